"""Lamps with a colour wheel: its slot is chosen after the solve, and all is solved again."""

import json
from typing import Any

import numpy as np
import pytest
from least_squares import stack_rows
from nightly import seeds
from scipy.optimize import lsq_linear, nnls

from lightpaint.colour.color import ciede2000, lab, luminance
from lightpaint.colour.primaries import REC709, REC2020, rgb_to_xyz
from lightpaint.errors import ConstraintError
from lightpaint.lighting.analysis.answer_analysis import analyse
from lightpaint.lighting.answer.lighting_file import read_lighting, write_lighting
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.fit import Fit, resolve_for_targets
from lightpaint.lighting.live.live_solver import LiveSolver
from lightpaint.lighting.live.live_view import LiveView
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solver import solution_of, tie_frames
from lightpaint.lighting.unknowns import slot_search
from lightpaint.report.phrases import spoken_lamp, spoken_wheels
from lightpaint.target.painted_target import Target

SIZE = (5, 4)

SLOTS = [
    {"name": name, "xy": xy, "Y": level, "watts": 400}
    for name, xy, level in (
        ("open", [0.31, 0.32], 6.0),
        ("red", [0.69, 0.30], 0.5),
        ("amber", [0.55, 0.43], 2.5),
        ("green", [0.25, 0.66], 2.0),
        ("blue", [0.15, 0.07], 0.3),
        ("magenta", [0.38, 0.18], 0.9),
        ("cto", [0.41, 0.39], 4.0),
    )
]

#: Seed of a case in which other slots than the closest ones are better.
GREEDY_IS_WRONG = 0

#: Float64 of these conditions, and the oracle's own tolerance.
SAME = 1e-8


def _case(make_basis: Any, seed: int, wheel: Any = True, **more: Any) -> Any:
    spot = {"emitters": SLOTS, "wheel": wheel, **more}
    lights = {"spot": spot, "profile": {"emitters": SLOTS, "wheel": True}, "wash": {}}
    basis = make_basis(3, SIZE, seed=seed, names=[*lights])
    rng = np.random.default_rng(seed)
    image = (rng.random((*SIZE, 3)) * rng.uniform(0.5, 6) * rng.random(3)).astype(np.float32)
    target = Target("t", image, rng.random(SIZE).astype(np.float32), everything=False)
    return basis, target, Constraints.of(lights)


def _mixed_best(rows: Any, y: Any, columns: Any) -> Any:
    """The emissions (2, 3) of the best mix of slots, whose shares are 1 at most together, by nnls:
    with a heavy row that makes the shares and what is left of each lamp 1.
    """
    count = len(columns)
    part = rows.reshape(len(y), 3, 3)
    A = np.hstack(
        [part[:, 0] @ columns.T, part[:, 1] @ columns.T, part[:, 2], np.zeros((len(y), 2))]
    )
    heavy = 1e5 * np.abs(A).max()
    sums = np.zeros((2, A.shape[1]))
    for k in range(2):
        sums[k, k * count : (k + 1) * count], sums[k, -2 + k] = heavy, heavy
    x, _ = nnls(np.vstack([A, sums]), np.append(y, [heavy, heavy]), maxiter=10_000)
    return x[:count] @ columns, x[count : 2 * count] @ columns


