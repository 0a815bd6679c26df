"""What holds lights, and what letting go brings: against scipy on the pixels, in other columns."""

import json
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from least_squares import stack_rows
from nightly import seeds
from scipy.optimize import lsq_linear

from lightpaint.colour.color import kelvin_to_rgb
from lightpaint.colour.color_ranges import white_range
from lightpaint.errors import LightingError
from lightpaint.lighting.analysis import active_bounds
from lightpaint.lighting.analysis.diagnosis import diagnose
from lightpaint.lighting.answer.certificate import Bound
from lightpaint.lighting.answer.lighting_file import read_lighting, write_lighting
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.target.painted_target import Target

SIZE = (5, 4)
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

#: Difference of two objectives beside ‖Ψ‖²: float64 of some condition, and scipy's stopping.
SAME = 1e-9

#: A gain that must not be overlooked, beside ‖Ψ‖²: `is_active` looks at the gradient, and what it
#: takes for none, 10⁻⁷ of its scale, brings its square.
WORTH = 1e-8

#: Step of the finite differences, in units of emission, where weights are some 0.1 to 1.
STEP = 1e-5
STEPS = (STEP, -STEP)


@dataclass
class LightRange:
    """One light, or tied ones, by its own words: w = C x + w0 with low <= x <= high."""

    lights: tuple[int, ...]
    C: Any  # (k, 3 n)
    low: Any
    high: Any
    w0: Any  # (3 n,)
    kind: str = ""


def _light_columns(n: int, light: int, colours: Any) -> Any:
    C = np.zeros((len(colours), n, 3))
    C[:, light] = colours
    return C.reshape(len(colours), 3 * n)


def _free_range(n: int, light: int, is_scalar: bool) -> LightRange:
    C = _light_columns(n, light, np.ones((1, 3)) if is_scalar else np.eye(3))
    k = len(C)
    return LightRange((light,), C, np.zeros(k), np.full(k, np.inf), np.zeros(3 * n))


def _problem(make_basis: Any, seed: int, n: int = 6) -> tuple[Any, Target]:
    rng = np.random.default_rng(seed)
    basis = make_basis(n, SIZE, seed=seed, names=[f"l{k}" for k in range(n)])
    lights = []
    for light in basis.lights:
        emission = tuple(rng.uniform(0.1, 2, 3).tolist())
        lights.append(replace(light, emission=emission))
    lights[-1] = replace(lights[-1], emission=(1.0,) * 3, is_scalar=True)
    image = (rng.random((*SIZE, 3)) * rng.uniform(0.3, 4)).astype(np.float32)
    importance = rng.random(SIZE).astype(np.float32)
    return replace(basis, lights=tuple(lights)), Target("t", image, importance, everything=False)


def _reduced(basis: Any, target: Target) -> tuple[Any, Any]:
    """R (3 n + 1 rows) and q with ‖R w − q‖² the objective: QR of the weighted pixels."""
    R = np.linalg.qr(np.column_stack(stack_rows(basis, target)), mode="r")
    return R[:, :-1], R[:, -1]


