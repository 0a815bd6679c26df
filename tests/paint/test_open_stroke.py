"""What there was before a stroke, however it went: against a copy of the whole picture."""

from unittest.mock import patch

import numpy as np
import numpy.typing as npt
from hypothesis import given
from hypothesis import strategies as st

from lightpaint.paint.layers import canvas
from lightpaint.paint.layers.canvas import OpenStroke
from lightpaint.paint.layers.layer_pixels import LayerPixels
from lightpaint.paint.store.history_steps import Pixels, Region

HEIGHT, WIDTH = 21, 34


def spans(maximum: int) -> st.SearchStrategy[tuple[int, int]]:
    return st.tuples(st.integers(0, maximum), st.integers(0, maximum)).map(
        lambda s: (min(s), max(s))
    )


REGIONS = st.builds(lambda y, x: (*y, *x), spans(HEIGHT), spans(WIDTH))


def picture(seed: int, marks: npt.NDArray[np.bool_] | None = None) -> Pixels:
    random = np.random.default_rng(seed)
    image = random.random((HEIGHT, WIDTH, 3), np.float32)
    return Pixels(image, random.random((HEIGHT, WIDTH), np.float32), marks)


@given(
    regions=st.lists(REGIONS, max_size=8),
    is_marked=st.booleans(),
    is_new=st.booleans(),
    side=st.sampled_from([4, 7]),
)
def test_what_was_before_is_given_back(
    regions: list[Region], is_marked: bool, is_new: bool, side: int
) -> None:
    marks = np.random.default_rng(1).random((HEIGHT, WIDTH, 3)) > 0.5 if is_marked else None
    layer = LayerPixels((HEIGHT, WIDTH))
    before = picture(0, marks)
    if is_new:
        before = Pixels.unpainted(np.zeros((HEIGHT, WIDTH, 3), np.float32))
    layer.put((0, HEIGHT, 0, WIDTH), before)
    with patch.object(canvas, "SQUARE_SIDE", side):
        stroke = OpenStroke()
        for k, region in enumerate(regions):
            stroke.touch(region, layer)
            layer.put(region, picture(k + 1).part(region))
        pixels_before = stroke.pixels_before(layer)
    real = [(a, b, c, d) for a, b, c, d in regions if a < b and c < d]
    assert bool(stroke) == bool(real)
    if real:
        tops, bottoms, lefts, rights = zip(*real, strict=True)
        assert stroke.region == (min(tops), max(bottoms), min(lefts), max(rights))
    assert pixels_before.equals(before.part(stroke.region))
    # However often a stroke goes over a place, it is kept once.
    saved_values = sum(
        pixels.importance.size for pixels in stroke._before.values() if pixels is not None
    )
    assert saved_values <= HEIGHT * WIDTH
