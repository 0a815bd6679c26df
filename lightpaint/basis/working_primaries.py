"""Light groups of a renderer that works in other primaries than Rec.709, such as ACEScg.

Planes are linear Rec.709, but the renderer multiplies red, green and blue of its own primaries.
With the matrix A from Rec.709 to these, a light whose emission was white and becomes w has the
multipliers A w, and the picture is

    A⁻¹ Σ diag(A w_i) A Φ_i

which is Σ diag(w_i) Φ_i on grey surfaces, and differs on coloured ones.
"""

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.planes import Planes
from lightpaint.colour import ACESCG, SPACES, are_same, from_rec709, primaries_in, to_rec709
from lightpaint.errors import BasisError, ImageError

#: Primaries, as tuples of `Origin`; () for Rec.709.
Primaries = tuple[float, ...]


#: Tolerance for primaries that files round.
ROUNDING = 1e-3

#: Least channel of a weight, relative to its largest, whose picture is more than spill of others.
LEAST_CHANNEL = 0.05


def working_primaries(primaries: Primaries | None) -> Primaries:
    """Return the primaries in which the renderer of a file multiplies lights; () for Rec.709.

    primaries: of the file; None for Rec.709. ACES2065-1 is a space of files, whose renderers work
    in ACEScg. Primaries in which some colours of Rec.709 are negative count as Rec.709.
    """
    if primaries is None:
        return ()
    if are_same(primaries, primaries_in("ACES2065-1")):
        return ACESCG
    own = from_rec709(primaries)
    has_white = np.allclose(own.sum(axis=1), 1, rtol=0, atol=ROUNDING)  # XYZ has not
    return tuple(primaries) if has_white and (own >= -ROUNDING).all() else ()


def name_of_primaries(primaries: Primaries) -> str:
    """Return the name of known primaries, or their numbers."""
    for space in SPACES.values():
        if are_same(primaries, primaries_in(space)):
            return space.removeprefix("ITU-R B").replace("T.", "Rec.")
    red, green, blue, _ = zip(primaries[::2], primaries[1::2], strict=True)
    corners = ", ".join(f"({x:.3g}, {y:.3g})" for x, y in (red, green, blue))
    return f"RGB of the primaries {corners}"


def check_primaries(primaries: Primaries) -> None:
    """Raise BasisError unless primaries are four chromaticities that span colours."""
    try:
        if len(primaries) != 8:
            raise ImageError(f"declares {len(primaries)} numbers as chromaticities: expected 8")
        from_rec709(primaries)
    except ImageError as error:
        raise BasisError(error) from None


def multipliers_in(primaries: Primaries, weights: Doubles) -> Doubles:
    """Return the multipliers of red, green and blue in some primaries, of weights (..., 3)."""
    return weights @ from_rec709(primaries).T if primaries else weights


def mixes_in(primaries: Primaries, planes: Planes, weights: Doubles) -> npt.NDArray[np.float32]:
    """Return what a renderer shows that multiplies in some primaries, (k, h, w, 3) in Rec.709.

    weights: (k, n, 3).
    """
    own = from_rec709(primaries)
    # For each channel there, a mix in which all channels here have its multiplier.
    multipliers = multipliers_in(primaries, weights)
    of_channels = np.repeat(np.moveaxis(multipliers, 2, 1)[..., None], 3, axis=3)
    mixed = planes.mixes(of_channels.reshape(-1, *of_channels.shape[2:]))
    mixed = mixed.reshape(*of_channels.shape[:2], *mixed.shape[1:])
    shown = np.einsum("ec,cd,kchwd->khwe", to_rec709(primaries), own, mixed, optimize=True)
    return np.asarray(shown, np.float32)


def response_in(primaries: Primaries, plane: Floats) -> Floats:
    """Return by how much each channel of a light's picture rises with the same channel of its
    weight, (h, w, 3), where a renderer multiplies in some primaries.

    plane: (h, w, 3), the picture at a weight of 1.
    """
    own, back = from_rec709(primaries), to_rec709(primaries)
    return np.asarray(plane @ ((back * own.T) @ own).T, np.float32)


def picture_at(primaries: Primaries, plane: Floats, weight: Doubles) -> Floats:
    """Return a picture whose product with a light's weight, (3,), is what a renderer shows that
    multiplies in some primaries, in all channels in which the weight is not next to nothing.

    plane: (h, w, 3), the picture at a weight of 1.
    """
    own, back = from_rec709(primaries), to_rec709(primaries)
    shown = plane @ ((back * (own @ weight)) @ own).T
    is_lit = weight > LEAST_CHANNEL * weight.max()
    return np.where(is_lit, shown / np.where(is_lit, weight, 1), plane).astype(np.float32)
