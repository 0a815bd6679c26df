"""What engines are given to do: steps of looks (see task.py), and parts of what is rendered.

An errand is files and plain values. It can be sent anywhere, done twice, and comes to the same.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Literal, Protocol

from lightpaint.basis.render.parts import Part
from lightpaint.batch.manifest.keys import Final
from lightpaint.lighting.fit import Emitters
from lightpaint.pipeline.sources import Painting, SceneFile, vars_of
from lightpaint.scene.presets import Quality

#: What becomes of a path where an errand is done elsewhere.
Move = Callable[[str], str]


class Errand(Protocol):
    """One thing to do."""

    @property
    def name(self) -> str:
        """Which no other errand of its kind has."""

    @property
    def kind(self) -> str:
        """What it is: `answer` or `render` of a look, `lesson`, `part`, `rows`, `passes`."""

    @property
    def needs(self) -> tuple[str, ...]:
        """Files that it reads."""

    @property
    def carried(self) -> tuple[str, ...]:
        """Files that it reads, too, which are made for it and only here."""

    @property
    def writes(self) -> str:
        """The folder that it fills; "" if what it comes to is returned."""

    @property
    def expected_s(self) -> float:
        """Roughly how long it takes one thread."""

    def moved(self, move: Move) -> "Errand":
        """The same by other paths."""


def spoken(errand: Errand) -> str:
    """What an errand is called: `evening: answer`, `part 3`."""
    is_step = errand.kind in ("answer", "render")
    return f"{errand.name}: {errand.kind}" if is_step else errand.name


@dataclass(frozen=True)
class Done:
    """What came of an errand. failure: why it came to nothing; "" where it is done.

    look: name of the errand, of steps that of the look. is_full: whether the disk is, and nothing
    more can be kept. is_lost: whether the worker died, and the same may well succeed elsewhere.
    spent_s: seconds. left_s: of all that is left. value: what is returned. files: what was written,
    by name in the folder, where that is another than is meant.
    """

    look: str
    kind: str
    failure: str = ""
    is_full: bool = False
    is_lost: bool = False
    spent_s: float = 0.0
    left_s: float | None = None
    value: Any = field(default=None, repr=False, compare=False)
    files: dict[str, bytes] | None = field(default=None, repr=False, compare=False)


@dataclass(frozen=True)
class SceneFilm:
    """A scene by its file, on the film that its basis is rendered on. files: all it is made of."""

    scene: SceneFile
    quality: Quality | None = None
    resolution: str | None = None
    files: tuple[str, ...] = ()

    def moved(self, move: Move) -> "SceneFilm":
        """The same by other paths."""
        return replace(
            self, scene=moved_scene(self.scene, move), files=tuple(map(move, self.files))
        )

    def unread(self) -> "SceneFilm":
        """Return the same, of which nothing is loaded yet."""
        return replace(self, scene=self.scene.unread())

    @property
    def key(self) -> str:
        """What two of the same have in common."""
        return json.dumps([vars_of(self.scene), self.quality, self.resolution])


@dataclass(frozen=True)
class Lesson:
    """What parts of a basis choose emitters by is learned. spp: that they come to."""

    name: str
    film: SceneFilm
    spp: int
    seed: int
    expected_s: float
    kind: Literal["lesson"] = "lesson"
    writes: str = ""
    carried: tuple[str, ...] = ()

    @property
    def needs(self) -> tuple[str, ...]:
        """As of `Errand`."""
        return self.film.files

    def moved(self, move: Move) -> "Lesson":
        """As of `Errand`."""
        return replace(self, film=self.film.moved(move))


@dataclass(frozen=True)
class PartOfBasis:
    """A part of a basis is rendered. learned: file of what the lesson came to; "" if nothing is."""

    name: str
    film: SceneFilm
    part: Part
    seed: int
    learned: str
    expected_s: float
    kind: Literal["part"] = "part"
    writes: str = ""

    @property
    def needs(self) -> tuple[str, ...]:
        """As of `Errand`."""
        return self.film.files

    @property
    def carried(self) -> tuple[str, ...]:
        """As of `Errand`."""
        return (self.learned,) if self.learned else ()

    def moved(self, move: Move) -> "PartOfBasis":
        """As of `Errand`."""
        learned = move(self.learned) if self.learned else ""
        return replace(self, film=self.film.moved(move), learned=learned)


@dataclass(frozen=True)
class PaintingOfSums:
    """A painting that sums are wanted with. emitters: as of `Fit`; resize: as of `Settings`."""

    painting: Painting
    emitters: Emitters
    resize: bool

    def moved(self, move: Move) -> "PaintingOfSums":
        """The same by other paths."""
        its = self.painting
        paths: dict[str, Any] = {
            name: value if (value := getattr(its, name)) is None else move(value)
            for name in ("path", "mask", "template")
        }
        return replace(self, painting=replace(its, **paths))


@dataclass(frozen=True)
class SumsOfRows:
    """Some rows of a basis are rendered, and nothing is kept but their sums with paintings.

    parts: all of these rows, in their order. learned: as of `PartOfBasis`. files: of the paintings.
    """

    name: str
    film: SceneFilm
    parts: tuple[Part, ...]
    seed: int
    learned: str
    paintings: tuple[PaintingOfSums, ...]
    files: tuple[str, ...]
    expected_s: float
    kind: Literal["rows"] = "rows"
    writes: str = ""

    @property
    def needs(self) -> tuple[str, ...]:
        """As of `Errand`."""
        return (*self.film.files, *self.files)

    @property
    def carried(self) -> tuple[str, ...]:
        """As of `Errand`."""
        return (self.learned,)

    def moved(self, move: Move) -> "SumsOfRows":
        """As of `Errand`."""
        return replace(
            self,
            film=self.film.moved(move),
            learned=move(self.learned),
            paintings=tuple(one.moved(move) for one in self.paintings),
            files=tuple(map(move, self.files)),
        )


@dataclass(frozen=True)
class Passes:
    """Some passes of a final render. relit: the scene, which is rendered as `final` says.

    first, last: passes, the last one not among them.
    """

    name: str
    relit: SceneFile
    final: Final
    first: int
    last: int
    files: tuple[str, ...]
    expected_s: float
    kind: Literal["passes"] = "passes"
    writes: str = ""
    carried: tuple[str, ...] = ()

    @property
    def needs(self) -> tuple[str, ...]:
        """As of `Errand`."""
        return self.files

    def moved(self, move: Move) -> "Passes":
        """As of `Errand`."""
        files = tuple(map(move, self.files))
        return replace(self, relit=moved_scene(self.relit, move), files=files)


def moved_scene(scene: SceneFile, move: Move) -> SceneFile:
    """The same scene by other paths."""
    lights_file = scene.lights_file
    return replace(
        scene, path=move(scene.path), lights_file=None if lights_file is None else move(lights_file)
    )
