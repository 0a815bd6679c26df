"""How far an answer looks from what was painted, where, and why."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from texel_grid import texel_names

from lightpaint.basis.planes import MemoryPlanes
from lightpaint.colour.color import delta_e, luminance
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.images.object_map import Objects
from lightpaint.lighting.analysis.answer_analysis import analyse
from lightpaint.lighting.analysis.appearance import display_difference
from lightpaint.lighting.analysis.appearance.answer_appearance import (
    CLOSE,
    Appearance,
    compare_appearance,
    with_undetermined,
)
from lightpaint.lighting.analysis.appearance.display_difference import (
    PaintComparison,
    unpainted_change,
)
from lightpaint.lighting.analysis.appearance.pixel_sample import PixelSample
from lightpaint.lighting.analysis.noise.uncertainty import error_bars
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.report.verdict_sentences import headline
from lightpaint.target.painted_target import Target, Wish

SIZE = (24, 48)


def _left_and_right(make_basis: Any, *, spill: float = 0.0, noise: float = 0.0) -> Any:
    """A light for each half of the picture, of which a share falls on the other."""
    images = np.full((2, *SIZE, 3), spill)
    images[0, :, :24] = images[1, :, 24:] = 1
    grain = np.random.default_rng(2).normal(0, noise, (2, *images.shape))
    return make_basis(
        images=images + grain[0],
        half_differences=grain[1],
        names=["left", "right"],
        emission=[[0.2] * 3] * 2,
    )


def _paint_over(look: Any, region: Any, color: Any, *, alpha: float = 1.0) -> Target:
    """Painted over the current look, through a display."""
    image, importance = look.copy(), np.zeros(look.shape[:2], np.float32)
    image[region], importance[region] = color, alpha
    painted = Target.of(image, importance, name="painting")
    return replace(painted, over_look=True, through_view=True, transform=ViewTransform())


def _look(basis: Any) -> Any:
    return basis.mix(basis.current_weights)


def test_the_mean_is_over_the_paint_weighted_and_against_the_paint(make_basis: Any):
    """Whatever the solve held: in closed form."""
    basis = _left_and_right(make_basis)
    region = (slice(None), slice(0, 24))
    target = _paint_over(_look(basis), region, (0.5, 0.4, 0.3))
    target.importance[:12, :24] = 0.25
    target.image[:12, :24] = 0.6
    solution = solve(basis, target, constraints=Constraints.of({"left": {"lock": True}}))
    predicted = combine(basis, solution.lighting).image
    np.testing.assert_allclose(predicted, 0.2, rtol=1e-6)
    upper, lower = (
        float(delta_e(np.array(painted), np.full(3, 0.2)))
        for painted in ((0.6, 0.6, 0.6), (0.5, 0.4, 0.3))
    )
    appearance = compare_appearance(solution)
    assert appearance.delta_e == pytest.approx((0.25 * upper + lower) / 1.25, rel=1e-5)
    assert appearance.requested_change == pytest.approx(appearance.delta_e, rel=1e-5)
    assert appearance.noise == 0


@pytest.mark.parametrize(("share", "hidden"), [(0.99, ()), (1.01, ("left",))])
def test_a_light_is_undetermined_where_its_error_may_be_all_that_is_missing(
    make_basis: Any, share: float, hidden: tuple[str, ...]
):
    """The light of `left` is 1 there at unit emission, so its error is that of its weight."""
    basis = _left_and_right(make_basis)
    target = _paint_over(_look(basis), (slice(None), slice(0, 24)), (0.5, 0.4, 0.3))
    solution = solve(basis, target, constraints=Constraints.of({"left": {"lock": True}}))
    appearance = compare_appearance(solution)
    missed = float(luminance(np.array([0.3, 0.2, 0.1])))
    bars = error_bars(solution)
    assert bars is not None
    half = np.array([[share * missed] * 3, [10.0] * 3])
    uncertain = replace(bars, interval=(solution.weights - half, solution.weights + half))
    assert with_undetermined(appearance, solution, uncertain).hidden_lights == hidden


@pytest.mark.parametrize(
    ("painted", "ends", "hidden"),
    [
        (0.8, (0.75, 1.1), ("left",)),
        (0.8, (0.85, 1.5), ()),
        (1.2, (0.5, 1.25), ("left",)),
        (1.2, (0.5, 1.1), ()),
    ],
)
def test_an_error_and_the_miss_that_it_explains_are_of_the_same_pixels_and_of_one_sign(
    make_basis: Any, painted: float, ends: tuple[float, float], hidden: tuple[str, ...]
):
    """A light of 1 is a fifth off: so is the block with most of the error, whose mean is .75.

    A block beside it, with less of the error, is brighter.
    """
    images = np.full((2, *SIZE, 3), 0.01)
    images[0, :8, :8], images[0, :8, :8:8], images[0, :8, 8:16] = 0, 6, 2
    basis = make_basis(images=images, names=["left", "right"], emission=[[1] * 3] * 2)
    image, everywhere = painted * basis.images[0] + basis.images[1], np.ones(SIZE, np.float32)
    locked = Constraints.of({"*": {"lock": True}})
    solution = solve(basis, Target("ball", image, everywhere, everything=True), constraints=locked)
    appearance, bars = compare_appearance(solution), error_bars(solution)
    assert appearance.place is not None
    assert appearance.place.box == (0, 0, 8, 8)
    assert appearance.place.reached[0] > 1.3
    assert bars is not None
    low, high = (np.full((2, 3), x) for x in ends)
    uncertain = replace(bars, interval=(low, high))
    assert with_undetermined(appearance, solution, uncertain).undetermined_lights == hidden


@pytest.mark.parametrize(("is_noisy", "hidden"), [(True, ("stray",)), (False, ())])
def test_a_light_of_stray_paths_may_reach_where_these_samples_found_none(
    make_basis: Any, is_noisy: bool, hidden: tuple[str, ...]
):
    """Single paths of it are as bright as 1 in a pixel, so that 3 of 64 pixels may lack them."""
    images = np.zeros((2, *SIZE, 3))
    images[0] = 0.1
    images[1, ::3, 9::5] = 1
    half_differences = np.zeros(images.shape)
    half_differences[1] = images[1] * is_noisy
    basis = make_basis(
        images=images,
        half_differences=half_differences,
        names=["even", "stray"],
        emission=[[1] * 3] * 2,
    )
    painting = basis.images[0].copy()
    painting[:8, :8] *= 2
    everywhere = np.ones(SIZE, np.float32)
    target = Target("place", painting, everywhere, everything=True)
    solution = solve(basis, target, constraints=Constraints.of({"*": {"lock": True}}))
    appearance, bars = compare_appearance(solution), error_bars(solution)
    assert appearance.place is not None
    assert bars is not None
    box = (slice(None, 8), slice(None, 8))
    place = replace(appearance.place, box=(0, 0, 8, 8))
    appearance = replace(appearance, place=place, local_lights=(), area_lights=None)
    assert not basis.images[1][box].any()
    # What is missing there is .1: an error of 3 brings up to 3 * 3 / 64.
    half = np.array([[0.01] * 3, [3.0] * 3])
    uncertain = replace(
        bars,
        interval=(solution.weights - half, solution.weights + half),
        untold=np.array([False, True]),
    )
    assert with_undetermined(appearance, solution, uncertain).hidden_lights == hidden
    little = replace(uncertain, interval=(solution.weights - half / 3, solution.weights + half / 3))
    assert with_undetermined(appearance, solution, little).hidden_lights == ()


@pytest.mark.parametrize(("share", "hidden"), [(0.34, ("left",)), (0.32, ())])
def test_an_undetermined_light_that_hardly_reaches_the_place_is_not_the_reason(
    make_basis: Any, share: float, hidden: tuple[str, ...]
):
    """On a stage a spot beside the cyclorama was named, whose error brings a 400th of the miss."""
    basis = _left_and_right(make_basis)
    target = _paint_over(_look(basis), (slice(None), slice(0, 24)), (0.5, 0.4, 0.3))
    solution = solve(basis, target, constraints=Constraints.of({"left": {"lock": True}}))
    appearance, bars = compare_appearance(solution), error_bars(solution)
    assert bars is not None
    assert "left" in appearance.local_lights
    half = np.array([[share * 0.3] * 3, [10.0] * 3])  # most is missing in red: .5 − .2
    uncertain = replace(
        bars,
        interval=(solution.weights - half, solution.weights + half),
        untold=np.array([True, True]),
    )
    assert with_undetermined(appearance, solution, uncertain).hidden_lights == hidden


def test_paths_of_many_lights_are_found_in_one_walk(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
):
    noise = np.random.default_rng(3).normal(0, 0.01, (5, *SIZE, 3))
    basis = make_basis(n=5, size=SIZE, half_differences=noise)
    target = _paint_over(_look(basis), (slice(None), slice(0, 24)), 0.5)
    solution, lights = solve(basis, target), np.array([1, 3, 4])
    one_by_one = display_difference._light_of_paths(solution, lights)
    monkeypatch.setattr(display_difference, "MAX_SINGLE_PLANES", 2)
    found = display_difference._light_of_paths(solution, lights)
    assert found.min() > 0
    # Sums in another order.
    np.testing.assert_allclose(found, one_by_one, rtol=1e-12)


def test_only_planes_of_undetermined_lights_are_asked_for_their_paths(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
):
    noise = np.random.default_rng(3).normal(0, 0.01, (5, *SIZE, 3))
    basis = make_basis(n=5, size=SIZE, half_differences=noise)
    target = _paint_over(_look(basis), (slice(None), slice(0, 24)), 0.5)
    solution = solve(basis, target, constraints=Constraints.of({"*": {"lock": True}}))
    appearance, bars = compare_appearance(solution), error_bars(solution)
    assert appearance.place is not None
    assert bars is not None
    asked: list[int] = []
    whole = MemoryPlanes.plane

    def plane(planes: MemoryPlanes, k: int) -> Any:
        asked.append(k)
        return whole(planes, k)

    def pixels(*_: Any) -> Any:
        pytest.fail("pixels of all planes were read")

    monkeypatch.setattr(MemoryPlanes, "plane", plane)
    monkeypatch.setattr(MemoryPlanes, "pixels", pixels)
    with_undetermined(appearance, solution, replace(bars, untold=np.arange(5) == 3))
    assert asked == [3, 3]  # its light, and its noise


def test_a_look_at_the_exposure_and_through_the_view_of_the_painting(make_basis: Any):
    basis = _left_and_right(make_basis, spill=0.5)
    dark = make_basis(images=basis.images, names=basis.names, emission=[[0.2 / 64] * 3] * 2)
    bright = ViewTransform("srgb", 6.0)
    region = (slice(None), slice(0, 24))
    appearances = []
    for its_basis, scale, view in ((basis, 1, ViewTransform()), (dark, 64, bright)):
        target = replace(_paint_over(_look(its_basis), region, 0.5 / scale), transform=view)
        appearances.append(compare_appearance(solve(its_basis, target, constraints=_lock_all())))
    assert appearances[0].delta_e > 1
    assert appearances[1].delta_e == pytest.approx(appearances[0].delta_e, rel=1e-3)


def test_a_painting_that_is_made_is_close(make_basis: Any):
    basis = _left_and_right(make_basis)
    appearance = compare_appearance(
        solve(basis, _paint_over(_look(basis), (slice(None), slice(0, 24)), 0.5))
    )
    assert appearance.is_close
    assert not appearance.is_far
    assert appearance.delta_e < 0.1 < 10 < appearance.requested_change
    assert appearance.limit_groups == ()


def test_an_untouched_picture_is_close(make_basis: Any):
    basis = _left_and_right(make_basis)
    appearance = compare_appearance(
        solve(basis, _paint_over(_look(basis), (slice(None), slice(None)), 0.2))
    )
    assert appearance.is_close
    assert appearance.delta_e < 1e-3


@pytest.mark.parametrize(
    ("requested", "held_share"),
    [
        ({"hold": 50.0}, ("hold",)),
        ({"hold": 0.0, "constraints": {"*": {"limits": {"max": 0.21}}}}, ("constraints",)),
        ({"hold": 0.0}, ()),
    ],
)
def test_a_held_picture_never_meets_the_wish(make_basis: Any, requested: Any, held_share: Any):
    """A wish that is swallowed is not a success, and the verdict names what swallowed it."""
    basis = _left_and_right(make_basis, spill=0.5)
    target = _paint_over(_look(basis), (slice(8, 16), slice(4, 12)), 0.6)
    limits = Constraints.of(requested.get("constraints", {}))
    appearance = compare_appearance(
        solve(basis, target, hold=requested["hold"], constraints=limits)
    )
    assert appearance.is_close == (not held_share)
    assert appearance.limit_groups == held_share


def test_what_holds_whatever_else_is_let_go_comes_first(make_basis: Any):
    """Where all lights are locked it is of no use to let go of what was not painted."""
    basis = _left_and_right(make_basis, spill=0.5)
    target = _paint_over(_look(basis), (slice(8, 16), slice(4, 12)), 0.6)
    locked = Constraints.of({"*": {"lock": True}})
    assert compare_appearance(solve(basis, target, hold=50.0)).limit_groups == ("hold",)
    groups = compare_appearance(solve(basis, target, hold=50.0, constraints=locked)).limit_groups
    assert groups[0] == "constraints"
    assert "hold" in groups


def _four_quarters(make_basis: Any) -> Any:
    """A picture of four quarters, each with a light of its own, that spill a little."""
    images = np.full((4, *SIZE, 3), 0.02)
    for k in range(4):
        images[k, :, 12 * k : 12 * k + 12] = 1
    names = ["left", "annex_window", "annex_lamp", "right"]
    basis = make_basis(images=images, names=names, emission=[[0.2] * 3] * 4)
    index = np.repeat(np.arange(4, dtype=np.int32), 12)[None].repeat(SIZE[0], 0)
    return replace(basis, objects=Objects(index, ("wall", "annex", "niche", "door")))


@pytest.mark.nightly
def test_a_light_that_somebody_switched_off_goes_before_the_hold(make_basis: Any):
    """Two are off by hand, and one of them is all that is missed."""
    basis = _four_quarters(make_basis)
    target = _paint_over(_look(basis), (slice(None), slice(12, 24)), 0.5)
    switched_off = {name: {"off": True} for name in ("annex_window", "annex_lamp")}
    appearance = compare_appearance(
        solve(basis, target, hold=10.0, constraints=Constraints.of(switched_off))
    )
    first = appearance.reasons[0]
    assert (first.kind, first.names) == ("off", ("annex_window",))
    assert first.share > 0.8
    assert "annex_window is switched off" in headline(appearance)
    # What both are needed for is told of both, and of no other light that is locked.
    wide = _paint_over(_look(basis), (slice(None), slice(12, 36)), 0.5)
    constraints = Constraints.of(switched_off | {"left": {"lock": True}})
    first = compare_appearance(solve(basis, wide, hold=10.0, constraints=constraints)).reasons[0]
    assert first.names == ("annex_window", "annex_lamp")


def test_the_share_of_a_reason_is_what_the_fit_misses_no_more(make_basis: Any):
    """By a solve without it, of all pixels: the few that are looked at give the same."""
    basis = _four_quarters(make_basis)
    target = _paint_over(_look(basis), (slice(None), slice(12, 24)), 0.5)
    without_window = Constraints.of({"annex_window": {"off": True}})

    def missed_light(**options: Any) -> float:
        solution = solve(basis, target, **options)
        loss = solution.problem.loss.residual(basis.mix(solution.weights))
        return float((target.importance[..., None] * np.square(loss)).sum())

    current_miss, hold = (
        missed_light(constraints=without_window, hold=3.0),
        missed_light(constraints=without_window, hold=0.0),
    )
    miss_with_all = missed_light(hold=3.0)
    shares = {
        reason.kind: reason.share
        for reason in compare_appearance(
            solve(basis, target, constraints=without_window, hold=3.0)
        ).reasons
    }
    assert shares["off"] == pytest.approx(
        1 - miss_with_all / current_miss, abs=1e-3
    )  # of where its solve stops
    assert shares.get("hold", 0.0) == pytest.approx(1 - hold / current_miss, abs=0.05)


def test_what_counts_of_the_few_pixels_is_what_counts_of_all(make_basis: Any):
    """Of a large painting the rest is less than the paint, and of few pixels it was as much."""
    images = np.kron(_left_and_right(make_basis, spill=0.5).images, np.ones((1, 6, 6, 1)))
    basis = make_basis(images=images, names=["left", "right"], emission=[[0.2] * 3] * 2)
    look = _look(basis)
    target = _paint_over(look, (slice(None), slice(0, 240)), 0.6)
    solution = solve(basis, target, hold=3.0)
    sample = PixelSample.of(solution)
    weights = sample.solve((), sample.other_views)
    np.testing.assert_allclose(weights, solution.weights, rtol=2e-3)  # where both solves stop


def test_a_sample_asks_for_the_same_contrasts(make_basis: Any):
    """Places that ask for something of their own are found where pixels lie, not in a row."""
    yy, xx = np.mgrid[:40, :50] / 8
    images = np.stack([2 + np.sin(k + 1 + yy * k) * np.cos(k * xx + yy) for k in range(3)])
    basis = make_basis(images=images[..., None] * np.ones(3), emission=[[0.02] * 3] * 3)
    image = 0.5 * _look(basis)
    image[12:28, 12:28] *= 4
    target = _paint_over(image, (slice(None), slice(None)), image)
    solution = solve(basis, target, hold=0.0)
    sample = PixelSample.of(solution)
    weights = sample.solve((), sample.other_views)
    np.testing.assert_allclose(weights, solution.weights, rtol=2e-3)  # where both solves stop


@pytest.mark.parametrize("stops", [(1.0, 0.0), (0.8, -0.5)])
def test_a_weaker_hold_is_the_strongest_that_brings_half(make_basis: Any, stops: Any):
    """One light for both halves of the paint, and a window elsewhere that spills on it."""
    images = np.zeros((2, *SIZE, 3))
    images[0, :, :24] = 1
    images[1, :, 36:], images[1, :, :12] = 1, 0.3
    basis = make_basis(images=images, names=["spot", "window"], emission=[[0.1] * 3] * 2)
    index = np.zeros(SIZE, np.int32)
    index[:, 36:] = 1
    basis = replace(basis, objects=Objects(index, ("wall", "annex")))
    look = _look(basis)
    target = _paint_over(look, (slice(None), slice(0, 24)), look[:, :24] * 2.0 ** stops[1])
    target.image[:, :12] = look[:, :12] * 2.0 ** stops[0]
    target = replace(target, wishes=(Wish("paint", target.importance),))
    solution = solve(basis, target, hold=10.0)
    hold = next(x for x in compare_appearance(solution).reasons if x.kind == "hold")
    weaker = hold.loosening
    assert weaker is not None
    assert 0 < weaker.hold < 10
    sample = PixelSample.of(solution)
    tested_holds = (weaker.hold, 1.3 * weaker.hold)  # the steps of the search are finer than that
    removed, removed_less = (
        sample.share_of(sample.solve((), sample.other_views, hold=h)) for h in tested_holds
    )
    assert removed >= 0.5 * hold.share > removed_less
    assert weaker.share == pytest.approx(removed)
    # And it harms less than none would: of the window, which nobody painted.
    look_at = PaintComparison.of_problem(solution.problem)
    before = basis.mix(solution.weights)
    none = basis.mix(solve(basis, target, hold=0.0).weights)
    cost = unpainted_change(look_at, basis, target.importance > 0, before, none)
    assert cost is not None
    assert weaker.unpainted_change is not None
    assert weaker.unpainted_change.object == cost.object == "annex"
    assert weaker.unpainted_change.worst < cost.worst


def test_what_becomes_of_the_rest_is_seen(make_basis: Any):
    """In closed form; and what a person did to a light is not a harm of the answer."""
    basis = _four_quarters(make_basis)
    region = (slice(None), slice(0, 12))
    locked = Constraints.of({"*": {"lock": True}, "annex_window": {"lock": 0.4}})
    appearance = compare_appearance(
        solve(basis, _paint_over(_look(basis), region, 0.2), constraints=locked)
    )
    assert appearance.unpainted_change is not None
    assert appearance.unpainted_change.worst < 1e-3
    target = _paint_over(_look(basis), region, 0.5)
    solution = solve(basis, target, hold=0.0, constraints=Constraints.of({"left": {"off": True}}))
    appearance = compare_appearance(solution)
    mixed = solution.basis.mix(solution.weights)
    start = basis.current_weights * np.array([0, 1, 1, 1])[:, None]
    before = basis.mix(start)
    worst = max(float(delta_e(mixed[0, x], before[0, x])) for x in (12, 24, 36))
    assert appearance.unpainted_change is not None
    assert appearance.unpainted_change.worst == pytest.approx(worst, rel=1e-4)
    assert appearance.unpainted_change.delta_e == pytest.approx(
        np.mean([delta_e(mixed[0, x], before[0, x]) for x in (12, 24, 36)]), rel=1e-4
    )


@pytest.mark.nightly
def test_lights_that_are_held_back_are_known(make_basis: Any):
    basis = _left_and_right(make_basis, spill=0.5)
    target = _paint_over(_look(basis), (slice(8, 16), slice(4, 12)), 0.6)
    limits = Constraints.of({"left": {"limits": {"max": 0.21}}})
    appearance = compare_appearance(solve(basis, target, constraints=limits))
    assert appearance.held_lights == ("left",)
    assert {"left"} < set(appearance.local_lights)
    assert compare_appearance(solve(basis, target)).held_lights == ()
    # That lamps are white is asked of none of them.
    assert compare_appearance(solve(basis, target, colors="white")).held_lights == ()


def test_a_small_wish_that_is_swallowed_is_not_close(make_basis: Any):
    basis = _left_and_right(make_basis, spill=0.9)
    target = _paint_over(_look(basis), (slice(8, 12), slice(4, 8)), 0.415)
    appearance = compare_appearance(solve(basis, target, hold=100.0))
    assert appearance.error < CLOSE
    assert appearance.is_far
    assert not appearance.is_close


def test_colours_that_hold_are_told(make_basis: Any):
    """A white lamp cannot be green."""
    basis = _left_and_right(make_basis)
    target = _paint_over(_look(basis), (slice(None), slice(0, 24)), (0.1, 0.6, 0.1))
    appearance = compare_appearance(solve(basis, target, colors="white"))
    assert appearance.is_far
    assert appearance.limit_groups == ("colors",)
    assert compare_appearance(solve(basis, target, colors="free")).is_close


def test_where_no_light_gets(make_basis: Any):
    """The bottom right third is black whatever is on."""
    images = _left_and_right(make_basis).images.copy()
    images[:, 16:, 32:] = 0
    basis = make_basis(images=images, names=["left", "right"], emission=[[0.2] * 3] * 2)
    image = np.full((*SIZE, 3), 0.4, np.float32)
    appearance = compare_appearance(
        solve(basis, Target.of(image, name="even"), hold=0.0, space="display")
    )
    assert appearance.place is not None
    assert appearance.place.region == (2, 2)
    assert appearance.is_spot
    assert appearance.local_lights == ()
    top, left, bottom, right = appearance.place.box
    assert 16 <= top < bottom <= 24
    assert 32 <= left < right <= 48


def test_texels_of_an_image_light_a_place_together(make_basis: Any):
    """Each by itself is a sixteenth of its light."""
    names = texel_names("wall", (4, 4))
    basis = make_basis(
        images=np.full((16, *SIZE, 3), 1 / 16), names=names, emission=[[0.2] * 3] * 16
    )
    target = _paint_over(_look(basis), (slice(None), slice(0, 24)), 0.02)
    appearance = compare_appearance(solve(basis, target))
    assert appearance.place is not None
    assert set(appearance.local_lights) == set(names)


def test_noise_that_the_painting_does_not_share_is_told_from_a_miss(make_basis: Any):
    basis = _left_and_right(make_basis, noise=0.05)
    region = (slice(None), slice(0, 24))
    appearance = compare_appearance(solve(basis, _paint_over(_look(basis), region, 0.5)))
    assert appearance.delta_e > 2
    assert appearance.error < 0.4 * appearance.delta_e
    # A painting over the same samples shares it: then what is missed is no noise.
    look = _look(basis)
    target = _paint_over(look, region, 2.5 * look[region])
    appearance = compare_appearance(solve(basis, target, hold=0.0, constraints=_lock_all()))
    assert appearance.noise < 0.1 * appearance.delta_e


def test_what_is_missed_lies_on_an_object(make_basis: Any):
    """Painted brighter than anything gets on a statue, and nothing missed beside it."""
    images = _left_and_right(make_basis).images.copy()
    statue = (slice(4, 20), slice(14, 34))
    images[(slice(None), *statue)] = 0.01
    basis = make_basis(images=images, names=["left", "right"], emission=[[0.4] * 3] * 2)
    index = np.zeros(SIZE, np.int32)
    index[statue] = 1
    index[12:20, 14:34] = 2
    even_target = Target.of(np.full((*SIZE, 3), 0.4, np.float32), name="even")
    for names, place in (
        (("wall", "statue_body", "statue_head"), "statue"),
        (("wall", "statue", "statue"), "statue"),
        (("wall", "plinth", "statue"), ""),
        (("wall", "sphere", "sphere"), ""),
        (("room", "room", "room"), ""),
    ):
        basis_of_objects = replace(basis, objects=Objects(index, names))
        appearance = compare_appearance(solve(basis_of_objects, even_target))
        assert appearance.place is not None
        assert appearance.place.object == place


def test_a_miss_that_is_spread_is_on_nothing(make_basis: Any):
    """Half of it on each of two things."""
    images = _left_and_right(make_basis).images.copy()
    images[:, 8:16] = 0
    index = np.zeros(SIZE, np.int32)
    index[8:16, :24], index[8:16, 24:] = 1, 2
    basis = make_basis(images=images, names=["left", "right"], emission=[[0.4] * 3] * 2)
    basis = replace(basis, objects=Objects(index, ("wall", "bench", "vase")))
    even_target = Target.of(np.full((*SIZE, 3), 0.4, np.float32), name="even")
    appearance = compare_appearance(solve(basis, even_target))
    assert appearance.place is not None
    assert appearance.place.object == ""


@pytest.mark.parametrize("space", ["linear", "display"])
def test_another_view_that_holds_is_named(make_basis: Any, space: Any):
    """One lamp lights all three views alike, and one is to be dark."""
    views = [_basis_of_view(make_basis, name) for name in ("stalls", "balcony", "box")]
    levels = (0.8, 0.05, 0.8)
    targets = [_even_target(x) for x in levels]
    solution = solve(views, targets, space=space)
    stalls, balcony, _ = (compare_appearance(view) for view in solution.views)
    assert stalls.limit_groups == balcony.limit_groups == ("views",)
    assert stalls.limiting_views == ("balcony",)
    assert balcony.limiting_views == ("stalls", "box")
    # Views of one sensor go by their paintings.
    joint = solve([views[0]] * 3, targets, space=space)
    assert compare_appearance(joint.views[0]).limiting_views == ("0.05 painted",)


def test_what_holds_beside_other_views_is_told_apart(make_basis: Any):
    """A limit alone keeps both from being bright."""
    views = [_basis_of_view(make_basis, name) for name in ("stalls", "balcony")]
    targets = [_even_target(0.8)] * 2
    dim = Constraints.of({"lamp": {"limits": {"max": 0.1}}})
    for view in solve(views, targets, constraints=dim).views:
        appearance = compare_appearance(view)
        assert appearance.limit_groups == ("constraints",)
        assert appearance.limiting_views == ()
    for view in solve(views, targets).views:
        assert compare_appearance(view).limit_groups == ()


def _basis_of_view(make_basis: Any, sensor: str) -> Any:
    basis = make_basis(images=np.ones((1, *SIZE, 3)), names=["lamp"], emission=[[0.3] * 3])
    return replace(basis, origin=replace(basis.origin, sensor=sensor))


def _even_target(light: float) -> Target:
    """As a display shows it at its own exposure."""
    image = np.full((*SIZE, 3), light, np.float32)
    return replace(Target.of(image, name=f"{light:g} painted"), transform=ViewTransform())


def _lock_all() -> Constraints:
    return Constraints.of({"left": {"lock": True}, "right": {"lock": True}})


def test_words_do_not_depend_on_how_finely_it_is_rendered(make_basis: Any):
    """Beyond enough pixels every second one is looked at."""
    basis = _left_and_right(make_basis)
    target = _paint_over(_look(basis), (slice(None), slice(0, 24)), 0.5)
    large = make_basis(
        images=np.kron(basis.images, np.ones((1, 16, 16, 1))), emission=basis.current_weights
    )
    painted = replace(
        target,
        image=np.kron(target.image, np.ones((16, 16, 1), np.float32)),
        importance=np.kron(target.importance, np.ones((16, 16), np.float32)),
    )
    one, other = (
        compare_appearance(solve(b, t, hold=3.0, space="linear"))
        for b, t in ((basis, target), (large, painted))
    )
    assert isinstance(one, Appearance)
    assert other.delta_e == pytest.approx(one.delta_e, rel=1e-3)


def test_nothing_is_left_to_solve_where_all_is_held(make_basis: Any):
    """Of a basis with noise, whose errors are asked for: no direction is left that they have."""
    basis = _left_and_right(make_basis, noise=0.01)
    target = _paint_over(_look(basis), np.s_[:, :24], 0.5)
    locks = Constraints.of({"*": {"lock": 0.3}})
    [analysis] = analyse(solve(basis, target, constraints=locks))
    np.testing.assert_allclose(analysis.solution.weights, 0.3)
