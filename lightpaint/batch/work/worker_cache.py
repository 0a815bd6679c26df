"""The memory of a process that works on a batch: its scenes, bases and renderers."""

import gc
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import Basis
from lightpaint.basis.file.basis_file import read_basis
from lightpaint.basis.render.render_parts import PartRenderer
from lightpaint.batch.manifest.keys import Final
from lightpaint.batch.work.spool import read_guide_table
from lightpaint.batch.work.task import key_of_basis
from lightpaint.batch.work.work_items import (
    PaintingOfSums,
    PartOfBasis,
    Passes,
    SceneFilm,
    SumsOfRows,
)
from lightpaint.images.estimate import read_estimate
from lightpaint.pipeline.job.sources import BasisFile, GroupsFile, SceneFile
from lightpaint.placement.placement import read_placement
from lightpaint.scene.quality_presets import on_film
from lightpaint.scene.runtime.render_lock import tracing
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import Stream, pass_sum, passes_of
from lightpaint.target.target import Target


class PassRenderer:
    """A renderer of passes of one relit scene, which stays loaded until `close`.

    The sums of all ranges of passes equal those of one render to the last bit.
    """

    def __init__(self, scene: Scene, final: Final) -> None:
        self._scene, self._final = scene, final
        self._passes = passes_of(scene, final.spp)
        self._loaded_scene: Any = scene.load()

    def sum(self, passes: range) -> dict[int, Doubles]:
        """Return the undivided sums, (h, w, 3), of the given passes for each half, by the half."""
        sums: dict[int, Doubles] = {}
        for k in passes:
            half, spp = self._passes[k]
            seed, stream = self._final.seed, Stream.VERIFICATION
            with tracing():
                pass_total = pass_sum(
                    self._loaded_scene, self._scene, k, spp, seed=seed, stream=stream
                )
            sums[half] = sums[half] + pass_total if half in sums else pass_total
        return sums

    def close(self) -> None:
        """Release the scene."""
        self._loaded_scene = None
        gc.collect()


class WorkerCache:
    """Scenes and bases that several looks share; this process loads or renders each once."""

    def __init__(self) -> None:
        self._scenes: dict[str, SceneFile] = {}
        self._sources: dict[str, BasisFile | GroupsFile] = {}
        self._bases: dict[str, Basis] = {}
        self._renderer: PartRenderer | PassRenderer | None = None
        self._renderer_key = ""
        self._targets: dict[str, Target] = {}

    def scene(self, file: SceneFile) -> SceneFile:
        """Return the shared scene file that equals `file`; its first use loads it."""
        return self._scenes.setdefault(repr(file), file)

    def source(self, file: BasisFile | GroupsFile) -> BasisFile | GroupsFile:
        """Return the shared basis or light groups that equal `file`; the first use reads them."""
        return self._sources.setdefault(repr(file), file)

    def basis(self, key: str) -> Basis | None:
        """Return the basis of a key, if it is stored here. key: of `key_of_scene`."""
        return self._bases.get(key)

    def put(self, key: str, basis: Basis) -> None:
        """Store the basis of a key."""
        self._bases[key] = basis

    def load(self, key: str, file: str, former_look_file: str = "") -> None:
        """Load the basis of a key from a file that was written for workers.

        former_look_file: the picture before lights were moved; "" if none was.
        """
        if file and key not in self._bases:
            basis = read_basis(file)
            look = read_estimate(Path(former_look_file))[0] if former_look_file else None
            self._bases[key] = replace(basis, former=look)

    def film(self, film: SceneFilm) -> Scene:
        """Return the scene on a film."""
        scene = on_film(self.scene(film.scene).content, film.quality, film.resolution)
        if film.places:
            [scene] = read_placement(Path(film.places)).hung_in([scene]).scenes
        return scene.only(film.light_names) if film.light_names else scene

    def renderer(self, item: PartOfBasis | SumsOfRows) -> PartRenderer:
        """Return the renderer of a part; it stays loaded until an item of another basis comes."""
        key = repr((item.film.key, item.seed, item.guide_file))
        if not isinstance(self._renderer, PartRenderer) or self._renderer_key != key:
            self.release_renderer()
            scene = self.film(item.film)
            guide_table = read_guide_table(item.guide_file) if item.guide_file else None
            self._renderer, self._renderer_key = PartRenderer(scene, item.seed, guide_table), key
        return self._renderer

    def frame(self, item: Passes) -> PassRenderer:
        """Return the renderer of passes; it stays loaded until another scene's item comes."""
        key = repr((item.relit, item.final))
        if not isinstance(self._renderer, PassRenderer) or self._renderer_key != key:
            self.release_renderer()
            scene = self.film(SceneFilm(item.relit, None, item.final.resolution))
            self._renderer, self._renderer_key = PassRenderer(scene, item.final), key
        return self._renderer

    def target(self, request: PaintingOfSums, size: tuple[int, int]) -> Target:
        """Return a painting at the size of its basis, read once."""
        key = repr((request, size))
        if key not in self._targets:
            read = request.painting.without_content().content
            self._targets[key] = read.fitted_to(size, resize=request.resize)
        return self._targets[key]

    def release_renderer(self) -> None:
        """Release the renderer of parts or passes."""
        if self._renderer is not None:
            self._renderer.close()
        self._renderer = None
        self._targets = {}

    def keep_only(self, keys: Collection[str]) -> None:
        """Release all bases but those of these keys."""
        self._bases = {key: basis for key, basis in self._bases.items() if key in keys}
        self._sources = {k: x for k, x in self._sources.items() if key_of_basis(x) in keys}
