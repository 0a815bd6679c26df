"""Error bars against what noise really does, and the steps that take some of it back."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scipy
from nightly import nightly

from lightpaint.basis.light_basis import Basis, Origin
from lightpaint.basis.lights import BasisLight
from lightpaint.errors import BasisError, SizeError
from lightpaint.images.estimate import Estimate
from lightpaint.lighting.analysis.noise import uncertainty
from lightpaint.lighting.analysis.noise.basis_noise import denoised_matrix, pseudo_inverse
from lightpaint.lighting.analysis.noise.dominant_pixels import NORMAL_95
from lightpaint.lighting.analysis.noise.noise_correction import correct_noise, refine
from lightpaint.lighting.analysis.noise.uncertainty import (
    error_bars,
    weakest_matrix,
    with_error_bars,
)
from lightpaint.lighting.analysis.noise.weight_directions import _one_sided
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.default_solve import solve
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.progress import stage
from lightpaint.target.painted_target import Target

SIZE = (24, 24)
SEEDS = 40


def _target(image: Any) -> Target:
    return Target("t", image.astype(np.float32), np.ones(SIZE, np.float32), everything=True)


def _pools(n: int = 5) -> Any:
    """Overlapping pools of light, (n, h, w, 3)."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] / SIZE[0]
    places = np.random.default_rng(0).random((n, 2))
    pools = [np.exp(-((x - a) ** 2 + (y - b) ** 2) / 0.15) for a, b in places]
    return np.stack(pools)[..., None] * np.ones(3)


def _painting(clean: Any) -> Target:
    """Something no mix of the pools is: half dark, reddish, and lit from below."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1], :1][:2]
    image = np.einsum("n,nhwc->hwc", [1, 0.5, 0, 0.3, 0], clean)
    image = image * (x > 9) * np.array([1, 0.7, 0.3]) + 0.2 * y / SIZE[0]
    return _target(image)


def _noisy_halves(clean: Any, sigma: float, rng: np.random.Generator) -> tuple[Any, Any]:
    """Mean and half difference of two halves: skewed noise, the same in all channels."""

    def half() -> Any:
        error = rng.exponential(1, (*clean.shape[:-1], 1)) - 1
        return clean * (1 + sigma * np.sqrt(2) * error)

    a, b = half(), half()
    return (a + b) / 2, (a - b) / 2


def _tie_channels(basis: Basis, *dimmed: int) -> Basis:
    lights = [replace(x, is_scalar=k in dimmed) for k, x in enumerate(basis.lights)]
    return replace(basis, lights=tuple(lights))


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("sigma", "dimmed"), [(0.05, ()), (0.2, ()), (0.2, (0, 2)), (0.5, (1,)), (0.5, ())]
)
def test_intervals_hold_the_answer_without_noise(
    make_basis: Any, sigma: float, dimmed: tuple[int, ...]
):
    """95 % intervals, over seeds: those of lights that are on, and of those that are off."""
    clean = _pools()
    target = _painting(clean)
    quiet = _tie_channels(make_basis(images=clean), *dimmed)
    truth = solve(quiet, target).lighting.weights_for(quiet)
    coverages, misses, stated_errors = [], [], []
    for seed in range(SEEDS):
        images, halves = _noisy_halves(clean, sigma, np.random.default_rng(seed))
        basis = _tie_channels(make_basis(images=images, half_differences=halves), *dimmed)
        bars = error_bars(solve(basis, target))
        low, high = bars.interval
        coverages.append((low <= truth + 1e-9) & (truth <= high + 1e-9))
        misses.append(np.square(bars.weights - truth).mean())
        stated_errors.append(np.square(bars.standard_error).mean())
    # Where more than half of what a light does alone is noise, it may be anything: they are wide.
    assert 0.85 <= np.mean(coverages) <= 0.99
    # So is each light by itself, unless half of M is noise and more than that is guessed.
    if sigma < 0.5:
        assert np.mean(coverages, axis=0).min() > 0.8
    # The errors are as large as they say.
    ratio = np.sqrt(np.mean(stated_errors) / np.mean(misses))
    assert 0.6 < ratio < 1.4


def _factor(values: Any, half: Any, own: float = 0.0) -> Any:
    """A share of each pixel and the rest of the other one of its pair, where they are alike.

    values, half: (…, pixels, channels). The last of an odd number takes the pixel before it.
    """
    pixels = values.shape[-2]
    beside = values[..., [min(k ^ 1, pixels - 1 - (k ^ 1 >= pixels)) for k in range(pixels)], :]
    is_alike = np.abs(beside - values) <= 1.5 * np.abs(half)
    return np.where(is_alike, own * values + (1 - own) * beside, values)


def _push(images: Any, halves: Any, residual: Any, noise: Any, own: float = 0.0) -> Any:
    """The noise of the gradient by hand, (n, pixels, channels), of arrays (…, pixels, channels)."""
    return halves * _factor(residual, noise, own) - _factor(images, halves, own) * noise


def test_one_light_by_hand(make_basis: Any):
    """w = b / M of one light: δw = Σ (h r̃ − Φ̃ w h) / M, and the bias N w / M."""
    rng = np.random.default_rng(1)
    image = 1 + rng.random((1, *SIZE, 3))
    half = rng.normal(0, 0.1, image.shape)
    basis = make_basis(images=image, half_differences=half)
    painted = rng.random((*SIZE, 3))
    solution = solve(basis, _target(painted))
    bars = error_bars(solution)
    M, w = np.square(image[0]).sum((0, 1)), bars.weights[0]
    arrays = (image[0], half[0], painted - w * image[0], w * half[0])
    push = _push(*(x.reshape(-1, 3) for x in arrays))
    np.testing.assert_allclose(bars.scatter[0], np.sqrt(np.square(push).sum(0)) / M, rtol=1e-4)
    power = np.square(half[0]).sum((0, 1))
    np.testing.assert_allclose(bars.bias[0], w * power / (M - power), rtol=1e-4)
    np.testing.assert_allclose(
        bars.objective_noise, (np.square(w) * np.square(half[0])).sum((0, 1)), rtol=1e-4
    )
    # Without all of the noise the answer moves by just that bias.
    corrected = correct_noise(solution, share=1.0)
    np.testing.assert_allclose(
        corrected.lighting.weights_for(basis)[0], w + bars.bias[0], rtol=1e-4
    )
    np.testing.assert_allclose(error_bars(corrected).bias, 0, atol=1e-5)


@pytest.mark.parametrize("sigma", [0.02, 0.1, 0.5])
def test_an_interval_has_95_percent_around_the_answer_without_bias(make_basis: Any, sigma: float):
    """And includes the answer, however far bias has moved it."""
    rng = np.random.default_rng(1)
    image = 1 + rng.random((1, *SIZE, 3))
    half = rng.normal(0, sigma, image.shape)
    basis = make_basis(images=image, half_differences=half)
    solution = solve(basis, _target(1.4 * image[0]), literal=True)
    bars = error_bars(solution, with_painting=False)
    center = bars.weights + bars.bias
    # That answer scatters by M − N, and the solved one by M.
    M, N = (np.square(x[0]).sum((0, 1)) for x in (image, half))
    scatter = bars.scatter[0] * M / (M - N)
    below, above = ((end - center)[0] / scatter for end in bars.interval)
    mass = scipy.special.ndtr(above) - scipy.special.ndtr(below)
    # Student's t of so few pixels is wider by half a percent.
    np.testing.assert_allclose(mass, 0.95, atol=4e-3)
    assert (below <= -bars.bias[0] / scatter + 1e-9).all()


def test_errors_of_poses_add_to_the_scatter(make_basis: Any):
    """Independent of the basis's noise: the squares add up, in intervals, too."""
    clean = _pools()
    images, halves = _noisy_halves(clean, 0.1, np.random.default_rng(1))
    basis = make_basis(images=images, half_differences=halves, names="abcde")
    solution = solve(basis, _painting(clean))
    alone, both = (error_bars(solution, level_errors=x) for x in ((), [("a", (0.1, 0.2, 0.3))]))
    by_poses = np.zeros((5, 3))
    by_poses[0] = solution.weights[0] * [0.1, 0.2, 0.3]
    assert (solution.weights[0] > 0).all()
    np.testing.assert_allclose(both.scatter, np.hypot(alone.scatter, by_poses), rtol=1e-12)
    (low, _), (both_low, _) = alone.interval, both.interval
    np.testing.assert_array_equal(both_low[1:], low[1:])
    inside = both_low[0] > 0
    unbiased = (solution.weights + alone.bias)[0]
    rise = np.hypot(unbiased - low[0], NORMAL_95 * by_poses[0])
    np.testing.assert_allclose((unbiased - both_low[0])[inside], rise[inside], rtol=1e-9)
    assert inside.any()


