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
    matching,
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
from lightpaint.pipeline.settings import Settings
from lightpaint.pipeline.sources import BasisFile, GroupsFile, Painting, SceneFile

#: Looks of one batch, at most.
MAX_LOOKS = 10_000


@dataclass(frozen=True)
class LookEntry:
    """A look with all its inputs and options.

    name: of its folder. where: its name in errors. scenes, basis: that it is lit in. paintings: of
    each view; none where a lighting is given. variation: the word by which it varies another.
    lighting: a file with the lighting. of: names of looks whose lightings it combines; share,
    space: between two of them. want: steps.
    """

    name: str
    where: str
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
    lighting: str = ""
    of: tuple[str, ...] = ()
    share: float = 0.0
    space: Space = "log"

    @property
    def is_solved(self) -> bool:
        """True if its lighting is solved for, and not given or combined."""
        return bool(self.paintings)

    @property
    def is_by_sums(self) -> bool:
        """True if only its lighting is wanted, which needs no pictures."""
        return self.want == ("lights",)


@dataclass(frozen=True)
class LookEntries:
    """Looks of all tables.

    complete: those that can be planned, in their order. incomplete: of each table with mistakes,
    the scenes, constraints and settings that can be checked all the same, without a painting.
    """

    complete: list[LookEntry] = field(default_factory=list)
    incomplete: list[tuple[Table, LookEntry]] = field(default_factory=list)


def looks_of(manifest: Manifest) -> LookEntries:
    """Return the looks of all tables; errors are added to the mistakes."""
    sources, looks = _Sources(manifest), LookEntries()
    for table in manifest.looks:
        made, entry = _table_looks(manifest, sources, table)
        looks.complete.extend(made)
        if len(looks.complete) > MAX_LOOKS:
            raise BatchError(
                f"{manifest.path} asks for more than {MAX_LOOKS} looks: make several batches of it"
            )
        if entry is not None:
            looks.incomplete.append((table, entry))
    return looks


class _Sources:
    """Scenes and bases, equal ones shared, so that each is loaded once."""

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
        made = SceneFile(path, **{**values, "sensor": sensor})
        return self._scenes.setdefault(repr(made), made)

    def basis(self, look: Mapping[str, Any]) -> BasisFile | GroupsFile | None:
        made: BasisFile | GroupsFile
        if "light_groups" in look:
            # In a folder of them may lie what is painted with.
            pictures = [look[key] for key in ("painting", "mask") if key in look]
            pictures += look.get("paintings", [])
            aside = [x for path in pictures for x in matching(self._base, path)]
            path = str(self._base / look["light_groups"])
            leave_out = tuple(aside) if Path(path).is_dir() else ()
            made = GroupsFile(path, look.get("pattern"), leave_out)
        elif "basis" in look:
            made = BasisFile(str(self._base / look["basis"]))
        else:
            return None
        return self._bases.setdefault(repr(made), made)


def _table_looks(
    manifest: Manifest, sources: _Sources, table: Table
) -> tuple[list[LookEntry], LookEntry | None]:
    """Return the looks of one table; or, of one with mistakes, the part that is clear."""
    mistakes, where, look = manifest.mistakes, table.where, table.values
    before = len(mistakes.lines)
    check_combination(mistakes, table)
    check_files(manifest, table)
    check_step_tables(mistakes, table)
    is_given = table.has("lighting", "lightings")
    entry = LookEntry(
        look.get("name", ""),
        where,
        constraints=constraints_of(manifest, where, look),
        settings=settings_of(mistakes, where, look),
        want=tuple(look.get("want", GIVEN_LIGHTING_STEPS if is_given else SOLVE_STEPS)),
        final=mistakes.final(look.get("render", {}), where),
        handover=mistakes.handover(look.get("export", {}), where, manifest.folder),
    )
    made: list[LookEntry] = []
    try:
        _painting(manifest, look, "")  # its view is looked at, whatever else is wrong
        if len(mistakes.lines) == before and not table.unclear:
            entry = replace(entry, basis=sources.basis(look))
            made = list(islice(_subject_looks(manifest, sources, entry, look), MAX_LOOKS + 1))
            made += [_variation_entry(x, word) for word in look.get("variations", ()) for x in made]
    except LightpaintError as error:
        mistakes.add(where, str(error))
    shown = made[0] if made else _partial_entry(manifest, sources, table, entry)
    if "export" in entry.want and (shown.scenes or shown.basis):
        check_handover(mistakes, where, entry.handover, shown)
    for name in {one.name for one in made} or {entry.name} - {""}:
        if not is_name(name):
            mistakes.add(where, f"{name!r} is no name for a folder: say name = ...")
    if len(mistakes.lines) == before and not table.unclear:
        return made, None
    return [], shown


def _partial_entry(
    manifest: Manifest, sources: _Sources, table: Table, entry: LookEntry
) -> LookEntry:
    """Return the scenes and the basis of a table with mistakes, as far as they are known."""
    look, base = table.values, manifest.folder
    # Another sensor, or none, is as good to look at the lights of a scene.
    if table.unclear & (set(SOURCE_KEYS) - {"sensor", "sensors"}):
        return entry
    if "scene" in look and (base / look["scene"]).is_file():
        sensors = [*look.get("views", ()), *look.get("sensors", ())]
        sensors += [look["sensor"]] if "sensor" in look else []
        return replace(entry, scenes=tuple(sources.scene(look, x) for x in sensors or [None]))
    named = [look[key] for key in BASES if key in look]
    if len(named) == 1 and (base / named[0]).exists():
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
    given = [look[key]] if key in look else look[f"{key}s"]
    is_one = key in look and not has_magic(look[key])
    sensors: Sequence[Any] = look.get("sensors") or [look.get("sensor")]
    for file in (file for path in given for file in matching(manifest.folder, path)):
        # Answers are all called lighting.json, and go by their folders.
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
    named = replace(entry, name=f"{entry.name}-{word.replace(' ', '-')}", variation=word)
    if word not in SHIFTED_WORDS:
        if not entry.is_solved:
            raise LightpaintError(f"variations has {word!r}, and its lighting is given")
        return named
    return replace(
        named, paintings=(), lighting="", of=(entry.name,), want=_lighting_steps(entry.want)
    )


def _lighting_steps(want: Sequence[str]) -> tuple[str, ...]:
    """Return the wanted steps that apply to a lighting that is combined from others."""
    return tuple(step for step in want if step in LIGHTING_STEPS) or GIVEN_LIGHTING_STEPS
