"""What a basis costs: one pass for all lights against n renders and one beauty render.

    python benchmarks/basis.py [SCENE] [--spp N] [--repeats K]

Everything runs in one process with its kernels warm, in turns, and ratios are taken between
neighbours in time. Variance is that of a plane, averaged over pixels and channels, from
independent renders; "at equal time" divides by what the samples cost.
"""

import argparse
import gc
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint import load_scene
from lightpaint.basis.separate import BLACK, WHITE
from lightpaint.scene.scene import Scene

GALLERY = Path(__file__).parent.parent / "scenes" / "gallery" / "scene.xml"
Image = npt.NDArray[Any]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", nargs="?", default=GALLERY)
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()

    scene = load_scene(options.scene)
    names = [light.name for light in scene.lights]
    height, width = scene.size
    print(f"{options.scene}: {len(names)} lights, {width}x{height}, {options.spp} spp\n")
    runs: dict[str, list[tuple[float, list[Image]]]] = {
        "one pass": [],
        "beauty": [],
        "n renders": [],
    }
    for repeat in range(options.repeats + 1):
        for name, method in (("one pass", one_pass), ("beauty", beauty), ("n renders", separate)):
            if repeat == 0 and name == "n renders":
                continue  # its kernels are the beauty render's
            runs[name].append(method(scene, names, options.spp, seed=repeat))
            gc.collect()  # the scene it loaded
            print(f"  {name}: {runs[name][-1][0]:.2f} s", flush=True)
    runs["one pass"].pop(0)  # the first of each compiled
    runs["beauty"].pop(0)
    report(runs, names)


def timed(work: Callable[[], Image]) -> tuple[float, Image]:
    """(seconds, result) of `work`."""
    start = time.perf_counter()
    result = work()
    return time.perf_counter() - start, result


def one_pass(scene: Scene, names: list[str], spp: int, *, seed: int) -> tuple[float, list[Image]]:
    """All planes from one pass."""
    import drjit as dr
    import mitsuba as mi

    from lightpaint.basis.lightgroups import accumulate, lights_by_instance

    height, width = scene.size
    loaded = scene.load(dict.fromkeys(names, WHITE))
    planes = dr.zeros(mi.Float, len(names) * height * width * 3)
    seen = dr.zeros(mi.Float, height * width)
    light_of = lights_by_instance(loaded, names)
    dr.eval(planes, seen)

    def work() -> Image:
        accumulate(
            loaded,
            scene.integrator,
            camera=scene.camera(loaded),
            light_of=light_of,
            planes=planes,
            seen=seen,
            seed=seed,
            spp=spp,
            turn=(seed * 1000, 0),
        )
        return np.array(planes)

    seconds, result = timed(work)
    images = list(result.reshape(len(names), height, width, 3) / spp)
    return seconds, images


def beauty(scene: Scene, names: list[str], spp: int, *, seed: int) -> tuple[float, list[Image]]:
    """One ordinary render with all lights on."""
    return render(scene, dict.fromkeys(names, WHITE), spp, seed)


def separate(scene: Scene, names: list[str], spp: int, *, seed: int) -> tuple[float, list[Image]]:
    """One ordinary render per light; loading is not counted."""
    total, images = 0.0, []
    for k, name in enumerate(names):
        emission = {other: WHITE if other == name else BLACK for other in names}
        seconds, image = render(scene, emission, spp, seed * 1000 + k)
        total += seconds
        images += image
    return total, images


def render(scene: Scene, emission: Any, spp: int, seed: int) -> tuple[float, list[Image]]:
    """`mi.render` of the scene, its film overridden as for the basis."""
    import mitsuba as mi

    loaded = scene.load(emission)
    seconds, image = timed(
        lambda: np.array(mi.render(loaded, sensor=scene.camera(loaded), seed=seed, spp=spp))
    )
    return seconds, [image[..., :3]]


def report(runs: dict[str, list[tuple[float, list[Image]]]], names: list[str]) -> None:
    """Print times as medians, ratios as medians of the ratios run by run."""
    times = {name: [seconds for seconds, _ in made] for name, made in runs.items()}
    print(f"\n{'method':12s} {'median s':>9s} {'of a beauty render':>19s}")
    for name, seconds in times.items():
        ratio = statistics.median(a / b for a, b in zip(seconds, times["beauty"], strict=True))
        print(f"{name:12s} {statistics.median(seconds):9.2f} {ratio:18.2f}x")
    speed = statistics.median(
        a / b for a, b in zip(times["n renders"], times["one pass"], strict=True)
    )
    print(f"\none pass is {speed:.1f}x faster than {len(names)} renders at equal spp\n")
    if len(times["beauty"]) < 2:
        return
    print(f"{'light':16s} {'variance vs its own render':>27s} {'at equal time':>14s}")
    gains = []
    for k, name in enumerate(names):
        one, own = (
            np.var([images[k] for _, images in runs[m]], axis=0, ddof=1).mean()
            for m in ("one pass", "n renders")
        )
        gains.append(speed * own / one)
        print(f"{name:16s} {one / own:26.2f}x {gains[-1]:13.1f}x lower")
    print(f"{'geometric mean':43s} {np.exp(np.mean(np.log(gains))):14.1f}x lower")


if __name__ == "__main__":
    main()
