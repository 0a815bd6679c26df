"""A basis from one ordinary render per light: works with any integrator, but takes n times the
work.

The seed of a pass follows from its light, half and number alone. So passes may be rendered in any
order, and in several runs.
"""

import gc
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from lightpaint.arrays import RGB, Bools, Floats
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render.integrators import depth_limit
from lightpaint.basis.render.render_budget import PASS_DIVISOR, Budget, Clock, Keeper, next_pair
from lightpaint.images import block_mean
from lightpaint.progress import Interrupted, Progress
from lightpaint.scene import Scene, Stream, as_float32, pass_seed, plan_passes, render_pass
from lightpaint.scene.runtime.render_lock import MITSUBA, tracing
from lightpaint.scene.runtime.variant import use_variant

WHITE: RGB = (1.0, 1.0, 1.0)
BLACK: RGB = (0.0, 0.0, 0.0)

#: Number of camera samples per pixel in the search for visible emitters.
SEEN_SAMPLES = 16

#: Consecutive passes as pairs of half (0 or 1) and samples per pixel.
Plan = list[tuple[int, int]]


class LightSums:
    """The sums, not divided by their counts, of the two halves of each light's samples.

    planes: (2, n, h, w, 3) float32. spp, passes: (n, 2), numbers so far, by light and half.
    """

    def __init__(self, lights: int, size: tuple[int, int]) -> None:
        self.planes = np.zeros((2, lights, *size, 3), np.float32)
        self.spp = np.zeros((lights, 2), np.int64)
        self.passes = np.zeros((lights, 2), np.int64)

    @classmethod
    def of(cls, basis: Basis) -> "LightSums":
        """Return the sums from which `basis` was computed, exact if it has them, else up to
        round-off.
        """
        sums = cls.counted(basis)
        if basis.sums is not None:
            sums.planes = np.stack(basis.sums)
            return sums
        sums.planes = np.zeros((2, *basis.images.shape), np.float32)
        for k, (a, b) in enumerate(sums.spp.tolist()):
            image, half_difference = basis.images[k], basis.half_differences[k]
            # The mean is (a A + b B) / (a + b), the half difference (A − B) / 2.
            sums.planes[0, k] = a * (image + half_difference * (2 * b / max(a + b, 1)))
            sums.planes[1, k] = b * (image - half_difference * (2 * a / max(a + b, 1)))
        return sums

    @classmethod
    def counted(cls, basis: Basis) -> "LightSums":
        """Return the numbers of samples and passes of `basis`, without their sums."""
        origin, sums = basis.origin, cls(len(basis.lights), (0, 0))
        each_light = origin.each_light or ((*origin.halves, *origin.passes),) * len(basis.lights)
        sums.spp[:], sums.passes[:] = np.array(each_light)[:, :2], np.array(each_light)[:, 2:]
        return sums

    def add(self, light: int, half: int, image: Floats, spp: int) -> None:
        """Add the undivided sum of a pass, (h, w, 3), of `spp` samples per pixel."""
        self.planes[half, light] += image
        self.spp[light, half] += spp
        self.passes[light, half] += 1

    def done(self, light: int) -> tuple[int, int]:
        """Return the samples per pixel of the two halves of a light."""
        a, b = self.spp[light].tolist()
        return a, b

    def mean_and_half_difference(self) -> tuple[Floats, Floats]:
        """Return mean and half difference, (n, h, w, 3) float32; 0 without samples."""
        means, half_differences = np.zeros_like(self.planes[0]), np.zeros_like(self.planes[0])
        for k, (a, b) in enumerate(self.spp.tolist()):
            sum_a, sum_b = self.planes[:, k]
            means[k] = (sum_a + sum_b) / max(a + b, 1)
            if a and b:
                half_differences[k] = (sum_a / a - sum_b / b) / 2
        return means, half_differences

    def counts(self) -> dict[str, Any]:
        """Return the fields of an Origin that record numbers of samples and passes."""
        # With only one half the noise is unknown, so the minimum over both halves counts.
        spp, passes = int(self.spp.min()), int(self.passes.min())
        each_light: tuple[tuple[int, ...], ...] = ()
        if (self.spp != spp).any() or (self.passes != passes).any():
            each_light = tuple(map(tuple, np.hstack([self.spp, self.passes]).tolist()))
        return {"halves": (spp, spp), "passes": (passes, passes), "each_light": each_light}


def render_separately(
    scene: Scene,
    budget: Budget,
    *,
    seed: int,
    sums: LightSums,
    basis: Callable[[], Basis],
    keeper: Keeper,
    progress: Progress,
) -> None:
    """Render passes until `budget` is spent, and add them to `sums`.

    basis: returns the basis of the sums so far, for saving. Raises Interrupted on Ctrl-C.
    """
    try:
        with tracing() as let_others_through:
            for light, plan, after_pass in _turns(scene, budget, sums, progress):
                loaded = load_one_light(scene, light)
                for half, pass_spp in plan:
                    number = int(sums.passes[light, half])
                    image = light_pass(loaded, scene, light, half, number, pass_spp, seed)
                    sums.add(light, half, image, pass_spp)
                    after_pass()
                    keeper.now_and_then(basis)
                    let_others_through()
                del loaded
                gc.collect()
    except KeyboardInterrupt:
        if not sums.spp.any() or keeper.keep is None or not keeper.keep(basis()):
            raise
        mean = sums.spp.sum() / len(scene.lights)
        budget_text = "" if budget.time_s is not None else f" of {budget.spp}"
        raise Interrupted(
            f"{mean:.3g}{budget_text} samples per pixel, on average over the lights, are kept; "
            "run the same command to continue"
        ) from None


