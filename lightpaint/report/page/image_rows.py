"""Rows of the report's table of lights; of an image one, with its map."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.light_images import LightImage
from lightpaint.colour.color import luminance
from lightpaint.colour.srgb import encode_display, to_8_bit
from lightpaint.lighting.solution import Solution
from lightpaint.report.page.figures import data_uri

#: Width of the map of an image in pixels.
MAP_WIDTH = 144
#: Share of its pixels that the map may show too bright to tell.
CLIPPED_SHARE = 0.02


@dataclass(frozen=True)
class RowPicture:
    """A small picture in a row. source: data: URI. label: its content in words."""

    source: str
    width: int
    height: int
    label: str


@dataclass(frozen=True)
class RowColor:
    """The colour of a light: `#rrggbb`, None where there is none. notes: what it is in words."""

    hex: str | None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class LevelChange:
    """The change of a light in words. notes: what stands below in small print."""

    text: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class LightEntry:
    """A row of the table of lights.

    kind: plugin and form. share: of the picture's energy. color, now, new, parameter, unit,
    amounts: of the emission, a line each; empty for a light that is fixed. is_relative: whether
    amounts are relative.
    """

    pictures: Sequence[RowPicture]
    name: str
    kind: str
    change: LevelChange
    share: float
    color: RowColor | None = None
    now: Sequence[str] = ()
    new: Sequence[str] = ()
    parameter: str = ""
    unit: str = ""
    amounts: Sequence[str] = ()
    is_relative: bool = False


def image_row(image: LightImage, basis: Basis, solution: Solution, shares: Doubles) -> LightEntry:
    """Return the row of an image that is whole. shares: (n,), see `energy_shares`."""
    weights = solution.weights
    current = basis.current_weights
    stops = map_stops(image.radiances(weights))
    pictures = [
        _map(f"{image.name} {label}", image, image.radiances(radiances), stops)
        for label, radiances in (("now", current), ("solved", weights))
    ]
    plugin, domain = basis.lights[int(image.lights[0])].plugin, image.domain
    now, new = (image.mean(radiances) for radiances in (current, weights))
    return LightEntry(
        pictures,
        image.name,
        f"{plugin} · {image.size_text}",
        luminance_change(now, new),
        float(shares[image.lights].sum()),
        now=_rgb(now),
        new=_rgb(new),
        parameter=domain.parameter,
        unit=f"{domain.unit}, mean over {domain.whole}",
    )


def map_stops(radiances: Floats) -> float:
    """Return the exposure that shows an image, all but its brightest parts."""
    bright = float(np.quantile(luminance(radiances), 1 - CLIPPED_SHARE))
    return -float(np.log2(bright)) if bright > 0 else 0.0


def map_picture(image: LightImage, radiances: Floats, stops: float, width: int) -> Floats:
    """Return an image as Mitsuba interpolates it in display values, (height, width, 3)."""
    size = image.domain.picture_size(image.size, width)
    return encode_display(2.0**stops * image.domain.interpolated(radiances, size))


def _map(label: str, image: LightImage, radiances: Floats, stops: float) -> RowPicture:
    picture = to_8_bit(map_picture(image, radiances, stops, MAP_WIDTH))
    label = f"{label}, {image.domain.extent}, shown at {stops:+.1f} stops"
    return RowPicture(data_uri(picture), MAP_WIDTH, len(picture), label)


def _rgb(color: Sequence[float] | Doubles) -> list[str]:
    return [f"{v:.4g}" for v in color] if any(color) else ["off"]


def luminance_change(now: Doubles, new: Doubles) -> LevelChange:
    """Return the change of luminance from `now` to `new`, (3,) each, as a ratio and in stops."""
    before, after = (float(luminance(color)) for color in (now, new))
    if after == 0:
        return LevelChange("off" if before > 0 else "stays off")
    if before == 0:
        return LevelChange("was off, now on")
    stops = f"{np.log2(after / before):+.2f} stops".replace("-", "−")
    return LevelChange(f"×{after / before:.3g}", (stops,))
