"""The looks that a manifest asks for, one by one: patterns, sensors, variations, frames told."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from glob import has_magic
from pathlib import Path
from typing import Any

from lightpaint.batch.checks import (
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
from lightpaint.batch.keys import GIVEN, PAINTED, SOURCE, Final, Handover, Space
from lightpaint.batch.manifest import Manifest
from lightpaint.batch.variations import SHIFTED
from lightpaint.colour.transform import TransformChoice
from lightpaint.errors import LightpaintError
from lightpaint.files import is_name
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.settings import Settings
from lightpaint.sources import BasisFile, GroupsFile, Painting, SceneFile


@dataclass(frozen=True)
class Entry:
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


def looks_of(manifest: Manifest) -> list[Entry]:
    """All looks that tables ask for, in their order; what is wrong is added to the mistakes."""
    sources = _Sources(manifest)
    tables = manifest.looks
    return [x for where, look in tables for x in _of_look(manifest, sources, where, look)]


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
    manifest: Manifest, sources: _Sources, where: str, look: Mapping[str, Any]
) -> list[Entry]:
    """The looks that one table asks for."""
    mistakes = manifest.mistakes
    before = len(mistakes.found)
    check_together(mistakes, where, look)
    if len(mistakes.found) == before:
        check_files(manifest, where, look)
    settings = settings_of(mistakes, where, look)
    constraints = constraints_of(manifest, where, look)
    final = mistakes.final(look.get("render", {}), where)
    handover = mistakes.handover(look.get("export", {}), where, manifest.folder)
    if len(mistakes.found) == before:
        check_wanted(mistakes, where, look)
    if len(mistakes.found) > before:
        return []
    basis = sources.basis(look)
    is_given = "lighting" in look or "lightings" in look
    entry = Entry(
        "",
        where,
        basis=basis,
        constraints=constraints,
        settings=settings,
        want=tuple(look.get("want", SHOWN if is_given else WANTED)),
        final=final,
        handover=handover,
    )
    try:
        made = list(_of_subject(manifest, sources, entry, look))
        made += [_varied(x, word) for word in look.get("variations", ()) for x in made]
    except LightpaintError as error:
        mistakes.add(where, str(error))
        return []
    if made and "export" in entry.want:
        check_handover(mistakes, where, handover, made[0])
    for one in made:
        if not is_name(one.name):
            mistakes.add(where, f"{one.name!r} is no name for a folder: say name = ...")
    return made


def _of_subject(
    manifest: Manifest, sources: _Sources, entry: Entry, look: Mapping[str, Any]
) -> Iterator[Entry]:
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


def _varied(entry: Entry, word: str) -> Entry:
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
