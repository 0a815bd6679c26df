"""Renders of Mitsuba's own integrators with spectra: what the film records, and which wavelengths
are sampled.

By itself Mitsuba samples wavelengths as the eye sees them. Of a narrow LED most samples then see
nothing: the noise is some five times the noise of RGB. But a `specfilm` samples them by the sum of
its channels. So it gets a channel for each curve of the observer, and one more, whose values are
not used: the light of the scene's emitters.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.colour import Observer

#: Wavelengths of the channels in nm.
WAVES = np.arange(380, 781, dtype=np.float64)

#: Share of the samples whose wavelengths are those that the observer sees, whatever lamps emit.
EVEN_SHARE = 0.25


@dataclass(frozen=True)
class Bands:
    """The bands that a film records: integrals of radiance over the curves of an observer.

    curves: (401, 3) at WAVES, >= 0. emitted: (401,), the density with which other wavelengths are
    sampled as well; 0 if the curves suffice.
    """

    curves: Doubles
    emitted: Doubles

    def channels(self) -> dict[str, Any]:
        """Return the channels of Mitsuba's film: the channels of the observer come first."""
        columns = [x for x in (*self.curves.T, self.emitted) if x.any()]
        return {
            f"channel_{k}": {
                "type": "regular",
                "wavelength_min": WAVES[0],
                "wavelength_max": WAVES[-1],
                "values": ",".join(f"{x:.7g}" for x in column),
            }
            for k, column in enumerate(columns)
        }


def bands_of(state: Any, emissions: Iterable[tuple[int, str]], observer: Observer) -> Bands:
    """Return the bands of renders of a scene.

    state: its nodes, from Mitsuba's parser. emissions: node and parameter of the emission of its
    emitters.
    """
    curves = observer.curves(WAVES)
    seen, emitted = np.linalg.norm(observer.response(WAVES), axis=1), np.zeros(len(WAVES))
    for power in _spectra(state, emissions):
        contributed = power * seen
        if total := contributed.sum():
            emitted += contributed / total
    if total := emitted.sum():
        emitted *= (1 / EVEN_SHARE - 1) * curves.sum() / total
    return Bands(curves, emitted)


def _spectra(state: Any, emissions: Iterable[tuple[int, str]]) -> Iterator[Doubles]:
    """Yield the power at WAVES of each emitter; the power of RGB counts as even."""
    import mitsuba as mi

    for node, parameter in emissions:
        props = state.nodes[node].props
        if parameter not in props or props.type(parameter) != mi.Properties.Type.Spectrum:
            yield np.ones(len(WAVES))
            continue
        spectrum = props[parameter]
        waves, values = np.array(spectrum.wavelengths), np.array(spectrum.values)
        if len(waves) > 1:
            yield np.maximum(np.interp(WAVES, waves, values, left=0, right=0), 0)


def as_seen(image: Floats, observer: Observer) -> Floats:
    """Return what a film of `Bands` recorded, (h, w, 3 or 4), as linear Rec.709 (h, w, 3)."""
    import mitsuba as mi

    matrix = mi.MI_CIE_Y_NORMALIZATION * observer.matrix
    return np.asarray(image[..., :3] @ matrix.T.astype(np.float32))