@pytest.mark.nightly
def test_intervals_are_those_of_student_where_few_pixels_have_noise(make_basis: Any):
    """Three half differences are three degrees of freedom: 1.96 standard errors hold in 85 %."""
    image, target = np.ones((1, *SIZE, 3)), _target(np.full((*SIZE, 3), 0.5))
    image[0, :, 12:] = 2
    clean = solve(make_basis(images=image), target).weights
    coverages, normal_coverages = [], []
    for seed in range(200):
        noise = np.zeros((2, *image.shape))
        noise[..., 5:8, 3, :] = np.random.default_rng(seed).normal(0, 0.1, (2, 1, 3, 3))
        half = (noise[0] - noise[1]) / 2
        basis = make_basis(images=image + noise.mean(axis=0), half_differences=half)
        # Noise of the painting, of which there is none here, would be another error of the answer.
        bars = error_bars(solve(basis, target), with_painting=False)
        low, high = bars.interval
        coverages.append((low <= clean) & (clean <= high))
        normal_coverages.append(np.abs(bars.weights - clean) <= NORMAL_95 * bars.standard_error)
    # The channels of 200 seeds are 600 cases, of whose share 0.009 is a standard error.
    assert np.mean(normal_coverages) == pytest.approx(
        2 * scipy.stats.t.cdf(1.96, 3) - 1, abs=4 * 0.015
    )
    assert 0.95 - 3 * 0.009 <= np.mean(coverages) <= 0.985


def test_without_noise_nothing_is_uncertain(make_basis: Any):
    basis = make_basis(4, SIZE)
    solution = solve(basis, _painting(_pools()))
    bars = error_bars(solution)
    assert bars.scatter.max() == 0
    np.testing.assert_allclose(bars.bias, 0, atol=1e-5)
    errors = [x.standard_error for x in with_error_bars(solution, bars).lighting.lights]
    assert None not in errors


