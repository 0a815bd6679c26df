"""A basis in parts that do not wait for each other, so that many processes may render it.

A part is some rows of the picture, some samples of one half and, where each light takes renders of
its own, one light. Which parts there are follows from scene and samples alone, and their sums are
added in a fixed order: the basis does not depend on who renders what, nor when, nor how often
somebody failed. One lesson comes before them: it learns which emitter matters where, and parts
choose by that and learn no more, so that none depends on another.
"""

import gc
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.planes import as_planes
from lightpaint.basis.render.render import (
    IN_PARTS,
    ONE_PASS,
    basis_lights,
    method_of,
    origin_of,
    with_first_hits,
)
from lightpaint.basis.render.separate import LightSums, emitters_seen, light_pass, plan_of_light
from lightpaint.basis.render.sums import halves_of, mean_and_half_difference
from lightpaint.scene.runtime.kernel_threads import kernels
from lightpaint.scene.runtime.render_lock import MITSUBA, tracing
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import SAMPLES_PER_PASS, plan_passes, view_seed

#: Camera samples of a part: some seconds of one processor, which is what an accident costs.
SAMPLES = SAMPLES_PER_PASS // 2

#: Bytes of a part's images, at most.
BYTES = 2**27

#: Samples of a pass of a lesson, which chooses by what those before have learned; how many there
#: are at most, and samples of the basis for each.
LESSON, LESSONS, PER_LESSON = 2**18, 4, 2**20


@dataclass(frozen=True)
class Part:
    """A part of the samples of a basis.

    half: 0 or 1. top, bottom: its rows, the last one not among them. first: samples of a pixel of
    that half that come before. spp: its own. light: index, where it is one light's alone; number:
    of the pass among those of that light and half.
    """

    half: int
    top: int
    bottom: int
    first: int
    spp: int
    light: int | None = None
    number: int = 0

    @property
    def place(self) -> tuple[int, int, int]:
        """Key that is equal for parts which are added to each other."""
        return self.half, self.top, -1 if self.light is None else self.light


