"""Lights that are little but stray bright pixels: intervals that hold, and what is said."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy
from nightly import nightly

from lightpaint.lighting.analysis.noise.basis_noise import noise_sums
from lightpaint.lighting.analysis.noise.dominant_pixels import (
    PEAK_SHARE,
    T_RATIOS,
    TWO_PATHS,
    Peaks,
    most_noise,
    t_ratios,
)
from lightpaint.lighting.analysis.noise.noise_correction import correct_noise
from lightpaint.lighting.analysis.noise.uncertainty import error_bars, with_error_bars
from lightpaint.lighting.default_solve import solve
from lightpaint.report.diagnosis_sentences import (
    UNTOLD_HERE,
    spoken_errors,
    uncertainty_sentence,
    untold_lights,
)
from lightpaint.report.page.lights_table import lights_table
from lightpaint.report.page.notebook_html import html_of
from lightpaint.target.painted_target import Target

SIZE = (24, 24)
SEEDS = 40
SPP = 8

#: Shares of the last light's energy that one pixel has.
HIGHLIGHTS = {"highlight": 2 / 3, "two fifths": 0.41, "a tenth": 0.1}


def _hits(clean: Any, chance: float, rng: np.random.Generator) -> Any:
    """Half of the samples of something that each meets with `chance` only, (h, w, 3)."""
    hit_counts = rng.poisson(chance * SPP, clean.shape[:2])
    return (
        clean
        * (rng.gamma(3 * hit_counts + 1e-12) / 3 * (hit_counts > 0) / (chance * SPP))[..., None]
    )


def _lights() -> Any:
    """Three pools of light, (3, h, w, 3)."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] / SIZE[0]
    places = ((0.2, 0.3), (0.8, 0.5), (0.5, 0.8))
    return np.stack([np.exp(-((x - a) ** 2 + (y - b) ** 2) / 0.2) for a, b in places])[
        ..., None
    ] * np.ones(3)


def _highlight(clean: Any, share: float) -> Any:
    """One pixel with that share of the last light's energy, (h, w, 3)."""
    spot = np.zeros(clean[2].shape)
    spot[13, 9] = np.sqrt(share / (1 - share) * np.square(clean[2, ..., 0]).sum())
    return spot


def _halves(kind: str, rng: np.random.Generator) -> tuple[Any, list[Any]]:
    """What the lights do, and two halves of their samples."""
    clean = _lights()
    halves = [clean * (1 + 0.1 * rng.normal(size=(*clean.shape[:3], 1))) for _ in range(2)]
    if kind == "fireflies":
        clean[2] = 0.05 * clean[2] + 0.01
        for half in halves:
            half[2] = _hits(clean[2], 0.01, rng)
    if kind in HIGHLIGHTS:
        spot = _highlight(clean, HIGHLIGHTS[kind])
        clean[2] += spot
        for half in halves:
            half[2] += _hits(spot, 0.25, rng)
    return clean, halves


def _painting(kind: str, clean: Any) -> Target:
    image = np.einsum("n,nhwc->hwc", [1, 0.5, 12 if kind == "fireflies" else 0.8], clean)
    image[:, 12:] *= [0.7, 0.6, 0.5]
    return Target("t", image.astype(np.float32), np.ones(SIZE, np.float32), everything=True)


