"""How noisy planes and pictures are for the time that they take, against one render per light.

    python benchmarks/noise.py [--scenes gallery hall64 hall256] [--before CHECKOUT] [--keep FOLDER]

Errors are mean squared differences from a long render, of each light's plane over its mean, less
what that render's own noise adds: so bias counts. Times are seconds of the processor, kernels
compiled, loading not counted. `one pass` is the basis as it is rendered and solved, `pictures`
its planes as people see them, without grain. The rivals are one ordinary render per light, as they
come and denoised alike; where there are many lights, some of them are rendered alone, and their
time is scaled to all. A figure says how many times lower the error is at equal time, as the
geometric mean over lights. `weights` is how far the weights of a painting are off, in the mean of
lights by their share of the picture: the scene as it is under another light, with a pool of paint,
solved with the noise correction; against the weights that the long render gives. `--before` names a
checkout of an earlier version, which is then measured in the same run, in turns. Long renders are
kept in FOLDER for the next run.
"""

import argparse
import gc
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from hall import write_hall

from lightpaint import Basis, Scene, Target, correct_noise, load_scene, render_basis, solve
from lightpaint.colour.color import luminance
from lightpaint.images.denoiser import denoised
from lightpaint.scene.scene_render import Stream, render_loaded

REPOSITORY = Path(__file__).parent.parent
GALLERY = REPOSITORY / "scenes" / "gallery" / "scene.xml"
SCENES = ("gallery", "hall64", "hall256")
HALL_SIZE = {"width": 160, "height": 90}

#: Samples of the long renders: so many that their own noise is far below the noise of what is
#: measured.
LONG_SPP = {"gallery": 768, "hall64": 1024, "hall256": 512}

#: Seeds of the long render, and of the first one that is measured.
LONG_SEED, FIRST_SEED = 90_000, 1

#: Lights that are rendered alone, at most.
ALONE = 12

WHITE, BLACK = (1.0, 1.0, 1.0), (0.0, 0.0, 0.0)

try:
    from lightpaint.basis.cache.denoised_planes import denoise_to_halves
except ImportError:  # as earlier versions call it
    from lightpaint.basis.cache.denoised_planes import denoise_to_halves

