"""Embedded ICC profiles: from a file's own RGB or grey to linear Rec.709.

Supported are profiles with three curves and a matrix, and with one curve for grey (ICC.1:2022, F.2
and F.3), which include the working spaces of paint programs. Profiles with tables over all three
colours (printers, some scanners) are rejected.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.colour.primaries import REC709, adaptation, decode_display, rgb_to_xyz, to_rec709
from lightpaint.errors import ImageError

Curve = Callable[[Floats], Floats]

#: XYZ of D50, the white point of all profiles.
D50 = np.array([0.9642, 1.0, 0.8249])

#: Maximum difference in light, relative to 1, at which a profile counts as sRGB: programs ship
#: curves with 1024 points and matrices with four decimals.
SRGB_TOLERANCE = 2e-3


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
