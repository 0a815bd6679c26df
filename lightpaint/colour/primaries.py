"""RGB spaces: from the primaries or the ICC profile of a file to linear Rec.709, and from linear
light to the display values of sRGB and back.

Supported are profiles with three curves and a matrix, and with one curve for grey (ICC.1:2022, F.2
and F.3), which include the working spaces of paint programs. Profiles with tables over all three
colours (printers, some scanners) are rejected.

Encoding a million float32 pixels takes 28 ms and decoding 15 ms; colour-science takes 65 and 70 ms,
and returns float64.
"""

import struct
import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, lru_cache
from types import ModuleType
from typing import cast

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.errors import ImageError
from lightpaint.signals import interruptible_between_pieces

Curve = Callable[[Floats], Floats]

#: XYZ of D50, the white point of all profiles.
D50 = np.array([0.9642, 1.0, 0.8249])

#: Maximum difference in light, relative to 1, at which a profile counts as sRGB: programs ship
#: curves with 1024 points and matrices with four decimals.
SRGB_TOLERANCE = 2e-3


def encode_display(image: Floats, *, stops: float = 0.0) -> Floats:
    """Return linear Rec.709, scaled by 2^stops and clipped, as sRGB-encoded values in [0, 1].

    The transfer function is the function of IEC 61966-2-1.
    """
    linear = np.clip(image * 2.0**stops, 0, 1)
    curve = 1.055 * linear ** (1 / 2.4) - 0.055
    return np.asarray(np.where(linear <= 0.0031308, 12.92 * linear, curve))


def decode_display(image_display: Floats) -> Floats:
    """Return sRGB-encoded values in [0, 1] as linear Rec.709: the inverse of `encode_display`."""
    curve = ((image_display + 0.055) / 1.055) ** 2.4
    return np.asarray(np.where(image_display <= 0.04045, image_display / 12.92, curve))


def to_8_bit(image_display: Floats) -> npt.NDArray[np.uint8]:
    """Return display values in [0, 1] as 8-bit integers."""
    return np.asarray(np.round(image_display * 255), dtype=np.uint8)


@cache
def colour_science() -> ModuleType:
    """Return the module `colour`."""
    # An interrupt in the middle of the import would cause error messages when the process ends.
    with interruptible_between_pieces(), warnings.catch_warnings():
        # It warns about missing plotting libraries, which are not needed here.
        warnings.simplefilter("ignore")
        import colour
    return cast("ModuleType", colour)


#: CIE xy of red, green, blue and white of Rec.709, the primaries of all images in memory.
REC709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)

#: The same of ACEScg (ACES primaries 1), and of ITU-R BT.2020.
ACESCG = (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767)
REC2020 = (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290)

#: CIE XYZ itself, as a set of primaries.
XYZ = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1 / 3, 1 / 3)

#: Tolerance for numbers that files round to three decimals or to float16.
ROUNDING = 1e-3

#: From XYZ to the cone responses of Bradford's adaptation (Lam 1985; ICC.1:2022, annex E).
BRADFORD = np.array(
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]
)

#: Working spaces of renderers: their names in files, and in colour-science.
SPACES = {
    "lin_ap1_scene": "ACEScg",
    "lin_ap0_scene": "ACES2065-1",
    "lin_rec2020_scene": "ITU-R BT.2020",
    "lin_p3d65_scene": "P3-D65",
}


def primaries_in(space: str) -> tuple[float, ...]:
    """Return CIE xy of red, green, blue and white of a space, named as in colour-science."""
    color_space = colour_science().RGB_COLOURSPACES[space]
    return tuple(map(float, (*color_space.primaries.ravel(), *color_space.whitepoint)))


@lru_cache(64)
def rgb_to_xyz(primaries: tuple[float, ...]) -> Doubles:
    """Return the matrix (3, 3) from linear RGB in these primaries to XYZ, with white at Y = 1
    (SMPTE RP 177).

    It is read-only. Raises ImageError if the primaries span no colours.
    """
    xy = np.asarray(primaries, dtype=np.float64).reshape(4, 2)
    with np.errstate(all="ignore"), suppress(np.linalg.LinAlgError):
        columns = np.array([xy[:, 0], xy[:, 1], 1 - xy.sum(axis=1)])
        white = columns[:, 3] / xy[3, 1]
        matrix = columns[:, :3] * np.linalg.solve(columns[:, :3], white)
        if xy[3, 1] > 1e-6 and np.linalg.cond(matrix) < 1e6:
            matrix.setflags(write=False)
            return np.asarray(matrix)
    raise ImageError(f"declares chromaticities that span no colours: {_listed(xy)}")


