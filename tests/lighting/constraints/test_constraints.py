"""Constraints against scipy on the pixels, against their own definition, and in closed form."""

from dataclasses import replace
from itertools import combinations, pairwise
from typing import Any

import numpy as np
import pytest
from least_squares import stack_rows
from nightly import seeds
from qp import least
from scipy.optimize import lsq_linear, nnls

from lightpaint.colour.color import cct_and_duv, hex_to_rgb, kelvin_to_rgb
from lightpaint.colour.color_ranges import white_range
from lightpaint.errors import ConstraintError
from lightpaint.lighting.answer.lighting_file import read_lighting, write_lighting
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.unknowns.reduced_problem import reduced_problems
from lightpaint.target.painted_target import Target

SIZE = (5, 4)
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])

#: Objective beside ‖Ψ‖²: float64 of some condition here, the oracles' own tolerance there.
SAME = 1e-9

#: Random problems for each kind of constraint.
PROBLEMS = list(seeds(8, 60))


def _problem(make_basis: Any, seed: int, n: int = 4, *, scalar: tuple[int, ...] = ()) -> Any:
    rng = np.random.default_rng(seed)
    basis = make_basis(n, SIZE, seed=seed, names=[f"l{k}" for k in range(n)])
    lights = []
    for k, light in enumerate(basis.lights):
        emission = (1.0, 1.0, 1.0) if k in scalar else tuple(rng.uniform(0.1, 2, 3).tolist())
        lights.append(replace(light, emission=emission, is_scalar=k in scalar))
    image = (rng.random((*SIZE, 3)) * rng.uniform(0.3, 4)).astype(np.float32)
    importance = rng.random(SIZE).astype(np.float32)
    return replace(basis, lights=tuple(lights)), Target("t", image, importance, everything=False)


def _solve(basis: Any, target: Target, **constraint_options: Any) -> tuple[Any, float, Any]:
    solution = solve(basis, target, constraints=Constraints.of(**constraint_options))
    assert solution.certificate.converged
    w = solution.lighting.weights_for(basis)
    A, y = stack_rows(basis, target)
    return w, float(((A @ w.ravel() - y) ** 2).sum()), solution


def _current_weights(basis: Any) -> Any:
    return np.array([light.emission for light in basis.lights])


def _least_squares(A: Any, y: Any, C: Any, w0: Any, low: Any = 0.0, high: Any = np.inf) -> float:
    """The least ‖A (C x + w₀) − y‖² between bounds, by scipy."""
    optimum = lsq_linear(A @ C, y - A @ w0.ravel(), bounds=(low, high), method="bvls", tol=1e-14)
    return float(2 * optimum.cost)


def _least_squares_capped(A: Any, y: Any, C: Any, row: Any, least_of: float, most: float) -> float:
    """The same under least_of ≤ row · x ≤ most, x ≥ 0, by quadprog."""
    AC = A @ C
    x = least(AC.T @ AC, AC.T @ y, rows=[row], limits=[(least_of, most)])
    return float(((AC @ x - y) ** 2).sum())


def _columns(n: int, light: int, colours: Any) -> Any:
    """C (3n, …): all lights free but one, which mixes `colours`."""
    others = [3 * k + c for k in range(n) for c in range(3) if k != light]
    C = np.zeros((3 * n, len(others) + len(colours)))
    C[others, range(len(others))] = 1
    C[3 * light : 3 * light + 3, len(others) :] = np.transpose(colours)
    return C


def _check_close(objective: float, oracle: float, y: Any, *, tolerance: float = SAME) -> None:
    assert abs(objective - oracle) <= tolerance * (y @ y)


@pytest.mark.parametrize("seed", PROBLEMS)
def test_fixed_colours_and_leds(make_basis: Any, seed: int) -> None:
    basis, target = _problem(make_basis, seed)
    A, y = stack_rows(basis, target)
    free = _solve(basis, target, sparse=None, prefer_current=0, light={})[1]
    leds = [hex_to_rgb(text) for text in ("#ff2000", "#20ff00", "#3000ff", "#ffb070")]
    for words, colours in (
        ({"color": "3200K"}, [kelvin_to_rgb(3200)]),
        ({"color": "#ffaa66"}, [hex_to_rgb("#ffaa66")]),
        ({"color": [0.2, 0, 1]}, [[0.2, 0, 1]]),
        ({"primaries": ["#ff2000", "#20ff00", "#3000ff", "#ffb070"]}, leds),
    ):
        w, objective, solution = _solve(basis, target, light={"l1": words})
        _check_close(objective, _least_squares(A, y, _columns(4, 1, colours), np.zeros(12)), y)
        assert objective >= free - SAME * (y @ y)
        x, distance = nnls(np.transpose(colours).astype(float), w[1])
        assert distance < 1e-9 * max(1, w[1].max())
        assert (x >= 0).all()
        assert solution.lighting.lights[1].constraint