def test_an_estimate_below_zero_is_nothing_to_gain(make_basis: Any):
    """As it was on a shipped painting, which was told as a warning of NumPy's."""
    bars = error_bars(solve(make_basis(2, (16, 20)), Target.of(np.ones((16, 20, 3)))))
    assert bars is not None
    assert replace(bars, excess=np.array([-0.1, 0.01, 0.01])).relative_excess == 0


def test_kept_and_unreached_lights_have_no_error(make_basis: Any):
    clean = _pools(3)
    clean[2] = 0
    images, halves = _noisy_halves(clean, 0.2, np.random.default_rng(0))
    basis = make_basis(
        images=images, half_differences=halves, emission=[[1, 1, 1], [1, 0, 0], [2, 2, 2]]
    )
    lights = (replace(basis.lights[0], is_fixed=True), *basis.lights[1:])
    basis = replace(basis, lights=lights)
    solution = solve(basis, _target(clean[0] + 0.5 * clean[1]))
    bars = error_bars(solution)
    assert not bars.standard_error[0].any()
    assert bars.standard_error[1].all()
    # Of what reaches nothing nothing is known: that is not the same as no error.
    assert np.isnan(bars.standard_error[2]).all()
    assert np.isnan(bars.interval)[:, 2].all()
    assert not np.isnan(bars.interval)[:, :2].any()
    lighting = with_error_bars(solution, bars).lighting
    assert [x.standard_error is None for x in lighting.lights] == [True, False, True]


@pytest.mark.nightly
@pytest.mark.parametrize("mixed_sigma", [0.05, 0.3, 3.0])
def test_a_refinement_comes_closer(make_basis: Any, mixed_sigma: float):
    """On average over seeds; a render of the mix that is nothing but noise does no harm."""
    clean = _pools()
    target = _painting(clean)
    quiet = make_basis(images=clean)
    best = solve(quiet, target)
    excess: dict[str, list[float]] = {"plain": [], "corrected": [], "refined": []}
    coverages, shares = [], []
    truth = best.lighting.weights_for(quiet)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        images, halves = _noisy_halves(clean, 0.5, rng)
        basis = make_basis(images=images, half_differences=halves)
        plain = solve(basis, target)
        weights = plain.lighting.weights_for(basis)
        mix = np.einsum("nc,nhwc->hwc", weights, clean)
        image, half = _noisy_halves(mix, mixed_sigma, rng)
        mixed = Estimate(image.astype(np.float32), half.astype(np.float32))
        refined = refine(plain, mixed)
        assert refined.problem.refinement is not None
        shares.append(refined.problem.refinement.share)
        solutions = {"plain": plain, "corrected": correct_noise(plain), "refined": refined}
        for name, solution in solutions.items():
            w = solution.lighting.weights_for(basis)
            value = best.equations.objective(w) - best.equations.objective(truth)
            excess[name].append(float(value.sum()))
        low, high = error_bars(refined).interval
        coverages.append((low <= truth + 1e-9) & (truth <= high + 1e-9))
    mean = {name: np.mean(values) for name, values in excess.items()}
    assert mean["corrected"] < 0.9 * mean["plain"]
    assert mean["refined"] < {0.05: 0.6, 0.3: 0.75, 3.0: 1.1}[mixed_sigma] * mean["plain"]
    assert np.mean(shares) == pytest.approx({0.05: 1, 0.3: 0.9, 3.0: 0.25}[mixed_sigma], abs=0.15)
    assert 0.8 <= np.mean(coverages) <= 1


def test_the_render_of_the_mix_has_the_size_of_the_basis(make_basis: Any):
    basis = make_basis(2, SIZE)
    solution = solve(basis, _painting(_pools()))
    small = np.zeros((12, 12, 3), np.float32)
    with pytest.raises(SizeError, match="render of the mix is 12x12 but the basis is 24x24"):
        refine(solution, Estimate(small, small))


def test_what_is_not_known_is_not_taken_for_no_noise(make_basis: Any):
    """A render beside noise of which nothing is known would be thrown away in silence."""
    basis = make_basis(2, SIZE)
    basis = replace(basis, origin=replace(basis.origin, halves=(0, 0)))
    solution = solve(basis, _painting(_pools()))
    image = 1.3 * basis.mix(solution.lighting.weights_for(basis))
    assert error_bars(solution) is None
    with pytest.raises(BasisError, match="is unknown, so"):
        refine(solution, Estimate(image, 0.05 * image))
    with pytest.raises(BasisError, match="is unknown, so"):
        correct_noise(solution)


