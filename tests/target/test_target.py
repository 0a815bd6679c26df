"""Targets: what they refuse, and resampling in linear light under importance."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.colour.primaries import encode_display
from lightpaint.errors import SizeError, TargetError
from lightpaint.images.formats.exr import read_parts
from lightpaint.lighting.default_solve import solve
from lightpaint.target.painted_target import Target
from lightpaint.target.target_reader import read_target
from lightpaint.target.template import write_look

# Resampling runs in float32.
PRECISION = 1e-6


def _target(image: Any, importance: Any) -> Target:
    image, importance = np.asarray(image, np.float32), np.asarray(importance, np.float32)
    return Target("painted", image, importance, everything=False)


def _random(height: int, width: int) -> Target:
    rng = np.random.default_rng(0)
    importance = rng.random((height, width)) * (rng.random((height, width)) < 0.6)
    importance[0, 0] = 1
    return _target(rng.random((height, width, 3)), importance)


def test_image_and_importance_of_different_sizes():
    with pytest.raises(SizeError, match="differ in size"):
        _target(np.ones((4, 3, 3)), np.ones((3, 4)))


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_pixels_must_be_finite(bad: float):
    image = np.ones((3, 3, 3))
    image[1, 1, 1] = bad
    with pytest.raises(TargetError, match="NaN or Inf in 1 of 9 pixels"):
        _target(image, np.ones((3, 3)))


@pytest.mark.parametrize("bad", [np.nan, np.inf, -0.5])
def test_importance_must_be_finite_and_not_negative(bad: float):
    importance = np.ones((3, 3))
    importance[1, 1] = bad
    with pytest.raises(TargetError, match="finite and not negative"):
        _target(np.ones((3, 3, 3)), importance)


def test_a_target_of_arrays():
    image, mask = np.full((3, 4, 3), 0.25), np.zeros((3, 4), bool)
    mask[1, 2] = True
    full_target, part = Target.of(image), Target.of(image, mask, name="lamp")
    assert (full_target.name, full_target.everything, part.name, part.everything) == (
        *("target", True),
        *("lamp", False),
    )
    for target in (full_target, part):
        assert (target.image.dtype, target.importance.dtype) == (np.float32, np.float32)
        np.testing.assert_array_equal(target.image, image)
    np.testing.assert_array_equal(full_target.importance, 1)
    np.testing.assert_array_equal(part.importance, mask)
    image[:], mask[:] = 7, True  # whoever goes on painting changes no target
    assert part.image.max() == 0.25
    assert part.importance.sum() == 1


@pytest.mark.parametrize(
    ("image", "importance", "complaint"),
    [
        (np.ones((3, 4)), None, r"\(3, 4\): expected \(height, width, 3\)"),
        (np.ones((3, 4, 4)), None, r"\(3, 4, 4\)"),
        (np.ones((0, 4, 3)), None, r"\(0, 4, 3\)"),
        (np.ones((3, 4, 3), np.uint8), None, "of uint8: expected floats"),
        (np.ones((3, 4, 3), object), None, "of object: expected floats"),
        (np.full((3, 4, 3), 1e39), None, "NaN or Inf in 12 of 12 pixels"),  # too much for float32
        (np.full((3, 4, 3), 1e-38), None, r"light up to 1e-38 .* in another unit"),
        (np.full((3, 4, 3), 1e30), None, r"light up to 1e\+30 .* in another unit"),
        (np.ones((3, 4, 3)), np.ones((4, 3)), "differ in size"),
        (np.ones((3, 4, 3)), np.ones((3, 4, 1)), "differ in size"),
        (np.ones((3, 4, 3)), np.full((3, 4), "x"), "expected numbers"),
        (np.ones((3, 4, 3)), -np.ones((3, 4), int), "not negative"),
        (np.ones((3, 4, 3)), np.zeros((3, 4), bool), "importance 0 everywhere"),
    ],
)
def test_arrays_that_are_no_target(image: Any, importance: Any, complaint: str):
    with pytest.raises(TargetError, match=f"^target mine.*{complaint}"):
        Target.of(image, importance, name="mine")


def test_a_target_is_shown_in_a_few_lines():
    image = np.zeros((1, 8, 3))
    image[0, 1] = 1, 2, 3
    target = Target.of(image, [[1, 1, 0, 0, 0, 0, 0, 0]], name="dusk")
    text = repr(target)
    assert text.splitlines() == [
        "Target 'dusk', 8x1",
        "  counts   25 % of the pixels",
        "  light    0 to 3",
    ]
    target = replace(
        target,
        at_least=image == 2,
        transform=ViewTransform("agx", 1.5),
        notes=("painted on nothing",),
    )
    assert repr(target).splitlines() == [
        *text.splitlines(),
        "  at least 50 % of what counts, or anything brighter",
        "  seen     through agx at +1.5 stops",
        "  note     painted on nothing",
    ]


def test_something_must_count():
    with pytest.raises(TargetError, match="importance 0 everywhere"):
        _target(np.ones((3, 3, 3)), np.zeros((3, 3)))


def test_its_own_size_changes_nothing():
    target = _random(6, 8)
    assert target.resized((6, 8)) is target
    assert target.fitted_to((6, 8), resize=False) is target


def test_another_size_only_if_allowed():
    target = _random(6, 8)
    with pytest.raises(SizeError, match=r"painted is 8x6 but the basis is 12x9.*resize=True"):
        target.fitted_to((9, 12), resize=False)
    assert target.fitted_to((9, 12), resize=True).size == (9, 12)


@pytest.mark.parametrize("resize", [True, False])
def test_a_whole_multiple_is_reduced_to_weighted_means(resize: bool):
    target = _random(6, 8)
    reduced = target.fitted_to((3, 4), resize=resize)
    for y, x in np.ndindex(3, 4):
        block = np.s_[2 * y : 2 * y + 2, 2 * x : 2 * x + 2]
        weight = target.importance[block].astype(np.float64)
        if weight.any():
            mean = (weight[..., None] * target.image[block]).sum(axis=(0, 1)) / weight.sum()
            np.testing.assert_allclose(reduced.image[y, x], mean, rtol=PRECISION)
        np.testing.assert_allclose(reduced.importance[y, x], weight.mean(), rtol=PRECISION)


def test_the_reduced_problem_is_the_same_problem():
    """For images that are constant in blocks, residuals differ by a constant alone."""
    target, rng = _random(8, 12), np.random.default_rng(4)
    reduced = target.fitted_to((2, 3), resize=False)
    gaps = []
    for _ in range(3):
        small = rng.random((2, 3, 3))
        large = np.kron(small, np.ones((4, 4, 1)))
        full_loss = (target.importance[..., None] * (large - target.image) ** 2).sum()
        part = (reduced.importance[..., None] * (small - reduced.image) ** 2).sum()
        gaps.append(full_loss - 16 * part)
    np.testing.assert_allclose(gaps, gaps[0], rtol=1e-4)


def test_a_multiple_in_one_direction_or_two_different_ones_is_refused():
    for size in ((6, 4), (3, 8), (2, 4)):
        with pytest.raises(SizeError):
            _random(6, 8).fitted_to(size, resize=False)


@pytest.mark.parametrize("size", [(3, 4), (12, 16), (5, 11), (1, 1), (7, 3)])
def test_a_constant_image_stays_constant(size: tuple[int, int]):
    colour = np.array([0.25, 1.5, 40.0], np.float32)
    resized = _target(np.broadcast_to(colour, (6, 8, 3)), _random(6, 8).importance).resized(size)
    assert resized.size == size
    assert resized.image.dtype == resized.importance.dtype == np.float32
    counts = resized.importance > 0
    assert counts.any()
    np.testing.assert_allclose(
        resized.image[counts], np.broadcast_to(colour, (counts.sum(), 3)), rtol=PRECISION
    )


@pytest.mark.parametrize("size", [(3, 4), (12, 16), (5, 11), (1, 1)])
def test_constant_importance_stays_constant(size: tuple[int, int]):
    target = _target(_random(6, 8).image, np.full((6, 8), 0.75))
    np.testing.assert_allclose(target.resized(size).importance, 0.75, rtol=PRECISION)


@pytest.mark.parametrize("factor", [2, 3])
def test_shrinking_is_the_mean_over_blocks_by_importance(factor: int):
    target = _random(12, 18)
    height, width = 12 // factor, 18 // factor

    def block_sums(values: Any) -> Any:
        blocks = values.astype(np.float64).reshape(height, factor, width, factor, -1)
        return blocks.sum(axis=(1, 3))

    a = target.importance[..., None]
    sums, total = block_sums(a * target.image), block_sums(a)
    resized = target.resized((height, width))
    np.testing.assert_allclose(resized.importance, total[..., 0] / factor**2, rtol=PRECISION)
    counts = total[..., 0] > 0
    expected = sums[counts] / total[counts]
    np.testing.assert_allclose(resized.image[counts], expected, rtol=PRECISION)


def test_what_does_not_count_never_bleeds_in():
    """Paint beside pixels of no importance keeps its colour, however bright those are."""
    image = np.full((8, 8, 3), 1e6)
    image[:, 3:] = 0.5
    importance = np.zeros((8, 8))
    importance[:, 3:] = 1
    for size in ((4, 4), (5, 5), (16, 16), (13, 13)):
        resized = _target(image, importance).resized(size)
        counts = resized.importance > 0
        np.testing.assert_allclose(resized.image[counts], 0.5, rtol=PRECISION)


def test_resampling_keeps_everything_else():
    target = Target("x", np.ones((4, 4, 3)), np.ones((4, 4)), everything=True, not_finite=3)
    resized = target.resized((2, 2))
    assert (resized.name, resized.everything, resized.not_finite) == ("x", True, 3)


def test_template(tmp_path: Any):
    image = np.random.default_rng(0).random((4, 5, 3)).astype(np.float32)
    picture = write_look(tmp_path / "a.template.exr", image, ViewTransform("srgb"))
    assert picture == tmp_path / "a.template.png"
    np.testing.assert_array_equal(read_parts(tmp_path / "a.template.exr")[0].rgb(), image)
    from PIL import Image

    with Image.open(picture) as png:
        # Pillow reads the upper 8 of the 16 bits.
        np.testing.assert_allclose(np.asarray(png) / 255, encode_display(image), atol=1.001 / 255)


@pytest.mark.parametrize(
    "transform",
    [
        ViewTransform("srgb", 1.0),
        ViewTransform("agx", 1.5),
        ViewTransform("filmic", -0.25),
        ViewTransform("linear"),
    ],
)
def test_a_painted_template_is_read_through_its_own_view(tmp_path: Any, transform: ViewTransform):
    image = np.exp2(np.random.default_rng(0).uniform(-4, 2, (9, 7, 1))) * [[[0.8, 0.9, 1]]] / 64
    picture = write_look(tmp_path / "a.template.exr", image, transform)
    target = read_target(picture)
    display = transform.encode(image)
    np.testing.assert_array_equal(target.at_least, display >= 65534.5 / 65535)
    # What 16 bits round away in display values.
    np.testing.assert_allclose(transform.encode(target.image), display, atol=0.51 / 65535)


@pytest.mark.parametrize("size", [(4, 6), (6, 9), (1, 1), (5, 7), (11, 17), (7, 9)])
def test_what_means_at_least_in_most_of_a_pixel_means_it_of_its_mean(size: tuple[int, int]):
    """Of what is marked, nothing is more than a pixel wide: no patch."""
    rng = np.random.default_rng(3)
    at_least = np.zeros((12, 18, 3), bool)
    at_least[1::3, ::2] = rng.random((4, 9, 3)) < 0.7
    at_least[2::3, ::2] = at_least[1::3, ::2]
    image, importance = rng.random((12, 18, 3)), rng.choice([0.0, 1.0, 2.0], (12, 18))
    target = replace(_target(image, importance), at_least=at_least)
    # How much of a pixel's importance comes from what is marked.
    marked = [_target(image, importance * at_least[..., k]).resized(size) for k in range(3)]
    resized = target.resized(size)
    counts = np.maximum(resized.importance, 1e-6)[..., None]
    share = np.dstack([part.importance for part in marked]) / counts
    clear = abs(share - 0.5) > 1e-4
    assert (share < 0.5).any()
    assert size == (1, 1) or (share > 0.5).any()
    np.testing.assert_array_equal(resized.at_least[clear], share[clear] > 0.5)
    if factor := {(4, 6): 3, (6, 9): 2}.get(size):
        np.testing.assert_array_equal(target.reduced(factor).at_least, resized.at_least)
    assert target.reduced(1).at_least is at_least


@pytest.mark.parametrize(
    "size", [(4, 6), (6, 9), (1, 1), (5, 7), (11, 17), (7, 9), (24, 36), (13, 19)]
)
def test_a_patch_at_least_is_at_least_in_all_that_it_has_a_share_in(size: tuple[int, int]):
    """And in nothing else: a pixel beyond it would lose its say for nothing."""
    for y, x in ((0, 0), (5, 9), (9, 15), (6, 3)):
        at_least = np.zeros((12, 18, 3), bool)
        at_least[y : y + 3, x : x + 3, 1] = True
        image = at_least.astype(np.float32)
        target = replace(_target(image, np.ones((12, 18))), at_least=at_least).resized(size)
        assert target.at_least is not None
        assert not target.at_least[..., [0, 2]].any()
        np.testing.assert_array_equal(target.at_least[..., 1], target.image[..., 1] > 0)


def test_a_patch_that_does_not_count_says_nothing():
    at_least = np.zeros((12, 12, 3), bool)
    at_least[2:7, 2:7] = True
    importance = np.ones((12, 12))
    importance[at_least[..., 0]] = 0
    target = replace(_target(np.ones((12, 12, 3)), importance), at_least=at_least)
    assert not target.reduced(4).at_least.any()
    assert not target.resized((5, 5)).at_least.any()


def _pools(side: int) -> tuple[Any, Any]:
    """Images (3, side, side, 3) of three smooth lights, and what no light can do."""
    y, x = np.mgrid[:side, :side] / side
    places = np.random.default_rng(0).random((3, 2))
    pools = [np.exp(-((x - a) ** 2 + (y - b) ** 2) / 0.1) for a, b in places]
    detail = 1 + 0.5 * np.sin(9 * x) * np.cos(7 * y)
    return np.stack(pools)[..., None] * np.ones(3), detail[..., None]


def _weights_of_both_sizes(make_basis: Any, images: Any, painted: Any) -> tuple[Any, Any]:
    """Of a painting of 8 bits, white at 1: at full size, and on blocks of 8 x 8."""
    side = painted.shape[0]
    target = _target(np.minimum(painted, 1), np.ones((side, side)))
    target = replace(target, at_least=painted >= 1)
    blocks = images.reshape(len(images), side // 8, 8, side // 8, 8, 3).mean(axis=(2, 4))
    weights = []
    for basis in (make_basis(images=images), make_basis(images=blocks)):
        fitted = target.fitted_to(basis.size, resize=False)
        weights.append(solve(basis, fitted).lighting.weights_for(basis))
    return weights[0], weights[1]


@pytest.mark.parametrize("share", [0.02, 0.3])
def test_white_speckles_do_not_brighten_the_answer_on_a_reduced_film(make_basis: Any, share: float):
    images, detail = _pools(96)
    painted = np.einsum("nhwc,n->hwc", images, [0.5, 0.4, 0.3]) * detail
    painted[np.random.default_rng(1).random((96, 96)) < share] = 1
    full, reduced = _weights_of_both_sizes(make_basis, images, painted)
    # What the means over blocks of these pools change by themselves is 0.3 %.
    np.testing.assert_allclose(reduced, full, rtol=0.01)


@pytest.mark.parametrize("radius", [0.08, 0.03])
def test_a_lamp_painted_white_is_not_dimmed_by_a_reduced_film(make_basis: Any, radius: float):
    """Blocks at its edge are far brighter than the mean of white and what is around it."""
    images, detail = _pools(96)
    y, x = np.mgrid[:96, :96] / 96
    images[0][(x - 0.52) ** 2 + (y - 0.47) ** 2 < radius**2] += 50
    painted = np.einsum("nhwc,n->hwc", images, [0.5, 0.4, 0.3]) * detail
    full, reduced = _weights_of_both_sizes(make_basis, images, painted)
    # Blocks at its edge say less than their pixels did. By their means it would be off by 0.9.
    np.testing.assert_allclose(reduced, full, rtol=0.05)


def test_at_least_has_the_images_size():
    with pytest.raises(SizeError, match="at_least"):
        replace(_random(4, 5), at_least=np.zeros((4, 5), bool))


def test_a_target_without_a_name_is_called_the_target() -> None:
    with pytest.raises(TargetError, match=r"^the target has importance 0 everywhere"):
        Target.of(np.ones((2, 2, 3)), np.zeros((2, 2)))
