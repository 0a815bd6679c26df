"""Denoised mixes: direct light keeps its edges, and no more is changed than noise asks for."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lightpaint.basis.cache.denoised_planes import RoughPlanes
from lightpaint.basis.denoised_mixes import (
    READ_SIDE,
    blend_by_noise,
    blend_where_sure,
    denoise_mix,
    denoise_plane,
    read_look,
    read_look_noise,
    read_look_side,
)
from lightpaint.basis.file.basis_file import as_stored, read_basis, write_basis
from lightpaint.basis.light_basis import Basis, Origin
from lightpaint.basis.lights import BasisLight
from lightpaint.basis.planes import IndirectLight, as_planes
from lightpaint.errors import BasisError
from lightpaint.images import denoiser
from lightpaint.images.denoiser import Features, denoised, oidn_is_installed
from lightpaint.images.pixel_blocks import block_mean

SIZE = (48, 64)


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def test_a_picture_without_noise_stays_as_it_is(rng: np.random.Generator):
    raw = rng.random((*SIZE, 3), dtype=np.float32)
    np.testing.assert_array_equal(blend_by_noise(raw, np.zeros_like(raw), raw * 0.5), raw)


def test_a_denoiser_that_loses_nothing_is_believed(rng: np.random.Generator):
    """Then it differs from the picture by the noise alone, and the share is V / (V + 0)."""
    clean = np.full((96, 96, 3), 2, np.float32)
    a, b = (clean + rng.normal(size=clean.shape).astype(np.float32) for _ in range(2))
    blended = blend_by_noise((a + b) / 2, (a - b) / 2, clean)
    # V and B each are means of 147 squares: their noise leaves an error of about B ≈ V / 10.
    assert np.square(blended - clean).mean() < 0.1 * np.square((a + b) / 2 - clean).mean()


@pytest.mark.parametrize("offset", [0.3, 1.0, 3.0])
def test_the_share_is_that_of_the_least_error(offset: float, rng: np.random.Generator):
    """Of a denoiser that is off by B everywhere: t = V / (V + B), and the error V B / (V + B)."""
    truth = np.full((160, 160, 3), 10, np.float32)
    a, b = (truth + rng.normal(size=truth.shape).astype(np.float32) for _ in range(2))
    blended = blend_by_noise((a + b) / 2, (a - b) / 2, truth + np.float32(offset))
    variance, squared_bias = 0.5, offset**2
    expected = variance * squared_bias / (variance + squared_bias)
    # The windows' own noise costs a little; both rivals alone are worse where they differ.
    error = np.square(blended - truth, dtype=np.float64).mean()
    assert expected * 0.9 < error < expected * 1.15
    assert error < min(variance, squared_bias)


#: Pixels that one of two samples found bright, in two of the four windows around (12, 12).
SINGLE_SAMPLES = ((6, 6), (17, 18))


@pytest.mark.parametrize(
    ("bright", "single", "is_kept"),
    [
        pytest.param([(12, 12)], SINGLE_SAMPLES, False, id="a stray pixel"),
        pytest.param([(12, 12), (12, 13)], SINGLE_SAMPLES, False, id="two of them"),
        pytest.param([(12, 12)], [], True, id="a highlight without noise around"),
        pytest.param([(12, 12)], SINGLE_SAMPLES[:1], True, id="a highlight beside noise"),
        pytest.param([(12, 12)], [(12, 12)], False, id="its own noise"),
        pytest.param([(12, x) for x in range(24)], SINGLE_SAMPLES, True, id="a line"),
    ],
)
def test_what_is_bright_by_chance_is_denoised(
    bright: list[tuple[int, int]], single: list[tuple[int, int]], is_kept: bool
):
    """Both samples of a bright pixel agree, so it shows no noise, but single ones nearby do."""
    a = np.ones((24, 24, 3), np.float32)
    a[tuple(zip(*bright, strict=True))] = 10
    clean, b = np.ones_like(a), a.copy()
    for pixel in single:
        a[pixel], b[pixel] = 19, 1
    blended = blend_by_noise((a + b) / 2, (a - b) / 2, clean)
    np.testing.assert_array_equal(blended[12, 12], 10 if is_kept else 1)


def split_basis(direct: np.ndarray, indirect: np.ndarray, rng: np.random.Generator) -> Basis:
    """Return a basis of one light with clean direct light and indirect light of few samples."""
    a, b = (indirect * rng.exponential(size=(*SIZE, 1)).astype(np.float32) for _ in range(2))
    light = BasisLight("spot", "spot", "intensity", "", (1, 1, 1))
    mean, half = ((a + b) / 2)[None], ((a - b) / 2)[None]
    parts = IndirectLight(as_planes(mean), as_planes(half))
    origin = Origin("made", "", "", 0, "", (4, 4), (1, 1))
    emitter_mask = np.zeros(SIZE, bool)
    return Basis((light,), direct[None] + mean, half, emitter_mask, origin, indirect=parts)


@pytest.mark.skipif(not oidn_is_installed(), reason="Open Image Denoise")
def test_edges_of_direct_light_survive(rng: np.random.Generator):
    """A grid of sharp pools in smooth indirect light, against the denoised sum of both."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    pools = ((x // 2 + y // 2) % 2 * np.float32(0.2))[..., None] * np.ones(3, np.float32)
    smooth = np.full((*SIZE, 3), 0.3, np.float32)
    basis, truth = split_basis(pools, smooth, rng), pools + smooth
    denoised_total = denoised(basis.planes.plane(0), None)
    error = {
        "split": np.square(denoise_plane(basis, 0) - truth).mean(),
        "whole": np.square(denoised_total - truth).mean(),
        "raw": np.square(basis.planes.plane(0) - truth).mean(),
    }
    assert error["split"] < 0.3 * error["whole"]
    assert error["split"] < 0.1 * error["raw"]
    twice = denoise_mix(basis, np.full((1, 3), 2.0))
    np.testing.assert_allclose(twice, 2 * denoise_plane(basis, 0), rtol=2e-3, atol=1e-4)


