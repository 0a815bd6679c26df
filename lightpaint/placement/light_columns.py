"""Columns, the images of all lights of a search at unit emission, and what panels hide of them.

Columns are (n, q, 3). A new panel is a thing in the room: it hides what is behind it, whichever
side the camera sees. So if there are panels, columns have a fourth channel, the share of each pixel
that their panel hides; it is 0 for other lights.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from lightpaint.arrays import Doubles, Floats


def with_columns(columns: Floats, changed: Mapping[int, Floats]) -> Floats:
    """Return columns, some of them replaced: by (q, 4), or by (q, 3), which hide nothing."""
    replaced = columns.copy()
    for k, column in changed.items():
        replaced[k, :, 3:] = 0
        replaced[k, :, : column.shape[1]] = column
    return replaced


def seen_columns(columns: Floats) -> Floats:
    """Return columns (n, q, 3) without what panels among them hide of the others."""
    if columns.shape[2] == 3:
        return columns
    return np.asarray(columns[:, :, :3] * _shown_shares(columns)[:, :, None])


def picture_slopes(
    columns: Floats, weights: Doubles, slopes: Floats, owners: Sequence[int], c: int
) -> Doubles:
    """Return slopes of the picture in channel c, (s, q), by slopes of columns.

    A panel that moves changes its own light, and hides other parts of what is behind it. weights:
    (n, c); slopes: (s, q, 3 or 4); owners: of each slope, the index of its column.
    """
    owned = np.array(owners)
    rows = slopes[:, :, c % 3] * weights[owned, c][:, None]
    if columns.shape[2] == 3:
        return np.asarray(rows)
    rows *= _shown_shares(columns)[owned]
    if slopes.shape[2] > 3:
        for k in {*owners}:
            others = with_columns(columns, {k: np.zeros(columns.shape[1:], np.float32)})
            behind = weights[:, c] @ seen_columns(others)[:, :, c % 3]
            rows[owned == k] -= slopes[owned == k, :, 3] * behind
    return np.asarray(rows)


def _shown_shares(columns: Floats) -> Floats:
    """Return the share of each pixel of a column that the panels of others leave, (n, q)."""
    shown = np.ones(columns.shape[:2], np.float32)
    for k in np.flatnonzero(columns[:, :, 3].any(axis=1)):
        rest = 1 - columns[k, :, 3]
        shown[:k] *= rest
        shown[k + 1 :] *= rest
    return shown
