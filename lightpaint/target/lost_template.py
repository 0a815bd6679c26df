"""Diagnoses a painting that hardly matches its template: repainted, converted or moved.

Another view or profile maps each colour of the template to one other colour by a smooth function.
Paint does not: it puts different colours on the same wall.
"""

from collections.abc import Iterator

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.sentences import Hint, Sentence

#: Maximum error of a smooth function of the template's colours, relative to the painting's
#: contrast. Measured: views and profiles leave at most 0.04, paintings at least 0.2.
SMOOTH = 0.1

#: Number of evenly spread sample pixels; and the display value from which a channel is clipped.
PIXELS, WHITE = 20_000, 0.998


def explain_mismatch(picture: Floats, template: Floats) -> str:
    """Return a clause on why the whole template differs; "" if it was painted over.

    picture, template: (h, w, 3), display values of painting and template.
    """
    if _is_function(picture, template):
        return Sentence(
            "a single change of colours explains all of it: unless you graded it, it was saved "
            "through another view or profile (",
            Hint("transform"),
            ", ",
            Hint("mask"),
            ")",
        )
    for turn, turned_template in _turned(template):
        if _is_function(picture, turned_template):
            return f"it is the template {turn}: turn it back"
    down, right = _offset(picture, template)
    if (down or right) and _is_function(*_overlap(picture, template, down, right)):
        return f"it is the template moved by {right} pixels to the right and {down} down: undo that"
    return ""


def _is_function(picture: Floats, template: Floats) -> bool:
    """Return whether `picture` is a smooth function of `template` wherever neither is clipped."""
    picture, template = (x.reshape(-1, 3).astype(np.float64) for x in (picture, template))
    unclipped = np.flatnonzero((picture < WHITE).all(axis=-1) & (template < WHITE).all(axis=-1))
    unclipped = unclipped[:: max(1, unclipped.size // PIXELS)]
    terms = _terms(template[unclipped])
    if unclipped.size < 2 * terms.shape[1]:
        return False  # too few to decide
    solution, *_ = np.linalg.lstsq(terms, picture[unclipped], rcond=None)
    mean_square_error = np.square(picture[unclipped] - terms @ solution).mean()
    return bool(mean_square_error <= SMOOTH**2 * picture[unclipped].var(axis=0).mean())


def _terms(rgb: Doubles) -> Doubles:
    """Return the terms of a curve for each channel with a little crosstalk, (n, 13)."""
    r, g, b = rgb.T
    ones = np.ones_like(r)
    terms = (ones, r, g, b, r * r, g * g, b * b, r * g, r * b, g * b, r**3, g**3, b**3)
    return np.stack(terms, axis=-1)


def _turned(template: Floats) -> Iterator[tuple[str, Floats]]:
    yield "mirrored", template[:, ::-1]
    yield "upside down and mirrored", template[::-1]
    yield "upside down", template[::-1, ::-1]


def _offset(picture: Floats, template: Floats) -> tuple[int, int]:
    """Return the shift in pixels (down, right) with the largest phase correlation."""
    size = picture.shape[:2]
    first, second = (np.fft.rfft2(x.mean(axis=-1) - x.mean()) for x in (picture, template))
    cross = first * np.conj(second)
    peaks = np.fft.irfft2(cross / np.maximum(np.abs(cross), 1e-12), s=size)
    peak = np.unravel_index(int(np.argmax(peaks)), size)
    down, right = (int(k) if k <= n // 2 else int(k) - n for k, n in zip(peak, size, strict=True))
    return down, right


def _overlap(picture: Floats, template: Floats, down: int, right: int) -> tuple[Floats, Floats]:
    """Return the parts of two pictures that overlap when one is shifted."""
    height, width = picture.shape[0] - abs(down), picture.shape[1] - abs(right)
    top, left = max(down, 0), max(right, 0)
    part = picture[top : top + height, left : left + width]
    top, left = max(-down, 0), max(-right, 0)
    return part, template[top : top + height, left : left + width]