@pytest.mark.parametrize("seed", PROBLEMS)
def test_limits_of_emission(make_basis: Any, seed: int) -> None:
    basis, target = _problem(make_basis, seed)
    A, y = stack_rows(basis, target)
    high = np.full((4, 3), np.inf)
    low = np.zeros((4, 3))
    high[:, :] = [0.3, 0.4, 0.2]
    high[2], low[2] = [0.6, 0.6, 2], [0.1, 0.2, 0.3]
    words = {
        "l*": {"limits": {"max": [0.3, 0.4, 0.2]}},
        "l2": {"limits": {"min": [0.1, 0.2, 0.3], "max": [0.6, 0.6, 2]}},
    }
    w, objective, _ = _solve(basis, target, light=words)
    assert (w <= high).all()
    assert (w >= low).all()
    _check_close(
        objective, _least_squares(A, y, np.eye(12), np.zeros(12), low.ravel(), high.ravel()), y
    )


@pytest.mark.parametrize("seed", PROBLEMS)
def test_a_range_of_white_is_as_good_as_the_best_of_its_pieces(make_basis: Any, seed: int) -> None:
    basis, target = _problem(make_basis, seed)
    A, y = stack_rows(basis, target)
    words = {"kelvin": [2700, 6500], "duv": 0.002}
    w, objective, solution = _solve(basis, target, light={"l1": words})
    pieces = pairwise(white_range(2700, 6500, 0.002).colors)
    best = min(_least_squares(A, y, _columns(4, 1, piece), np.zeros(12)) for piece in pieces)
    _check_close(objective, best, y)
    assert solution.lighting.lights[1].constraint
    if w[1].any():
        kelvin, duv = cct_and_duv(w[1])  # type: ignore[misc]
        assert 2700 - 0.1 <= kelvin <= 6500 + 0.1
        assert abs(duv - 0.002) < 1e-4


@pytest.mark.parametrize("seed", PROBLEMS)
def test_limits_of_luminance(make_basis: Any, seed: int) -> None:
    basis, target = _problem(make_basis, seed)
    A, y = stack_rows(basis, target)
    current = float(_current_weights(basis)[1] @ LUMINANCE)
    whites = list(pairwise(white_range(2700, 6500).colors))
    for limits, lowest, most in (
        ({"max": 0.2}, 0.0, 0.2),
        ({"max": "40%"}, 0.0, 0.4 * current),
        ({"min": 0.5, "max": 0.9}, 0.5, 0.9),
    ):
        for extra, mixes in (({}, [np.eye(3)]), ({"kelvin": [2700, 6500]}, whites)):
            w, objective, _ = _solve(basis, target, light={"l1": {"limits": limits, **extra}})
            # Round-off of a sum of three.
            assert lowest - 1e-12 <= w[1] @ LUMINANCE <= most + 1e-12
            each = [_columns(4, 1, colours) for colours in mixes]
            best = [_least_squares_capped(A, y, C, LUMINANCE @ C[3:6], lowest, most) for C in each]
            # Of whites that no neighbour and no other white alone betters there may be several.
            tolerance = 2e-4 if extra else SAME
            assert objective >= min(best) - SAME * (y @ y)
            _check_close(objective, min(best), y, tolerance=tolerance)


