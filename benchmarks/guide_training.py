"""How many samples should train the emitter guide of a small picture: variance and processor time.

    python benchmarks/guide_training.py [--scene gallery | cornell | stage | hall64 | …]
        [--resolution 64x36] [--spp 16] [--training-spp 4 16 64] [--repeats K]

Each number of training samples per pixel is compared with all training samples, which larger
pictures have. All run in turns in one process, with one kernel. Variance is a plane's,
averaged over pixels and channels, from the difference of two halves: the geometric mean over
lights. Time is of the processor, without loading; the last column is variance times the sum of
both times.
"""

import argparse
import statistics
import tempfile
import time
from collections import defaultdict
from pathlib import Path
from unittest import mock

import numpy as np
from emitter_samples import open_scene

from lightpaint import use_variant
from lightpaint.basis.render import basis_render
from lightpaint.scene.mitsuba_scene import Scene

#: More samples per pixel than the training passes have in any picture.
UNBOUNDED_SPP = 2**20


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", default="gallery")
    parser.add_argument("--resolution", default="64x36")
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--training-spp", nargs="+", type=int, default=[4, 16, 64])
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scene = open_scene(options.scene, options.resolution, Path(folder))
        default_spp = sum(basis_render.training_samples(scene)) / np.prod(scene.size)
        print(
            f"{options.scene}: {len(scene.lights)} lights, {options.resolution}, {options.spp} spp"
        )
        print(f"by default {default_spp:.3g} training samples per pixel")
        measure(scene, [UNBOUNDED_SPP, *options.training_spp], options.spp, options.repeats)


def measure(scene: Scene, choices: list[int], spp: int, repeats: int) -> None:
    """Render and print one table. The first choice is what others are compared with."""
    times, variances = defaultdict(list), defaultdict(list)
    for repeat in range(repeats + 1):
        for choice in choices:
            with mock.patch.multiple(basis_render, TRAINING_SPP=choice, TRAINING_SPP_PER_EMITTER=0):
                *seconds, variance = render(scene, repeat, spp)
            if repeat > 0:  # the kernel is compiled
                times[choice].append(seconds)
                variances[choice].append(variance)
    print(f"{'training':>8s} {'seconds':>8s} {'samples':>8s} {'variance':>9s} {'times time':>11s}")
    reference = variances[choices[0]]
    whole_s = None
    for choice in choices:
        training_s, samples_s = map(statistics.median, zip(*times[choice], strict=True))
        whole_s = training_s + samples_s if whole_s is None else whole_s
        ratios = np.mean(variances[choice], axis=0) / np.mean(reference, axis=0)
        variance = float(np.exp(np.mean(np.log(ratios[ratios > 0]))))
        gain = variance * (training_s + samples_s) / whole_s
        name = "all" if choice == UNBOUNDED_SPP else str(choice)
        print(f"{name:>8s} {training_s:8.2f} {samples_s:8.2f} {variance:9.3f} {gain:11.3f}")


def render(scene: Scene, seed: int, spp: int) -> tuple[float, float, np.ndarray]:
    """Return the seconds of training and of the samples, and the variance of each plane."""
    use_variant()
    from lightpaint.basis.render.tracer.one_pass import Tracer

    tracer, rows = Tracer(scene, seed), range(scene.size[0])
    begun_s = time.process_time()
    basis_render.train_tracer(tracer, lambda: None)
    trained_s = time.process_time()
    halves = [tracer.planes(rows) for _ in range(2)]
    for half, planes in enumerate(halves):
        tracer.add(planes, half, rows, 0, spp // 2)
    difference = (halves[0].sums() - halves[1].sums()) / spp
    done_s = time.process_time()
    tracer.close()
    variance = np.square(difference, dtype=np.float64).mean(axis=(1, 2, 3))
    return trained_s - begun_s, done_s - trained_s, variance


if __name__ == "__main__":
    main()
