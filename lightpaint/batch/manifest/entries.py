"""All looks of a manifest: the looks of its tables, expanded, and the frames of its sequences."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from glob import has_magic
from itertools import islice
from pathlib import Path
from typing import Any

from lightpaint.batch.manifest import checks, keys
from lightpaint.batch.manifest.file_names import is_reserved, name_clashes
from lightpaint.batch.manifest.looks_file import Manifest, Table
from lightpaint.batch.manifest.sequence import frame_position
from lightpaint.colour import TransformChoice
from lightpaint.display_text import some_names
from lightpaint.errors import BatchError, LightpaintError
from lightpaint.files import is_name
from lightpaint.lighting import Constraints
from lightpaint.pipeline import BasisFile, GroupsFile, Painting, SceneFile, Settings

#: Maximum number of looks of one batch.
MAX_LOOKS = 10_000


@dataclass(frozen=True)
class LookEntry:
    """A look with all its inputs and options.

    name: of its folder. label: its name in errors. scenes, basis: to light. paintings: one for
    each view; none if a lighting is given. variation: its word, if it varies another look, which
    is `varied_look`. shares_places: whether its lights hang where the lights of other looks do.
    places: file with the places of lights that may move; set once its scene is read. lighting: a
    file with the lighting. combined_looks: names of the looks whose lightings it combines; share,
    space: between two of them. want: steps.
    """

    name: str
    label: str
    scenes: tuple[SceneFile, ...] = ()
    basis: BasisFile | GroupsFile | None = None
    paintings: tuple[Painting, ...] = ()
    constraints: Constraints = field(default_factory=Constraints)
    settings: Settings = field(default_factory=Settings)
    by_sensor: bool = False
    want: tuple[str, ...] = checks.SOLVE_STEPS
    final: keys.Final = field(default_factory=keys.Final)
    handover: keys.Handover = field(default_factory=keys.Handover)
    variation: str = ""
    varied_look: str = ""
    shares_places: bool = False
    places: str = ""
    lighting: str = ""
    combined_looks: tuple[str, ...] = ()
    share: float = 0.0
    space: keys.Space = "log"

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


def entries_of(manifest: Manifest) -> LookEntries:
    """Return all looks in the order of the manifest, and add errors to its mistakes."""
    looks = _looks_of_tables(manifest)
    for table in manifest.sequences:
        looks.complete.extend(_sequence_looks(manifest, looks, table))
        if len(looks.complete) > MAX_LOOKS + keys.MAX_FRAMES:
            raise BatchError(
                f"{manifest.path} asks for more than {MAX_LOOKS} looks and {keys.MAX_FRAMES} "
                "frames: make several batches of it"
            )
    named_entries = [entry for _, entry in looks.incomplete if entry.name]
    _check_names(manifest, [*looks.complete, *named_entries])
    return looks


def _check_names(manifest: Manifest, looks: Sequence[LookEntry]) -> None:
    """Add each look whose folder another look, or the batch itself, would use to the mistakes."""
    for look in looks:
        if is_reserved(look.name):
            manifest.mistakes.add(
                look.label,
                f"a look cannot be called {look.name!r}, the name of a file of the batch itself: "
                "set name = ...",
            )
    for names_of_folder in name_clashes(look.name for look in looks):
        labels = some_names(
            dict.fromkeys(x.label for x in looks if x.name in names_of_folder), " and "
        )
        names = " and ".join(map(repr, names_of_folder))
        text = f"more than one look would be called {names}: set name = ... in one of them"
        if len(names_of_folder) > 1:
            text = (
                f"{names} would be one folder on disks that ignore case: set name = ... "
                "in one of them"
            )
        manifest.mistakes.add(labels, text)


def _looks_of_tables(manifest: Manifest) -> LookEntries:
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
        values = {key: look[key] for key in keys.SOURCE_KEYS if key in look}
        for key in ("basis", "light_groups", "pattern", "sensors"):
            values.pop(key, None)
        path = str(self._base / values.pop("scene"))
        if "lights_file" in values:
            values["lights_file"] = str(self._base / values["lights_file"])
        values["parameters"] = {k: str(v) for k, v in values.get("parameters", {}).items()}
        values |= self._spectra(look.get("settings", {}))
        file = SceneFile(path, **{**values, "sensor": sensor})
        return self._scenes.setdefault(repr(file), file)

    def _spectra(self, settings: Mapping[str, Any]) -> dict[str, Any]:
        """Return how the scene is rendered with spectra, if it is."""
        if settings.get("spectral") is not True:
            return {}
        observer = settings.get("observer")
        path = str(self._base / observer) if isinstance(observer, str) else None
        return {"spectral": True, "observer": path}

    def basis(self, look: Mapping[str, Any]) -> BasisFile | GroupsFile | None:
        file: BasisFile | GroupsFile
        if "light_groups" in look:
            # The folder of light groups may hold paintings and masks as well.
            pictures = [look[key] for key in ("painting", "mask") if key in look]
            pictures += look.get("paintings", [])
            painted_files = [x for path in pictures for x in checks.files_named(self._base, path)]
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
    checks.check_combination(mistakes, table)
    checks.check_files(manifest, table)
    checks.check_step_tables(mistakes, table)
    is_given = table.has("lighting", "lightings")
    entry = LookEntry(
        look.get("name", ""),
        label,
        constraints=checks.constraints_of(manifest, label, look),
        settings=checks.settings_of(manifest, label, look),
        want=tuple(
            look.get("want", checks.GIVEN_LIGHTING_STEPS if is_given else checks.SOLVE_STEPS)
        ),
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
        checks.check_handover(mistakes, label, entry.handover, example)
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
    if table.unclear_keys & (set(keys.SOURCE_KEYS) - {"sensor", "sensors"}):
        return entry
    if "scene" in look and (base / look["scene"]).is_file():
        sensors = [*look.get("views", ()), *look.get("sensors", ())]
        sensors += [look["sensor"]] if "sensor" in look else []
        return replace(entry, scenes=tuple(sources.scene(look, x) for x in sensors or [None]))
    paths = [look[key] for key in checks.BASES if key in look]
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
    for file in (file for path in patterns for file in checks.files_named(manifest.folder, path)):
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
    values = {key: look[key] for key in keys.PAINTING_KEYS if key in look}
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
    if word not in keys.SHIFTED_WORDS:
        if not entry.is_solved:
            raise LightpaintError(f"variations has {word!r}, and its lighting is given")
        return variation
    return replace(
        variation,
        paintings=(),
        lighting="",
        combined_looks=(entry.name,),
        want=(
            tuple(step for step in entry.want if step in keys.LIGHTING_STEPS)
            or checks.GIVEN_LIGHTING_STEPS
        ),
    )


def _sequence_looks(manifest: Manifest, looks: LookEntries, table: Table) -> list[LookEntry]:
    """Return a look for each frame; none if the sequence has mistakes."""
    mistakes, label, values = manifest.mistakes, table.label, table.values
    by_name = {look.name: look for look in looks.complete}
    mistakes_before = len(mistakes.lines)
    checks.check_sequence(mistakes, table)
    checks.check_step_tables(mistakes, table)
    final = mistakes.final(values.get("render", {}), label)
    handover = mistakes.handover(values.get("export", {}), label, manifest.folder)
    ends = [by_name[name] for name in values.get("through", ()) if name in by_name]
    for name in (name for name in values.get("through", ()) if name not in by_name):
        if not any(_may_become(name, entry) for _, entry in looks.incomplete):
            mistakes.add(label, f"through: no look is called {name!r}")
    if ends:
        _check_ends(mistakes, label, ends, values)
    if (
        len(mistakes.lines) > mistakes_before
        or table.unclear_keys
        or len(ends) < len(values["through"])
    ):
        return []
    steps = tuple(values.get("want", checks.GIVEN_LIGHTING_STEPS))
    options: dict[str, Any] = {"want": steps, "final": final, "handover": handover}
    looks_of_frames = [replace(frame, label=label, **options) for frame in _frames(values, ends)]
    if "render" in steps and not ends[0].scenes:
        mistakes.add(label, "want has 'render', which needs the scene of its looks")
    if "export" in steps:
        checks.check_handover(mistakes, label, handover, looks_of_frames[0])
    return looks_of_frames


def _check_ends(
    mistakes: keys.Mistakes, label: str, ends: Sequence[LookEntry], values: Mapping[str, Any]
) -> None:
    """Add reasons why looks cannot be the ends of a sequence to the mistakes."""
    path = values.get("sensors")
    if any(_view_key(end, path) != _view_key(ends[0], path) for end in ends):
        mistakes.add(label, "through: its looks are of different scenes, sensors or bases")
    elif path and not ends[0].scenes:
        mistakes.add(label, "sensors: its looks have no scene that other sensors could see")
    elif not path and any(end.by_sensor for end in ends):
        mistakes.add(
            label, "through: a look of several views has several pictures: name looks of one view"
        )


def _may_become(name: str, entry: LookEntry) -> bool:
    """Return whether a table would expand to a look of that name if its mistakes were mended."""
    if not entry.name:
        return True
    return name == entry.name or name.startswith(f"{entry.name}-")


def _frames(values: Mapping[str, Any], ends: Sequence[LookEntry]) -> Iterator[LookEntry]:
    """Yield each frame: a mix of two of `ends`, through their sensor or its own on a path."""
    path, look_names = values.get("sensors"), values["through"]
    frames = len(path) if path else values["frames"]
    digits = len(str(frames - 1))
    for k in range(frames):
        first, share = frame_position(k, frames, len(look_names))
        scenes = ends[first].scenes
        yield replace(
            ends[first],
            name=f"{values['name']}-{k:0{digits}}",
            scenes=(replace(scenes[0], sensor=path[k]),) if path else scenes,
            by_sensor=False,
            paintings=(),
            lighting="",
            variation="",
            combined_looks=tuple(look_names[first : first + 2]),
            share=share,
            space=values.get("space", "log"),
        )


def _view_key(entry: LookEntry, path: Sequence[str] | None) -> tuple[Any, ...]:
    """Return the inputs that all looks of a sequence must share.
    path: sensors that replace the looks' own.
    """
    if path:
        return tuple(replace(scene, sensor=None) for scene in entry.scenes[:1]), entry.basis
    return entry.scenes, entry.basis