@pytest.mark.parametrize("seed", PROBLEMS)
def test_ties_locks_and_off(make_basis: Any, seed: int) -> None:
    basis, target = _problem(make_basis, seed)
    A, y = stack_rows(basis, target)
    current = _current_weights(basis)
    # One dimmer: the columns of both, as they shine now, are one.
    w, objective, _ = _solve(basis, target, tie=["l0", "l2"])
    C = np.zeros((12, 7))
    C[[3, 4, 5, 9, 10, 11], range(6)] = 1
    C[0:3, 6], C[6:9, 6] = current[0], current[2]
    _check_close(objective, _least_squares(A, y, C, np.zeros(12)), y)
    np.testing.assert_allclose(w[0] / current[0], w[2, 0] / current[2, 0], rtol=1e-12)
    # What is locked moves to the right-hand side.
    locked_weights = np.zeros((4, 3))
    locked_weights[3], locked_weights[0] = current[3], [0.5, 0.25, 0.125]
    C = np.eye(12)[:, 3:9]
    words = {"l3": {"lock": True}, "l0": {"lock": [0.5, 0.25, 0.125]}}
    w, objective, _ = _solve(basis, target, light=words)
    np.testing.assert_array_equal(w[[0, 3]], locked_weights[[0, 3]])
    _check_close(objective, _least_squares(A, y, C, locked_weights), y)
    # What is off might as well not be there.
    w, objective, _ = _solve(basis, target, light={"l0": {"off": True}, "l3": {"off": True}})
    assert not w[[0, 3]].any()
    _check_close(objective, _least_squares(A, y, C, np.zeros(12)), y)


@pytest.mark.parametrize("seed", PROBLEMS)
def test_the_pull_to_the_present(make_basis: Any, seed: int) -> None:
    basis, target = _problem(make_basis, seed, scalar=(2,))
    A, y = stack_rows(basis, target)
    current, strength = _current_weights(basis), 0.05
    power = np.square(basis.images, dtype=np.float64).sum(axis=(1, 2))
    root = np.sqrt(strength * power).ravel()
    rows, aims = np.vstack([A, np.diag(root)]), np.concatenate([y, root * current.ravel()])
    w, _, _ = _solve(basis, target, prefer_current=strength)
    objective = float(((rows @ w.ravel() - aims) ** 2).sum())
    C = _columns(4, 2, np.ones((1, 3)))
    _check_close(objective, _least_squares(rows, aims, C, np.zeros(12)), aims)


def _random_feasible(rng: Any, basis: Any, answer: Any) -> Any:
    """A random lighting that keeps to `EVERYTHING`, by its words alone.

    Of a range of white, on the straight piece on which the answer is: the range itself is not
    convex.
    """
    whites = white_range(2700, 5000)
    [place] = np.floor(whites.places(answer[[2]]) - 1e-9).clip(0)
    current, w = _current_weights(basis), rng.exponential(1, (7, 3))
    w[0] = current[0]
    w[1] = rng.exponential() * kelvin_to_rgb(3200)
    w[1] *= min(1, 0.3 / (w[1] @ LUMINANCE))
    w[2] = rng.exponential() * whites.at(place + rng.random(1))
    w[3:5] = rng.exponential() * current[3:5]
    w[5] = np.minimum(w[5], 0.5 * w[5] / (w[5] @ LUMINANCE))
    w[6] = rng.uniform(0, 0.8)
    return w


EVERYTHING: dict[str, Any] = {
    "light": {
        "l0": {"lock": True},
        "l1": {"color": "3200K", "limits": {"max": 0.3}},
        "l2": {"kelvin": [2700, 5000]},
        "l5": {"limits": {"max": 0.5}},
        "l6": {"limits": {"max": 0.8}},
    },
    "tie": ["l3", "l4"],
}


@pytest.mark.parametrize("seed", PROBLEMS)
def test_no_feasible_lighting_is_better_than_all_constraints_at_once(
    make_basis: Any, seed: int
) -> None:
    """The variational inequality: no way from the answer to another lighting goes down."""
    basis, target = _problem(make_basis, seed, 7, scalar=(6,))
    w, _, _ = _solve(basis, target, **EVERYTHING)
    A, y = stack_rows(basis, target)
    gradient = A.T @ (A @ w.ravel() - y)
    rng = np.random.default_rng(seed)
    for _ in range(200):
        way = (_random_feasible(rng, basis, w) - w).ravel()
        # A KKT residual of 1e-12 and its condition, beside the terms that cancel.
        assert gradient @ way >= -1e-8 * (y @ y)


def test_one_light_of_fixed_colour_in_closed_form(make_basis: Any) -> None:
    basis, target = _problem(make_basis, 3, 1)
    w, _, _ = _solve(basis, target, light={"l0": {"color": "3200K"}})
    A, y = stack_rows(basis, target)
    column = A @ kelvin_to_rgb(3200)
    expected = max(column @ y / (column @ column), 0) * kelvin_to_rgb(3200)
    np.testing.assert_allclose(w[0], expected, rtol=1e-10)


