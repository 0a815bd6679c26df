"""The part of a view that a reference shows, told by its edges."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles, Floats, Slices
from lightpaint.colour.color import luminance
from lightpaint.paint.references.tones import DETAIL_SIZE, Tones, edges

#: Heights of a part, in heights of the view.
HEIGHTS = 0.95 ** np.arange(19)

#: Rows or columns of a small picture that one line covers, and the share of edges in them above
#: which these tell no place from another.
LINE, PLAIN = 4, 0.75

#: Stops below the brightest parts of a view at which all is equally dark.
DARKEST = 7.0

Point = tuple[float, float]


@dataclass(frozen=True)
class ViewPart:
    """A part of a view. All numbers are shares of the view.

    likeness: correlation of the edges of reference and part. is_mirrored: whether the reference
    shows it mirrored.
    """

    left: float
    top: float
    width: float
    height: float
    is_mirrored: bool
    likeness: float

    def place(self, x: float, y: float) -> Point:
        """Return the place in the view of one in the reference, both 0 to 1."""
        across = 1 - x if self.is_mirrored else x
        return self.left + self.width * across, self.top + self.height * y

    def slices(self, size: tuple[int, int]) -> Slices:
        """Return its rows and columns in a picture of the view of a size."""
        rows = slice(round(self.top * size[0]), round((self.top + self.height) * size[0]))
        columns = slice(round(self.left * size[1]), round((self.left + self.width) * size[1]))
        return rows, columns


def find_part(reference: Tones, light: Floats) -> ViewPart:
    """Return the part of a view, (h, w, 3) linear, whose edges are most like a reference's.

    All of it, with a likeness of 0, where there are hardly any edges to compare.
    """
    bright = float(np.quantile(luminance(light), 0.75))
    levels = np.log2(np.maximum(luminance(light), 0) + max(bright, 1e-30) * 2.0**-DARKEST)
    nowhere = ViewPart(0.0, 0.0, 1.0, 1.0, is_mirrored=False, likeness=0.0)
    found = _parts(reference, np.asarray(levels, np.float64))
    return max(found, key=lambda part: part.likeness, default=nowhere)


def _parts(reference: Tones, levels: Doubles) -> Iterator[ViewPart]:
    """Yield the likeliest part of the view for each height, and all of it."""
    theirs = edges(reference.levels, DETAIL_SIZE)
    theirs = (theirs - theirs.mean()) / max(float(theirs.std()), 1e-9)
    if _plainness(theirs) > PLAIN:
        return
    rows, columns = DETAIL_SIZE
    height, width = levels.shape
    aspect = reference.size[1] / reference.size[0]
    sizes = [(round(rows / x), round(columns * width / (x * height * aspect))) for x in HEIGHTS]
    for size in (DETAIL_SIZE, *sizes):
        if size[1] < columns:
            continue
        ours = edges(levels, size)
        windows = np.lib.stride_tricks.sliding_window_view(ours, DETAIL_SIZE)
        spread = np.maximum(windows.std(axis=(2, 3)), 0.2 * max(float(ours.std()), 1e-9))
        for is_mirrored in (False, True):
            edge = theirs[:, ::-1] if is_mirrored else theirs
            found = np.einsum("yxij,ij->yx", windows, edge) / edge.size / spread
            top, left = np.unravel_index(int(np.argmax(found)), found.shape)
            if _plainness(windows[top, left]) > PLAIN:
                continue
            yield ViewPart(
                float(left / size[1]),
                float(top / size[0]),
                columns / size[1],
                rows / size[0],
                is_mirrored,
                float(found[top, left]),
            )


def _plainness(edge: Doubles) -> float:
    """Return the share of edges (h, w) in a few rows or columns: 1 for the edge of one shadow."""
    squares = edge**2
    lines = squares.sum(axis=0), squares.sum(axis=1)
    most = max(float(np.convolve(x, np.ones(LINE), "valid").max()) for x in lines)
    return most / max(float(squares.sum()), 1e-30)
