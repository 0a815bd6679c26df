"""Clean planes: their sums, where they are kept, and that they are of just these pixels."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lightpaint.basis.cache import denoised_planes
from lightpaint.basis.cache.denoised_planes import (
    DenoisedPlanes,
    RoughPlanes,
    as_halves,
    obtain_denoised_planes,
    read_denoised_planes,
    scale_of,
)
from lightpaint.basis.denoised_mixes import denoise_current_look
from lightpaint.basis.file.basis_file import read_basis, write_basis
from lightpaint.images.denoiser import Features, denoised, oidn_is_installed
from lightpaint.images.estimate import Estimate
from lightpaint.images.pixel_blocks import block_mean

pytestmark = pytest.mark.skipif(not oidn_is_installed(), reason="Open Image Denoise")


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path))
    monkeypatch.setattr(denoised_planes, "MIN_PIXELS", 1)
    return tmp_path


def test_their_sum_is_a_clean_picture_of_any_lighting(make_basis: Any):
    """Half floats hold 11 bits of each plane, and the sum no less."""
    basis = make_basis(3, (40, 72))
    weights = np.array([[1.0, 2.0, 0.0], [0.5, 0.0, 3.0], [4.0, 1.0, 0.1]])
    planes = obtain_denoised_planes(basis)
    assert planes is not None
    each = [denoised(image, basis.features) for image in basis.images]
    expected = sum(w * x.astype(np.float64) for w, x in zip(weights, each, strict=True))
    bound = sum(w * np.abs(x) for w, x in zip(weights, each, strict=True)) * 2.0**-11
    assert (np.abs(planes.mix(weights) - expected) <= bound + 1e-6 * expected.max()).all()
    np.testing.assert_allclose(planes.plane(1), each[1], rtol=2**-11, atol=each[1].max() * 2**-24)
    np.testing.assert_array_equal(planes.current, planes.mix(basis.current_weights))


def test_made_once_for_the_same_pixels(make_basis: Any, monkeypatch: pytest.MonkeyPatch):
    basis, calls = make_basis(2, (24, 32)), []
    real = denoised_planes.denoise_plane

    def count_calls(*arguments: Any, **options: Any) -> Any:
        calls.append(arguments)
        return real(*arguments, **options)

    monkeypatch.setattr(denoised_planes, "denoise_plane", count_calls)
    first, second = obtain_denoised_planes(basis), obtain_denoised_planes(replace(basis))
    assert len(calls) == 2
    assert first is not None
    assert second is not None
    np.testing.assert_array_equal(first.halves, second.halves)
    # Other pixels, features or current emissions have others.
    other = replace(basis, planes=basis.images * np.float32(1.5))
    assert read_denoised_planes(other) is None
    brighter = tuple(replace(x, emission=(2.0, 2.0, 2.0)) for x in basis.lights)
    assert read_denoised_planes(replace(basis, lights=brighter)) is None
    assert read_denoised_planes(basis) is not None


def test_planes_of_a_file_are_known_without_reading_them(
    make_basis: Any, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
):
    path = tmp_path_factory.mktemp("saved") / "a.basis.exr"
    write_basis(path, make_basis(2, (24, 32)))
    basis = read_basis(path)
    first = obtain_denoised_planes(basis)
    hashed: list[Any] = []
    keys = denoised_planes._content_keys
    monkeypatch.setattr(
        denoised_planes, "_content_keys", lambda basis: hashed.append(basis) or keys(basis)
    )
    again = read_denoised_planes(read_basis(path))
    assert not hashed
    assert first is not None
    assert again is not None
    np.testing.assert_array_equal(again.halves, first.halves)
    # Other current emissions, other features and other noise are seen; so are changed planes.
    brighter = tuple(replace(x, emission=(2.0, 2.0, 2.0)) for x in basis.lights)
    assert read_denoised_planes(replace(basis, lights=brighter)) is None
    grey = np.full((24, 32, 3), 0.5, np.float32)
    features = Features(grey, grey)
    assert read_denoised_planes(replace(basis, features=features)) is None
    assert read_denoised_planes(replace(basis, noise=1 + basis.half_differences)) is None
    basis.planes.plane(0)[...] *= 2
    assert read_denoised_planes(basis.without_cached_values()) is None
    assert len(hashed) == 4


def test_blocks_of_a_file_are_kept_without_reading_all_planes(
    make_basis: Any, tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
):
    """Nor is the look as large as the film, if it is shown smaller."""
    path = tmp_path_factory.mktemp("saved") / "a.basis.exr"
    write_basis(path, make_basis(2, (48, 64)))
    monkeypatch.setattr(denoised_planes, "_content_keys", lambda _: pytest.fail("reads all"))
    first = obtain_denoised_planes(read_basis(path), factor=4, look_factor=2)
    assert first is not None
    assert not first.is_whole
    assert first.halves.shape == (2, 12, 16, 3)
    assert first.current.shape == (24, 32, 3)
    again = read_denoised_planes(read_basis(path), factor=4, look_factor=2)
    assert again is not None
    np.testing.assert_array_equal(again.halves, first.halves)
    np.testing.assert_array_equal(again.current, first.current)
    # A painter wants the whole look.
    assert read_denoised_planes(read_basis(path), factor=4) is None
    assert first.look((12, 16)) is not None
    assert first.look((48, 64)) is None


@pytest.mark.parametrize("factor", [1, 2])
def test_planes_that_another_basis_shares_are_not_denoised_again(
    make_basis: Any, monkeypatch: pytest.MonkeyPatch, factor: int
):
    basis, denoised_lights = make_basis(3, (24, 32)), []
    real = denoised_planes.denoise_plane
    first = obtain_denoised_planes(basis, factor=factor)
    # The middle light was moved, and the others have changed places in the list.
    images = basis.images[::-1].copy()
    images[1] = images[1][::-1]
    moved = replace(basis, planes=images, origin=replace(basis.origin, scene_identity="moved"))

    def note(basis: Any, k: int, **options: Any) -> Any:
        denoised_lights.append(k)
        return real(basis, k, **options)

    monkeypatch.setattr(denoised_planes, "denoise_plane", note)
    second = obtain_denoised_planes(moved, factor=factor)
    assert denoised_lights == [1]
    assert first is not None
    assert second is not None
    for k in range(3):
        np.testing.assert_array_equal(
            second.plane(k), as_halves(real(moved, k, factor=factor), 1.0).astype(np.float32)
        )
    # Planes with other noise, of the same light, are others.
    noisier = replace(moved, noise=np.ones_like(images))
    obtain_denoised_planes(noisier, factor=factor)
    assert denoised_lights == [1, 0, 1, 2]


def test_few_pixels_are_not_worth_it(make_basis: Any, monkeypatch: pytest.MonkeyPatch):
    basis = make_basis(2, (24, 32))
    monkeypatch.setattr(denoised_planes, "MIN_PIXELS", basis.images[..., 0].size + 1)
    assert obtain_denoised_planes(basis) is None
    monkeypatch.setattr(denoised_planes, "MIN_PIXELS", 1)
    assert obtain_denoised_planes(basis) is not None


def test_means_over_blocks_are_denoised_and_kept_until_whole_planes_are(make_basis: Any):
    basis = make_basis(2, (49, 66))
    small = obtain_denoised_planes(basis, factor=2)
    assert small is not None
    assert not small.is_whole
    assert small.halves.shape == (2, 24, 33, 3)
    assert small.current.shape == (49, 66, 3)
    features = basis.features and basis.features.reduced(2)
    expected = denoised(block_mean(basis.planes.plane(1), 2), features)
    np.testing.assert_allclose(
        small.plane(1), expected, rtol=2**-11, atol=expected.max() * 2.0**-24
    )
    reread = read_denoised_planes(basis, factor=2)
    assert reread is not None
    np.testing.assert_array_equal(reread.halves, small.halves)
    assert read_denoised_planes(basis) is None
    assert read_denoised_planes(basis, factor=3) is None
    full_planes = obtain_denoised_planes(basis)
    assert full_planes is not None
    assert full_planes.is_whole
    # Now these serve for either.
    block_planes = obtain_denoised_planes(basis, factor=2)
    assert block_planes is not None
    np.testing.assert_array_equal(block_planes.halves, full_planes.halves)


def test_the_look_before_lights_were_moved_is_not_kept_as_the_present_one(make_basis: Any):
    basis = make_basis(2, (24, 32))
    before = 9 * basis.current_look
    moved_basis = replace(basis, former=Estimate(before, np.zeros_like(before)))
    planes = obtain_denoised_planes(moved_basis, factor=2)
    assert planes is not None
    np.testing.assert_array_equal(planes.current, denoise_current_look(basis))


def test_a_folder_that_takes_nothing_is_no_obstacle(make_basis: Any, cache: Path):
    (cache / "no folder").write_text("")
    basis = make_basis(2, (24, 32))
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LIGHTPAINT_CACHE", str(cache / "no folder"))
        planes = obtain_denoised_planes(basis)
    assert isinstance(planes, DenoisedPlanes)


@pytest.mark.parametrize("brightest", [0.0, 1e-30, 1.0, 1024.0, 1025.0, 3e9])
def test_scales_keep_all_but_the_last_bits(brightest: float):
    plane = np.array([[[brightest, brightest / 3, brightest / 1000]]], np.float32)
    scale = scale_of(plane)
    assert np.log2(scale) == round(np.log2(scale))
    np.testing.assert_allclose(as_halves(plane, scale) * np.float32(scale), plane, rtol=2**-11)


def test_the_same_light_by_the_scales_of_brighter_planes(make_basis: Any):
    basis = make_basis(2, (24, 32))
    planes = obtain_denoised_planes(basis)
    assert planes is not None
    brighter = replace(basis, planes=basis.images * np.float32(2**12))
    scaled_planes = planes.scaled_as(brighter)
    np.testing.assert_array_equal(
        scaled_planes.scales, [scale_of(plane) for plane in brighter.images]
    )
    assert (scaled_planes.scales != planes.scales).any()
    for k in range(2):
        # What is 12 stops below has as many bits less among the half floats' 24.
        light = planes.plane(k)
        np.testing.assert_allclose(
            scaled_planes.plane(k), light, rtol=2**-11, atol=light.max() * 2**-11
        )


def test_rough_planes_add_up_and_are_nearer_to_light_without_grain(make_basis: Any):
    """Of a few samples: a third of the pixels have all of the light."""
    rng = np.random.default_rng(4)
    y, x = np.mgrid[:61, :98] / 61
    light = np.array([1 / (0.3 + (y - a) ** 2 + (x - b) ** 2) for a, b in ((0, 0), (1, 1.6))])
    light = light[..., None] * rng.uniform(0.2, 1, (2, 1, 1, 3))
    grainy = 3 * light * (rng.random(light.shape[:3]) < 1 / 3)[..., None]
    basis = make_basis(images=grainy, emission=[[1, 0.5, 0.2], [2, 3, 4]])
    current = np.einsum("nhwc,nc->hwc", light, basis.current_weights).astype(np.float32)
    rough = RoughPlanes(basis, current)
    planes = np.array([rough.plane(k) for k in range(2)])
    assert planes.dtype == np.float32
    total = np.einsum("nhwc,nc->hwc", planes, basis.current_weights)
    np.testing.assert_allclose(total, current, rtol=1e-5)  # single precision
    grain, remaining_grain = (
        np.sqrt(np.mean((image - light) ** 2)) for image in (basis.images, planes)
    )
    assert (
        remaining_grain < grain / 5
    )  # of 64 pixels each is a mean, and of the total nothing is left


def test_clean_blocks_bring_rough_planes_nearer_to_the_light(make_basis: Any):
    """A shadow that the rough planes of few samples have only half of."""
    light = np.ones((2, 64, 96, 3), np.float32)
    light[0, :, :48] = 0.25
    rng = np.random.default_rng(5)
    grainy = 3 * light * (rng.random(light.shape[:3]) < 1 / 3)[..., None]
    basis = make_basis(images=grainy, emission=[[1, 1, 1], [2, 3, 4]])
    current = np.einsum("nhwc,nc->hwc", light, basis.current_weights).astype(np.float32)
    small = np.stack([block_mean(plane, 2) for plane in light]).astype(np.float16)
    blocks = DenoisedPlanes(small, np.ones(2), current)
    for k in range(2):
        rough, better = (RoughPlanes(basis, current, x).plane(k) for x in (None, blocks))
        rough_error, remaining_error = (
            np.sqrt(np.mean((x - light[k]) ** 2)) for x in (rough, better)
        )
        assert remaining_error < rough_error / 2
        # Away from the shadow's edge, over which a gain is interpolated.
        for part in (np.s_[:, :20], np.s_[:, 28:]):
            blocks_of = [block_mean(x, 2)[part] for x in (better, light[k])]
            np.testing.assert_allclose(*blocks_of, rtol=0.1)


def test_what_is_black_is_black_in_rough_planes(make_basis: Any):
    images = np.zeros((2, 20, 30, 3))
    images[0, :10, :10] = 1
    rough = RoughPlanes(make_basis(images=images), images[0].astype(np.float32))
    assert not rough.plane(1).any()
    assert not rough.plane(0)[12:].any()