@pytest.mark.parametrize("seed", list(seeds(8, 60)))
def test_each_wheel_begins_at_the_slot_closest_to_the_best_mix(make_basis, monkeypatch, seed):
    monkeypatch.setattr(slot_search, "MAX_TRIALS", 0)
    basis, target, constraints = _case(make_basis, seed)
    solution = solve(basis, target, constraints=constraints, literal=True)
    assert solution.certificate.converged
    rows, y = stack_rows(basis, target)
    lamp = solution.problem.reduction.lamps[0]
    mixed = _mixed_best(rows, y, lamp.columns)
    chosen = []
    for name, color in zip(("spot", "profile"), mixed, strict=True):
        light = solution.lighting[name]
        if (
            luminance(color) < 1e-6 * lamp.levels.max()
        ):  # it is off, and may come on at its open slot
            assert light.mixed_emission is None
            assert light.slot in ("open", "")
            chosen.append(lamp.columns[0])
            continue
        # The row of the oracle weighs 1e5 times as much as the painting.
        assert np.allclose(light.mixed_emission, color, atol=1e-4 * np.abs(color).max())
        looks = lab(np.array([*lamp.columns, color]) / luminance([*lamp.columns, color])[:, None])
        distances = ciede2000(looks[:-1], looks[-1])
        slot = int(np.argmin(distances))
        chosen.append(lamp.columns[slot])
        if not any(light.drives.values()):  # off, now that other wheels are at slots
            continue
        assert light.slot == lamp.names[slot]
        assert light.slot_delta_e == pytest.approx(distances.min(), rel=1e-2, abs=0.05)
        assert sum(drive > 0 for drive in light.drives.values()) == 1
    # With these slots, the answer is that of scipy with a dimmer each.
    part = rows.reshape(len(y), 3, 3)
    A = np.column_stack([part[:, 0] @ chosen[0], part[:, 1] @ chosen[1], part[:, 2]])
    best = lsq_linear(A, y, ([0.0] * 5, [1, 1, np.inf, np.inf, np.inf]), tol=1e-14)
    drives = [max(solution.lighting[x].drives.values()) for x in ("spot", "profile")]
    found = np.append(drives, solution.weights[2])
    # Both are solutions of the same least squares.
    assert np.square(A @ found - y).sum() <= 2 * best.cost * (1 + SAME) + SAME * (y @ y)


def _least_squares(rows: Any, y: Any, columns: Any) -> float:
    """The least loss with a dimmer of 0 to 1 for each column (k, 3) of the first lights, and a last
    light of any colour.
    """
    part, count = rows.reshape(len(y), 3, 3), len(columns)
    A = np.column_stack([*(part[:, k] @ columns[k] for k in range(count)), part[:, 2]])
    upper = [1.0] * count + [np.inf] * 3
    return 2 * lsq_linear(A, y, ([0.0] * (count + 3), upper), tol=1e-14).cost


@pytest.mark.parametrize("seed", list(seeds(6, 40)))
def test_no_other_slot_of_a_single_wheel_is_better(make_basis, monkeypatch, seed):
    basis, target, constraints = _case(make_basis, seed)
    found = solve(basis, target, constraints=constraints, literal=True)
    rows, y = stack_rows(basis, target)
    lamp = found.problem.reduction.lamps[0]
    slots = [lamp.names.index(found.lighting[x].slot or "open") for x in ("spot", "profile")]
    own = _least_squares(rows, y, lamp.columns[slots])
    for wheel in range(2):
        for slot in range(len(SLOTS)):
            other = [*slots]
            other[wheel] = slot
            # Moves that gain less than MIN_GAIN are not made.
            assert _least_squares(rows, y, lamp.columns[other]) >= own * (
                1 - slot_search.MIN_GAIN
            ) - SAME * (y @ y)
    monkeypatch.setattr(slot_search, "MAX_TRIALS", 0)
    closest = solve(basis, target, constraints=constraints, literal=True)
    losses = [x.problem.objective(x.weights).sum() for x in (found, closest)]
    assert losses[0] <= losses[1] * (1 + SAME)


@pytest.mark.parametrize("fit", [{"literal": True}, {"space": "display"}])
def test_the_closest_slots_of_all_wheels_are_not_always_the_best(make_basis, monkeypatch, fit):
    basis, target, constraints = _case(make_basis, GREEDY_IS_WRONG)
    found = solve(basis, target, constraints=constraints, **fit)
    monkeypatch.setattr(slot_search, "MAX_TRIALS", 0)
    closest = solve(basis, target, constraints=constraints, **fit)
    slots = [
        [x[name].slot for name in ("spot", "profile")] for x in (found.lighting, closest.lighting)
    ]
    assert slots[0] != slots[1]
    losses = [x.problem.objective(x.weights).sum() for x in (found, closest)]
    assert losses[0] < 0.99 * losses[1]


