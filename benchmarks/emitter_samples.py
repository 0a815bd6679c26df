"""How many emitters a vertex should sample: variance and processor time against one each.

    python benchmarks/emitter_samples.py [--scene gallery | cornell | stage | hall64 | …]
        [--emitter-samples 1,1 8,2 8,4] [--resolution 320x180] [--spp N] [--repeats K]

Each pair is what the first vertex and later ones sample. All run in turns in one process, with one
kernel, and are trained apart. Variance is a plane's, averaged over pixels and
channels, from the difference of two halves: the geometric mean over lights. Time is of the
processor, without loading and training, which have a column of their own.
"""

import argparse
import statistics
import tempfile
import time
from collections import defaultdict
from pathlib import Path

import numpy as np
from hall import write_hall

from lightpaint import load_scene, use_variant
from lightpaint.basis.render.basis_render import train_tracer
from lightpaint.scene.mitsuba_scene import Scene

SCENES = Path(__file__).parent.parent / "scenes"


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", default="gallery")
    parser.add_argument("--emitter-samples", nargs="+", default=["1,1", "8,2", "8,4", "8,8"])
    parser.add_argument("--resolution", default="320x180")
    parser.add_argument("--spp", type=int, default=8)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        scene = open_scene(options.scene, options.resolution, Path(folder))
        pairs = [tuple(map(int, pair.split(","))) for pair in options.emitter_samples]
        print(f"{options.scene}: {len(scene.lights)} lights, {options.resolution}")
        measure(scene, pairs, options.spp, options.repeats)


def measure(scene: Scene, pairs: list[tuple[int, ...]], spp: int, repeats: int) -> None:
    """Render and print one table. The first of the pairs is what others are compared with."""
    use_variant()
    from lightpaint.basis.render.tracer.one_pass import Tracer

    seconds, training, variances = defaultdict(list), defaultdict(list), defaultdict(list)
    rows, half_spp = range(scene.size[0]), spp // 2
    for repeat in range(repeats + 1):
        for pair in pairs:
            tracer = Tracer(scene, repeat, emitter_samples=(pair[0], pair[1]))
            begun_s = time.process_time()
            train_tracer(tracer, lambda: None)
            trained_s = time.process_time()
            halves = [tracer.planes(rows) for _ in range(2)]
            for half, planes in enumerate(halves):
                tracer.add(planes, half, rows, 0, half_spp)
            done_s = time.process_time()
            difference = (halves[0].sums() - halves[1].sums()) / spp
            tracer.close()
            if repeat == 0:  # the kernel is compiled
                continue
            training[pair].append(trained_s - begun_s)
            seconds[pair].append((done_s - trained_s) / spp)
            variances[pair].append(np.square(difference, dtype=np.float64).mean(axis=(1, 2, 3)))
    print(
        f"{'samples':>8s} {'training':>9s} {'s per spp':>10s} {'variance':>9s} {'times time':>11s}"
    )
    first = pairs[0]
    for pair in pairs:
        ratios = np.mean(variances[pair], axis=0) / np.mean(variances[first], axis=0)
        variance = float(np.exp(np.mean(np.log(ratios[ratios > 0]))))
        median_s, reference = statistics.median(seconds[pair]), statistics.median(seconds[first])
        print(
            f"{pair[0]:5d}, {pair[1]} {statistics.median(training[pair]):9.2f} {median_s:10.4f} "
            f"{variance:9.3f} {variance * median_s / reference:11.3f}"
        )


def open_scene(name: str, resolution: str, folder: Path) -> Scene:
    """Return the scene of a name: one of the project, or a hall of so many lights."""
    width, height = map(int, resolution.split("x"))
    if name.startswith("hall"):
        return load_scene(write_hall(folder, int(name[4:]), width=width, height=height))
    return load_scene(SCENES / name / "scene.xml").reduced(resolution)


if __name__ == "__main__":
    main()
