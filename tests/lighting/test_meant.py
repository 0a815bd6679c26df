"""What a painting means: held where nothing is painted, lamps in their colour, as it was seen."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize, nnls

import lightpaint as lp
from lightpaint.colour.color import LUMINANCE, cct_and_duv, kelvin_to_rgb
from lightpaint.errors import TargetError
from lightpaint.lighting.fit import DEFAULT_HOLD, Fit, resolve_for_targets
from lightpaint.lighting.linear_problem import PaintReading
from lightpaint.lighting.loss import expected_lights, weight_penalty
from lightpaint.lighting.loss.expected_lights import ExpectedLights, Wash
from lightpaint.lighting.loss.painting import unpainted_weight_of
from lightpaint.lighting.loss.weight_penalty import CLEAR_PULL, COLOR_PULL, MAX_DIMMING
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solver import solution_of

SRGB = lp.ViewTransform()


def _basis(make_basis: Any, n: int = 4, seed: int = 0) -> lp.Basis:
    rng = np.random.default_rng(seed)
    return make_basis(images=rng.random((n, 12, 10, 3)) ** 3, emission=rng.random((n, 3)) + 0.1)


def _paint(basis: lp.Basis, seed: int = 1, **fields: Any) -> lp.Target:
    """Something else than the look, within the left half."""
    rng = np.random.default_rng(seed)
    mask = np.zeros(basis.size)
    mask[:, :5] = rng.random((basis.size[0], 5))
    masked = lp.Target.of(rng.random((*basis.size, 3)), mask)
    return replace(masked, **fields)


@pytest.mark.parametrize(
    ("fields", "fit"),
    [
        ({}, ("linear", 0, "free", None)),
        ({"transform": SRGB}, ("linear", 0, "free", None)),
        ({"over_look": True}, ("linear", DEFAULT_HOLD, "gentle", None)),
        ({"through_view": True, "transform": SRGB}, ("display", 0, "gentle", SRGB)),
        (
            {"through_view": True, "over_look": True, "transform": SRGB},
            ("display", DEFAULT_HOLD, "gentle", SRGB),
        ),
    ],
)
def test_what_is_left_open_follows_from_how_it_was_painted(make_basis: Any, fields: Any, fit: Any):
    target = _paint(_basis(make_basis), **fields)
    resolved = resolve_for_targets(Fit(), [target])
    assert (resolved.space, resolved.hold, resolved.colors, resolved.transform) == fit
    literal = resolve_for_targets(Fit(literal=True), [target])
    assert (literal.space, literal.hold, literal.colors) == ("linear", 0, "free")
    # What is said holds, whatever else is taken at its word.
    expected = Fit(space="display", hold=0.7, colors="white", literal=True)
    assert resolve_for_targets(expected, [target]) == replace(expected, transform=SRGB)


def test_views_of_which_one_was_painted_over_the_look(make_basis: Any):
    basis = _basis(make_basis)
    targets = [_paint(basis), _paint(basis, over_look=True)]
    assert resolve_for_targets(Fit(), targets).hold == DEFAULT_HOLD
    agx = lp.ViewTransform("agx")
    targets_by_view = [_paint(basis, through_view=True, transform=x) for x in (SRGB, agx)]
    with pytest.raises(TargetError, match=r"srgb at \+0 stops.*transform=\.\.\."):
        resolve_for_targets(Fit(), targets_by_view)
    assert resolve_for_targets(Fit(transform=agx), targets_by_view).transform == agx


def test_what_is_not_painted_weighs_as_much_as_is_said(make_basis: Any):
    """h Σ D over all of it, but no pixel more than a painted one."""
    basis = _basis(make_basis)
    target = _paint(basis, over_look=True)
    D = target.importance.astype(float)
    # Of this painting the rest is too small to weigh more.
    hold = 0.9 * float((1 - D).sum() / D.sum())
    problem = Problem.of(basis, target, fit=Fit(hold=hold))
    rest = problem.squares.weight[..., 0] - D
    np.testing.assert_allclose(rest.sum(), hold * D.sum(), rtol=1e-6)
    np.testing.assert_allclose(rest, rest.max() * (1 - D), rtol=1e-5, atol=1e-9)
    most = replace(target, importance=np.where(np.arange(10) > 0, 1, D).astype(np.float32))
    assert (
        unpainted_weight_of(
            Problem.of(basis, most).views, resolve_for_targets(Fit(hold=50), [most])
        )
        == 1
    )


def test_an_untouched_look_is_met_by_the_present_lighting(make_basis: Any):
    basis = _basis(make_basis)
    look = basis.mix(basis.current_weights)
    for fields in ({"over_look": True}, {"over_look": True, "through_view": True}):
        target = replace(_paint(basis, transform=lp.ViewTransform("srgb", -1.0)), image=look)
        solution = lp.solve(basis, replace(target, **fields))
        np.testing.assert_allclose(solution.weights, basis.current_weights, rtol=1e-4)


def test_colors_are_pulled_as_the_formula_says(make_basis: Any, monkeypatch: pytest.MonkeyPatch):
    """The optimum of squares and pull together, of any colours, found by another solver.

    The pull to each light grows with how dim it is expected to be, and falls with how clearly other
    colours are painted where it shines.
    """
    monkeypatch.setattr(PaintReading, "gamuts", lambda *_: None)
    for name in ("CONTRAST", "EXACT_CONTRAST", "EXACT_REST", "RESTRAINT"):
        monkeypatch.setattr(weight_penalty, name, 0.0)
    basis = _basis(make_basis)
    target = _paint(basis, over_look=True)
    solution = lp.solve(basis, target, hold=0)
    D, current = target.importance.astype(float), basis.current_weights
    images = basis.images.astype(float)
    colors = current / (current @ LUMINANCE)[:, None]
    power = np.square(images).sum(axis=(1, 2))

    def cost(flat: np.ndarray) -> float:
        w = flat.reshape(-1, 3)
        residual = target.image - np.einsum("nhwc,nc->hwc", images, w)
        hue = w - (w @ LUMINANCE)[:, None] * colors
        pull = (strength[:, None] * power * hue**2).sum()
        return float((D[..., None] * residual**2).sum() + D.mean() * pull)

    expected = solution.problem.expected
    assert expected is not None
    dimming = np.clip((current / expected.emission)[:, 1], 1, MAX_DIMMING)
    strength = dimming * (COLOR_PULL * (1 - expected.clarity) + CLEAR_PULL * expected.clarity)
    bounds, start = [(0, None)] * current.size, current.ravel()
    options = {"method": "L-BFGS-B", "options": {"ftol": 1e-15, "maxiter": 5000}}
    optimum = minimize(cost, start, bounds=bounds, **options)
    assert optimum.success
    assert cost(solution.weights.ravel()) <= optimum.fun * (1 + 1e-7)
    np.testing.assert_allclose(solution.weights.ravel(), optimum.x, rtol=1e-3, atol=1e-4)
    assert solution.certificate.converged


def test_lamps_that_only_dim_cost_nothing(make_basis: Any):
    """A painting that the lights meet in their current colours keeps these, at any pull."""
    basis = _basis(make_basis)
    dimmed = basis.current_weights * np.array([[0.2], [3.0], [0.0], [1.0]])
    target = replace(lp.Target.of(basis.mix(dimmed).astype(np.float32)), over_look=True)
    np.testing.assert_allclose(lp.solve(basis, target).weights, dimmed, rtol=1e-5, atol=1e-6)


#: A wash of two lamps beside each other on a bar, amber and blue, and a lamp elsewhere.
BAR = {"amber": (0.8, 0.4, 0.06), "blue": (0.03, 0.08, 0.8), "side": (0.2, 0.2, 0.2)}


def _bar(make_basis: Any) -> tuple[lp.Basis, lp.Target]:
    """The lamps, and a painting in which what the bar lights is as blue as its blue lamp."""
    shapes = np.ones((3, 12, 16))
    shapes[0] += 0.4 * np.linspace(-1, 1, 16)  # the amber one is a little beside
    shapes[:2, :, 11:] = shapes[2, :, :11] = 0.02
    basis = make_basis(
        images=shapes[..., None] * np.ones(3), names=list(BAR), emission=list(BAR.values())
    )
    night = basis.mix(np.array([(0, 0, 0), (0.05, 0.13, 1.3), BAR["side"]])).astype(np.float32)
    # Amber light alone could fall off as the brush did.
    night[:, :11] *= shapes[0][:, :11, None].astype(np.float32)
    painted = lp.Target.of(night)
    return basis, replace(painted, transform=SRGB, through_view=True, over_look=True)


def test_a_lamp_beside_one_of_the_painted_colour_keeps_its_own(make_basis: Any):
    """The blue lamp lights the night, not the amber one turned blue, though that fits better."""
    basis, target = _bar(make_basis)
    amber, blue, _ = lp.solve(basis, target).weights
    # As blue as it was, and amber but for a trace.
    np.testing.assert_allclose(blue / blue[2], np.array(BAR["blue"]) / 0.8, atol=0.05)
    assert blue[2] > BAR["blue"][2]
    assert amber.max() < 0.1 * BAR["amber"][0]


def test_a_lamp_takes_the_painted_colour_where_the_one_beside_it_is_locked(make_basis: Any):
    basis, target = _bar(make_basis)
    locked = lp.Constraints.of({"blue": {"off": True}})
    amber, blue, _ = lp.solve(basis, target, constraints=locked).weights
    assert not blue.any()
    assert amber[2] > 5 * amber[0]
    assert amber[2] > 10 * BAR["amber"][2]


def test_alike_are_lights_of_one_shape(make_basis: Any):
    basis, target = _bar(make_basis)
    assert Wash.of(basis, target).alike.tolist() == [[0, 1], [1, 0]]
    assert not Wash.of(_basis(make_basis), _paint(_basis(make_basis))).alike.size


def test_lamps_that_are_alike_leave_the_kept_sums_of_wishes(make_basis: Any):
    basis, target = _bar(make_basis)
    wash = Wash.of(basis, target)
    shares = np.random.default_rng(0).random((3, wash.counts.size))
    first = wash.light_sums(shares)
    ExpectedLights.of(wash, basis.current_weights)
    kept = wash.kept_sums.of(shares, lambda _: pytest.fail("wishes are summed again"))
    np.testing.assert_array_equal(kept.transpose(1, 2, 0), first)


def test_mixes_of_own_colours_are_the_nearest():
    """As SciPy finds them; the iteration is slow where two of the colours are nearly one."""
    rng = np.random.default_rng(0)
    colors, asked = rng.random((300, 4, 3)) ** 2, rng.random((300, 3))
    colors[::3, 2:] = 0  # smaller groups
    found = expected_lights._nearest_mixes(colors, asked)
    best = [nnls(c.T, t)[0] @ c for c, t in zip(colors, asked, strict=True)]
    np.testing.assert_allclose(found, best, atol=0.02)
    assert np.median(np.abs(found - best)) < 1e-6


def test_of_lamps_beside_each_other_those_change_that_bring_what_is_missing(make_basis: Any):
    """A blue deeper than the blue lamp's: it becomes deeper, and the amber one stays."""
    basis, target = _bar(make_basis)
    deep = target.image * np.float32([0.02, 0.02, 1])
    wash = Wash.of(basis, replace(target, image=deep))
    amber, blue, _ = ExpectedLights.of(wash, basis.current_weights).clarity
    assert amber < 0.01
    assert blue > 0.99
    alone = ExpectedLights.of(wash, basis.current_weights, np.array([True, False, True])).clarity
    assert alone[:2].min() > 0.99


