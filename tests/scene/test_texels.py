"""Images around the scene in texels: sizes, solid angles, and hats as Mitsuba interpolates them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from texel_grid import texel_direction, texel_names

from lightpaint.errors import SceneError
from lightpaint.scene.lights.texels.image_domains import Sky, solid_angles
from lightpaint.scene.lights.texels.texel import (
    TexelLayout,
    image_of,
    images_of,
    parse_map_size,
    parse_size,
)
from lightpaint.scene.runtime.variant import use_variant

SIZES = st.tuples(st.integers(2, 24), st.integers(3, 24))


@given(SIZES)
def test_the_hats_of_an_image_cover_all_directions_once(size: tuple[int, int]) -> None:
    angles = solid_angles(size)
    assert angles.shape == size[::-1]
    assert angles.min() > 0
    assert angles.sum() == pytest.approx(4 * np.pi, rel=1e-12)


@given(SIZES, st.integers(0, 100))
def test_a_coarse_image_emits_as_much_light_as_the_fine_one(
    size: tuple[int, int], seed: int
) -> None:
    fine = np.random.default_rng(seed).random((129, 256, 3))
    total = (Sky().coarse(fine, size) * solid_angles(size)[..., None]).sum(axis=(0, 1))
    expected = (fine * solid_angles((256, 129))[..., None]).sum(axis=(0, 1))
    # The sums over its pixels stand for integrals, to the square of their size.
    np.testing.assert_allclose(total, expected, rtol=2e-3)


def test_a_map_of_the_size_of_the_image_or_coarser_is_not_blurred() -> None:
    image = np.random.default_rng(0).random((8, 16, 3))
    np.testing.assert_allclose(Sky().coarse(image, (16, 8)), image, atol=1e-12)
    small = image[:3, :2]
    assert np.isfinite(Sky().coarse(small, (32, 16))).all()


def test_an_odd_multiple_of_an_image_holds_the_same_function() -> None:
    image = np.random.default_rng(1).random((5, 8, 3))
    larger = Sky().interpolated(image, (24, 13))
    np.testing.assert_allclose(larger[::3, 1::3], image, atol=1e-12)


@pytest.mark.parametrize("size", [(2, 3), (8, 5), (7, 4)])
def test_texels_lie_where_mitsuba_has_them_and_shine_as_it_interpolates(
    size: tuple[int, int],
) -> None:
    use_variant()
    import drjit as dr
    import mitsuba as mi

    columns, rows = size
    image = np.random.default_rng(2).random((rows, columns, 3)).astype(np.float32)
    emitter = mi.load_dict({"type": "envmap", "bitmap": mi.Bitmap(image)})
    places = [(x, y) for y in range(1, rows - 1) for x in range(columns)]
    directions = np.array([texel_direction(x, y, size) for x, y in places], np.float32)
    si = dr.zeros(mi.SurfaceInteraction3f, len(places))
    si.wi = -mi.Vector3f(directions.T)
    seen = np.array(emitter.eval(si)).T
    np.testing.assert_allclose(seen, image[1:-1].reshape(-1, 3), atol=1e-5)


def test_names_tell_the_image_and_its_size() -> None:
    names = [*texel_names("sky", (4, 3)), "bulb", "wall.x0.y0", "wall.x3.y1"]
    assert images_of(names) == {"sky": (4, 3)}
    assert image_of("sky.x3.y2") == "sky"
    assert image_of("bulb") == ""
    assert images_of(["lamp.x0.y0"]) == {}


@pytest.mark.parametrize(
    ("value", "size"), [("16x8", (16, 8)), (" 16 × 8 ", (16, 8)), ([16, 8], (16, 8))]
)
def test_a_size_is_a_text_or_two_numbers(value: object, size: tuple[int, int]) -> None:
    assert parse_size(value, "split") == size


def test_a_layout_is_a_size_and_the_texels_that_are_split_again() -> None:
    text = "16x8+x4.y3+sun1.x13.y10"
    layout = parse_size(text, "split: sky")
    assert layout == TexelLayout((16, 8), ((0, 4, 3), (1, 13, 10)))
    assert layout.text == text
    assert parse_size(" 16x8 + x4.y3", "split: sky") == TexelLayout((16, 8), ((0, 4, 3),))


@pytest.mark.parametrize(
    "split", ["", "x4.y8", "x16.y3", "sun1.x13.y10", "sky.x4.y3", "x4", "x4.y3+x4.y3"]
)
def test_a_texel_that_cannot_be_split_again_is_one_line(split: str) -> None:
    with pytest.raises(SceneError) as caught:
        parse_size(f"16x8+{split}", "split: sky")
    last = split.split("+")[-1]
    assert str(caught.value) == (
        f"split: sky has {last!r} after a +: expected a texel to split again, such as x8.y4"
    )


@pytest.mark.parametrize(
    ("value", "part"),
    [
        ("large", "the map size is 'large': expected columns and rows, such as 1024x512"),
        ("0x512", "the map size is 0x512: expected from 1 to 8192 columns and rows"),
        ([20000, 10000], "expected from 1 to 8192"),
    ],
)
def test_a_wrong_map_size_is_one_line(value: object, part: str) -> None:
    with pytest.raises(SceneError) as caught:
        parse_map_size(value)
    assert part in str(caught.value)


@pytest.mark.parametrize(
    ("value", "part"),
    [
        ("400x250", "100,000 texels: expected at most 4,096"),
        ("sixteen", "expected columns and rows, such as 16x8"),
        ([16], "expected columns and rows"),
        ([16.0, 8.0], "expected columns and rows"),
        (True, "expected columns and rows"),
    ],
)
def test_other_sizes_are_refused_in_one_line(value: object, part: str) -> None:
    with pytest.raises(SceneError) as caught:
        parse_size(value, "split")
    assert part in str(caught.value)
    assert "\n" not in str(caught.value)