@pytest.mark.parametrize("fit", [{}, {"hold": 0.1}, {"space": "display"}])
def test_no_fit_mixes_slots(make_basis, fit):
    basis, target, constraints = _case(make_basis, 3)
    solution = solve(basis, target, constraints=constraints, **fit)
    for name in ("spot", "profile"):
        light = solution.lighting[name]
        assert sum(drive > 0 for drive in light.drives.values()) <= 1
        assert np.allclose(light.emission, light.lamp.mix(np.array([*light.drives.values()])))
    [analysis] = analyse(solution)
    assert [x.mixed_emission for x in analysis.solution.lighting.lights] == [
        x.mixed_emission for x in solution.lighting.lights
    ]


def test_sparse_lights_have_slots(make_basis):
    basis, target, constraints = _case(make_basis, 4)
    chosen = solve(basis, target, constraints=constraints.and_then(Constraints.of(sparse=1)))
    on = [x for x in chosen.lighting.lights if any(x.emission)]
    assert len(on) <= 1
    assert all(sum(d > 0 for d in x.drives.values()) <= 1 for x in chosen.lighting.lights)


def test_a_wheel_can_be_left_open(make_basis):
    basis, target, constraints = _case(make_basis, 5, wheel="open")
    light = solve(basis, target, constraints=constraints).lighting["spot"]
    assert light.mixed_emission is None
    assert light.slot_delta_e is None
    assert [x for x, drive in light.drives.items() if drive > 0] == ["open"]


def test_each_frame_of_a_shot_has_slots(make_basis):
    basis, first, constraints = _case(make_basis, 1)
    targets = first, _case(make_basis, 2)[1]
    fit = Fit(literal=True)
    problems = [Problem.of(basis, x, constraints=constraints, fit=fit) for x in targets]
    for solution in tie_frames([solution_of(x) for x in problems], [1, 20]):
        assert solution.certificate.converged
        for light in solution.lighting.lights[:2]:
            assert sum(drive > 0 for drive in light.drives.values()) <= 1
            assert np.allclose(light.emission, light.lamp.mix(np.array([*light.drives.values()])))


def test_slots_that_were_chosen_are_said(make_basis):
    basis, target, constraints = _case(make_basis, 5, wheel="open")
    lights = solve(basis, target, constraints=constraints).lighting.lights
    chosen = lights[1]
    assert spoken_wheels(lights) == (
        f"Colour wheels: profile at {chosen.slot}, ΔE {chosen.slot_delta_e:.1f} off."
    )
    assert spoken_lamp(chosen).endswith(f" (ΔE {chosen.slot_delta_e:.1f} off)")
    assert spoken_lamp(lights[0]).startswith("open ")
    assert spoken_wheels(lights[:1]) == ""


def test_a_colour_chooses_the_closest_slot(make_basis):
    basis, target, constraints = _case(make_basis, 5, color="#ff2010")
    light = solve(basis, target, constraints=constraints).lighting["spot"]
    assert light.slot == "red"


def test_limits_leave_out_slots_that_are_too_dark(make_basis):
    basis, target, constraints = _case(make_basis, 6, limits={"min": 2.2, "max": 2.3})
    light = solve(basis, target, constraints=constraints).lighting["spot"]
    assert light.slot in ("open", "amber", "cto")
    assert 2.2 - 1e-9 <= luminance(np.array(light.emission)) <= 2.3 + 1e-9


def test_a_locked_wheel_has_the_colour_of_a_slot(make_basis):
    basis, target, constraints = _case(make_basis, 6, lock="#0000ff 0.2")
    light = solve(basis, target, constraints=constraints).lighting["spot"]
    assert light.slot == "blue"
    assert luminance(np.array(light.emission)) == pytest.approx(0.2)


def test_the_file_says_slot_and_distance(make_basis, tmp_path):
    basis, target, constraints = _case(make_basis, 7)
    lighting = solve(basis, target, constraints=constraints).lighting
    file = tmp_path / "lighting.json"
    write_lighting(file, lighting)
    data = json.loads(file.read_text())["lights"]["spot"]
    assert data["is_wheel"] is True
    assert data["slot"] == lighting["spot"].slot
    assert data["slot_delta_e"] == pytest.approx(lighting["spot"].slot_delta_e)
    assert read_lighting(file)["spot"] == lighting["spot"]


