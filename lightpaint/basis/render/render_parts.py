"""A basis rendered in independent parts, which can be distributed over many processes.

A part is some rows of the picture or, if each light is rendered separately, a pass of one light.
The parts follow from scene and samples alone, and the samples of a pixel are added in a fixed
order. So the basis equals the basis of `render_basis` bit by bit, whichever process renders which
part, in any order, and however often one fails.
"""

import gc
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render import rendered_basis, separate_renders
from lightpaint.basis.render.banded_film import (
    FileSums,
    planes_of_sums,
    renders_in_bands,
)
from lightpaint.basis.render.basis_render import with_first_hits
from lightpaint.basis.render.integrators import plane_count
from lightpaint.basis.render.render_budget import PASS_DIVISOR, half_of
from lightpaint.scene import SAMPLES_PER_PASS, Scene, largest_pass, view_seed
from lightpaint.scene.runtime.render_lock import MITSUBA, tracing

#: Number of camera samples in a part: some seconds on one processor, the work lost by a failure.
PART_SAMPLES = SAMPLES_PER_PASS // 2

#: Maximum size in bytes of the images of a part.
PART_MAX_BYTES = 2**27


@dataclass(frozen=True)
class Part:
    """A part of the samples of a basis.

    top, bottom: its rows, `bottom` excluded. first: number of earlier samples per pixel of each
    half. spp: number of its samples per pixel of each half.
    light, half: index of the light and half (0 or 1) that a pass of separate renders belongs to.
    number: index of that pass for its light and half.
    """

    top: int
    bottom: int
    first: int
    spp: int
    light: int | None = None
    half: int | None = None
    number: int = 0

    @property
    def place(self) -> tuple[int, int]:
        """Light and half of a pass; passes with the same values are added up."""
        assert self.light is not None
        assert self.half is not None
        return self.light, self.half


