"""Levels of channels from the drives of lights, and back; also of lights that mix a colour by
filters, or by naming it.

A drive is the share of an emitter's light at full, 0 to 1. A light's first dimmer carries its
largest drive and its emitters the others relative to that, as on a console; so small drives keep
the resolution of the emitters' channels. Its further dimmers are at full, all else is at rest. A
colour wheel goes to the slot of the largest drive, which the dimmer carries; one in front of
emitters that mix has drives of its own, such as `wheel congo`.

Emitters of lights with filters, or with x and y, are red, green and blue of Rec.709, which add up
to all their light. A drive is the share of that light which is left. Emitters of lights with a
colour temperature are the two ends of its range; between them light is taken to change evenly.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.colour import REC709, cct_and_duv, rgb_to_xyz
from lightpaint.display_text import some_names
from lightpaint.dmx import console_rig
from lightpaint.errors import RigError
from lightpaint.lighting import Lighting, LightSetting

#: Least share of light that counts as more than none.
_DARK = 1e-6

#: Steps between two whites.
WHITE_STEPS = 65

#: Condition number up to which three filters set red, green and blue.
MAX_CONDITION = 50.0

#: Drives by name of emitter.
Drives = Mapping[str, float]

#: Drives of emitters, by light.
RigDrives = Mapping[str, Drives]

#: Rounding of a drive beyond 0 and 1, in which answers are solved.
ROUNDING = 1e-6


def can_invert(densities: Sequence[Sequence[float]]) -> bool:
    """Return whether three filters, by their densities for red, green and blue, set all colours."""
    return float(np.linalg.cond(np.array(densities, float))) <= MAX_CONDITION


def filters_for_drives(
    light: console_rig.RigLight, drives: Sequence[float]
) -> tuple[float, list[float]]:
    """Return the dimmer, and how far in each filter is, 0 to 1, for drives of red, green and blue.

    Densities add: −log d = A t + δ, where a column of A is the density of a filter, t how far it
    is in, and e^−δ the dimmer. The dimmer dims as much as it can, so that the filters are out as
    far as they can be. Drives that they cannot reach are clipped.
    """
    density = _densities(light)
    largest = max(drives)
    if largest <= _DARK:
        return 0.0, [0.0] * 3 if light.dimmers else [1.0] * 3
    deepest = density.sum(axis=1) - np.log(largest)
    wanted = np.minimum(-np.log(np.maximum(drives, _DARK)), deepest)
    places, slope = np.linalg.solve(density, wanted), np.linalg.solve(density, np.ones(3))
    dimmed = 0.0
    if light.dimmers:
        limits = [t / s for t, s in zip(places, slope, strict=True) if s > 0]
        dimmed = min(max(min(limits, default=0.0), 0.0), -float(np.log(largest)))
    return float(np.exp(-dimmed)), np.clip(places - dimmed * slope, 0, 1).tolist()


def drives_of_filters(
    light: console_rig.RigLight, dimmer: float, places: Sequence[float]
) -> list[float]:
    """Return the drives of red, green and blue behind filters that are so far in."""
    return [float(x) for x in dimmer * np.exp(-_densities(light) @ np.array(places))]


def _densities(light: console_rig.RigLight) -> Doubles:
    return np.array([x.density for x in light.filters], float).T


def xy_for_drives(
    light: console_rig.RigLight, drives: Sequence[float]
) -> tuple[float, list[float]]:
    """Return the luminance relative to full, and x and y, for drives of red, green and blue.

    Dark light keeps the x and y of all its emitters.
    """
    columns = _tristimulus(light)
    level = float(columns[1] @ drives / columns[1].sum())
    xyz = columns @ (drives if level > _DARK else np.ones(3))
    return level, (xyz[:2] / xyz.sum()).tolist()


def drives_of_xy(light: console_rig.RigLight, level: float, xy: Sequence[float]) -> list[float]:
    """Return the drives of red, green and blue for a luminance relative to full, and x and y.

    Colours outside Rec.709 are clipped.
    """
    columns, (x, y) = _tristimulus(light), xy
    if level <= _DARK or y <= 0:
        return [0.0] * 3
    xyz = level * columns[1].sum() * np.array([x / y, 1.0, (1 - x - y) / y])
    return [float(d) for d in np.clip(np.linalg.solve(columns, xyz), 0.0, 1.0)]


def white_for_drives(light: console_rig.RigLight, drives: Sequence[float]) -> tuple[float, float]:
    """Return the dimmer and the colour temperature in kelvin for drives of both whites.

    Two whites mix a colour on the line between them, which is a little more purple than the black
    body of its temperature. Drives of more than 1 together are clipped.
    """
    level, (shares, kelvins) = sum(drives), _whites(light)
    if level <= _DARK:
        return 0.0, float(kelvins[0])
    return min(level, 1.0), float(np.interp(drives[1] / level, shares, kelvins))


def drives_of_white(light: console_rig.RigLight, level: float, kelvin: float) -> list[float]:
    """Return the drives of both whites for a dimmer and a colour temperature."""
    shares, kelvins = _whites(light)
    share = float(np.interp(kelvin, kelvins[::-1], shares[::-1]))
    return [level * (1 - share), level * share]


@lru_cache(256)
def _whites(light: console_rig.RigLight) -> tuple[Doubles, Doubles]:
    """Return shares of the warmer white, rising, and kelvin of their mixes, falling, (k,)."""
    shares, (cool, warm) = np.linspace(0.0, 1.0, WHITE_STEPS), _tristimulus(light).T
    mixes = cool + shares[:, None] * (warm - cool)
    known = [cct_and_duv(rgb) for rgb in np.linalg.solve(rgb_to_xyz(REC709), mixes.T).T]
    assert None not in known  # both are whites, and what lies between them is nearly one
    kelvins = np.array([x[0] for x in known if x is not None])
    return shares, np.minimum.accumulate(kelvins)


def _tristimulus(light: console_rig.RigLight) -> Doubles:
    """Return X, Y and Z of each emitter at full, (3, e), relative to one candela."""
    columns = []
    for emitter in light.emitters:
        x, y = emitter.xy
        columns.append(emitter.candela * np.array([x / y, 1.0, (1 - x - y) / y]))
    return np.array(columns).T


def encode_levels(rig: console_rig.ConsoleRig, drives: Mapping[str, Drives]) -> dict[int, bytes]:
    """Return the 512 bytes of each universe of a rig.

    drives: by name of light; a light without any, and each emitter without one, is at 0.
    """
    universes = {universe: bytearray(levels) for universe, levels in rig.rest.items()}
    for fixture in rig.fixtures:
        for light in fixture.lights:
            levels = _levels_of(fixture, light, drives.get(light.name, {}))
            for k, level in levels.items():
                fixture.set_level(universes, fixture.channels[k], level)
    return {universe: bytes(levels) for universe, levels in universes.items()}


def decode_levels(
    rig: console_rig.ConsoleRig, universes: Mapping[int, bytes]
) -> dict[str, dict[str, float]]:
    """Return the drives of each light, by its name and the names of its emitters, that levels mean.

    universes: 512 bytes each; one that is missing is all at 0.
    """
    return {
        light.name: _drives_of(fixture, light, universes)
        for fixture in rig.fixtures
        for light in fixture.lights
    }


def _levels_of(
    fixture: console_rig.RigFixture, light: console_rig.RigLight, drives: Drives
) -> dict[int, int]:
    """Return the levels of the channels of a light, by their places among the fixture's."""
    if not light.is_controlled:
        return {}
    return _mixing_levels(fixture, light, drives) | _filter_levels(fixture, light, drives)


