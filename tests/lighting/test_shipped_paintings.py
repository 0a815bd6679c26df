"""Every shipped painting, solved by the program and by others: one lighting of the same planes.

The others are NumPy's sums over pixels in float64, SciPy's non-negative least squares and quadprog.
Planes are of few pixels and few samples: what they show does not matter, but that both have them.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nightly import nightly
from qp import least
from scipy.optimize import nnls

import lightpaint as lp
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.lighting import hold_to_current

ROOT = Path(__file__).parent.parent.parent

#: Paintings by their folder, which is called like their scene, and name.
PAINTINGS = sorted(
    str(path.relative_to(ROOT / "targets"))
    for path in (ROOT / "targets").glob("*/*")
    if path.suffix in (".exr", ".png") and not path.stem.endswith(".mask")
)

#: Those that are seen by another sensor than the scene's first.
SENSORS = {"stage/moonlight-box.exr": "box"}

#: Pixels along the longer side, and samples of each.
SIDE, SPP = 48, 4

#: Part of the brightest light by which weights may differ: float64 has 2e-16, and the matrices'
#: condition is at most 1e6.
ROUND_OFF = 1e-9

#: The same where pixels are held to the current look, which is a picture in float32.
PICTURE_ROUND_OFF = 1e-6

#: Where the gradient of the objective vanishes, in parts of b.
FLAT = 1e-10

#: How much unpainted pixels count together, beside the painted ones.
HOLD = 2.0

Planes = Callable[[str], lp.Basis]


@pytest.fixture(scope="module")
def planes() -> Planes:
    """A function that renders the planes of a painting's scene, through its sensor."""

    @cache
    def render(folder: str, sensor: str | None) -> lp.Basis:
        # Images in texels have an expectation, which the others do not know: a sky is one light.
        path = ROOT / "scenes" / folder / "scene.xml"
        scene = lp.load_scene(path, sensor=sensor, split={})
        small = scene.reduced(f"1/{-(-max(scene.size) // SIDE)}")
        return render_basis(small, spp=SPP, seed=1)

    return lambda name: render(name.partition("/")[0], SENSORS.get(name))


def _painting(name: str, basis: lp.Basis) -> lp.Target:
    path = ROOT / "targets" / name
    mask = path.with_name(f"{path.stem}.mask.exr")
    target = lp.read_target(path, mask=mask if mask.exists() else None)
    return target.fitted_to(basis.size, resize=True)


def _literal_problem(basis: lp.Basis, target: lp.Target) -> tuple[Any, Any]:
    """Ψ, (h, w, 3), and D, (h, w), where pixels with an emitter in view count if painted."""
    D = target.importance.astype(np.float64)
    if target.everything:
        D = np.where(basis.emitters_seen, 0, D)
    return target.image.astype(np.float64), D


def _hold_look(basis: lp.Basis, target: lp.Target) -> tuple[Any, Any]:
    """The same with unpainted pixels held to the current look C: D + u and (D Ψ + u C) / (D + u).

    All u together are HOLD times all D, and no u is more than 1 − D (docs/method.md, "Unpainted
    pixels").
    """
    psi, D = _literal_problem(basis, target)
    look = np.einsum("nc,nhwc->hwc", basis.current_weights, basis.images.astype(np.float64))
    free = np.where(basis.emitters_seen, 0, np.maximum(1 - D, 0))
    u = free * (min(HOLD * D.sum() / free.sum(), 1.0) if free.any() else 0.0)
    total_weight = np.where(D + u > 0, D + u, 1)[..., None]
    return (D[..., None] * psi + u[..., None] * look) / total_weight, D + u


def _rows(basis: lp.Basis, psi: Any, D: Any, channel: int) -> tuple[Any, Any]:
    """A, (pixels, n), and y, (pixels,), with the objective ‖A w − y‖² of a channel."""
    root = np.sqrt(D).ravel()
    images = basis.images[..., channel].astype(np.float64).reshape(len(basis.lights), -1)
    return images.T * root[:, None], psi[..., channel].ravel() * root


def _assert_close(weights: Any, others: Any, part: float = ROUND_OFF) -> None:
    np.testing.assert_allclose(weights, others, rtol=0, atol=part * np.abs(others).max())


def test_all_scenes_have_paintings() -> None:
    scenes = {path.parent.name for path in (ROOT / "scenes").glob("*/scene.xml")}
    assert {name.partition("/")[0] for name in PAINTINGS} == scenes


