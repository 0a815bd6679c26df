"""Processor time of the illuminance on a floor, per light, against a basis of the same scene.

    python benchmarks/illuminance.py [--lights 300] [--points 2000] [--error 2%]
        [--size 640x360] [--spp 32]

Draws a hall (hall.py) of so many lights. Measures the illuminance at about that many points of its
floor, 0.8 m high, from every light, until the mean and the points are as certain as asked for, and
renders a basis of that size and number of samples. Both include loading the scene and training the
guide; a small measurement and a small basis before compile the kernels. Prints seconds, the ratio,
and how well each light alone is known in the mean over the floor.
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np
from hall import write_floor, write_hall

from lightpaint.basis.render.basis_render import render_basis
from lightpaint.photometry.measure import measure_illuminance, weights_on
from lightpaint.photometry.planes_file import read_planes
from lightpaint.scene.scene_reader import load_scene
from lightpaint.validation import parse_share


def main() -> None:
    """Measure and render once each."""
    options = parse_options()
    width, height = map(int, options.size.split("x"))
    with tempfile.TemporaryDirectory() as folder:
        path = write_hall(Path(folder), options.lights, width=width, height=height)
        scene = load_scene(path, group_alike=False)
        planes = read_planes(write_floor(Path(folder), options.points), scene).planes
        measure_illuminance(scene, planes, spp=2, use_cache=False)
        render_basis(scene, spp=2)

        begin_s = time.process_time()
        found = measure_illuminance(scene, planes, error=options.error, use_cache=False)
        measured_s = time.process_time() - begin_s
        begin_s = time.process_time()
        render_basis(scene, spp=options.spp)
        basis_s = time.process_time() - begin_s

    weights = weights_on(found.lights)
    reading = found.reading("floor", weights)
    each = np.einsum("pnc,nc->pn", found.noise, weights)
    light = np.einsum("pnc,nc->n", found.matrix, weights)
    errors = np.sqrt((each**2).sum(axis=0)) / np.maximum(light, 1e-12)
    points = found.standard_errors(weights) / found.of(weights)
    print(f"{options.lights} lights, {reading.points} points, error {options.error:g}")
    print(f"mean {reading.mean:.4g} ± {reading.mean_interval:.2g}, U0 {reading.uniformity:.3f}")
    print(f"standard error of a point: median {np.median(points):.2%}, most {points.max():.2%}")
    print(f"error of one light's mean: median {np.median(errors):.2%}, most {errors.max():.2%}")
    print(f"measurement {measured_s:.1f} s, basis {options.size} @ {options.spp} {basis_s:.1f} s")
    print(f"ratio {measured_s / basis_s:.2f}")


def parse_options() -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lights", type=int, default=300)
    parser.add_argument("--points", type=int, default=2000)
    parser.add_argument("--error", type=parse_share, default=0.02)
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--spp", type=int, default=32)
    return parser.parse_args()


if __name__ == "__main__":
    main()
