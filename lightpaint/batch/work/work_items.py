"""Work items, which engines run: steps of looks, and parts of renders.

A work item is files and plain values. It can be sent anywhere and done twice, with the same result.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, is_dataclass, replace
from pathlib import Path
from typing import Any, Literal, Protocol

from lightpaint import pipeline
from lightpaint.basis.render import Part
from lightpaint.batch.manifest.entries import LookEntry
from lightpaint.batch.manifest.keys import SHIFTED_WORDS, Final, Handover, Space
from lightpaint.colour import Observer
from lightpaint.lighting import Emitters
from lightpaint.scene.quality_presets import Quality

#: Map from a path to that on another machine.
PathMap = Callable[[str], str]

#: Seconds of a sample of one pixel for all lights together, and in addition for each light.
SAMPLE_S, LIGHT_SAMPLE_S = 9.6e-7, 1e-8


#: Steps: the answer, its final render, and exports for other programs.
Kind = Literal["answer", "render", "export"]

#: Folder of the exports, in the folder of the look.
EXPORT = "export"


class WorkItem(Protocol):
    """A piece of work."""

    @property
    def name(self) -> str:
        """Name, unique among items of its kind."""

    @property
    def kind(self) -> str:
        """Kind: `answer` or `render` of a look, `training`, `part`, `rows`, `passes`, `places`."""

    @property
    def input_files(self) -> tuple[str, ...]:
        """Files that it reads."""

    @property
    def local_files(self) -> tuple[str, ...]:
        """Temporary files that it reads as well; they exist only on this machine."""

    @property
    def output_folder(self) -> str:
        """Folder that it fills; "" if it returns its result."""

    @property
    def expected_s(self) -> float:
        """Rough estimate of its time on one thread."""


def item_label(item: WorkItem) -> str:
    """Return the label of an item: `evening: answer`, `part 3`."""
    is_step = item.kind in ("answer", "render")
    return f"{item.name}: {item.kind}" if is_step else item.name


@dataclass(frozen=True)
class ItemResult:
    """The result of a work item. failure: the reason if it failed; "" if it is done.

    look: name of the item; for a step, of its look. is_disk_full: whether nothing more can be
    written. is_lost: whether the worker died, and the item may well succeed elsewhere. spent_s:
    seconds it took. left_s: estimated seconds for the remaining steps. value: the returned value.
    files: written files by their name in the folder, if another machine wrote them.
    """

    look: str
    kind: str
    failure: str = ""
    is_disk_full: bool = False
    is_lost: bool = False
    spent_s: float = 0.0
    left_s: float | None = None
    value: Any = field(default=None, repr=False, compare=False)
    files: dict[str, bytes] | None = field(default=None, repr=False, compare=False)


@dataclass(frozen=True)
class SceneFilm:
    """A scene by its file, on the film that its basis is rendered on.

    files: all files of the scene. light_names: the lights to render, if not all. places: file of
    the places of lights that moved or are new; "" if none did.
    """

    scene: pipeline.SceneFile
    quality: Quality | None = None
    resolution: str | None = None
    files: tuple[str, ...] = ()
    light_names: tuple[str, ...] = ()
    places: str = ""

    def without_content(self) -> "SceneFilm":
        """Return the same film, with nothing loaded yet."""
        return replace(self, scene=self.scene.without_content())

    @property
    def key(self) -> str:
        """Key that equal films share."""
        film = [pipeline.vars_of(self.scene), self.quality, self.resolution, self.light_names]
        return json.dumps([*film, *([self.places] if self.places else [])])


@dataclass(frozen=True)
class GuideTraining:
    """An item that trains the emitter guide of a basis."""

    name: str
    film: SceneFilm
    seed: int
    expected_s: float
    kind: Literal["training"] = "training"
    output_folder: str = ""
    local_files: tuple[str, ...] = ()

    @property
    def input_files(self) -> tuple[str, ...]:
        """Files of the scene."""
        return self.film.files


@dataclass(frozen=True)
class PartOfBasis:
    """An item that renders a part of a basis. guide_file: of the guide's table; "" if none."""

    name: str
    film: SceneFilm
    part: Part
    seed: int
    guide_file: str
    expected_s: float
    kind: Literal["part"] = "part"
    output_folder: str = ""

    @property
    def input_files(self) -> tuple[str, ...]:
        """Files of the scene."""
        return self.film.files

    @property
    def local_files(self) -> tuple[str, ...]:
        """File of the guide's table."""
        return (self.guide_file,) if self.guide_file else ()


