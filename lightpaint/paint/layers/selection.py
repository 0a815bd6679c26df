"""The selection of a view: a soft mask that strokes, fills, adjustments and gradients keep to.

A client that paints multiplies coverage by the mask before it sends pixels, so that the session
replays the same bits without the mask. The session keeps the mask as the pixels of a layer that is
in no stack: selecting is a step, which undo, reopening and a crash treat like any other.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.errors import PaintError
from lightpaint.paint.layers.layer_pixels import LayerPixels, enclosing, is_empty
from lightpaint.paint.store.history_steps import Patch, Pixels, Region

#: The id under which steps hold the masks; layers of a stack have ids from 0.
SELECTION_ID = -1

#: The value of a fully selected pixel. Masks have 8 bits, so that inverting twice changes nothing.
FULL = 255


def selection_mask(selection: LayerPixels) -> npt.NDArray[np.uint8]:
    """Return the mask (rows, columns) in the bounds of a selection."""
    share = selection.part(selection.bounds).importance
    return np.asarray(np.rint(share * np.float32(FULL)), np.uint8)


def selection_patch(
    selection: LayerPixels, view: int, region: Region, arrays: Mapping[str, npt.NDArray[Any]]
) -> Patch | None:
    """Return the change of a view's selection to the mask of a region; None if there is none.

    Nothing is selected outside the region. Raises PaintError if the mask is none.
    """
    height, width = selection.size
    top, bottom, left, right = region
    if not (0 <= top <= bottom <= height and 0 <= left <= right <= width):
        raise PaintError(f"a selection at {list(region)}, and the picture is {width}x{height}")
    mask = arrays.get("mask")
    if mask is None or mask.dtype != np.uint8 or mask.shape != (bottom - top, right - left):
        found = "none" if mask is None else f"{mask.dtype} {list(mask.shape)}"
        raise PaintError(f"a mask of {list(region)} is {found}: expected bytes of that size")
    after = LayerPixels(selection.size)
    if not is_empty(region):
        after.put(region, _mask_pixels(np.asarray(mask, np.float32) / np.float32(FULL)))
    bounds = enclosing([selection.bounds, after.bounds])
    if is_empty(bounds):
        return None
    patch = Patch(
        bounds,
        _mask_pixels(selection.part(bounds).importance),
        _mask_pixels(after.part(bounds).importance),
        view,
        SELECTION_ID,
    )
    return None if patch.before.equals(patch.after) else patch


def put_selection(selection: LayerPixels, patch: Patch, *, is_back: bool) -> None:
    """Change a selection by a patch, or back. Updated in place."""
    selection.put(patch.region, patch.before if is_back else patch.after)


def _mask_pixels(share: npt.NDArray[np.float32]) -> Pixels:
    """Return a mask as pixels without colour."""
    return Pixels(np.broadcast_to(np.float32(0), (*share.shape, 3)), share)