def _basis(make_basis: Any, kind: str, seed: int) -> Any:
    _, (a, b) = _halves(kind, np.random.default_rng(seed))
    return make_basis(images=(a + b) / 2, half_differences=(a - b) / 2, names="abc")


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("kind", "excluded_range"),
    [("plain", (0, 0)), ("fireflies", (0.95, 1)), ("highlight", (0.2, 1))],
)
def test_intervals_hold_what_few_pixels_show(
    make_basis: Any, kind: str, excluded_range: tuple[float, float]
):
    clean = _halves(kind, np.random.default_rng(0))[0]
    target = _painting(kind, clean)
    truth = solve(make_basis(images=clean), target).weights
    coverages, excluded_shares = [], []
    for seed in range(SEEDS):
        bars = error_bars(solve(_basis(make_basis, kind, seed), target))
        low, high = bars.interval
        coverages.append((low <= truth + 1e-9) & (truth <= high + 1e-9))
        excluded_shares.append(bars.untold)
    # Of 95 % of 40 seeds: a standard error is 0.034.
    assert np.mean(coverages, axis=(0, 2)).min() > 0.9
    assert excluded_range[0] <= np.mean(excluded_shares, axis=0)[2] <= excluded_range[1]
    # A highlight in its midst may leave another light open as well, now and then.
    assert np.mean(excluded_shares, axis=0)[:2].max() <= (0.25 if kind == "highlight" else 0)


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["two fifths", nightly("a tenth")])
def test_intervals_hold_what_one_pixel_has_a_share_of(make_basis: Any, kind: str):
    """A pixel that a few paths meet: its halves may agree by chance, one number for all noise."""
    clean = _halves(kind, np.random.default_rng(0))[0]
    target = _painting(kind, clean)
    truth = solve(make_basis(images=clean), target).weights
    coverages = []
    for seed in range(4 * SEEDS):
        solution = solve(_basis(make_basis, kind, seed), target)
        low, high = error_bars(correct_noise(solution)).interval
        coverages.append((low <= truth + 1e-9) & (truth <= high + 1e-9))
    # Of 95 % of 160 seeds, whose channels are alike: three standard errors are 0.052.
    assert np.mean(coverages, axis=(0, 2)).min() >= 0.95 - 0.052


def test_a_light_that_cannot_be_told_is_so_in_words(make_basis: Any):
    target = _painting("fireflies", _halves("fireflies", np.random.default_rng(0))[0])
    basis = _basis(make_basis, "fireflies", 1)
    bars = error_bars(solve(basis, target))
    solution = with_error_bars(solve(basis, target), bars)
    assert [light.untold for light in solution.lighting.lights] == [False, False, True]
    errors = spoken_errors(bars, 3)
    assert errors[2] == "undetermined"
    assert all(error.endswith(" %") for error in errors[:2])
    assert untold_lights(solution.lighting).startswith(f"Light c is {UNTOLD_HERE}: ")
    assert untold_lights(solution.lighting) in uncertainty_sentence(basis, solution, bars)
    for text in (
        lights_table(basis, solution, bars),
        html_of(solution),
        html_of(solution.lighting),
    ):
        assert text is not None
        assert text.count(UNTOLD_HERE) == 1


def _rare(lights: Any, _pixels: Any) -> Any:
    """The limits of pixels that rare paths may have met."""
    return np.full(lights.size, TWO_PATHS)


def test_peaks_by_hand():
    """A pixel with most of what could push, in which both halves agree by chance."""
    possible, push = np.full((1, 101), 1.0), np.full((1, 101), 0.1)
    possible[0, 50], push[0, 50] = 10, 0
    # As if the pixels came in blocks: what was a peak of the first is none of all.
    peaks = Peaks.empty(1)
    for part in np.array_split(np.arange(101), 4):
        peaks.add(possible[:, part], push[:, part], push[:, part], _rare)
    # Half of 200: it says nothing, the others 0.01 each, and it may be twice as noisy.
    assert peaks.total[0] == pytest.approx(200)
    assert peaks.hidden()[0] == pytest.approx(4 * 0.01 * 100)
    # It says 0.04 of itself, and alone it may be 42 times that: more than two paths have.
    push[0, 50] = 2
    peaks = Peaks.empty(1)
    peaks.add(possible, push, push, _rare)
    assert 0.04 * T_RATIOS[0] ** 2 > TWO_PATHS
    assert peaks.hidden()[0] == pytest.approx(TWO_PATHS * 100 - 4)
    # By the light of the pixel beside it pushes nothing, but its halves differ by a fifth of it.
    push[0, 50], shown = 0, push.copy()
    shown[0, 50] = 2
    peaks = Peaks.empty(1)
    peaks.add(possible, push, shown, _rare)
    assert peaks.hidden()[0] == pytest.approx(TWO_PATHS * 100)
    # Of many alike none decides.
    peaks = Peaks.empty(1)
    few = int(1 / PEAK_SHARE) + 1
    peaks.add(np.ones((1, few)), *np.full((2, 1, few), 0.1), _rare)
    assert peaks.hidden()[0] == 0


