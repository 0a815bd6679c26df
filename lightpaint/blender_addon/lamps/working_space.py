# SPDX-License-Identifier: GPL-3.0-or-later
"""The space in which a file has its colours: from Blender 5 on it may have other primaries.

Multipliers are of linear Rec.709, as lightpaint shows and solves everything.
"""

#: Working space, as files name it -> the matrix to it from linear Rec.709.
SPACES = {
    "lin_ap1_scene": (
        (0.613097402, 0.339523146, 0.047379451),
        (0.070193722, 0.916353879, 0.013452398),
        (0.020615593, 0.109569773, 0.869814634),
    ),
    "lin_rec2020_scene": (
        (0.627403896, 0.329283038, 0.043313066),
        (0.069097289, 0.919540395, 0.011362316),
        (0.016391439, 0.088013308, 0.895595253),
    ),
}


def working_space(data):
    """Return the matrix from linear Rec.709 to the space of a file; None if that is Rec.709.

    data: bpy.data.
    """
    settings = getattr(data, "colorspace", None)
    return SPACES.get(getattr(settings, "working_space_interop_id", ""))


def multiplied(colour, factor, space=None):
    """Return a colour of a file with red, green and blue of Rec.709 multiplied, at least 0.

    space: as `working_space` returns it.
    """
    if space is None:
        return [c * f for c, f in zip(colour, factor, strict=True)]
    shown = [f * c for c, f in zip(_solved(space, colour), factor, strict=True)]
    return [max(sum(m * c for m, c in zip(row, shown, strict=True)), 0.0) for row in space]


def _solved(matrix, result):
    """Return the vector that a matrix of three rows turns into `result`, by Cramer's rule."""
    columns = list(zip(*matrix, strict=True))
    whole = _determinant(columns)
    return [
        _determinant([result if i == k else column for i, column in enumerate(columns)]) / whole
        for k in range(3)
    ]


def _determinant(columns):
    (a, b, c), (d, e, f), (g, h, i) = columns
    return a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
