"""From the colours that a file declares to linear Rec.709."""

from collections.abc import Sequence

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.errors import ImageError

#: CIE xy of red, green, blue and white of Rec.709, the colours of every image here.
REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)

#: CIE XYZ itself, as a set of primaries.
XYZ = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3)

#: Files round the numbers: to three decimals, or to float16.
ROUNDING = 1e-3

#: CIE xy of red, green, blue and white of those that renderers work in.
SPACES = {
    "lin_ap1_scene": (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767),
    "lin_ap0_scene": (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767),
    "lin_rec2020_scene": (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290),
    "lin_p3d65_scene": (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290),
}

#: Lam's cone responses ("Bradford"), in which a white is adapted to another.
BRADFORD = np.array([
    [0.8951, 0.2664, -0.1614],
    [-0.7502, 1.7135, 0.0367],
    [0.0389, -0.0685, 1.0296],
])  # fmt: skip


def rgb_to_xyz(primaries: Sequence[float]) -> Floats:
    """(3, 3) matrix from linear RGB of these primaries (SMPTE RP 177) to XYZ, white at Y = 1.

    Raises ImageError where they span no colours.
    """
    xy = np.asarray(primaries, dtype=np.float64).reshape(4, 2)
    with np.errstate(all="ignore"):
        *columns, white = np.column_stack([xy, 1 - xy.sum(axis=1)])
        matrix = np.stack(columns, axis=1)
        if np.isfinite(matrix).all() and abs(np.linalg.det(matrix)) > 1e-6 and white[1] > 1e-6:
            scale = np.linalg.solve(matrix, white / white[1])
            if (np.abs(scale) > 1e-6).all():
                return matrix * scale
    raise ImageError(f"declares chromaticities that span no colours: {_listed(xy)}")


def adaptation(white: Floats, to: Floats) -> Floats:
    """(3, 3) matrix that takes XYZ as seen under `white` to how it looks under `to`."""
    gains = (BRADFORD @ to) / (BRADFORD @ white)
    return np.asarray(np.linalg.solve(BRADFORD, gains[:, None] * BRADFORD))


def to_rec709(primaries: Sequence[float]) -> Floats:
    """(3, 3) matrix from linear RGB of these primaries to linear Rec.709.

    Another white is adapted (Bradford): what is white in the file is white here. XYZ is no RGB
    space with a white of its own but colours as measured, and taken as it is.
    """
    ours, theirs = rgb_to_xyz(REC709), rgb_to_xyz(primaries)
    if not np.allclose(primaries, XYZ, rtol=0, atol=ROUNDING):
        white, to = theirs.sum(axis=1), ours.sum(axis=1)
        if not np.allclose(primaries[6:], REC709[6:], rtol=0, atol=ROUNDING):
            theirs = adaptation(white, to) @ theirs
    return np.linalg.solve(ours, theirs)


def are_same(one: Sequence[float] | None, other: Sequence[float] | None) -> bool:
    """Whether two declare the same primaries, None for Rec.709's, but for how files round."""
    return np.allclose(one or REC709, other or REC709, rtol=0, atol=ROUNDING)


def is_rec709(primaries: Sequence[float] | None) -> bool:
    """Whether these are the primaries of every image here; a file that declares none has them."""
    return are_same(primaries, None)


def converted(image: Floats, matrix: Floats) -> Floats:
    """Each pixel of (h, w, 3) by a (3, 3) matrix, as float32."""
    # NaN and Inf are found, and counted, afterwards.
    with np.errstate(invalid="ignore", over="ignore"):
        return np.asarray(image.astype(np.float32, copy=False) @ matrix.T.astype(np.float32))


def _listed(xy: Floats) -> str:
    return ", ".join(f"({x:.4g}, {y:.4g})" for x, y in xy)