def test_colors_that_were_asked_for_are_not_pulled(make_basis: Any):
    basis = _basis(make_basis)
    target = _paint(basis, over_look=True)
    red = lp.Constraints.of({"light 0": {"color": "#ff0000"}})
    problem = Problem.of(basis, target, constraints=red)
    assert problem.keeps_color.tolist() == [False, True, True, True]
    solution = solution_of(problem)
    assert solution.weights[0, 1:].tolist() == [0, 0]
    assert solution.certificate.converged


def test_white_is_what_kelvin_does(make_basis: Any):
    basis = _basis(make_basis)
    target = _paint(basis)
    constraints = lp.Constraints.of({"*": {"kelvin": [2200, 9000]}})
    expected = lp.solve(basis, target, constraints=constraints).weights
    np.testing.assert_allclose(lp.solve(basis, target, colors="white").weights, expected, rtol=1e-9)
    # What is asked of a light goes before.
    locked = lp.Constraints.of({"light 1": {"lock": True}})
    weights = lp.solve(basis, target, colors="white", constraints=locked).weights
    np.testing.assert_allclose(weights[1], basis.current_weights[1])


@pytest.mark.parametrize(
    ("kelvin", "least", "most"), [(6000, 5400, 6600), (16_000, 14_000, 18_000)]
)
def test_whites_reach_as_far_as_what_is_painted(
    make_basis: Any, kelvin: float, least: float, most: float
):
    """Moonlight is painted at 12,000 K and more, beyond usual lamps."""
    left = np.linspace(1, 0, 16) * np.ones((12, 1))
    images = np.array([left, 1 - left])[..., None] * np.ones(3)
    basis = make_basis(images=images, names=["a", "b"], emission=[(0.3, 0.3, 0.3), (0.1, 0.1, 0.1)])
    moonlit = (basis.current_look * kelvin_to_rgb(kelvin)).astype(np.float32)
    everywhere = np.ones(basis.size, np.float32)
    target = lp.Target(
        "moon",
        moonlit,
        everywhere,
        everything=False,
        transform=SRGB,
        through_view=True,
        over_look=True,
    )
    for colors in ("white", "gentle"):
        for emission in lp.solve(basis, target, colors=colors).weights:
            found = cct_and_duv(emission)
            assert found is not None
            assert least < found[0] < most, (colors, found)


def test_the_answer_says_how_it_was_found(make_basis: Any, tmp_path: Any):
    basis = _basis(make_basis)
    lighting = lp.solve(basis, _paint(basis, over_look=True)).lighting
    lp.write_lighting(tmp_path / "a.json", lighting)
    certificate = lp.read_lighting(tmp_path / "a.json").certificate
    assert (certificate.hold, certificate.colors) == (DEFAULT_HOLD, "gentle")
