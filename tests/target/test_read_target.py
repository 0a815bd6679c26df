"""Reading paintings and masks: which channel counts, and what is refused."""

from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest

from lightpaint.colour.primaries import colour_science
from lightpaint.errors import ImageError, SizeError, TargetError
from lightpaint.images.formats.exr import ExrPart, rgb_channels, write_parts
from lightpaint.target.target_reader import read_target

SIZE = (6, 5)


@pytest.fixture
def image() -> Any:
    return np.random.default_rng(0).random((*SIZE, 3)).astype(np.float32)


@pytest.fixture
def alpha() -> Any:
    """Importances of 0, of 1 and powers of two between, by which float32 divides exactly."""
    return np.random.default_rng(1).choice([0, 0.125, 0.5, 1], SIZE).astype(np.float32)


@pytest.fixture
def write(tmp_path: Path) -> Any:
    """A function that writes one part of these channels and returns its path."""

    def write(name: str = "look.exr", rgb: Any = None, **channels: Any) -> Path:
        colours = {} if rgb is None else rgb_channels(rgb)
        write_parts(tmp_path / name, [ExrPart("paint", colours | channels)])
        return tmp_path / name

    return write


def test_rgb_alone_counts_everywhere(write: Any, image: Any):
    target = read_target(write("evening light.exr", image))
    assert target.name == "evening light"
    assert target.everything
    assert target.not_finite == 0
    np.testing.assert_array_equal(target.image, image)
    np.testing.assert_array_equal(target.importance, 1)


def test_half_float_paintings(write: Any, image: Any):
    channels = {c: image[..., k].astype(np.float16) for k, c in enumerate("RGB")}
    target = read_target(write(**channels))
    assert target.image.dtype == target.importance.dtype == np.float32
    np.testing.assert_array_equal(target.image, image.astype(np.float16))


def test_alpha_is_importance_and_premultiplied(write: Any, image: Any, alpha: Any):
    target = read_target(write(rgb=image * alpha[..., None], A=alpha))
    assert not target.everything
    np.testing.assert_array_equal(target.importance, alpha)
    np.testing.assert_array_equal(target.image[alpha > 0], image[alpha > 0])
    np.testing.assert_array_equal(target.image[alpha == 0], 0)


def test_the_weight_channel_leaves_rgb_alone(write: Any, image: Any, alpha: Any):
    weight = alpha * 3
    target = read_target(write(rgb=image, W=weight))
    assert not target.everything
    np.testing.assert_array_equal(target.importance, weight)
    np.testing.assert_array_equal(target.image, image)


def test_the_weight_channel_goes_before_alpha(write: Any, image: Any, alpha: Any):
    target = read_target(write(rgb=image, W=alpha, A=np.full(SIZE, 0.5, np.float32)))
    np.testing.assert_array_equal(target.importance, alpha)
    np.testing.assert_array_equal(target.image, image)


def test_the_mask_goes_before_both(write: Any, image: Any, alpha: Any):
    mask = write("mask.exr", Y=alpha)
    ones = np.ones(SIZE, np.float32)
    for others in ({}, {"A": ones}, {"W": ones}, {"A": ones, "W": ones}):
        target = read_target(write(rgb=image, **others), mask=mask)
        assert not target.everything
        np.testing.assert_array_equal(target.importance, alpha)
        np.testing.assert_array_equal(target.image, image)


def test_with_a_mask_rgb_stays_premultiplied_by_alpha(write: Any, image: Any, alpha: Any):
    path = write(rgb=image * alpha[..., None], A=alpha)
    mask = np.full(SIZE, 0.5, np.float32)
    target = read_target(path, mask=write("mask.exr", Y=mask))
    np.testing.assert_array_equal(target.importance[alpha > 0], 0.5)
    np.testing.assert_array_equal(target.image[alpha > 0], image[alpha > 0])


def test_a_mask_paints_nothing_where_alpha_is_zero(write: Any, image: Any, alpha: Any):
    """There RGB is undefined: it must not come to count as painted black."""
    assert (alpha == 0).any()
    mask = write("mask.exr", Y=np.ones(SIZE, np.float32))
    target = read_target(write(rgb=image * alpha[..., None], A=alpha), mask=mask)
    np.testing.assert_array_equal(target.importance, alpha > 0)
    assert target.importance.dtype == np.float32
    # Beside a W channel RGB is not premultiplied, and alpha has no say.
    target = read_target(write(rgb=image, A=alpha, W=alpha), mask=mask)
    np.testing.assert_array_equal(target.importance, 1)


