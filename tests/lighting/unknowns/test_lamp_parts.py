"""Lamps whose emitters have a picture each: solve, constraints, file."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from lightpaint.colour.color import kelvin_to_rgb
from lightpaint.colour.rendering_indices import fidelity
from lightpaint.colour.spectrum import rgb_of_powers
from lightpaint.errors import ConstraintError
from lightpaint.lighting.analysis.answer_analysis import analyse
from lightpaint.lighting.analysis.rendered_colors import renderings_of
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.answer.lighting_file import read_lighting, write_lighting
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.unknowns.lamp_parts import WholeLamps
from lightpaint.lighting.unknowns.reduction import lamps_by_name, reduce_to
from lightpaint.target.painted_target import Target

SIZE = (6, 5)
WAVES = np.arange(380, 781, 10)


def _pairs(peak: float, width: float) -> list[list[float]]:
    return [[float(w), float(np.exp(-0.5 * ((w - peak) / width) ** 2))] for w in WAVES]


LEVELS = {"red": 4.0, "green": 8.0, "blue": 1.5, "white": 10.0}
EMITTERS = [
    {"name": "red", "spectrum": _pairs(630, 12), "Y": 4, "watts": 12},
    {"name": "green", "spectrum": _pairs(525, 16), "Y": 8, "watts": 10},
    {"name": "blue", "spectrum": _pairs(455, 12), "Y": 1.5, "watts": 14},
    {"name": "white", "spectrum": _pairs(560, 70), "Y": 10, "watts": 16},
]
LAMPS = {"a": {"emitters": EMITTERS}, "b": {"emitters": EMITTERS}}
#: Float64, and the tolerance of scipy's.
SAME = 1e-6


def _basis(make_basis: Any, *, lamps: str = "ab") -> Any:
    names = [f"{lamp}/{name}" for lamp in lamps for name in LEVELS]
    basis = make_basis(len(names), SIZE, names=names)
    lights = tuple(
        replace(x, lamp=x.name[0], members=(x.name[0],), is_scalar=True, emission=(0.5, 0.5, 0.5))
        for x in basis.lights
    )
    return replace(basis, lights=lights)


def _target(basis: Any, drives: Any) -> Target:
    levels = np.tile([*LEVELS.values()], len(basis.lights) // 4)
    image = basis.mix(np.repeat((drives * levels)[:, None], 3, axis=1)).astype(np.float32)
    return Target("t", image, np.ones(SIZE, np.float32), everything=False)


DRIVES = np.array([0.2, 0, 0.7, 0.5, 0, 1.0, 0.25, 0.9])


def test_the_drives_are_the_bounded_least_squares_of_scipy(make_basis):
    basis = _basis(make_basis)
    target = _target(basis, DRIVES * 1.3)
    solution = solve(basis, target, constraints=Constraints.of(LAMPS), literal=True)
    assert solution.certificate.converged
    levels = np.tile([*LEVELS.values()], 2)
    A = basis.images.astype(np.float64).reshape(8, -1).T * levels
    expected = lsq_linear(A, target.image.ravel().astype(np.float64), (0, 1), tol=1e-14).x
    assert solution.weights[:, 0] / levels == pytest.approx(expected, abs=1e-5)
    lamps = solution.lighting.of_lamps()
    assert [*lamps] == ["a", "b"]
    assert [*lamps["a"].drives] == [*LEVELS]
    assert [*lamps["a"].drives.values()] == pytest.approx(expected[:4], abs=1e-5)


def test_a_wheel_shows_one_of_its_slots(make_basis, tmp_path):
    basis = _basis(make_basis)
    wheel = {"emitters": EMITTERS, "wheel": True}
    constraints = Constraints.of({"a": wheel, "b": wheel})
    solution = solve(basis, _target(basis, DRIVES), constraints=constraints, literal=True)
    assert solution.certificate.converged
    write_lighting(tmp_path / "a.json", solution.lighting)
    for lamp in read_lighting(tmp_path / "a.json").values():
        assert [x for x, drive in lamp.drives.items() if drive > 0] == [lamp.slot]
        assert lamp.mixed_emission is not None
        assert lamp.slot_delta_e == pytest.approx(
            lamp.lamp.distances(np.array(lamp.mixed_emission)).min()
        )


def test_two_limits_of_a_lamp_hold(make_basis):
    basis = _basis(make_basis)
    limits = {"min": 2.0, "max": 6.0}
    lamp = {"emitters": EMITTERS, "power_share": 0.3, "limits": limits}
    constraints = Constraints.of({"a": lamp, "b": lamp})
    solution = solve(basis, _target(basis, DRIVES * 1.3), constraints=constraints, literal=True)
    assert solution.certificate.converged
    for x in solution.lighting.of_lamps().values():
        drives = np.array([*x.drives.values()])
        assert drives @ x.lamp.powers <= 0.3 + SAME
        assert 2 - SAME <= drives @ x.lamp.levels <= 6 + SAME


def test_a_lamp_has_the_colour_and_the_spectrum_of_its_drives(make_basis):
    basis = _basis(make_basis)
    solved = solve(basis, _target(basis, DRIVES), constraints=Constraints.of(LAMPS), literal=True)
    lamp = solved.lighting.of_lamps()["b"]
    assert lamp.powers is not None
    # The weights of luminance have four digits.
    assert lamp.emission == pytest.approx(rgb_of_powers(lamp.powers), rel=1e-3)
    assert lamp.emission @ np.array([0.2126, 0.7152, 0.0722]) == pytest.approx(
        DRIVES[4:] @ [*LEVELS.values()], abs=2e-2
    )


def test_a_file_has_lamps_and_gives_the_weights_back(make_basis, tmp_path):
    basis = _basis(make_basis)
    solution = solve(basis, _target(basis, DRIVES), constraints=Constraints.of(LAMPS))
    lighting = analyse(solution)[0].solution.lighting
    write_lighting(tmp_path / "a.json", lighting)
    found = read_lighting(tmp_path / "a.json")
    assert [*found] == ["a", "b"]
    assert found == lighting.of_lamps()
    assert found.weights_for(basis) == pytest.approx(lighting.weights_for(basis), rel=1e-9)
    np.testing.assert_allclose(combine(basis, found).image, combine(basis, lighting).image, 1e-6)
    errors = [x.standard_error for x in lighting.lights[:4]]
    known = [None if x is None else x[0] for x in errors]
    for error, level, shown in zip(
        known, LEVELS.values(), found["a"].drive_errors.values(), strict=True
    ):
        assert (shown is None) == (error is None)
        assert error is None or shown == pytest.approx(error / level)


def _drives(basis: Any, constraints: Constraints, seed: int = 1) -> Any:
    rng = np.random.default_rng(seed)
    target = _target(basis, rng.random(len(basis.lights)) * 2)
    solution = solve(basis, target, constraints=constraints, literal=True)
    assert solution.certificate.converged
    found = solution.lighting.of_lamps()
    return found, {name: np.array([*light.drives.values()]) for name, light in found.items()}


def test_power_share_bounds_the_emitters_of_a_lamp_together(make_basis):
    watts = np.array([12, 10, 14, 16]) / 52
    lamps = {**LAMPS, "a": {"emitters": EMITTERS, "power_share": 0.3}}
    _, drives = _drives(_basis(make_basis), Constraints.of(lamps))
    assert drives["a"] @ watts == pytest.approx(0.3, abs=SAME)
    assert drives["b"] @ watts > 0.3


def test_an_answer_keeps_the_power_share_of_its_lamp(make_basis, tmp_path):
    """So the best Rf is that of mixes within it, where white takes much power."""
    emitters = [*EMITTERS[:3], {**EMITTERS[3], "watts": 60}]
    lamps = {**LAMPS, "a": {"emitters": emitters, "power_share": 0.3}}
    basis = _basis(make_basis)
    constraints = Constraints.of(lamps)
    lamp = lamps_by_name(constraints, WholeLamps.of(basis.lights).lights)["a"]
    white = np.asarray(kelvin_to_rgb(4000.0))
    drives = lamp.drives_for(0.95 * lamp.brightest(white) * white)
    solution = solve(
        basis, _target(basis, np.tile(drives, 2)), constraints=constraints, literal=True
    )
    write_lighting(tmp_path / "a.json", solution.lighting)
    a, b = read_lighting(tmp_path / "a.json").values()
    assert a.lamp.power_share == pytest.approx(0.3)
    assert b.lamp.power_share is None
    for found in (a, solution.lighting.of_lamps()["a"]):
        assert len(found.lamp.mixes(found.lamp.mix(np.array(found.mix)))) > 0
        best = found.lamp.best_rendering(np.array(found.emission))
        assert best @ found.lamp.powers <= 0.3 + SAME
    rendering = renderings_of(solution.lighting)["a"]
    free = replace(a.lamp, power_share=None)
    assert rendering.best_rf + 1 < fidelity(
        free.best_rendering(np.array(a.emission)) @ free.powers_at_full
    )


def test_limits_bound_the_luminance_of_a_lamp(make_basis):
    lamps = {**LAMPS, "b": {"emitters": EMITTERS, "limits": {"max": 3.5}}}
    _, drives = _drives(_basis(make_basis), Constraints.of(lamps))
    assert drives["b"] @ [*LEVELS.values()] == pytest.approx(3.5, abs=SAME)


def test_off_lock_colour_and_ties_are_of_whole_lamps(make_basis):
    basis = _basis(make_basis)
    levels = np.array([*LEVELS.values()])
    _, drives = _drives(basis, Constraints.of({**LAMPS, "a": {"emitters": EMITTERS, "off": True}}))
    assert not drives["a"].any()
    lamps = {**LAMPS, "a": {"emitters": EMITTERS, "lock": True}}
    found, drives = _drives(basis, Constraints.of(lamps))
    # As the scene shows it, each emitter has the luminance .5; its preferred mix, the same colour.
    assert drives["a"] @ levels == pytest.approx(2.0, rel=1e-4)
    lamps = {**LAMPS, "a": {"emitters": EMITTERS, "color": "4000K"}}
    found, _ = _drives(basis, Constraints.of(lamps))
    assert found.photometry(found["a"]).kelvin == pytest.approx(4000, abs=15)
    found, drives = _drives(basis, Constraints.of(LAMPS, tie=[["a", "b"]]))
    assert drives["a"] == pytest.approx(drives["b"], rel=1e-6)
    assert np.flatnonzero(drives["a"]).size


def test_a_range_of_white_is_refused_in_one_line(make_basis):
    basis = _basis(make_basis)
    constraints = Constraints.of({**LAMPS, "b": {"emitters": EMITTERS, "kelvin": [2700, 5000]}})
    with pytest.raises(ConstraintError, match="light 'b' has a range of kelvin, and where each"):
        reduce_to(constraints, basis.lights)


def test_an_unknown_lamp_is_named_with_the_others(make_basis):
    basis = _basis(make_basis)
    constraints = Constraints.of({**LAMPS, "c": {"off": True}})
    with pytest.raises(Exception, match="no light 'c'; there are a, b"):
        reduce_to(constraints, basis.lights)
