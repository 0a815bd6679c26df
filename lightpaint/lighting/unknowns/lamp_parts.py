"""Lamps whose emitters have a picture each, as in a basis of spectra; and the power of lamps: of
each unknown that drives their emitters, and of lamps that stay.

Constraints speak of lamps. So the unknowns are first the unknowns of lamps, with an emission in
RGB; then each unknown moves the weights of the pictures of the lamp's emitters instead.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np

from lightpaint.arrays import Doubles, as_rgb
from lightpaint.basis import BasisLight
from lightpaint.colour import Lamp, luminance
from lightpaint.display_text import some_names
from lightpaint.errors import ConstraintError
from lightpaint.lighting.unknowns.knobs import Knob, Unknown


def watts_of_unknowns(knobs: Sequence[Knob], lamps: Mapping[int, Lamp]) -> Doubles:
    """Return the power, (k,), of each x at 1; 0 for the power of lights of unknown power."""
    powers = list[float]()
    for knob in knobs:
        lamp = lamps.get(knob.lights[0]) if len(knob.lights) == 1 else None
        if lamp is not None and knob.has_drives_of(lamp):
            powers += [x.watts or 0.0 for x in lamp.emitters]
            continue
        for unknown in knob.unknowns:
            members = ((lamps.get(light), rgb) for light, rgb in unknown.columns)
            powers.append(sum(_watts_per_level(lamp, rgb) for lamp, rgb in members if lamp))
    return np.array(powers)


def watts_of(weights: Doubles, lamps: Mapping[int, Lamp]) -> float:
    """Return the power of lamps at weights (n, 3) of all lights, in watts."""
    return sum(lamp.watts_for(weights[light]) or 0.0 for light, lamp in lamps.items())


def _watts_per_level(lamp: Lamp, color: Doubles) -> float:
    """Return the power of a colour (3,), as if the lamp were as bright as it needs."""
    level = lamp.brightest(color)
    return 0.0 if level == 0 else (lamp.watts_for(level * color) or 0.0) / level


@dataclass(frozen=True)
class WholeLamps:
    """Lights in which the emitters of a lamp are one light. parts: their indices, by light."""

    lights: tuple[BasisLight, ...]
    parts: tuple[tuple[int, ...], ...]

    @classmethod
    def of(cls, lights: Sequence[BasisLight]) -> "WholeLamps":
        """Make them of the lights of a basis."""
        groups = groupby(range(len(lights)), key=lambda k: lights[k].lamp or lights[k].name)
        parts = tuple(tuple(indices) for _, indices in groups)
        return cls(tuple(_whole([lights[k] for k in places]) for places in parts), parts)

    @property
    def has_parts(self) -> bool:
        """True if some light is an emitter of a lamp."""
        return any(light.lamp for light in self.lights)

    def check_emitters(self, lights: Sequence[BasisLight], lamps: Mapping[int, Lamp]) -> None:
        """Raise ConstraintError if a lamp has other emitters than those whose pictures there are.

        lights: of which these are. lamps: by the index of the whole light.
        """
        for k, lamp in lamps.items():
            own = self.lights[k]
            if not own.lamp:
                continue
            rendered = [lights[i].name.removeprefix(f"{own.name}/") for i in self.parts[k]]
            if rendered != list(lamp.names):
                raise ConstraintError(
                    f"light {own.name!r} has the emitters {some_names(lamp.names)}, and was "
                    f"rendered with {some_names(rendered)}: give it those in the lights file, and "
                    "render again"
                )

    def weights(self, k: int, lamp: Lamp | None, emission: Doubles) -> Doubles:
        """Return the weights (parts, 3) at which light k has an emission (3,)."""
        if lamp is None or not self.lights[k].lamp:
            return emission[None]
        levels = lamp.drives_for(emission) * lamp.levels if emission.any() else 0 * lamp.levels
        return np.repeat(levels[:, None], 3, axis=1)

    def knobs(self, knob: Knob, lamps: dict[int, Lamp]) -> tuple[Knob, ...]:
        """Return a knob of lights as knobs of their parts."""
        places = tuple(part for k in knob.lights for part in self.parts[k])
        if not any(self.lights[k].lamp for k in knob.lights):
            [single] = [replace(knob, lights=places, unknowns=self._moved(knob.unknowns))]
            return (single,)
        if knob.whites is not None:
            raise ConstraintError(
                f"light {self.lights[knob.lights[0]].name!r} has a range of kelvin, and where each "
                "emitter has a picture a lamp has one white or any colour: give one temperature, "
                "or leave it out"
            )
        lamp = lamps.get(knob.lights[0])
        if lamp is None or not knob.has_drives_of(lamp):
            mixes = tuple(self._of_parts(x, lamps) for x in knob.unknowns)
            return (replace(knob, lights=places, unknowns=mixes),)
        unknowns = tuple(
            replace(x, columns=((part, np.full(3, level)),))
            for x, part, level in zip(knob.unknowns, places, lamp.levels, strict=True)
        )
        if knob.limit is None and knob.wheel is None:
            return tuple(Knob((k,), (x,)) for k, x in zip(places, unknowns, strict=True))
        return (replace(knob, lights=places, unknowns=unknowns),)

    def _moved(self, unknowns: Sequence[Unknown]) -> tuple[Unknown, ...]:
        """Return unknowns of whole lights with the indices of these among the parts."""
        return tuple(
            replace(x, columns=tuple((self.parts[k][0], rgb) for k, rgb in x.columns))
            for x in unknowns
        )

    def _of_parts(self, unknown: Unknown, lamps: dict[int, Lamp]) -> Unknown:
        """Return an unknown of whole lights by the drives that mix its colours at full."""
        columns, upper = list[tuple[int, Doubles]](), unknown.upper
        for k, color in unknown.columns:
            if (lamp := lamps.get(k)) is None:
                weights = self.weights(k, lamp, color)
            else:
                drives, brightest = lamp.brightest_mix(color)
                weights = np.repeat((drives * lamp.levels / brightest)[:, None], 3, axis=1)
                upper = min(upper, brightest)
            columns += zip(self.parts[k], weights, strict=True)
        return replace(unknown, columns=tuple(columns), upper=max(upper, unknown.lower))


def part_lamps(lamp: Lamp) -> list[Lamp]:
    """Return a lamp for each emitter, whose emission has its luminance in each channel.

    Its share of power is what the lamp leaves it while the others are off.
    """
    share = lamp.power_share
    shares = [None if share is None else share / x for x in lamp.powers.tolist()]
    return [
        replace(lamp, emitters=(replace(x, emission=as_rgb(np.full(3, level))),), power_share=own)
        for x, level, own in zip(lamp.emitters, lamp.levels, shares, strict=True)
    ]


def emission_of_parts(parts: Sequence[BasisLight], lamp: Lamp) -> Doubles:
    """Return the emission (3,) of a lamp whose emitters are at the emissions of `parts`."""
    drives = np.array([x.emission[0] for x in parts]) / lamp.levels
    return lamp.mix(drives)


def _whole(parts: Sequence[BasisLight]) -> BasisLight:
    """Return the light that emitters form. It is grey until its lamp is known."""
    first = parts[0]
    if not first.lamp:
        return first
    level = sum(float(luminance(np.array(x.emission))) for x in parts)
    return replace(
        first, name=first.lamp, emission=(level, level, level), is_scalar=False, identity=""
    )
