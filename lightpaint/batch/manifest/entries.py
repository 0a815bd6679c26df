"""The looks of a manifest, one by one: patterns, sensors and variations expanded."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from glob import has_magic
from itertools import islice
from pathlib import Path
from typing import Any

from lightpaint.batch.manifest.checks import (
    BASES,
    GIVEN_LIGHTING_STEPS,
    SOLVE_STEPS,
    check_combination,
    check_files,
    check_handover,
    check_step_tables,
    constraints_of,
    files_named,
    settings_of,
)
from lightpaint.batch.manifest.keys import (
    LIGHTING_STEPS,
    PAINTING_KEYS,
    SOURCE_KEYS,
    Final,
    Handover,
    Space,
)
from lightpaint.batch.manifest.manifest import Manifest, Table
from lightpaint.batch.manifest.variations import SHIFTED_WORDS
from lightpaint.colour.display.view_transform import TransformChoice
from lightpaint.errors import BatchError, LightpaintError
from lightpaint.files import is_name
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import BasisFile, GroupsFile, Painting, SceneFile

#: Maximum number of looks of one batch.
MAX_LOOKS = 10_000


@dataclass(frozen=True)
class LookEntry:
    """A look with all its inputs and options.

    name: of its folder. label: its name in errors. scenes, basis: to light. paintings: one for
    each view; none if a lighting is given. variation: its word, if it varies another look, which
    is `varied_look`. shares_places: whether its lights hang where those of other looks do. places:
    file with the places of lights that may move; set once its scene is read. lighting: a file with
    the lighting. combined_looks: names of the looks whose lightings it combines; share, space:
    between two of them. want: steps.
    """

    name: str
    label: str
    scenes: tuple[SceneFile, ...] = ()
    basis: BasisFile | GroupsFile | None = None
    paintings: tuple[Painting, ...] = ()
    constraints: Constraints = field(default_factory=Constraints)
    settings: Settings = field(default_factory=Settings)
    by_sensor: bool = False
    want: tuple[str, ...] = SOLVE_STEPS
    final: Final = field(default_factory=Final)
    handover: Handover = field(default_factory=Handover)
    variation: str = ""
    varied_look: str = ""
    shares_places: bool = False
    places: str = ""
    lighting: str = ""
    combined_looks: tuple[str, ...] = ()
    share: float = 0.0
    space: Space = "log"

    @property
    def is_solved(self) -> bool:
        """True if its lighting is solved for, not given or combined."""
        return bool(self.paintings)

    @property
    def is_by_sums(self) -> bool:
        """True if only its lighting is requested, which needs no pictures."""
        return self.want == ("lights",)


@dataclass(frozen=True)
class LookEntries:
    """Looks of all tables.

    complete: those that can be planned, in their order. incomplete: for each table with mistakes,
    the scenes, constraints and settings that can still be checked without a painting.
    """

    complete: list[LookEntry] = field(default_factory=list)
    incomplete: list[tuple[Table, LookEntry]] = field(default_factory=list)


def looks_of(manifest: Manifest) -> LookEntries:
    """Return the looks of all tables, and add errors to the mistakes."""
    sources, looks = _Sources(manifest), LookEntries()
    for table in manifest.looks:
        table_looks, entry = _table_looks(manifest, sources, table)
        looks.complete.extend(table_looks)
        if len(looks.complete) > MAX_LOOKS:
            raise BatchError(
                f"{manifest.path} asks for more than {MAX_LOOKS} looks: make several batches of it"
            )
        if entry is not None:
            looks.incomplete.append((table, entry))
    return looks


class _Sources:
    """Scenes and bases; equal ones are shared, so that each is loaded once."""

    def __init__(self, manifest: Manifest) -> None:
        self._base = manifest.folder
        self._scenes: dict[str, SceneFile] = {}
        self._bases: dict[str, BasisFile | GroupsFile] = {}

    def scene(self, look: Mapping[str, Any], sensor: str | int | None) -> SceneFile:
        values = {key: look[key] for key in SOURCE_KEYS if key in look}
        for key in ("basis", "light_groups", "pattern", "sensors"):
            values.pop(key, None)
        path = str(self._base / values.pop("scene"))
        if "lights_file" in values:
            values["lights_file"] = str(self._base / values["lights_file"])
        values["parameters"] = {k: str(v) for k, v in values.get("parameters", {}).items()}
        file = SceneFile(path, **{**values, "sensor": sensor})
        return self._scenes.setdefault(repr(file), file)

    def basis(self, look: Mapping[str, Any]) -> BasisFile | GroupsFile | None:
        file: BasisFile | GroupsFile
        if "light_groups" in look:
            # The folder of light groups may hold paintings and masks as well.
            pictures = [look[key] for key in ("painting", "mask") if key in look]
            pictures += look.get("paintings", [])
            painted_files = [x for path in pictures for x in files_named(self._base, path)]
            path = str(self._base / look["light_groups"])
            leave_out = tuple(painted_files) if Path(path).is_dir() else ()
            file = GroupsFile(path, look.get("pattern"), leave_out)
        elif "basis" in look:
            file = BasisFile(str(self._base / look["basis"]))
        else:
            return None
        return self._bases.setdefault(repr(file), file)


def _table_looks(
    manifest: Manifest, sources: _Sources, table: Table
) -> tuple[list[LookEntry], LookEntry | None]:
    """Return the looks of one table or, if it has mistakes, the part of it that is clear."""
    mistakes, label, look = manifest.mistakes, table.label, table.values
    mistakes_before = len(mistakes.lines)
    check_combination(mistakes, table)
    check_files(manifest, table)
    check_step_tables(mistakes, table)
    is_given = table.has("lighting", "lightings")
    entry = LookEntry(
        look.get("name", ""),
        label,
        constraints=constraints_of(manifest, label, look),
        settings=settings_of(mistakes, label, look),
        want=tuple(look.get("want", GIVEN_LIGHTING_STEPS if is_given else SOLVE_STEPS)),
        final=mistakes.final(look.get("render", {}), label),
        handover=mistakes.handover(look.get("export", {}), label, manifest.folder),
        shares_places="share" in look,
    )
    looks: list[LookEntry] = []
    try:
        _painting(manifest, look, "")  # checks the view transform, whatever else is wrong
        if len(mistakes.lines) == mistakes_before and not table.unclear_keys:
            entry = replace(entry, basis=sources.basis(look))
            looks = list(islice(_subject_looks(manifest, sources, entry, look), MAX_LOOKS + 1))
            looks += [
                _variation_entry(x, word) for word in look.get("variations", ()) for x in looks
            ]
    except LightpaintError as error:
        mistakes.add(label, error.sentence)
    example = looks[0] if looks else _partial_entry(manifest, sources, table, entry)
    if "export" in entry.want and (example.scenes or example.basis):
        check_handover(mistakes, label, entry.handover, example)
    for name in {x.name for x in looks} or {entry.name} - {""}:
        if not is_name(name):
            mistakes.add(label, f"{name!r} cannot be the name of a folder: set name = ...")
    if len(mistakes.lines) == mistakes_before and not table.unclear_keys:
        return looks, None
    return [], example


def _partial_entry(
    manifest: Manifest, sources: _Sources, table: Table, entry: LookEntry
) -> LookEntry:
    """Return the scenes and the basis of a table with mistakes, as far as they are known."""
    look, base = table.values, manifest.folder
    # Any sensor, or none, will do to check the lights of a scene.
    if table.unclear_keys & (set(SOURCE_KEYS) - {"sensor", "sensors"}):
        return entry
    if "scene" in look and (base / look["scene"]).is_file():
        sensors = [*look.get("views", ()), *look.get("sensors", ())]
        sensors += [look["sensor"]] if "sensor" in look else []
        return replace(entry, scenes=tuple(sources.scene(look, x) for x in sensors or [None]))
    paths = [look[key] for key in BASES if key in look]
    if len(paths) == 1 and (base / paths[0]).exists():
        return replace(entry, basis=sources.basis(look))
    return entry


def _subject_looks(
    manifest: Manifest, sources: _Sources, entry: LookEntry, look: Mapping[str, Any]
) -> Iterator[LookEntry]:
    """Yield a look for each painting or lighting, through each sensor."""
    if "views" in look:
        views = look["views"]
        yield replace(
            entry,
            name=look.get("name") or Path(next(iter(views.values()))).stem,
            scenes=tuple(sources.scene(look, sensor) for sensor in views),
            paintings=tuple(
                _painting(manifest, look, str(manifest.folder / path)) for path in views.values()
            ),
            by_sensor=True,
        )
        return
    key = "lighting" if "lighting" in look or "lightings" in look else "painting"
    patterns = [look[key]] if key in look else look[f"{key}s"]
    is_one = key in look and not has_magic(look[key])
    sensors: Sequence[Any] = look.get("sensors") or [look.get("sensor")]
    for file in (file for path in patterns for file in files_named(manifest.folder, path)):
        # Answers are all called lighting.json: their folders tell them apart.
        stem = Path(file).parent.name if Path(file).name == "lighting.json" else Path(file).stem
        name = look.get("name", "")
        name = (name or stem) if is_one else f"{name}-{stem}" if name else stem
        for sensor in sensors:
            yield replace(
                entry,
                name=f"{name}-{sensor}" if "sensors" in look else name,
                scenes=(sources.scene(look, sensor),) if "scene" in look else (),
                paintings=(_painting(manifest, look, file),) if key == "painting" else (),
                lighting=file if key == "lighting" else "",
            )


def _painting(manifest: Manifest, look: Mapping[str, Any], file: str) -> Painting:
    values = {key: look[key] for key in PAINTING_KEYS if key in look}
    transform = TransformChoice(values.pop("view", None), values.pop("exposure", None))
    if "find_template" in values:
        values["find"] = values.pop("find_template")
    for key in ("mask", "template"):
        if key in values:
            values[key] = str(manifest.folder / values[key])
    return Painting(file, transform=transform, **values)


def _variation_entry(entry: LookEntry, word: str) -> LookEntry:
    """Return a variation of a look: solved with other settings, or derived from its answer."""
    name = f"{entry.name}-{word.replace(' ', '-')}"
    variation = replace(entry, name=name, variation=word, varied_look=entry.name)
    if word not in SHIFTED_WORDS:
        if not entry.is_solved:
            raise LightpaintError(f"variations has {word!r}, and its lighting is given")
        return variation
    return replace(
        variation,
        paintings=(),
        lighting="",
        combined_looks=(entry.name,),
        want=_lighting_steps(entry.want),
    )


def _lighting_steps(want: Sequence[str]) -> tuple[str, ...]:
    """Return the requested steps that apply to a lighting that is combined from others."""
    return tuple(step for step in want if step in LIGHTING_STEPS) or GIVEN_LIGHTING_STEPS