def adaptation(white: Doubles, to: Doubles) -> Doubles:
    """Return the matrix (3, 3) that adapts XYZ from white point `white` to white point `to`
    (Bradford).

    colour-science has this too, but most paintings have a profile, and its import would delay them.
    """
    ratio = (BRADFORD @ to) / (BRADFORD @ white)
    return np.asarray(np.linalg.solve(BRADFORD, ratio[:, None] * BRADFORD))


def to_rec709(primaries: tuple[float, ...]) -> Doubles:
    """Return the matrix (3, 3) from linear RGB in these primaries to linear Rec.709.

    A different white is adapted, so that white in the file becomes white here. XYZ is converted
    without adaptation, since it holds colours as measured and has no white of its own.
    """
    to_xyz, source_to_xyz = rgb_to_xyz(REC709), rgb_to_xyz(primaries)
    is_same_white = np.allclose(primaries[6:], REC709[6:], rtol=0, atol=ROUNDING)
    if not (is_same_white or are_same(primaries, XYZ)):
        source_to_xyz = adaptation(source_to_xyz.sum(axis=1), to_xyz.sum(axis=1)) @ source_to_xyz
    return np.asarray(np.linalg.solve(to_xyz, source_to_xyz), np.float64)


def from_rec709(primaries: tuple[float, ...]) -> Doubles:
    """Return the matrix (3, 3) from linear Rec.709 to linear RGB in these primaries."""
    return np.asarray(np.linalg.inv(to_rec709(primaries)))


def are_same(a: Sequence[float] | None, b: Sequence[float] | None) -> bool:
    """Return True if both are the same primaries up to rounding in files; None is Rec.709."""
    return np.allclose(a or REC709, b or REC709, rtol=0, atol=ROUNDING)


def is_rec709(primaries: Sequence[float] | None) -> bool:
    """Return True for the primaries of Rec.709; None, an undeclared value, counts as such."""
    return are_same(primaries, None)


def converted(image: Floats, matrix: Floats) -> Floats:
    """Return each pixel of (h, w, 3) multiplied by a (3, 3) matrix, as float32."""
    # The caller detects and counts NaN and Inf.
    with np.errstate(invalid="ignore", over="ignore"):
        return np.asarray(image.astype(np.float32, copy=False) @ matrix.T.astype(np.float32))


def _listed(xy: Floats) -> str:
    return ", ".join(f"({x:.4g}, {y:.4g})" for x, y in xy)


@dataclass(frozen=True)
class Profile:
    """The meaning of a picture's numbers.

    name: the profile's own description. curves: for each of R, G, B, from values in [0, 1] to
    light. matrix: (3, 3), from that light to linear Rec.709.
    """

    name: str
    curves: tuple[Curve, Curve, Curve]
    matrix: Floats

    @property
    def is_srgb(self) -> bool:
        """True if the numbers mean the same as without a profile."""
        return self._curves_are(decode_display) and bool(
            np.allclose(self.matrix, np.eye(3), rtol=0, atol=SRGB_TOLERANCE)
        )

    @property
    def is_linear(self) -> bool:
        """True if the numbers are proportional to light."""
        return self._curves_are(lambda v: v)

    def _curves_are(self, curve: Curve) -> bool:
        v = np.linspace(0, 1, 256)
        return all(np.abs(own(v) - curve(v)).max() < SRGB_TOLERANCE for own in self.curves)


def read_icc(data: bytes) -> Profile:
    """Return the profile in these bytes. Raises ImageError if it is damaged or not supported."""
    try:
        return _read(data)
    except (struct.error, IndexError, ValueError, UnicodeDecodeError) as error:
        raise ImageError(f"has a damaged colour profile: {error}") from error


def gamma_profile(gamma: float, primaries: tuple[float, ...] | None) -> Profile:
    """Return the profile for PNG's gAMA and cHRM: light = value^gamma, in these primaries."""
    matrix = np.eye(3) if primaries is None else to_rec709(primaries)
    curve = _power(gamma)
    return Profile(f"gamma {gamma:.3g}", (curve, curve, curve), matrix)


def srgb_profile(name: str, primaries: tuple[float, ...]) -> Profile:
    """Return the profile with sRGB's curve and other primaries."""
    return Profile(name, (decode_display,) * 3, to_rec709(primaries))