@dataclass(frozen=True)
class PaintingOfSums:
    """A painting to form sums with. emitters: of `Fit`; resize: of `Settings`."""

    painting: pipeline.Painting
    emitters: Emitters
    resize: bool


@dataclass(frozen=True)
class SumsOfRows:
    """An item that renders rows of a basis, and returns only their sums with paintings.

    part: the rows with all their samples. guide_file: see `PartOfBasis`. files: of the paintings.
    """

    name: str
    film: SceneFilm
    part: Part
    seed: int
    guide_file: str
    paintings: tuple[PaintingOfSums, ...]
    files: tuple[str, ...]
    expected_s: float
    kind: Literal["rows"] = "rows"
    output_folder: str = ""

    @property
    def input_files(self) -> tuple[str, ...]:
        """Files of the scene and of the paintings."""
        return (*self.film.files, *self.files)

    @property
    def local_files(self) -> tuple[str, ...]:
        """File of the guide's table."""
        return (self.guide_file,)


@dataclass(frozen=True)
class Passes:
    """An item that renders passes of a final render. relit: the scene. final: its options.

    first, last: range of passes; the last one is not included. observer: what sees it, of a render
    with spectra.
    """

    name: str
    relit: pipeline.SceneFile
    final: Final
    first: int
    last: int
    files: tuple[str, ...]
    expected_s: float
    kind: Literal["passes"] = "passes"
    output_folder: str = ""
    local_files: tuple[str, ...] = ()
    observer: Observer | None = None

    @property
    def input_files(self) -> tuple[str, ...]:
        """Files of the scene."""
        return self.files


def render_seconds(samples: int, lights: int) -> float:
    """Return the seconds for that many samples of a basis."""
    return samples * (SAMPLE_S + LIGHT_SAMPLE_S * lights)


@dataclass(frozen=True)
class Task:
    """A step of one look, of files and plain values.

    look: name. kind: step. job: the text of `Job.to_json`; without a target if it is derived.
    lightings: files that it combines; source_files: all others but bases; share, space: between two
    lightings; mireds: how much warmer. final: options of the final render. handover: exports for
    other programs. bases: keys of its bases; files: where these are saved, "" if they have to be
    obtained; former_look_files: the pictures before lights were moved. places: file of the places
    of lights that may move, which one search for all looks that share them writes. expected_s:
    rough estimate of its time. is_by_sums: whether only the lighting is requested.
    """

    look: str
    kind: Kind
    job: str
    lightings: tuple[str, ...] = ()
    source_files: tuple[str, ...] = ()
    share: float = 0.0
    space: Space = "log"
    mireds: float = 0.0
    final: Final = field(default_factory=Final)
    handover: Handover = field(default_factory=Handover)
    bases: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    former_look_files: tuple[str, ...] = ()
    places: str = ""
    expected_s: float = 0.0
    is_by_sums: bool = False

    @property
    def name(self) -> str:
        """Name of the look; see `WorkItem`."""
        return self.look

    @property
    def output_folder(self) -> str:
        """Folder of the results; see `WorkItem`."""
        return str(json.loads(self.job)["folder"])

    @property
    def force(self) -> bool:
        """True if results of something else, or changed by hand, are replaced."""
        return bool(json.loads(self.job)["settings"]["force"])

    @property
    def input_files(self) -> tuple[str, ...]:
        """Files that it reads (see `WorkItem`); a render needs those beside its lighting, too."""
        results: list[str] = []
        if self.kind == "render":
            results = [str(x) for x in sorted(Path(self.output_folder).rglob("*")) if x.is_file()]
        places = [self.places] if self.places and self.kind == "answer" else []
        return tuple(dict.fromkeys([*self.source_files, *self.lightings, *places, *results]))

    @property
    def local_files(self) -> tuple[str, ...]:
        """Saved bases; see `WorkItem`."""
        return tuple(file for file in (*self.files, *self.former_look_files) if file)


