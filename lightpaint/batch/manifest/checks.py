"""Checks of a manifest's tables before files are read: missing keys, contradictions,
missing files.
"""

from collections.abc import Mapping
from glob import has_magic
from pathlib import Path
from typing import Any

from lightpaint.batch.manifest import keys
from lightpaint.batch.manifest.file_names import files_matching
from lightpaint.batch.manifest.looks_file import Manifest, Table, subject_keys
from lightpaint.display_text import some_names
from lightpaint.errors import LightpaintError
from lightpaint.files import is_name
from lightpaint.lighting import Constraints, read_constraints
from lightpaint.pipeline import GroupsFile, Settings
from lightpaint.relit import FORMS, check_usd

#: Default steps of a look that is solved, and of a given lighting or a frame.
SOLVE_STEPS, GIVEN_LIGHTING_STEPS = ("solve", "predict", "verify", "report"), ("predict",)

#: Keys that stand for a scene that is already rendered.
BASES = ("basis", "light_groups")

#: Keys of `Constraints.of`, as in a lights file.
CONSTRAINT_KEYS = (
    *("light", "tie", "prefer_current", "sparse", "start", "near"),
    "prefer_emitters",
)


def check_combination(mistakes: keys.Mistakes, table: Table) -> None:
    """Add keys that are missing or contradict each other to the mistakes."""
    label, look = table.label, table.values
    subjects = subject_keys(look)
    if not table.has(*keys.SUBJECT_KEYS):
        mistakes.add(
            label, "nothing to show: give painting, paintings, views, lighting or lightings"
        )
    elif len(subjects) > 1:
        mistakes.add(label, f"{' and '.join(subjects)} at once: give one of them")
    basis_keys = [key for key in BASES if key in look]
    if not table.has("scene", *BASES):
        mistakes.add(label, "no scene and no basis: give one, here or in [defaults]")
    elif len(basis_keys) > 1 or ("scene" in look and "light_groups" in look):
        mistakes.add(label, "light_groups stand for scene and basis: give them alone")
    if "pattern" in look and not table.has("light_groups"):
        mistakes.add(label, "pattern is of light_groups: leave it out, or give them")
    has_several_views = "views" in look or "sensors" in look
    if "sensor" in look and "sensors" in look:
        mistakes.add(label, "sensor and sensors at once: give one of them")
    elif "views" in look and ("sensor" in look or "sensors" in look):
        mistakes.add(label, "views name their sensors: leave sensor and sensors out")
    elif has_several_views and basis_keys:
        mistakes.add(label, "a basis has only one view: give the scene to solve for several")
    elif basis_keys and not table.has("scene"):
        _check_basis_keys(mistakes, label, look)
    steps, is_given = look.get("want", ()), "lighting" in look or "lightings" in look
    if is_given and (
        unusable := [x for x in ("solve", "verify", "report", "lights") if x in steps]
    ):
        mistakes.add(label, f"want has {unusable[0]!r}, and its lighting is given: leave it out")
    elif "lights" in steps:
        check_by_sums(mistakes, table)
    if "share" in look:
        _check_share(mistakes, table, is_given=is_given)
    if is_given and (
        unusable := [word for word in look.get("variations", ()) if word in keys.SOLVED_WORDS]
    ):
        mistakes.add(label, f"variations has {unusable[0]!r}, and its lighting is given")


def _check_share(mistakes: keys.Mistakes, table: Table, *, is_given: bool) -> None:
    """Add keys that contradict `share = "places"` to the mistakes."""
    look = table.values
    if is_given:
        mistakes.add(table.label, "share is of places that are searched for: its lighting is given")
    elif any(key in look for key in BASES):
        mistakes.add(table.label, "share needs lights of a scene: leave the basis out")
    elif "lights" in look.get("want", ()):
        mistakes.add(table.label, "want has 'lights', and places need images: want 'solve' instead")
    elif look.get("settings", {}).get("move_lights") is False:
        mistakes.add(
            table.label, "share is of lights that move, and move_lights is false: leave one out"
        )