def _filter_levels(
    fixture: console_rig.RigFixture, light: console_rig.RigLight, drives: Drives
) -> dict[int, int]:
    """Return the levels of colour wheels in front of what a light mixes: at the slots whose drive
    is largest, or open.
    """
    wheel = light.wheel
    if wheel is None or not wheel.filters:
        return {}
    wanted = [drives.get(name, 0.0) for name in wheel.filter_drives]
    defaults = [fixture.channels[k].default for k in wheel.channels]
    slots = wheel.slots[int(np.argmax(wanted))]
    return {
        # A wheel that rests in its slot stays as it is.
        k: default if slot.first <= default <= slot.last else slot.level
        for k, slot, default in zip(wheel.channels, slots, defaults, strict=True)
    }


def _mixing_levels(
    fixture: console_rig.RigFixture, light: console_rig.RigLight, drives: Drives
) -> dict[int, int]:
    """Return the levels of dimmers, and of what mixes or chooses the colour."""
    channels = fixture.channels
    levels = {k: _level(1.0, channels[k]) for k in (*light.dimmers[1:], *light.masters)}
    wanted = [min(max(drives.get(x.name, 0.0), 0.0), 1.0) for x in light.emitters]
    if light.filters:
        dimmer, places = filters_for_drives(light, wanted)
        for filter_, place in zip(light.filters, places, strict=True):
            levels |= {k: _level(place, channels[k]) for k in filter_.channels}
        return levels | {k: _level(dimmer, channels[k]) for k in light.dimmers[:1]}
    if light.chromaticity:
        dimmer, xy = xy_for_drives(light, wanted)
        levels |= {k: _level(v, channels[k]) for k, v in zip(light.chromaticity, xy, strict=True)}
        return levels | {k: _level(dimmer, channels[k]) for k in light.dimmers[:1]}
    if light.whites:
        dimmer, kelvin = white_for_drives(light, wanted)
        levels |= {k: _level(kelvin, channels[k]) for k in light.whites}
        return levels | {k: _level(dimmer, channels[k]) for k in light.dimmers[:1]}
    if light.wheel is not None and not light.wheel.filters:
        slot = int(np.argmax(wanted))
        if wanted[slot]:  # a dark wheel rests
            turned = zip(light.wheel.channels, light.wheel.slots[slot], strict=True)
            levels |= {k: x.level for k, x in turned}
        return levels | {k: _level(wanted[slot], channels[k]) for k in light.dimmers[:1]}
    top = 1.0
    for k in light.dimmers[:1]:
        # Emitters make up for a dimmer that is rounded up; they could not for one rounded down.
        levels[k] = _level_of_at_least(max(wanted, default=0.0), channels[k])
        top = _share(levels[k], channels[k])
    for emitter, drive in zip(light.emitters, wanted, strict=True):
        share = min(drive / top, 1.0) if top > 0 else 0.0
        controlled = _inverse(emitter.curve, share)
        levels |= {k: _level(controlled, channels[k]) for k in emitter.channels}
    return levels


