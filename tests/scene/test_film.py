"""Reduced films: which there are, and that they show the same picture in larger pixels."""

from pathlib import Path

import numpy as np
import pytest
from renderer import write_room

from lightpaint.basis.render.render import render_basis
from lightpaint.errors import SceneError
from lightpaint.images.blocks import block_mean, enlarged, whole_factor
from lightpaint.scene.film import Film, reduced, reduction, reductions
from lightpaint.scene.quality import PRESETS, on_film, samples
from lightpaint.scene.render import Stream, render
from lightpaint.scene.scene import load_scene

FULL_HD = Film(0, (1920, 1080), (1920, 1080), (0, 0))
CROPPED = Film(0, (640, 360), (320, 180), (80, 60))


def test_a_film_is_cut_into_whole_blocks() -> None:
    assert reduction(FULL_HD, "1/4") == reduction(FULL_HD, "480x270") == 4
    assert reduced(FULL_HD, 4) == Film(0, (480, 270), (480, 270), (0, 0))
    # The size is that of the image, and the crop window divides as well.
    assert reduction(CROPPED, "160x90") == reduction(CROPPED, "1/2") == 2
    assert reduced(CROPPED, 20) == Film(0, (32, 18), (16, 9), (4, 3))
    assert reductions(CROPPED) == [1, 2, 4, 5, 10, 20]
    assert reduction(CROPPED, "1/1") == 1


@pytest.mark.parametrize("given", ["1/7", "1/0", "100x50", "960x541", "3840x2160", "0x0", "1920x1"])
def test_anything_else_is_refused_with_what_works(given: str) -> None:
    with pytest.raises(
        SceneError, match=r"1920x1080 cannot be reduced to .*: 960x540 \(1/2\), 640"
    ):
        reduction(FULL_HD, given)


@pytest.mark.parametrize("given", ["", "half", "4", "2/4", "-1/4", "1/4x", "320X180", "1e2x3"])
def test_what_is_no_resolution_is_said_to_be_none(given: str) -> None:
    with pytest.raises(SceneError, match="is not a resolution"):
        reduction(FULL_HD, given)


def test_a_film_of_coprime_sides_has_only_its_full_size() -> None:
    with pytest.raises(SceneError, match="only its full size"):
        reduction(Film(0, (31, 20), (31, 20), (0, 0)), "1/2")


def test_factors_and_blocks() -> None:
    assert whole_factor((6, 8), (3, 4)) == 2
    assert whole_factor((6, 8), (6, 8)) == 1
    assert whole_factor((6, 8), (3, 8)) is None
    assert whole_factor((3, 4), (6, 8)) is None
    image = np.random.default_rng(0).random((3, 4, 3)).astype(np.float32)
    np.testing.assert_array_equal(block_mean(enlarged(image, 4), 4), image)


def test_presets_take_the_smallest_reduction_that_is_small_enough(tmp_path: Path) -> None:
    preview, final = PRESETS["preview"], PRESETS["final"]
    assert preview.reduction(FULL_HD) == 8
    assert preview.reduction(Film(0, (128, 128), (128, 128), (0, 0))) == 1
    assert preview.reduction(Film(0, (1366, 768), (1366, 768), (0, 0))) == 2
    assert final.reduction(FULL_HD) == 1
    scene = load_scene(write_room(tmp_path), parameters={"width": 4000})
    assert on_film(scene, None, None) is scene
    assert samples(None, spp=None, time_s=None) is None
    assert on_film(scene, "preview", None).size == (10, 2000)
    assert samples("preview", spp=None, time_s=None) == 64
    # What is given goes before the preset.
    assert on_film(scene, "preview", "1/4").size == (5, 1000)
    assert samples("preview", spp=3, time_s=None) == 3
    assert samples("preview", spp=None, time_s=1.0) is None


@pytest.mark.parametrize("cropped", [False, True])
def test_a_small_pixel_is_the_mean_of_its_block(tmp_path: Path, cropped: bool) -> None:
    film = "".join(
        f'<integer name="crop_{name}" value="{value}"/>'
        for name, value in {"width": 12, "height": 8, "offset_x": 8, "offset_y": 4}.items()
    )
    scene = load_scene(write_room(tmp_path, film=film if cropped else ""))
    small = scene.reduced("1/4")
    assert small.identity == scene.identity
    assert small.size == ((2, 3) if cropped else (5, 6))
    whole = render(scene, spp=64, stream=Stream.TEMPLATE).reduced(4)
    part = render(small, spp=1024, stream=Stream.VERIFICATION)
    basis = render_basis(small, spp=1024)
    assert basis.size == whole.size
    now = basis.mix(basis.present_weights)
    weights = basis.present_weights.astype(np.float32)[:, None, None, :]
    noise = {
        "a render": np.square(part.half_difference, dtype=np.float64),
        "the basis": np.square((basis.half_differences * weights).sum(axis=0), dtype=np.float64),
    }
    for name, image in {"a render": part.image, "the basis": now}.items():
        gap = (whole.image - image).astype(np.float64)
        squares = noise[name] + np.square(whole.half_difference, dtype=np.float64)
        # Noise: four and a half standard errors of the sum, and of pixels in the mean square.
        assert abs(gap.sum()) <= 4.5 * np.sqrt(squares.sum()), name
        assert np.square(gap).sum() <= 4 * squares.sum(), name