def plan_parts(scene: Scene, spp: int, *, start: Basis | None = None) -> list[Part]:
    """Return the parts that bring a basis of `scene` to `spp` samples per pixel, in order.

    start: an existing basis whose samples count.
    """
    height, width = scene.size
    if rendered_basis.method_of(scene) != rendered_basis.ONE_PASS:
        return _separate_parts(scene, spp, start)
    done = 0 if start is None else start.origin.halves[0]
    remainder = half_of(spp) - done
    if remainder <= 0:
        return []
    # The number of rows is chosen so that all their samples take some seconds.
    by_work = PART_SAMPLES // (2 * width * remainder)
    by_memory = PART_MAX_BYTES // (2 * plane_count(scene) * width * 12)
    count = -(-height // max(1, min(by_work, by_memory)))
    edges = [height * k // count for k in range(count + 1)]
    return [Part(top, bottom, done, remainder) for top, bottom in pairwise(edges)]


def _separate_parts(scene: Scene, spp: int, start: Basis | None) -> list[Part]:
    """Return the passes of each light, numbered from the first pass of `start`."""
    height, _ = scene.size
    sums = (
        separate_renders.LightSums(len(scene.lights), (0, 0))
        if start is None
        else separate_renders.LightSums.counted(start)
    )
    parts = []
    for light in range(len(scene.lights)):
        done, numbers = list(sums.done(light)), sums.passes[light].tolist()
        for half, pass_spp in separate_renders.plan_of_light(scene, spp, done=(done[0], done[1])):
            parts.append(Part(0, height, done[half], pass_spp, light, half, numbers[half]))
            done[half] += pass_spp
            numbers[half] += 1
    return parts


class PartRenderer:
    """Renders parts of one scene, which stays loaded in between. Close it before loading another
    scene.

    guide_table: from `train_guide`, or from the basis to which samples are added.
    """

    def __init__(self, scene: Scene, seed: int, guide_table: Floats | None) -> None:
        self._scene, self._seed, self._guide_table = (
            scene,
            view_seed(seed, scene.sensor),
            guide_table,
        )
        self._tracer: Any = None
        self._light: int | None = None
        self._loaded: Any = None

    @MITSUBA.acquired()
    def render(self, part: Part) -> tuple[Floats, Floats]:
        """Return the sums of a part's samples and the number of rays that saw an emitter, for each
        half.

        (halves, lights, rows, w, 3) and (halves, rows, w) float32. A part of separate renders has a
        single half and light.
        """
        if part.light is not None:
            return self._of_light(part, part.light)
        if self._tracer is None:
            from lightpaint.basis.render.tracer.one_pass import Tracer

            self._tracer = Tracer(self._scene, self._seed, self._guide_table)
        rows, size = range(part.top, part.bottom), (part.bottom - part.top, self._scene.size[1])
        # A running kernel cannot be interrupted.
        step = largest_pass(size[0] * size[1], shorter=PASS_DIVISOR)
        halves = [self._tracer.planes(rows) for _ in range(2)]
        with self._scene.variant(), tracing() as let_others_through:
            for half, planes in enumerate(halves):
                for done in range(0, part.spp, step):
                    pass_spp = min(step, part.spp - done)
                    self._tracer.add(planes, half, rows, part.first + done, pass_spp)
                    let_others_through()
        return np.stack([x.sums() for x in halves]), np.stack([x.seen() for x in halves])

    def _of_light(self, part: Part, light: int) -> tuple[Floats, Floats]:
        if self._light != light:
            self.close()
            self._loaded = separate_renders.load_one_light(self._scene, light)
            self._light = light
        assert part.half is not None
        which = light, part.half, part.number, part.spp, self._seed
        with tracing():
            image = separate_renders.light_pass(self._loaded, self._scene, *which)
        return image[None, None], np.zeros((1, *self._scene.size), np.float32)

    def close(self) -> None:
        """Release the loaded scene."""
        if self._tracer is not None:
            self._tracer.close()
        self._tracer = self._loaded = self._light = None
        gc.collect()


class PartSums:
    """The sums of parts, which may arrive in any order.

    start: the basis to which they are added.
    """

    def __init__(
        self, scene: Scene, parts: Sequence[Part], *, seed: int, start: Basis | None = None
    ) -> None:
        self._scene, self._seed, self._start = scene, seed, start
        self._left = set(parts)
        self._lights: LightPasses | None = None
        if rendered_basis.method_of(scene) != rendered_basis.ONE_PASS:
            self._lights = LightPasses(scene, parts, start)
            return
        self._half = 0 if start is None else start.origin.halves[0]
        self._half += parts[0].spp if parts else 0
        #: Allocated when the first part tells the number of planes and channels; in a file where
        #: `render_basis` keeps them in one, too.
        self._halves: Floats | FileSums | None = None
        if renders_in_bands(scene, start):
            self._halves = FileSums((2, plane_count(scene), *scene.size, 3))
        self._seen = np.zeros(scene.size, np.float32)

    def add(self, part: Part, planes: Floats, seen: Floats) -> None:
        """Add what `PartRenderer.render` returned for a part."""
        self._left.remove(part)
        if self._lights is not None:
            self._lights.add(part, planes[0, 0])
            return
        if self._halves is None:
            halves, lights, _, _, channels = planes.shape
            self._halves = np.zeros((halves, lights, *self._scene.size, channels), np.float32)
        if isinstance(self._halves, FileSums):
            for half, sums in enumerate(planes):
                self._halves.write(half, range(part.top, part.bottom), sums)
        else:
            self._halves[:, :, part.top : part.bottom] = planes
        self._seen[part.top : part.bottom] = seen.sum(axis=0)

    def basis(self, guide_table: Floats | None) -> Basis:
        """Return the basis after all parts were added; the sums are released.

        guide_table: the table by which emitters were chosen.
        """
        assert not self._left
        scene, start = self._scene, self._start
        if self._lights is not None:
            start_basis = self._lights.basis(self._seed)
        elif self._halves is None:  # `start` had all samples, so there were no parts
            assert start is not None
            start_basis = start
        elif isinstance(self._halves, FileSums):
            pairs = planes_of_sums(self._halves, len(scene.lights), self._half)
            of_render = scene, self._seed, self._seen > 0, self._half, guide_table
            start_basis = rendered_basis.basis_of_planes(
                pairs, *of_render, is_finished=True, sums=None
            )
        else:
            halves, seen = list(self._halves), self._seen > 0
            start_basis = rendered_basis.basis_of_sums(
                scene, self._seed, halves, seen, self._half, guide_table, start=start
            )
        if start is not None:
            start_basis = replace(start_basis, features=start.features, objects=start.objects)
        return with_first_hits(start_basis, scene, self._seed)


class LightPasses:
    """The passes of separate renders, added in planned order."""

    def __init__(self, scene: Scene, parts: Sequence[Part], start: Basis | None) -> None:
        self._scene, self._start = scene, start
        n = len(scene.lights)
        self._sums = (
            separate_renders.LightSums(n, scene.size)
            if start is None
            else separate_renders.LightSums.of(start)
        )
        self._next: dict[tuple[int, int], list[Part]] = defaultdict(list)
        for part in sorted(parts, key=lambda part: part.first):
            self._next[part.place].append(part)
        self._waiting: dict[Part, Floats] = {}

    def add(self, part: Part, image: Floats) -> None:
        """Add a pass, (h, w, 3), once all earlier passes have arrived."""
        self._waiting[part] = image
        line = self._next[part.place]
        while line and line[0] in self._waiting:
            part = line.pop(0)
            self._sums.add(*part.place, self._waiting.pop(part), part.spp)

    def basis(self, seed: int) -> Basis:
        """Return the basis after all passes were added."""
        scene, start = self._scene, self._start
        seen = separate_renders.emitters_seen(scene) if start is None else start.emitters_seen
        return rendered_basis.basis_of_passes(scene, seed, self._sums, seen)