def _random_ranges(rng: Any, basis: Any) -> tuple[dict[str, Any], list[str], list[LightRange]]:
    """What is asked of each light: as `Constraints.of` takes it, and by its own words."""
    n = len(basis.lights)
    current = np.array([light.emission for light in basis.lights])
    wishes: dict[str, Any] = {}
    ranges = []
    for k in range(n - 3):
        one = _free_range(n, k, is_scalar=False)
        kind = rng.choice(["", "lock", "off", "rgb", "color", "dimmer", "kelvin"])
        if kind == "lock":
            emission = rng.exponential(0.3, 3)
            wishes[f"l{k}"] = {"lock": emission.tolist()}
            one.C, one.low, one.high = one.C[:0], one.low[:0], one.high[:0]
            one.w0[3 * k : 3 * k + 3] = emission
        elif kind == "off":
            wishes[f"l{k}"] = {"off": True}
            one.C, one.low, one.high = one.C[:0], one.low[:0], one.high[:0]
        elif kind == "rgb":
            one.low, one.high = rng.uniform(0, 0.2, 3), rng.uniform(0.2, 0.6, 3)
            one.low[rng.integers(3)] = 0
            limits = {"min": one.low.tolist(), "max": one.high.tolist()}
            wishes[f"l{k}"] = {"limits": limits}
        elif kind in ("color", "dimmer"):
            one.C = _light_columns(n, k, [kelvin_to_rgb(3200)])
            one.low, one.high = np.zeros(1), np.full(1, np.inf)
            wishes[f"l{k}"] = {"color": "3200K"}
            if kind == "dimmer":
                one.high[0] = rng.uniform(0.05, 0.5)
                wishes[f"l{k}"]["limits"] = {"max": float(one.high[0])}
        elif kind == "kelvin":
            one.C = _light_columns(n, k, [kelvin_to_rgb(2700), kelvin_to_rgb(6500)])
            one.low, one.high = np.zeros(2), np.full(2, np.inf)
            wishes[f"l{k}"] = {"kelvin": [2700, 6500]}
        one.kind = kind
        ranges.append(one)
    # Two tied lights, and one that can only be dimmed.
    ties = []
    if rng.random() < 0.5:
        C = (
            _light_columns(n, n - 3, current[[n - 3]]) + _light_columns(n, n - 2, current[[n - 2]])
        ).reshape(1, -1)
        tied = LightRange(
            (n - 3, n - 2), C, np.zeros(1), np.full(1, np.inf), np.zeros(3 * n), "tie"
        )
        ranges.append(tied)
        ties = [f"l{n - 3}", f"l{n - 2}"]
    else:
        ranges += [_free_range(n, n - 3, is_scalar=False), _free_range(n, n - 2, is_scalar=False)]
    last = _free_range(n, n - 1, is_scalar=True)
    if rng.random() < 0.6:
        last.kind, last.high = "scalar", np.array([rng.uniform(0.05, 0.4)])
        wishes[f"l{n - 1}"] = {"limits": {"max": float(last.high[0])}}
    return wishes, ties, [*ranges, last]


def _least_objective(R: Any, q: Any, ranges: list[LightRange]) -> float:
    """The least objective, by scipy."""
    C = np.concatenate([a.C for a in ranges]).T
    w0 = np.sum([a.w0 for a in ranges], axis=0)
    low, high = (np.concatenate(x) for x in zip(*((a.low, a.high) for a in ranges), strict=True))
    rest = q - R @ w0
    if not low.size:
        return float(rest @ rest)
    solution = lsq_linear(R @ C, rest, bounds=(low, high), method="bvls", tol=1e-15, max_iter=1000)
    return float(2 * solution.cost)


def _drop_bound(bound: Bound, ranges: list[LightRange], w: Any, basis: Any) -> list[LightRange]:
    """What is asked of all lights without that one bound."""
    n = len(basis.lights)
    indices = [basis.names.index(name) for name in bound.lights]
    others = [a for a in ranges if set(a.lights) != set(indices)]
    if bound.kind != "zero":
        return others + [_free_range(n, k, basis.lights[k].is_scalar) for k in indices]
    [one] = (a for a in ranges if set(a.lights) == set(indices))
    is_off = _is_at_zero(one, w)
    low, high = np.where(is_off, -np.inf, one.low), np.where(is_off, 0, one.high)
    return [*others, replace(one, low=low, high=high)]


def _is_at_zero(one: LightRange, w: Any) -> Any:
    return np.array([not w.ravel()[column > 0].any() for column in one.C]) & (one.low == 0)


def _solve(make_basis: Any, seed: int) -> Any:
    basis, target = _problem(make_basis, seed)
    rng = np.random.default_rng(1000 + seed)
    wishes, ties, ranges = _random_ranges(rng, basis)
    constraints = Constraints.of(wishes, tie=ties)
    solution = solve(basis, target, constraints=constraints)
    assert solution.certificate.converged
    for one in ranges:
        if one.kind == "kelvin":
            one.C = _tangent(solution, one.lights[0])
    return basis, target, solution, ranges


def _tangent(solution: Any, light: int) -> Any:
    """The emissions that a light of a range of white mixes about its answer."""
    knobs = solution.problem.local_reduction.knobs
    [knob] = (knob for knob in knobs if knob.lights == (light,))
    return _light_columns(
        6, light, [rgb for unknown in knob.unknowns for _, rgb in unknown.columns]
    )


def _white_pieces(low: float, high: float) -> list[Any]:
    """The emissions that a light of a range of white mixes, piece by piece."""
    return [_light_columns(6, 0, pair) for pair in pairwise(white_range(low, high).colors)]