@pytest.mark.parametrize("kelvin", [2700, 3100, 4321, 6500])
def test_a_light_of_a_range_has_every_white_in_it(make_basis: Any, kelvin: float) -> None:
    basis, target = _problem(make_basis, 1, 2)
    truth = np.array([1.7 * kelvin_to_rgb(kelvin), [0.2, 0.3, 0.4]])
    image = np.einsum("nhwc,nc->hwc", basis.images, truth).astype(np.float32)
    target = replace(target, image=image)
    w, _, _ = _solve(basis, target, light={"l0": {"kelvin": [2700, 6500]}})
    # The picture is float32, and a piece of the locus straight.
    np.testing.assert_allclose(w, truth, atol=3e-4)


@pytest.mark.parametrize("seed", range(20))
def test_what_is_not_active_changes_nothing(make_basis: Any, seed: int) -> None:
    basis, target = _problem(make_basis, seed)
    plain = solve(basis, target).lighting.weights_for(basis)
    for limits in ({"max": 1e4}, {"max": [1e3, 1e4, 1e5]}, {"min": 0.0, "max": "1e6%"}):
        w, _, solution = _solve(basis, target, light={"l*": {"limits": limits}})
        # A KKT residual of 1e-10 times the condition of the basis.
        np.testing.assert_allclose(w, plain, atol=1e-8)
        assert not any(light.is_active for light in solution.lighting.lights)
    w, _, _ = _solve(basis, target, light={"l1": {"limits": {"max": 0.01}}})
    assert np.abs(w - plain).max() > 1e-3


def test_active_is_what_holds_a_light_back(make_basis: Any) -> None:
    basis, target = _problem(make_basis, 5)
    plain = solve(basis, target).lighting.weights_for(basis)
    tight = {"l0": {"lock": plain[0].tolist()}, "l1": {"limits": {"max": (plain[1] / 2).tolist()}}}
    # Locked where it would be anyway: nothing holds it, until another light is moved.
    single = _solve(basis, target, light={"l0": tight["l0"]})[2]
    assert [light.is_active for light in single.lighting.lights] == [False] * 4
    combined = _solve(basis, target, light=tight)[2]
    assert [light.is_active for light in combined.lighting.lights] == [True, True, False, False]


def test_a_light_that_reaches_nothing_stays_as_near_as_it_may(make_basis: Any) -> None:
    images = np.random.default_rng(0).random((3, *SIZE, 3))
    images[1] = 0
    images[2, ..., 0] = 0
    basis = make_basis(images=images, names=["a", "b", "c"], emission=[[1, 2, 3]] * 3)
    target = Target(
        "t", np.ones((*SIZE, 3), np.float32), np.ones(SIZE, np.float32), everything=True
    )
    free = _solve(basis, target, light={"a": {"limits": {"max": 9}}})[2]
    assert free.certificate.unreached == ("b",)
    assert free.lighting.emission["b"] == (1, 2, 3)
    assert free.lighting.emission["c"][0] == pytest.approx(1, rel=1e-9)
    w, _, _ = _solve(basis, target, light={"b": {"limits": {"max": "50%"}}})
    assert w[1] @ LUMINANCE == pytest.approx(0.5 * (np.array([1, 2, 3]) @ LUMINANCE))
    w, _, solution = _solve(basis, target, tie=["a", "b"])
    np.testing.assert_allclose(w[0], w[1])
    assert solution.certificate.unreached == ()


def test_scalar_and_kept_lights(make_basis: Any) -> None:
    basis, target = _problem(make_basis, 2, 5, scalar=(1, 2))
    kept_light = replace(
        basis.lights[4], name="rest", emission=(1.0,) * 3, is_fixed=True, members=("x",)
    )
    basis = replace(basis, lights=(*basis.lights[:4], kept_light))
    A, y = stack_rows(basis, target)
    words = {"l1": {"limits": {"max": "20%"}}, "rest": {"lock": True}, "x": {"lock": True}}
    w, objective, _ = _solve(basis, target, light=words, tie=["l2", "l3"])
    assert (w[4] == 1).all()
    assert w[1, 0] == w[1, 1] == w[1, 2] <= 0.2
    C = np.zeros((15, 5))
    C[:3, :3] = np.eye(3)
    C[3:6, 3] = 1
    C[6:9, 4], C[9:12, 4] = 1, basis.lights[3].emission
    w0 = np.zeros(15)
    w0[12:] = 1
    _check_close(objective, _least_squares(A, y, C, w0, 0, [np.inf] * 3 + [0.2, np.inf]), y)
    w, _, _ = _solve(basis, target, light={"l1": {"lock": "30%"}, "l2": {"lock": 0.7}})
    np.testing.assert_allclose(w[1:3], [[0.3] * 3, [0.7] * 3])


