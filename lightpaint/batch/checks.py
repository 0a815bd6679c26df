"""What a table asks for, before files are read: what lacks, contradicts itself, is not there."""

from collections.abc import Mapping
from glob import glob, has_magic
from pathlib import Path
from typing import Any

from lightpaint.batch.keys import SOURCE, Handover, Mistakes
from lightpaint.batch.manifest import Manifest, subject
from lightpaint.errors import LightpaintError
from lightpaint.files import is_name
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.file import read_constraints
from lightpaint.relit.export.usd import check_usd
from lightpaint.relit.forms import FORMS
from lightpaint.screen import some_names
from lightpaint.settings import Settings
from lightpaint.sources import GroupsFile

#: What is wanted of a look if nobody says; of a lighting that is there already, and of a frame.
WANTED, SHOWN = ("solve", "predict", "verify", "report"), ("predict",)

#: What is there in the place of a scene, and is rendered already.
BASES = ("basis", "light_groups")

#: Keys of `Constraints.of`, as they stand in a lights file.
CONSTRAINED = ("light", "tie", "prefer_current", "sparse")


def check_together(mistakes: Mistakes, where: str, look: Mapping[str, Any]) -> None:
    """What is missing, or contradicts itself."""
    subjects = subject(look)
    if not subjects:
        mistakes.add(
            where, "nothing to show: give painting, paintings, views, lighting or lightings"
        )
    elif len(subjects) > 1:
        mistakes.add(where, f"{' and '.join(subjects)} at once: give one of them")
    given = [key for key in BASES if key in look]
    if "scene" not in look and not given:
        mistakes.add(where, "no scene and no basis: give one, here or in [defaults]")
    elif len(given) > 1 or ("scene" in look and "light_groups" in look):
        mistakes.add(where, "light_groups stand for scene and basis: give them alone")
    if "pattern" in look and "light_groups" not in look:
        mistakes.add(where, "pattern is of light_groups: leave it out, or give them")
    several = "views" in look or "sensors" in look
    if "sensor" in look and "sensors" in look:
        mistakes.add(where, "sensor and sensors at once: give one of them")
    elif "views" in look and ("sensor" in look or "sensors" in look):
        mistakes.add(where, "views name their sensors: leave sensor and sensors out")
    elif several and given:
        mistakes.add(where, "a basis has one view only: give the scene, to see it from several")
    elif "scene" not in look and given:
        _check_of_basis(mistakes, where, look)
    want = look.get("want", ())
    if ("lighting" in look or "lightings" in look) and (
        idle := [x for x in ("solve", "verify", "report", "lights") if x in want]
    ):
        mistakes.add(where, f"want has {idle[0]!r}, and its lighting is given: leave it out")
    elif "lights" in want:
        check_by_sums(mistakes, where, look)


def check_by_sums(mistakes: Mistakes, where: str, look: Mapping[str, Any]) -> None:
    """What goes with a lighting and nothing else."""
    if len(look["want"]) > 1:
        mistakes.add(where, "want has 'lights', which is the lighting alone: leave the rest out")
    if "views" in look or "variations" in look:
        mistakes.add(where, "want has 'lights', which is of one view, without variations")
    settings = look.get("settings", {})
    if settings.get("literal") is not True:
        mistakes.add(where, "want has 'lights': settings need literal = true, or images are needed")
    for key in ("time_s", "noise_correction", "refine", "suggest"):
        if settings.get(key):
            mistakes.add(where, f"want has 'lights', and {key} needs images: leave it out")


def _check_of_basis(mistakes: Mistakes, where: str, look: Mapping[str, Any]) -> None:
    """What a saved basis has no use of."""
    for step in ("verify", "render"):
        if step in look.get("want", ()):
            mistakes.add(where, f"want has {step!r}, which needs the scene: give scene = ...")
    if idle := [key for key in SOURCE if key in look and key not in (*BASES, "pattern")]:
        mistakes.add(where, f"{some_names(idle)} cannot change a saved basis: leave it out")


def check_wanted(mistakes: Mistakes, where: str, look: Mapping[str, Any]) -> None:
    """That a render or an export which is told of is wanted."""
    for step in ("render", "export"):
        if step in look and step not in look.get("want", ()):
            mistakes.add(where, f"[{step}] says how, and want does not have {step!r}: add it there")