@pytest.mark.parametrize("seed", seeds(20, 250))
def test_each_gain_is_that_of_the_problem_without_that_one_bound(
    make_basis: Any, seed: int
) -> None:
    basis, target, solution, ranges = _solve(make_basis, seed)
    R, q = _reduced(basis, target)
    w = solution.lighting.weights_for(basis)
    bounds, left_out = active_bounds.bounds_of(solution)
    assert left_out == 0
    assert [b.gain for b in bounds] == sorted((b.gain for b in bounds), reverse=True)
    before, scale = _least_objective(R, q, ranges), q @ q
    for bound in bounds:
        gain = before - _least_objective(R, q, _drop_bound(bound, ranges, w, basis))
        assert abs(bound.gain - gain) <= SAME * scale
    # None is overlooked: whatever is asked of a light and costs something has its bound.
    bounded_lights = {bound.lights for bound in bounds if bound.kind != "zero"}
    for one in ranges:
        names = tuple(basis.names[k] for k in one.lights)
        if one.kind and names not in bounded_lights:
            freed_ranges = [a for a in ranges if a is not one]
            freed_ranges += [_free_range(6, k, basis.lights[k].is_scalar) for k in one.lights]
            assert before - _least_objective(R, q, freed_ranges) <= WORTH * scale
        labels = {light.name: light.constraint for light in solution.lighting.lights}
    for bound in bounds:
        if bound.kind != "zero":
            assert bound.held_by == labels[bound.lights[0]] != ""


def _raise_bound(
    bound: Bound, ranges: list[LightRange], w: Any, basis: Any, j: int, h: float
) -> list[LightRange]:
    """What is asked of all lights with the j-th number that holds raised by h."""
    indices = [basis.names.index(name) for name in bound.lights]
    others = [a for a in ranges if set(a.lights) != set(indices)]
    [one] = (a for a in ranges if set(a.lights) == set(indices))
    w0, low, high = one.w0.copy(), one.low.copy(), one.high.copy()
    if bound.kind == "zero":
        low[j] += h
    elif bound.kind == "limits":
        at_low = w.ravel() @ one.C[j] <= one.low[j] * (one.C[j] @ one.C[j]) * (1 + 1e-12)
        if at_low and one.low[j] > 0:
            low[j] += h
        elif one.low[j] == 0 and at_low:
            return ranges  # zero holds, which is another bound
        else:
            high[j] += h
    elif bound.kind == "tie":
        k = indices[j]
        w0[3 * k : 3 * k + 3] += h * np.array(basis.lights[k].emission)
    else:
        w0[3 * indices[0] + j] += h
    return [*others, replace(one, w0=w0, low=low, high=high)]


def _bound_indices(bound: Bound, ranges: list[LightRange], basis: Any, j: int) -> Any:
    """Which numbers multiplier j is of: of a mix that is off, the primary that matters most."""
    indices = {basis.names.index(name) for name in bound.lights}
    [one] = (a for a in ranges if set(a.lights) == indices)
    return range(len(one.low)) if bound.kind == "zero" and one.kind == "kelvin" else [j]


@pytest.mark.parametrize("seed", seeds(15, 120))
def test_each_multiplier_is_how_fast_the_objective_changes(make_basis: Any, seed: int) -> None:
    basis, target, solution, ranges = _solve(make_basis, seed)
    R, q = _reduced(basis, target)
    w = solution.lighting.weights_for(basis)
    bounds, _ = active_bounds.bounds_of(solution)
    for bound in bounds:
        assert len(bound.multiplier) == {"emission": 3, "luminance": 1}.get(
            bound.per, len(bound.lights)
        )
        for j, multiplier in enumerate(bound.multiplier):
            if bound.kind == "zero" and multiplier == 0:
                continue  # a channel that is on
            slopes = []
            for i in _bound_indices(bound, ranges, basis, j):
                up, down = (
                    _least_objective(R, q, _raise_bound(bound, ranges, w, basis, i, h))
                    for h in STEPS
                )
                slopes.append((up - down) / (2 * STEP))
            slope = max(slopes)
            if bound.kind == "off":
                slope = min(slope, 0)
            # Between two changes of what is held the objective is quadratic, and the difference
            # exact but for the round-off of the objective; at a change it is off by the step
            # times the power of a light.
            power = np.square(R).sum(axis=0).max()
            allowed = 1e-12 * (q @ q) / STEP + 4 * STEP * power * len(basis.lights)
            assert abs(multiplier - slope) <= allowed


@pytest.mark.nightly
def test_multipliers_of_the_tests_are_not_small(make_basis: Any) -> None:
    """Else the one above could not fail."""
    sizes: dict[str, list[float]] = {}
    for seed in range(60):
        basis, target, solution, _ = _solve(make_basis, seed)
        R, q = _reduced(basis, target)
        allowed = 1e-12 * (q @ q) / STEP + 4 * STEP * np.square(R).sum(axis=0).max() * 6
        for bound in active_bounds.bounds_of(solution)[0]:
            size = max(np.abs(bound.multiplier)) / allowed
            sizes.setdefault(bound.kind, []).append(size)
    assert set(sizes) == {"zero", "lock", "off", "tie", "limits", "colour"}
    for kind, measured in sizes.items():
        assert np.median(measured) > 100, kind