@pytest.mark.parametrize(
    ("lock", "expected"),
    [
        ("50%", [0.5, 1, 1.5]),
        (2 * float(np.array([1, 2, 3]) @ LUMINANCE), [2, 4, 6]),
        ([3, 2, 1], [3, 2, 1]),
        ("#ffaa66 3", 3 * hex_to_rgb("#ffaa66") / (hex_to_rgb("#ffaa66") @ LUMINANCE)),
        ("3200K 3", 3 * kelvin_to_rgb(3200)),
        ("3200K", kelvin_to_rgb(3200) * (np.array([1, 2, 3]) @ LUMINANCE)),
    ],
)
def test_what_a_light_can_be_locked_at(make_basis: Any, lock: Any, expected: Any) -> None:
    basis = make_basis(2, SIZE, names=["a", "b"], emission=[[1, 2, 3]] * 2)
    _, target = _problem(make_basis, 0)
    w, _, _ = _solve(basis, target, light={"a": {"lock": lock}})
    np.testing.assert_allclose(w[0], expected, rtol=1e-12)


def test_what_stands_later_and_names_go_before(make_basis: Any) -> None:
    basis, target = _problem(make_basis, 4)
    below = Constraints.of({"l1": {"color": "3200K"}, "l*": {"off": True}})
    w = solve(basis, target, constraints=below).lighting.weights_for(basis)
    assert not w[[0, 2, 3]].any()
    assert w[1].all()
    merged = below.and_then(Constraints.of({"l*": {"lock": True}}, sparse=2))
    assert merged.sparse == 2
    w = solve(basis, target, constraints=replace(merged, sparse=None)).lighting.weights_for(basis)
    np.testing.assert_array_equal(w, _current_weights(basis))
    merged_again = below.and_then(Constraints.of({"l2": {"off": False}}))
    assert solve(basis, target, constraints=merged_again).lighting.weights_for(basis)[2].any()


def test_the_answer_file_says_what_held_a_light(make_basis: Any, tmp_path: Any) -> None:
    basis, target = _problem(make_basis, 4)
    _, _, solution = _solve(basis, target, light={"l1": {"limits": {"max": 0.01}}})
    write_lighting(tmp_path / "lighting.json", solution.lighting)
    reread = read_lighting(tmp_path / "lighting.json")
    assert reread == solution.lighting
    assert [x.constraint for x in reread.lights] == ["", "limits 0 to 0.01", "", ""]
    assert reread.lights[1].is_active
    assert not reread.with_emission("l1", (1, 1, 1)).lights[1].constraint