@pytest.mark.parametrize("name", PAINTINGS)
def test_no_answer_is_farther_from_its_painting_than_the_lights_as_they_are(
    planes: Planes, name: str
) -> None:
    """In the mean ΔE that reports give."""
    basis = planes(name)
    appearance = lp.compare_appearance(hold_to_current(lp.solve(basis, _painting(name, basis))))
    assert appearance.delta_e <= appearance.requested_change


#: By day sums of some, and the lightings of all.
SUMMED = [name if k % 8 == 0 else nightly(name) for k, name in enumerate(PAINTINGS)]


@pytest.mark.parametrize("name", SUMMED)
def test_sums_over_pixels_are_those_of_numpy(planes: Planes, name: str) -> None:
    basis = planes(name)
    target = _painting(name, basis)
    equations = lp.Problem.of(basis, target, fit=lp.Fit(literal=True)).equations
    for channel in range(3):
        A, y = _rows(basis, *_literal_problem(basis, target), channel)
        np.testing.assert_allclose(equations.M[channel], A.T @ A, rtol=1e-11)
        np.testing.assert_allclose(equations.b[channel], A.T @ y, rtol=1e-11)
        np.testing.assert_allclose(equations.target_norm2[channel], y @ y, rtol=1e-11)


def _solve_by_scipy(basis: lp.Basis, psi: Any, D: Any) -> Any:
    return np.stack([nnls(*_rows(basis, psi, D, c))[0] for c in range(3)], axis=-1)


@pytest.mark.parametrize("name", SUMMED)
def test_literal_lightings_are_those_of_scipy(planes: Planes, name: str) -> None:
    basis = planes(name)
    target = _painting(name, basis)
    solution = lp.solve(basis, target, literal=True)
    if solution.problem.is_linear:
        _assert_close(solution.weights, _solve_by_scipy(basis, *_literal_problem(basis, target)))
    else:
        _assert_least(basis, target, solution.weights, *_literal_problem(basis, target))


@pytest.mark.parametrize("name", [name for name in PAINTINGS if name.endswith(".exr")])
def test_held_lightings_are_those_of_scipy(planes: Planes, name: str) -> None:
    basis = planes(name)
    target = _painting(name, basis)
    weights = lp.solve(basis, target, space="linear", colors="free", hold=HOLD).weights
    _assert_close(weights, _solve_by_scipy(basis, *_hold_look(basis, target)), PICTURE_ROUND_OFF)


def _assert_least(basis: lp.Basis, target: lp.Target, weights: Any, psi: Any, D: Any) -> None:
    """The convex objective in which "at least" pixels may be brighter cannot fall any more.

    That is so if its gradient vanishes for each light that is on, and is not negative for others.
    """
    residual = np.einsum("nc,nhwc->hwc", weights, basis.images.astype(np.float64)) - psi
    assert target.at_least is not None
    residual = np.where(target.at_least & (residual > 0), 0, residual)
    gradient, scale = (
        np.einsum("nhwc,hw,hwc->nc", basis.images.astype(np.float64), D, x) for x in (residual, psi)
    )
    flat = FLAT * np.abs(scale).max()
    assert np.abs(gradient[weights > 0]).max() < flat
    assert gradient.min() > -flat


@pytest.mark.parametrize("name", PAINTINGS)
def test_constrained_lightings_are_those_of_quadprog(planes: Planes, name: str) -> None:
    """One light is locked, one is off, one has a most of each channel."""
    basis = planes(name)
    target = replace(_painting(name, basis), at_least=None)  # least squares, of every painting
    free = lp.solve(basis, target, literal=True)
    dark, limited = np.argsort(-free.weights.min(axis=1))[:2]  # two that are on
    current_power = (basis.current_weights * basis.totals).sum(axis=1)
    locked = next(
        k for k in np.argsort(current_power) if k not in (dark, limited)
    )  # hardly in the way
    most = 0.5 * free.weights[limited]
    words = {
        basis.names[locked]: {"lock": True},
        basis.names[dark]: {"off": True},
        basis.names[limited]: {"limits": {"max": most.tolist()}},
    }
    weights = lp.solve(basis, target, literal=True, constraints=lp.Constraints.of(words)).weights
    assert (weights[limited] == most).any()
    n = len(basis.lights)
    for channel in range(3):
        A, y = _rows(basis, *_literal_problem(basis, target), channel)
        lower, upper = np.zeros(n), np.full(n, np.inf)
        lower[locked] = upper[locked] = basis.current_weights[locked, channel]
        upper[dark], upper[limited] = 0, most[channel]
        others = least(A.T @ A, A.T @ y, lower=lower, upper=upper)
        _assert_close(weights[:, channel], others)
