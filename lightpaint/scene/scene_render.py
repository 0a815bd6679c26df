"""Ordinary Mitsuba renders of a scene, in passes, as an `Estimate` with its noise."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from enum import IntEnum
from itertools import zip_longest
from typing import Any

import numpy as np

from lightpaint.arrays import RGB, Doubles, Floats
from lightpaint.errors import SceneError
from lightpaint.images import Estimate, block_mean
from lightpaint.progress import Progress, silent
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.properties.film import as_seen
from lightpaint.scene.runtime.kernel_threads import kernels
from lightpaint.scene.runtime.render_lock import tracing
from lightpaint.scene.scene_tree import with_sampling

#: Number of camera samples in one pass. Passes are short, since a running kernel cannot be
#: interrupted and needs memory for its whole pass.
SAMPLES_PER_PASS = 2**21

#: Number of camera samples in a range of passes that is summed separately.
SAMPLES_PER_RANGE = 2**22

#: Share of the samples that all emitters get alike where the others go to those that matter.
EVEN_SHARE = 0.25


class Stream(IntEnum):
    """Purposes of random numbers; equal seeds give independent numbers in different streams."""

    BASIS = 0
    VERIFICATION = 1
    TEMPLATE = 2
    NUMBERS = 3
    SECOND_VERIFICATION = 4
    REFINEMENT = 5
    VIEW = 6
    SURFACES = 7
    CANDIDATES = 8
    FROZEN_PATHS = 9
    PLAIN_LOOK = 10


def pass_seed(seed: int, stream: Stream, index: int) -> int:
    """Return the 32-bit seed of pass `index`, unrelated to that for any other seed, stream or
    index.
    """
    return int(np.random.SeedSequence([seed, int(stream), index]).generate_state(1)[0])


def view_seed(seed: int, sensor: int) -> int:
    """Return the seed of a view. Different views have independent random numbers and hence
    noise.
    """
    return seed if sensor == 0 else pass_seed(seed, Stream.VIEW, sensor)


def largest_pass(pixels: int, *, shorter: int = 1) -> int:
    """Return the samples per pixel of a full pass. shorter: divisor of SAMPLES_PER_PASS."""
    return max(1, SAMPLES_PER_PASS // shorter // pixels)


def plan_passes(
    pixels: int, spp: int, *, done: tuple[int, int] = (0, 0), shorter: int = 1, step: int = 1
) -> list[tuple[int, int]]:
    """Return (half 0 or 1, samples per pixel) for each remaining pass, with alternating halves.

    spp: total of both halves, rounded up to make them equal. done: samples per pixel that each half
    already has. step: the number of samples in a pass is a multiple of this.
    """
    if spp < 2:
        raise SceneError(f"{spp} samples per pixel are too few for two halves: expected 2 or more")
    largest = max(1, largest_pass(pixels, shorter=shorter) // step)
    lists = []
    # After an interrupt the second half may have fewer samples; then it comes first.
    for half in (0, 1) if done[0] <= done[1] else (1, 0):
        remainder = -(-max(0, -(-spp // 2) - done[half]) // step)
        sizes = [largest] * (remainder // largest) + [remainder % largest] * (
            remainder % largest > 0
        )
        lists.append([(half, size * step) for size in sizes])
    return [
        next_pass for pair in zip_longest(*lists) for next_pass in pair if next_pass is not None
    ]


def render(
    scene: Scene,
    emission: Mapping[str, RGB] | None = None,
    *,
    spp: int | None = None,
    seed: int = 0,
    stream: Stream,
    label: str = "render",
    progress: Progress = silent,
) -> Estimate:
    """Render `scene` with its own integrator and the given emissions, by default its own.

    spp: samples per pixel in all, by default the scene's own number. Returns linear Rec.709
    radiance, (h, w, 3).
    """

    def rendered(loaded: Any) -> Estimate:
        return render_loaded(
            loaded, scene, spp=spp, seed=seed, stream=stream, label=label, progress=progress
        )

    return scene.while_loaded(rendered, emission)


def render_loaded(
    loaded: Any,
    scene: Scene,
    *,
    spp: int | None = None,
    seed: int,
    stream: Stream,
    label: str = "render",
    progress: Progress = silent,
) -> Estimate:
    """Render a loaded scene, as `render` does."""
    passes = passes_of(scene, spp)
    sums = np.zeros((2, *scene.size, 3), np.float64)
    progress(label, 0, len(passes))
    with tracing() as let_others_through:
        for numbers in ranges_of(scene, passes):
            range_sums = np.zeros_like(sums)
            for k in numbers:
                half, pass_spp = passes[k]
                range_sums[half] += pass_sum(loaded, scene, k, pass_spp, seed=seed, stream=stream)
                progress(label, k + 1, len(passes))
                let_others_through()
            sums += range_sums
    return estimate_of(sums, passes)


def render_in_stages(
    scene: Scene,
    stages: Sequence[int],
    is_enough: Callable[[Estimate, int], bool],
    *,
    seed: int = 0,
    stream: Stream,
    label: str = "render",
    progress: Progress = silent,
) -> tuple[Estimate, int]:
    """Render `scene` in stages until `is_enough` returns True, as `render` does.

    stages: samples per pixel at the end of each stage, increasing. is_enough: called after each
    stage except the last, with the picture so far and its samples per pixel. Returns both.
    """
    height, width = scene.size
    done, plan = (0, 0), []
    for spp in stages:
        passes = plan_passes(height * width, spp, done=done, step=scene.film.block_pixels)
        plan.append(passes)
        done = (
            done[0] + sum(size for half, size in passes if half == 0),
            done[1] + sum(size for half, size in passes if half == 1),
        )
    total = sum(map(len, plan))

    def rendered(loaded: Any) -> tuple[Estimate, int]:
        sums, spp, number = np.zeros((2, *scene.size, 3), np.float64), 0, 0
        progress(label, 0, total)
        with tracing() as let_others_through:
            for k, passes in enumerate(plan):
                for half, pass_spp in passes:
                    sums[half] += pass_sum(
                        loaded, scene, number, pass_spp, seed=seed, stream=stream
                    )
                    spp, number = spp + pass_spp, number + 1
                    progress(label, number, total)
                    let_others_through()
                estimate = estimate_of(sums.copy(), [(0, spp)])
                if k == len(plan) - 1 or is_enough(estimate, spp):
                    break
        return estimate, spp

    return scene.while_loaded(rendered)


def sampled_by(scene: Scene, shares: Mapping[str, float]) -> Scene:
    """Return `scene` with emitters sampled more often the more of the light is theirs.

    Its picture is the same, and has less noise if the shares are about right. If they are wrong, an
    emitter is still sampled EVEN_SHARE as often as among equals. Emitters that are never sampled
    stay so.

    scene: without texels. shares: by name of the emitter, >= 0, relative to each other. An emitter
    that has none is sampled as one among equals.
    """
    sampled = [emitter for emitter in scene.emitters if emitter.sampling_weight]
    known = {x.name: shares[x.name] for x in sampled if x.name in shares}
    if not (total := sum(known.values())):
        return scene
    factor = (1 - EVEN_SHARE) * len(known) / total
    weights = {x.node: 1.0 for x in sampled}
    weights |= {x.node: EVEN_SHARE + factor * known[x.name] for x in sampled if x.name in known}
    return replace(scene, parsed=with_sampling(scene.parsed, weights))


def passes_of(scene: Scene, spp: int | None) -> list[tuple[int, int]]:
    """Return (half, samples per pixel) for all passes of an ordinary render, in order."""
    height, width = scene.size
    step = scene.film.block_pixels
    return plan_passes(height * width, scene.spp if spp is None else spp, step=step)


def ranges_of(scene: Scene, passes: Sequence[tuple[int, int]]) -> list[range]:
    """Return ranges of passes that are summed separately, so that other machines can render
    some.
    """
    height, width = scene.size
    largest = max((spp for _, spp in passes), default=1)
    size = max(1, SAMPLES_PER_RANGE // (height * width * largest))
    return [range(k, min(k + size, len(passes))) for k in range(0, len(passes), size)]


def pass_sum(
    loaded: Any, scene: Scene, number: int, spp: int, *, seed: int, stream: Stream
) -> Doubles:
    """Render a pass and return its undivided sum, (h, w, 3) float64."""
    image = render_pass(loaded, scene, seed=pass_seed(seed, stream, number), spp=spp)
    return spp * image.astype(np.float64)


def estimate_of(sums: Doubles, passes: Sequence[tuple[int, int]]) -> Estimate:
    """Return the estimate from undivided sums of both halves, (2, h, w, 3), which are
    overwritten.
    """
    sums /= sum(size for _, size in passes) / 2
    return Estimate.of_halves(as_float32(sums[0]), as_float32(sums[1]))


def render_pass(loaded: Any, scene: Scene, *, seed: int, spp: int) -> Floats:
    """Return the render of one pass by the scene's own integrator, (h, w, 3).

    spp: a multiple of the number of film pixels in a block.
    """
    import mitsuba as mi

    film = scene.film
    spp //= film.block_pixels
    with kernels():
        image = np.array(mi.render(loaded, sensor=scene.camera(loaded), seed=seed, spp=spp))
    if scene.is_spectral:
        image = as_seen(image, scene.observer)
    # Wrapping integrators append further channels after R, G and B.
    return block_mean(image[..., :3], film.block)


def as_float32(image: Floats) -> Floats:
    """Return the image in the precision in which images are stored."""
    return image.astype(np.float32)