@pytest.mark.parametrize(
    ("constraint_words", "words"),
    [
        ({"lock": True, "off": True}, "both 'lock' and 'off'"),
        ({"lock": 1, "limits": {"max": 2}}, "both 'lock' and 'limits'"),
        ({"off": True, "color": "3200K"}, "both 'off' and 'color'"),
        ({"kelvin": 3200, "color": "3200K"}, "both 'color' and 'kelvin'"),
        ({"lock": True, "color": "3200K"}, "lock that holds its colour and 'color'"),
        ({"lock": 1, "kelvin": [2700, 5000]}, "both lock and 'kelvin'"),
        ({"lock": "very dim"}, "lock is 'very dim': expected"),
        ({"lock": "a b c"}, "lock is 'a b c': expected"),
        ({"lock": -1}, "lock is -1: expected"),
        ({"lock": "#fff #000"}, "expected .* a colour and a level"),
        ({"color": "3200"}, "color is '3200': expected a colour like #ffaa66, 3200K"),
        ({"color": "#xyz"}, "color is '#xyz': expected"),
        ({"color": [0, 0, 0]}, "black, which is not a colour of light: use off"),
        ({"color": [1, -1, 1]}, "color is .*: expected"),
        ({"kelvin": [6500, 2700]}, r"kelvin runs from 6500 to 2700 K: give the lower"),
        ({"kelvin": 500}, "kelvin: a colour temperature of 500 K"),
        ({"kelvin": "warm"}, "kelvin is 'warm': expected"),
        ({"kelvin": 3000, "duv": "x"}, "duv is 'x': expected a number"),
        ({"duv": 0.01}, "'duv' without a 'kelvin'"),
        ({"primaries": []}, "primaries is .*: expected a list of colours"),
        ({"primaries": ["red"]}, "primaries is 'red': expected a colour"),
        ({"limits": {}}, "limits is empty"),
        ({"limits": 3}, "limits is 3: expected keys"),
        ({"limits": {"maximum": 3}}, "known are min, max"),
        ({"limits": {"max": "dim"}}, "limits.max is 'dim': expected a luminance"),
        ({"limits": {"min": 3, "max": 2}}, "min of 3 above its max of 2"),
        ({"limits": {"min": [0, 1, 0], "max": [1, 0.5, 1]}}, "above its max"),
        ({"off": 1}, "off is 1: expected true or false"),
        ({"dim": True}, "has the key 'dim': known are lock, off"),
        (3, "is 3: expected keys"),
    ],
)
def test_wishes_that_mean_nothing_are_refused_at_birth(constraint_words: Any, words: str) -> None:
    with pytest.raises(ConstraintError, match=words) as refusal:
        Constraints.of({"key": constraint_words}, where="hall.lights.toml")
    assert str(refusal.value).startswith("hall.lights.toml: light.key")
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("constraint_words", "words"),
    [
        ({"light": ["key"]}, "light is .*: expected tables"),
        ({"tie": "key"}, "tie is 'key': expected lists of names"),
        ({"tie": [3]}, "tie is .*: expected lists"),
        ({"tie": [{"lamps": ["a"]}]}, "known are lights, color"),
        ({"tie": [{"lights": "a"}]}, "expected lists"),
        ({"tie": [[]]}, "expected names of at least two"),
        ({"prefer_current": -1}, "prefer_current is -1: expected a strength"),
        ({"prefer_current": {"current": 1}}, "prefer_current is {'current': 1}: expected"),
        ({"sparse": 0}, "sparse is 0: expected a whole number"),
        ({"sparse": True}, "sparse is True"),
    ],
)
def test_wishes_for_all_lights_that_mean_nothing(constraint_words: Any, words: str) -> None:
    with pytest.raises(ConstraintError, match=words):
        Constraints.of(**constraint_words)


@pytest.mark.parametrize(
    ("constraint_words", "words"),
    [
        ({"light": {"lamb_1": {"off": True}}}, "no light 'lamb_1'; did you mean 'lamp_1'"),
        ({"light": {"w*": {"off": True}}}, r"no light 'w\*'; there are"),
        ({"light": {"bulb": {"off": True}}}, "'bulb' is part of the light 'group'"),
        ({"light": {"rest": {"off": True}}}, "'rest' is fixed, since it is not among"),
        ({"light": {"x": {"color": "3200K"}}}, "'x' is fixed, since it is not among"),
        ({"light": {"sky": {"color": "3200K"}}}, "'sky' can only be dimmed as a whole"),
        ({"light": {"sky": {"kelvin": [2700, 5000]}}}, "'sky' can only be dimmed"),
        ({"light": {"sky": {"lock": [1, 2, 3]}}}, "'sky' can only be dimmed"),
        ({"light": {"sky": {"lock": "3200K"}}}, "'sky' can only be dimmed"),
        ({"light": {"sky": {"limits": {"max": [1, 2, 3]}}}}, "'sky' can only be dimmed"),
        ({"tie": [{"lights": ["sky", "lamp_1"], "color": "3200K"}]}, "'sky' can only be dimmed"),
        ({"light": {"dark": {"limits": {"max": "40%"}}}}, "'dark' is currently off"),
        ({"tie": ["dark", "lamp_1"]}, "'dark' is currently off"),
        ({"tie": ["lamp_1"]}, "is one light: a tie has at least two"),
        ({"tie": [["lamp_1", "sky"], ["lamp_*"]]}, "'lamp_1' is in two ties"),
        ({"tie": ["lamp_*"], "light": {"lamp_1": {"kelvin": [2700, 5000]}}}, "is on the dimmer"),
        (
            {
                "tie": ["lamp_*"],
                "light": {
                    "lamp_1": {"limits": {"max": "20%"}},
                    "lamp_2": {"limits": {"min": "50%"}},
                },
            },
            "lamp_1, lamp_2 share a dimmer, but one needs",
        ),
        (
            {"tie": ["lamp_*"], "light": {"lamp_1": {"lock": True}, "lamp_2": {"off": True}}},
            "lamp_1, lamp_2 share a dimmer, but one needs",
        ),
        (
            {"light": {"lamp_1": {"limits": {"min": [9, 9, 9], "max": 3}}}},
            "no emission at all: widen",
        ),
        (
            {"light": {"lamp_1": {"limits": {"min": 9, "max": [1, 1, 1]}}}},
            "no emission at all: widen",
        ),
        (
            {"light": {"lamp_1": {"color": [1, 0, 0], "limits": {"min": [0, 1, 0]}}}},
            "no emission at all: widen",
        ),
        (
            {"light": {"lamp_1": {"kelvin": [2700, 5000], "limits": {"max": [1, 1, 1]}}}},
            "for a light that mixes primaries: give a luminance",
        ),
    ],
)
def test_wishes_that_do_not_fit_the_lights(
    make_basis: Any, constraint_words: Any, words: str
) -> None:
    names = ["lamp_1", "lamp_2", "dark", "sky", "group", "rest"]
    basis = make_basis(6, SIZE, names=names, emission=[[1, 2, 3]] * 6)
    changes: list[dict[str, Any]] = [{} for _ in names]
    changes[2] = {"emission": (0.0, 0.0, 0.0)}
    changes[3] = {"emission": (1.0, 1.0, 1.0), "is_scalar": True}
    changes[4] = {"members": ("bulb", "tube")}
    changes[5] = {"emission": (1.0, 1.0, 1.0), "is_fixed": True, "members": ("x", "y")}
    lights = tuple(replace(x, **change) for x, change in zip(basis.lights, changes, strict=True))
    _, target = _problem(make_basis, 0)
    with pytest.raises(ConstraintError, match=words) as refusal:
        solve(replace(basis, lights=lights), target, constraints=Constraints.of(**constraint_words))
    assert "\n" not in str(refusal.value)


