"""Renders that come as a display shows them are read as renders, and paintings never."""

import io
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import gaussian_filter

import lightpaint as lp
from lightpaint.lighting.analysis.noise.rendered_painting import (
    OF_FEW,
    SIDES,
    WHITE,
    is_made_by_lights,
)
from lightpaint.report import answer_remarks

SIZE = (72, 96)
Y, X = np.mgrid[: SIZE[0], : SIZE[1]]

#: Pools of light over a texture, and levels that differ from the present ones.
POOLS = [(20, 20, 400), (70, 30, 600), (50, 60, 900), (30, 50, 5000)]
LEVELS = np.array([[1.5], [0.6], [1.0], [0.4]]) * [1.0, 0.9, 0.7]

VIEW = lp.ViewTransform("srgb")


def planes() -> Any:
    """Return what the lights do without noise, (4, h, w, 3)."""
    leaves = np.random.default_rng(9).uniform(0.6, 1.4, SIZE)
    pools = [np.exp(-((X - x) ** 2 + (Y - y) ** 2) / s) * leaves for x, y, s in POOLS]
    return 0.35 * np.repeat(np.stack(pools)[..., None], 3, axis=-1)


def basis_of(make_basis: Any, seed: int, noise: float = 0.06) -> lp.Basis:
    """Return the lights with noise of paths, which carry all channels."""
    rng, clean = np.random.default_rng(seed), planes()
    a, b = (clean * (1 + noise * rng.normal(size=(*clean.shape[:3], 1))) for _ in range(2))
    emission = (LEVELS * [[0.6], [1.6], [0.8], [1.5]]).tolist()
    return make_basis(images=(a + b) / 2, half_differences=(a - b) / 2, emission=emission)


def look_at(basis: lp.Basis) -> Any:
    """Return the look without noise, (h, w, 3)."""
    return np.einsum("nhwc,nc->hwc", planes(), basis.current_weights)


def shown(image: Any, quality: int | None = None) -> lp.Target:
    """Return a picture as a PNG, or as a JPEG of that quality."""
    codes = np.round(255 * np.clip(VIEW.encode(image), 0, 1))
    if quality is not None:
        file = io.BytesIO()
        Image.fromarray(codes.astype(np.uint8)).save(file, "JPEG", quality=quality)
        codes = np.asarray(Image.open(file)).astype(float)
    return lp.Target(
        "picture",
        VIEW.decode(codes / 255).astype(np.float32),
        np.ones(SIZE, np.float32),
        everything=True,
        at_least=codes >= 255,
        transform=VIEW,
        through_view=True,
    )


def grain(strength: float, seed: int = 5) -> Any:
    """Return factors of independent noise, (h, w, 1)."""
    return 1 + strength * np.random.default_rng(seed).normal(size=(*SIZE, 1))


@pytest.mark.parametrize("strength", [0.03, 0.1])
def test_a_render_in_eight_bits_is_one(make_basis: Any, strength: float) -> None:
    held = []
    for seed in range(4):
        basis = basis_of(make_basis, seed)
        image = np.einsum("nhwc,nc->hwc", planes(), LEVELS) * grain(strength, 100 + seed)
        answer = lp.correct_noise(lp.solve(basis, shown(image)))
        assert answer.problem.is_render
        assert answer.problem.contrast is None
        assert "as of a render" in str(answer_remarks(answer)[0])
        bars = lp.error_bars(answer)
        assert bars is not None
        low, high = bars.interval
        held.append((low <= LEVELS) & (high >= LEVELS))
    # Channels are alike, so these are 16 intervals of 95 %: three standard errors are .16.
    assert np.mean(held) >= 0.95 - 0.16


def test_what_cannot_be_told_is_said(make_basis: Any) -> None:
    answer = lp.solve(basis_of(make_basis, 1), shown(planes().sum(axis=0)))
    unknown = replace(answer, problem=replace(answer.problem, is_render=None))
    assert str(answer_remarks(unknown)[0]).startswith(
        "noise hides whether the painting is a render"
    )


def soft_stroke() -> Any:
    """Return how far a brush covers the picture, (h, w, 1)."""
    return np.clip((16 - np.hypot(X - 60, Y - 30)) / 8, 0, 1)[..., None]


def hand_painted(kind: str, look: Any) -> Any:
    """Return a painting over the look, (h, w, 3)."""
    rng, stroke = np.random.default_rng(3), soft_stroke()
    brighter = look * 2 ** (1.2 * stroke * [1.0, 0.8, 0.5])
    texture = np.clip(1 + 0.6 * gaussian_filter(rng.normal(size=SIZE), 0.6)[..., None], 0, 2)
    return {
        "stroke": lambda: brighter,
        "film grain": lambda: brighter * grain(0.08),
        "textured brush": lambda: look * 2 ** (1.2 * stroke * texture * [1.0, 0.8, 0.5]),
        "flat paint": lambda: look * (1 - stroke) + 0.3 * stroke * [1.0, 0.7, 0.4],
        "wash": lambda: look * 2 ** (0.02 * (X - 48)[..., None] * [1.0, 0.3, -0.6]),
        "gradient": lambda: look * (0.5 + Y / 72)[..., None],
    }[kind]()


@pytest.mark.parametrize("quality", [None, 70, 90])
@pytest.mark.parametrize(
    "kind", ["stroke", "film grain", "textured brush", "flat paint", "wash", "gradient"]
)
def test_a_painting_is_none(make_basis: Any, kind: str, quality: int | None) -> None:
    basis = basis_of(make_basis, 1)
    answer = lp.solve(basis, shown(hand_painted(kind, look_at(basis)), quality))
    assert answer.problem.is_render is False
    assert not answer_remarks(answer) or "render" not in str(answer_remarks(answer)[0])


def test_strokes_over_the_noise_of_another_render_are_no_render(make_basis: Any) -> None:
    basis, other = basis_of(make_basis, 1), basis_of(make_basis, 2)
    painted = hand_painted("stroke", other.mix(basis.current_weights))
    assert lp.solve(basis, shown(painted)).problem.is_render is False


def test_what_is_missed_by_a_render_is_white(make_basis: Any) -> None:
    """An answer without contrasts misses squares of noise, Σ_squares (Σ q)² / Σ q² = 1 ± √(2/n)."""
    basis = basis_of(make_basis, 1)
    image = np.einsum("nhwc,nc->hwc", planes(), LEVELS)
    literal = lp.solve(basis, shown(image * grain(0.1)), literal=True, space="display")
    assert is_made_by_lights(literal)
    q = (literal.image - literal.basis.mix(literal.weights)) * np.sqrt(literal.weight)
    for side in SIDES:
        sums = q.reshape(SIZE[0] // side, side, SIZE[1] // side, side, 3).sum(axis=(1, 3))
        ratio = float(np.square(sums).sum() / np.square(q).sum())
        assert ratio < WHITE + OF_FEW / np.sqrt(sums[..., 0].size)
        assert ratio == pytest.approx(1, abs=3 * np.sqrt(2 / sums[..., 0].size))