def check_by_sums(mistakes: keys.Mistakes, table: Table) -> None:
    """Add keys that contradict a request for the lighting alone to the mistakes."""
    label, look = table.label, table.values
    if len(look["want"]) > 1:
        mistakes.add(label, "want has 'lights', which is the lighting alone: leave the rest out")
    if "views" in look or look.get("variations"):
        mistakes.add(label, "want has 'lights', which is of one view, without variations")
    settings = look.get("settings", {})
    if settings.get("literal") is not True and "settings" not in table.unclear_keys:
        mistakes.add(label, "want has 'lights': settings need literal = true, or images are needed")
    for key in ("time_s", "error", "noise_correction", "refine", "suggest", "planes"):
        if settings.get(key):
            mistakes.add(label, f"want has 'lights', and {key} needs images: leave it out")


def _check_basis_keys(mistakes: keys.Mistakes, label: str, look: Mapping[str, Any]) -> None:
    """Add keys that a saved basis cannot use to the mistakes."""
    for step in ("verify", "render"):
        if step in look.get("want", ()):
            mistakes.add(label, f"want has {step!r}, which needs the scene: give scene = ...")
    if unusable_keys := [
        key for key in keys.SOURCE_KEYS if key in look and key not in (*BASES, "pattern")
    ]:
        mistakes.add(
            label, f"{some_names(unusable_keys)} cannot change a saved basis: leave it out"
        )


def check_step_tables(mistakes: keys.Mistakes, table: Table) -> None:
    """Add a [render] or [export] table whose step `want` lacks to the mistakes."""
    for step in ("render", "export"):
        if (
            step in table.values
            and "want" not in table.unclear_keys
            and step not in table.values.get("want", ())
        ):
            mistakes.add(
                table.label, f"[{step}] says how, and want does not have {step!r}: add it there"
            )


def check_handover(
    mistakes: keys.Mistakes, label: str, handover: keys.Handover, entry: Any
) -> None:
    """Add exports that a look cannot have to the mistakes. entry: one of its looks."""
    has_groups = isinstance(entry.basis, GroupsFile)
    for form in handover.to:
        if has_groups and FORMS[form].file_of_groups is None:
            requirement = "a scene, and no light groups"
            mistakes.add(f"{label}, export", f"{form!r} is of {requirement}: leave it out")
        elif not has_groups and not entry.scenes and FORMS[form].needs_source:
            mistakes.add(f"{label}, export", f"{form!r} needs the scene: give scene = ...")
    if handover.stage and "usd" in handover.to and not Path(handover.stage).is_file():
        mistakes.add(f"{label}, export", f"stage: no such file: {handover.stage}")
    elif "usd" in handover.to:
        try:
            check_usd()
        except LightpaintError as error:
            mistakes.add(f"{label}, export", error.sentence)


def check_sequence(mistakes: keys.Mistakes, table: Table) -> None:
    """Add a sequence's errors to the mistakes: it needs looks and frames, or a path of sensors."""
    label, values = table.label, table.values
    path, frames = values.get("sensors"), values.get("frames")
    missing_keys = [key for key in ("name", "through") if not table.has(key)]
    missing_keys += ["frames"] if not table.has("frames", "sensors") else []
    if missing_keys:
        mistakes.add(
            label, f"{missing_keys[0]} is missing: give name, through and frames (or sensors)"
        )
    if "name" in values and not is_name(values["name"]):
        mistakes.add(label, f"{values['name']!r} cannot be the name of a folder: set name = ...")
    if len(values.get("through", "..")) < 2 and not table.has("sensors"):
        mistakes.add(label, f"through is {values['through']}: expected at least two names of looks")
    if path is not None and frames not in (None, len(path)):
        mistakes.add(label, f"{frames} frames of {len(path)} sensors: leave frames out")
    elif path is not None and len(path) < 2:
        mistakes.add(label, "sensors has one: a path goes through two or more")


def settings_of(manifest: Manifest, label: str, look: Mapping[str, Any]) -> Settings:
    mistakes = manifest.mistakes
    values = mistakes.settings(look.get("settings", {}), label)
    for name in ("planes", "observer"):
        if name in values:
            values[name] = str(manifest.folder / values[name])
    steps = look.get("want", SOLVE_STEPS)
    if "scene" in look and values.get("sun"):
        mistakes.add(
            label,
            "sun adds texels for one look, and looks share their basis: leave it out here, and "
            "solve that look alone for its sun",
        )
    if "scene" in look:
        values["sun"] = 0  # also instead of that in a lights file
        # What an earlier run has left in the cache must not decide the answers of a batch.
        if not {"time_s", "error"} & set(values):
            values.setdefault("exact_spp", True)
    return Settings(**values, verify="verify" in steps, report="report" in steps)


