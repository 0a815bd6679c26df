"""Masks of what is selected, and strokes that keep to them."""

import math
from typing import Any

import numpy as np
import pytest
from nightly import nightly

H, W = 64, 80

MODULES = """
  const polygon = await import('/engine/selection/polygon_mask.js');
  const masks = await import('/engine/selection/mask_operations.js');
  const shown = await import('/engine/selection/shown_masks.js');
  const hand = await import('/engine/stroke.js');
"""


def run(page: Any, script: str, given: Any = None) -> Any:
    """Run a script with the modules and `given` in scope, and return its result."""
    return page.evaluate(
        f"async ([H, W, given]) => {{ {MODULES} const size = [H, W]; {script} }}", [H, W, given]
    )


def mask_of(page: Any, script: str, given: Any = None) -> np.ndarray:
    return np.array(run(page, f"return [...({script})]", given)).reshape(H, W)


def random_mask(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    mask = rng.integers(0, 256, (H, W))
    mask[rng.random((H, W)) < 0.3] = 0
    mask[:, 60:] = 0
    return mask


def test_rectangles_are_exact_and_ellipses_have_their_area(page: Any) -> None:
    whole = mask_of(page, "polygon.polygonMask(polygon.rectangle([30, 40], [10, 20]), size)")
    expected = np.zeros((H, W))
    expected[20:40, 10:30] = 255
    np.testing.assert_array_equal(whole, expected)
    parts = mask_of(page, "polygon.polygonMask(polygon.rectangle([-5, 2.5], [3.25, 99]), size)")
    np.testing.assert_array_equal(parts[2, :4], [128, 128, 128, 32])
    assert parts[H - 1].sum() == 3 * 255 + 64
    ring = mask_of(page, "polygon.polygonMask(polygon.ellipse([10, 10], [60, 50]), size)")
    assert ring.sum() / 255 == pytest.approx(math.pi * 25 * 20, rel=2e-3)
    # A lasso that crosses itself encloses both of its loops, whichever way they turn.
    star = "[[10, 10], [50, 10], [10, 50], [50, 50]]"
    loops = mask_of(page, f"polygon.polygonMask({star}, size)")
    assert loops[12, 30] == loops[48, 30] == 255
    assert loops[30, 12] == 0
    twice = "[[10, 10], [50, 10], [50, 50], [10, 50], [10, 10], [50, 10], [50, 50], [10, 50]]"
    assert mask_of(page, f"polygon.polygonMask({twice}, size)").sum() == 40 * 40 * 255


def test_masks_are_joined_and_inverted_as_sets(page: Any) -> None:
    a, b = random_mask(0), random_mask(1)
    script = """
      const [a, b] = given.map((mask) => Uint8Array.from(mask));
      const { joined, inverted, boundsOf, cropped } = masks;
      const none = (mask) => [...mask];
      return [joined(a, b, 'replace'), joined(a, b, 'add'), joined(a, b, 'subtract'),
        joined(a, b, 'intersect'), joined(null, b, 'add'), joined(null, b, 'subtract'),
        inverted(inverted(a)), boundsOf(a, size), cropped(a, size, boundsOf(a, size)),
        boundsOf(a.fill(0), size)].map((made) => made && [...made]);
    """
    made = run(page, script, [a.ravel().tolist(), b.ravel().tolist()])
    for k, expected in enumerate(
        (b, np.maximum(a, b), np.minimum(a, 255 - b), np.minimum(a, b), b, 255 - b, a)
    ):
        np.testing.assert_array_equal(np.reshape(made[k], (H, W)), expected)
    top, bottom, left, right = made[7]
    np.testing.assert_array_equal(
        np.reshape(made[8], (bottom - top, -1)), a[top:bottom, left:right]
    )
    assert a.sum() == sum(made[8])
    assert right == 60
    assert made[9] is None


def test_edges_are_feathered_around_their_place_and_not_at_the_edge_of_the_picture(
    page: Any,
) -> None:
    mask = random_mask(2)
    same = mask_of(page, "masks.feathered(Uint8Array.from(given), size, 0)", mask.ravel().tolist())
    np.testing.assert_array_equal(same, mask)
    half = np.zeros((H, W), int)
    half[:, :40] = 255
    for pixels in (1, 2, 4, 12):
        soft = mask_of(
            page, f"masks.feathered(Uint8Array.from(given), size, {pixels})", half.ravel().tolist()
        )
        assert (soft == soft[0]).all()
        assert (np.diff(soft[0]) <= 0).all()
        np.testing.assert_allclose(soft[0, 39] + soft[0, 40], 255, atol=1)
        assert soft[0, 0] == 255
        # Where a Gaussian of half that width is 2 % and 98 %.
        deviation = np.sqrt(np.sum(-np.diff(soft[0]) * (np.arange(1, W) - 40) ** 2) / 255)
        assert deviation == pytest.approx(pixels / 2, abs=0.35)


def test_a_mask_grows_in_a_circle_and_shrinks_by_the_same(page: Any) -> None:
    dot = np.zeros((H, W), int)
    dot[30, 40], dot[0, 0] = 255, 90
    grown = mask_of(page, "masks.grown(Uint8Array.from(given), size, 7)", dot.ravel().tolist())
    y, x = np.mgrid[:H, :W]
    expected = np.where((y - 30) ** 2 + (x - 40) ** 2 <= 7.5**2, 255, 0)
    expected = np.maximum(expected, np.where(y**2 + x**2 <= 7.5**2, 90, 0))
    np.testing.assert_array_equal(grown, expected)
    back = "masks.grown(masks.grown(Uint8Array.from(given), size, 5), size, -5)"
    disc = np.where((y - 30) ** 2 + (x - 40) ** 2 <= 14.5**2, 255, 0)
    np.testing.assert_array_equal(mask_of(page, back, disc.ravel().tolist()), disc)


@pytest.mark.nightly
def test_colours_brightness_and_light_are_selected_as_they_are_seen(page: Any) -> None:
    codes = np.zeros((H, W, 4), int)
    codes[..., 3] = 255
    codes[:, :40, :3], codes[:, 40:60, :3], codes[:, 60:, :3] = 119, (119, 117, 119), (200, 40, 40)
    given = codes.ravel().tolist()
    like = mask_of(page, "shown.colourMask(Uint8ClampedArray.from(given), 0, 8)", given)
    assert (like[:, :60] == 255).all()
    assert not like[:, 60:].any()
    # Middle grey has L* 50.
    bright = mask_of(page, "shown.brightnessMask(Uint8ClampedArray.from(given), 48, 51)", given)
    assert (bright[:, :40] == 255).all()
    assert not bright[:, 60:].any()
    plane, albedo = np.zeros((H, W, 3), np.float16), np.full((H, W, 3), 0.5, np.float16)
    plane[:20], plane[20:40] = 1, 0.25
    plane[0, :3] = 6e4  # the lamp itself
    albedo[20:40] = 0.125
    bits = [x.view(np.uint16).ravel().tolist() for x in (plane, albedo)]
    lit = "const [plane, albedo] = given.map((x) => Uint16Array.from(x));"
    mask = np.reshape(run(page, lit + "return [...shown.lightMask(plane, albedo)]", bits), (H, W))
    assert (mask[:40] == 255).all()
    assert not mask[40:].any()
    bare = np.reshape(run(page, lit + "return [...shown.lightMask(plane, null)]", bits), (H, W))
    assert 0 < bare[30, 5] < 100


@pytest.mark.parametrize(
    "tool", ["brush", *map(nightly, ["fill", "adjust", "eraser", "weight", "line"])]
)
def test_no_stroke_changes_a_pixel_outside_of_what_is_selected(page: Any, tool: str) -> None:
    mask = random_mask(3)
    script = f"""
      const tool = {{ ...hand.DEFAULT_TOOL, tool: '{tool}', size: 50, flow: 0.8, importance: 4 }};
      const spots = [given, null].map((mask) => {{
        const canvas = bench.plain(H, W, 0.5);
        canvas.importance.fill(0.5, 0, 2000);
        canvas.selection = mask && {{ mask: Uint8Array.from(mask), bounds: [0, H, 0, W] }};
        const stroke = new hand.Stroke(canvas, tool, {{ x: 30, y: 20, pressure: 1 }}, 1);
        stroke.begin();
        stroke.move([{{ x: 60, y: 50, pressure: 1 }}]);
        canvas.end();
        return [[...canvas.image], [...canvas.importance]];
      }});
      const plain = bench.plain(H, W, 0.5);
      plain.importance.fill(0.5, 0, 2000);
      return [...spots, [[...plain.image], [...plain.importance]]];
    """
    kept, free, before = (
        np.c_[np.reshape(image, (H * W, 3)), importance]
        for image, importance in run(page, script, mask.ravel().tolist())
    )
    flat = mask.ravel()
    np.testing.assert_array_equal(kept[flat == 0], before[flat == 0])
    np.testing.assert_array_equal(kept[flat == 255], free[flat == 255])
    assert (kept[flat > 0] != before[flat > 0]).any()