def answer_task(
    entry: LookEntry,
    folders: Mapping[str, Path],
    *,
    source_files: Sequence[Path] = (),
    force: bool,
    command: str,
) -> Task:
    """Return the task of a look's answer. folders: of all looks, by name."""
    lightings = [str(folders[name] / "lighting.json") for name in entry.combined_looks]
    return Task(
        entry.name,
        "answer",
        pipeline.encode_job(
            entry.scenes,
            entry.paintings,
            entry.basis,
            entry.constraints,
            replace(entry.settings, force=force, command=command),
            folder=str(folders[entry.name]),
            by_sensor=entry.by_sensor,
            placement=pipeline.PlacementFile(entry.places) if entry.places else None,
        ),
        tuple([entry.lighting] if entry.lighting else lightings),
        tuple(map(str, source_files)),
        entry.share,
        entry.space,
        SHIFTED_WORDS.get(entry.variation, 0.0),
        entry.final,
        entry.handover,
        bases_of(entry),
        ("",) * len(bases_of(entry)),
        places=entry.places,
        is_by_sums=entry.is_by_sums,
    )


def render_task(answer: Task, entry: LookEntry, folder: Path) -> Task:
    """Return the task of a look's final render. answer: the task of its answer, in `folder`."""
    lighting = str(folder / "lighting.json")
    return Task(
        entry.name, "render", answer.job, (lighting,), answer.source_files, final=entry.final
    )


def export_task(answer: Task, entry: LookEntry, folder: Path) -> Task:
    """Return the task of a look's exports. answer: the task of its answer, in `folder`."""
    lighting = str(folder / "lighting.json")
    # An export to light groups needs their names.
    bases = answer.bases if isinstance(entry.basis, pipeline.GroupsFile) else ()
    options: dict[str, Any] = {"handover": entry.handover, "bases": bases}
    return Task(entry.name, "export", answer.job, (lighting,), answer.source_files, **options)


def bases_of(entry: LookEntry) -> tuple[str, ...]:
    """Return the key of each basis that a look is solved with: equal keys mean equal bases."""
    if entry.basis is not None:
        return (key_of_basis(entry.basis),)
    return tuple(key_of_scene(scene, entry.settings, entry.places) for scene in entry.scenes)


def key_of_basis(basis: pipeline.BasisFile | pipeline.GroupsFile) -> str:
    """Return the key of a saved basis, or of light groups."""
    return json.dumps({"basis": asdict(basis)})


def key_of_scene(scene: pipeline.SceneFile, settings: pipeline.Settings, places: str = "") -> str:
    """Return the key of a rendered basis: the scene with its sensor, and the render settings.

    places: file of the places of lights that may move; "" for the basis of the unchanged scene.
    """
    key = {"scene": asdict(scene), **render_settings(settings)}
    return json.dumps(key | ({"places": places} if places else {}))


def render_settings(settings: pipeline.Settings) -> dict[str, Any]:
    """Return the settings that a rendered basis depends on, by name."""
    names = ("spp", "time_s", "error", "seed", "resolution", "quality", "use_cache", "exact_spp")
    return {name: getattr(settings, name) for name in names}


def with_paths(value: Any, move: PathMap) -> Any:
    """Return a work item, or what is in one, with other paths; `move` leaves all other texts
    unchanged.
    """
    if isinstance(value, str):
        return move(value)
    if isinstance(value, dict):
        return {key: with_paths(x, move) for key, x in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(with_paths(x, move) for x in value)
    if not is_dataclass(value) or isinstance(value, type):
        return value
    moved = {x.name: with_paths(getattr(value, x.name), move) for x in fields(value) if x.init}
    if isinstance(value, Task):  # whose job and keys are texts of JSON
        moved["job"] = _json_with_paths(value.job, move)
        moved["bases"] = tuple(_json_with_paths(key, move) for key in value.bases)
    return replace(value, **moved)


def _json_with_paths(text: str, move: PathMap) -> str:
    return json.dumps(with_paths(json.loads(text), move))
