"""Pictures for pages, of pictures of any shape."""

import numpy as np
import pytest

from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.paint.session.picture_table import THUMBNAIL_SIDE, display_thumbnail


@pytest.mark.parametrize(
    "size", [(1, 1), (540, 960), (1080, 1920), (1, 400), (4, 2000), (2000, 4), (9, 4000)]
)
def test_thumbnails_of_any_shape_are_small_and_show_its_mean(size: tuple[int, int]) -> None:
    light = np.random.default_rng(0).random((*size, 3), np.float32)
    linear = ViewTransform("linear")
    small = display_thumbnail(light, linear)
    assert min(small.shape[:2]) >= 1
    assert max(small.shape[:2]) <= THUMBNAIL_SIDE
    shape = np.divide(small.shape[:2], max(small.shape[:2]))
    np.testing.assert_allclose(shape, np.divide(size, max(size)), atol=1 / max(small.shape[:2]))
    # Half a code of rounding each, and of a few pixels the parts of blocks that a box leaves out.
    mean_code, mean = small.mean(axis=(0, 1)), 255 * light.mean(axis=(0, 1))
    np.testing.assert_allclose(mean_code, mean, atol=0.6)