def _read(data: bytes) -> Profile:
    if len(data) < 132 or data[36:40] != b"acsp":
        raise ValueError("it is cut off, or is not a profile")
    space, connection = data[16:20], data[20:24]
    tags = {}
    (count,) = struct.unpack_from(">I", data, 128)
    for k in range(min(count, 200)):
        tag, offset, length = struct.unpack_from(">4sII", data, 132 + 12 * k)
        if offset + length > len(data):
            raise ValueError(f"its part {tag!r} is cut off")
        tags[tag] = data[offset : offset + length]
    name = _name(tags.get(b"desc", b""))
    grey = space == b"GRAY" and b"kTRC" in tags
    colour = space == b"RGB " and connection == b"XYZ " and not tags.keys() & {b"A2B0", b"A2B1"}
    if grey:
        curve = _curve(tags[b"kTRC"])
        return Profile(name, (curve, curve, curve), np.eye(3))
    if not (colour and all(t in tags for c in b"rgb" for t in (b"%cXYZ" % c, b"%cTRC" % c))):
        raise ImageError(
            f"has the colour profile {name!r}, which is not made of curves and a matrix: convert "
            "it to sRGB and export it again"
        )
    columns = [_xyz(tags[b"%cXYZ" % c]) for c in b"rgb"]
    red, green, blue = (_curve(tags[b"%cTRC" % c]) for c in b"rgb")
    to_xyz_d50 = adaptation(rgb_to_xyz(REC709).sum(axis=1), D50) @ rgb_to_xyz(REC709)
    matrix = np.linalg.solve(to_xyz_d50, np.stack(columns, axis=1))
    if not abs(np.linalg.det(matrix)) > 1e-6:
        raise ValueError("its three colours are not independent")
    return Profile(name, (red, green, blue), matrix)


def _name(tag: bytes) -> str:
    if tag[:4] == b"desc":
        (length,) = struct.unpack_from(">I", tag, 8)
        return tag[12 : 12 + length].split(b"\0")[0].decode("latin-1")
    if tag[:4] == b"mluc":
        length, offset = struct.unpack_from(">II", tag, 20)
        return tag[offset : offset + length].decode("utf-16-be")
    return "unnamed"


def _xyz(tag: bytes) -> Floats:
    if tag[:4] != b"XYZ ":
        raise ValueError("a colour is missing")
    return np.array(struct.unpack_from(">3i", tag, 8)) / 65536


def _curve(tag: bytes) -> Curve:
    if tag[:4] == b"curv":
        (count,) = struct.unpack_from(">I", tag, 8)
        values = np.frombuffer(tag, ">u2", count, 12)
        if count == 0:
            return _power(1.0)
        if count == 1:
            return _power(float(values[0]) / 256)
        table = values / 65535
        if (np.diff(table) < 0).any() or table[-1] <= table[0]:
            raise ValueError("a curve falls")
        return lambda v: np.interp(v, np.linspace(0, 1, count), table)
    if tag[:4] == b"para":
        (kind,) = struct.unpack_from(">H", tag, 8)
        if kind > 4:
            raise ValueError(f"a curve is of the unknown kind {kind}")
        values = np.array(struct.unpack_from(f">{(1, 3, 4, 5, 7)[kind]}i", tag, 12)) / 65536
        return _parametric(kind, values.tolist())
    raise ValueError("a curve is missing")


def _parametric(kind: int, values: list[float]) -> Curve:
    """Return ICC's parametric curve: (a x + b)^g + e for x >= d, and c x + f below.

    Types 0 to 4 omit some of the parameters.
    """
    g, a, b, c, d, e, f = values[0], 1.0, 0.0, 0.0, -1.0, 0.0, 0.0
    if kind in (1, 2):
        a, b = values[1:3]
        e = f = values[3] if kind == 2 else 0.0
        d = -b / a if a else 0.0
    elif kind > 2:
        a, b, c, d = values[1:5]
        e, f = values[5:7] if kind == 4 else (0.0, 0.0)
    if not (0.1 <= g <= 10 and a > 0):
        raise ValueError("a curve has an absurd exponent")
    return lambda x: np.where(x >= d, np.maximum(a * x + b, 0) ** g + e, c * x + f)


def _power(gamma: float) -> Curve:
    if not 0.1 <= gamma <= 10:
        raise ValueError(f"a curve has the absurd exponent {gamma:g}")
    return lambda v: v if gamma == 1 else np.maximum(v, 0) ** gamma
