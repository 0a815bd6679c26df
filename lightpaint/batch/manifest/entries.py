"""The looks that a manifest asks for, one by one: patterns, sensors, variations, frames told."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from glob import has_magic
from itertools import islice
from pathlib import Path
from typing import Any

from lightpaint.batch.manifest.checks import (
    BASES,
    SHOWN,
    WANTED,
    check_files,
    check_handover,
    check_together,
    check_wanted,
    constraints_of,
    matching,
    settings_of,
)
from lightpaint.batch.manifest.keys import GIVEN, PAINTED, SOURCE, Final, Handover, Space
from lightpaint.batch.manifest.manifest import Manifest, Table
from lightpaint.batch.manifest.variations import SHIFTED
from lightpaint.colour.display.view_transform import TransformChoice
from lightpaint.errors import BatchError, LightpaintError
from lightpaint.files import is_name
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.pipeline.settings import Settings
from lightpaint.pipeline.sources import BasisFile, GroupsFile, Painting, SceneFile

#: Looks of one batch, at most.
MOST_LOOKS = 10_000


@dataclass(frozen=True)
class LookEntry:
    """One look, with all that is asked of it.

    name: of its folder. where: what errors call it. scenes, basis: what it is lit in. paintings:
    of each view; none where a lighting is given. variation: the word it varies another by.
    lighting: a file with the lighting. of: names of looks whose lightings it is made of; share,
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
    want: tuple[str, ...] = WANTED
    final: Final = field(default_factory=Final)
    handover: Handover = field(default_factory=Handover)
    variation: str = ""
    lighting: str = ""
    of: tuple[str, ...] = ()
    share: float = 0.0
    space: Space = "log"

    @property
    def is_solved(self) -> bool:
        """Whether its lighting is found, and not made of others."""
        return bool(self.paintings)

    @property
    def is_by_sums(self) -> bool:
        """Whether nothing but its lighting is wanted, for which nobody needs its pictures."""
        return self.want == ("lights",)


@dataclass(frozen=True)
class LookEntries:
    """All looks that tables ask for.

    whole: those that can be planned, in their order. rest: of each table with mistakes, what can be
    looked at all the same: its scenes, constraints and settings, without a painting.
    """

    whole: list[LookEntry] = field(default_factory=list)
    rest: list[tuple[Table, LookEntry]] = field(default_factory=list)


def looks_of(manifest: Manifest) -> LookEntries:
    """Return all looks that tables ask for; what is wrong is added to the mistakes."""
    sources, looks = _Sources(manifest), LookEntries()
    for table in manifest.looks:
        made, entry = _of_look(manifest, sources, table)
        looks.whole.extend(made)
        if len(looks.whole) > MOST_LOOKS:
            raise BatchError(
                f"{manifest.path} asks for more than {MOST_LOOKS} looks: make several batches of it"
            )
        if entry is not None:
            looks.rest.append((table, entry))
    return looks


class _Sources:
    """Scenes and bases, of which equal ones are one, so that each is loaded once."""

    def __init__(self, manifest: Manifest) -> None:
        self._base = manifest.folder
        self._scenes: dict[str, SceneFile] = {}
        self._bases: dict[str, BasisFile | GroupsFile] = {}

    def scene(self, look: Mapping[str, Any], sensor: str | int | None) -> SceneFile:
        said = {key: look[key] for key in SOURCE if key in look}
        for key in ("basis", "light_groups", "pattern", "sensors"):
            said.pop(key, None)
        path = str(self._base / said.pop("scene"))
        if "lights_file" in said:
            said["lights_file"] = str(self._base / said["lights_file"])
        said["parameters"] = {k: str(v) for k, v in said.get("parameters", {}).items()}
        made = SceneFile(path, **{**said, "sensor": sensor})
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


def _of_look(
    manifest: Manifest, sources: _Sources, table: Table
) -> tuple[list[LookEntry], LookEntry | None]:
    """Return the looks that one table asks for; or, of one with mistakes, what of it is clear."""
    mistakes, where, look = manifest.mistakes, table.where, table.said
    before = len(mistakes.found)
    check_together(mistakes, table)
    check_files(manifest, table)
    check_wanted(mistakes, table)
    is_given = table.has("lighting", "lightings")
    entry = LookEntry(
        look.get("name", ""),
        where,
        constraints=constraints_of(manifest, where, look),
        settings=settings_of(mistakes, where, look),
        want=tuple(look.get("want", SHOWN if is_given else WANTED)),
        final=mistakes.final(look.get("render", {}), where),
        handover=mistakes.handover(look.get("export", {}), where, manifest.folder),
    )
    made: list[LookEntry] = []
    try:
        _painting(manifest, look, "")  # its view is looked at, whatever else is wrong
        if len(mistakes.found) == before and not table.unclear:
            entry = replace(entry, basis=sources.basis(look))
            made = list(islice(_of_subject(manifest, sources, entry, look), MOST_LOOKS + 1))
            made += [_varied(x, word) for word in look.get("variations", ()) for x in made]
    except LightpaintError as error:
        mistakes.add(where, str(error))
    shown = made[0] if made else _what_is_clear(manifest, sources, table, entry)
    if "export" in entry.want and (shown.scenes or shown.basis):
        check_handover(mistakes, where, entry.handover, shown)
    for name in {one.name for one in made} or {entry.name} - {""}:
        if not is_name(name):
            mistakes.add(where, f"{name!r} is no name for a folder: say name = ...")
    if len(mistakes.found) == before and not table.unclear:
        return made, None
    return [], shown


def _what_is_clear(
    manifest: Manifest, sources: _Sources, table: Table, entry: LookEntry
) -> LookEntry:
    """Return the scenes and the basis of a table with mistakes, as far as they follow from it."""
    look, base = table.said, manifest.folder
    # Another sensor, or none, is as good to look at the lights of a scene.
    if table.unclear & (set(SOURCE) - {"sensor", "sensors"}):
        return entry
    if "scene" in look and (base / look["scene"]).is_file():
        sensors = [*look.get("views", ()), *look.get("sensors", ())]
        sensors += [look["sensor"]] if "sensor" in look else []
        return replace(entry, scenes=tuple(sources.scene(look, x) for x in sensors or [None]))
    named = [look[key] for key in BASES if key in look]
    if len(named) == 1 and (base / named[0]).exists():
        return replace(entry, basis=sources.basis(look))
    return entry


def _of_subject(
    manifest: Manifest, sources: _Sources, entry: LookEntry, look: Mapping[str, Any]
) -> Iterator[LookEntry]:
    """A look for each painting or lighting, through each sensor."""
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
    said = {key: look[key] for key in PAINTED if key in look}
    transform = TransformChoice(said.pop("view", None), said.pop("exposure", None))
    if "find_template" in said:
        said["find"] = said.pop("find_template")
    for key in ("mask", "template"):
        if key in said:
            said[key] = str(manifest.folder / said[key])
    return Painting(file, transform=transform, **said)


def _varied(entry: LookEntry, word: str) -> LookEntry:
    """A sibling of a look: solved otherwise, or made of its answer."""
    named = replace(entry, name=f"{entry.name}-{word.replace(' ', '-')}", variation=word)
    if word not in SHIFTED:
        if not entry.is_solved:
            raise LightpaintError(f"variations has {word!r}, and its lighting is given")
        return named
    return replace(named, paintings=(), lighting="", of=(entry.name,), want=_given(entry.want))


def _given(want: Sequence[str]) -> tuple[str, ...]:
    """What is wanted of a lighting that is made of others."""
    return tuple(step for step in want if step in GIVEN) or SHOWN