Errors = npt.NDArray[np.float64]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", nargs="+", default=list(SCENES), choices=SCENES)
    parser.add_argument("--spp", type=int, default=32)
    parser.add_argument("--long-spp", type=int, help=f"by default {LONG_SPP}")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--before", type=Path, metavar="CHECKOUT")
    parser.add_argument("--keep", type=Path, metavar="FOLDER")
    parser.add_argument("--measure", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.measure:
        scene, long, output = options.measure
        measure(scene_named(scene), Path(long), options.spp, options.repeats, Path(output))
        return
    heads = f"{'one pass':>10s}{'pictures':>10s}{'of denoised':>13s}{'weights':>9s}{'CPU s':>8s}"
    print(" " * 32 + heads, flush=True)
    with tempfile.TemporaryDirectory() as folder:
        keep = options.keep or Path(folder)
        keep.mkdir(parents=True, exist_ok=True)
        for name in options.scenes:
            compare(name, options, keep)


def scene_named(name: str) -> Scene:
    """Load the gallery at half its size, or the hall with as many lights as its name says."""
    if name == "gallery":
        return load_scene(GALLERY).reduced("1/2")
    with tempfile.TemporaryDirectory() as folder:
        return load_scene(write_hall(Path(folder), int(name.removeprefix("hall")), **HALL_SIZE))


def compare(name: str, options: argparse.Namespace, keep: Path) -> None:
    """Measure one scene by this version, by the one before, and by a render per light."""
    scene = scene_named(name)
    long_spp = options.long_spp or LONG_SPP[name]
    long = keep / f"{name}_{long_spp}.npz"
    truth, variance = long_render(scene, long_spp, long)
    checkouts = {"now": REPOSITORY} | ({"before": options.before} if options.before else {})
    results = {
        version: measured(name, options, checkout, long) for version, checkout in checkouts.items()
    }
    spp, repeats, lights = options.spp, options.repeats, len(scene.lights)
    indices = np.unique(np.linspace(0, lights - 1, min(ALONE, lights)).astype(int))
    single_renders = [render_alone(scene, k, spp, seed) for seed in range(repeats) for k in indices]
    alone_s = sum(seconds for _, seconds in single_renders) / len(single_renders) * lights
    plain = errors(
        [image for image, _ in single_renders], np.tile(indices, repeats), truth, variance
    )
    results_now = results["now"]
    # As many samples as that many renders can take in the same time, one at least.
    few = max(1, round(spp * float(results_now["pictures_s"]) / alone_s))
    few_samples = render_basis(scene, spp=2, seed=0)
    features = few_samples.features
    exact = replace(few_samples, planes=truth, noise=np.zeros_like(truth), indirect=None)
    expected = luminance(solve(exact, painting(exact, truth)).weights)
    light = expected * luminance(truth.mean(axis=(1, 2)))
    rough = [render_alone(scene, k, few, seed) for seed in range(repeats) for k in indices]
    begin_s = time.process_time()
    clean = [denoised(image, features) for image, _ in rough]
    clean_s = (time.process_time() - begin_s + sum(s for _, s in rough)) / len(rough) * lights
    smooth = errors(clean, np.tile(indices, repeats), truth, variance)
    for label, arrays in results.items():
        noisy = errors(arrays["planes"], np.tile(np.arange(lights), repeats), truth, variance)
        picture_errors = errors(
            arrays["pictures"], np.tile(np.arange(lights), repeats), truth, variance
        )
        pass_s, pictures_s = float(arrays["pass_s"]), float(arrays["pictures_s"])
        weight_errors = np.abs(luminance(arrays["weights"]) / np.maximum(expected, 1e-12) - 1).mean(
            axis=0
        )
        figures = (
            ratio(plain * alone_s, noisy[indices] * pass_s),
            ratio(plain * alone_s, picture_errors[indices] * pictures_s),
            ratio(smooth * clean_s, picture_errors[indices] * pictures_s),
        )
        title = f"{name}, {lights} lights, {spp} spp, {label}"
        print(
            f"{title:32s}{figures[0]:9.1f}x{figures[1]:9.1f}x{figures[2]:12.1f}x"
            f"{100 * weight_errors @ light / light.sum():7.1f} %{pictures_s:8.1f}"
        )
        sys.stdout.flush()


def long_render(scene: Scene, spp: int, path: Path) -> tuple[npt.NDArray[np.float32], Errors]:
    """Return planes of many samples, (n, h, w, 3), and the variance of each, (n,)."""
    if not path.is_file():
        basis = render_basis(scene, spp=spp, seed=LONG_SEED)
        variance = np.square(basis.half_differences, dtype=np.float64).mean(axis=(1, 2, 3))
        np.savez(path, planes=basis.images, variance=variance)
    with np.load(path) as archive:
        return archive["planes"], archive["variance"]


def painting(basis: Basis, truth: npt.NDArray[np.float32]) -> Target:
    """Return a painting of a scene: its look in a warmer light that falls off, with a pool.

    truth: planes, (n, h, w, 3), whose sum is that look.
    """
    look = np.einsum("nhwc,nc->hwc", truth, basis.current_weights)
    y, x = (np.arange(size) / size for size in look.shape[:2])
    pool = np.square((x - 0.35) / 0.15) + np.square((y[:, None] - 0.6) / 0.25) < 1
    painted = look * (0.4 + 0.6 * x[:, None]) * (1.1, 1, 0.85)
    painted += pool[..., None] * look.mean() * (1.5, 1.2, 0.7)
    return Target.of(painted.astype(np.float32))


def measured(
    name: str, options: argparse.Namespace, checkout: Path, long: Path
) -> dict[str, npt.NDArray[np.float32]]:
    """Return what `measure` finds in a process that runs the version of `checkout`.

    long: file of the long render.
    """
    output = long.parent / "measured.npz"
    command = [sys.executable, str(Path(__file__).absolute()), "--measure", name, str(long)]
    command += [str(output), "--spp", str(options.spp), "--repeats", str(options.repeats)]
    path = os.pathsep.join([str(checkout), str(Path(__file__).parent)])
    subprocess.run(command, check=True, env={**os.environ, "PYTHONPATH": path})
    with np.load(output) as archive:
        arrays = dict(archive)
    output.unlink()
    return arrays


def measure(scene: Scene, long: Path, spp: int, repeats: int, output: Path) -> None:
    """Write planes, pictures and weights of several seeds, and seconds for one of each.

    long: file of the long render, of which the painting is made.
    """
    compiled = render_basis(scene, spp=2, seed=0)
    with np.load(long) as archive:
        target = painting(compiled, archive["planes"])
    planes, pictures, weights, pass_s, clean_s = [], [], [], 0.0, 0.0
    for seed in range(FIRST_SEED, FIRST_SEED + repeats):
        basis, seconds = render_timed(scene, spp, seed)
        pass_s += seconds
        begin_s = time.process_time()
        for k in range(len(scene.lights)):
            halves, scale = denoise_to_halves(basis, k)
            pictures.append(halves.astype(np.float32) * np.float32(scale))
        clean_s += time.process_time() - begin_s
        planes += list(basis.images)
        weights.append(correct_noise(solve(basis, target)).weights)
        del basis
        gc.collect()
    seconds = {"pass_s": pass_s / repeats, "pictures_s": (pass_s + clean_s) / repeats}
    results = {"planes": planes, "pictures": pictures, "weights": weights}
    np.savez(output, **{name: np.stack(arrays) for name, arrays in results.items()}, **seconds)


def render_timed(scene: Scene, spp: int, seed: int) -> tuple[Basis, float]:
    """Return a basis and the processor's seconds from its first pass on."""
    starts: list[float] = []

    def progress(*_: object) -> None:
        starts.append(time.process_time())

    basis = render_basis(scene, spp=spp, seed=seed, progress=progress)
    return basis, time.process_time() - starts[0]


def render_alone(
    scene: Scene, light: int, spp: int, seed: int
) -> tuple[npt.NDArray[np.float32], float]:
    """Return an ordinary render of one light alone, and the processor's seconds for it."""
    loaded = scene.load(
        {x.name: WHITE if k == light else BLACK for k, x in enumerate(scene.lights)}
    )
    render_loaded(loaded, scene, spp=2, seed=0, stream=Stream.TEMPLATE)
    begin_s = time.process_time()
    image = render_loaded(
        loaded, scene, spp=max(spp, 2), seed=seed * 1000 + light, stream=Stream.TEMPLATE
    )
    seconds = time.process_time() - begin_s
    del loaded
    gc.collect()
    return image.image, seconds * spp / max(spp, 2)


def errors(
    images: Sequence[npt.NDArray[np.float32]] | npt.NDArray[np.float32],
    lights: npt.NDArray[np.int64],
    truth: npt.NDArray[np.float32],
    variance: Errors,
) -> Errors:
    """Return the error of each light that occurs, in their order, as a mean over its images.

    images: (h, w, 3) each; lights: which light each one shows.
    """
    total = np.zeros(len(truth))
    for image, k in zip(images, lights, strict=True):
        total[k] += np.square(image - truth[k], dtype=np.float64).mean() - variance[k]
    indices, count = np.unique(lights, return_counts=True)
    return total[indices] / count / np.square(truth[indices].mean(axis=(1, 2, 3), dtype=np.float64))


def ratio(other: Errors, own: Errors) -> float:
    """Return the geometric mean over lights of how many times lower our error is."""
    is_measured = (other > 0) & (own > 0)
    return float(np.exp(np.mean(np.log(other[is_measured] / own[is_measured]))))


if __name__ == "__main__":
    main()