def wall() -> Features:
    """A wall across the view, a pixel a unit wide."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]].astype(np.float32)
    flat = np.ones((*SIZE, 3), np.float32)
    return Features(flat / 2, flat * np.float32([0, 0, 1]), np.stack([x, y, 0 * x], axis=-1))


def pools_and_glow() -> tuple[np.ndarray, np.ndarray]:
    """Sharp pools of direct light, and indirect light that falls off."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    pools = ((x // 4 + y // 4) % 2 * np.float32(0.2))[..., None] * np.ones(3, np.float32)
    glow = (0.1 + 0.3 * y / SIZE[0]).astype(np.float32)[..., None] * np.ones(3, np.float32)
    return pools, glow


def test_without_a_denoiser_light_is_averaged_along_surfaces(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
):
    """Nearer to the truth than the plain filter of both parts, which surfaces tell nothing."""
    monkeypatch.setattr(denoiser, "oidn_is_installed", lambda: False)
    monkeypatch.setattr("lightpaint.basis.denoised_mixes.oidn_is_installed", lambda: False)
    pools, glow = pools_and_glow()
    plain = split_basis(pools, glow, rng)
    along = replace(plain, features=wall())
    error = {
        name: np.square(denoise_plane(basis, 0) - pools - glow).mean()
        for name, basis in (("plain", plain), ("along surfaces", along))
    }
    raw = np.square(plain.planes.plane(0) - pools - glow).mean()
    assert error["along surfaces"] < 0.6 * error["plain"]
    # A Gaussian of two pixels leaves 1/25 of the noise of each.
    assert error["along surfaces"] < 0.06 * raw


