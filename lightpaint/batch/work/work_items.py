"""Work items, which engines run: steps of looks (see task.py), and parts of renders.

A work item is files and plain values. It can be sent anywhere and done twice, with the same result.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Protocol

from lightpaint.basis.render import Part
from lightpaint.batch.manifest.keys import Final
from lightpaint.colour import Observer
from lightpaint.lighting import Emitters
from lightpaint.pipeline import Painting, SceneFile, vars_of
from lightpaint.scene.quality_presets import Quality

#: Map from a path to that on another machine.
PathMap = Callable[[str], str]

#: Seconds of a sample of one pixel for all lights together, and in addition for each light.
SAMPLE_S, LIGHT_SAMPLE_S = 9.6e-7, 1e-8


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

    def with_paths(self, move: PathMap) -> "WorkItem":
        """Return the same item with other paths."""


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

    scene: SceneFile
    quality: Quality | None = None
    resolution: str | None = None
    files: tuple[str, ...] = ()
    light_names: tuple[str, ...] = ()
    places: str = ""

    def with_paths(self, move: PathMap) -> "SceneFilm":
        """Return the same with other paths."""
        return replace(
            self,
            scene=scene_with_paths(self.scene, move),
            files=tuple(map(move, self.files)),
            places=self.places and move(self.places),
        )

    def without_content(self) -> "SceneFilm":
        """Return the same film, with nothing loaded yet."""
        return replace(self, scene=self.scene.without_content())

    @property
    def key(self) -> str:
        """Key that equal films share."""
        film = [vars_of(self.scene), self.quality, self.resolution, self.light_names]
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

    def with_paths(self, move: PathMap) -> "GuideTraining":
        """Return the same item with other paths."""
        return replace(self, film=self.film.with_paths(move))


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

    def with_paths(self, move: PathMap) -> "PartOfBasis":
        """Return the same item with other paths."""
        guide_file = move(self.guide_file) if self.guide_file else ""
        return replace(self, film=self.film.with_paths(move), guide_file=guide_file)


@dataclass(frozen=True)
class PaintingOfSums:
    """A painting to form sums with. emitters: of `Fit`; resize: of `Settings`."""

    painting: Painting
    emitters: Emitters
    resize: bool

    def with_paths(self, move: PathMap) -> "PaintingOfSums":
        """Return the same with other paths."""
        painting = self.painting
        paths: dict[str, Any] = {
            name: value if (value := getattr(painting, name)) is None else move(value)
            for name in ("path", "mask", "template")
        }
        return replace(self, painting=replace(painting, **paths))


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

    def with_paths(self, move: PathMap) -> "SumsOfRows":
        """Return the same item with other paths."""
        return replace(
            self,
            film=self.film.with_paths(move),
            guide_file=move(self.guide_file),
            paintings=tuple(painting.with_paths(move) for painting in self.paintings),
            files=tuple(map(move, self.files)),
        )


@dataclass(frozen=True)
class Passes:
    """An item that renders passes of a final render. relit: the scene. final: its options.

    first, last: range of passes; the last one is not included. observer: what sees it, of a render
    with spectra.
    """

    name: str
    relit: SceneFile
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

    def with_paths(self, move: PathMap) -> "Passes":
        """Return the same item with other paths."""
        files = tuple(map(move, self.files))
        return replace(self, relit=scene_with_paths(self.relit, move), files=files)


def scene_with_paths(scene: SceneFile, move: PathMap) -> SceneFile:
    """Return the same scene with other paths."""

    def moved(path: str | None) -> str | None:
        return None if path is None else move(path)

    return replace(
        scene,
        path=move(scene.path),
        lights_file=moved(scene.lights_file),
        observer=moved(scene.observer),
    )


def render_seconds(samples: int, lights: int) -> float:
    """Return the seconds for that many samples of a basis."""
    return samples * (SAMPLE_S + LIGHT_SAMPLE_S * lights)
