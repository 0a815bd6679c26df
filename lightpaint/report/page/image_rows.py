"""Rows of the report's table of lights for images: one for each, with its map."""

from collections.abc import Sequence
from html import escape

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.light_images import LightImage
from lightpaint.colour.color import luminance
from lightpaint.colour.srgb import encode_display, to_8_bit
from lightpaint.lighting.solution import Solution
from lightpaint.report.page.figures import data_uri
from lightpaint.report.page.html import breakable_name, share_cell

#: Width of the map of an image in pixels.
MAP_WIDTH = 144
#: Share of its pixels that the map may show too bright to tell.
CLIPPED_SHARE = 0.02


def image_row(image: LightImage, basis: Basis, solution: Solution, shares: Doubles) -> str:
    """Return the row of an image that is whole. shares: (n,), see `energy_shares`."""
    weights = solution.weights
    current = basis.current_weights
    stops = map_stops(image.radiances(weights))
    maps = "".join(
        _map(f"{image.name} {label}", image, image.radiances(radiances), stops)
        for label, radiances in (("now", current), ("solved", weights))
    )
    plugin, domain = basis.lights[int(image.lights[0])].plugin, image.domain
    now, new = (image.mean(radiances) for radiances in (current, weights))
    share = float(shares[image.lights].sum())
    return (
        f'<tr><td class="thumb">{maps}</td>'
        f'<th scope="row" class="name">{breakable_name(image.name)}'
        f"<small>{escape(plugin)} · {image.size_text}</small></th>"
        '<td class="colour"></td>'
        f'<td class="rgb now">{_rgb(now)}</td><td class="rgb new">{_rgb(new)}</td>'
        f'<td class="unit">{domain.parameter} '
        f"<small>{domain.unit}, mean over {domain.whole}</small></td>"
        f'<td class="rgb amount"></td><td class="change">{luminance_change(now, new)}</td>'
        f"{share_cell(f'{100 * share:.1f} %', share)}</tr>"
    )


def map_stops(radiances: Floats) -> float:
    """Return the exposure that shows an image, all but its brightest parts."""
    bright = float(np.quantile(luminance(radiances), 1 - CLIPPED_SHARE))
    return -float(np.log2(bright)) if bright > 0 else 0.0


def map_picture(image: LightImage, radiances: Floats, stops: float, width: int) -> Floats:
    """Return an image as Mitsuba interpolates it in display values, (height, width, 3)."""
    size = image.domain.picture_size(image.size, width)
    return encode_display(2.0**stops * image.domain.interpolated(radiances, size))


def _map(label: str, image: LightImage, radiances: Floats, stops: float) -> str:
    picture = to_8_bit(map_picture(image, radiances, stops, MAP_WIDTH))
    caption = escape(f"{label}, {image.domain.extent}, shown at {stops:+.1f} stops")
    return (
        f'<img src="{data_uri(picture)}" width="{MAP_WIDTH}" height="{len(picture)}" '
        f'alt="{caption}" title="{caption}">'
    )


def _rgb(color: Sequence[float] | Doubles) -> str:
    return " <br>".join(f"{v:.4g}" for v in color) if any(color) else "off"


def luminance_change(now: Doubles, new: Doubles) -> str:
    """Return the change of luminance from `now` to `new`, (3,) each, as a ratio and in stops."""
    before, after = (float(luminance(color)) for color in (now, new))
    if after == 0:
        return "off" if before > 0 else "stays off"
    if before == 0:
        return "was off, now on"
    stops = f"{np.log2(after / before):+.2f} stops".replace("-", "−")
    return f"×{after / before:.3g} <small>{stops}</small>"
