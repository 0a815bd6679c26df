"""Noise of a painting: that of a render is named, and nothing that a brush does."""

from typing import Any

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from lightpaint.lighting.analysis.diagnosis import diagnose
from lightpaint.lighting.analysis.noise.residuals import channel_grain
from lightpaint.lighting.default_solve import solve
from lightpaint.report.diagnosis_sentences import error_sentences
from lightpaint.target.painted_target import Target

SIZE = (90, 120)
Y, X = np.mgrid[: SIZE[0], : SIZE[1]]
EVERYWHERE = np.ones(SIZE, bool)


def _noise(kind: str) -> Any:
    """(h, w, 3), of variance 1 in the right half and 4 in the left one."""
    rng = np.random.default_rng(3)
    noises = {
        "normal": lambda: rng.normal(size=(*SIZE, 3)),
        "skewed": lambda: (rng.gamma(0.5, 1, (*SIZE, 3)) - 0.5) / np.sqrt(0.5),
        # As Mitsuba's default filter leaves it: σ of half a pixel.
        "filtered": lambda: gaussian_filter(rng.normal(size=(*SIZE, 3)), (0.5, 0.5, 0), truncate=4),
        "grey": lambda: np.repeat(rng.normal(size=(*SIZE, 1)), 3, axis=2),
    }[kind]()
    return noises / noises.std() * np.where(X < 60, 2, 1)[..., None]


def grain(residual: Any, counted: Any) -> Any:
    """The variance of a residual's noise, (h, w, 3)."""
    return np.stack([channel_grain(residual[..., c], counted) for c in range(3)], axis=-1)


def _brush_coverage(kind: str) -> Any:
    """(h, w), what a brush does."""
    far = np.hypot(X - 61.3, Y - 40.7)
    return {
        "soft brush": lambda: np.clip((30 - far) / 12, 0, 1),
        "hard disc": lambda: np.clip(30.3 - far, 0, 1),
        "slanted edge": lambda: np.clip(0.31 * X + 0.95 * Y - 60, 0, 1),
        "gradient": lambda: (X / 120.0) ** 2 * Y / 90.0,
        "stripes": lambda: Y % 2 - 0.5,
        "lamp": lambda: 20 * np.clip(3.2 - np.hypot(X - 30.2, Y - 20.6), 0, 1),
        "strokes": lambda: gaussian_filter(
            np.random.default_rng(0).normal(size=SIZE), 3, mode="nearest"
        ),
    }[kind]()


@pytest.mark.parametrize("kind", ["normal", "skewed", "filtered", "grey"])
def test_noise_is_measured(kind: str) -> None:
    measured = grain(_noise(kind), EVERYWHERE)
    # 5400 pixels each, whose squares scatter by as much as they are, and more if skewed.
    for half, variance in ((measured[:, :40], 4), (measured[:, 80:], 1)):
        assert half.mean() == pytest.approx(variance, rel=0.15)


@pytest.mark.parametrize(
    "kind", ["soft brush", "hard disc", "slanted edge", "gradient", "stripes", "lamp", "strokes"]
)
def test_paint_is_no_noise(kind: str) -> None:
    shape = np.repeat(_brush_coverage(kind)[..., None], 3, axis=2)
    part = grain(shape, EVERYWHERE).sum() / np.square(shape).sum()
    assert part < {"lamp": 0.25, "hard disc": 0.03, "slanted edge": 0.03}.get(kind, 0.005)


def test_only_what_counts_is_looked_at() -> None:
    is_left = X < 60
    residual = np.where(is_left[..., None], 0, _noise("normal"))
    assert grain(residual, is_left).max() == 0
    assert grain(residual, ~EVERYWHERE).max() == 0
    # A mask of single pixels has no neighbours to compare.
    assert grain(residual, (X % 3 == 0) & (Y % 3 == 0)).max() == 0


@pytest.mark.parametrize("size", [(1, 1), (2, 40), (4, 5), (7, 7), (5, 300)])
def test_small_pictures(size: tuple[int, int]) -> None:
    residual = np.random.default_rng(0).normal(size=(*size, 3))
    measured = grain(residual, np.ones(size, bool))
    assert measured.shape == residual.shape
    assert np.isfinite(measured).all()


@pytest.mark.parametrize("is_known", [True, False])
def test_a_render_as_painting_lacks_nothing_that_lights_could_give(
    make_basis: Any, is_known: bool
) -> None:
    """Half as noisy as its basis is in one light, and a stroke that no light makes."""
    rng = np.random.default_rng(1)
    clean = np.stack([np.repeat((1 + a)[..., None], 3, 2) for a in (X / 120, Y / 90, X * Y / 1e4)])
    noise = 0.02 * rng.normal(size=(3, *SIZE, 3))
    halves = 0.02 * rng.normal(size=noise.shape)
    basis = make_basis(images=clean + noise, half_differences=halves if is_known else None)
    image = clean.sum(axis=0) + 0.1 * _noise("normal")
    stroke = 0.4 * _brush_coverage("soft brush")[..., None]

    def diagnosis(image: Any) -> Any:
        target = Target("render", image.astype(np.float32), EVERYWHERE * np.float32(1), True)
        return diagnose(solve(basis, target))

    plain, painted = diagnosis(image), diagnosis(image + stroke)
    assert plain.share(plain.unreachable) < 0.03
    assert plain.share(plain.painting_noise) > (0.9 if is_known else 0.95)
    assert "is out of reach of any mix" not in " ".join(error_sentences(plain)).split(",")[0]
    explanation = (
        "finer detail of the painting than light can show"
        if is_known
        else "of the painting or of the lights'"
    )
    assert explanation in error_sentences(plain)[0]
    # The stroke is there as before, and is no noise.
    assert painted.painting_noise == pytest.approx(plain.painting_noise, rel=0.05)
    assert painted.unreachable > 0.5 * np.square(stroke).sum()
