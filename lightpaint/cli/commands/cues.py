"""The cues of `lightpaint export --to cues`: of answers, and of the looks of a session."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.arrays import Position
from lightpaint.cli.commands import console_commands
from lightpaint.cli.options.console_options import RigFile
from lightpaint.dmx.console_rig import ConsoleRig
from lightpaint.dmx.pan_tilt import aimed_rig, directions_of
from lightpaint.errors import LightingError
from lightpaint.paint import SESSION_FILE, read_kept_looks
from lightpaint.relit.export.level_table import Cue, cue_list_csv
from lightpaint.scene.properties.site import unit


def is_session(path: Path) -> bool:
    """Return whether a path is the session of a painter, or the folder that it is in."""
    return path.suffix == Path(SESSION_FILE).suffix or (path / SESSION_FILE).is_file()


def cue_list(
    sources: Sequence[Path], rig: RigFile, *, fade_s: float, positions: bool
) -> tuple[str, list[str]]:
    """Return the table of a cue for each lighting and each look of a session, in their order, and
    what fixtures cannot do.

    positions: whether pan and tilt follow. Raises LightingError for what has no drives, PaintError
    for what is not a session, RigError for what does not fit the rig.
    """
    fixtures = console_commands.read_rig_file(rig)
    cues = []
    for path in sources:
        cues += (
            _cues_of_session(path, fixtures, fade_s=fade_s)
            if is_session(path)
            else [_cue_of_lighting(path, fade_s=fade_s)]
        )
    if not positions:
        cues = [Cue(x.label, x.fade_s, x.drives) for x in cues]
    remarks = [r for x in cues if x.directions for r in aimed_rig(fixtures, x.directions)[1]]
    return cue_list_csv(fixtures, cues), [*dict.fromkeys(remarks)]


def _cue_of_lighting(path: Path, *, fade_s: float) -> Cue:
    lighting, drives = console_commands.read_answer(path)
    return Cue(_label_of(path), fade_s, drives, directions_of(lighting))


def _cues_of_session(path: Path, rig: ConsoleRig, *, fade_s: float) -> list[Cue]:
    """Return a cue for each look of a session."""
    file = path / SESSION_FILE if path.is_dir() else path
    looks = read_kept_looks(file)
    if not looks:
        raise LightingError(f"{file} has no looks: keep some in the painter, one for each cue")
    cues = []
    for look in looks:
        if look.drives is None:
            raise LightingError(
                f"{file} has no drives of the look {look.name!r}: open it in the painter once, "
                "with lights that have emitters"
            )
        placed = look.requests.placed
        cues.append(Cue(look.name, fade_s, look.drives, _directions(placed, rig)))
    return cues


def _directions(placed: Mapping[str, Mapping[str, Any]], rig: ConsoleRig) -> dict[str, Position]:
    """Return where lights that were moved point; others point as in the show."""
    lights = {light.name: light for fixture in rig.fixtures for light in fixture.lights}
    found = {}
    for name, pose in placed.items():
        if name in lights and pose.get("target") is not None:
            way = np.subtract(pose["target"], pose.get("position") or lights[name].position)
            if np.linalg.norm(way) > 0:
                found[name] = unit(way)
    return found


def _label_of(lighting: Path) -> str:
    """Return the name of a look: its file's, or its folder's where all files are called alike."""
    path = lighting.absolute()
    return path.parent.name if path.stem == "lighting" else path.stem
