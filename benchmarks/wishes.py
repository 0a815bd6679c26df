"""Processor time of an answer under wishes for lux, against the answer without them.

    python benchmarks/wishes.py [--lights 60] [--lamps whites] [--points 2000] [--size 640x360]

Draws a hall (hall.py) of so many lights, renders a basis of that size and measures the illuminance
at about that many points of its floor, 0.8 m high. Each lamp mixes a warm and a cool white, or has
any colour (`--lamps colors`), or any up to a luminance (`limits`). The painting is the hall with
random levels of both whites, or has bands of warm, cold and little light over it, which no lamps
make (`--painting bands`); the wishes are a mean a fifth above what the answer gives, and a
uniformity above its own. Prints, of the literal answer (squares of linear light) and of the default
one to a picture as a display shows it, the seconds of both solves, their ratio, the same with the
sums over the picture, with which every answer begins, how many rows hold, and what the floor gets.
SciPy's linear programs are loaded before.
"""

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy.optimize  # noqa: F401
from hall import write_floor, write_hall

from lightpaint.arrays import Floats
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.light_wishes import wished_light
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solver import solution_of
from lightpaint.lighting.unknowns.reduction import reduce_to
from lightpaint.lighting.wish_problems import with_wishes
from lightpaint.photometry.illuminance import Illuminance, PowerBudget, Wishes
from lightpaint.photometry.measure import measure_illuminance
from lightpaint.photometry.planes_file import read_planes
from lightpaint.scene.scene_reader import load_scene
from lightpaint.target.painted_target import Target

#: Chromaticities of the two whites of each lamp.
WHITES = {"warm": [0.4599, 0.4106], "cool": [0.3457, 0.3585]}

#: Fits by name: of linear light, and as a display shows it.
FITS = {
    "literal": Fit(literal=True),
    "default": Fit(space="display", transform=ViewTransform("srgb"), colors="gentle"),
}


def main() -> None:
    """Solve twice for each fit."""
    options = parse_options()
    width, height = map(int, options.size.split("x"))
    with tempfile.TemporaryDirectory() as folder:
        path = write_hall(Path(folder), options.lights, width=width, height=height)
        scene = load_scene(path, group_alike=False)
        planes = read_planes(write_floor(Path(folder), options.points), scene).planes
        measured = measure_illuminance(scene, planes, spp=64, use_cache=False)
        basis = render_basis(scene, spp=options.spp)
    bright = 2 * float(basis.current_weights.max())
    emitters = [{"name": name, "xy": xy, "Y": bright} for name, xy in WHITES.items()]
    constraints = {
        "whites": Constraints.of({"*": {"emitters": emitters}}),
        "colors": Constraints(),
        "limits": Constraints.of({"*": {"limits": {"max": bright}}}),
    }
    lamps = reduce_to(constraints["whites"], basis.lights).lamps
    drives = np.random.default_rng(1).uniform(0.05, 0.4, (len(lamps), 2))
    mixes = [
        lamps[k].mix(drives[k]) if k in lamps else np.ones(3) for k in range(len(basis.lights))
    ]
    image = basis.mix(np.array(mixes))
    if options.painting == "bands":
        image = with_bands(image)
    target = Target("levels", image, np.ones(basis.size, np.float32), everything=True)
    for name in options.fits:
        limits = constraints[options.lamps]
        compare(name, Problem.of(basis, target, constraints=limits, fit=FITS[name]), measured)


def with_bands(image: Floats) -> Floats:
    """Return an image, (h, w, 3), under bands of warm, cold and little light."""
    y, x = np.mgrid[0 : 1 : image.shape[0] * 1j, 0 : 1 : image.shape[1] * 1j]
    warm = 1 + 0.6 * np.sin(6 * np.pi * x) * np.cos(4 * np.pi * y)
    level = np.where(np.sin(2 * np.pi * (x + 2 * y)) > 0, 1.5, 0.3)
    tint = np.stack([warm, np.ones_like(warm), 2 - warm], axis=-1)
    return (image * tint * level[..., None]).astype(np.float32)


def compare(name: str, problem: Problem, measured: Illuminance) -> None:
    """Solve a problem without and with wishes, and print what both took."""
    solution_of(problem)  # loads what is loaded once
    squares = problem.squares
    begin_s = time.process_time()
    NormalEquations.of(problem.basis, squares.image, squares.weight)
    sums_s = time.process_time() - begin_s
    begin_s = time.process_time()
    free = solution_of(problem)
    free_s = time.process_time() - begin_s
    now = measured.reading("floor", free.weights)
    wishes = Wishes(mean=1.2 * now.mean, uniformity=min(1.3 * now.uniformity, 0.7))
    [plane] = measured.planes
    wished = wished_light(
        replace(measured, planes=(replace(plane, wishes=wishes),)),
        PowerBudget(),
        problem.reduction,
    )
    begin_s = time.process_time()
    required = with_wishes(problem, wished)
    solution = solution_of(required.problem)
    required_s = time.process_time() - begin_s
    reading = measured.reading("floor", solution.weights)
    sums = np.einsum("mnc,nc->m", wished.requirements.rows, solution.weights)
    least = wished.requirements.least
    held = int((sums <= least + 1e-6 * np.maximum(np.abs(least), now.mean)).sum())
    print(
        f"{name}: {len(problem.lights)} lights, {reading.points} points: {free_s:.3f} s without, "
        f"{required_s:.3f} s with wishes, ratio {required_s / free_s:.1f}, with {sums_s:.3f} s of "
        f"sums {(sums_s + required_s) / (sums_s + free_s):.1f}; {held} rows hold; mean "
        f"{now.mean:.4g} -> {reading.mean:.4g} of {wishes.mean:.4g}, U0 {now.uniformity:.2f} -> "
        f"{reading.uniformity:.2f} of {wishes.uniformity:.2f}; given up {required.shares.round(3)}"
    )


def parse_options() -> argparse.Namespace:
    """Return the options."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--lights", type=int, default=60)
    parser.add_argument("--lamps", choices=("whites", "colors", "limits"), default="whites")
    parser.add_argument("--painting", choices=("levels", "bands"), default="levels")
    parser.add_argument("--points", type=int, default=2000)
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--spp", type=int, default=8)
    parser.add_argument("--fits", nargs="+", choices=FITS, default=[*FITS])
    return parser.parse_args()


if __name__ == "__main__":
    main()