def test_peaks_of_a_light_that_hardly_pushes_are_as_those_of_any_other():
    """In units of 1e-90, whose fourth powers are 0 in float64."""
    possible, push = np.full((1, 50), 0.1), np.full((1, 50), 0.01)
    possible[0, :2], push[0, :2] = (3, 2), (0.3, 0.1)
    found = []
    for unit in (1.0, 1e-90):
        peaks = Peaks.empty(1)
        peaks.add(unit * possible, unit * push, unit * push, _rare)
        found.append(peaks.hidden()[0] / unit**2)
    assert found[0] > 0
    # Rounded squares.
    assert found[1] == pytest.approx(found[0], rel=1e-12)


@pytest.mark.parametrize("share", [0.02, 0.3, 0.9])
def test_many_paths_limit_the_variance_of_a_pixel(share: float):
    """Means of samples that meet an emitter or not, which is the widest that radiance up to 1 may
    scatter, and of such that meet it in part.
    """
    rng, samples = np.random.default_rng(0), 64
    hits = rng.random((20_000, samples)) < share
    for values in (hits, hits * rng.random(hits.shape)):
        means = values.mean(axis=1)
        measured = means.var() / means.mean() ** 2
        limit = most_noise(means.mean(keepdims=True), np.array([True]), samples)[0]
        # Means of 20,000 squares are known to 2 %.
        assert measured < 1.02 * limit or limit == TWO_PATHS
        if values is hits and limit < TWO_PATHS:
            assert measured == pytest.approx(limit, rel=0.04)
    # More than its radiance is not seen of a light, so its unit is another one.
    for light, is_radiance in ((share, False), (1.5, True), (0.0, True)):
        limits = most_noise(np.array([light]), np.array([is_radiance]), samples)
        assert limits[0] == TWO_PATHS


def test_a_lamp_at_the_edge_of_a_mirror_hides_no_noise(make_basis: Any):
    """One pixel has most of a light, and is a third of a lamp that 64 samples look at."""
    lights = _lights()
    lights[2] *= 1e-3
    lights[2, 8, 8] = 1 / 3
    halves = np.zeros_like(lights)
    halves[2, 8, 8] = 0.03
    image = np.einsum("n,nhwc->hwc", [1, 0.5, 0.8], lights).astype(np.float32)
    image[:, 12:] *= 0.7
    target = Target("t", image, np.ones(SIZE, np.float32), everything=True)
    basis = make_basis(images=lights, half_differences=halves, names="abc")
    rare = replace(basis, lights=tuple(replace(x, unit="W/sr") for x in basis.lights))
    seen, hidden = (noise_sums(solve(x, target)).hidden for x in (basis, rare))
    # Of 21 paths the variance is (2 / 3) / 21 at most; by one square of .09 it may be .34.
    assert (seen[:, 2] < hidden[:, 2] / 5).all()
    assert (hidden[:, 2] > 0).all()


def test_ratios_are_those_of_student() -> None:
    freedom = np.concatenate([np.arange(1, 6), np.geomspace(5, 1e7, 50)])
    exact = scipy.stats.t.ppf(0.975, freedom) / scipy.stats.norm.ppf(0.975)
    np.testing.assert_allclose(t_ratios(freedom), exact, rtol=4e-3)
    ratios = np.linspace(1, 5, 33)
    near = scipy.stats.t.ppf(0.975, ratios) / scipy.stats.norm.ppf(0.975)
    assert (t_ratios(ratios) > 0.99 * near).all()
    assert (t_ratios(ratios) < 1.05 * near).all()
    np.testing.assert_array_equal(t_ratios(np.array([0.3, np.nan])), [T_RATIOS[0], 1])