def test_a_light_that_the_paint_hardly_shows_is_undetermined_alone(make_basis: Any) -> None:
    """Two lights shine elsewhere, and a little of them, with as much noise, falls on the paint."""
    clean, rng = _pools(), np.random.default_rng(3)
    images, halves = _noisy_halves(clean, 0.02, rng)
    mask = np.zeros(SIZE, np.float32)
    mask[:, :12] = 1
    for k in (3, 4):
        images[k, :, :12] *= 1e-3
        halves[k, :, :12] *= 1e-3
        images[k, :, :12] += 2e-3 * rng.exponential(1, (24, 12, 1))
        halves[k, :, :12] += 2e-3 * rng.normal(size=(24, 12, 1))
    image = np.einsum("n,nhwc->hwc", [1, 0.5, 0.8], clean[:3])
    target = Target("t", image.astype(np.float32), mask, everything=False)
    basis = make_basis(images=images, half_differences=halves)
    bars = error_bars(solve(basis, target))
    names = [light.name for light in basis.lights]
    locked = Constraints.of(light={name: {"lock": True} for name in names[3:]})
    alone = error_bars(solve(basis, target, constraints=locked))
    # The hidden lights, off or twice as bright, add as much again.
    np.testing.assert_allclose(bars.scatter[:3], alone.scatter[:3], rtol=2.0)
    assert bars.untold.tolist() == [False, False, False, True, True]


@pytest.mark.parametrize("seed", range(4))
def test_lights_by_stray_paths_are_undetermined_alone(make_basis: Any, seed: int) -> None:
    """Two lights shine elsewhere, and the paint shows a few stray paths of them, one in a pixel."""
    clean, rng = _pools(), np.random.default_rng(seed)
    images, halves = _noisy_halves(clean, 0.02, rng)
    mask = np.zeros(SIZE, np.float32)
    mask[:, :12] = 1
    for k in (3, 4):
        is_hit = rng.random((SIZE[0], 12, 1)) < 0.02
        path = 1e-3 * is_hit * rng.exponential(1, is_hit.shape)
        images[k, :, :12] = path
        halves[k, :, :12] = path * rng.choice((-1, 1), is_hit.shape)
    image = np.einsum("n,nhwc->hwc", [1, 0.5, 0.8], clean[:3])
    # What no light makes pulls at them, too.
    image += 0.03 * rng.choice((-1, 1), (*SIZE, 1))
    target = Target("t", image.astype(np.float32), mask, everything=False)
    basis = make_basis(images=images, half_differences=halves)
    names = [light.name for light in basis.lights]
    locked = Constraints.of(light={name: {"lock": True} for name in names[3:]})
    widths = []
    for constraints in (None, locked):
        bars = error_bars(solve(basis, target, constraints=constraints))
        assert bars is not None
        assert not bars.untold[:3].any()
        low, high = bars.interval
        widths.append((high - low)[:3])
    # At ten times their levels the two would add as much as these intervals are wide.
    assert (widths[0] < 3 * widths[1]).all()


def test_noise_of_a_render_that_is_the_painting_is_in_the_intervals(make_basis: Any) -> None:
    """Over seeds of the painting: its scatter is what is stated, and the intervals hold."""
    clean, rng = _pools(), np.random.default_rng(5)
    images, halves = _noisy_halves(clean, 1e-3, rng)
    basis = make_basis(images=images, half_differences=halves)
    truth = np.array([1, 0.5, 0.8, 0.3, 1.2])
    mixed = np.einsum("n,nhwc->hwc", truth, clean)
    solved, stated, held, basis_alone = [], [], [], []
    for _ in range(SEEDS):
        painting = mixed + 0.02 * rng.normal(size=(*SIZE, 1))
        bars = error_bars(solve(basis, _target(painting)))
        low, high = bars.interval
        solved.append(bars.weights)
        stated.append(bars.standard_error)
        basis_alone.append(bars.scatter)
        held.append((low <= truth[:, None]) & (truth[:, None] <= high))
    scatter = np.std(solved, axis=0)
    # The scatter of so many seeds is known to 11 %; what is stated is good to a third.
    np.testing.assert_allclose(np.mean(stated, axis=0), scatter, rtol=0.5)
    assert np.mean(basis_alone) < 0.2 * scatter.mean()
    assert np.mean(held) >= 0.88


def test_a_smooth_painting_that_lights_miss_has_no_noise(make_basis: Any) -> None:
    clean = _pools()
    images, halves = _noisy_halves(clean, 0.05, np.random.default_rng(1))
    bars = error_bars(solve(make_basis(images=images, half_differences=halves), _painting(clean)))
    assert (bars.painting_scatter <= 0.2 * bars.scatter.max()).all()


def test_a_noiseless_refinement_stays_where_it_is(make_basis: Any):
    basis = make_basis(4, SIZE)
    solution = solve(basis, _painting(_pools()))
    image = basis.mix(solution.lighting.weights_for(basis))
    second = refine(solution, Estimate(image, 0 * image))
    weights = partial(Basis.mix, basis)
    np.testing.assert_allclose(
        weights(second.lighting.weights_for(basis)), image, rtol=1e-4, atol=1e-5
    )


