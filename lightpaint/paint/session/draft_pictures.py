"""Pictures of lightings of so many lights that no page has their planes.

A draft comes at once: the current look, denoised and of all pixels, times the ratio of the two
lightings in the small picture that follows the brush. It has the edges and textures of the current
look, and soft shadows of lights that change.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis import Basis, as_halves
from lightpaint.errors import PaintError
from lightpaint.images import block_mean, resampled
from lightpaint.lighting import LiveView
from lightpaint.paint.layers.canvas import Canvas
from lightpaint.paint.session.picture_table import Picture, page_factor

#: Light that is added to both pictures of a ratio, relative to the mean of the current look: where
#: that is black its ratio is of noise.
FLOOR = 1e-3

#: Largest ratio of a pixel to its surroundings, as of a lamp in view.
MAX_DETAIL = 16.0


class DraftPictures:
    """The drafts of one view, whose details are found once for each current look."""

    def __init__(self) -> None:
        self._known: tuple[LiveView, Floats, Floats] | None = None

    def picture(self, view: Canvas, weights: Doubles, step: int = 1) -> Picture:
        """Return the draft of a lighting as a page has it, (h, w, 3) float16.

        weights: (n, 3). step: return every step-th pixel of every step-th row.
        """
        detail = self._detail(view)[::step, ::step]
        small = view.live.draft(weights)
        return as_halves(resampled(small, detail.shape[:2]) * detail)

    def _detail(self, view: Canvas) -> Floats:
        """Return the current look over its own average, (h, w, 3), as large as a page has it."""
        live, look = view.live, view.current
        if self._known is None or self._known[0] is not live or self._known[1] is not look:
            average = live.averaged(look)
            floor = np.float32(FLOOR * look.mean() + np.finfo(np.float32).tiny)
            whole = (look + floor) / (resampled(average, look.shape[:2]) + floor)
            detail = block_mean(np.minimum(whole, MAX_DETAIL), page_factor(view.basis))
            self._known = live, look, np.asarray(detail, np.float32)
        return self._known[2]


def checked_weights(basis: Basis, arrays: Mapping[str, npt.NDArray[Any]]) -> Doubles:
    """Return the weights (n, 3) of a message. Raises PaintError for others."""
    weights, expected = arrays.get("weights"), (len(basis.lights), 3)
    if weights is None or weights.shape != expected or not np.isfinite(weights).all():
        raise PaintError(f"weights: expected finite numbers of shape {expected}")
    return np.asarray(weights, np.float64)
