"""Derivatives of a view transform, as a matrix for each colour."""

from typing import Any

import numpy as np

from lightpaint.colour.display.view_transform import ViewTransform


def slopes_of(transform: ViewTransform, colours: Any) -> Any:
    """Derivatives of display value i by linear channel j at colours (p, 3), (p, 3, 3)."""
    _, slopes = transform.with_slopes(np.asarray(colours).T)
    if slopes.ndim == 2:
        slopes = slopes * np.eye(3)[..., None]
    return slopes.transpose(2, 0, 1)
