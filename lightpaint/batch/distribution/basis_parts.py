"""Bases that an engine renders in parts."""

from dataclasses import replace
from typing import Any

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.render.banded_film import check_memory
from lightpaint.basis.render.basis_render import render_basis, training_samples, with_first_hits
from lightpaint.basis.render.render_origin import ONE_PASS, method_of
from lightpaint.basis.render.render_parts import Part, PartSums, plan_parts
from lightpaint.batch.distribution.engine import Engine
from lightpaint.batch.work.spool import Spool
from lightpaint.batch.work.work_items import GuideTraining, PartOfBasis, SceneFilm, render_seconds
from lightpaint.errors import BasisError
from lightpaint.progress import Progress
from lightpaint.scene.scene import Scene


class PartwiseRender:
    """A `render_basis` for `obtain_basis` that renders one film by an engine."""

    def __init__(self, engine: Engine, film: SceneFilm) -> None:
        self._engine = engine
        self._film = film.without_content()

    def __call__(
        self,
        scene: Scene,
        *,
        spp: int | None,
        time_s: float | None,
        seed: int,
        start: Basis | None = None,
        progress: Progress,
        **options: Any,
    ) -> Basis:
        """Render as `render_basis` does. This process alone spends and measures a time budget."""
        if time_s is not None:
            budget_options: dict[str, Any] = {
                "time_s": time_s,
                "seed": seed,
                "progress": progress,
                **options,
            }
            return render_basis(scene, start=start, **budget_options)
        spp = scene.spp if spp is None else spp
        if start is not None and start.origin.spp >= spp:
            return with_first_hits(start.with_requests(scene.requests), scene, seed)
        if start is not None and start.origin.method != method_of(scene):
            start = None
        if start is not None and start.sums is not None and method_of(scene) == ONE_PASS:
            # Adding whole parts to earlier sums changes the last bits, compared with one render.
            # That is acceptable only for a finished basis, which was rounded anyway.
            start = None
        check_memory(scene)
        parts = plan_parts(scene, spp, start=start)
        spool = Spool(scene, parts, seed=seed, start=start)
        film = self._film_of(scene)
        guide_table = obtain_guide_table(self._engine, film, scene, seed, start, spool)
        sums = PartSums(scene, parts, seed=seed, start=start)
        self._add_all(scene, parts, sums, seed, spool, progress)
        basis = sums.basis(guide_table)
        spool.drop()
        return basis

    def _film_of(self, scene: Scene) -> SceneFilm:
        """Return the film of `scene`, which may have only some of the lights."""
        return replace(self._film, light_names=scene.chosen)

    def _add_all(
        self,
        scene: Scene,
        parts: list[Part],
        sums: PartSums,
        seed: int,
        spool: Spool,
        progress: Progress,
    ) -> None:
        """Add all parts to `sums`: those that are cached, and those that the engine renders."""
        guide_file = str(spool.guide_file) if spool.guide_file.is_file() else ""
        missing = {}
        for k, part in enumerate(parts):
            cached = spool.part(part)
            if cached is not None:
                sums.add(part, *cached)
                continue
            pixels = (part.bottom - part.top) * scene.size[1]
            lights = len(scene.lights) if part.light is None else 1
            samples = pixels * part.spp * (2 if part.half is None else 1)
            expected_s = render_seconds(samples, lights)
            item = PartOfBasis(
                f"part {k}", self._film_of(scene), part, seed, guide_file, expected_s
            )
            missing[item.name] = item
        progress("basis", len(parts) - len(missing), len(parts), "parts")
        for count, result in enumerate(self._engine.run(list(missing.values()))):
            if result.failure:
                raise BasisError(result.failure)
            part, (planes, first_hits) = missing[result.look].part, result.value
            spool.keep_part(part, planes, first_hits)
            sums.add(part, planes, first_hits)
            progress("basis", len(parts) - len(missing) + count + 1, len(parts), "parts")


def obtain_guide_table(
    engine: Engine,
    film: SceneFilm,
    scene: Scene,
    seed: int,
    start: Basis | None,
    spool: Spool,
) -> Floats | None:
    """Return the guide's table by which parts choose emitters, and store it in the spool.

    None where parts do without, as in separate renders.
    """
    if method_of(scene) != ONE_PASS:
        return None
    table = spool.guide_table() if start is None else start.guide_table
    if table is None:
        expected_s = render_seconds(sum(training_samples(scene)), len(scene.lights))
        [result] = engine.run([GuideTraining("training", film, seed, expected_s)])
        if result.failure:
            raise BasisError(result.failure)
        table = result.value
        assert table is not None
    if not spool.guide_file.is_file():
        spool.keep_guide_table(table)
    return table
