"""Drives of all lights of a rig: from an answer, checked against a rig, and on their way."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

from lightpaint.display_text import some_names
from lightpaint.dmx.console_rig import ConsoleRig, filter_drive
from lightpaint.dmx.levels import Drives
from lightpaint.errors import RigError
from lightpaint.lighting.answer.lighting import Lighting, LightSetting

#: Drives of emitters, by light.
RigDrives = Mapping[str, Drives]

#: Rounding of a drive beyond 0 and 1, in which answers are solved.
ROUNDING = 1e-6


def drives_of(lighting: Lighting) -> dict[str, Drives]:
    """Return the drives of all lights that have emitters, with that of a colour wheel in front of
    them.
    """
    return {
        light.name: {**light.drives, **_wheel_drive(light)}
        for light in lighting.lights
        if light.drives
    }


def _wheel_drive(light: LightSetting) -> Drives:
    behind = "" if light.lamp is None else light.lamp.behind
    return {filter_drive(behind): 1.0} if behind else {}


def check_drives(rig: ConsoleRig, drives: RigDrives) -> None:
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


def check_lamps(rig: ConsoleRig, lamps: Mapping[str, Collection[str]]) -> None:
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