@pytest.mark.nightly
@pytest.mark.parametrize("seed", seeds(8, 40))
@pytest.mark.parametrize("is_least", [False, True])
def test_a_limit_of_luminance(make_basis: Any, seed: int, is_least: bool) -> None:
    basis, target = _problem(make_basis, seed)
    plain = solve(basis, target).lighting.weights_for(basis)
    level = float(plain[1] @ LUMINANCE) * (1.5 if is_least else 0.5) + 0.05 * is_least

    def objective(limit: float) -> tuple[float, Any]:
        limits = {"l1": {"limits": {"min" if is_least else "max": limit}}}
        solution = solve(basis, target, constraints=Constraints.of(limits))
        return sum(solution.certificate.objective), solution

    before, solution = objective(level)
    if level == 0:
        return
    [bound] = (b for b in active_bounds.bounds_of(solution)[0] if b.kind == "limits")
    free = sum(solve(basis, target).certificate.objective)
    norm2 = float(solution.equations.target_norm2.sum())
    assert bound.gain == pytest.approx(before - free, abs=SAME * norm2)
    assert bound.per == "luminance"
    [multiplier] = bound.multiplier
    assert (multiplier > 0) == is_least
    step = 1e-5 * level
    slope = (objective(level + step)[0] - objective(level - step)[0]) / (2 * step)
    # Round-off of the objective over the step; the curvature of a change in what is held.
    power = float(np.einsum("cii->ic", solution.equations.M)[1].max() / LUMINANCE.min() ** 2)
    assert multiplier == pytest.approx(slope, abs=1e-13 * norm2 / step + 2 * step * power)


@pytest.mark.nightly
@pytest.mark.parametrize("seed", seeds(8, 60))
def test_lights_that_sparse_leaves_out(make_basis: Any, seed: int) -> None:
    basis, target = _problem(make_basis, seed)
    R, q = _reduced(basis, target)
    constraints = Constraints.of({"l0": {"kelvin": [2700, 6500]}}, sparse=2)
    solution = solve(basis, target, constraints=constraints)
    w = solution.lighting.weights_for(basis)
    ranges = [_free_range(6, k, basis.lights[k].is_scalar) for k in range(6)]
    ranges[0] = LightRange(
        (0,), _tangent(solution, 0), np.zeros(2), np.full(2, np.inf), np.zeros(18)
    )
    lit_lights = [k for k in range(6) if w[k].any()]
    before = _least_objective(R, q, [ranges[k] for k in lit_lights])

    def gained(k: int) -> float:
        if k:
            return before - _least_objective(R, q, [ranges[j] for j in (*lit_lights, k)])
        pieces = [replace(ranges[0], C=C) for C in _white_pieces(2700, 6500)]
        return before - min(
            _least_objective(R, q, [*(ranges[j] for j in lit_lights), one]) for one in pieces
        )

    bounds = [b for b in active_bounds.bounds_of(solution)[0] if b.kind == "left out"]
    # Each as what else is asked of it allows: l0 is still white.
    gains = {k: gained(k) for k in set(range(6)) - set(lit_lights)}
    bound_by_light = {basis.names.index(b.lights[0]): b for b in bounds}
    for k, gain in gains.items():
        if gain > WORTH * (q @ q):
            # Of whites that no neighbour betters there may be several, nearly as good.
            near = SAME if k else 1e-6
            assert bound_by_light[k].gain == pytest.approx(gain, abs=near * (q @ q))
            assert bound_by_light[k].held_by == "left out"
            assert max(bound_by_light[k].multiplier) <= 0
            assert bound_by_light[k].is_switched_off


@pytest.mark.parametrize("seed", range(30))
def test_with_a_pull_the_gain_is_of_the_miss_alone(make_basis: Any, seed: int) -> None:
    basis, target = _problem(make_basis, seed)
    off_constraints = Constraints.of({"l1": {"off": True}}, prefer_current=0.02)
    solution = solve(basis, target, constraints=off_constraints)
    unbounded = solve(basis, target, constraints=Constraints.of(prefer_current=0.02))
    gain = sum(solution.certificate.objective) - sum(unbounded.certificate.objective)
    off_bounds = [b for b in active_bounds.bounds_of(solution)[0] if b.kind == "off"]
    norm2 = float(solution.equations.target_norm2.sum())
    for bound in off_bounds:
        assert bound.gain == pytest.approx(gain, abs=SAME * norm2)
    assert off_bounds
    assert off_bounds[0].held_by == "off"


