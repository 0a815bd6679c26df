"""Lamps of emitters under limits of power and luminance together."""

from typing import Any

import numpy as np
import pytest
from least_squares import stack_rows
from nightly import seeds
from scipy.optimize import linprog

from lightpaint.colour.color import luminance
from lightpaint.colour.lamp import Lamp, LampEmitter
from lightpaint.errors import ConstraintError
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.target.painted_target import Target

SIZE = (5, 4)

RGBWA = [
    {"name": name, "xy": xy, "Y": level, "watts": watts}
    for name, xy, level, watts in (
        ("red", [0.7, 0.299], 1.9, 12),
        ("green", [0.17, 0.7], 3.8, 10),
        ("blue", [0.135, 0.055], 0.8, 14),
        ("white", [0.33, 0.34], 5.1, 9),
        ("amber", [0.57, 0.42], 2.5, 11),
    )
]

#: Round-off of gradients in float64 with images in float32, relative to the painting.
SAME = 1e-7


def _problem(make_basis: Any, seed: int, par: dict[str, Any]) -> Any:
    basis = make_basis(2, SIZE, seed=seed, names=["par", "other"])
    rng = np.random.default_rng(seed)
    image = (rng.random((*SIZE, 3)) * rng.uniform(0.5, 6)).astype(np.float32)
    target = Target("t", image, rng.random(SIZE).astype(np.float32), everything=False)
    return basis, target, Constraints.of({"par": par})


def _gap(solution: Any, rows: Any, y: Any, limits: Any, share: float) -> float:
    """How far the sum of squares is above the least at most: by scipy's linear program over the
    drives, along the gradient, of which a convex function has no more to gain (Frank, Wolfe 1956).
    """
    [lamp] = solution.problem.reduction.lamps.values()
    weights = solution.weights.ravel()
    gradient = 2 * rows.T @ (rows @ weights - y)
    by_drive = np.append(lamp.columns @ gradient[:3], gradient[3:])
    sums = np.zeros((3, len(by_drive)))
    sums[:, : len(lamp.most)] = lamp.powers, lamp.levels, -lamp.levels
    most = float(100 * weights.max())
    bounds = [(0, x) for x in lamp.most] + [(0, most)] * 3
    sides = [share, limits["max"], -limits["min"]]
    return float(gradient @ weights - linprog(by_drive, A_ub=sums, b_ub=sides, bounds=bounds).fun)


@pytest.mark.parametrize("seed", list(seeds(6, 60)))
def test_both_limits_give_the_least_squares_of_scipy(make_basis, seed):
    rng = np.random.default_rng(seed)
    share, limits = rng.uniform(0.2, 0.6), {"min": rng.uniform(0, 1), "max": rng.uniform(1.2, 4)}
    par = {"emitters": RGBWA, "power_share": share, "limits": limits}
    basis, target, constraints = _problem(make_basis, seed, par)
    solution = solve(basis, target, constraints=constraints, literal=True)
    assert solution.certificate.converged
    A, y = stack_rows(basis, target)
    assert _gap(solution, A, y, limits, share) <= SAME * (y @ y)
    [lamp] = solution.problem.reduction.lamps.values()
    light = solution.lighting["par"]
    drives = np.array([*light.drives.values()])
    assert drives @ lamp.powers <= share * (1 + 1e-6)
    assert limits["min"] - 1e-6 <= luminance(np.array(light.emission)) <= limits["max"] + 1e-6


@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_the_corners_hold_all_that_the_lamp_can_emit(count):
    lamp = _lamp(count, power_share=0.45)
    least, most = 0.1 * lamp.levels.sum(), 0.4 * lamp.levels.sum()
    corners = lamp.corners(least, most)
    assert (luminance(corners) >= least - 1e-9).all()
    assert (luminance(corners) <= most + 1e-9).all()
    assert all(lamp.can_mix(x) for x in corners)
    # No direction leads farther than a corner: the best drives for it, by a linear program.
    for way in np.random.default_rng(count).normal(size=(20, 3)):
        assert (corners @ way).max() == pytest.approx(_farthest(lamp, way, least, most), abs=1e-6)


def _lamp(count: int, **fields: Any) -> Lamp:
    colors = [(11.5, -0.75, -0.13), (-3.2, 6.26, 0.02), (-0.74, 0.09, 12.4), (6, 5, 4), (8, 1, 0)]
    emitters = [LampEmitter(f"e{k}", color, watts=9.0 + k) for k, color in enumerate(colors)]
    return Lamp(tuple(emitters[:count]), **fields)


def _farthest(lamp: Lamp, way: Any, least: float, most: float) -> float:
    rows = [lamp.powers, lamp.levels, -lamp.levels]
    bounds = [(0, x) for x in lamp.most]
    best = linprog(
        -(lamp.columns @ way), A_ub=rows, b_ub=[lamp.power_share, most, -least], bounds=bounds
    )
    return float(-best.fun)


def test_limits_that_power_does_not_reach_leave_nothing(make_basis):
    par = {"emitters": RGBWA, "power_share": 0.1, "limits": {"min": 5}}
    basis, target, constraints = _problem(make_basis, 1, par)
    with pytest.raises(ConstraintError, match="leaves it no emission at all: widen the limits"):
        solve(basis, target, constraints=constraints)