def constraints_of(manifest: Manifest, label: str, look: Mapping[str, Any]) -> Constraints:
    """Return the constraints of tables and files; later ones override earlier ones."""
    constraints, mistakes = Constraints(), manifest.mistakes
    for source in look["constraints"]:
        try:
            if isinstance(source, str):
                constraints = constraints.and_then(read_constraints(manifest.folder / source))
            else:
                constraints = constraints.and_then(
                    _constraints(mistakes, f"{label}, constraints", source)
                )
        except LightpaintError as error:
            mistakes.add(f"{label}, constraints", error.sentence)
    return constraints


def _constraints(mistakes: keys.Mistakes, label: str, table: Mapping[str, Any]) -> Constraints:
    """Return the constraints of a table; errors are added light by light and key by key."""
    values = {key: value for key, value in table.items() if key in CONSTRAINT_KEYS}
    for key in (key for key in table if key not in values):
        suggestion = keys.near_key(key, CONSTRAINT_KEYS)
        hint = (
            f": did you mean {suggestion!r}?"
            if suggestion
            else f"; known are {', '.join(CONSTRAINT_KEYS)}"
        )
        mistakes.add(label, f"unknown key {key!r}{hint}")
    lights = values.pop("light", None)
    if isinstance(lights, dict):
        lights = {
            name: values_of_light
            for name, values_of_light in lights.items()
            if _is_light(mistakes, label, name, values_of_light)
        }
    for key, value in list(values.items()):
        if not _is_valid(mistakes, label, **{key: value}):
            del values[key]
    return Constraints.of(lights, **values)


def _is_light(mistakes: keys.Mistakes, label: str, name: str, values: Any) -> bool:
    """Return whether a light's constraints are valid: each key by itself, then all together."""
    # A Duv alone is incomplete.
    fields = values if isinstance(values, dict) else {}
    single_keys = [{name: {key: value}} for key, value in fields.items() if key != "duv"]
    invalid_keys = [
        single_key for single_key in single_keys if not _is_valid(mistakes, label, light=single_key)
    ]
    return not invalid_keys and _is_valid(mistakes, label, light={name: values})


def _is_valid(mistakes: keys.Mistakes, label: str, **arguments: Any) -> bool:
    try:
        Constraints.of(**arguments)
    except LightpaintError as error:
        mistakes.add(label, error.sentence)
        return False
    return True


def check_files(manifest: Manifest, table: Table) -> None:
    """Add files that do not exist to the mistakes, so that a misspelt name fails at once."""
    label, look = table.label, table.values
    groups = look.get("light_groups")
    if groups is not None and not (manifest.folder / groups).exists():
        manifest.mistakes.add(label, f"light_groups: no such file or folder: {groups}")
    for key in ("scene", "basis", "mask", "lights_file"):
        if key in look and not (manifest.folder / look[key]).is_file():
            manifest.mistakes.add(label, f"{key}: no such file: {look[key]}")
    if "template" in look and not (manifest.folder / look["template"]).is_dir():
        manifest.mistakes.add(label, f"template: no such folder: {look['template']}")
    for key in ("painting", "lighting"):
        patterns = [look[key]] if key in look else look.get(f"{key}s", [])
        for path in patterns:
            if not files_named(manifest.folder, path):
                manifest.mistakes.add(label, f"{key}: no such file: {path}")
    for sensor, path in look.get("views", {}).items():
        if not (manifest.folder / path).is_file():
            manifest.mistakes.add(label, f"views.{sensor}: no such file: {path}")


def files_named(base: Path, path: str) -> list[str]:
    """Return the files that a path or a pattern names, in the order of their names."""
    full_path = str(base / path)
    if not has_magic(path) or Path(full_path).is_file():
        return [full_path] if Path(full_path).is_file() else []
    return sorted(files_matching(path, base))