def test_a_kept_light_stands_in_the_way_under_constraints_too(make_basis: Any) -> None:
    basis, target = _problem(make_basis, 3)
    kept_light = replace(basis.lights[0], emission=(1.0,) * 3, is_fixed=True)
    basis_with_kept = replace(basis, lights=(kept_light, *basis.lights[1:]))
    colour_constraint = {"l1": {"color": "3200K"}}
    solution = solve(basis_with_kept, target, constraints=Constraints.of(colour_constraint))
    [bound] = (b for b in active_bounds.bounds_of(solution)[0] if b.kind == "kept")
    free = solve(basis, target, constraints=Constraints.of(colour_constraint))
    gain = sum(solution.certificate.objective) - sum(free.certificate.objective)
    assert bound.gain == pytest.approx(gain, rel=1e-8)


def test_the_scene_with_twelve_lights_has_all_of_its_bounds(make_basis: Any) -> None:
    basis, target = _problem(make_basis, 1, 12)
    constraints = {"l?": {"color": "3200K"}, "l11": {"limits": {"max": 0.01}}, "l10": {"off": True}}
    solution = solve(basis, target, constraints=Constraints.of(constraints))
    bounds, left_out = active_bounds.bounds_of(solution)
    assert left_out == 0
    active = [light.name for light in solution.lighting.lights if light.is_active]
    assert set(active) == {b.lights[0] for b in bounds if b.kind != "zero"}


def test_of_many_bounds_those_that_seem_to_matter_most_are_looked_into(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    basis, target = _problem(make_basis, 2)
    constraints = {"l*": {"off": True}, "l5": {"lock": 0.5}}
    solution = solve(basis, target, constraints=Constraints.of(constraints))
    every, none = active_bounds.bounds_of(solution)
    assert none == 0
    monkeypatch.setattr(active_bounds, "MAX_RELEASED", 2)
    diagnosis = diagnose(solution)
    assert len(diagnosis.bounds) == 2
    assert diagnosis.bounds_left_out == len(every) - 2
    assert set(diagnosis.bounds) <= set(every)


@pytest.mark.parametrize("seed", seeds(8, 40))
def test_the_estimate_is_a_lower_limit(make_basis: Any, seed: int) -> None:
    """By moving one light alone nothing is gained that moving all would not gain."""
    basis, _, solution, _ = _solve(make_basis, seed)
    answer = active_bounds._bounded_answer(solution, solution.problem.solved)
    norm2 = float(solution.equations.target_norm2.sum())
    gains = {(b.lights, b.kind): b.gain for b in active_bounds.bounds_of(solution)[0]}
    for h in active_bounds.find_active_bounds(answer):
        names = tuple(basis.names[k] for k in h.lights)
        if (names, h.kind) in gains and len(names) == 1:
            assert h.estimate <= gains[names, h.kind] + SAME * norm2


def test_bounds_stand_in_the_answer_file(make_basis: Any, tmp_path: Any) -> None:
    _basis, _target, solution, _ = _solve(make_basis, 7)
    diagnosis = diagnose(solution)
    assert diagnosis.bounds
    path = tmp_path / "lighting.json"
    write_lighting(path, solution.with_certificate_fields(bounds=diagnosis.bounds).lighting)
    assert read_lighting(path).certificate.bounds == diagnosis.bounds  # type: ignore[union-attr]
    data = json.loads(path.read_text(encoding="utf-8"))
    assert set(data["solve"]["bounds"][0]) == {
        "lights", "kind", "held_by", "gain", "multiplier", "per", "tint",
    }  # fmt: skip
    # An older file has none; one that was edited is refused in one line.
    write_lighting(path, solution.lighting)
    assert "bounds" not in json.loads(path.read_text(encoding="utf-8"))["solve"]
    assert read_lighting(path).certificate.bounds == ()  # type: ignore[union-attr]
    for key, value in (("kind", "fate"), ("lights", "l1"), ("gain", "x"), ("multiplier", 3)):
        broken = json.loads(json.dumps(data))
        broken["solve"]["bounds"][0][key] = value
        path.write_text(json.dumps(broken), encoding="utf-8")
        with pytest.raises(LightingError, match="not a complete lighting"):
            read_lighting(path)
