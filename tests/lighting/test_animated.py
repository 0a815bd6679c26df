"""Lights that change over a shot: their curves, and the solve that ties neighbouring frames."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator
from scipy.optimize import lsq_linear

import lightpaint as lp
from lightpaint.errors import LightingError
from lightpaint.lighting.answer.lighting_keys import LightingKey, key_slopes, weights_at
from lightpaint.lighting.solver import TIE, solution_of, tie_frames


def keys_of(frames: Any, weights: Any) -> list[LightingKey]:
    return [
        LightingKey(frame, tuple(map(tuple, rows)))
        for frame, rows in zip(frames, np.asarray(weights).tolist(), strict=True)
    ]


@pytest.mark.parametrize("seed", range(4))
def test_curves_are_those_of_pchip_but_level_at_the_ends(seed: int) -> None:
    rng = np.random.default_rng(seed)
    frames = np.cumsum(rng.integers(1, 20, 6)).tolist()
    weights = rng.gamma(1, 1, (6, 2, 3)) * (rng.uniform(size=(6, 2, 3)) > 0.2)
    keys = keys_of(frames, weights)
    slopes = PchipInterpolator(frames, weights).derivative()(frames)
    np.testing.assert_allclose(key_slopes(keys)[1:-1], slopes[1:-1], atol=1e-12)
    assert not key_slopes(keys)[[0, -1]].any()
    inner = np.linspace(frames[1], frames[-2], 50)
    curve = np.array([weights_at(keys, x) for x in inner])
    np.testing.assert_allclose(curve, PchipInterpolator(frames, weights)(inner), atol=1e-12)


def test_curves_stay_between_their_keys_and_rest_outside() -> None:
    weights = [[(0, 3, 1)], [(0, 1, 2)], [(5, 0, 2)]]
    keys = keys_of((10, 20, 60), weights)
    curve = np.array([weights_at(keys, x) for x in range(80)])
    assert curve.min() == 0
    assert (curve[20:60, 0, 2] == 2).all()
    assert (np.diff(curve[10:61, 0, 1]) <= 0).all()
    np.testing.assert_array_equal(curve[:11], np.array([weights[0]] * 11))
    np.testing.assert_array_equal(curve[60:], np.array([weights[2]] * 20))
    # No jump in speed: a straight line from 3 to 1 in ten frames would begin with 0.2 per frame.
    assert np.abs(np.diff(curve, n=2, axis=0)).max() < 6 * 2 / 10**2


def problems_of(make_basis: Any, frames: int = 3) -> tuple[list[lp.Problem], list[Any]]:
    """Frames of the same lights on other surfaces, and noisy paintings of each."""
    problems, parts = [], []
    rng = np.random.default_rng(2)
    for k in range(frames):
        basis = make_basis(3, seed=k)
        image = basis.mix(rng.uniform(0, 2, (3, 3))) * rng.uniform(0.8, 1.2, (*basis.size, 1))
        target = lp.Target.of(image.astype(np.float32))
        problems.append(lp.Problem.of(basis, target))
        parts.append((basis.images.astype(np.float64), image))
    return problems, parts


def test_the_tied_solve_is_the_least_of_the_whole(make_basis: Any) -> None:
    problems, parts = problems_of(make_basis)
    frames, n = (1, 5, 21), 3
    solutions = tie_frames([solution_of(x) for x in problems], frames)
    spans = np.diff(frames)
    for c in range(3):
        rows, goal = [], []
        for k, (images, painted) in enumerate(parts):
            block = np.zeros((painted[..., c].size, 3 * n))
            block[:, k * n : (k + 1) * n] = images[..., c].reshape(n, -1).T
            rows.append(block)
            goal.append(painted[..., c].ravel())
        for k, span in enumerate(spans):
            power = (problems[k].power[:, c] + problems[k + 1].power[:, c]) / 2
            root = np.sqrt(TIE * power * spans.mean() / span)
            tie = np.zeros((n, 3 * n))
            tie[:, k * n : (k + 2) * n] = np.concatenate([np.diag(-root), np.diag(root)], axis=1)
            rows.append(tie)
            goal.append(np.zeros(n))
        expected = lsq_linear(np.concatenate(rows), np.concatenate(goal), (0, np.inf), tol=1e-14).x
        found = np.concatenate([solution.weights[:, c] for solution in solutions])
        np.testing.assert_allclose(found, expected, atol=1e-4)


def test_what_a_frame_does_not_show_comes_from_its_neighbours(make_basis: Any) -> None:
    bases = [make_basis(2, seed=k) for k in range(3)]
    images = bases[1].images.copy()
    images[1] = 0  # the second light is out of the picture
    bases[1] = bases[1].on_pixels(images, 0 * images, bases[1].emitters_seen)
    weights = [np.full((2, 3), x) for x in (1.0, 2.0, 3.0)]
    targets = [lp.Target.of(basis.mix(w)) for basis, w in zip(bases, weights, strict=True)]
    problems = [lp.Problem.of(*pair) for pair in zip(bases, targets, strict=True)]
    alone = tie_frames([solution_of(x) for x in problems], (1, 2, 3), tie=0)
    assert alone[1].weights[1, 0] == bases[1].current_weights[1, 0]
    assert alone[1].certificate.unreached == (bases[1].names[1],)
    solutions = tie_frames([solution_of(x) for x in problems], (1, 2, 3))
    tied = [solution.weights[1, 0] for solution in solutions]
    assert tied[1] == pytest.approx((tied[0] + tied[2]) / 2, rel=0.05)
    assert solutions[1].certificate.unreached == ()
    assert solutions[1].reached.all()


def test_keys_are_read_as_they_were_written(tmp_path: Path, make_basis: Any) -> None:
    basis = make_basis(2)
    rng = np.random.default_rng(0)
    keys = tuple(
        LightingKey(frame, tuple(map(tuple, rng.uniform(0, 1, (2, 3)).tolist())), f"p.{frame}")
        for frame in (-3, 8)
    )
    lights = lp.Lighting.of_weights(basis, np.array(keys[0].weights)).lights
    lighting = lp.Lighting(lights, "dusk", animation=keys)
    lp.write_lighting(tmp_path / "lighting.json", lighting)
    reread = lp.read_lighting(tmp_path / "lighting.json")
    assert reread == lighting
    assert reread.at_frame(8).emission == dict(zip(basis.names, keys[1].weights, strict=True))
    text = (tmp_path / "lighting.json").read_text()
    for old, new in (('"frame": 8', '"frame": -4'), ('"frame": 8', '"frame": 1.5')):
        (tmp_path / "wrong.json").write_text(text.replace(old, new))
        with pytest.raises(LightingError, match=r"key|frame"):
            lp.read_lighting(tmp_path / "wrong.json")
