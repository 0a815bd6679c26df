"""Rf that is asked for where each emitter has a picture: the picture is held."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lightpaint.colour.color import delta_e, kelvin_to_rgb
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.colour.rendering_indices import fidelity
from lightpaint.colour.spectrum import WAVELENGTHS, rgb_of_powers, spectrum_of
from lightpaint.lighting.analysis.answer_analysis import analyse
from lightpaint.lighting.analysis.rendered_colors import renderings_of
from lightpaint.lighting.answer.lighting_file import read_lighting, write_lighting
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.held_mixes import HELD
from lightpaint.lighting.problem import display_transform
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.pipeline.job.settings import Settings
from lightpaint.report.phrases import rendering_sentences
from lightpaint.target.painted_target import Target

SIZE = (6, 20)
#: Peaks of LEDs: nanometres, width and height. The white one is a blue LED with a phosphor.
PEAKS = {
    "red": [(630, 12, 1)],
    "green": [(525, 16, 1)],
    "blue": [(455, 12, 1)],
    "white": [(450, 9, 0.5), (575, 55, 1)],
}
WATTS = {"red": 12, "green": 20, "blue": 14, "white": 40}
LEVEL = 4.0
RED = 0.04 + 0.6 / (1 + np.exp(-(WAVELENGTHS - 600) / 8))
#: A grey so little red that eyes do not see it, beside which the solve tells mixes apart.
SURFACES = {"grey": np.full(len(RED), 0.5), "warm": 0.5 + 2e-3 * RED, "red": RED}


def _powers(name: str) -> np.ndarray:
    lines = [h * np.exp(-0.5 * ((WAVELENGTHS - nm) / sd) ** 2) for nm, sd, h in PEAKS[name]]
    return np.array(spectrum_of(WAVELENGTHS, np.sum(lines, axis=0)))


#: Drives of three LEDs that mix 3200 K, with a low Rf and little power, and with a high one.
COLUMNS = np.stack([LEVEL * rgb_of_powers(_powers(name)) for name in PEAKS])
WHITE = 1.5 * np.asarray(kelvin_to_rgb(3200.0))
POOR, RICH = np.zeros((2, 4))
POOR[:3] = np.linalg.solve(COLUMNS[:3].T, WHITE)
RICH[[0, 2, 3]] = np.linalg.solve(COLUMNS[[0, 2, 3]].T, WHITE)

EMITTERS = [
    {
        "name": name,
        "spectrum": np.stack([WAVELENGTHS, _powers(name)], axis=1).tolist(),
        "Y": LEVEL,
        "watts": WATTS[name],
    }
    for name in PEAKS
]


def _basis(make_basis: Any, *surfaces: str, lamps: str = "a") -> Any:
    """Return a basis of surfaces side by side, by hand: spectrum, reflectance, observer."""
    names = [f"{lamp}/{name}" for lamp in lamps for name in PEAKS]
    basis = make_basis(len(names), SIZE, names=names)
    shade = np.linspace(0.5, 1, SIZE[0] * SIZE[1]).reshape(*SIZE, 1)
    columns = np.array_split(np.arange(SIZE[1]), len(surfaces))
    images = np.zeros((len(names), *SIZE, 3), np.float32)
    for k, name in enumerate(names):
        for surface, part in zip(surfaces, columns, strict=True):
            light = rgb_of_powers(_powers(name[2:]) * SURFACES[surface])
            images[k][:, part] = light * shade[:, part]
    lights = tuple(
        replace(x, lamp=x.name[0], members=(x.name[0],), is_scalar=True, emission=(0.5, 0.5, 0.5))
        for x in basis.lights
    )
    return replace(basis, planes=basis.planes.replaced(dict(enumerate(images))), lights=lights)


def _solved(
    basis: Any, lamps: str = "a", prefer: Any = None, painted: Any = POOR, **wish: Any
) -> Any:
    weights = np.repeat(np.tile(painted * LEVEL, len(lamps))[:, None], 3, axis=1)
    target = Target("t", basis.mix(weights), np.ones(SIZE, np.float32), everything=True)
    tables = {lamp: {"emitters": EMITTERS, **wish} for lamp in lamps}
    constraints = Constraints.of(tables, prefer_emitters=prefer)
    return solve(basis, target, constraints=constraints, literal=True)


def _change(basis: Any, before: Any, after: Any) -> np.ndarray:
    """Return the CIEDE2000 between two answers, everywhere."""
    exposure = 2.0 ** display_transform(before.problem).stops
    pictures = [basis.mix(x.weights) * exposure for x in (before, after)]
    return delta_e(*pictures)


def _rf(solution: Any, name: str = "a") -> float:
    return fidelity(solution.lighting.of_lamps()[name].powers)


def test_on_grey_a_lamp_takes_the_rf_that_is_asked_for(make_basis):
    basis = _basis(make_basis, "grey", "warm")
    plain = _solved(basis)
    assert _rf(plain) < 70
    found = _solved(basis, rf=80)
    assert 80 <= _rf(found) < 80.2
    assert _change(basis, plain, found).max() < HELD
    [x] = renderings_of(found.lighting).values()
    assert x.held_mix_change is None
    assert x.plain_rf == pytest.approx(_rf(plain), abs=0.1)
    drives = found.lighting.of_lamps()["a"].drives
    watts = sum(drives[name] * w for name, w in WATTS.items())
    assert x.watts == pytest.approx(watts)
    [sentence] = rendering_sentences({"a": x})
    assert sentence == (
        f"a: Rf {_rf(found):.1f}".removesuffix(".0")
        + f", as asked for. It takes {watts:.3g} W, instead of {x.plain_watts:.3g} W for Rf "
        f"{x.plain_rf:.1f}."
    )


def test_beside_a_red_dress_the_picture_stays_and_the_sentence_says_what_it_costs(make_basis):
    basis = _basis(make_basis, "grey", "red")
    plain, found = _solved(basis), _solved(basis, rf=80)
    # Of all pixels one in a hundred may change more, and round-off is of float32.
    assert 0.5 * HELD < np.quantile(_change(basis, plain, found), 0.99) <= HELD * 1.001
    assert _rf(plain) < _rf(found) < 80
    [x] = renderings_of(found.lighting).values()
    assert x.held_mix_change is not None
    assert x.held_mix_change > 1
    assert x.best_rf is not None
    assert x.best_rf > 80
    [sentence] = rendering_sentences({"a": x})
    assert "leaves the picture as it is; 80 was asked for" in sentence
    assert f"changes the picture by {x.held_mix_change:.1f} ΔE" in sentence


def test_the_picture_is_held_for_all_lamps_together(make_basis):
    basis = _basis(make_basis, "grey", "red", lamps="ab")
    plain, found = _solved(basis, "ab"), _solved(basis, "ab", prefer="rf")
    assert np.quantile(_change(basis, plain, found), 0.99) <= HELD * 1.001
    assert _rf(found, "b") > _rf(plain, "b")


def test_a_mix_that_has_the_rf_stays(make_basis):
    basis = _basis(make_basis, "grey", "red")
    plain = _solved(basis)
    found = _solved(basis, rf=_rf(plain) - 1)
    np.testing.assert_array_equal(found.weights, plain.weights)


@pytest.mark.parametrize(("prefer", "painted"), [("watts", RICH), ("white", POOR)])
def test_other_preferences_hold_it_as_well(prefer: str, painted: Any, make_basis):
    basis = _basis(make_basis, "grey", "warm")
    plain, found = (_solved(basis, prefer=x, painted=painted) for x in (None, prefer))
    assert _change(basis, plain, found).max() < HELD
    before, after = (x.lighting.of_lamps()["a"].drives for x in (plain, found))
    assert (after["white"] > before["white"]) == (prefer == "white")
    spent = [sum(x[name] * w for name, w in WATTS.items()) for x in (before, after)]
    assert (spent[1] < spent[0]) == (prefer == "watts")


def test_a_fixed_colour_puts_rf_before_the_picture(make_basis):
    """The brightness is limited to what mixes of that Rf reach."""
    basis = _basis(make_basis, "grey", "red")
    found = _solved(basis, rf=80, color="4000K")
    assert _rf(found) >= 80
    lamp = found.lighting.of_lamps()["a"].lamp
    assert lamp is not None
    color = np.array([*found.lighting.of_lamps()["a"].emission])
    color /= color @ [0.2126, 0.7152, 0.0722]
    _, brightest = lamp.brightest_mix(color)
    assert brightest < lamp.brightest(color)
    powers = lamp.powers_at_full
    assert powers is not None
    for level, is_enough in ((0.99 * brightest, True), (1.01 * brightest, False)):
        best = fidelity(lamp.best_rendering(level * color) @ powers)
        assert (best >= 80) == is_enough


#: Least squares in float64, of planes in float32.
ROUND_OFF = 1e-4


@pytest.mark.parametrize("prefer", ["rf", "watts", "white"])
@pytest.mark.parametrize("level", [0.2, 0.7])
def test_a_fixed_colour_is_mixed_as_preferred_at_its_brightness(level, prefer, make_basis):
    """And is as bright as brings the picture closest with that mix."""
    basis = _basis(make_basis, "grey", "red")
    found = _solved(basis, prefer=prefer, painted=level * POOR, color="3200K")
    light = found.lighting.of_lamps()["a"]
    assert light.lamp is not None
    drives = np.array([*light.drives.values()])
    expected = light.lamp.drives_for(np.array(light.emission))
    # Mixes whose Rf is nearly equal are found some thousandths apart.
    assert drives == pytest.approx(expected, abs=5e-3)
    assert (drives <= light.lamp.most).all()
    if prefer == "rf":
        [x] = renderings_of(found.lighting).values()
        assert x.color is not None
        assert x.color.rf == pytest.approx(x.best_rf, abs=0.1)
    # At full there is one mix, which dimmed lamps do not have to keep.
    _, most = light.lamp.brightest_mix(np.array(light.emission))
    at_full = light.lamp.drives_for(most * np.array(light.emission)) / most
    assert np.abs(drives - at_full).max() > 0.01
    picture = basis.mix(found.weights).ravel().astype(np.float64)
    goal = found.problem.squares.image.ravel()
    assert picture @ goal / (picture @ picture) == pytest.approx(1, rel=ROUND_OFF)


def test_lamps_on_one_dimmer_are_mixed_as_preferred_at_their_brightness(make_basis):
    basis = _basis(make_basis, "grey", "red", lamps="ab")
    weights = np.repeat(np.tile(0.3 * POOR * LEVEL, 2)[:, None], 3, axis=1)
    target = Target("t", basis.mix(weights), np.ones(SIZE, np.float32), everything=True)
    constraints = Constraints.of(
        {name: {"emitters": EMITTERS} for name in "ab"},
        tie=[{"lights": ["a", "b"], "color": "3200K"}],
        prefer_emitters="rf",
    )
    found = solve(basis, target, constraints=constraints, literal=True)
    a, b = found.lighting.of_lamps().lights
    assert a.mix == pytest.approx(b.mix, abs=1e-6)
    for x in renderings_of(found.lighting).values():
        assert x.color is not None
        assert x.color.rf == pytest.approx(x.best_rf, abs=0.1)


def test_the_file_has_what_was_chosen(make_basis, tmp_path):
    solution = _solved(_basis(make_basis, "grey", "red"), rf=80)
    lighting = analyse(solution)[0].solution.lighting
    write_lighting(tmp_path / "a.json", lighting)
    assert read_lighting(tmp_path / "a.json") == lighting.of_lamps()
    assert renderings_of(read_lighting(tmp_path / "a.json")) == renderings_of(lighting)


@pytest.mark.parametrize("wish", [{}, {"color": "3200K"}])
def test_a_session_at_rest_has_the_mixes_of_a_solve(wish, make_basis):
    basis = _basis(make_basis, "grey", "warm")
    painted = 0.5 * POOR
    expected = _solved(basis, prefer="rf", painted=painted, **wish).lighting.of_lamps()["a"]
    weights = np.repeat((painted * LEVEL)[:, None], 3, axis=1)
    target = Target("t", basis.mix(weights), np.ones(SIZE, np.float32), everything=True)
    constraints = Constraints.of({"a": {"emitters": EMITTERS, **wish}}, prefer_emitters="rf")
    snapshot = SessionSnapshot(
        *(0, (basis,), (target,), SessionRequests(), Settings(literal=True, spectral=True)),
        *(constraints, ViewTransform()),
    )
    found = snapshot.solution().lighting.of_lamps()["a"]
    assert found.drives == pytest.approx(expected.drives, abs=1e-9)
    assert fidelity(found.powers) > fidelity(painted @ found.lamp.powers_at_full) + 10
