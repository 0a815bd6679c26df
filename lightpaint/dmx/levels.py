"""Levels of channels from the drives of lights, and back.

A drive is the share of an emitter's light at full, 0 to 1. A light's first dimmer carries its
largest drive and its emitters the others relative to that, as on a console; so small drives keep
the resolution of the emitters' channels. Its further dimmers are at full, all else is at rest.
"""

from collections.abc import Mapping

import numpy as np

from lightpaint.dmx.console_rig import (
    UNIVERSE_SIZE,
    ConsoleRig,
    DmxChannel,
    RigEmitter,
    RigFixture,
    RigLight,
)

#: Drives by name of emitter.
Drives = Mapping[str, float]


def encode_levels(rig: ConsoleRig, drives: Mapping[str, Drives]) -> dict[int, bytes]:
    """Return the 512 bytes of each universe of a rig.

    drives: by name of light; a light without any, and each emitter without one, is at 0.
    """
    universes = {universe: bytearray(UNIVERSE_SIZE) for universe in rig.universes}
    for fixture in rig.fixtures:
        levels = {k: channel.default for k, channel in enumerate(fixture.channels)}
        for light in fixture.lights:
            levels |= _levels_of(fixture, light, drives.get(light.name, {}))
        for k, level in levels.items():
            _write(universes, fixture, fixture.channels[k], level)
    return {universe: bytes(levels) for universe, levels in universes.items()}


def decode_levels(rig: ConsoleRig, universes: Mapping[int, bytes]) -> dict[str, dict[str, float]]:
    """Return the drives of each light, by its name and those of its emitters, that levels mean.

    universes: 512 bytes each; one that is missing is all at 0.
    """
    return {
        light.name: _drives_of(fixture, light, universes)
        for fixture in rig.fixtures
        for light in fixture.lights
    }


def _levels_of(fixture: RigFixture, light: RigLight, drives: Drives) -> dict[int, int]:
    """Return the levels of the channels of a light, by their places among the fixture's."""
    channels = fixture.channels
    dimmer = max((drives.get(x.name, 0.0) for x in light.emitters), default=0.0)
    top = dimmer if light.dimmers else 1.0
    levels = {k: channels[k].highest for k in light.dimmers[1:]}
    levels |= {k: _rounded(dimmer, channels[k]) for k in light.dimmers[:1]}
    if light.dimmers and levels[light.dimmers[0]]:
        # The emitters make up for the rounding of the dimmer.
        top = levels[light.dimmers[0]] / channels[light.dimmers[0]].highest
    for emitter in light.emitters:
        share = min(drives.get(emitter.name, 0.0) / top, 1.0) if top else 0.0
        levels |= {
            k: _rounded(_channel_share(emitter, share), channels[k]) for k in emitter.channels
        }
    return levels


def _drives_of(
    fixture: RigFixture, light: RigLight, universes: Mapping[int, bytes]
) -> dict[str, float]:
    shares = {
        k: _read(universes, fixture, fixture.channels[k]) / fixture.channels[k].highest
        for k in {*light.dimmers, *(k for x in light.emitters for k in x.channels)}
    }
    dimmer = float(np.prod([shares[k] for k in light.dimmers]))
    return {
        x.name: dimmer * _light_share(x, float(np.mean([shares[k] for k in x.channels] or [1.0])))
        for x in light.emitters
    }


def _rounded(share: float, channel: DmxChannel) -> int:
    return round(min(max(share, 0.0), 1.0) * channel.highest)


def _channel_share(emitter: RigEmitter, light: float) -> float:
    """Return the share of a channel's highest level that gives a share of light."""
    if not emitter.curve:
        return light
    levels, lights = zip(*emitter.curve, strict=True)
    return float(np.interp(light, lights, levels))


def _light_share(emitter: RigEmitter, level: float) -> float:
    """Return the share of light that a share of a channel's highest level gives."""
    if not emitter.curve:
        return level
    levels, lights = zip(*emitter.curve, strict=True)
    return float(np.interp(level, levels, lights))


def _write(
    universes: Mapping[int, bytearray], fixture: RigFixture, channel: DmxChannel, level: int
) -> None:
    values = level.to_bytes(len(channel.offsets), "big")
    for (universe, index), value in zip(fixture.places(channel), values, strict=True):
        universes[universe][index] = value


def _read(universes: Mapping[int, bytes], fixture: RigFixture, channel: DmxChannel) -> int:
    values = [
        universes[universe][index] if universe in universes else 0
        for universe, index in fixture.places(channel)
    ]
    return int.from_bytes(bytes(values), "big")