@pytest.mark.parametrize("factor", [1, 2])
def test_direct_light_is_averaged_along_surfaces(
    factor: int, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
):
    """The denoiser, which takes ten times as long, gets indirect light alone."""
    denoised_parts = []

    def denoiser_of_constants(image: np.ndarray, *_: Any, **__: Any) -> np.ndarray:
        denoised_parts.append(image)
        return np.full_like(image, image.mean(dtype=np.float64))

    monkeypatch.setattr("lightpaint.basis.denoised_mixes.denoised", denoiser_of_constants)
    edge = SIZE[1] // 2
    pool = np.full((*SIZE, 3), 0.2, np.float32)
    pool[:, :edge] = 0.4
    plain = split_basis(pool, np.full_like(pool, 0.3), rng)
    grain = rng.normal(0, 0.02, (2, 1, *SIZE, 3)).astype(np.float32)
    basis = replace(
        plain,
        features=wall(),
        planes=as_planes(plain.planes.array() + (grain[0] + grain[1]) / 2),
        noise=as_planes(plain.noise.array() + (grain[0] - grain[1]) / 2),
    )
    clean = denoise_plane(basis, 0, factor=factor)
    [indirect] = denoised_parts
    assert basis.indirect is not None
    np.testing.assert_array_equal(indirect, block_mean(basis.indirect.planes.plane(0), factor))
    direct, truth = clean - indirect.mean(dtype=np.float64), block_mean(pool, factor)
    raw = block_mean(np.maximum(basis.planes.plane(0) - basis.indirect.planes.plane(0), 0), factor)
    error, noise = (np.square(picture - truth).mean(axis=(0, 2)) for picture in (direct, raw))
    # A Gaussian of two pixels leaves 1/25 of the noise. Beside the edge, which it would blur by
    # half of 0.2, the picture stays as it is, with noise of four standard errors at most.
    assert error[:8].mean() < 0.1 * noise.mean()
    beside = np.abs(direct - truth)[:, edge // factor - 1 : edge // factor + 1]
    assert beside.max() < 4 * 0.02 / np.sqrt(2 * factor**2)


@pytest.mark.skipif(not oidn_is_installed(), reason="Open Image Denoise")
def test_coarse_pictures_are_nearly_as_close(rng: np.random.Generator):
    """Their errors are those of a fourth of the samples in blocks of four pixels: of one size."""
    pools, glow = pools_and_glow()
    basis = replace(split_basis(pools, glow, rng), features=wall())
    truth, raw = pools + glow, basis.planes.plane(0)
    fast, coarse = (
        float(np.square(denoise_plane(basis, 0, quality=quality) - truth).mean())
        for quality in ("fast", "coarse")
    )
    assert coarse < 1.5 * fast
    assert coarse < 0.05 * np.square(raw - truth).mean()


def test_sure_blends_leave_no_specks_of_grain(rng: np.random.Generator):
    """Where nothing is lost, hardly a window of noise looks as if; lost edges come back."""
    truth = np.full((96, 96, 3), 2, np.float32)
    truth[:, 60:] = 12
    a, b = (truth + rng.exponential(size=truth.shape).astype(np.float32) - 1 for _ in range(2))
    raw, half, clean = (a + b) / 2, (a - b) / 2, np.full_like(truth, 2)
    change = np.abs(blend_where_sure(raw, half, clean) - clean).mean(axis=-1)[:, :56]
    plain = np.abs(blend_by_noise(raw, half, clean) - clean).mean(axis=-1)[:, :56]
    assert np.quantile(change, 0.99) < 0.2 * np.quantile(plain, 0.99)
    beyond = blend_where_sure(raw, half, clean)[:, 66:]
    # t = V / (V + B) = 0.5 / 100.5 of the change by 10, and the noise of the raw picture.
    assert np.abs(beyond.mean() - 12) < 0.15


@pytest.mark.skipif(not oidn_is_installed(), reason="Open Image Denoise")
def test_coarse_pictures_keep_what_a_mirror_shows():
    """Edges in indirect light without noise, which no surface has and blocks of pixels lose."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    seen = ((x // 3 + y // 3) % 2 * np.float32(0.4))[..., None] * np.ones(3, np.float32)
    plain = split_basis(0 * seen, seen, np.random.default_rng(5))
    parts = IndirectLight(as_planes(seen[None]), as_planes(0 * seen[None]))
    planes, noise = as_planes(seen[None]), as_planes(0 * seen[None])
    basis = replace(plain, planes=planes, noise=noise, indirect=parts, features=wall())
    np.testing.assert_allclose(denoise_plane(basis, 0, quality="coarse"), seen, atol=1e-6)


@pytest.mark.skipif(not oidn_is_installed(), reason="Open Image Denoise")
def test_the_filter_does_not_spread_what_no_surface_shows(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
):
    """A lamp in a mirror, whose border few samples show: dark pixels beside it stay dark."""
    smooth = np.full((*SIZE, 3), 0.3, np.float32)
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    distance = np.hypot(y - 24, x - 32)[..., None] * np.ones(3)
    lamp = np.where(distance < 6, 20, 0.01).astype(np.float32)
    border = np.where(np.abs(distance - 6) < 1, rng.choice([-10, 10], distance.shape), 0)
    plain = split_basis(lamp, smooth, rng)
    parts = plain.indirect
    assert parts is not None
    noise = as_planes(parts.noise.array() + border.astype(np.float32))
    basis = replace(plain, features=wall(), noise=noise)
    seen = []
    monkeypatch.setattr(
        "lightpaint.basis.denoised_mixes.denoised",
        lambda image, *_, **__: (seen.append(image), np.zeros_like(image))[1],
    )
    clean = denoise_mix(basis, np.ones((1, 3)))
    assert len(seen) == 1  # indirect light alone
    outside = np.abs(clean - lamp)[distance > 7.5]
    assert outside.max() < 1e-3
    assert np.abs(basis.surfaces(1)[1](lamp) - lamp)[distance > 7.5].max() > 0.5  # type: ignore[misc]


def two_lights(rng: np.random.Generator) -> tuple[Basis, list[np.ndarray]]:
    """A basis of two lights whose pools are where the other's are not, and its true planes."""
    pools, glow = pools_and_glow()
    bases = [split_basis(part, glow, rng) for part in (pools, 0.3 - pools)]

    def stacked(name: str, parts: Any) -> Any:
        return as_planes(np.concatenate([getattr(part, name).array() for part in parts]))

    lights = [replace(bases[0].lights[0], name=name) for name in ("spot", "other")]
    indirect = [stacked(name, [part.indirect for part in bases]) for name in ("planes", "noise")]
    basis = replace(
        bases[0],
        lights=lights,
        planes=stacked("planes", bases),
        noise=stacked("noise", bases),
        indirect=IndirectLight(*indirect),
    )
    return basis, [pools + glow, 0.3 - pools + glow]


def test_planes_that_stand_in_keep_edges_of_direct_light(rng: np.random.Generator):
    """They add up to the picture that they are shares of, and are nearer to the truth than shares
    of squares of pixels.
    """
    basis, truth = two_lights(rng)
    current = (truth[0] + truth[1]).astype(np.float32)
    error = {}
    for name, features in (("squares", None), ("surfaces", wall())):
        rough = RoughPlanes(replace(basis, features=features), current)
        planes = [rough.plane(k) for k in range(2)]
        np.testing.assert_allclose(sum(planes), current, rtol=1e-4)  # single precision
        error[name] = np.mean([np.square(a - b).mean() for a, b in zip(planes, truth, strict=True)])
    assert error["surfaces"] < 0.2 * error["squares"]


def test_planes_that_stand_in_of_large_pictures_are_of_squares(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
):
    """Averages along surfaces would take as long as the denoised planes that they stand in for."""
    basis, truth = two_lights(rng)
    current = (truth[0] + truth[1]).astype(np.float32)
    expected = RoughPlanes(basis, current).plane(0)
    with_surfaces = replace(basis, features=wall())
    monkeypatch.setattr("lightpaint.images.surface_filter.KEPT_PIXELS", 1)
    np.testing.assert_array_equal(RoughPlanes(with_surfaces, current).plane(0), expected)


def test_without_indirect_light_all_of_it_is_denoised(make_basis: Any):
    basis = make_basis(2, SIZE)
    expected = denoised(basis.planes.plane(1), basis.features)
    np.testing.assert_array_equal(denoise_plane(basis, 1), expected)


def test_indirect_light_is_of_the_lights_of_its_basis(make_basis: Any):
    basis = make_basis(2, SIZE)
    other = as_planes(np.zeros((3, *SIZE, 3), np.float32))
    with pytest.raises(BasisError, match="indirect light and images differ in shape"):
        replace(basis, indirect=IndirectLight(other, other))


@pytest.mark.parametrize("has_denoiser", [True, False])
def test_the_look_that_is_read_has_little_noise_in_blocks_and_keeps_single_pixels(
    has_denoiser: bool, rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
):
    """Its own estimate of what is left, and the errors against the truth, agree over many draws."""
    if has_denoiser and not oidn_is_installed():
        pytest.skip("Open Image Denoise")
    monkeypatch.setattr("lightpaint.basis.denoised_mixes.oidn_is_installed", lambda: has_denoiser)
    pools, glow = pools_and_glow()
    side, error, raw, stated = 6, 0.0, 0.0, 0.0
    for _ in range(8):
        basis = replace(split_basis(pools, glow, rng), features=wall())
        look, noise = read_look(basis), read_look_noise(basis)
        change = look - basis.current_look
        blocks = block_mean(change, READ_SIDE).repeat(READ_SIDE, axis=0).repeat(READ_SIDE, axis=1)
        # Pixels of a block change alike: what is left is round-off.
        np.testing.assert_allclose(change, blocks, atol=1e-6)
        off = (block_mean(x - pools - glow, side) for x in (look, basis.current_look))
        error, raw = (
            float(e + np.square(x).mean()) for e, x in zip((error, raw), off, strict=True)
        )
        stated += float(np.square(block_mean(noise, side)).mean())
    assert error < 0.3 * raw
    # The denoiser has a bias of its own, and its answers to both halves are not independent.
    assert 0.5 < stated / error < 1.5


def test_reading_the_look_walks_no_image_again(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
):
    basis = replace(split_basis(*pools_and_glow(), rng), features=wall())
    known = basis.current_look
    monkeypatch.delattr(Basis, "mixes")
    assert read_look(basis).shape == known.shape


@pytest.mark.parametrize("size", [(47, 64), (48, 63), (25, 45)])
def test_the_look_of_a_picture_with_odd_sides_is_read(
    size: tuple[int, int], rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
):
    """Pixels at the end that fill no block change as those beside them."""
    monkeypatch.setitem(globals(), "SIZE", size)
    basis = replace(split_basis(*pools_and_glow(), rng), features=wall())
    look, noise = read_look(basis), read_look_noise(basis)
    assert look.shape == noise.shape == (*size, 3)
    change = look - basis.current_look
    assert np.abs(change).max() > 0.01
    if size[0] % READ_SIDE:
        np.testing.assert_allclose(change[-1], change[-2], atol=1e-6)
    if size[1] % READ_SIDE:
        np.testing.assert_allclose(change[:, -1], change[:, -2], atol=1e-6)


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (9, 1)])
def test_the_look_of_a_line_of_pixels_is_read_as_it_is(
    size: tuple[int, int], rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch
):
    """No block fits into it."""
    monkeypatch.setitem(globals(), "SIZE", size)
    basis = replace(split_basis(*pools_and_glow(), rng), features=wall())
    assert read_look(basis) is basis.current_look
    np.testing.assert_array_equal(read_look_noise(basis), basis.current_noise)
    assert read_look_side(basis) == 1


