"""Lights that mix their colour from emitters: solve, file and errors."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from least_squares import stack_rows
from nightly import seeds
from scipy.optimize import lsq_linear

from lightpaint.colour.color import cct_and_duv, kelvin_to_rgb
from lightpaint.dmx import drives_of
from lightpaint.errors import BasisError, ConstraintError, LightingError
from lightpaint.lighting.analysis.answer_analysis import analyse
from lightpaint.lighting.answer.lighting_file import read_lighting, write_lighting
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.constraints.constraints_file import read_constraints
from lightpaint.lighting.constraints.light_constraints import constraints_by_light, tables_by_light
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.unknowns.reduction import reduce_to
from lightpaint.target.painted_target import Target

SIZE = (5, 4)

#: Chromaticities of CIE 1931 of usual LEDs.
RED, GREEN, BLUE = [0.7, 0.299], [0.17, 0.7], [0.135, 0.055]
WHITE, AMBER, LIME = [0.33, 0.34], [0.57, 0.42], [0.41, 0.55]

RGBW = [
    {"name": name, "xy": xy, "Y": level, "watts": 12}
    for name, xy, level in (
        ("red", RED, 1.9),
        ("green", GREEN, 3.8),
        ("blue", BLUE, 0.8),
        ("white", WHITE, 5.1),
    )
]
SIX = [*RGBW, {"name": "amber", "xy": AMBER, "Y": 2.5}, {"name": "lime", "xy": LIME, "Y": 5.0}]

#: Float64 of this condition, and the oracle's own tolerance.
SAME = 1e-8


def _case(make_basis: Any, seed: int, **lights: Any) -> Any:
    basis = make_basis(len(lights), SIZE, seed=seed, names=[*lights])
    rng = np.random.default_rng(seed)
    image = (rng.random((*SIZE, 3)) * rng.uniform(0.5, 6)).astype(np.float32)
    target = Target("t", image, rng.random(SIZE).astype(np.float32), everything=False)
    return basis, target, Constraints.of(lights)


@pytest.mark.parametrize("seed", list(seeds(6, 40)))
def test_the_answer_is_the_bounded_least_squares_of_scipy(make_basis, seed):
    lights = {"par": {"emitters": RGBW}, "wash": {"emitters": SIX}, "other": {}}
    basis, target, constraints = _case(make_basis, seed, **lights)
    solution = solve(basis, target, constraints=constraints, literal=True)
    assert solution.certificate.converged
    A, y = stack_rows(basis, target)
    lamps = solution.problem.reduction.lamps
    C = np.zeros((9, 13))
    C[:3, :4], C[3:6, 4:10] = lamps[0].columns.T, lamps[1].columns.T
    C[6:, 10:] = np.eye(3)
    bounds = np.zeros(13), np.r_[np.ones(10), np.full(3, np.inf)]
    best = lsq_linear(A @ C, y, bounds, method="bvls", tol=1e-14)
    w = solution.weights.ravel()
    assert ((A @ w - y) ** 2).sum() == pytest.approx(2 * best.cost, rel=SAME, abs=SAME)
    for k, light in enumerate(solution.lighting.lights[:2]):
        drives = np.array([*light.drives.values()])
        assert ((drives >= 0) & (drives <= 1)).all()
        assert np.allclose(lamps[k].mix(drives), light.emission, atol=1e-5)


def test_a_green_outside_rec709_is_answered_with_negative_red(make_basis):
    # No drives of these two give a red of 0.
    basis, target, constraints = _case(make_basis, 3, par={"emitters": RGBW[1:3]})
    first = solve(basis, target, constraints=constraints, literal=True)
    emission = first.problem.reduction.lamps[0].mix(np.array([0.8, 0.1]))
    assert emission[0] < 0
    # A painting has no negative light.
    green = replace(target, image=np.maximum(basis.mix(emission[None]), 0).astype(np.float32))
    solution = solve(basis, green, constraints=constraints, literal=True)
    [light] = solution.lighting.lights
    assert light.emission[0] < 0
    assert not light.is_active  # emitters at 0 hold nothing back
    objective = solution.problem.objective
    assert objective(solution.weights).sum() <= objective(emission[None]).sum() * (1 + SAME)


def test_the_share_of_power_bounds_the_sum(make_basis):
    limited = {"par": {"emitters": RGBW, "power_share": 0.3}}
    basis, target, constraints = _case(make_basis, 1, **limited)
    bright = replace(target, image=target.image * 50)
    [light] = solve(basis, bright, constraints=constraints, literal=True).lighting.lights
    assert sum(light.drives.values()) / 4 == pytest.approx(0.3, abs=1e-6)
    assert light.is_active


def test_a_largest_drive_and_a_limit_of_luminance_hold(make_basis):
    emitters = [{**x, "max": 0.5} for x in RGBW]
    basis, target, constraints = _case(make_basis, 1, par={"emitters": emitters})
    bright = replace(target, image=target.image * 50)
    [light] = solve(basis, bright, constraints=constraints, literal=True).lighting.lights
    assert max(light.drives.values()) == pytest.approx(0.5)
    assert light.is_active
    dimmed = constraints.and_then(Constraints.of({"par": {"limits": {"max": 1.0}}}))
    solution = solve(basis, bright, constraints=dimmed, literal=True)
    assert solution.lighting.photometry(solution.lighting["par"]).y == pytest.approx(1.0)


def test_a_colour_is_mixed_as_bright_as_the_emitters_can(make_basis):
    basis, target, constraints = _case(make_basis, 1, par={"emitters": RGBW, "color": "3200K"})
    bright = replace(target, image=target.image * 50)
    [light] = solve(basis, bright, constraints=constraints, literal=True).lighting.lights
    assert light.lamp is not None
    assert max(light.drives.values()) == pytest.approx(1)
    assert np.allclose(light.lamp.mix(np.array([*light.drives.values()])), light.emission)


def _bend(mireds: float) -> float:
    """Return how far the curve of whites is from its straight pieces at most, as a share."""
    middles = np.linspace(1e6 / 6500, 1e6 / 2700, 100)
    off = [
        (kelvin_to_rgb(1e6 / (m - mireds / 2)) + kelvin_to_rgb(1e6 / (m + mireds / 2))) / 2
        - kelvin_to_rgb(1e6 / m)
        for m in middles
    ]
    return float(np.abs(off).max())


@pytest.mark.parametrize("gain", [0.3, 3.0, 50.0])
@pytest.mark.parametrize("share", [None, 0.3])
@pytest.mark.parametrize("seed", list(seeds(2, 12)))
def test_a_range_of_white_is_the_best_white_that_the_emitters_mix(make_basis, seed, share, gain):
    """Against whites of a fine grid, each as bright as is best and as the lamp can be."""
    limit = {} if share is None else {"power_share": share}
    table = {"emitters": RGBW, "kelvin": [2700, 6500], **limit}
    basis, target, constraints = _case(make_basis, seed, par=table)
    bright = replace(target, image=target.image * gain)
    solution = solve(basis, bright, constraints=constraints, literal=True)
    [light] = solution.lighting.lights
    assert light.lamp is not None
    objective = solution.problem.objective
    best, picture = np.inf, 0.0
    for mired in np.linspace(1e6 / 6500, 1e6 / 2700, 400):
        color = kelvin_to_rgb(1e6 / mired)
        most = light.lamp.brightest(color)
        zero, one, two = (float(objective(y * color[None]).sum()) for y in (0.0, 1.0, 2.0))
        curve = (two - 2 * one + zero) / 2  # a parabola in the brightness
        y = min(max(-(one - zero - curve) / (2 * curve), 0.0), most)
        if (value := float(objective(y * color[None]).sum())) < best:
            best, picture = value, y * np.sqrt(curve)  # the norm of what the light makes
    found = float(objective(solution.weights).sum())
    # Whites 8 mireds apart are mixed along the straight line between them, whose middle is off the
    # curve by this share of the light, and the brightest mix of which is taken to be straight.
    assert found <= best * (1 + 1e-4) + 2 * np.sqrt(best) * _bend(8) * picture
    assert light.lamp.can_mix(np.array(light.emission))
    white = cct_and_duv(np.array(light.emission))
    assert white is not None
    assert 2699 < white[0] < 6501
    assert abs(white[1]) < 1e-4
    power = np.array([*light.drives.values()]) @ light.lamp.powers
    assert power <= (share or 1.0) + 1e-6
    if gain == 50.0:
        assert light.is_active
    if seed == 0:
        analysed = analyse(solution)[0].solution.lighting["par"]
        assert np.allclose([*analysed.drives.values()], [*light.drives.values()])


def test_lamps_of_one_pattern_are_read_once(make_basis):
    """A rig has hundreds of them."""
    lights = {f"par {k}": {} for k in range(4)}
    basis, _, _ = _case(make_basis, 1, **lights)
    more = {"par 3": {"limits": {"max": 2.0}}}
    constraints = Constraints.of({"par *": {"emitters": RGBW}} | more)
    by_light = constraints_by_light(constraints, basis.lights)
    assert by_light[0] is by_light[1] is by_light[2]
    assert by_light[3].most is not None
    lamps = reduce_to(constraints, basis.lights).lamps
    assert lamps[0] is lamps[1] is lamps[2]
    assert lamps[3] == lamps[0]


def test_preferences_change_the_drives_and_not_the_picture(make_basis):
    basis, target, constraints = _case(make_basis, 2, wash={"emitters": SIX})
    answers = {
        prefer: solve(
            basis,
            target,
            constraints=constraints.and_then(Constraints.of(prefer_emitters=prefer)),
            literal=True,
        ).lighting["wash"]
        for prefer in ("watts", "white", "fewest")
    }
    emissions = {light.emission for light in answers.values()}
    assert len(emissions) == 1
    count = {key: sum(x > 0 for x in light.drives.values()) for key, light in answers.items()}
    assert count["fewest"] <= min(count.values())
    assert answers["white"].drives["white"] >= answers["watts"].drives["white"] - 1e-9


def test_candelas_and_lumens_are_of_the_scale(make_basis):
    basis = make_basis(1, SIZE, names=["par"])
    spot = replace(basis.lights[0], plugin="spot", unit="W/sr", unit_flux=(0.5, 0.5, 0.5))
    basis = replace(basis, lights=(spot,))
    target = Target(
        "t", np.ones((*SIZE, 3), np.float32), np.ones(SIZE, np.float32), everything=True
    )
    for amount, level in (({"cd": 2000}, 2.0), ({"lm": 2000}, 4.0), ({"Y": 3.0}, 3.0)):
        emitters = [{"name": "white", "xy": WHITE, **amount}]
        constraints = Constraints.of({"par": {"emitters": emitters}}, cd_per_unit=1000)
        lamp = solve(basis, target, constraints=constraints).problem.reduction.lamps[0]
        assert lamp.columns @ [0.2126, 0.7152, 0.0722] == pytest.approx([level], rel=1e-3)


def test_a_scale_alone_is_kept(make_basis):
    basis, target, _ = _case(make_basis, 0, a={})
    answer = solve(basis, target, constraints=Constraints.of(cd_per_unit=1000)).lighting
    assert answer.cd_per_unit == 1000


def test_a_narrow_spectrum_has_the_colour_of_its_wavelength(make_basis):
    line = [[400, 0], [519, 0], [520, 1], [521, 0], [700, 0]]
    emitters = [{"name": "laser", "spectrum": line, "Y": 1}]
    basis, target, constraints = _case(make_basis, 1, par={"emitters": emitters})
    rgb = solve(basis, target, constraints=constraints).problem.reduction.lamps[0].columns[0]
    xyz = (
        np.array(
            [
                [0.41239080, 0.35758434, 0.18048079],
                [0.21263901, 0.71516868, 0.07219232],
                [0.01933082, 0.11919478, 0.95053215],
            ]
        )
        @ rgb
    )
    # CIE 1931 at 520 nm (CIE 15): x 0.0743, y 0.8338.
    assert xyz[:2] / xyz.sum() == pytest.approx([0.0743, 0.8338], abs=2e-3)


def test_drives_are_in_the_file_and_return(make_basis, tmp_path):
    basis, target, constraints = _case(make_basis, 4, par={"emitters": RGBW}, other={})
    lighting = analyse(solve(basis, target, constraints=constraints))[0].solution.lighting
    write_lighting(tmp_path / "a.json", lighting)
    data = json.loads((tmp_path / "a.json").read_text())["lights"]
    assert data["par"]["drives"] == lighting["par"].drives
    assert "drives" not in data["other"]
    assert read_lighting(tmp_path / "a.json").lights == lighting.lights


def test_drives_that_somebody_changed_are_refused_with_the_emission_that_they_mix(
    make_basis, tmp_path
):
    basis, target, constraints = _case(make_basis, 4, par={"emitters": RGBW})
    lighting = solve(basis, target, constraints=constraints).lighting
    file = tmp_path / "a.json"
    write_lighting(file, lighting)
    data = json.loads(file.read_text())
    light = data["lights"]["par"]
    light["drives"]["red"] = 0.123
    file.write_text(json.dumps(data))
    with pytest.raises(LightingError, match="light 'par' has drives that mix ") as caught:
        read_lighting(file)
    # What it says to do helps, both of it.
    words = str(caught.value).partition("that mix ")[2].partition(", and the emission")[0]
    mixed = [float(x) for x in words.split()]
    changed = {**data, "lights": {"par": {**light, "emission": mixed, "weight": mixed}}}
    file.write_text(json.dumps(changed))
    emission = lighting["par"].lamp.mix(np.array([*light["drives"].values()]))
    assert read_lighting(file)["par"].emission == pytest.approx(emission, rel=1e-5)
    del light["drives"]
    file.write_text(json.dumps(data))
    assert read_lighting(file)["par"].drives == pytest.approx(lighting["par"].drives, abs=1e-9)
    light["drives"] = {"pink": 1}
    file.write_text(json.dumps(data))
    with pytest.raises(LightingError, match="are not numbers of its emitters, red, green, blue"):
        read_lighting(file)


def test_other_drives_of_the_same_emission_are_sent(make_basis, tmp_path):
    basis, target, constraints = _case(make_basis, 3, wash={"emitters": SIX})
    lighting = solve(basis, target, constraints=constraints).lighting
    lamp = lighting["wash"].lamp
    emission = tuple(lamp.mix(np.full(6, 0.3)).tolist())
    file = tmp_path / "a.json"
    write_lighting(file, lighting.with_emission("wash", emission))
    data = json.loads(file.read_text())
    preferred = data["lights"]["wash"]["drives"]
    assert read_lighting(file)["wash"].edited_mix is None
    data["lights"]["wash"]["drives"] = edited = dict.fromkeys(preferred, 0.3)
    file.write_text(json.dumps(data))
    found = read_lighting(file)
    assert np.abs(np.array([*preferred.values()]) - 0.3).max() > 0.05
    assert found["wash"].drives == drives_of(found)["wash"] == edited
    write_lighting(tmp_path / "b.json", found)
    assert read_lighting(tmp_path / "b.json") == found
    # At another emission, the lamp mixes what it prefers.
    assert found.with_emission("wash", emission)["wash"].drives == pytest.approx(preferred)


def test_rf_of_unknown_spectra_is_refused(make_basis):
    basis, target, constraints = _case(make_basis, 3, par={"emitters": RGBW})
    with pytest.raises(ConstraintError, match="prefer_emitters is rf, and nothing says which spec"):
        solve(
            basis,
            target,
            constraints=constraints.and_then(Constraints.of(prefer_emitters="rf")),
        )


def test_only_lamps_may_be_negative_in_a_file(make_basis, tmp_path):
    basis, target, constraints = _case(make_basis, 4, par={"emitters": RGBW})
    write_lighting(tmp_path / "a.json", solve(basis, target, constraints=constraints).lighting)
    data = json.loads((tmp_path / "a.json").read_text())
    data["lights"]["par"] |= {"emission": [-0.1, 1, 0], "weight": [-0.1, 1, 0]}
    del data["lights"]["par"]["drives"]  # which follow from the emission
    (tmp_path / "b.json").write_text(json.dumps(data))
    assert read_lighting(tmp_path / "b.json").emission["par"] == (-0.1, 1, 0)
    del data["lights"]["par"]["emitters"]
    (tmp_path / "c.json").write_text(json.dumps(data))
    with pytest.raises(LightingError, match=r"emission \[-0.1, 1.0, 0.0\]: need three numbers"):
        read_lighting(tmp_path / "c.json")


def test_a_lights_file_describes_emitters(tmp_path):
    path = tmp_path / "hall.lights.toml"
    path.write_text(
        'cd_per_unit = 1000\nprefer_emitters = "white"\n[light."par *"]\npower_share = 0.6\n'
        'emitters = [{name = "red", xy = [0.7, 0.299], cd = 900, bits = 16, max = 0.9}]\n'
    )
    constraints = read_constraints(path)
    assert constraints.cd_per_unit == 1000
    assert constraints.prefer_emitters == "white"
    assert "60% of full power" in repr(constraints)


def _with_spectrum(pairs):
    return {"emitters": [{"name": "a", "spectrum": pairs, "Y": 1}]}


WRONG = {
    "no list": ({"emitters": "red"}, "expected a list of emitters"),
    "no colour": ({"emitters": [{"name": "a", "cd": 1}]}, "no colour: expected one of xy, rgb"),
    "two colours": (
        {"emitters": [{"name": "a", "xy": RED, "rgb": [1, 1, 1]}]},
        "xy and rgb: expected one of",
    ),
    "no brightness": ({"emitters": [{"name": "a", "xy": RED}]}, "how bright it is at full"),
    "two amounts": ({"emitters": [{"name": "a", "xy": RED, "cd": 1, "lm": 1}]}, "cd and lm"),
    "no colour of this xy": ({"emitters": [{"name": "a", "xy": [0.9, 0.9], "cd": 1}]}, "no colour"),
    "dark": ({"emitters": [{"name": "a", "rgb": [-1, 0, 0]}]}, "luminance is not above 0"),
    "bits": ({"emitters": [{**RGBW[0], "bits": 12}]}, "expected 8, 16 or 24"),
    "max": ({"emitters": [{**RGBW[0], "max": 1.5}]}, "expected > 0, at most 1"),
    "a name twice": ({"emitters": [RGBW[0], RGBW[0]]}, "two emitters named 'red'"),
    "no name": ({"emitters": [{"xy": RED, "cd": 1}]}, "has no name: give it one"),
    "unknown": ({"emitters": [{**RGBW[0], "nm": 630}]}, "has the key 'nm'"),
    "misspelt": ({"emitters": [{**RGBW[0], "wats": 3}]}, "did you mean 'watts'"),
    "misspelt above": ({"emiters": RGBW}, "did you mean 'emitters'"),
    "too many": (
        {"emitters": [{**RGBW[0], "name": str(k)} for k in range(11)]},
        "at most 10 can be mixed",
    ),
    "spectrum": (_with_spectrum([[600, "much"]]), "is not a spectrum"),
    "few points": (
        _with_spectrum([[400, 0], [620, 0.1], [632, 1], [700, 0]]),
        r"light\.par\.emitters\.1\.spectrum has 4 points: expected 5 to",
    ),
    "falling": (
        _with_spectrum([[400, 0], [600, 1], [500, 1], [650, 0], [700, 0]]),
        "goes from 600 to 500 nm",
    ),
    "red alone": (
        _with_spectrum([[620, 0.1], [630, 0.8], [632, 1], [640, 0.5], [644, 0.1]]),
        "covers 620 to 644 nm: expected 400 to 700 at least",
    ),
    "negative": (
        _with_spectrum([[400, 0], [600, -0.5], [610, 1], [650, 0], [700, 0]]),
        "has the power -0.5 at 600 nm",
    ),
    "infrared": (
        _with_spectrum([[400, 0], [500, 0], [700, 0], [850, 0], [900, 1]]),
        "no power that eyes see",
    ),
    "primaries": (
        {"emitters": RGBW, "primaries": ["#f00", "#00f"]},
        "emitters and 'primaries', and",
    ),
    "a range of white and limits": (
        {"emitters": RGBW, "kelvin": [2700, 6500], "limits": {"max": 2}},
        "emitters, a range of kelvin and limits: leave limits out",
    ),
    "a share of nothing": ({"power_share": 0.5}, "without the emitters that share it"),
    "share": ({"emitters": RGBW, "power_share": 2}, "expected a share of full power"),
    "an Rf that none has": ({"emitters": RGBW, "rf": 120}, "rf is 120: expected the least Rf"),
    "an Rf in words": ({"emitters": RGBW, "rf": ">= 85"}, "rf is '>= 85': expected the least Rf"),
}


@pytest.mark.parametrize("case", WRONG)
def test_mistakes_are_named(case):
    table, message = WRONG[case]
    with pytest.raises(ConstraintError, match=message) as error:
        Constraints.of({"par": table})
    assert "\n" not in str(error.value)


IMPOSSIBLE = {
    "candelas without a scale": ({"emitters": [{"name": "a", "xy": RED, "cd": 9}]}, "is in cd"),
    "a colour it cannot mix": (
        {"emitters": RGBW[3:], "color": "#0000ff"},
        "its emitters white cannot mix",
    ),
    "whites it cannot mix": (
        {"emitters": [{"name": "w", "xy": WHITE, "Y": 5}, RGBW[0]], "kelvin": [2700, 6500]},
        "the emitters of 'par', w, red, cannot mix .* K: narrow the range",
    ),
    "a lock it cannot mix": (
        {"emitters": RGBW, "lock": "#ffffff 900"},
        "emitters red, green, blue, white cannot mix",
    ),
    "an Rf without spectra": (
        {"emitters": RGBW, "rf": 85},
        "rf is 85, and nothing says which spectrum its emitters red, green, blue, white of 'par'",
    ),
    "an Rf of a light without emitters": (
        {"rf": 85},
        "nothing says which spectrum its emitters of 'par' have: add emitters",
    ),
    "limits by channel": (
        {"emitters": RGBW, "limits": {"max": [1, 1, 1]}},
        "for a light that mixes emitters",
    ),
}


def test_a_lock_that_is_out_of_range_says_what_the_lamp_reaches(make_basis):
    basis, target, lamp = _case(make_basis, 1, par={"emitters": [{"name": "w", "rgb": [1, 2, 3]}]})
    for lock, message in (
        ([2.0, 4.0, 6.0], r"in this colour they reach 1 2 3, a level of 1\.86; lock it at that"),
        ([1.0, 0.0, 0.0], "they have no light of this colour, and all together reach 1 2 3"),
    ):
        held = lamp.and_then(Constraints.of({"par": {"lock": lock}}))
        with pytest.raises(ConstraintError, match=message):
            solve(basis, target, constraints=held)


@pytest.mark.parametrize("case", IMPOSSIBLE)
def test_what_a_lamp_cannot_do_is_one_line(make_basis, case):
    table, message = IMPOSSIBLE[case]
    basis, target, constraints = _case(make_basis, 1, par=table)
    with pytest.raises(ConstraintError, match=message):
        solve(basis, target, constraints=constraints)


def test_a_lamp_that_stays_may_be_described(make_basis):
    """A rig's lights file has the emitters of all lamps, also when --lights chooses some."""
    [light, _] = make_basis(2, SIZE, seed=1).lights
    # Together with others it may radiate less than nothing in a channel.
    fixed = [replace(light, is_fixed=True, emission=(1, 1, 1), unit_flux=(-0.7, 1.9, 17))]
    described = {"emitters": RGBW, "power_share": 0.5}
    [(table, _)] = tables_by_light(Constraints.of({light.name: described}), fixed)
    assert table == {}
    with pytest.raises(ConstraintError, match="is fixed, since it is not among the lights"):
        tables_by_light(Constraints.of({light.name: described | {"off": True}}), fixed)
    with pytest.raises(BasisError, match="has a flux of"):
        replace(light, unit_flux=(-0.7, 1.9, 17))
