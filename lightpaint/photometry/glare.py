"""Discomfort glare: the Unified Glare Rating of CIE 117:1995, of any weights of the lights.

    UGR = 8 lg (0.25 / L_b · Σ L² ω / p²)

L is the luminance of a source of light as an observer sees it in cd/m², ω the solid angle that it
fills in sr, and p its position index. The background luminance L_b is the vertical illuminance at
the eye without the direct light of the sources, divided by π.

L is linear in the weights, and so is L_b, which alone has noise.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices, Position
from lightpaint.display_text import some_names
from lightpaint.photometry.illuminance import Illuminance, PlaneReading

#: Rise of the rating with the natural logarithm of what it is the logarithm of.
PER_E_FOLD = 8 / math.log(10)

#: Solid angles in sr of the sources that the rating is made for (CIE 117:1995).
LEAST_ANGLE, LARGEST_ANGLE = 3e-4, 0.1

#: Share of the sum from which on a source decides the rating.
DECISIVE = 0.5

#: Least rating that means some glare; below it, no value is stated.
LEAST_RATING = 10.0

#: Distance from the line of sight, relative to the distance along it, from which on a source below
#: it counts less, and both factors of that distance.
BELOW_NEAR, BELOW_FACTORS = 0.6, (0.8, 1.2)


@dataclass(frozen=True)
class GlareObserver:
    """Eyes from which glare is judged.

    place: in scene units. ahead, up: unit vectors, the line of sight and, perpendicular to it, the
    upper side of what is seen.
    """

    name: str
    place: Position
    ahead: Position
    up: Position


@dataclass(frozen=True)
class GlareReading:
    """The glare that an observer sees.

    rating: the UGR; None if it is unknown, for the `reason`. error: its standard error.
    interval: half of its 95 % interval. background: L_b in cd/m². strongest: the source that
    counts most, "" without one; solid_angle: what it fills, in sr; share: its part of the sum.
    """

    rating: float | None
    error: float
    interval: float
    background: float
    strongest: str = ""
    solid_angle: float = 0.0
    share: float = 0.0
    reason: str = ""

    @property
    def is_of_unusual_size(self) -> bool:
        """True if a source decides the rating that is smaller or larger than it is made for."""
        return self.share > DECISIVE and not LEAST_ANGLE <= self.solid_angle <= LARGEST_ANGLE


@dataclass(frozen=True)
class GlareSources:
    """Light of s sources as o observers see it, of each at an emission of 1.

    names: (s,). luminance: (o, s, 3), cd/m² per channel, the mean over what is seen of it; of one
    without a known size its light at the eye, in any unit. solid_angle: (o, s), sr. spread: (o, s),
    ω / p² in sr. is_sizeless: (o, s), whether its size is unknown.
    of_source, of_light, factor: (r,), (r,), (r, 3), the parts of which each source's emission is
    the sum: source, light, and emission per unit weight.
    """

    names: tuple[str, ...]
    luminance: Doubles
    solid_angle: Doubles
    spread: Doubles
    is_sizeless: Bools
    of_source: Indices
    of_light: Indices
    factor: Doubles

    def lit(self, weights: Doubles) -> Doubles:
        """Return the luminance of all sources, (o, s). weights: (n, 3)."""
        emission = np.zeros((len(self.names), 3))
        np.add.at(emission, self.of_source, self.factor * weights[self.of_light])
        return np.asarray(np.einsum("osc,sc->os", self.luminance, emission))


@dataclass(frozen=True)
class Glare:
    """The glare that observers see, as a function of the weights of the lights.

    sources: of which the observers see the light directly. background: the illuminance at their
    eyes without that; each observer is a plane of equal points, whose differences are noise.
    """

    observers: tuple[GlareObserver, ...]
    sources: GlareSources
    background: Illuminance

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the observers."""
        return tuple(x.name for x in self.observers)

    def readings(self, weights: Doubles) -> Mapping[str, GlareReading]:
        """Return the glare by observer. weights: (n, 3)."""
        luminance = self.sources.lit(weights)
        parts = np.where(self.sources.is_sizeless, 0.0, luminance**2 * self.sources.spread)
        return {
            name: self._reading(k, luminance[k], parts[k], self.background.reading(name, weights))
            for k, name in enumerate(self.names)
        }

    def _reading(
        self, observer: int, luminance: Doubles, parts: Doubles, eye: PlaneReading
    ) -> GlareReading:
        """Return the glare of one observer. luminance, parts: (s,), L and L² ω / p²."""
        names, background = np.array(self.sources.names, object), eye.mean / math.pi
        unknown = names[self.sources.is_sizeless[observer] & (luminance > 0)]
        reason = ""
        if len(unknown):
            reason = f"{some_names(unknown)} in sight, of no known size"
        elif not parts.any():
            reason = "no lamp is in sight"
        elif not background > 0:
            reason = "no light reaches the eye but from the lamps"
        if reason:
            return GlareReading(None, 0.0, 0.0, max(background, 0.0), reason=reason)
        k, total = int(parts.argmax()), float(parts.sum())
        return GlareReading(
            8 * math.log10(0.25 / background * total),
            PER_E_FOLD * eye.mean_error / eye.mean,
            PER_E_FOLD * eye.relative_interval,
            background,
            str(names[k]),
            float(self.sources.solid_angle[observer, k]),
            float(parts[k]) / total,
        )


def position_index(directions: Doubles, ahead: Position, up: Position) -> Doubles:
    """Return Guth's position index p (...) of directions (..., 3), unit vectors from the eye.

    Above the line of sight it is Levin's formula (Journal of the IES 4, 1975) for the table that
    CIE 117:1995 prints. That table ends at the line of sight. Below it counts the model of Iwata
    and Tokura (1998), as in Radiance's evalglare.

    ahead, up: unit vectors, perpendicular to each other.
    """
    right = np.cross(ahead, up)
    distance, aside, height = (directions @ np.asarray(x, float) for x in (ahead, right, up))
    from_axis = np.hypot(aside, height)
    sigma = np.degrees(np.arctan2(from_axis, distance))
    tau = np.degrees(np.arctan2(np.abs(aside), np.maximum(height, 0.0)))
    above = np.exp(
        (35.2 - 0.31889 * tau - 1.22 * np.exp(-2 * tau / 9)) * 1e-3 * sigma
        + (21 + 0.26667 * tau - 0.002963 * tau**2) * 1e-5 * sigma**2
    )
    ratio = from_axis / np.maximum(distance, 1e-9)
    below = 1 + np.where(ratio < BELOW_NEAR, *BELOW_FACTORS) * ratio
    return np.asarray(np.where(height >= 0, above, below))