def plan_of_light(scene: Scene, spp: int, *, done: tuple[int, int] = (0, 0)) -> Plan:
    """Return the passes that bring one light from `done` samples per half to `spp` in all.

    If a pixel is a block of film pixels, the number is rounded up so that each of these gets a
    sample.
    """
    height, width = scene.size
    step = scene.film.block_pixels
    return plan_passes(height * width, spp, done=done, shorter=PASS_DIVISOR, step=step)


def _turns(
    scene: Scene, budget: Budget, sums: LightSums, progress: Progress
) -> Iterator[tuple[int, Plan, Callable[[], None]]]:
    """Yield (light, its passes, function to call after each pass) in turn, until `budget` is
    spent.
    """
    height, width = scene.size
    pixels, lights = height * width, len(scene.lights)
    if budget.time_s is None:
        # One light at a time, since a large scene takes long to load.
        for light in range(lights):
            plan = plan_of_light(scene, budget.spp, done=sums.done(light))
            if plan:
                yield (
                    light,
                    plan,
                    _progress_counter(f"basis: {scene.lights[light].name}", plan, progress),
                )
        return

    # In each round every light reaches the same number of samples. The first round is one pair of
    # passes and measures their time; the second spends the remaining time, and a third is rare.
    clock, pairs = Clock(budget.time_s, progress), 1
    while pairs > 0:
        fullest = int(sums.spp.max())
        begin_s, rendered = clock.left_s, 0
        goal = next_pair(pixels, (fullest, fullest), pairs, step=scene.film.block_pixels)
        spp = 2 * fullest + sum(size for _, size in goal)
        for light in range(lights):
            plan = plan_of_light(scene, spp, done=sums.done(light))
            rendered += len(plan)
            yield light, plan, clock.report
        pair_of_all_s = (begin_s - clock.left_s) / rendered * 2 * lights
        pairs = max(0, int(clock.left_s / pair_of_all_s))


def _progress_counter(label: str, plan: Plan, progress: Progress) -> Callable[[], None]:
    done = 0
    progress(label, done, len(plan))

    def one_more() -> None:
        nonlocal done
        done += 1
        progress(label, done, len(plan))

    return one_more


def load_one_light(scene: Scene, light: int) -> Any:
    """Load a scene in which one light is white and all others are off."""
    name = scene.lights[light].name
    return scene.load({x.name: WHITE if x.name == name else BLACK for x in scene.lights})


def light_pass(
    loaded: Any, scene: Scene, light: int, half: int, number: int, spp: int, seed: int
) -> Floats:
    """Render a pass and return its undivided sum, (h, w, 3). number: its index for this light and
    half.
    """
    # Lights have independent samples.
    of_light = pass_seed(seed, Stream.BASIS, light)
    seed_of_pass = pass_seed(of_light, Stream.BASIS, 2 * number + half)
    return spp * as_float32(render_pass(loaded, scene, seed=seed_of_pass, spp=spp))


@MITSUBA.acquired()
def emitters_seen(scene: Scene) -> Bools:
    """Return the pixels in which the camera sees an emitter, directly or through clear glass, (h,
    w).
    """
    import mitsuba as mi

    if scene.integrator.hide_emitters:
        return np.zeros(scene.size, dtype=bool)
    loaded: Any = scene.in_rgb.load({light.name: WHITE for light in scene.lights})
    direct = mi.load_dict({"type": "path", "max_depth": 1})
    spp = -(-SEEN_SAMPLES // scene.film.block_pixels)
    image = as_float32(
        np.array(mi.render(loaded, sensor=scene.camera(loaded), integrator=direct, seed=0, spp=spp))
    )
    seen = block_mean(image, scene.film.block).max(axis=-1) > 0
    if use_variant().is_jit:
        seen |= _seen_through_glass(scene, loaded)
    del loaded
    gc.collect()
    return np.asarray(seen)


def _seen_through_glass(scene: Scene, loaded: Any) -> Bools:
    """Return the pixels in which a ray reaches an emitter through clear surfaces only, (h, w)."""
    from lightpaint.basis.render.tracer.one_pass import view_of
    from lightpaint.basis.render.tracer.path_tracer import emitters_seen_through, has_clear_surfaces

    if not has_clear_surfaces(loaded):
        return np.zeros(scene.size, dtype=bool)
    depth = depth_limit(scene.integrator)
    return emitters_seen_through(view_of(scene, loaded), depth, samples=SEEN_SAMPLES)