@pytest.mark.parametrize("space", ["linear", "display"])
def test_under_the_brush_wheels_are_at_the_closest_slots(make_basis, monkeypatch, space):
    monkeypatch.setattr(slot_search, "MAX_TRIALS", 0)
    basis, target, constraints = _case(make_basis, 8)
    view = LiveView(basis, target.image.copy(), target.importance.copy())
    fit = resolve_for_targets(Fit(literal=True, space=space), [target])
    live = LiveSolver([view], fit=fit, constraints=constraints)
    answer = live.answer(basis.current_weights)
    assert all(live.lamps[k].can_mix(answer[k]) for k in (0, 1))
    assert 0 in live.mixed_emissions
    again = live.answer(answer, while_painting=True)
    assert all(live.lamps[k].can_mix(again[k]) for k in (0, 1))
    if space == "linear":
        exact = solve(basis, target, constraints=constraints, literal=True)
        assert np.allclose(answer, exact.weights, atol=1e-6 * exact.weights.max())


def test_before_paint_wheels_are_at_slots(make_basis):
    basis, _, constraints = _case(make_basis, 8)
    view = LiveView(basis, np.zeros((*SIZE, 3), np.float32), np.zeros(SIZE, np.float32))
    live = LiveSolver([view], fit=Fit(literal=True, space="linear"), constraints=constraints)
    answer = live.answer(basis.current_weights)
    assert all(live.lamps[k].can_mix(answer[k]) for k in (0, 1))
    assert live.mixed_emissions == {}


