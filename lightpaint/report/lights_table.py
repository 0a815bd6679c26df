"""The table of lights in the report, as HTML.

Names of lights come from other people's files and are escaped here.
"""

from collections.abc import Sequence
from html import escape

import numpy as np

from lightpaint.arrays import RGB
from lightpaint.basis.basis import Basis, BasisLight
from lightpaint.colour.color import luminance, rgb_to_hex
from lightpaint.colour.display import to_8_bit
from lightpaint.colour.photometry import Photometry
from lightpaint.lighting.analysis.uncertainty import Uncertainty
from lightpaint.lighting.setting import ALL_REACHED, LightSetting
from lightpaint.lighting.solution import Solution
from lightpaint.report.figures import data_uri, thumbnail
from lightpaint.report.html import share_cell
from lightpaint.report.looks import MOST_THUMBNAILS
from lightpaint.report.sentences import spoken_errors, unreached_channels
from lightpaint.report.verdict import energy_shares


def lights_table(
    basis: Basis,
    solution: Solution,
    uncertainty: Uncertainty | None = None,
    *,
    is_clean: bool = False,
) -> str:
    """One row per light, in document order. is_clean: whether its pictures are denoised."""
    is_clean = is_clean and len(basis.lights) <= MOST_THUMBNAILS
    shares = energy_shares(basis, solution.lighting)
    errors = spoken_errors(uncertainty, len(shares))
    settings = {light.name: light for light in solution.lighting.lights}
    rows = []
    for k, (light, image) in enumerate(zip(basis.lights, basis.images, strict=True)):
        share = shares[k]
        picture, stops = thumbnail(image, basis.emitters_seen, is_clean=is_clean)
        name, setting = escape(light.name), settings[light.name]
        error = f"<small>{errors[k]}</small>" if errors[k] else ""
        what = f"What {name} lights alone, shown at {stops:+.1f} stops"
        rows.append(
            f'<tr><td class="thumb"><img src="{data_uri(to_8_bit(picture), largest_png=0)}" '
            f'width="{picture.shape[1]}" height="{picture.shape[0]}" alt="{what}" '
            f'title="{what}"></td>'
            f'<th scope="row">{name}<small>{escape(light.plugin)}'
            f"{' · ' + escape(light.form) if light.form else ''}</small></th>"
            f"{_emission_cells(light, setting, solution.lighting.photometry(setting))}"
            f"<td>{change(light, setting)}{error}{_asked(setting)}</td>"
            f"{share_cell(f'{100 * share:.1f} %', share)}</tr>"
        )
    return "".join(rows)


def amounts_heading(solution: Solution) -> str:
    """What stands in the column of fluxes: lumen where the scene has a scale, else no unit."""
    if solution.lighting.cd_per_unit is None:
        return "flux<br>(relative)"
    return "output"


def _emission_cells(light: BasisLight, setting: LightSetting, seen: Photometry) -> str:
    """Colour, emission before and after, their unit, and what an eye makes of it."""
    if light.is_fixed:
        return '<td></td><td class="rgb"></td><td class="rgb"></td><td class="unit"></td><td></td>'
    return (
        f'<td class="colour">{_swatch(setting, seen)}</td>'
        f'<td class="rgb">{_rgb(light.emission)}</td>'
        f'<td class="rgb">{_rgb(setting.emission, setting.reached)}</td>'
        f'<td class="unit">{escape(light.parameter)}<small>{escape(light.unit)}</small></td>'
        f'<td class="rgb">{_amounts(seen)}</td>'
    )


def change(light: BasisLight, setting: LightSetting) -> str:
    """In words or as a ratio of luminance, what happens to a light where it reaches anything."""
    if light.is_fixed:
        return "kept as it is"
    if not any(setting.reached):
        return "unchanged: reaches nothing painted"
    kept = f"<small>{unreached_channels(setting)} kept: reaches nothing painted</small>"
    return _changed(light, setting) + (kept if setting.is_partly_reached else "")


def _changed(light: BasisLight, setting: LightSetting) -> str:
    its = np.array(setting.reached)
    before = float(luminance(np.where(its, light.emission, 0)))
    after = float(luminance(np.where(its, setting.emission, 0)))
    if after == 0:
        return "off" if before > 0 else "stays off"
    if before == 0:
        return "was off, now on"
    stops = f"{np.log2(after / before):+.2f} stops".replace("-", "−")
    return f"×{after / before:.3g}<small>{stops}</small>"


def _asked(setting: LightSetting) -> str:
    """What was asked of a light, and whether that holds it."""
    holds = " (holds it)" if setting.is_active else ""
    return f"<small>{escape(setting.constraint)}{holds}</small>" if setting.constraint else ""


def hex_color(emission: RGB) -> str | None:
    """Colour of a light as #rrggbb, its brightest channel at full; None if it is off."""
    return rgb_to_hex(np.array(emission)) if any(emission) else None


def _swatch(setting: LightSetting, seen: Photometry) -> str:
    """The colour of a light; of one whose own is not known, that of its factor."""
    if setting.is_partly_reached:
        return '<span class="swatch none"></span><small>not known</small>'
    emission = setting.emission
    color = seen.hex or hex_color(emission)
    if color is None or not any(emission):
        return '<span class="swatch none"></span><small>off</small>'
    kelvin = "" if seen.kelvin is None else f"{seen.kelvin:.0f} K"
    away = "" if seen.duv is None else f"Duv {seen.duv:+.3f}".replace("-", "−")
    return (
        f'<span class="swatch" style="background: {color}"></span><code>{color}</code>'
        f"{f'<small>{kelvin}</small><small>{away}</small>' if kelvin else ''}"
    )


def _amounts(seen: Photometry) -> str:
    """Luminous quantity and flux; without a scale, the flux in proportion."""
    if seen.luminous is not None or seen.flux_lm is not None:
        return "<br>".join(filter(None, seen.amounts))
    return "" if seen.flux_y is None else f"{seen.flux_y:.3g}"


def _rgb(emission: RGB, reached: Sequence[bool] = ALL_REACHED) -> str:
    """A line for each channel, in brackets where nothing tells it."""
    if not any(emission):
        return "off"
    told = zip(emission, reached, strict=True)
    return "<br>".join(f"{v:.4g}" if tells else f"({v:.4g})" for v, tells in told)