MASK_CHANNELS = ["Y", "W", "A", "R"]


@pytest.mark.parametrize("first", range(4))
def test_channels_of_a_mask(write: Any, image: Any, alpha: Any, first: int):
    """The first of Y, W, A, R that is there; what comes after it is not looked at."""
    decoys = {name: np.full(SIZE, 9, np.float32) for name in MASK_CHANNELS[first + 1 :]}
    mask = write("mask.exr", **{MASK_CHANNELS[first]: alpha}, **decoys)
    target = read_target(write(rgb=image), mask=mask)
    np.testing.assert_array_equal(target.importance, alpha)


def test_a_mask_without_any_of_them(write: Any, image: Any, alpha: Any):
    with pytest.raises(ImageError, match=r"mask\.exr has none .*: it has G, Z"):
        read_target(write(rgb=image), mask=write("mask.exr", Z=alpha, G=alpha))


def test_a_mask_of_another_size(write: Any, image: Any):
    mask = write("mask.exr", Y=np.ones((5, 6), np.float32))
    with pytest.raises(SizeError, match=r"mask .*mask\.exr is 6x5 but the target .* is 5x6"):
        read_target(write(rgb=image), mask=mask)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("with_alpha", [False, True])
def test_pixels_that_are_not_finite_count_nothing(
    write: Any, image: Any, bad: float, with_alpha: bool
):
    image[0, 1, 0] = image[2, 3] = bad
    channels = {"A": np.ones(SIZE, np.float32)} if with_alpha else {}
    target = read_target(write(rgb=image, **channels))
    assert target.not_finite == 2
    expected = np.ones(SIZE)
    expected[0, 1] = expected[2, 3] = 0
    np.testing.assert_array_equal(target.importance, expected)
    assert target.everything is not with_alpha
    np.testing.assert_array_equal(target.image[expected == 1], image[expected == 1])


def test_an_alpha_too_small_to_divide_by(write: Any, image: Any):
    """Colour over next to no alpha leaves the range of float32: no importance, no warning."""
    alpha = np.ones(SIZE, np.float32)
    alpha[1, 1] = 1e-39
    target = read_target(write(rgb=image, A=alpha))
    assert target.not_finite == 1
    assert target.importance[1, 1] == 0


def test_negative_colours_are_legitimate(write: Any, image: Any):
    np.testing.assert_array_equal(read_target(write(rgb=-image)).image, -image)


@pytest.mark.parametrize("channel", ["A", "W"])
@pytest.mark.parametrize(
    ("value", "message"),
    [(-0.25, "between -0.25 and 1"), (np.nan, "finite"), (np.inf, "finite")],
)
def test_importance_that_makes_no_sense(
    write: Any, image: Any, channel: str, value: float, message: str
):
    values = np.ones(SIZE, np.float32)
    values[3, 3] = value
    with pytest.raises(TargetError, match=message):
        read_target(write(rgb=image, **{channel: values}))
    with pytest.raises(TargetError, match=message):
        read_target(write(rgb=image), mask=write("mask.exr", Y=values))


def test_importance_of_nothing(write: Any, image: Any):
    black = np.zeros(SIZE, np.float32)
    for path, mask in [
        (write("a.exr", image, A=black), None),
        (write("w.exr", image, W=black), None),
        (write("m.exr", image), write("mask.exr", Y=black)),
    ]:
        with pytest.raises(TargetError, match=f"{path.name} has importance 0 everywhere"):
            read_target(path, mask=mask)
    with pytest.raises(TargetError, match=r"nan\.exr holds NaN or Inf in every pixel"):
        read_target(write("nan.exr", image * np.nan))


def _write_declared(path: Path, image: Any, chromaticities: Any) -> Path:
    header = {"type": OpenEXR.scanlineimage, "chromaticities": chromaticities}
    channels = {name: np.ascontiguousarray(c) for name, c in rgb_channels(image).items()}
    OpenEXR.File(header, channels).write(str(path))
    return path


REC709 = (0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329)
REC2020 = (0.708, 0.292, 0.17, 0.797, 0.131, 0.046, 0.3127, 0.329)
ACESCG = (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767)


@pytest.mark.parametrize(("space", "primaries"), [("ITU-R BT.2020", REC2020), ("ACEScg", ACESCG)])
def test_other_primaries_are_converted(tmp_path: Path, image: Any, space: str, primaries: Any):
    path = _write_declared(tmp_path / "wide.exr", image, primaries)
    rec709, other = (colour_science().RGB_COLOURSPACES[n] for n in ("ITU-R BT.709", space))
    expected = colour_science().RGB_to_RGB(
        image, other, rec709, chromatic_adaptation_transform="Bradford"
    )
    # The primaries are stored in float32, and colour-science has whites of five decimals.
    np.testing.assert_allclose(read_target(path).image, expected, rtol=0, atol=2e-5)