def check_handover(mistakes: Mistakes, where: str, asked: Handover, entry: Any) -> None:
    """That a look has what other programs are told from. entry: one of its looks."""
    has_groups = isinstance(entry.basis, GroupsFile)
    for form in asked.to:
        if FORMS[form][has_groups] is None:
            needed = "light groups" if form == "nuke" else "a scene, and no light groups"
            mistakes.add(f"{where}, export", f"{form!r} is of {needed}: leave it out")
        elif not has_groups and not entry.scenes and form not in ("csv", "json"):
            mistakes.add(f"{where}, export", f"{form!r} needs the scene: give scene = ...")
    if asked.stage and not Path(asked.stage).is_file():
        mistakes.add(f"{where}, export", f"stage: no such file: {asked.stage}")
    elif "usd" in asked.to:
        try:
            check_usd()
        except LightpaintError as error:
            mistakes.add(f"{where}, export", str(error))


def check_sequence(mistakes: Mistakes, where: str, said: Mapping[str, Any]) -> None:
    """That it goes somewhere: through several looks, or along a path of sensors."""
    path, frames = said.get("sensors"), said.get("frames")
    if "name" not in said or "through" not in said or (frames is None and path is None):
        lacking = next(key for key in ("name", "through", "frames") if key not in said)
        mistakes.add(where, f"{lacking} is missing: give name, through and frames (or sensors)")
    elif not is_name(said["name"]):
        mistakes.add(where, f"{said['name']!r} is no name for a folder: say name = ...")
    elif len(said["through"]) < 2 and path is None:
        mistakes.add(where, f"through is {said['through']}: expected at least two names of looks")
    elif path is not None and frames not in (None, len(path)):
        mistakes.add(where, f"{frames} frames of {len(path)} sensors: leave frames out")
    elif path is not None and len(path) < 2:
        mistakes.add(where, "sensors has one: a path goes through two or more")


def settings_of(mistakes: Mistakes, where: str, look: Mapping[str, Any]) -> Settings:
    said = mistakes.settings(look.get("settings", {}), where)
    want = look.get("want", WANTED)
    return Settings(**said, verify="verify" in want, report="report" in want)


def constraints_of(manifest: Manifest, where: str, look: Mapping[str, Any]) -> Constraints:
    """What is asked of the lights, by tables and files; what is said last goes before."""
    asked = Constraints()
    for given in look["constraints"]:
        try:
            if isinstance(given, str):
                asked = asked.and_then(read_constraints(manifest.folder / given))
                continue
            if unknown := [key for key in given if key not in CONSTRAINED]:
                manifest.mistakes.add(
                    f"{where}, constraints",
                    f"unknown key {unknown[0]!r}; known are {', '.join(CONSTRAINED)}",
                )
                continue
            said = dict(given)
            asked = asked.and_then(Constraints.of(said.pop("light", None), **said))
        except LightpaintError as error:
            manifest.mistakes.add(f"{where}, constraints", str(error))
    return asked


def check_files(manifest: Manifest, where: str, look: Mapping[str, Any]) -> None:
    """What is named is there, so that a slip of the pen is no failed look at midnight."""
    groups = look.get("light_groups")
    if groups is not None and not (manifest.folder / groups).exists():
        manifest.mistakes.add(where, f"light_groups: no such file or folder: {groups}")
    for key in ("scene", "basis", "mask", "lights_file"):
        if key in look and not (manifest.folder / look[key]).is_file():
            manifest.mistakes.add(where, f"{key}: no such file: {look[key]}")
    if "template" in look and not (manifest.folder / look["template"]).is_dir():
        manifest.mistakes.add(where, f"template: no such folder: {look['template']}")
    for key in ("painting", "lighting"):
        given = [look[key]] if key in look else look.get(f"{key}s", [])
        for path in given:
            if not matching(manifest.folder, path):
                manifest.mistakes.add(where, f"{key}: no such file: {path}")
    for sensor, path in look.get("views", {}).items():
        if not (manifest.folder / path).is_file():
            manifest.mistakes.add(where, f"views.{sensor}: no such file: {path}")


def matching(base: Path, path: str) -> list[str]:
    """The files that a path or a pattern names, in the order of their names."""
    given = str(base / path)
    if not has_magic(path) or Path(given).is_file():
        return [given] if Path(given).is_file() else []
    return sorted(x for x in glob(given, recursive=True) if Path(x).is_file())
