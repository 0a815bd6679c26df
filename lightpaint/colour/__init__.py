"""Colours as numbers: spaces, temperatures, view transforms, displays. Nothing here reads
pictures.
"""

from typing import TYPE_CHECKING, Literal

from lightpaint.lazy_names import lazy_names

#: What a lamp saves, or uses most, among the drives that mix the same colour. It stands here, so
#: that options name it without the libraries that find these drives.
Preference = Literal["watts", "white", "fewest", "rf"]

if TYPE_CHECKING:
    # fmt: off
    from lightpaint.colour.color import (
        C2, LUMINANCE, NAMED_DUV, WHITE_DUV, cct_and_duv, ciede2000, delta_e, hex_to_rgb,
        hue_name, kelvin_to_rgb, lab, lab_of_lights, luminance, matching_functions, rgb_to_hex,
        uv_of_black_body, xy_of, xy_of_spectrum, xyz_of,
    )
    from lightpaint.colour.color_ranges import (
        DIRECTIONS, ROUND_OFF, ColorHull, WhiteRange, chromaticity, reach_of, sides_of, white_range,
    )
    from lightpaint.colour.display.exposure import choose_exposure
    from lightpaint.colour.display.tone_curves import BUILT_IN
    from lightpaint.colour.display.view_transform import (
        MAX_STOPS, TransformChoice, ViewTransform, curve_of, lattice_of,
    )
    from lightpaint.colour.lamp import (
        MAX_EMITTERS, MAX_SLOTS, OPAQUE, Lamp, LampEmitter, SlotFilter,
    )
    from lightpaint.colour.luminous_flux import (
        Photometry, lambertian_flux, photometry, point_flux, solid_angle, spot_cone, spot_flux,
    )
    from lightpaint.colour.primaries import (
        ACESCG, REC709, REC2020, SPACES, Profile, are_same, converted, decode_display,
        encode_display, from_rec709, gamma_profile, is_rec709, primaries_in, read_icc, rgb_to_xyz,
        srgb_profile, to_8_bit, to_rec709,
    )
    from lightpaint.colour.rendering_indices import (
        ColorRendering, adapted_color, color_rendering, fidelity, white_of,
    )
    from lightpaint.colour.spectrum import (
        EYE, FEWEST_POINTS, STEP, WAVELENGTHS, Observer, Spectrum, daylight, file_of_spectrum,
        measured_points, named_spectrum, read_observer, rgb_of_powers, spectrum_of, xyz_of_powers,
    )
    # fmt: on

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
