"""What a basis costs: one pass for all lights against n renders and one beauty render.

    python benchmarks/basis.py [--lights 12 64 256] [--spp N] [--repeats K] [--only M]

12 lights are the gallery's; larger numbers hang in a hall made for the purpose. Everything
runs in one process with its kernels warm, in turns, and ratios are taken between neighbours
in time. Seconds are the processor's, of all threads, so other work on the machine matters little;
loading is not counted. Variance is a plane's, averaged over pixels and
channels, from the difference of two independent halves; "at equal time" divides by what the
samples cost. Where there are many lights, only M of them, evenly spread over the list, are
rendered alone, and their time is scaled to all.
"""

import argparse
import gc
import multiprocessing
import resource
import statistics
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from hall import write_hall

from lightpaint import load_scene
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.basis.render.separate_renders import BLACK, WHITE
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_render import Stream, render_loaded

GALLERY = Path(__file__).parent.parent / "scenes" / "gallery" / "scene.xml"
HALL_SIZE = {"width": 480, "height": 270}


class Run(NamedTuple):
    """Seconds of the processor, and the variance of the mean of each plane."""

    seconds: float
    variances: npt.NDArray[np.float64]


def main() -> None:
    """Print a table for each number of lights."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lights", type=int, nargs="+", default=[12, 64, 256])
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--only", type=int, default=16)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for lights in options.lights:
            path = GALLERY
            if lights != 12:
                path = write_hall(Path(folder), lights, **HALL_SIZE)
            measure(load_scene(path), options.spp, options.repeats, options.only)
            for spp in (options.spp // 8, options.spp):
                print(f"peak memory at {spp:3d} spp: {peak_memory(path, spp) / 1e9:.2f} GB")


def measure(scene: Scene, spp: int, repeats: int, only: int) -> None:
    """Render and print one table."""
    names = [light.name for light in scene.lights]
    height, width = scene.size
    # An odd step, for kinds of lights take turns in the hall.
    sample = names[:: max(1, len(names) // only) | 1]
    print(f"\n{scene.path.name}: {len(names)} lights, {width}x{height}, {spp} spp")
    one: list[Run] = []
    beauty: list[Run] = []
    own: list[Run] = []
    for repeat in range(repeats + 1):
        one.append(one_pass(scene, spp, seed=repeat))
        beauty.append(beauty_render(scene, names, spp, seed=repeat))
        print(f"  one pass {one[-1].seconds:.2f} s, beauty {beauty[-1].seconds:.2f} s", flush=True)
        if repeat == 0:  # kernels are compiled
            one.clear()
            beauty.clear()
            continue
        own.append(separate(scene, sample, names, spp, seed=repeat))
        print(f"  n renders {own[-1].seconds:.2f} s", flush=True)
    report(names, sample, one=one, beauty=beauty, own=own)


def one_pass(scene: Scene, spp: int, *, seed: int) -> Run:
    """The basis as lightpaint renders it, from the first pass to the finished arrays."""
    starts: list[float] = []

    def progress(_label: str, _done: int, _total: int) -> None:
        starts.append(time.process_time())

    basis = render_basis(scene, spp=spp, seed=seed, progress=progress)
    seconds = time.process_time() - starts[0]
    variances = np.square(basis.half_differences, dtype=np.float64).mean(axis=(1, 2, 3))
    del basis
    gc.collect()
    return Run(seconds, variances)


def beauty_render(scene: Scene, names: list[str], spp: int, *, seed: int) -> Run:
    """One ordinary render with all lights on."""
    return _render(scene, dict.fromkeys(names, WHITE), spp, seed)


def separate(scene: Scene, sample: list[str], names: list[str], spp: int, *, seed: int) -> Run:
    """An ordinary render for each light in `sample`; time for all."""
    runs = []
    for k, name in enumerate(sample):
        emission = {other: WHITE if other == name else BLACK for other in names}
        runs.append(_render(scene, emission, spp, seed * 1000 + k))
    seconds = sum(run.seconds for run in runs) / len(sample) * len(names)
    return Run(seconds, np.concatenate([run.variances for run in runs]))


def _render(
    scene: Scene, emission: dict[str, tuple[float, float, float]], spp: int, seed: int
) -> Run:
    loaded = scene.load(emission)
    start = time.process_time()
    image = render_loaded(loaded, scene, spp=spp, seed=seed, stream=Stream.TEMPLATE)
    seconds = time.process_time() - start
    del loaded
    gc.collect()
    return Run(
        seconds, np.square(image.half_difference, dtype=np.float64).mean(keepdims=True)[0, 0]
    )


def report(
    names: list[str], sample: list[str], *, one: list[Run], beauty: list[Run], own: list[Run]
) -> None:
    """Print times as medians, ratios as medians of the ratios run by run."""
    print(f"\n{'method':12s} {'median s':>9s} {'of a beauty render':>19s}")
    for name, runs in (("one pass", one), ("beauty", beauty), ("n renders", own)):
        ratio = statistics.median(a.seconds / b.seconds for a, b in zip(runs, beauty, strict=True))
        print(f"{name:12s} {statistics.median(r.seconds for r in runs):9.2f} {ratio:18.2f}x")
    speed = statistics.median(a.seconds / b.seconds for a, b in zip(own, one, strict=True))
    print(f"\none pass is {speed:.1f}x faster than {len(names)} renders at equal spp\n")
    print(f"{'light':16s} {'variance vs its own render':>27s} {'at equal time':>14s}")
    own_variance = np.mean([run.variances for run in one], axis=0)
    other_variance = np.mean([run.variances for run in own], axis=0)
    gains = []
    for k, name in enumerate(sample):
        ratio = own_variance[names.index(name)] / other_variance[k]
        if ratio == 0:
            print(f"{name:16s} {'too faint to tell':>27s}")
            continue
        gains.append(speed / ratio)
        print(f"{name:16s} {ratio:26.2f}x {gains[-1]:13.1f}x lower")
    print(f"{'geometric mean':43s} {np.exp(np.mean(np.log(gains))):14.1f}x lower\n")


def peak_memory(path: Path, spp: int) -> int:
    """Bytes that a process takes which renders that basis and nothing else."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(_render_and_look, (path, spp))


def _render_and_look(path: Path, spp: int) -> int:
    render_basis(load_scene(path), spp=spp)
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


if __name__ == "__main__":
    main()
