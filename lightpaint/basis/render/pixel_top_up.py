"""Adds samples to selected pixels of a basis, where they matter most.

A plane holds means of samples, so more samples in a pixel only reduce its noise. Both halves get
equal numbers of samples in each pixel, so half their difference still estimates the noise of the
mean. Extra samples are terms of a separate sequence, far from the terms of the uniform samples, so
either sequence can be continued independently of the other.
"""

import gc
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from lightpaint.arrays import Floats, Indices
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.planes import IndirectLight, Planes, as_planes
from lightpaint.basis.render import rendered_basis
from lightpaint.basis.render.basis_render import train_tracer
from lightpaint.basis.render.integrators import has_indirect_planes, plane_count
from lightpaint.basis.render.render_budget import PASS_DIVISOR
from lightpaint.basis.render.render_parts import PART_MAX_BYTES
from lightpaint.errors import BasisError
from lightpaint.progress import Interrupted, Progress, silent
from lightpaint.scene import Scene, largest_pass, view_seed
from lightpaint.scene.runtime.mitsuba_errors import render_errors
from lightpaint.scene.runtime.render_lock import MITSUBA, tracing

if TYPE_CHECKING:
    from lightpaint.basis.render.tracer.one_pass import Tracer


class KeptTracer:
    """Tracers of the last top-ups, whose scene stays loaded until another one is needed.

    views: one scene through several sensors, which is loaded once for all of them.
    """

    def __init__(self, views: Sequence[Scene] = ()) -> None:
        self._views = tuple(views)
        self._tracers: dict[int, tuple[Tracer, int]] = {}  # by index of the view, with the seed

    def of(self, scene: Scene, basis: Basis) -> "Tracer":
        """Return a tracer that continues `basis`, which was rendered from `scene`."""
        from lightpaint.basis.render.tracer.one_pass import Tracer

        seed, table = basis.origin.seed, basis.guide_table
        if not any(view is scene for view in self._views):
            self.close()
            self._views = (scene,)
        number = next(k for k, view in enumerate(self._views) if view is scene)
        tracer, its_seed = self._tracers.get(number, (None, seed))
        if tracer is None or its_seed != seed or not _is_equal(tracer.guide_table, table):
            loaded = next((x.loaded for x, _ in self._tracers.values()), None)
            other_views = [view for view in self._views if view is not scene]
            numbers = view_seed(seed, scene.sensor)
            tracer = Tracer(scene, numbers, table, loaded=loaded, views=other_views)
            self._tracers[number] = tracer, seed
        return tracer

    def close(self) -> None:
        """Release the loaded scene."""
        if self._tracers:
            for tracer, _ in self._tracers.values():
                tracer.close()
            self._tracers = {}
            gc.collect()


def _is_equal(a: Floats | None, b: Floats | None) -> bool:
    return a is b or (a is not None and b is not None and np.array_equal(a, b))


@contextmanager
def kept_loaded(views: Sequence[Scene] = ()) -> Iterator[KeptTracer]:
    """Acquire Mitsuba, and keep the scene loaded between top-ups within the block.

    views: as in `KeptTracer`.
    """
    with MITSUBA.acquired():
        tracers = KeptTracer(views)
        try:
            yield tracers
        finally:
            tracers.close()


def top_up(
    scene: Scene,
    basis: Basis,
    counts: Indices,
    *,
    keep: Callable[[Basis], bool] | None = None,
    progress: Progress = silent,
    is_enough: Callable[[], bool] = lambda: False,
    tracers: KeptTracer | None = None,
) -> Basis:
    """Return `basis` with additional samples in some pixels.

    scene: the scene from which `basis` was rendered in one pass. counts: (h, w), number of samples
    to add to each half, which must not depend on the light of the same pixel. is_enough: checked
    between passes; True stops early. keep: called with the basis so far when Ctrl-C ends the work
    early; returns whether it was stored. tracers: from `kept_loaded`, to keep the scene loaded.
    Raises BasisError if the basis does not belong to the scene, and Interrupted on Ctrl-C.
    """
    if basis.origin.method != rendered_basis.ONE_PASS or not rendered_basis.is_of(
        scene, basis, basis.origin.seed
    ):
        raise BasisError("the basis to top up is not a one-pass basis of this scene and film")
    sums = _PlaneSums(scene, basis)
    batches = list(pixel_batches(counts, 2 * plane_count(scene)))
    with (
        nullcontext(tracers) if tracers is not None else kept_loaded() as kept_tracers,
        render_errors(scene.path),
    ):
        try:
            with scene.variant(), tracing() as let_others_through:
                tracer = kept_tracers.of(scene, basis)
                if batches and not tracer.is_trained:
                    train_tracer(tracer, let_others_through)
                sums.guide_table = tracer.guide_table
                progress("top-up", 0, len(batches))
                for k, pixels in enumerate(batches):
                    if is_enough():
                        break
                    first, spp = (x.ravel()[pixels] for x in (sums.extra, counts))
                    halves = _trace_halves(tracer, pixels, first, spp, let_others_through)
                    sums.add(pixels, halves, spp)
                    progress("top-up", k + 1, len(batches))
        except KeyboardInterrupt:
            if keep is None or not keep(sums.basis()):
                raise
            raise Interrupted(
                "the samples so far are kept; run the same command to continue"
            ) from None
    return sums.basis()


