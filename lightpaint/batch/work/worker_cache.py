"""What a process has at hand while it works on a batch."""

from collections.abc import Collection

from lightpaint.basis.basis import Basis
from lightpaint.basis.file import read_basis
from lightpaint.basis.render.parts import PartRenderer
from lightpaint.batch.work.render_passes import Frame
from lightpaint.batch.work.spool import read_lesson
from lightpaint.batch.work.task import key_of_basis
from lightpaint.batch.work.work_items import (
    PaintingOfSums,
    PartOfBasis,
    Passes,
    SceneFilm,
    SumsOfRows,
)
from lightpaint.pipeline.sources import BasisFile, GroupsFile, SceneFile
from lightpaint.scene.presets import on_film
from lightpaint.scene.scene import Scene
from lightpaint.target.target import Target


class WorkerCache:
    """Scenes and bases that several looks share, each loaded or rendered once in this process."""

    def __init__(self) -> None:
        self._scenes: dict[str, SceneFile] = {}
        self._saved: dict[str, BasisFile | GroupsFile] = {}
        self._bases: dict[str, Basis] = {}
        self._renderer: PartRenderer | Frame | None = None
        self._rendered = ""
        self._targets: dict[str, Target] = {}

    def scene(self, given: SceneFile) -> SceneFile:
        """The one that equals `given`, and is loaded by and by."""
        return self._scenes.setdefault(repr(given), given)

    def saved(self, given: BasisFile | GroupsFile) -> BasisFile | GroupsFile:
        """The one of the same file, which is read by and by."""
        return self._saved.setdefault(repr(given), given)

    def basis(self, key: str) -> Basis | None:
        """That of that key, if it is held. key: `key_of_scene`."""
        return self._bases.get(key)

    def hold(self, key: str, basis: Basis) -> None:
        """Hold the basis of that key."""
        self._bases[key] = basis

    def read(self, key: str, file: str) -> None:
        """Hold the basis of that key, which was saved for workers."""
        if file and key not in self._bases:
            self._bases[key] = read_basis(file)

    def film(self, film: SceneFilm) -> Scene:
        """The scene on it."""
        return on_film(self.scene(film.scene).content, film.quality, film.resolution)

    def renderer(self, errand: PartOfBasis | SumsOfRows) -> PartRenderer:
        """What renders that part; it stays loaded until the next errand is another basis's."""
        key = repr((errand.film.key, errand.seed, errand.learned))
        if not isinstance(self._renderer, PartRenderer) or self._rendered != key:
            self.rest()
            scene = self.film(errand.film)
            learned = read_lesson(errand.learned) if errand.learned else None
            self._renderer, self._rendered = PartRenderer(scene, errand.seed, learned), key
        return self._renderer

    def frame(self, errand: Passes) -> Frame:
        """What renders those passes; it stays loaded as well."""
        key = repr((errand.relit, errand.final))
        if not isinstance(self._renderer, Frame) or self._rendered != key:
            self.rest()
            scene = self.film(SceneFilm(errand.relit, None, errand.final.resolution))
            self._renderer, self._rendered = Frame(scene, errand.final), key
        return self._renderer

    def target(self, wanted: PaintingOfSums, size: tuple[int, int]) -> Target:
        """A painting at the size of its basis, read once."""
        key = repr((wanted, size))
        if key not in self._targets:
            read = wanted.painting.unread().content
            self._targets[key] = read.fitted_to(size, resize=wanted.resize)
        return self._targets[key]

    def rest(self) -> None:
        """Let go of what is loaded to render parts."""
        if self._renderer is not None:
            self._renderer.close()
        self._renderer = None
        self._targets = {}

    def only(self, keys: Collection[str]) -> None:
        """Let go of all bases but those."""
        self._bases = {key: basis for key, basis in self._bases.items() if key in keys}
        self._saved = {k: x for k, x in self._saved.items() if key_of_basis(x) in keys}
