"""Photometry of lights: colour, colour temperature, luminous quantities and flux.

A scene in RGB has no absolute scale: only its author knows what radiance 1 stands for. One number,
in cd/m², gives the scale of everything: if radiance 1 W/(m² sr) stands for u cd/m², an emission
with the luminance-weighted mean Y is

    area, constant   u Y(L) cd/m²      point, spot   u Y(I) cd      directional   u Y(E) lx

and a flux of Φ watts is u Y(Φ) lm. Without u the numbers are only relative, and have no units.

A fixture with given beam and field angles has the flux of the closest cone of Mitsuba's spot.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from lightpaint.arrays import RGB
from lightpaint.colour.color import WHITE_DUV, cct_and_duv, luminance, rgb_to_hex

#: Luminous counterparts of emission units. Multiples of a scene's emission have none.
LUMINOUS_UNITS = {"W/(m² sr)": "cd/m²", "W/sr": "cd", "W/m²": "lx"}

#: Widest cone that Mitsuba's spot has, in degrees from its axis.
WIDEST = 89.0

#: Least share of a cone over which a spot fades: its beam must be narrower than its cutoff.
LEAST_FADE = 1e-3


@dataclass(frozen=True)
class Photometry:
    """The photometric quantities of one light.

    y: luminance-weighted emission, 0.2126 R + 0.7152 G + 0.0722 B.
    hex: its display colour, with the brightest channel at full. kelvin, duv: its correlated colour
    temperature; None if it is off, of unknown colour, or no white: beyond `WHITE_DUV`. flux_w:
    radiant flux per channel; None for a light without a flux, such as the sun. flux_y: the same,
    luminance-weighted. luminous, luminous_unit, flux_lm: in cd/m², cd or lx, and in lumens; only
    with a scale.
    """

    y: float
    hex: str | None
    kelvin: float | None
    duv: float | None
    flux_w: RGB | None
    flux_y: float | None
    luminous: float | None
    luminous_unit: str
    flux_lm: float | None

    @property
    def color(self) -> str:
        """Colour and temperature, such as `#ffaa66 2856 K`, as far as they are defined."""
        kelvin = "" if self.kelvin is None else f"{self.kelvin:.0f} K"
        return " ".join(filter(None, (self.hex, kelvin)))

    def without_colour(self) -> "Photometry":
        """Return the same quantities for a light of unknown colour."""
        return replace(self, hex=None, kelvin=None, duv=None)

    @property
    def amounts(self) -> tuple[str, str]:
        """Luminous quantity and luminous flux as text, each "" if undefined."""
        luminous = (
            "" if self.luminous is None else f"{_in_words(self.luminous)} {self.luminous_unit}"
        )
        return luminous, "" if self.flux_lm is None else f"{_in_words(self.flux_lm)} lm"

    def fields(self) -> dict[str, Any]:
        """Return the fields for JSON (docs/formats.md); undefined quantities are left out."""
        by_name = {
            "y": self.y,
            "hex": self.hex,
            "cct_k": self.kelvin,
            "duv": self.duv,
            "flux_w": None if self.flux_w is None else list(self.flux_w),
            "flux_y": self.flux_y,
            "luminous": self.luminous,
            "luminous_unit": self.luminous_unit or None,
            "flux_lm": self.flux_lm,
        }
        return {key: value for key, value in by_name.items() if value is not None}


def photometry(
    emission: RGB, *, unit: str, unit_flux: RGB | None = None, cd_per_unit: float | None = None
) -> Photometry:
    """Return the photometric quantities of a light with `emission` in `unit`.

    unit_flux: watts radiated per channel at an emission of 1.
    cd_per_unit: cd/m² that radiance 1 stands for.
    """
    is_colour = unit in LUMINOUS_UNITS
    y = float(luminance(np.array(emission)))
    flux = None if unit_flux is None else _times(emission, unit_flux)
    flux_y = None if flux is None else float(luminance(np.array(flux)))
    # A multiple of several emissions has no colour, but their total flux has one.
    colour = emission if is_colour else flux
    has_colour = colour is not None and any(colour)
    temperature = cct_and_duv(np.array(colour)) if has_colour else None
    is_white = temperature is not None and abs(temperature[1]) <= WHITE_DUV
    kelvin, duv = temperature if temperature is not None and is_white else (None, None)
    scale = cd_per_unit
    return Photometry(
        y=y,
        hex=rgb_to_hex(np.array(colour)) if has_colour else None,
        kelvin=kelvin,
        duv=duv,
        flux_w=flux,
        flux_y=flux_y,
        luminous=scale * y if scale is not None and is_colour else None,
        luminous_unit=LUMINOUS_UNITS[unit] if scale is not None and is_colour else "",
        flux_lm=scale * flux_y if scale is not None and flux_y is not None else None,
    )


def lambertian_flux(area: float) -> float:
    """Return the watts per unit of radiance of a surface that is equally bright from all sides: π
    A.
    """
    return math.pi * area


def point_flux() -> float:
    """Return the watts per unit of intensity of a light equally bright in all directions: 4π."""
    return 4 * math.pi


def spot_flux(cutoff: float, beam_width: float) -> float:
    """Return the watts per unit of intensity of Mitsuba's spot; angles from the axis, in radians.

    Its intensity is constant up to the beam width b, and then falls linearly with the angle to 0 at
    the cutoff c:

      2π (∫₀ᵇ sin θ dθ + ∫ᵇᶜ (c − θ)/(c − b) sin θ dθ) = 2π (1 − (sin c − sin b)/(c − b))
    """
    c, b = cutoff, min(beam_width, cutoff)
    # (sin c − sin b)/(c − b), without subtracting numbers that may be equal.
    half = (c - b) / 2
    sinc = math.sin(half) / half if half > 1e-8 else 1.0
    return 2 * math.pi * (1 - math.cos((c + b) / 2) * sinc)


def _in_words(value: float) -> str:
    # 1,480 instead of 1.48e+03, but not a hundred digits either.
    return f"{value:,.0f}" if 1000 <= value < 1e7 else f"{value:.3g}"


def _times(a: RGB, b: RGB) -> RGB:
    r, g, blue = (x * y for x, y in zip(a, b, strict=True))
    return r, g, blue


def spot_cone(beam_angle: float, field_angle: float) -> tuple[float, float]:
    """Return cutoff and beam width of a spot, in degrees from its axis.

    beam_angle, field_angle: full angles b and f at which the intensity is 50 % and 10 %. Between
    its beam width w and its cutoff c, Mitsuba's spot falls linearly with the angle θ,
    (c − θ)/(c − w), which is 1/2 at b/2 and 1/10 at f/2 for

      c = f/2 + (f − b)/8      w = b/2 − 5 (f − b)/8

    A field of more than 1.8 times the beam would need w < 0: such a spot falls from its axis on,
    and has 10 % at f/2 alone. Without a fade, f = b, both are b/2.
    """
    beam, field = beam_angle / 2, max(field_angle, beam_angle) / 2
    cutoff, width = field + 0.25 * (field - beam), beam - 1.25 * (field - beam)
    if width < 0:
        cutoff, width = field / 0.9, 0.0
    cutoff = min(cutoff, WIDEST)
    return cutoff, min(width, cutoff * (1 - LEAST_FADE))


def solid_angle(beam_angle: float, field_angle: float) -> float:
    """Return lumens per candela of a spot, the integral of its profile over all directions."""
    cutoff, width = spot_cone(beam_angle, field_angle)
    return spot_flux(math.radians(cutoff), math.radians(width))
