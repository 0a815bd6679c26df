"""The noise of lit pixels alone is that of all pixels."""

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from lightpaint import progress
from lightpaint.basis.file import lit_planes
from lightpaint.basis.file.half_floats import EncodedPlanes, encoded_plane
from lightpaint.basis.file.lit_planes import LitPlane, LitPlanes
from lightpaint.basis.planes import MemoryPlanes
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.lighting.analysis.noise import basis_noise, noise_rows
from lightpaint.lighting.analysis.noise.basis_noise import NoisyPixels, noise_sums
from lightpaint.lighting.analysis.noise.noise_rows import FOLDED_PIXELS, MANY_LIGHTS, folded
from lightpaint.lighting.default_solve import solve
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
    D = both[0].problem.squares.weight.reshape(-1, both[0].problem.squares.weight.shape[2])
    light, half = (D * x.reshape(N, -1, 3) for x in (images, halves * halves))
    np.testing.assert_allclose(dense.power_error, np.sqrt((half**2).sum(axis=1)).T, rtol=1e-5)
    # The lower limit of a Poisson variable, by its exact relation to χ². The approximation is off
    # by a third over the square of the number of paths, with five as with thirty.
    paths = light.sum(axis=1) ** 2 / (light**2).sum(axis=1)
    least = (light.sum(axis=1) * chi2.ppf(0.025, 2 * paths) / (2 * paths)) ** 2 / D.sum(axis=0)
    assert (np.abs(dense.least_power.T / least - 1) < 0.4 / paths**2 + 1e-4).all()
    pixels = np.arange(5, 60)
    rows = [NoisyPixels.of(x).gradient_noise(pixels) for x in both]
    np.testing.assert_allclose(rows[1], rows[0], rtol=1e-5, atol=1e-8)


def test_folded_pixels_have_about_the_same_variances() -> None:
    """Within 5 standard errors of a sum of as many squares, also if one pixel has most of them."""
    rng = np.random.default_rng(2)
    rows = rng.normal(size=(MANY_LIGHTS, 8 * 1000 + 3))  # some are left over
    rows[:, 17] *= 300
    few = folded(rows)
    assert few.shape[1] <= rows.shape[1] / FOLDED_PIXELS + FOLDED_PIXELS
    directions = rng.normal(size=(50, MANY_LIGHTS))
    directions[:25] -= (
        np.outer(directions[:25] @ rows[:, 17], rows[:, 17]) / (rows[:, 17] ** 2).sum()
    )
    exact, found = (np.square(directions @ x).sum(axis=1) for x in (rows, few))
    np.testing.assert_allclose(found, exact, rtol=5 * np.sqrt(2 / few.shape[1]))
    assert not np.allclose(found, exact, rtol=1e-3)


def test_few_lights_keep_all_pixels() -> None:
    rows = np.ones((MANY_LIGHTS - 1, 8 * FOLDED_PIXELS))
    assert folded(rows) is rows


@pytest.mark.parametrize("own_lamps", [False, True], ids=["free", "one colour"])
def test_error_bars_of_folded_pixels_are_those_of_all(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch, own_lamps: bool
) -> None:
    """Within 5 standard errors of a variance that so many sums determine."""
    rng = np.random.default_rng(3)
    size = (40, 60)
    images = rng.random((N, *size, 3)).astype(np.float32)
    halves = rng.normal(0, 0.2, images.shape).astype(np.float32) * images
    basis = make_basis(images=images, half_differences=halves)
    everywhere = np.ones(size, np.float32)
    target = Target("t", rng.random((*size, 3), np.float32), everywhere, everything=True)
    solution = solve(basis, target, literal=True, colors="own" if own_lamps else "free")
    exact = noise_sums(solution).gradient
    monkeypatch.setattr(noise_rows, "MANY_LIGHTS", 1)
    few = noise_sums(solution).gradient
    assert not np.array_equal(few, exact)
    spread = 5 * np.sqrt(2 * FOLDED_PIXELS / (size[0] * size[1]))
    scale = np.sqrt(np.einsum("cici->ci", exact))
    np.testing.assert_allclose(
        few / scale[:, :, None, None] / scale, exact / scale[:, :, None, None] / scale, atol=spread
    )


def test_each_block_of_the_parts_is_reported(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A part, of which several are summed at a time, takes seconds with hundreds of lights."""
    monkeypatch.setattr(progress, "QUIET_S", 0)
    monkeypatch.setattr("lightpaint.basis.planes.BLOCK_PIXELS", 10)
    monkeypatch.setattr(basis_noise, "BLOCK_PIXELS", 10)
    rng = np.random.default_rng(7)
    images = rng.random((N, *SIZE, 3)).astype(np.float32)
    basis = make_basis(images=images, half_differences=images / 10)
    target = Target("t", images[0], np.ones(SIZE, np.float32), everything=True)
    solution, steps = solve(basis, target, literal=True), []

    class Listener:
        def __call__(self, label: str, done: int, total: int, unit: str = "passes") -> None:
            steps.append((done, total, unit))

        say = note = at_work = lambda *_: None

    with progress.stage("error bars", Listener()):
        noise_sums(solution)
    blocks = -(-SIZE[0] * SIZE[1] // 10)
    assert blocks > basis_noise.PARTS
    assert sorted(steps[:blocks]) == [(k, blocks, "blocks") for k in range(1, blocks + 1)]


@pytest.mark.parametrize("unit", [1.0, 2.0**24, 2.0**-24])
def test_noise_in_half_floats_is_summed_in_float32(make_basis: Any, unit: float) -> None:
    """To the round-off of float32, in any unit of light."""
    rng = np.random.default_rng(6)
    shape = basis_noise.MIN_SINGLE_LIGHTS, 3, *SIZE
    images = rng.random(shape).astype(np.float16)
    halves = rng.normal(0, 0.2, shape).astype(np.float16) * images
    stored = [EncodedPlanes([encoded_plane(x, unit) for x in y]) for y in (images, halves)]
    images, halves = (np.stack([*x]) for x in stored)
    basis = make_basis(images=images, half_differences=halves)
    everywhere = np.ones(SIZE, np.float32)
    target = Target("t", unit * rng.random((*SIZE, 3), np.float32), everywhere, everything=True)
    solution = solve(basis, target, literal=True)
    of_halves = replace(basis, planes=stored[0], noise=stored[1])
    exact = noise_sums(solution)
    single = noise_sums(replace(solution, problem=replace(solution.problem, basis=of_halves)))
    for name in ("power", "gradient", "freedom", "hidden"):
        expected, found = getattr(exact, name), getattr(single, name)
        assert not np.array_equal(found, expected) or not expected.any()
        np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4 * np.abs(expected).max())