WRONG = {
    "no slots": ({"wheel": True}, "has wheel without emitters, which are its slots"),
    "unknown slot": ({"emitters": SLOTS, "wheel": "pink"}, "expected true, or one of its slots, "),
    "number": ({"emitters": SLOTS, "wheel": 3}, "is 3: expected true, or one of its slots"),
    "power": ({"emitters": SLOTS, "wheel": True, "power_share": 0.5}, "wheel and power_share"),
    "whites": ({"emitters": SLOTS, "wheel": True, "kelvin": [2700, 6500]}, "wheel and kelvin"),
    "too many": (
        {"emitters": [{**SLOTS[0], "name": str(k)} for k in range(41)], "wheel": True},
        "lists 41 slots: at most 40",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_mistakes_are_named(case):
    table, message = WRONG[case]
    with pytest.raises(ConstraintError, match=message):
        Constraints.of({"spot": table})


#: A lamp that mixes a cool and a warm white, behind a wheel.
WHITES = [
    {"name": "cool white", "xy": [0.313, 0.324], "Y": 4.0, "watts": 400},
    {"name": "warm white", "xy": [0.44, 0.403], "Y": 3.0, "watts": 400},
]
FILTERS = [
    {"name": "open", "transmission": [1, 1, 1]},
    {"name": "red", "transmission": [0.9, 0.01, 0.0]},
    {"name": "congo", "transmission": [0.1, 0.0, 0.7]},
    {"name": "green", "transmission": [0.05, 0.8, 0.02]},
]


def _filtered_case(make_basis: Any, painted: Any, **more: Any) -> Any:
    """A wash behind a wheel, alone, and paint of one linear colour where it shines."""
    lights = {"wash": {"emitters": WHITES, "power_share": 0.5, "wheel": FILTERS, **more}}
    basis = make_basis(1, SIZE, seed=3, names=["wash"])
    image = (basis.images[0] * np.array(painted)).astype(np.float32)
    target = Target("t", image, np.ones(SIZE, np.float32), everything=True)
    return basis, target, Constraints.of(lights)


@pytest.mark.parametrize(
    ("painted", "slot"),
    [
        ((1.5, 1.4, 1.3), "open"),
        ((1.2, 0.02, 0.01), "red"),
        ((0.2, 0.02, 1.5), "congo"),
        ((0.05, 1.0, 0.1), "green"),
    ],
)
def test_a_wheel_in_front_of_emitters_leaves_open_only_for_the_painted_colour(
    make_basis, painted, slot
):
    basis, target, constraints = _filtered_case(make_basis, painted)
    light = solve(basis, target, constraints=constraints, literal=True).lighting["wash"]
    assert light.slot == light.lamp.behind == ("" if slot == "open" else slot)
    assert light.slot_delta_e is None
    assert [*light.drives] == ["cool white", "warm white"]
    # What it emits is the mix of its emitters, each filtered in BT.2020.
    passed = next(x["transmission"] for x in FILTERS if x["name"] == slot)
    wide = rgb_to_xyz(REC2020)
    mixed = np.zeros(3)
    for emitter, drive in zip(WHITES, light.drives.values(), strict=True):
        x, y = emitter["xy"]
        xyz = drive * emitter["Y"] * np.array([x / y, 1, (1 - x - y) / y])
        mixed += wide @ (np.maximum(passed, 1e-4) * np.linalg.solve(wide, xyz))
    # Y is 0.2126 R + 0.7152 G + 0.0722 B, of four digits.
    assert np.allclose(np.linalg.solve(rgb_to_xyz(REC709), mixed), light.emission, rtol=1e-4)


def test_a_gain_that_nobody_sees_leaves_the_wheel_open(make_basis, monkeypatch):
    """The colour of a filter that is nearly clear: its slot is better by less than 1 % of it."""
    pale = {"name": "pale", "transmission": [1.0, 0.985, 1.0]}
    paint = (1.5, 1.4, 1.5)
    basis, target, constraints = _filtered_case(make_basis, paint, wheel=[FILTERS[0], pale])
    solution = solve(basis, target, constraints=constraints, literal=True)
    assert solution.lighting["wash"].slot == ""
    monkeypatch.setattr(slot_search, "VISIBLE", 0.0)
    eager = solve(basis, target, constraints=constraints, literal=True)
    assert eager.lighting["wash"].slot == "pale"
    errors = [
        np.sqrt(x.problem.objective(x.weights).sum() / x.problem.norm2.sum())
        for x in (solution, eager)
    ]
    assert 0 < errors[0] - errors[1] < 0.01


def test_a_slot_in_front_of_emitters_comes_back_from_the_file(make_basis, tmp_path):
    basis, target, constraints = _filtered_case(make_basis, (1.2, 0.02, 0.01))
    lighting = solve(basis, target, constraints=constraints).lighting
    file = tmp_path / "lighting.json"
    write_lighting(file, lighting)
    data = json.loads(file.read_text())["lights"]["wash"]
    assert (data["slot"], data["behind"]) == ("red", "red")
    assert read_lighting(file)["wash"] == lighting["wash"]
    assert spoken_wheels(lighting.lights) == "Colour wheels: wash behind red."


def test_a_range_of_white_and_one_colour_leave_a_filter_open(make_basis):
    leds = [
        {"name": name, "xy": xy, "Y": 2.0}
        for name, xy in (("red", [0.69, 0.30]), ("green", [0.2, 0.7]), ("blue", [0.15, 0.05]))
    ]
    for more in ({"kelvin": [3000, 5000], "power_share": False}, {"color": "#ffaa66"}):
        basis, target, constraints = _filtered_case(
            make_basis, (1.2, 0.02, 0.01), emitters=leds, **more
        )
        light = solve(basis, target, constraints=constraints, literal=True).lighting["wash"]
        assert light.lamp.behind == ""


WRONG_FILTERS = {
    "empty": ([], "is \\[\\]: expected a list of at most 40 slots"),
    "no name": ([{"transmission": [1, 1, 1]}], "name is None"),
    "too much": ([{"name": "a", "transmission": [1.2, 1, 1]}], "expected the shares of red"),
    "twice": ([FILTERS[0], FILTERS[0]], "has two slots named 'open'"),
    "other key": ([{**FILTERS[0], "xy": [0.3, 0.3]}], "xy"),
}


@pytest.mark.parametrize("case", WRONG_FILTERS)
def test_mistakes_of_filters_are_named(case):
    wheel, message = WRONG_FILTERS[case]
    with pytest.raises(ConstraintError, match=message):
        Constraints.of({"wash": {"emitters": WHITES, "wheel": wheel}})