def test_error_bars_of_thousands_of_lights_say_first_how_long_they_take(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    remarks: list[Any] = []

    class Remarks:
        def __call__(self, *_: Any) -> None:
            pass

        def say(self, text: str) -> None:
            remarks.append(text)

    rng = np.random.default_rng(0)
    basis = make_basis(2, (6, 8), half_differences=rng.normal(0, 0.01, (2, 6, 8, 3)))
    solution = solve(basis, Target("t", basis.current_look, np.ones((6, 8)), everything=True))
    seconds = iter([0.1, 3.0])
    monkeypatch.setattr(uncertainty, "product_s", lambda _: next(seconds))
    for limit in (2, 1, 1):
        monkeypatch.setattr(uncertainty, "QUICK_MATRIX", limit)
        with stage("error bars", Remarks()):
            error_bars(solution)
    assert remarks == ["error bars take 9 min or more (error_bars=False skips them)"]


def test_pseudo_inverse_leaves_out_what_changes_nothing():
    M = np.diag([1e8, 1e-8, 0.0])
    np.testing.assert_allclose(pseudo_inverse(M), np.diag([1e-8, 1e8, 0]), rtol=1e-12)


#: What is asked, and of which lights: of "color" one that is on, for one that is off moves nothing.
ASKED: dict[str, tuple[dict[str, Any], str]] = {
    "lock": ({"lights": {"a": {"lock": 0.4}}}, "a"),
    "color": ({"lights": {"a": {"limits": {"max": 2.0}, "color": "3200K"}}}, "a"),
    "at a limit": ({"lights": {"a": {"limits": {"max": 0.3}}}}, "a"),
    "tie": ({"tie": [["a", "b", "c", "d", "e"]]}, "abcde"),
    "two ties": ({"tie": [["a", "b"], ["c", "d", "e"]]}, "abcde"),
    "sparse": ({"sparse": 3}, "abcde"),
    "prefer_current": ({"prefer_current": 0.1}, "abcde"),
}


@pytest.mark.parametrize(
    "name", [name if name in ("at a limit", "tie") else nightly(name) for name in ASKED]
)
def test_error_bars_under_constraints(make_basis: Any, name: str) -> None:
    """Of each light of which something is asked, against the spread over seeds."""
    clean = _pools()
    words, lights = ASKED[name]
    others = {key: value for key, value in words.items() if key != "lights"}
    constraints = Constraints.of(words.get("lights", {}), **others)
    target = _painting(clean)
    solved, errors, ends = [], [], []
    for seed in range(SEEDS):
        images, halves = _noisy_halves(clean, 0.1, np.random.default_rng(seed))
        basis = make_basis(
            images=images, half_differences=halves, names="abcde", emission=np.ones((5, 3))
        )
        solution = solve(basis, target, constraints=constraints)
        solved.append(solution.lighting.weights_for(basis))
        bars = error_bars(solution)
        errors.append(bars.scatter)
        ends.append([end == solved[-1] for end in bars.interval])
    spread, stated = np.std(solved, axis=0, ddof=1), np.sqrt(np.mean(np.square(errors), axis=0))
    is_held = spread < 1e-9
    # What does not move is at a bound, or locked.
    assert np.any(ends, axis=(0, 1))[is_held].all()
    assert name != "lock" or not stated[0].any()
    indices = ["abcde".index(light) for light in lights]
    # Lights that go off in some seeds have an error of which a half is cut off.
    always_on = (np.array(solved) > 0).all(axis=0) & ~is_held
    always_on[[k for k in range(5) if k not in indices]] = False
    assert always_on.any() != (name == "lock")
    ratio = stated[always_on] / spread[always_on]
    # A standard deviation from forty seeds is off by a ninth: three of these.
    np.testing.assert_allclose(ratio, 1, atol=0.34)


#: Of lights a and b, what is asked and the directions of the weights, (2, 3) each, that it leaves.
SPANNING: dict[str, tuple[dict[str, Any], Any]] = {
    "color": (
        {"lights": {"a": {"color": [1, 0.5, 0.2]}, "b": {"lock": 0.2}}},
        [[[1, 0.5, 0.2], [0, 0, 0]]],
    ),
    "tie": ({"tie": [["a", "b"]]}, [[[1, 1, 1], [1, 1, 1]]]),
    # Those along which the luminance stays at its limit.
    "limit": (
        {"lights": {"a": {"limits": {"max": 0.8}}, "b": {"off": True}}},
        [[[0.7152, -0.2126, 0], [0, 0, 0]], [[0, 0.0722, -0.7152], [0, 0, 0]]],
    ),
}


@pytest.mark.parametrize("name", SPANNING)
def test_what_one_unknown_moves_in_several_channels_errs_together(make_basis: Any, name: str):
    """By hand: each pixel's own push on the unknowns, of all channels, and the sum of squares.

    One path carries all three channels, so that the noise of one is that of the others, too.
    """
    words, directions = SPANNING[name]
    rng = np.random.default_rng(4)
    images = 1 + rng.random((2, *SIZE, 3))
    halves = 0.1 * rng.normal(size=(2, *SIZE, 1)) * images
    basis = make_basis(images=images, half_differences=halves, names="ab", emission=np.ones((2, 3)))
    painted = 1.4 + rng.random((*SIZE, 3))
    others = {key: value for key, value in words.items() if key != "lights"}
    constraints = Constraints.of(words.get("lights", {}), **others)
    solution = solve(basis, _target(painted), constraints=constraints)
    w = solution.lighting.weights_for(basis)
    assert w[0].all()
    residual = painted - np.einsum("nhwc,nc->hwc", images, w)
    noise = np.einsum("nhwc,nc->hwc", halves, w)
    # (pixels, lights, channels), and M as (lights, channels, lights, channels).
    arrays = (x.reshape(*x.shape[:-3], -1, 3) for x in (images, halves, residual, noise))
    push = np.moveaxis(_push(*arrays), 0, 1)
    M = np.einsum("ihwc,jhwc,cd->icjd", images, images, np.eye(3))
    direction_array = np.array(directions)
    stiffness = np.einsum("kic,icjd,ljd->kl", direction_array, M, direction_array)
    steps = np.linalg.solve(stiffness, np.einsum("kic,pic->kp", direction_array, push))
    expected = np.sqrt(np.square(np.einsum("kic,kp->icp", direction_array, steps)).sum(axis=-1))
    np.testing.assert_allclose(error_bars(solution).scatter, expected, rtol=1e-4, atol=1e-9)


#: As `SPANNING`, where the answer moves by more than one unknown's own channel, and where not.
MOVING: dict[str, tuple[dict[str, Any], Any]] = {
    "lock": (
        {"lights": {"b": {"lock": 3.0}}},
        [[axis, [0, 0, 0]] for axis in np.eye(3)],
    ),
    "scalar": ({}, [[[1, 1, 1], [0, 0, 0]], [[0, 0, 0], [1, 1, 1]]]),
    **SPANNING,
}


@pytest.mark.parametrize("sigma", [0.1, 0.3])
@pytest.mark.parametrize("name", MOVING)
def test_what_to_believe_is_decided_among_what_may_move(make_basis: Any, name: str, sigma: float):
    """By hand: the excess that is expected of shares of the correction and of a render's step."""
    words, directions = MOVING[name]
    rng = np.random.default_rng(5)
    # Few pixels count, so that neither scatter nor bias is all.
    importance = np.zeros(SIZE, np.float32)
    importance[:3, :3] = 1
    images = 1 + rng.random((2, *SIZE, 3))
    images[0, :, ::2] *= 0.2
    images[1, :, 1::2] *= 0.2
    halves = sigma * rng.normal(size=(2, *SIZE, 1)) * images
    basis = make_basis(images=images, half_differences=halves, names="ab", emission=np.ones((2, 3)))
    if name == "scalar":
        basis = _tie_channels(basis, 0, 1)
    others = {key: value for key, value in words.items() if key != "lights"}
    constraints = Constraints.of(words.get("lights", {}), **others)
    freedom = {"lock": 3, "scalar": 3, "color": 0.2, "tie": 1, "limit": 0}[name]
    painted = np.einsum("nhwc,n->hwc", images, [1, freedom]) + 0.2 * rng.random((*SIZE, 3))
    target = Target("t", painted.astype(np.float32), importance, everything=False)
    solution = solve(basis, target, constraints=constraints)
    w = solution.lighting.weights_for(basis)
    direction_array, is_counted = np.array(directions), importance > 0
    assert all(w[direction != 0].all() for direction in direction_array)

    f, h = images[:, is_counted], halves[:, is_counted]
    residual, noise = (
        painted[is_counted] - np.einsum("npc,nc->pc", f, w),
        np.einsum("npc,nc->pc", h, w),
    )
    M, N = (
        np.einsum("kic,ipc,jpc,ljc->kl", direction_array, x, x, direction_array) for x in (f, h)
    )
    # As if all of the noise were taken out.
    push = np.einsum("kic,ipc->kp", direction_array, _push(f, h, residual, noise, own=0))
    lacking = np.einsum("kic,ipc,pc->k", direction_array, h, noise)
    bias = np.linalg.solve(M - N, lacking)
    assert np.linalg.eigvals(np.linalg.solve(M, N)).max() < 0.5

    def excess(share: float) -> float:
        spread = np.linalg.solve(M - share * N, push)
        return float(
            (1 - share) ** 2 * bias @ M @ bias + np.einsum("kp,kl,lp->", spread, M, spread)
        )

    shares = np.linspace(0, 1, 9)
    removed = correct_noise(solution).problem.noise_removed
    assert removed == shares[np.argmin([excess(s) for s in shares])]

    render = 0.3 * rng.normal(size=(*SIZE, 1)) * painted
    mixed = Estimate(*(x.astype(np.float32) for x in (basis.mix(w), render)))
    known_part, rendered = (
        np.einsum("kp,kp->", x, np.linalg.solve(M, x))
        for x in (
            np.einsum("kic,ipc,pc->kp", direction_array, f, y) for y in (noise, render[is_counted])
        )
    )
    own_objective = lacking @ np.linalg.solve(M, lacking) + known_part
    refined = refine(solution, mixed)
    assert refined.problem.refinement.share == pytest.approx(
        own_objective / (own_objective + rendered), rel=1e-4
    )


@pytest.mark.parametrize("u", [0.0, 0.5, 3.0, 10.0, 29.9, 30.1, 1e3])
def test_an_interval_at_a_bound_is_that_of_a_cut_off_normal(u: float):
    """P(X > U) = 0.05 P(X > 0) for X ~ N(-u s, s²), with s = 2."""
    end = _one_sided(2 * u, 2.0)
    cut_off = scipy.stats.truncnorm(u, np.inf, loc=-2 * u, scale=2)
    # Far out SciPy's own loses itself; there its tail is exponential.
    expected = cut_off.isf(0.05) if u <= 30 else 2 * np.log(20) / u
    assert end == pytest.approx(expected, rel=2e-3)
    assert u > 0 or end == pytest.approx(2 * NORMAL_95, rel=1e-4)
    assert _one_sided(u, 0.0) == 0


def test_a_light_that_is_off_by_more_than_noise_may_be_on_by_little(make_basis: Any):
    """By hand, of one light: u = b / (M − N) < 0 and s² = Σ (h r)² / (M − N)² at w = 0."""
    rng = np.random.default_rng(1)
    image = 1 + rng.random((1, *SIZE, 3))
    half = rng.normal(0, 0.5, image.shape)
    painted = -0.1 * rng.random((*SIZE, 3)) * np.array([1, 0.2, 0.02])
    basis = make_basis(images=image, half_differences=half)
    solution = solve(basis, _target(painted))
    bars = error_bars(solution)
    M, b = (np.einsum("hwc,hwc->c", image[0], x) for x in (image[0], painted))
    M -= np.square(half[0]).sum((0, 1))
    u, s = -b / M, np.sqrt(np.square(half[0] * painted).sum((0, 1))) / M
    assert (u > 3 * s).all()
    expected = scipy.stats.truncnorm.isf(0.05, u / s, np.inf, loc=-u, scale=s)
    low, high = bars.interval
    np.testing.assert_array_equal(low, 0)
    np.testing.assert_allclose(high[0], expected, rtol=1e-3)
    [light] = with_error_bars(solution, bars).lighting.lights
    assert light.interval == tuple((0, end) for end in high[0])


#: What a light of 0.5 may be held by, and to which side it may go from there.
AT_BOUNDS: dict[str, tuple[dict[str, Any], int]] = {
    "a dimmer at most": ({"color": [1, 1, 1], "limits": {"max": 0.5}}, -1),
    "a dimmer at least": ({"color": [1, 1, 1], "limits": {"min": 0.5}}, 1),
    "a luminance at most": ({"limits": {"max": 0.5}}, -1),
    "a luminance at least": ({"limits": {"min": 0.5}}, 1),
    "channels at most": ({"limits": {"max": [0.5, 0.5, 0.5]}}, -1),
    "zero": ({}, 1),
}


@pytest.mark.parametrize("margin", [nightly(0.4), 1.2])
@pytest.mark.parametrize(
    "name", [name if k == 0 else nightly(name) for k, name in enumerate(AT_BOUNDS)]
)
def test_intervals_at_bounds_hold_what_is_just_inside(make_basis: Any, name: str, margin: float):
    """Normal noise of little power, so that coverage is known: 95 % at least, by the binomial.

    inside: how far the true weight is from its bound, in standard deviations.
    """
    words, side = AT_BOUNDS[name]
    rng, seeds = np.random.default_rng(3), 60
    # What a standard deviation is here, of one channel and of three that go together.
    one = 0.005 / (np.sqrt(3) if "dimmer" in name else 1)
    truth = (0.0 if name == "zero" else 0.5) + side * margin * one
    clean = 0.5 + rng.random((2, *SIZE, 3))
    painted = np.einsum("nhwc,n->hwc", clean, [1, truth]) + _unreachable_picture(clean, rng)
    constraints = Constraints.of({"lamp": words})
    coverages, spread = [], []
    for _ in range(seeds):
        a, b = (clean + 0.02 * rng.normal(size=clean.shape) for _ in range(2))
        basis = make_basis(images=(a + b) / 2, half_differences=(a - b) / 2, names=["key", "lamp"])
        bars = error_bars(solve(basis, _target(painted), constraints=constraints))
        low, high = (end[1] for end in bars.interval)
        assert (low < high).all()
        coverages.append((low <= truth) & (truth <= high))
        spread.append(bars.weights[1])
    assert np.mean(np.std(spread, axis=0)) == pytest.approx(one, rel=0.5)
    count = seeds if "dimmer" in name else 3 * seeds
    assert np.mean(coverages) >= 0.95 - 3 * np.sqrt(0.95 * 0.05 / count)


def _unreachable_picture(clean: Any, rng: np.random.Generator) -> Any:
    """(h, w, 3) of unit variance that no mix of the lights has a part in."""
    residual = rng.normal(0, 1, clean.shape[1:])
    for c in range(3):
        span, _ = np.linalg.qr(clean[..., c].reshape(len(clean), -1).T)
        flat = residual[..., c].ravel()
        residual[..., c] = (flat - span @ (span.T @ flat)).reshape(clean.shape[1:3])
    return residual


def test_a_limit_that_is_met_leaves_one_side(make_basis: Any):
    """Far outside: the interval goes inwards from the limit, and not beyond it."""
    rng = np.random.default_rng(2)
    clean = 0.5 + rng.random((2, *SIZE, 3))
    halves = 0.1 * rng.normal(size=clean.shape)
    basis = make_basis(images=clean, half_differences=halves, names=["key", "lamp"])
    target = _target(np.einsum("nhwc,n->hwc", clean, [1, 2]))
    for words, bound_side in (
        ({"limits": {"max": [1, 1, 1]}}, 1),
        ({"limits": {"min": [3, 3, 3]}}, 0),
    ):
        constraints = Constraints.of({"lamp": words})
        bars = error_bars(solve(basis, target, constraints=constraints))
        ends = [end[1] for end in bars.interval]
        np.testing.assert_array_equal(ends[bound_side], bars.weights[1])
        assert (ends[0] < ends[1]).all()


@pytest.mark.parametrize("together", [1, 5, 32])
def test_the_weakest_matrix_is_that_of_an_inverse_for_each_light(
    together: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Against the pseudo-inverse anew after each light; to round-off of the inverses."""
    monkeypatch.setattr(uncertainty, "COLUMNS_AT_A_TIME", together)
    rng = np.random.default_rng(1)
    image = rng.gamma(0.3, 1, (3, 12, 48))
    M = image @ image.mT
    power = np.square(image * rng.normal(size=image.shape)).sum(axis=2)[..., None] * np.eye(12)
    noise = SimpleNamespace(
        power=power,
        power_error=rng.uniform(0, 0.3, (3, 12)) * np.einsum("cii->ci", power),
        least_power=rng.uniform(0, 0.3, (3, 12)) * np.einsum("cii->ci", M),
    )
    corrected = denoised_matrix(NormalEquations(M, np.zeros((3, 12)), np.zeros(3)), power)
    doubts = np.clip(rng.uniform(-0.5, 1.3, (12, 3)), 0, 1)
    own_inverse = np.array([np.diag(pseudo_inverse(x)) for x in M])
    weakest = weakest_matrix(M, own_inverse, noise, doubts, corrected)  # type: ignore[arg-type]
    expected = corrected.copy()
    for k, c in np.argwhere(doubts > 0):
        noisy, alone = (1 / pseudo_inverse(x[c])[k, k] for x in (M, expected))
        least = max(
            noisy - power[c, k, k] - noise.power_error[c, k],
            alone - expected[c, k, k] + noise.least_power[c, k],
            1e-3 * M[c, k, k],
        )
        expected[c, k, k] -= doubts[k, c] * max(alone - least, 0)
    assert np.abs(expected - corrected).max() > 0.1
    np.testing.assert_allclose(weakest, expected, rtol=1e-7, atol=1e-9 * np.abs(M).max())


def _hardly_seen_pair(seed: int, count: int) -> tuple[Basis, Target]:
    """Four lights, and of `count` lights those that only one pixel shows, below its noise."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:32, :48]
    places = ((8, 10), (24, 12), (10, 36), (26, 40), (16, 24), (16, 25))
    grey = np.stack([np.exp(-((x - px) ** 2 + (y - py) ** 2) / 150) for py, px in places])
    grey[4:] *= np.where((x > 46) & (y > 30), 1e-3, 0)
    light = grey[..., None] * [1, 0.9, 0.8]
    halves = light + 0.01 * np.sqrt(light) * rng.normal(size=(2, *light.shape))
    light, halves = light[:count], halves[:, :count]
    lights = tuple(
        BasisLight(f"lamp {k}", "spot", "intensity", "W/sr", (1.0, 1.0, 1.0), "")
        for k in range(count)
    )
    planes, noise = halves.mean(axis=0), (halves[0] - halves[1]) / 2
    origin = Origin("scene.xml", "0f" * 8, "camera", 0, "synthetic", (64, 64), (1, 1))
    seen = np.zeros(light.shape[1:3], bool)
    basis = Basis(lights, planes.astype(np.float32), noise.astype(np.float32), seen, origin)
    mixed = np.einsum("nhwc,n->hwc", light, [1, 2, 0.5, 1.5, 1, 1][:count])
    return basis, Target.of(mixed.astype(np.float32))


@pytest.mark.parametrize("seed", range(8))
def test_lights_that_hardly_reach_the_paint_stay_undetermined_alone(seed: int):
    """Two lights that one pixel shows below its noise leave the others as sure as they are."""
    sides = []
    for count in (4, 6):
        basis, target = _hardly_seen_pair(seed, count)
        bars = error_bars(correct_noise(solve(basis, target)))
        assert bars is not None
        low, high = bars.interval
        sides.append((high - low)[:4])
        assert not bars.untold[:4].any()
    # The noise of the four is the same in both. Precision: the sums of the pair are singular but
    # for rounding, which may widen an interval.
    assert (sides[1] < 2 * sides[0]).all()


def test_many_corners_of_a_gamut_widen_no_error_bar(make_basis: Any):
    """A gamut only takes freedom away. Of corners as near to each other as those of a picture's
    own colours, any three span the same weights, and which of them an answer mixes says nothing.
    """
    clean, truth = _pools(3), np.array([[1.0, 0.9, 0.8], [0.7, 0.8, 0.75], [1.1, 1.2, 1.0]])
    target = _target(np.einsum("nhwc,nc->hwc", clean, truth))
    corners = truth[0] + 0.05 * np.random.default_rng(0).normal(size=(13, 3))
    constraints = Constraints.of({name: {"primaries": corners.tolist()} for name in "abc"})
    for seed in range(4):
        images, halves = _noisy_halves(clean, 0.3, np.random.default_rng(seed))
        basis = make_basis(
            images=images, half_differences=halves, names="abc", emission=np.ones((3, 3))
        )
        free = error_bars(solve(basis, target, literal=True))
        mixed = error_bars(solve(basis, target, literal=True, constraints=constraints))
        # Answers at a face of the gamut lie elsewhere, and what is missed there adds to the noise.
        assert (mixed.standard_error <= 1.3 * free.standard_error).all()