def test_ties_of_lights_with_colours_and_limits(make_basis: Any) -> None:
    basis, target = _problem(make_basis, 8)
    current = _current_weights(basis) @ LUMINANCE
    w, _, _ = _solve(
        basis,
        target,
        tie=[{"lights": ["l0", "l1"], "color": "3200K"}, ["l2", "l3"]],
        light={"l2": {"color": "#ffaa66"}, "l3": {"limits": {"max": "5%"}}},
    )
    np.testing.assert_allclose(w[0] / current[0], w[1] / current[1])
    np.testing.assert_allclose(w[0] / (w[0] @ LUMINANCE), kelvin_to_rgb(3200))
    # The limit of one member is that of the dimmer.
    np.testing.assert_allclose(w[2] @ LUMINANCE, 0.05 * current[2])


def test_who_holds_a_light_holds_its_dimmer(make_basis: Any) -> None:
    """As if each of the lights on it had been held, at the same share of the present."""
    basis, target = _problem(make_basis, 8)
    current, tie = _current_weights(basis), [["l0", "l1"]]
    level = 0.3 * float(current[0] @ LUMINANCE)
    warm = (level * kelvin_to_rgb(3200)).tolist()
    for lock, first, share in (
        ("30%", 0.3 * current[0], 0.3),
        (level, 0.3 * current[0], 0.3),
        (warm, np.array(warm), 0.3),  # its colour is its own
        (True, current[0], 1.0),
        ([0, 0, 0], 0 * current[0], 0.0),
        (None, 0 * current[0], 0.0),
    ):
        words = {"off": True} if lock is None else {"lock": lock}
        w, _, _ = _solve(basis, target, tie=tie, light={"l0": words})
        each = {"l0": {"lock": first.tolist()}, "l1": {"lock": (share * current[1]).tolist()}}
        expected, _, _ = _solve(basis, target, light=each)
        np.testing.assert_allclose(w[0], first, rtol=1e-12)
        np.testing.assert_allclose(w, expected, rtol=1e-9, atol=1e-9 * expected.max())
    # Both at the same share are one wish.
    same_locks = {"l0": {"lock": "30%"}, "l1": {"lock": "30%"}}
    w, _, _ = _solve(basis, target, tie=tie, light=same_locks)
    np.testing.assert_allclose(w[:2], 0.3 * current[:2], rtol=1e-12)