@pytest.mark.parametrize("primaries", [REC709, (*REC709[:6], 0.3127, 0.3291)])
def test_rec709_may_be_declared(tmp_path: Path, image: Any, primaries: Any):
    path = _write_declared(tmp_path / "look.exr", image, primaries)
    np.testing.assert_array_equal(read_target(path).image, image)


def test_no_rgb(write: Any, alpha: Any):
    with pytest.raises(ImageError, match=r"look\.exr is not an RGB image: .*; it has G, R, Z"):
        read_target(write(R=alpha, G=alpha, Z=alpha))


def test_luminance_alone_is_grey(write: Any, alpha: Any):
    target = read_target(write(Y=alpha))
    np.testing.assert_array_equal(target.image, np.repeat(alpha[..., None], 3, axis=-1))


def test_several_parts(tmp_path: Path, write: Any, image: Any):
    path = tmp_path / "parts.exr"
    write_parts(
        path, [ExrPart("left", rgb_channels(image)), ExrPart("right", rgb_channels(-image))]
    )
    with pytest.raises(ImageError, match=r"parts\.exr has 2 layers \(left, right\).*layer=\.\.\."):
        read_target(path)
    np.testing.assert_array_equal(read_target(path, layer="right").image, -image)
    with pytest.raises(ImageError, match=r"has no layer 'middle': it has left, right"):
        read_target(path, layer="middle")
    with pytest.raises(ImageError, match=r"mask .*parts\.exr has 2 parts \(left, right\)"):
        read_target(write(rgb=image), mask=path)


def test_no_file(tmp_path: Path, write: Any, image: Any):
    with pytest.raises(ImageError, match="no such image file"):
        read_target(tmp_path / "none.exr")
    with pytest.raises(ImageError, match="no such image file"):
        read_target(str(write(rgb=image)), mask=str(tmp_path / "none.exr"))


@pytest.mark.parametrize("alpha", [True, False])
@pytest.mark.parametrize("window", [(2, 1, 6, 5), (-3, -2, 12, 9), (4, 3, 30, 20), (-5, -5, 3, 2)])
def test_a_cropped_or_padded_picture_lies_where_it_was_painted(
    tmp_path: Path, window: tuple[int, int, int, int], alpha: bool
) -> None:
    height, width = 8, 10
    x0, y0, x1, y1 = window
    # Every pixel knows its place.
    yy, xx = np.mgrid[y0 : y1 + 1, x0 : x1 + 1].astype(np.float32)
    channels = {"R": yy, "G": xx, "B": yy * 0 + 1}
    if alpha:
        channels["A"] = yy * 0 + 1
    header = {
        "type": OpenEXR.scanlineimage,
        "dataWindow": (np.array([x0, y0], np.int32), np.array([x1, y1], np.int32)),
        "displayWindow": (np.zeros(2, np.int32), np.array([width - 1, height - 1], np.int32)),
    }
    OpenEXR.File(header, channels).write(str(tmp_path / "cropped.exr"))
    target = read_target(tmp_path / "cropped.exr")
    assert target.size == (height, width)
    y, x = np.mgrid[:height, :width]
    is_inside = (y >= y0) & (y <= y1) & (x >= x0) & (x <= x1)
    np.testing.assert_array_equal(target.importance, is_inside)
    np.testing.assert_array_equal(target.image[is_inside][:, 0], y[is_inside])
    np.testing.assert_array_equal(target.image[is_inside][:, 1], x[is_inside])
    # A mask does not paint what is not there.
    write_parts(tmp_path / "mask.exr", [ExrPart("", {"Y": np.full((height, width), 0.5, "f4")})])
    target = read_target(tmp_path / "cropped.exr", mask=tmp_path / "mask.exr")
    np.testing.assert_array_equal(target.importance, 0.5 * is_inside)


def test_paint_below_black_is_remarked_on(write: Any, image: Any):
    image[0, :3] = -0.25
    [note] = [x for x in read_target(write(rgb=image)).notes if "negative" in x]
    assert note.startswith(
        f"a negative luminance in 3 of {image[..., 0].size} pixels, down to -0.25"
    )
    assert not [x for x in read_target(write(rgb=abs(image))).notes if "negative" in x]