def _trace_halves(
    tracer: "Tracer", pixels: Indices, first: Indices, spp: Indices, pause: Callable[[], None]
) -> list[Floats]:
    """Return the undivided sums of new samples of both halves, (n or 2n, 1, p, 3).

    first, spp: as in `Tracer.top_up`. pause: called after each half.
    """
    halves = []
    for half in range(2):
        planes = tracer.pixel_planes(pixels.size)
        tracer.top_up(planes, half, pixels, first, spp)
        halves.append(planes.sums())
        pause()
    return halves


def pixel_batches(counts: Indices, planes: int) -> Iterator[Indices]:
    """Yield batches of pixels that need samples, (p,) each, fewest samples first.

    The pixels of a batch are traced in parallel, so they should need similar numbers of samples. A
    batch is a short pass, and is small enough that its planes take little memory. planes: number of
    planes per pixel.
    """
    flat = counts.ravel()
    pixels = np.flatnonzero(flat)
    pixels = pixels[np.argsort(flat[pixels], kind="stable")]
    ends = np.cumsum(flat[pixels], dtype=np.int64)
    largest, max_count = (
        largest_pass(1, shorter=PASS_DIVISOR),
        max(1, PART_MAX_BYTES // (12 * planes)),
    )
    start = 0
    while start < pixels.size:
        offset = ends[start - 1] if start else 0
        end = max(start + 1, int(np.searchsorted(ends, offset + largest, side="right")))
        end = min(end, start + max_count)
        yield pixels[start:end]
        start = end


class _PlaneSums:
    """Images and half differences of a basis, to which samples of selected pixels are added.

    extra: (h, w), number of samples of each half that were added to a pixel. guide_table: the table
    by which emitters are chosen.
    """

    def __init__(self, scene: Scene, basis: Basis) -> None:
        self._basis, self._lights = basis, len(scene.lights)
        self.extra = np.zeros(basis.size, np.intp) if basis.extra is None else basis.extra.copy()
        self.guide_table = basis.guide_table
        self._is_split = basis.indirect is not None and has_indirect_planes(scene)
        self._all = [basis.planes.array().copy(), basis.noise.array().copy()]
        if self._is_split and basis.indirect is not None:
            self._all += [
                planes.array().copy() for planes in (basis.indirect.planes, basis.indirect.noise)
            ]

    def add(self, pixels: Indices, halves: list[Floats], spp: Indices) -> None:
        """Add undivided sums of `spp` samples of both halves, (n or 2n, 1, p, 3)."""
        n, first = self._lights, self.extra.ravel()[pixels]
        indirect = [half[n:] for half in halves]
        totals = [half[:n] for half in halves]
        for total, part in zip(totals, indirect, strict=True):
            total[: len(part)] += part
        for which, added in enumerate((totals, indirect)[: 1 + self._is_split]):
            pair = self._all[2 * which : 2 * which + 2]
            for k, (a, b) in enumerate(self._half_spp()):
                light_halves = [half[k : k + 1] for half in added]
                old, new = (
                    [(x + y)[:, None].astype(np.float32) for x in (a, b)]
                    for y in (first, first + spp)
                )
                old_planes = [
                    as_planes(flat(plane[k : k + 1])[:, pixels][:, None]) for plane in pair
                ]
                rendered_basis.add_halves(light_halves, old_planes[0], old_planes[1], old)
                for plane, updated in zip(
                    pair, rendered_basis.mean_and_half_difference(light_halves, new), strict=True
                ):
                    flat(plane)[k, pixels] = updated[0, 0]
        self.extra.ravel()[pixels] += spp

    def _half_spp(self) -> list[tuple[int, int]]:
        """Return the number of uniform samples in both halves for each light."""
        origin = self._basis.origin
        if origin.each_light:
            return [counts[:2] for counts in origin.each_light]
        return [origin.halves] * self._lights

    def basis(self) -> Basis:
        """Return the basis with all added samples."""
        planes: list[Planes] = [as_planes(x) for x in self._all]
        mean = 2 * float(self.extra.mean(dtype=np.float64))
        return replace(
            self._basis,
            planes=planes[0],
            noise=planes[1],
            indirect=IndirectLight(planes[2], planes[3]) if self._is_split else None,
            extra=self.extra if mean else None,
            origin=replace(self._basis.origin, extra_spp=mean),
            guide_table=self.guide_table,
            sums=None,
        )


def flat(planes: Floats) -> Floats:
    """Return planes (n, h, w, 3) as (n, h w, 3), sharing memory."""
    return planes.reshape(len(planes), -1, 3)
