"""Colour science at the edge of the program, over colour-science.

Everything here takes linear Rec.709 (D65) with a last axis of 3. colour-science is imported
when first needed: it takes longer than most solves.
"""

from typing import TYPE_CHECKING, Any, cast

import numpy as np

from lightpaint.images.exr import Floats

if TYPE_CHECKING:
    from types import ModuleType

#: Luminance of linear Rec.709 (ITU-R BT.709-6, item 3.2).
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def luminance(rgb: Floats) -> Floats:
    """Relative luminance, (…,), of linear Rec.709 colours (…, 3)."""
    return np.asarray(rgb @ LUMINANCE)


def delta_e(a: Floats, b: Floats) -> Floats:
    """CIEDE2000 between two images as a display would show them, (…,).

    a, b: (…, 3) linear Rec.709 at the exposure they are looked at, white = 1. What a display
    cannot show is clipped, as the display would.
    """
    colour = _colour()

    def lab(image: Floats) -> Any:
        xyz = colour.RGB_to_XYZ(np.clip(image, 0, 1), "ITU-R BT.709", apply_cctf_decoding=False)
        return colour.XYZ_to_Lab(xyz)

    return np.asarray(colour.delta_E(lab(a), lab(b), method="CIE 2000"))


def _colour() -> "ModuleType":
    import warnings

    with warnings.catch_warnings():
        # It warns about plotting libraries that nothing here needs.
        warnings.simplefilter("ignore")
        import colour
    return cast("ModuleType", colour)
