"""How far weights are off, by samples and resolution, against a basis of many more samples.

    python benchmarks/quality.py SCENE TARGET [--mask M.exr] [--reference 1/4x4096] [--csv FILE]

The error of a light is the relative error of the luminance of its weight; "mean" weighs lights by
their share of the picture's energy, "worst" is the largest of lights with 2 % of it or more.
"picture" is the RMS of what the wrong weights change, relative to the picture, both without
noise of their own.
"""

import argparse
import time
from pathlib import Path

import numpy as np
from rows import add_csv, write_rows

from lightpaint import Basis, Scene, load_scene, read_target, render_basis, solve
from lightpaint.colour.color import luminance
from lightpaint.report.measures import energy_shares
from lightpaint.target.painted_target import Target

RESOLUTIONS = ("1/1", "1/2", "1/4")
SAMPLES = (16, 32, 64, 128, 256, 512, 1024)
#: Bases of more camera samples than this are left out.
MOST = 32_000_000


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene")
    parser.add_argument("target")
    parser.add_argument("--mask")
    parser.add_argument("--reference", default="1/4x4096", metavar="RESOLUTIONxSPP")
    add_csv(parser)
    options = parser.parse_args()
    scene = load_scene(options.scene)
    target = read_target(Path(options.target), mask=options.mask)
    resolution, _, spp = options.reference.rpartition("x")

    reference, truth = weights(scene.reduced(resolution), target, int(spp), seed=1000)
    image = truth.astype(np.float32)
    shares = energy_shares(reference, solve(reference, target).lighting)
    rows: list[dict[str, object]] = []
    print("resolution   spp  seconds  mean  worst  picture")
    for resolution in RESOLUTIONS:
        small = scene.reduced(resolution)
        for spp in SAMPLES:
            if spp * small.size[0] * small.size[1] > MOST:
                continue
            start_s = time.perf_counter()
            _, estimate = weights(small, target, spp, seed=1)
            taken_s = time.perf_counter() - start_s
            error = np.abs(luminance(estimate - truth)) / np.maximum(luminance(truth), 1e-12)
            residual = reference.mix(estimate - truth)
            picture = np.sqrt(np.square(residual).mean() / np.square(reference.mix(image)).mean())
            row: dict[str, object] = {
                "film": resolution,
                "samples per pixel": spp,
                "s": f"{taken_s:.1f}",
                "mean error": f"{100 * (error @ shares):.0f} %",
                "worst light of 2 % and more": f"{100 * error[shares > 0.02].max():.0f} %",
                "picture": f"{100 * picture:.1f} %",
            }
            rows.append({"scene": Path(options.scene).parent.name, **row})
            print("{:10s} {:5d} {:>8s} {:>6s} {:>6s} {:>8s}".format(*row.values()), flush=True)
            write_rows(options.csv, rows)


def weights(scene: Scene, target: Target, spp: int, *, seed: int) -> tuple[Basis, np.ndarray]:
    """A basis, and the (n, 3) emissions that it gives for the target."""
    basis = render_basis(scene, spp=spp, seed=seed)
    return basis, solve(basis, target).lighting.weights_for(basis)


if __name__ == "__main__":
    main()
