"""Colours as numbers: spaces, temperatures, view transforms, displays. Nothing here reads
pictures.
"""

from typing import TYPE_CHECKING, Literal

from lightpaint.lazy_names import lazy_names

#: What a lamp saves, or uses most, among the drives that mix the same colour. It stands here, so
#: that options name it without the libraries that find these drives.
Preference = Literal["watts", "white", "fewest", "rf"]

if TYPE_CHECKING:
    from lightpaint.colour.color import C2 as C2
    from lightpaint.colour.color import LUMINANCE as LUMINANCE
    from lightpaint.colour.color import WHITE_DUV as WHITE_DUV
    from lightpaint.colour.color import cct_and_duv as cct_and_duv
    from lightpaint.colour.color import ciede2000 as ciede2000
    from lightpaint.colour.color import delta_e as delta_e
    from lightpaint.colour.color import hex_to_rgb as hex_to_rgb
    from lightpaint.colour.color import hue_name as hue_name
    from lightpaint.colour.color import kelvin_to_rgb as kelvin_to_rgb
    from lightpaint.colour.color import lab as lab
    from lightpaint.colour.color import lab_of_lights as lab_of_lights
    from lightpaint.colour.color import luminance as luminance
    from lightpaint.colour.color import matching_functions as matching_functions
    from lightpaint.colour.color import rgb_to_hex as rgb_to_hex
    from lightpaint.colour.color import uv_of_black_body as uv_of_black_body
    from lightpaint.colour.color import xy_of as xy_of
    from lightpaint.colour.color import xy_of_spectrum as xy_of_spectrum
    from lightpaint.colour.color import xyz_of as xyz_of
    from lightpaint.colour.color_ranges import DIRECTIONS as DIRECTIONS
    from lightpaint.colour.color_ranges import ROUND_OFF as ROUND_OFF
    from lightpaint.colour.color_ranges import ColorHull as ColorHull
    from lightpaint.colour.color_ranges import WhiteRange as WhiteRange
    from lightpaint.colour.color_ranges import chromaticity as chromaticity
    from lightpaint.colour.color_ranges import reach_of as reach_of
    from lightpaint.colour.color_ranges import sides_of as sides_of
    from lightpaint.colour.color_ranges import white_range as white_range
    from lightpaint.colour.display.exposure import choose_exposure as choose_exposure
    from lightpaint.colour.display.tone_curves import BUILT_IN as BUILT_IN
    from lightpaint.colour.display.view_transform import MAX_STOPS as MAX_STOPS
    from lightpaint.colour.display.view_transform import TransformChoice as TransformChoice
    from lightpaint.colour.display.view_transform import ViewTransform as ViewTransform
    from lightpaint.colour.display.view_transform import curve_of as curve_of
    from lightpaint.colour.display.view_transform import lattice_of as lattice_of
    from lightpaint.colour.lamp import MAX_EMITTERS as MAX_EMITTERS
    from lightpaint.colour.lamp import MAX_SLOTS as MAX_SLOTS
    from lightpaint.colour.lamp import OPAQUE as OPAQUE
    from lightpaint.colour.lamp import Lamp as Lamp
    from lightpaint.colour.lamp import LampEmitter as LampEmitter
    from lightpaint.colour.lamp import SlotFilter as SlotFilter
    from lightpaint.colour.luminous_flux import Photometry as Photometry
    from lightpaint.colour.luminous_flux import lambertian_flux as lambertian_flux
    from lightpaint.colour.luminous_flux import photometry as photometry
    from lightpaint.colour.luminous_flux import point_flux as point_flux
    from lightpaint.colour.luminous_flux import solid_angle as solid_angle
    from lightpaint.colour.luminous_flux import spot_cone as spot_cone
    from lightpaint.colour.luminous_flux import spot_flux as spot_flux
    from lightpaint.colour.primaries import ACESCG as ACESCG
    from lightpaint.colour.primaries import REC709 as REC709
    from lightpaint.colour.primaries import REC2020 as REC2020
    from lightpaint.colour.primaries import SPACES as SPACES
    from lightpaint.colour.primaries import Profile as Profile
    from lightpaint.colour.primaries import are_same as are_same
    from lightpaint.colour.primaries import converted as converted
    from lightpaint.colour.primaries import decode_display as decode_display
    from lightpaint.colour.primaries import encode_display as encode_display
    from lightpaint.colour.primaries import from_rec709 as from_rec709
    from lightpaint.colour.primaries import gamma_profile as gamma_profile
    from lightpaint.colour.primaries import is_rec709 as is_rec709
    from lightpaint.colour.primaries import primaries_in as primaries_in
    from lightpaint.colour.primaries import read_icc as read_icc
    from lightpaint.colour.primaries import rgb_to_xyz as rgb_to_xyz
    from lightpaint.colour.primaries import srgb_profile as srgb_profile
    from lightpaint.colour.primaries import to_8_bit as to_8_bit
    from lightpaint.colour.primaries import to_rec709 as to_rec709
    from lightpaint.colour.spectra.color_rendering import ColorRendering as ColorRendering
    from lightpaint.colour.spectra.color_rendering import adapted_color as adapted_color
    from lightpaint.colour.spectra.color_rendering import color_rendering as color_rendering
    from lightpaint.colour.spectra.color_rendering import fidelity as fidelity
    from lightpaint.colour.spectra.color_rendering import white_of as white_of
    from lightpaint.colour.spectra.spectrum import EYE as EYE
    from lightpaint.colour.spectra.spectrum import FEWEST_POINTS as FEWEST_POINTS
    from lightpaint.colour.spectra.spectrum import STEP as STEP
    from lightpaint.colour.spectra.spectrum import WAVELENGTHS as WAVELENGTHS
    from lightpaint.colour.spectra.spectrum import Observer as Observer
    from lightpaint.colour.spectra.spectrum import Spectrum as Spectrum
    from lightpaint.colour.spectra.spectrum import daylight as daylight
    from lightpaint.colour.spectra.spectrum import file_of_spectrum as file_of_spectrum
    from lightpaint.colour.spectra.spectrum import measured_points as measured_points
    from lightpaint.colour.spectra.spectrum import named_spectrum as named_spectrum
    from lightpaint.colour.spectra.spectrum import read_observer as read_observer
    from lightpaint.colour.spectra.spectrum import rgb_of_powers as rgb_of_powers
    from lightpaint.colour.spectra.spectrum import spectrum_of as spectrum_of
    from lightpaint.colour.spectra.spectrum import xyz_of_powers as xyz_of_powers

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
