"""Lamps at the bounds of their gamuts under the brush: side by side to the same optimum."""

from typing import Any

import numpy as np
import pytest

import lightpaint as lp
from lightpaint.colour.color_ranges import ColorHull, reach_of, white_range
from lightpaint.lighting.linear_problem import reduce_lights
from lightpaint.lighting.live.live_solver import BRUSH_STEPS
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.unknowns import white_mixes
from lightpaint.lighting.unknowns.gamuts import Gamuts, PaintedLight
from lightpaint.lighting.unknowns.reduced_problem import nearest_unknowns, solve_reduced
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.lighting.unknowns.white_mixes import next_whites, solve_on_locus

SIZE = (9, 8)


def _problem(make_basis: Any, seed: int, n: int = 5) -> tuple[NormalEquations, Reduction, Any]:
    """A painting of colours that whites do not reach, under a basis of lamps that keep to some."""
    rng = np.random.default_rng(seed)
    basis = make_basis(n, SIZE, seed=seed, emission=rng.uniform(0.5, 1, (n, 3)).tolist())
    target_image = basis.mix(rng.exponential(1, (n, 3)) * (1, 1, 0.3)).astype(np.float32)
    weight = rng.random(SIZE).astype(np.float32)
    current = basis.current_weights
    gamuts = Gamuts(
        # The look is what is painted: no colours but their own, and whites.
        lambda: PaintedLight.of([(basis, basis.current_look, weight)]),
        basis.power,
        current,
    )
    reduction = reduce_lights(lp.Constraints(), basis.lights, lp.Fit(colors="gentle"), gamuts)
    equations = NormalEquations.of(basis, target_image, weight)
    return equations, reduction, current


def solve_near(
    equations: NormalEquations, reduction: Reduction, start: np.ndarray, steps: int = BRUSH_STEPS
) -> tuple[Reduction, np.ndarray]:
    reduction, optimum = solve_on_locus(equations, reduction, start, steps=steps)
    return reduction, optimum.weights


@pytest.mark.parametrize("seed", range(12))
def test_sides_lead_to_the_optimum_over_whole_gamuts(make_basis: Any, seed: int) -> None:
    """That of mixes of all corners, which is certified."""
    equations, reduction, current = _problem(make_basis, seed)
    over_gamuts, best = next_whites(equations, reduction, current)
    assert best.converged
    assert over_gamuts.confined_knobs  # else there is nothing to keep within anything
    near_sides, weights = solve_near(equations, reduction, current, steps=60)
    assert not (reduction.gamuts or Gamuts).lights_outside(weights, np.arange(len(current)))  # type: ignore[arg-type]
    value, least = (equations.objective(w).sum() for w in (weights, best.weights))
    round_off = 1e-9 * equations.target_norm2.sum()
    assert value == pytest.approx(least, abs=round_off)
    # And from there it stays.
    second_sides, second_weights = solve_near(equations, near_sides, weights)
    assert [knob.side for knob in second_sides.knobs] == [knob.side for knob in near_sides.knobs]
    np.testing.assert_allclose(second_weights, weights, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_exact_answers_of_many_lights_keep_to_triangles(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    """With the optimum of mixes of all corners, from fewer unknowns."""
    equations, reduction, current = _problem(make_basis, seed)
    over_gamuts, best = next_whites(equations, reduction, current)
    monkeypatch.setattr(white_mixes, "MANY_CONFINED", 0)
    in_triangles, optimum = next_whites(equations, reduction, current)
    assert in_triangles.has_sides
    assert not over_gamuts.has_sides
    assert len(optimum.x) < len(best.x)
    assert optimum.converged
    value, least = (equations.objective(x.weights).sum() for x in (optimum, best))
    assert value == pytest.approx(least, abs=1e-9 * equations.target_norm2.sum())  # round-off


def test_gamuts_of_another_painting_are_heeded(make_basis: Any) -> None:
    equations, reduction, current = _problem(make_basis, 1)
    gamuts = reduction.gamuts
    assert gamuts is not None
    near_sides, before = solve_near(equations, reduction, current)
    k = near_sides.confined_knobs[0]
    gamuts.refresh()
    second_sides, _ = solve_near(equations, near_sides, before)
    assert second_sides.knobs[k].gamut is near_sides.knobs[k].gamut  # nothing else was painted
    # Now whites alone, without its own colour and the margin.
    narrow = reach_of(white_range(3000, 6500).colors)
    gamuts.refresh()
    gamuts._gamuts[near_sides.knobs[k].lights[0]] = ColorHull(narrow, np.ones(3))
    after, weights = solve_near(equations, near_sides, before)
    light = after.knobs[k].lights[0]
    assert gamuts[light].has(weights[light])
    assert not gamuts[light].has(before[light])


@pytest.mark.parametrize("seed", range(4))
def test_mixes_of_three_colours_are_found_again(make_basis: Any, seed: int) -> None:
    """The x of an emission that three colours make are those that it was made with."""
    equations, reduction, current = _problem(make_basis, seed)
    near_sides, weights = solve_near(equations, reduction, current)
    optimum = solve_reduced(equations, near_sides, weights)
    x = nearest_unknowns(near_sides, near_sides.weights(optimum.x), np.ones(len(current), bool))
    np.testing.assert_allclose(
        near_sides.weights(x), near_sides.weights(optimum.x), rtol=1e-9, atol=1e-12
    )