def _drives_of(
    fixture: console_rig.RigFixture, light: console_rig.RigLight, universes: Mapping[int, bytes]
) -> dict[str, float]:
    channels = fixture.channels

    def share(k: int) -> float:
        return _share(_read(universes, fixture, channels[k]), channels[k])

    def mean(places: Sequence[int]) -> float:
        return float(np.mean([share(k) for k in places] or [1.0]))

    names = [x.name for x in light.emitters]
    if not light.is_controlled:
        return dict.fromkeys(names, 0.0)
    dimmer = float(np.prod([share(k) for k in (*light.dimmers, *light.masters)]))
    if light.filters:
        found = drives_of_filters(light, dimmer, [mean(x.channels) for x in light.filters])
    elif light.chromaticity:
        found = drives_of_xy(light, dimmer, [share(k) for k in light.chromaticity])
    elif light.whites:
        found = drives_of_white(light, dimmer, mean(light.whites))
    elif light.wheel is not None and not light.wheel.filters:
        found = [dimmer * is_shown for is_shown in _shown_slots(fixture, light.wheel, universes)]
    else:
        found = [dimmer * _forward(x.curve, mean(x.channels)) for x in light.emitters]
    drives = dict(zip(names, found, strict=True))
    if light.wheel is not None and light.wheel.filters:
        shown = _shown_slots(fixture, light.wheel, universes)
        pairs = zip(light.wheel.filter_drives, shown, strict=True)
        drives |= {name: 1.0 for name, is_shown in pairs if is_shown}
    return drives


def _shown_slots(
    fixture: console_rig.RigFixture, wheel: console_rig.RigWheel, universes: Mapping[int, bytes]
) -> list[bool]:
    """Return which combination of slots the levels of wheels mean; none while one is between."""
    levels = [_read(universes, fixture, fixture.channels[k]) for k in wheel.channels]
    return [
        all(x.first <= level <= x.last for x, level in zip(slots, levels, strict=True))
        for slots in wheel.slots
    ]


#: Pairs of a level and what it gives, which rises.
_Curve = Sequence[tuple[float, float]]


def _level(share: float, channel: console_rig.DmxChannel) -> int:
    """Return the level at which a channel gives a share of what it controls."""
    return round(min(max(_inverse(channel.curve, share), 0.0), 1.0) * channel.highest)


