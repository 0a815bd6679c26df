"""Resamples images to any size."""

import numpy as np

from lightpaint.arrays import Floats


def resampled(planes: Floats, size: tuple[int, int]) -> Floats:
    """Return (h, w, n) float32 at `size`: averaged where it shrinks, interpolated where it grows.

    size: (height, width).
    """
    from PIL import Image

    height, width = size
    shrinks = width <= planes.shape[1]
    kernel = Image.Resampling.BOX if shrinks else Image.Resampling.BILINEAR
    resized = [
        Image.fromarray(np.ascontiguousarray(plane, dtype=np.float32)).resize(
            (width, height), kernel
        )
        for plane in np.moveaxis(planes, -1, 0)
    ]
    return np.dstack([np.asarray(plane) for plane in resized])