def test_without_known_parts_the_look_is_read_as_it_is(rng: np.random.Generator):
    pools, glow = pools_and_glow()
    split = split_basis(pools, glow, rng)
    for basis in (split, replace(split, features=wall(), indirect=None)):
        assert read_look(basis) is basis.current_look
        np.testing.assert_array_equal(read_look_noise(basis), basis.current_noise)


def test_a_file_keeps_it(tmp_path: Path, rng: np.random.Generator):
    """Rounded as `as_stored` says, which is far below its noise."""
    y = np.linspace(0, 1, SIZE[0], dtype=np.float32)[:, None, None]
    ramp = y + np.zeros((*SIZE, 3), np.float32)
    basis = split_basis(ramp, np.float32(1e-6) * (1 + ramp), rng)
    before = basis.indirect
    assert before is not None
    images, noise = before.planes.array().copy(), before.noise.array().copy()
    write_basis(tmp_path / "a.basis.exr", basis)
    reread, stored = read_basis(tmp_path / "a.basis.exr").indirect, as_stored(basis).indirect
    assert reread is not None
    assert stored is not None
    np.testing.assert_array_equal(reread.planes.array(), stored.planes.array())
    np.testing.assert_array_equal(reread.noise.array(), stored.noise.array())
    power = np.square(noise, dtype=np.float64).sum()
    for read, expected in ((reread.planes, images), (reread.noise, noise)):
        assert np.square(read.array() - expected, dtype=np.float64).sum() < power / 100


def test_other_pixels_are_no_picture_to_denoise(rng: np.random.Generator):
    basis = split_basis(np.zeros((*SIZE, 3), np.float32), np.ones((*SIZE, 3), np.float32), rng)
    some = np.array([3, 5, 8])
    row = basis.on_pixels(
        basis.planes.picked(some), basis.noise.picked(some), np.zeros((1, 3), bool)
    )
    assert row.indirect is None
    assert row.size == (1, 3)
    np.testing.assert_array_equal(row.images, basis.images.reshape(1, 1, -1, 3)[:, :, some])