def _level_of_at_least(share: float, channel: console_rig.DmxChannel) -> int:
    """Return the level at which a channel gives a share of what it controls, or little more."""
    level = _level(share, channel)
    enough = [
        x
        for x in (level - 1, level, level + 1)
        if 0 <= x <= channel.highest and _share(x, channel) >= share
    ]
    return min(enough, key=lambda x: _share(x, channel), default=level)


def _share(level: int, channel: console_rig.DmxChannel) -> float:
    """Return the share of what a channel controls that a level gives."""
    return _forward(channel.curve, level / channel.highest)


def _inverse(curve: _Curve, share: float) -> float:
    if not curve:
        return share
    levels, shares = zip(*curve, strict=True)
    return float(np.interp(share, shares, levels))


def _forward(curve: _Curve, level: float) -> float:
    if not curve:
        return level
    # Levels fall where a channel is inverted.
    levels, shares = zip(*sorted(curve), strict=True)
    return float(np.interp(level, levels, shares))


def _read(
    universes: Mapping[int, bytes], fixture: console_rig.RigFixture, channel: console_rig.DmxChannel
) -> int:
    values = [
        universes[universe][index] if universe in universes else 0
        for universe, index in fixture.places(channel)
    ]
    return int.from_bytes(bytes(values), "big")


def drives_of(lighting: Lighting) -> dict[str, Drives]:
    """Return the drives of all lights that have emitters, with the drive of a colour wheel in front
    of them.
    """
    return {
        light.name: {**light.drives, **_wheel_drive(light)}
        for light in lighting.lights
        if light.drives
    }


def _wheel_drive(light: LightSetting) -> Drives:
    behind = "" if light.lamp is None else light.lamp.behind
    return {console_rig.filter_drive(behind): 1.0} if behind else {}


def check_drives(rig: console_rig.ConsoleRig, drives: RigDrives) -> None:
    """Raise RigError for a light or an emitter that a rig lacks, and for a drive beyond 0 and 1."""
    emitters = {
        light.name: {
            *(emitter.name for emitter in light.emitters),
            *(light.wheel.filter_drives if light.wheel else ()),
        }
        for fixture in rig.fixtures
        for light in fixture.lights
    }
    if unknown := [name for name in drives if name not in emitters]:
        raise RigError(
            f"{rig.name} has no light {some_names(unknown)}: it has "
            f"{some_names(emitters) or 'none'}; give the rig that the scene was made from"
        )
    for light, values in drives.items():
        if other := [name for name in values if name not in emitters[light]]:
            raise RigError(
                f"{light!r} of {rig.name} has no emitter {some_names(other)}: it has "
                f"{some_names(sorted(emitters[light])) or 'none'}"
            )
        for emitter, drive in values.items():
            if not -ROUNDING <= drive <= 1 + ROUNDING:
                raise RigError(f"{emitter!r} of {light!r} has the drive {drive:g}: expected 0 to 1")


def check_lamps(rig: console_rig.ConsoleRig, lamps: Mapping[str, Collection[str]]) -> None:
    """Raise RigError for lamps, the names of their emitters by light, that a rig lacks, and if
    there are none.
    """
    if not lamps:
        raise RigError(
            f"none of the lights has emitters, so that nothing could be sent to {rig.name}: paint "
            "in a scene that was made from it"
        )
    check_drives(rig, {light: dict.fromkeys(names, 0.0) for light, names in lamps.items()})


@dataclass(frozen=True)
class DriveFade:
    """The way from drives to others in a time: straight, so that light changes evenly.

    begin_s: when it begins, in seconds of any clock. duration_s: 0 for at once.
    """

    start: RigDrives
    end: RigDrives
    begin_s: float
    duration_s: float

    def at(self, now_s: float) -> RigDrives:
        """Return the drives at a time."""
        if self.is_over(now_s):
            return self.end
        share = max(now_s - self.begin_s, 0.0) / self.duration_s
        return {
            light: _between(self.start.get(light, {}), self.end.get(light, {}), share)
            for light in {**self.start, **self.end}
        }

    def is_over(self, now_s: float) -> bool:
        """Return True if a time is at its end or later."""
        return now_s >= self.begin_s + self.duration_s


def _between(start: Drives, end: Drives, share: float) -> Drives:
    return {
        name: (1 - share) * start.get(name, 0.0) + share * end.get(name, 0.0)
        for name in {**start, **end}
    }
