"""Images of walls and slides in texels: their hats, what a bitmap shows of itself, and meshes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpaint.errors import SceneError
from lightpaint.scene.lights.image_split import shown_image, why_not_flat
from lightpaint.scene.lights.texels.image_domains import (
    DOMAINS,
    ImageDomain,
    Slide,
    Wall,
    domain_of,
)
from lightpaint.scene.runtime.variant import use_variant

SIZES = st.tuples(st.integers(2, 24), st.integers(2, 24))
FLAT = Wall()


@given(SIZES, st.integers(1, 4), st.integers(0, 100))
def test_a_coarse_image_has_the_mean_of_the_fine_one(
    size: tuple[int, int], finer: int, seed: int
) -> None:
    columns, rows = size
    fine = np.random.default_rng(seed).random((finer * rows, finer * columns, 3))
    mean = (FLAT.coarse(fine, size) * FLAT.shares(size)[..., None]).sum(axis=(0, 1))
    np.testing.assert_allclose(mean, fine.mean(axis=(0, 1)), rtol=1e-12)


def test_an_image_of_the_size_of_the_texels_or_coarser_is_not_blurred() -> None:
    image = np.random.default_rng(0).random((8, 16, 3))
    np.testing.assert_allclose(FLAT.coarse(image, (16, 8)), image, atol=1e-12)
    np.testing.assert_allclose(
        FLAT.coarse(image[:2, :2], (5, 3)), FLAT.interpolated(image[:2, :2], (5, 3)), atol=1e-12
    )


@pytest.mark.parametrize("size", [(2, 2), (5, 3)])
def test_an_image_is_interpolated_as_mitsuba_does(size: tuple[int, int]) -> None:
    use_variant()
    import drjit as dr
    import mitsuba as mi

    columns, rows = size
    image = np.random.default_rng(2).random((rows, columns, 3)).astype(np.float32)
    texture = mi.load_dict(
        {"type": "bitmap", "bitmap": mi.Bitmap(image), "raw": True, "wrap_mode": "clamp"}
    )
    wide, high = 23, 17
    u, v = np.meshgrid((np.arange(wide) + 0.5) / wide, (np.arange(high) + 0.5) / high)
    si = dr.zeros(mi.SurfaceInteraction3f, wide * high)
    si.uv = mi.Point2f(np.stack([u.ravel(), v.ravel()]).astype(np.float32))
    shown = np.array(texture.eval(si)).T.reshape(high, wide, 3)
    np.testing.assert_allclose(FLAT.interpolated(image, (wide, high)), shown, atol=1e-5)


@pytest.mark.parametrize("filter_type", ["bilinear", "nearest"])
@pytest.mark.parametrize("wrap_mode", ["repeat", "mirror", "clamp"])
def test_a_bitmap_shows_what_mitsuba_shows(filter_type: str, wrap_mode: str) -> None:
    use_variant()
    import drjit as dr
    import mitsuba as mi

    image = np.random.default_rng(2).random((5, 7, 3)).astype(np.float32)
    turned = mi.ScalarTransform4f().translate([0.21, -0.43, 0]).rotate([0, 0, 1], 31)
    to_uv = turned.scale([1.7, -2.3, 1])
    texture = mi.load_dict(
        {
            "type": "bitmap",
            "bitmap": mi.Bitmap(image),
            "raw": True,
            "filter_type": filter_type,
            "wrap_mode": wrap_mode,
            "to_uv": to_uv,
        }
    )
    matrix = np.array(to_uv.matrix, float)
    shown = shown_image(image, (3, 2), matrix, filter_type=filter_type, wrap_mode=wrap_mode)
    high, wide = shown.shape[:2]
    assert (wide, high) >= (7, 5)
    u, v = np.meshgrid((np.arange(wide) + 0.5) / wide, (np.arange(high) + 0.5) / high)
    si = dr.zeros(mi.SurfaceInteraction3f, wide * high)
    si.uv = mi.Point2f(np.stack([u.ravel(), v.ravel()]).astype(np.float32))
    expected = np.array(texture.eval(si)).T.reshape(high, wide, 3)
    np.testing.assert_allclose(shown, expected, atol=1e-5)


def test_an_unchanged_bitmap_shows_its_own_pixels() -> None:
    image = np.random.default_rng(2).random((5, 7, 3))
    shown = shown_image(image, (2, 2), np.eye(4), filter_type="bilinear", wrap_mode="repeat")
    np.testing.assert_allclose(shown, image, atol=1e-12)


@pytest.mark.parametrize("domain", DOMAINS.values(), ids=DOMAINS.keys())
def test_shares_sum_to_one_and_neighbours_join_all_texels(domain: ImageDomain) -> None:
    size = (5, 4)
    assert domain.shares(size).sum() == pytest.approx(1, rel=1e-12)
    groups = {(y, x): {(y, x)} for y in range(4) for x in range(5)}
    pairs = list(domain.neighbours(size))
    for one, other, stiffness in pairs:
        assert stiffness > 0
        merged = groups[one] | groups[other]
        groups |= dict.fromkeys(merged, merged)
    assert len(groups[0, 0]) == 20


def test_a_wall_is_as_smooth_as_its_gradient_and_does_not_wrap_around() -> None:
    size = (16, 9)
    slope = np.repeat(np.arange(16.0)[None], 9, axis=0)
    cost = sum(k * (slope[a] - slope[b]) ** 2 for a, b, k in FLAT.neighbours(size))
    assert cost == pytest.approx(15 * 9 / (4 * np.pi))


def test_the_first_row_of_a_rectangle_is_stored_last() -> None:
    image = np.arange(12.0).reshape(2, 2, 3)
    np.testing.assert_array_equal(domain_of("area", "rectangle").as_stored(image), image[::-1])
    for domain in (domain_of("area", "obj"), domain_of("projector"), domain_of("envmap")):
        np.testing.assert_array_equal(domain.as_stored(image), image)


@pytest.mark.parametrize("size", [(16, 9), (32, 18), (7, 4), (2, 2)])
def test_a_slide_takes_sizes_of_its_shape(size: tuple[int, int]) -> None:
    pixels = (1, 1) if size == (2, 2) else (1920, 1080)
    Slide().check_size(size, pixels, "beam")


@pytest.mark.parametrize(
    ("domain", "size", "pixels", "part"),
    [
        (Slide(), (16, 8), (1920, 1080), "1920x1080: expected 16x9, or another size of that shape"),
        (Slide(), (16, 9), (1, 1), "the slide of a projector has the proportions of its bitmap"),
        (Slide(), (1, 1), (1, 1), "the slide of a projector has at least 2 columns and 2 rows"),
        (Wall(), (1, 1), (1, 1), "the image of an area light has at least 2 columns and 2 rows"),
        (DOMAINS["envmap"], (2, 2), (1, 1), "an image around the scene has at least 2 columns and"),
    ],
)
def test_other_sizes_are_refused_in_one_line(
    domain: ImageDomain, size: tuple[int, int], pixels: tuple[int, int], part: str
) -> None:
    with pytest.raises(SceneError) as caught:
        domain.check_size(size, pixels, "beam")
    assert part in str(caught.value)
    assert "\n" not in str(caught.value)


QUAD = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], float)
FACES = np.array([(0, 1, 2), (0, 2, 3)])


@pytest.mark.parametrize(
    ("coordinates", "faces", "part"),
    [
        (QUAD, FACES, ""),
        (QUAD[:, ::-1], FACES, ""),
        (QUAD * 2, FACES, "from 0 to 2"),
        (QUAD, np.concatenate([FACES, FACES]), "several places have the same"),
        (QUAD * (1, 0), FACES, "all on a line"),
        (QUAD * np.nan, FACES, "from nan to nan"),
    ],
)
def test_a_mesh_needs_one_place_for_each_coordinate(
    coordinates: np.ndarray, faces: np.ndarray, part: str
) -> None:
    reason = why_not_flat(coordinates, faces)
    assert part in reason
    assert bool(reason) == bool(part)
