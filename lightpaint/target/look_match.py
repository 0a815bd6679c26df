"""Finds the view through which a picture was painted over a known look, or says how it differs.

A picture from another program does not state its view. But most of a painting is unpainted, and
there it equals the look through one view, up to rounding in its file.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from lightpaint.arrays import Doubles, Floats, largest
from lightpaint.colour import BUILT_IN, TransformChoice, ViewTransform, luminance
from lightpaint.images import Picture
from lightpaint.sentences import Hint, Sentence
from lightpaint.target.painted_pixels import LOSSY, ROUNDING, compressed_like, lossy_difference

#: Minimum share of informative pixels that must equal the look.
MAX_DIFFERENCE = 0.5

#: Display values of informative pixels: not near black or white, where many pictures are alike; and
#: the minimum share of such pixels in a picture.
TELLING_RANGE, MIN_TELLING_SHARE = (0.04, 0.96), 0.01

#: Difference in stops up to which exposures are equal up to rounding in a file.
BIN = 0.04


def view_of_look(
    path: Path, picture: Picture, look: Floats, choice: TransformChoice
) -> ViewTransform | None:
    """Return the view through which most of `picture` equals `look`; None if it does not.

    path: the file of the picture. look: (h, w, 3) linear. choice: the part of the view that is
    given; the remainder, including the exposure, is searched. A file that holds light has no view,
    and is compared in sRGB.
    """
    if picture.size != look.shape[:2]:
        return None
    views = [ViewTransform()]
    display = (picture.transform or views[0]).encode(picture.image)
    if picture.transform is not None:
        views = list(_plausible(display, look, choice))
    agreements = [_agreement(path, picture, display, view.encode(look)) for view in views]
    best_index = max(range(len(views)), key=agreements.__getitem__)
    return views[best_index] if agreements[best_index][0] > MAX_DIFFERENCE else None


def _plausible(display: Floats, look: Floats, choice: TransformChoice) -> Iterator[ViewTransform]:
    """Yield views, each at the exposure that maps the look to most of the display values."""
    for name in (
        [choice.name] if choice.name is not None else [n for n in BUILT_IN if n != "linear"]
    ):
        view = TransformChoice(name, choice.stops or 0.0).over(None)
        yield view
        if choice.stops is None:
            stops = _stops_between(view, display, look)
            # People choose round numbers.
            for digits in (1, 2, 4):
                yield ViewTransform(view.name, round(stops, digits))


def _stops_between(view: ViewTransform, display: Floats, look: Floats) -> float:
    """Return the approximate exposure at which that view shows most of `look` as in `display`."""
    light, look_brightness = luminance(view.decode(display)), luminance(look)
    low, high = TELLING_RANGE
    is_unclipped = (display > low).all(axis=-1) & (display < high).all(axis=-1)
    is_unclipped &= (light > 0) & (look_brightness > 0)
    if not is_unclipped.any():
        return 0.0
    stops = np.log2(light[is_unclipped] / look_brightness[is_unclipped])
    # Unpainted pixels share the most common exposure; painted ones vary.
    counts = np.bincount(np.floor((stops - stops.min()) / BIN).astype(np.intp))
    smoothed = np.convolve(counts, [1, 1, 1], "same")
    commonest = stops.min() + BIN * (np.argmax(smoothed) + 0.5)
    return float(np.clip(np.median(stops[np.abs(stops - commonest) < 1.5 * BIN]), -60, 60))


def _agreement(
    path: Path, picture: Picture, display: Floats, encoded_look: Floats
) -> tuple[float, float]:
    """Return the share of informative pixels that are equal, and their closeness; larger is better.

    display, encoded_look: (h, w, 3), display values of the picture and of the look.
    """
    low, high = TELLING_RANGE
    is_informative = (largest(encoded_look) > low) & (encoded_look.min(axis=-1) < high)
    if is_informative.mean() < MIN_TELLING_SHARE:
        return 0.0, 0.0
    if picture.lossy:
        difference, tolerance = (
            lossy_difference(display, compressed_like(path, encoded_look)),
            LOSSY,
        )
    else:
        difference, tolerance = largest(np.abs(display - encoded_look)), ROUNDING
    is_same = difference[is_informative] <= tolerance
    if not is_same.any():
        return 0.0, 0.0
    # Rounded to fiftieths and tenths of a code, so that the first of nearly equal views wins.
    return round(50 * float(is_same.mean())) / 50, -round(
        2550 * float(difference[is_informative][is_same].mean())
    )


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
