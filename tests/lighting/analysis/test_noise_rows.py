"""The noise of lit pixels alone is that of all pixels."""

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from lightpaint.basis.file import lit_planes
from lightpaint.basis.file.lit_planes import LitPlane, LitPlanes
from lightpaint.basis.planes import MemoryPlanes
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.lighting.analysis.noise.basis_noise import NoisyPixels, noise_sums
from lightpaint.lighting.solver import solve
from lightpaint.target.painted_target import Target

N, SIZE = 4, (9, 11)


def _lit(images: Any) -> LitPlanes:
    return LitPlanes([LitPlane.of(list(np.moveaxis(x, -1, 0)), 1.0) for x in images], SIZE)


@pytest.mark.parametrize("transform", [None, ViewTransform("srgb")], ids=["linear", "srgb"])
@pytest.mark.parametrize("own_lamps", [False, True], ids=["free", "one colour"])
def test_black_pixels_add_no_noise(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch, transform: Any, own_lamps: bool
) -> None:
    monkeypatch.setattr(lit_planes, "MAX_LIT_SHARE", 1.0)
    rng = np.random.default_rng(4)
    shown = rng.random((N, *SIZE, 1)) < 0.3
    images = (rng.random((N, *SIZE, 3)) * shown).astype(np.float32)
    # Some halves are black where the light is not, and a few the other way round.
    halves = (rng.normal(0, 0.1, images.shape) * (rng.random(shown.shape) < 0.5)).astype(np.float32)
    halves *= shown | (rng.random(shown.shape) < 0.05)
    basis = make_basis(images=images, half_differences=halves)
    importance = (rng.random(SIZE) < 0.8).astype(np.float32)  # pairs are of pixels that count
    target = Target("t", rng.random((*SIZE, 3), np.float32), importance, everything=False)
    colors = "own" if own_lamps else "free"
    options: Any = {"unpainted": 0.1, "colors": colors, "transform": transform}
    both = []
    for kind in (MemoryPlanes, _lit):
        of_kind = replace(basis, planes=kind(images), noise=kind(halves))
        both.append(solve(of_kind, target, **options))
    dense, lit = (noise_sums(x) for x in both)
    for name in (x.name for x in fields(dense)):
        expected = getattr(dense, name)
        # The pictures of both answers are float32, and rounded differently.
        np.testing.assert_allclose(getattr(lit, name), expected, rtol=1e-5, atol=1e-8)
    pixels = np.arange(5, 60)
    rows = [NoisyPixels.of(x).gradient_noise(pixels) for x in both]
    np.testing.assert_allclose(rows[1], rows[0], rtol=1e-5, atol=1e-8)
