"""Error bars of sketches, whose wishes are found in a noisy look."""

from typing import Any

import numpy as np
import pytest

import lightpaint as lp
from lightpaint.lighting.analysis.noise import uncertainty
from lightpaint.lighting.analysis.noise.uncertainty import ReadingNoise
from lightpaint.lighting.loss.expected_lights import NoisyBlocks, PaintedBlocks, Wash
from lightpaint.target.wish_finding import DISTINCT_STOPS, find_wishes

SIZE, SEEDS, NOISE = (27, 48), 16, 0.1


def _pools() -> Any:
    """Three pools of light and one for the whole picture, (n, h, w, 3); white is 1."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]] / SIZE[1]
    places = [(0.2, 0.2), (0.6, 0.35), (0.85, 0.2)]
    pools = [0.05 + np.exp(-((x - a) ** 2 + (y - b) ** 2) / 0.02) for a, b in places]
    return 0.2 * np.stack([np.ones(SIZE), *pools])[..., None] * np.ones(3)


def _noisy_basis(make_basis: Any, seed: int) -> lp.Basis:
    """The pools with noise in each pixel, the same in all channels."""
    clean, rng = _pools(), np.random.default_rng(seed)
    a, b = (clean * (1 + NOISE * rng.normal(size=(*clean.shape[:3], 1))) for _ in range(2))
    ones = np.ones((len(clean), 3))
    return make_basis(images=(a + b) / 2, half_differences=(a - b) / 2, emission=ones)


def _sketch() -> lp.Target:
    """A picture in which two places ask for about as much more light as it takes to be a wish."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1], :1][:2]
    stops = 1.15 * DISTINCT_STOPS * ((x < 16) & (y < 16)) + 1.3 * DISTINCT_STOPS * (x > 36)
    image = _pools().sum(axis=0) * 2.0 ** (stops - 0.2) * np.array([1, 0.95, 0.9])
    return lp.Target(
        "sketch",
        image.astype(np.float32),
        np.ones(SIZE, np.float32),
        everything=True,
        transform=lp.ViewTransform(),
        through_view=True,
    )


def _corrected(basis: lp.Basis, target: lp.Target, **fit: Any) -> lp.Solution:
    return lp.correct_noise(lp.solve(basis, target, **fit))


def test_intervals_of_a_sketch_hold_whatever_wishes_noise_shows(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Some seeds show two wishes, others three or more."""
    target, clean = _sketch(), make_basis(images=_pools(), emission=np.ones((4, 3)))
    best = lp.solve(clean, target).weights
    answers = [_corrected(_noisy_basis(make_basis, seed), target) for seed in range(SEEDS)]
    counts = {len(find_wishes(target, x.basis.current_look)) for x in answers}
    assert len(counts) > 1

    def share_held() -> float:
        held = []
        for answer in answers:
            bars = lp.error_bars(answer)
            assert bars is not None
            low, high = bars.interval
            held.append((low <= best) & (best <= high))
        return float(np.mean(held))

    # Wishes move all lights together, so that seeds count alone: two standard errors below 95 %.
    least = 0.95 - 2 * (0.95 * 0.05 / SEEDS) ** 0.5
    assert share_held() > least
    unread = ReadingNoise(np.zeros_like(best), 1.0)
    monkeypatch.setattr(uncertainty.ReadingNoise, "of", lambda _solution: unread)
    assert share_held() < least - 0.3


def test_a_literal_painting_and_one_without_noise_are_read_in_one_way(make_basis: Any) -> None:
    target, basis = _sketch(), _noisy_basis(make_basis, 0)
    literal = ReadingNoise.of(_corrected(basis, target, literal=True, space="display"))
    assert not literal.scatter.any()
    assert literal.widening == 1
    assert ReadingNoise.of(_corrected(basis, target)).scatter.max() > 1e-3
    clean = make_basis(images=_pools(), emission=np.ones((4, 3)))
    # What is left is the round-off of the solves.
    assert ReadingNoise.of(lp.solve(clean, target)).scatter.max() < 1e-9


def test_disturbed_blocks_have_the_noise_of_the_basis_twice(make_basis: Any) -> None:
    """Of many draws, the mean is the wash, and its scatter the half difference."""
    target, basis = _sketch(), _noisy_basis(make_basis, 3)
    view, wash = NoisyBlocks.of(basis, target), PaintedBlocks.of(basis, target).wash
    assert np.array_equal(wash.rows, Wash.of(basis, target).rows)
    rng = np.random.default_rng(0)
    draws = [view.disturbed(rng) for _ in range(64)]
    rows, looks = (np.stack([getattr(x, k) for x in draws]) for k in ("rows", "look"))
    # Each draw adds or subtracts the same amount: exact but for float32.
    assert np.allclose(np.abs(rows - wash.rows), np.abs(view.noise), atol=1e-6)
    assert np.allclose(looks, rows.sum(axis=2), rtol=1e-5)
    assert np.abs((rows > wash.rows).mean() - 0.5) < 4 * 0.5 / np.sqrt(64 * wash.counts.size)
