"""Reduced films: which there are, and that they show the same picture in larger pixels."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from nightly import examples
from renderer import LIGHTS, write_room

from lightpaint.basis.render.basis_render import _render_one_by_one, render_basis
from lightpaint.basis.render.render_budget import Budget, Keeper
from lightpaint.errors import SceneError
from lightpaint.images.pixel_blocks import block_mean, enlarged, whole_factor
from lightpaint.pipeline.job.job_checks import remarks_of_film, remarks_of_target
from lightpaint.pipeline.job.settings import Settings
from lightpaint.progress import silent
from lightpaint.scene.properties.film import (
    Film,
    even_reductions,
    reduced,
    reduction,
    reduction_to,
    with_width,
)
from lightpaint.scene.quality_presets import PRESETS, on_film, samples
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.scene.scene_reader import load_scene
from lightpaint.scene.scene_render import Stream, render
from lightpaint.scene.surfaces import render_surfaces
from lightpaint.target.painted_target import Target
from lightpaint.validation import MAX_PIXELS

FULL_HD = Film(0, (1920, 1080), (1920, 1080), (0, 0))
CROPPED = Film(0, (640, 360), (320, 180), (80, 60))


def test_a_film_is_cut_into_whole_blocks() -> None:
    assert reduction(FULL_HD, "1/4") == reduction(FULL_HD, "480x270") == 4
    assert reduced(FULL_HD, 4) == Film(0, (480, 270), (480, 270), (0, 0))
    # The size is that of the image, and the crop window divides as well.
    assert reduction(CROPPED, "160x90") == reduction(CROPPED, "1/2") == 2
    assert reduced(CROPPED, 20) == Film(0, (32, 18), (16, 9), (4, 3))
    assert even_reductions(CROPPED) == [1, 2, 4, 5, 10, 20]
    assert reduction(CROPPED, "1/1") == 1


@pytest.mark.parametrize(
    "resolution", ["1/1081", "1/0", "100x50", "960x541", "3840x2160", "0x0", "1920x1"]
)
def test_anything_else_is_refused_with_what_works(resolution: str) -> None:
    with pytest.raises(
        SceneError, match=r"1920x1080 cannot be reduced to .*: 960x540 \(1/2\), 640"
    ):
        reduction(FULL_HD, resolution)


def test_a_refusal_names_sizes_that_are_near() -> None:
    with pytest.raises(SceneError, match=r"to 100x50, .*: 960x540 .*, 101x56 \(1/19\), 96x54 \("):
        reduction(FULL_HD, "100x50")
    with pytest.raises(SceneError, match=r"683x512 .* to 171x128, .*: 227x170 \(1/3\), 170x128 \("):
        reduction(Film(0, (683, 512), (683, 512), (0, 0)), "171x128")


@pytest.mark.parametrize("resolution", ["", "half", "4", "2/4", "-1/4", "1/4x", "320X180", "1e2x3"])
def test_what_is_no_resolution_is_said_to_be_none(resolution: str) -> None:
    with pytest.raises(SceneError, match="is not a resolution"):
        reduction(FULL_HD, resolution)


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (7, 1)])
def test_a_line_of_pixels_has_only_its_full_size(size: tuple[int, int]) -> None:
    film = Film(0, size, size, (0, 0))
    with pytest.raises(SceneError, match="only its full size"):
        reduction(film, "1/2")
    assert reduced(film, reduction(film, "1/1")) == film
    assert PRESETS["preview"].reduction(film) == 1


def test_what_makes_no_whole_block_is_left_out_at_the_right_and_at_the_bottom() -> None:
    film = reduced(Film(0, (683, 512), (683, 512), (0, 0)), 4)
    assert (film.pixels, film.block, film.left_out) == ((170, 128), 4, (3, 0))
    assert film.size == (683, 512)
    # Whole in itself, but not where it begins.
    film = reduced(Film(0, (640, 360), (320, 180), (81, 60)), 2)
    assert (film.pixels, film.block, film.left_out) == ((160, 90), 2, (0, 0))
    # Blocks of 5 leave nothing out, and are as many as blocks of 4.
    assert reduced(Film(0, (15, 15), (15, 15), (0, 0)), 4) == Film(0, (3, 3), (3, 3), (0, 0))


@pytest.mark.parametrize("size", [(683, 512), (641, 361), (1279, 719), (1366, 768), (4001, 3)])
def test_a_preview_is_small_on_any_film(size: tuple[int, int]) -> None:
    film = Film(0, size, size, (0, 0))
    small = reduced(film, PRESETS["preview"].reduction(film))
    width, height = small.pixels
    assert 2**15 / 4 < width * height <= 2**15 or min(width, height) == 1
    assert small == reduced(film, reduction(film, f"{width}x{height}"))


FILMS = st.tuples(
    st.tuples(st.integers(1, 90), st.integers(1, 90)),
    st.tuples(st.integers(1, 90), st.integers(1, 90)),
    st.tuples(st.integers(0, 9), st.integers(0, 9)),
    st.lists(st.integers(1, 12), min_size=1, max_size=2),
)


@settings(max_examples=examples(20, 60))
@given(FILMS)
def test_a_pixel_is_the_block_that_a_painting_is_averaged_over(drawn: object) -> None:
    """A painting of the whole film holds in each pixel where that is; and the camera agrees."""
    use_variant()
    import mitsuba as mi

    crop, beyond, offset, factors = drawn  # type: ignore[misc]
    size = (crop[0] + offset[0] + beyond[0] - 1, crop[1] + offset[1] + beyond[1] - 1)
    film = full_film = Film(0, size, crop, offset)
    for factor in factors:
        if factor <= min(film.pixels):
            film = reduced(film, factor)
    (width, height), (columns, rows) = film.pixels, full_film.pixels
    # Sizes alone tell the rest.
    factor = whole_factor((rows, columns), (height, width))
    assert factor is not None
    assert factor >= np.prod([1, *(f for f in factors[:1] if f <= min(columns, rows))])
    if len(factors) == 1:
        assert reduction(full_film, f"{width}x{height}") == factor
    elif film.block * full_film.size[0] != factor * film.size[0]:
        return  # a size so small that other blocks are as many
    y, x = np.mgrid[:rows, :columns] + 0.5
    centres = block_mean(np.dstack([x, y]), factor).reshape(-1, 2)
    target = Target.of(np.dstack([x, y, x]).astype(np.float32)).fitted_to(
        (height, width), resize=False
    )
    np.testing.assert_allclose(target.image[..., :2].reshape(-1, 2), centres, rtol=1e-6)

    def directions(film: Film, places: np.ndarray) -> np.ndarray:
        camera = mi.load_dict({"type": "perspective", "fov": 40, "film": film.load()})
        scale = np.array(camera.film().crop_size())
        ray, _ = camera.sample_ray(0, 0, mi.Point2f(*map(mi.Float, (places / scale).T)), 0.5)
        return np.array(ray.d).T

    y, x = np.mgrid[:height, :width] + 0.5
    middles = np.dstack([x, y]).reshape(-1, 2) * film.block
    # Directions in float32.
    np.testing.assert_allclose(directions(film, middles), directions(full_film, centres), atol=2e-6)


def test_what_is_left_out_is_said(tmp_path: Path) -> None:
    scene = load_scene(write_room(tmp_path), parameters={"width": 23})
    small_film = Settings(resolution="1/3")
    small = on_film(scene, None, "1/3")
    assert remarks_of_film(scene, small_film) == []
    assert remarks_of_film(small, small_film) == [
        "film of 23x20 reduced to 7x6 blocks of 3x3 pixels: 2 columns of pixels at the right and 2 "
        "rows at the bottom are left over and ignored"
    ]
    assert remarks_of_film(scene.reduced("1/2"), small_film)[0].endswith(
        "11x10 blocks of 2x2 pixels: 1 column of pixels at the right is left over and ignored"
    )
    target = Target.of(np.ones((20, 23, 3)))
    assert remarks_of_target(target, small.size, None, Settings()) == [
        "target: 23x20 pixels averaged to the basis's 7x6: 2 columns of pixels at the right and 2 "
        "rows at the bottom are left over and ignored"
    ]
    thin = load_scene(write_room(tmp_path), parameters={"width": 700_000})
    [remark] = remarks_of_film(on_film(thin, "preview", None), Settings(quality="preview"))
    assert remark == (
        'the film cannot be reduced as far as quality="preview" asks: 35000x1 pixels are rendered'
    )


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
    # Not 2, the only one that leaves nothing over: an eighth of its pixels are wanted.
    assert preview.reduction(Film(0, (1366, 768), (1366, 768), (0, 0))) == 6
    assert reduction_to(Film(0, (1280, 720), (1280, 720), (0, 0)), 2**15) == 8
    assert final.reduction(FULL_HD) == 1
    scene = load_scene(write_room(tmp_path), parameters={"width": 4000})
    assert on_film(scene, None, None) is scene
    assert samples(None, spp=None, time_s=None) is None
    assert on_film(scene, "preview", None).size == (10, 2000)
    assert samples("preview", spp=None, time_s=None) == 32
    # What is given goes before the preset.
    assert on_film(scene, "preview", "1/4").size == (5, 1000)
    assert samples("preview", spp=3, time_s=None) == 3
    assert samples("preview", spp=None, time_s=1.0) is None


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("cropped", "factor", "size"),
    [(False, 4, (5, 6)), (True, 4, (2, 3)), (False, 5, (4, 4)), (True, 3, (2, 4))],
)
def test_a_small_pixel_is_the_mean_of_its_block(
    tmp_path: Path, cropped: bool, factor: int, size: tuple[int, int]
) -> None:
    film = "".join(
        f'<integer name="crop_{name}" value="{value}"/>'
        for name, value in {"width": 12, "height": 8, "offset_x": 8, "offset_y": 4}.items()
    )
    # Of a panel rare bright samples are all the noise, which few pixels cannot tell.
    lights = LIGHTS["bulb"] + LIGHTS["sun"] + LIGHTS["sky"]
    scene = load_scene(write_room(tmp_path, lights=lights, film=film if cropped else ""))
    small = scene.reduced(f"1/{factor}")
    assert small.identity == scene.identity
    assert small.size == size
    large = render(scene, spp=1024, stream=Stream.TEMPLATE)
    full_render = large.reduced(factor)
    neighbour = block_mean(np.roll(large.image, 1, axis=(0, 1)), factor)
    part = render(small, spp=4096, stream=Stream.VERIFICATION)
    basis = render_basis(small, spp=4096)
    assert basis.size == full_render.size
    present_look = basis.mix(basis.current_weights)
    weights = basis.current_weights.astype(np.float32)[:, None, None, :]
    noise = {
        "a render": np.square(part.half_difference, dtype=np.float64),
        "the basis": np.square((basis.half_differences * weights).sum(axis=0), dtype=np.float64),
    }
    for name, image in {"a render": part.image, "the basis": present_look}.items():
        gap = (full_render.image - image).astype(np.float64)
        squares = noise[name] + np.square(full_render.half_difference, dtype=np.float64)
        # Noise: four and a half standard errors of the sum, and of pixels in the mean square.
        assert abs(gap.sum()) <= 4.5 * np.sqrt(squares.sum()), name
        assert np.square(gap).sum() <= 4 * squares.sum(), name
        # A pixel further is another picture.
        assert np.square(neighbour - image).sum() > 4 * squares.sum(), name


def test_on_blocks_every_plane_is_what_mitsuba_makes_of_their_pixels(tmp_path: Path) -> None:
    """The one pass, separate renders and plain ones; one light, whose mean is most of its noise."""
    lights = LIGHTS["bulb"] + LIGHTS["panel"]
    scene = load_scene(write_room(tmp_path, lights=lights)).reduced("1/3")
    assert scene.film.block == 3
    together = render_basis(scene, spp=1024)
    separate = _render_one_by_one(scene, Budget(64), 0, None, Keeper(None), silent)
    assert separate.images.shape == together.images.shape == (2, 6, 8, 3)
    # Nine samples at least, one in each pixel of a block, for each of the halves.
    assert separate.origin.halves == (36, 36)
    for k in range(2):
        gap = together.images[k].astype(np.float64) - separate.images[k]
        squares = np.square(together.half_differences[k], dtype=np.float64)
        squares += np.square(separate.half_differences[k], dtype=np.float64)
        # Noise: four and a half standard errors of the sum, and of pixels in the mean square.
        assert abs(gap.sum()) <= 4.5 * np.sqrt(squares.sum())
        assert np.square(gap).sum() <= 10 * squares.sum()
    assert (together.emitters_seen == separate.emitters_seen).mean() > 0.9
    small, full_surfaces = render_surfaces(scene), render_surfaces(load_scene(scene.path))
    assert small.depth.shape == scene.size
    for name, coverage in full_surfaces.coverage.items():
        # Noise of 18 samples a pixel, at the edges.
        assert np.abs(small.coverage[name] - block_mean(coverage, 3)).mean() < 0.03


def test_equal_sensors_without_ids_are_a_clear_error(tmp_path: Path) -> None:
    """Mitsuba makes one of them."""
    sensor = '<sensor type="perspective"><float name="fov" value="60"/></sensor>'
    path = write_room(tmp_path, sensors=2 * sensor)
    with pytest.raises(SceneError, match="two sensors are equal and have no id"):
        load_scene(path, sensor=1)


FILMS = st.builds(
    lambda size, share, start: Film(
        0,
        size,
        tuple(max(1, int(side * part)) for side, part in zip(size, share, strict=True)),
        tuple(
            int((side - max(1, int(side * part))) * at)
            for side, part, at in zip(size, share, start, strict=True)
        ),
    ),
    st.tuples(st.integers(2, 4000), st.integers(2, 4000)),
    st.tuples(st.floats(0.1, 1), st.floats(0.1, 1)),
    st.tuples(st.floats(0, 1), st.floats(0, 1)),
)


@given(FILMS, st.integers(16, 8000))
def test_a_film_of_another_width_has_the_same_frame(film: Film, width: int) -> None:
    """Each side of its frame is where that of the film is, up to a pixel."""
    if width * width * film.crop_size[1] > MAX_PIXELS * film.crop_size[0]:
        return
    wide = with_width(film, width)
    assert wide.pixels[0] == width
    factor = width / film.crop_size[0]
    for axis in (0, 1):
        low, high = (wide.crop_offset[axis], wide.crop_offset[axis] + wide.crop_size[axis])
        assert abs(low - factor * film.crop_offset[axis]) <= 0.5
        end = factor * (film.crop_offset[axis] + film.crop_size[axis])
        assert abs(high - end) <= 1
        assert high <= wide.size[axis]
        assert abs(wide.size[axis] - factor * film.size[axis]) <= 1.5


def test_a_whole_multiple_of_a_film_is_exact() -> None:
    film = Film(1, (640, 360), (320, 100), (40, 20), block=5)
    assert with_width(film, 960) == Film(1, (1920, 1080), (960, 300), (120, 60))
    with pytest.raises(SceneError, match="at most"):
        with_width(film, 2**16)