def plan_parts(scene: Scene, spp: int, *, start: Basis | None = None) -> list[Part]:
    """Return the parts that bring a basis of `scene` to `spp` samples per pixel, in order.

    start: what is there already, whose samples count.
    """
    height, width = scene.size
    if method_of(scene) != ONE_PASS:
        return _separate_parts(scene, spp, start)
    done = (0, 0) if start is None else start.origin.halves
    plan_passes(height * width, spp)  # refuses what is too few
    parts = []
    for half in range(2):
        left = -(-spp // 2) - done[half]
        if left <= 0:
            continue
        tiles = _tiles(len(scene.lights), height, width, left)
        for top, bottom in tiles:
            largest = max(1, SAMPLES // ((bottom - top) * width))
            for first in range(0, left, largest):
                its = min(largest, left - first)
                parts.append(Part(half, top, bottom, done[half] + first, its))
    # The halves in turn, the first samples first.
    return sorted(parts, key=lambda part: (part.first, part.top, part.half))


def _tiles(lights: int, height: int, width: int, spp: int) -> list[tuple[int, int]]:
    """Return rows of equal parts, as few as possible.

    A part whose samples are split sends its images as often.
    """
    by_work, by_memory = SAMPLES // (width * spp), BYTES // (lights * width * 12)
    count = -(-height // max(1, min(by_work, by_memory)))
    edges = [height * k // count for k in range(count + 1)]
    return list(pairwise(edges))


def _separate_parts(scene: Scene, spp: int, start: Basis | None) -> list[Part]:
    """Return the passes of each light, numbered from its first one on."""
    height, _ = scene.size
    there = LightSums(len(scene.lights), (0, 0)) if start is None else LightSums.counted(start)
    parts = []
    for light in range(len(scene.lights)):
        done, numbers = list(there.done(light)), there.passes[light].tolist()
        for half, its in plan_of_light(scene, spp, done=(done[0], done[1])):
            parts.append(Part(half, 0, height, done[half], its, light, numbers[half]))
            done[half] += its
            numbers[half] += 1
    return parts


@MITSUBA.taken()
def lesson(scene: Scene, spp: int, seed: int) -> Floats | None:
    """Return the learned probabilities of emitters for parts of `scene`; None if none are needed.

    spp: samples per pixel that the parts come to.
    """
    if method_of(scene) != ONE_PASS:
        return None
    from lightpaint.basis.render.one_pass import Tracer

    height, width = scene.size
    tracer = Tracer(scene, view_seed(seed, scene.sensor), None)
    try:
        # The order of additions, which only one thread keeps to, decides what is learned.
        with tracing() as let_others_through, kernels(threads=1):
            its, step = max(1, LESSON // (height * width)), max(1, height * width // LESSON)
            for k in range(min(max(spp * height * width // PER_LESSON, 1), LESSONS)):
                # Of a large picture some rows tell enough, each time others.
                let_others_through()
                tracer.learn(range(k * step // LESSONS, height, step), k * its, its)
        learned: Floats = tracer.guide.learned()
        return learned
    finally:
        tracer.close()
        gc.collect()


class PartRenderer:
    """Renders parts of one scene, which stays loaded between them: close it before another is.

    learned: as `lesson` returned it, or the `learned` of the basis that is gone on from.
    """

    def __init__(self, scene: Scene, seed: int, learned: Floats | None) -> None:
        self._scene, self._seed, self._learned = scene, view_seed(seed, scene.sensor), learned
        self._tracer: Any = None
        self._light: int | None = None
        self._loaded: Any = None

    @MITSUBA.taken()
    def render(self, part: Part) -> tuple[Floats, Floats]:
        """Return the sums of its samples, (lights, rows, w, 3) float32, and rays that saw an
        emitter.

        The lights are all of them, or its own alone.
        """
        if part.light is not None:
            return self._of_light(part, part.light)
        if self._tracer is None:
            from lightpaint.basis.render.one_pass import Tracer

            self._tracer = Tracer(self._scene, self._seed, self._learned)
            self._tracer.guide.freeze()
        with tracing(), kernels():
            sums: tuple[Floats, Floats] = self._tracer.part(
                part.half, range(part.top, part.bottom), part.first, part.spp
            )
        return sums

    def _of_light(self, part: Part, light: int) -> tuple[Floats, Floats]:
        if self._light != light:
            self.close()
            its = self._scene.lights[light].name
            white, black = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)
            self._loaded = self._scene.load(
                {x.name: white if x.name == its else black for x in self._scene.lights}
            )
            self._light = light
        which = light, part.half, part.number, part.spp, self._seed
        with tracing():
            image = light_pass(self._loaded, self._scene, *which)
        return image[None], np.zeros(self._scene.size, np.float32)

    def close(self) -> None:
        """Release what is loaded."""
        if self._tracer is not None:
            self._tracer.close()
        self._tracer = self._loaded = self._light = None
        gc.collect()


class PartSums:
    """The sums of parts, added in the order of the plan, in whatever order they come.

    start: what they are added to.
    """

    def __init__(
        self, scene: Scene, parts: Sequence[Part], *, seed: int, start: Basis | None = None
    ) -> None:
        self._scene, self._seed, self._start = scene, seed, start
        self._next: dict[tuple[int, int, int], list[Part]] = defaultdict(list)
        for part in sorted(parts, key=lambda part: part.first):
            self._next[part.place].append(part)
        self._waiting: dict[Part, tuple[Floats, Floats]] = {}
        n, is_together = len(scene.lights), method_of(scene) == ONE_PASS
        self._spp = [0, 0] if start is None else list(start.origin.halves)
        self._seen = np.zeros(scene.size, np.float32)
        self._lights: LightSums | None = None
        if is_together and start is not None:
            self._halves = halves_of(start)
        elif is_together:
            self._halves = [np.zeros((n, *scene.size, 3), np.float32) for _ in range(2)]
        else:
            self._lights = LightSums(n, scene.size) if start is None else LightSums.of(start)
        if is_together:
            for half in range(2):
                tops = {part.top for part in parts if part.half == half}
                its = sum(part.spp for part in parts if part.half == half)
                self._spp[half] += its // max(len(tops), 1)

    def add(self, part: Part, planes: Floats, seen: Floats) -> None:
        """Add what `PartRenderer.render` returned for a part."""
        self._waiting[part] = planes, seen
        line = self._next[part.place]
        while line and line[0] in self._waiting:
            first = line.pop(0)
            self._added(first, *self._waiting.pop(first))

    def _added(self, part: Part, planes: Floats, seen: Floats) -> None:
        if self._lights is not None and part.light is not None:
            self._lights.planes[part.half, part.light] += planes[0]
            self._lights.spp[part.light, part.half] += part.spp
            self._lights.passes[part.light, part.half] += 1
            return
        self._halves[part.half][:, part.top : part.bottom] += planes
        self._seen[part.top : part.bottom] += seen

    def basis(self, learned: Floats | None) -> Basis:
        """Return the basis, once all parts are added; the sums are released.

        learned: what the parts chose by.
        """
        assert not any(self._next.values())
        scene, start = self._scene, self._start
        lights = basis_lights(scene)
        if self._lights is not None:
            images, half_differences = self._lights.mean_and_half_difference()
            seen = emitters_seen(scene) if start is None else start.emitters_seen
            origin = replace(
                origin_of(scene, self._seed, method_of(scene), (0, 0), (0, 0)),
                **self._lights.counts(),
            )
            made = Basis(lights, as_planes(images), as_planes(half_differences), seen, origin)
        else:
            halves = (self._spp[0], self._spp[1])
            images, half_differences = mean_and_half_difference(self._halves, halves)
            seen = self._seen > 0
            if start is not None:
                seen |= start.emitters_seen
            height, width = scene.size
            plan = plan_passes(height * width, sum(halves))
            counts = sum(half == 0 for half, _ in plan), sum(half == 1 for half, _ in plan)
            origin = origin_of(scene, self._seed, IN_PARTS, halves, counts)
            made = Basis(
                lights, as_planes(images), as_planes(half_differences), seen, origin, learned
            )
        if start is not None:
            made = replace(made, features=start.features, objects=start.objects)
        return with_first_hits(made, scene, self._seed)


def render_in_parts(scene: Scene, *, spp: int, seed: int = 0, start: Basis | None = None) -> Basis:
    """Render all parts one after the other in this process, as the reference for other ways."""
    learned = None if start is None else start.learned
    if learned is None:
        learned = lesson(scene, spp, seed)
    parts = plan_parts(scene, spp, start=start)
    sums = PartSums(scene, parts, seed=seed, start=start)
    renderer = PartRenderer(scene, seed, learned)
    try:
        for part in parts:
            sums.add(part, *renderer.render(part))
    finally:
        renderer.close()
    return sums.basis(learned)
