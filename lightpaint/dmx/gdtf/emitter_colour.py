"""Colours of emitters, filters and lamps in a GDTF file, and usual ones where a file has none."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from lightpaint import colour
from lightpaint.arrays import RGB, Doubles, as_rgb
from lightpaint.dmx.gdtf.mode_channels import Curve
from lightpaint.errors import ColorError
from lightpaint.storage.rig_archive import library

#: Chromaticity of CIE 1931.
Chromaticity = tuple[float, float]

#: Least y of a chromaticity, and least share of light that a filter lets through.
LEAST_Y, LEAST_TRANSMISSION = 0.002, 0.002

#: Least area of the triangle of three colours in the diagram of chromaticities, times two.
LEAST_AREA = 1e-4

#: Largest distance, in x and y, of the colours of an emitter and of its measured spectrum.
SAME_COLOUR = 0.03

#: Name of an emitter, its usual chromaticity and its usual share of a fixture's luminance, by what
#: follows `ColorAdd_`. Some programs write A and L.
USUAL: Mapping[str, tuple[str, Chromaticity, float]] = {
    "R": ("red", (0.69, 0.305), 20),
    "G": ("green", (0.17, 0.70), 45),
    "B": ("blue", (0.14, 0.05), 8),
    "C": ("cyan", (0.10, 0.35), 25),
    "M": ("magenta", (0.38, 0.16), 15),
    "Y": ("yellow", (0.48, 0.51), 40),
    "RY": ("amber", (0.56, 0.43), 30),
    "A": ("amber", (0.56, 0.43), 30),
    "GY": ("lime", (0.41, 0.55), 60),
    "L": ("lime", (0.41, 0.55), 60),
    "GC": ("mint", (0.14, 0.55), 30),
    "BC": ("azure", (0.12, 0.15), 12),
    "BM": ("indigo", (0.16, 0.02), 4),
    "RM": ("pink", (0.50, 0.25), 18),
    "W": ("white", (0.3127, 0.3290), 60),
    "WW": ("warm white", (0.44, 0.403), 55),
    "CW": ("cool white", (0.3127, 0.3290), 60),
    "UV": ("uv", (0.168, 0.008), 1),
}

#: Transmission of usual filters in linear Rec.709, by what follows `ColorSub_`.
USUAL_FILTERS: Mapping[str, RGB] = {
    "C": (0.02, 0.70, 0.85),
    "M": (0.85, 0.02, 0.70),
    "Y": (0.95, 0.85, 0.02),
}


def rgb_of_xy(xy: Chromaticity) -> Doubles:
    """Return the linear Rec.709 colour of luminance 1, (3,); channels may be negative."""
    x, y = xy
    return np.asarray(
        np.linalg.solve(colour.rgb_to_xyz(colour.REC709), [x / y, 1.0, (1 - x - y) / y])
    )


@cache
def _equal_energy() -> Doubles:
    """Return the colour of equal power at all wavelengths, which filters are measured against."""
    xy = colour.xy_of_spectrum(np.array([300.0, 900.0]), np.ones(2))
    assert xy is not None
    return rgb_of_xy(xy)


@dataclass(frozen=True)
class EmitterColour:
    """The colour and brightness of an emitter, as far as a file has them.

    xy: its chromaticity. share: its luminance relative to others of the file. candela: what was
    measured at full, if it was. curve: pairs of a share of full, and of the light that was measured
    there. is_usual: whether the file has no colour, so that this is a usual one. spectrum: at full;
    None if it was not measured, or the file's colour is another.
    """

    name: str
    xy: Chromaticity
    share: float
    candela: float | None = None
    curve: Curve = ()
    is_usual: bool = False
    spectrum: colour.Spectrum | None = None


def emitter_colour(suffix: str, link: str | None, emitters: Sequence[Element]) -> EmitterColour:
    """Return the colour of the emitter that a channel dims.

    suffix: what follows `ColorAdd_` in the channel's attribute. link: name of the emitter, if the
    channel says it. emitters: of the file.
    """
    name, xy, share = USUAL.get(suffix, (suffix.lower() or "light", (0.3127, 0.3290), 30.0))
    by_name = {x.get("Name", "").casefold(): x for x in emitters}
    element = by_name.get((link or name).casefold(), by_name.get(name))
    if element is None:
        return EmitterColour(name, xy, share, is_usual=True)
    found = parsed_colour(element.get("Color"))
    measured = library("pygdtf").Emitter(xml_node=element)
    wave = measured.dominant_wave_length
    own = found[0] if found else _spectral(measured.measurements)
    if own is None and wave:
        own = colour.xy_of_spectrum(np.array([wave]), np.ones(1))
    candela, curve = _measured_light(measured.measurements)
    return EmitterColour(
        " ".join(element.get("Name", "").lower().split()) or name,
        bounded(own or xy),
        found[1] if found and found[1] > 0 else share,
        candela,
        curve,
        is_usual=own is None,
        spectrum=_measured_spectrum(measured.measurements, own),
    )


def parsed_colour(text: str | None) -> tuple[Chromaticity, float] | None:
    """Return chromaticity and Y of the text of a colour; None if there is none."""
    if not text:
        return None
    numbers = [float(x) for x in text.split(",")]
    if len(numbers) < 2 or not 0 < numbers[1] <= 1:
        return None
    return bounded((numbers[0], numbers[1])), numbers[2] if len(numbers) > 2 else 0.0


def bounded(xy: Chromaticity) -> Chromaticity:
    """Return the chromaticity as a light may have it: positive X, Y and Z."""
    x, y = max(xy[0], 0.0), max(xy[1], LEAST_Y)
    size = max(x + y, 1.0)
    return x / size, y / size


def _spectral(measurements: Sequence[Any]) -> Chromaticity | None:
    """Return the chromaticity of the spectrum that was measured at the highest level."""
    for measurement in sorted(measurements, key=lambda x: -float(x.physical)):
        points = _spectrum(measurement)
        if len(points) > 1:
            return colour.xy_of_spectrum(*points.T)
    return None


def _measured_spectrum(
    measurements: Sequence[Any], own: Chromaticity | None
) -> colour.Spectrum | None:
    """Return the spectrum that was measured at the highest level, if it has the emitter's colour.

    own: this colour, None if the file has none.
    """
    full = max(measurements, key=lambda x: float(x.physical), default=None)
    points = np.zeros((0, 2)) if full is None else _spectrum(full)
    if own is None or len(points) < colour.FEWEST_POINTS:
        return None
    try:
        found = colour.spectrum_of(*points.T)
    except ColorError:  # nobody sees it
        return None
    return (
        found if math.dist(colour.xy_of(colour.xyz_of_powers(found)), own) < SAME_COLOUR else None
    )


def _spectrum(measurement: Any) -> Doubles:
    """Return wavelengths in nanometres, rising, and powers, (k, 2)."""
    points = sorted((x.wave_length, max(x.energy, 0.0)) for x in measurement.measurement_points)
    if not np.isfinite(points).all():
        raise ValueError("a spectrum that is not finite")
    return np.array(points, float)


def _measured_light(measurements: Sequence[Any]) -> tuple[float | None, Curve]:
    """Return candelas at full, and the light at shares of full if that is not in proportion."""
    pairs = sorted((float(x.physical), float(x.luminous_intensity)) for x in measurements)
    pairs = [(level, candela) for level, candela in pairs if level > 0 and candela > 0]
    if not pairs:
        return None, ()
    top_level, top = pairs[-1]
    points = [(0.0, 0.0), *((level / top_level, candela / top) for level, candela in pairs)]
    rising = [points[0]]
    for level, light in points[1:]:
        if level > rising[-1][0] and light > rising[-1][1]:
            rising.append((level, light))
    is_straight = all(abs(level - light) < 1e-3 for level, light in rising)
    return top, () if is_straight or rising[-1] != (1.0, 1.0) else tuple(rising)


def possible_kelvin(kelvin: float) -> float:
    """Return the colour temperature that a file means, in the range that lamps have."""
    return min(max(kelvin, 1000.0), 100_000.0)


def xy_of_kelvin(kelvin: float) -> Chromaticity:
    """Return the chromaticity of a black body."""
    [uv] = colour.uv_of_black_body(np.array([possible_kelvin(kelvin)]))
    return colour.xy_of(colour.xyz_of(uv))


def whites_of(own: float, ends: tuple[float, float]) -> list[EmitterColour]:
    """Return the coolest and the warmest white of a lamp whose colour is filtered.

    own: its own colour temperature, of all its light. ends: of the range, in kelvin. Filters let
    through as much as they can: all of the channel in which the other colour has most.
    """
    lamp, found = rgb_of_xy(xy_of_kelvin(own)), []
    for name, kelvin in (("cool white", max(ends)), ("warm white", min(ends))):
        xy = xy_of_kelvin(kelvin)
        found.append(EmitterColour(name, xy, float(1 / np.max(rgb_of_xy(xy) / lamp))))
    return found


@dataclass(frozen=True)
class ColourSpace:
    """A space in which channels name colours by red, green and blue: chromaticities of these, and
    of all three at full.
    """

    corners: tuple[Chromaticity, Chromaticity, Chromaticity]
    white: Chromaticity


#: Spaces by the names that the standard gives them (DIN SPEC 15800, `ColorSpace`).
SPACES: Mapping[str, ColourSpace] = {
    "sRGB": ColourSpace(((0.64, 0.33), (0.30, 0.60), (0.15, 0.06)), (0.3127, 0.3290)),
    "ProPhoto": ColourSpace(
        ((0.7347, 0.2653), (0.1596, 0.8404), (0.0366, 0.0001)), (0.3457, 0.3585)
    ),
    "ANSI": ColourSpace(((0.7347, 0.2653), (0.1596, 0.8404), (0.0366, 0.001)), (0.4254, 0.4044)),
}


def primaries_of(space: ColourSpace) -> list[EmitterColour]:
    """Return red, green and blue of a space, whose sum is its white."""
    corners = [bounded(xy) for xy in space.corners]
    columns = np.array([(x / y, 1.0, (1 - x - y) / y) for x, y in corners]).T
    (x, y), names = space.white, ("red", "green", "blue")
    shares = np.maximum(np.linalg.solve(columns, [x / y, 1.0, (1 - x - y) / y]), 1e-5)
    return [
        EmitterColour(name, xy, float(share))
        for name, xy, share in zip(names, corners, shares / shares.sum(), strict=True)
    ]


def colour_space(name: str | None, main: Sequence[Element], more: Sequence[Element]) -> ColourSpace:
    """Return the space in which a channel names colours, the space of Rec.709 if the file has none.

    name: that the channel gives, of one of `more`. main: the space of the file, if it has one.
    """
    named = [x for x in more if name and x.get("Name") == name]
    element = next(iter((*named, *main)), None)
    if element is None:
        return SPACES["sRGB"]
    colours = [parsed_colour(element.get(key)) for key in ("Red", "Green", "Blue", "WhitePoint")]
    if element.get("Mode") != "Custom" or None in colours:
        return SPACES.get(element.get("Mode", "sRGB"), SPACES["sRGB"])
    red, green, blue, white = (x[0] for x in colours if x is not None)
    if abs(np.linalg.det([(*xy, 1.0) for xy in (red, green, blue)])) < LEAST_AREA:
        raise ValueError("a ColorSpace whose colours lie on a line")
    return ColourSpace((red, green, blue), white)


def rgb_emitters(links: Sequence[str | None], emitters: Sequence[Element]) -> list[EmitterColour]:
    """Return the emitters that channels of red, green and blue dim; none if they name colours of a
    space.

    links: names of emitters that the channels give. emitters: of the file; three called red, green
    and blue, and no other, count without links.
    """
    names = [(x.get("Name") or "").casefold() for x in emitters]
    if not all(links) and sorted(names) != ["blue", "green", "red"]:
        return []
    found = [
        emitter_colour(suffix, link, emitters) for suffix, link in zip("RGB", links, strict=True)
    ]
    is_known = not any(x.is_usual for x in found) and len({x.name for x in found}) == 3
    return found if is_known else []


def density_of(suffix: str, filters: Sequence[Element], link: str | None) -> tuple[RGB, bool]:
    """Return the optical density (natural logarithm) of a filter all the way in, in linear Rec.709.

    The densities at all measured positions are fitted by a straight line from none. Also returns
    whether the file says nothing of it, so that it is a usual one.
    """
    element = next((x for x in filters if x.get("Name") == link), None)
    points = [] if element is None else _transmissions(element)
    if not points:
        return as_rgb(-np.log(USUAL_FILTERS[suffix])), True
    places = np.array([place for place, _ in points])
    densities = -np.log(np.clip([x for _, x in points], LEAST_TRANSMISSION, 1.0))
    return as_rgb(places @ densities / (places @ places)), False


def filter_spectrum(element: Element) -> tuple[Doubles, Doubles, float] | None:
    """Return wavelengths in nanometres and transmissions in any unit, (k,) each, of a filter all
    the way in, and the share of light that it lets through; None if it was not measured.
    """
    measured = library("pygdtf").Filter(xml_node=element).measurements
    for x in sorted(measured, key=lambda x: -float(x.physical)):
        spectrum = _spectrum(x)
        if len(spectrum) > 1 and x.transmission > 0:
            return spectrum[:, 0], spectrum[:, 1], _as_share(x.transmission)
    return None


def _as_share(transmission: float) -> float:
    """Return a transmission as a share of 1: files have percentages, too."""
    return float(transmission) / 100 if transmission > 1 else float(transmission)


def _transmissions(element: Element) -> list[tuple[float, Doubles]]:
    """Return how far in a filter is, 0 to 1, and its transmission there in linear Rec.709."""
    points = []
    for measurement in library("pygdtf").Filter(xml_node=element).measurements:
        spectrum = _spectrum(measurement)
        if len(spectrum) > 1 and measurement.physical > 0 and measurement.transmission > 0:
            xy = colour.xy_of_spectrum(*spectrum.T)
            if xy is not None:
                level = _as_share(measurement.transmission)
                points.append((measurement.physical / 100, level * rgb_of_xy(xy) / _equal_energy()))
    given = parsed_colour(element.get("Color"))
    if not points and given is not None and given[1] > 0:
        points.append((1.0, min(given[1], 100.0) / 100 * rgb_of_xy(given[0])))
    return points