def test_no_constraints_are_the_plain_problem(make_basis: Any) -> None:
    """What the reduction leaves are M and b themselves: nothing is lost by having one way."""
    basis, target = _problem(make_basis, 0)
    solution = solve(basis, target)
    assert solve(basis, target, constraints=Constraints()).lighting == solution.lighting
    e = solution.equations
    for c, problem in enumerate(reduced_problems(e, solution.problem.reduction)):
        assert problem.channels == [c]
        np.testing.assert_array_equal(problem.M, e.M[c])
        np.testing.assert_array_equal(problem.b, e.b[c])


@pytest.mark.parametrize("seed", range(15))
def test_the_best_few_lights(make_basis: Any, seed: int) -> None:
    """Against all choices of two of five by scipy; what is locked shines along."""
    basis, target = _problem(make_basis, seed, 6)
    A, y = stack_rows(basis, target)
    w0 = np.zeros((6, 3))
    w0[5] = _current_weights(basis)[5]
    w, objective, solution = _solve(basis, target, sparse=2, light={"l5": {"lock": True}})
    lit_lights = np.flatnonzero(w[:5].any(axis=1))
    assert len(lit_lights) <= 2

    def objective_of(lights: Any) -> float:
        C = np.eye(18)[:, [3 * k + c for k in lights for c in range(3)]]
        return _least_squares(A, y, C, w0)

    # The best of these that are on, and, where exchanging found it, of all.
    _check_close(objective, objective_of(lit_lights), y)
    values = [objective_of(lights) for lights in combinations(range(5), 2)]
    assert objective <= np.quantile(values, 0.2) + SAME * (y @ y)
    counts, misses = zip(*solution.certificate.curve, strict=True)
    assert counts == (1, 2, 3, 4)
    # The roots of float64 sums.
    assert (np.diff(misses) < 1e-12).all()
    assert misses[1] == pytest.approx(np.sqrt(objective / (y @ y)))
    left_out_names = [
        light.name for light in solution.lighting.lights if "left out" in light.constraint
    ]
    assert len(left_out_names) == 3


def test_few_lights_among_ties_and_lower_limits(make_basis: Any) -> None:
    basis, target = _problem(make_basis, 1, 5)
    limits = {"l4": {"limits": {"min": 0.01}}}
    w, _, _ = _solve(basis, target, sparse=2, tie=["l0", "l1", "l2"], light=limits)
    assert w[4] @ LUMINANCE >= 0.01 - 1e-12
    assert w[0].any() == w[1].any() == w[2].any()
    with pytest.raises(ConstraintError, match="sparse is 1, but 2 lights have a lower limit"):
        _solve(basis, target, sparse=1, light={"l[34]": limits["l4"]})
    # More than there are is not a constraint.
    all_of_them = _solve(basis, target, sparse=9)[0]
    np.testing.assert_allclose(all_of_them, solve(basis, target).lighting.weights_for(basis))


@pytest.mark.parametrize("kind", ["color", "share", "luminance of mixed", "luminance of free"])
def test_limits_may_leave_one_emission(make_basis: Any, kind: str):
    """Round-off may part two ends that are the same; that is not a contradiction."""
    rng = np.random.default_rng(1)
    for color in rng.uniform(0.1, 1, (100, 3)):
        level = 0.37 * color
        bright = float(LUMINANCE @ level)
        basis = make_basis(2, SIZE, names="ab", emission=[level, [1, 1, 1]])
        target = Target("t", basis.images[0], np.ones(SIZE, np.float32), everything=False)
        # Of the first, level / color of one channel and another differ.
        words: dict[str, Any] = {
            "color": {"color": color.tolist(), "limits": [level.tolist(), level.tolist()]},
            "share": {"color": color.tolist(), "limits": ["100%", bright * (1 - 2e-13)]},
            "luminance of mixed": {"limits": ["100%", bright * (1 - 2e-13)]},
            "luminance of free": {"limits": [level.tolist(), bright * (1 - 2e-13)]},
        }[kind]
        words["limits"] = dict(zip(("min", "max"), words["limits"], strict=True))
        solution = solve(basis, target, constraints=Constraints.of({"a": words}))
        w = solution.lighting.weights_for(basis)[0]
        # What is taken for round-off, 1e-12, of a channel with a tenth of the luminance.
        if kind == "luminance of mixed":
            assert LUMINANCE @ w == pytest.approx(bright, rel=1e-11)
        else:
            np.testing.assert_allclose(w, level, rtol=1e-10)
