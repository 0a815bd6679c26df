"""The table of lights in the report, as HTML.

Names of lights come from other people's files and are escaped here.
"""

from collections.abc import Sequence
from html import escape

import numpy as np

from lightpaint.arrays import RGB, Doubles, Indices
from lightpaint.basis.basis import Basis
from lightpaint.basis.light_images import LightImage, light_images
from lightpaint.basis.lights import BasisLight
from lightpaint.colour.color import rgb_to_hex
from lightpaint.colour.photometry import Photometry
from lightpaint.colour.srgb import to_8_bit
from lightpaint.images.bands import in_turns
from lightpaint.images.pixel_blocks import block_mean
from lightpaint.lighting.analysis.noise.uncertainty import Uncertainty
from lightpaint.lighting.answer.lighting import ALL_REACHED, Lighting, LightSetting
from lightpaint.lighting.solution import Solution
from lightpaint.report.basis_memo import (
    ROWS_SHOWN,
    SPARE_ROWS,
    cached_clean_planes,
    make_once,
    page_reduction,
)
from lightpaint.report.clean_pictures import MAX_CLEAN_THUMBNAILS
from lightpaint.report.measures import energy_shares
from lightpaint.report.page.figures import data_uri, thumbnail
from lightpaint.report.page.html import breakable_name, fold, share_cell
from lightpaint.report.page.image_rows import image_row, luminance_change
from lightpaint.report.phrases import spoken_percent
from lightpaint.report.uncertainty_sentences import (
    UNDETERMINED,
    UNTOLD_HERE,
    spoken_errors,
    unreached_channels,
)

#: Headings of the columns, with the classes of their cells.
COLUMNS = (
    ("thumb", "alone"),
    ("name", "light"),
    ("colour", "colour"),
    ("rgb now", "emission now<br>R, G, B"),
    ("rgb new", "solved<br>R, G, B"),
    ("unit", "parameter"),
    ("rgb amount", "{amounts}"),
    ("change", "luminance"),
    ("share", "share of the<br>picture’s energy"),
)


def lights_table(
    basis: Basis,
    solution: Solution,
    uncertainty: Uncertainty | None = None,
    *,
    is_clean: bool = False,
) -> str:
    """Return a row per light, in document order; of many those with the largest shares, and the
    rest folded.

    Shares are of the picture's energy, now or as solved, whichever is more. is_clean: whether to
    denoise the pictures.
    """
    is_clean = is_clean and len(basis.lights) <= MAX_CLEAN_THUMBNAILS
    rows = _rows(basis, solution, uncertainty, is_clean=is_clean)
    if images := [image for image in light_images(basis.lights) if image.is_whole]:
        return _table_with_images(images, rows, basis, solution)
    if len(rows) <= ROWS_SHOWN + SPARE_ROWS:
        return _table(rows, solution)
    shares = largest_shares(basis, solution.lighting)
    visible_indices = most_visible_lights(basis, solution.lighting)
    other_indices = np.setdiff1d(np.arange(len(rows)), visible_indices)
    note = (
        f"{len(other_indices)} more lights, each at most "
        f"{spoken_percent(float(shares[other_indices].max()))} of the picture, now or as solved"
    )
    return (
        f"<p>The {len(visible_indices)} lights with the largest shares of the picture, "
        "now or as solved.</p>"
        + _table([rows[k] for k in visible_indices], solution)
        + fold(note, _table([rows[k] for k in other_indices], solution))
    )


def _table_with_images(
    images: Sequence[LightImage], rows: Sequence[str], basis: Basis, solution: Solution
) -> str:
    """Return a row for each image and each other light; the rows of texels are folded."""
    shares = energy_shares(basis, solution.lighting)
    in_images = {int(k) for image in images for k in image.lights}
    shown = [image_row(image, basis, solution, shares) for image in images]
    shown += [row for k, row in enumerate(rows) if k not in in_images]
    folds = (
        fold(
            f"the {len(image.lights)} texels of {escape(image.name)}, row by row from the top",
            _table([rows[k] for k in image.lights], solution),
        )
        for image in images
    )
    return _table(shown, solution) + "".join(folds)


def _table(rows: list[str], solution: Solution) -> str:
    amounts = "flux<br>(relative)" if solution.lighting.cd_per_unit is None else "output"
    cells = "".join(
        f'<th scope="col" class="{kind}">{heading.format(amounts=amounts)}</th>'
        for kind, heading in COLUMNS
    )
    return (
        '<div class="scroll" role="region" aria-labelledby="lights" tabindex="0">'
        f'<table class="lights"><thead><tr>{cells}</tr></thead><tbody>{"".join(rows)}</tbody>'
        "</table></div>"
    )


def _rows(
    basis: Basis, solution: Solution, uncertainty: Uncertainty | None, *, is_clean: bool
) -> list[str]:
    shares = energy_shares(basis, solution.lighting)
    errors = spoken_errors(uncertainty, len(shares))
    settings = {light.name: light for light in solution.lighting.lights}

    rows, thumbnails = [], thumbnails_of(basis, is_clean=is_clean)
    for k, (light, (uri, shape, stops)) in enumerate(zip(basis.lights, thumbnails, strict=True)):
        name, setting = escape(light.name), settings[light.name]
        error = UNTOLD_HERE if errors[k] == UNDETERMINED else errors[k]
        error = f" <small>{error}</small>" if error else ""
        caption = f"What {name} lights alone, shown at {stops:+.1f} stops"
        rows.append(
            f'<tr><td class="thumb"><img src="{uri}" '
            f'width="{shape[1]}" height="{shape[0]}" alt="{caption}" '
            f'title="{caption}"></td>'
            f'<th scope="row" class="name">{breakable_name(light.name)}'
            f"<small>{escape(light.plugin)}"
            f"{' · ' + escape(light.form) if light.form else ''}</small></th>"
            f"{_emission_cells(light, setting, solution.lighting)}"
            f'<td class="change">{change(light, setting)}{error}{_constraint_note(setting)}</td>'
            f"{share_cell(f'{100 * shares[k]:.1f} %', shares[k])}</tr>"
        )
    return rows


def thumbnails_of(basis: Basis, *, is_clean: bool) -> list[tuple[str, tuple[int, ...], float]]:
    """Return the picture of each light alone: data: URI, size and exposure. is_clean: whether
    denoised; then of the planes that the page shows, if these are there.
    """
    clean, seen = cached_clean_planes(basis) if is_clean else None, basis.emitters_seen
    if clean is not None and not clean.is_whole:
        factor = page_reduction(basis, len(basis.lights))
        seen = block_mean(seen[..., None].astype(np.float32), factor)[..., 0] > 0

    def shown(k: int) -> tuple[str, tuple[int, ...], float]:
        plane = basis.planes.plane(k) if clean is None else clean.plane(k)
        picture, stops = thumbnail(plane, seen, is_clean=is_clean and clean is None)
        return data_uri(to_8_bit(picture), largest_png=0), picture.shape, stops

    all_lights = range(len(basis.lights))
    return make_once(
        basis, ("thumbnails", is_clean), lambda: in_turns(shown, all_lights, basis.size)
    )


def _emission_cells(light: BasisLight, setting: LightSetting, lighting: Lighting) -> str:
    """Return cells with colour, emission before and after, their unit, and photometry."""
    light_photometry = lighting.photometry(setting)
    if light.is_fixed:
        return "".join(f'<td class="{kind}"></td>' for kind, _ in COLUMNS[2:7])
    return (
        f'<td class="colour">{_swatch(setting, light_photometry)}</td>'
        f'<td class="rgb now">{_rgb(light.emission)}</td>'
        f'<td class="rgb new">{_rgb(setting.emission, setting.reached)}</td>'
        f'<td class="unit">{escape(light.parameter)} <small>{escape(light.unit)}</small></td>'
        f'<td class="rgb amount{" flux" * (lighting.cd_per_unit is None)}">'
        f"{_amounts(light_photometry)}</td>"
    )


def change(light: BasisLight, setting: LightSetting) -> str:
    """Return the change of a light in words or as a ratio of luminance, for channels that reach
    anything.
    """
    if light.is_fixed:
        return "fixed"
    if not any(setting.reached):
        return "unchanged: reaches nothing painted"
    note = f"<small>{unreached_channels(setting)} unchanged: reaches nothing painted</small>"
    return _changed(light, setting) + (note if setting.is_partly_reached else "")


def _changed(light: BasisLight, setting: LightSetting) -> str:
    is_reached = np.array(setting.reached)
    now, new = (np.where(is_reached, rgb, 0) for rgb in (light.emission, setting.emission))
    return luminance_change(now, new)


def _constraint_note(setting: LightSetting) -> str:
    """Return the constraint on a light, and whether it holds the light."""
    note = " (limits it)" if setting.is_active else ""
    return f" <small>{escape(setting.constraint)}{note}</small>" if setting.constraint else ""


def hex_color(emission: RGB) -> str | None:
    """Return the colour of a light as #rrggbb, its brightest channel at full; None if it is off."""
    return rgb_to_hex(np.array(emission)) if any(emission) else None


def _swatch(setting: LightSetting, light_photometry: Photometry) -> str:
    """Return the colour of a light; for a multiplier, the colour of its factor."""
    if setting.is_partly_reached:
        return '<span class="swatch none"></span><small>not known</small>'
    emission = setting.emission
    color = light_photometry.hex or hex_color(emission)
    if color is None or not any(emission):
        return '<span class="swatch none"></span> <small>off</small>'
    kelvin = "" if light_photometry.kelvin is None else f"{light_photometry.kelvin:.0f} K"
    duv_text = (
        "" if light_photometry.duv is None else f"Duv {light_photometry.duv:+.3f}".replace("-", "−")
    )
    return (
        f'<span class="swatch" style="background: {color}"></span><code>{color}</code>'
        f"{f' <small>{kelvin}</small> <small>{duv_text}</small>' if kelvin else ''}"
    )


def _amounts(light_photometry: Photometry) -> str:
    """Return luminous quantity and flux; without a scale, the relative flux."""
    if light_photometry.luminous is not None or light_photometry.flux_lm is not None:
        return " <br>".join(filter(None, light_photometry.amounts))
    return "" if light_photometry.flux_y is None else f"{light_photometry.flux_y:.3g}"


def _rgb(emission: RGB, reached: Sequence[bool] = ALL_REACHED) -> str:
    """Return a line for each channel, in brackets if it is undetermined."""
    if not any(emission):
        return "off"
    channels = zip(emission, reached, strict=True)
    return " <br>".join(f"{v:.4g}" if is_reached else f"({v:.4g})" for v, is_reached in channels)


def largest_shares(basis: Basis, lighting: Lighting) -> Doubles:
    """Return the larger of the current and the solved share of each light, (n,)."""
    current_shares = energy_shares(basis, Lighting.current(basis))
    return np.maximum(energy_shares(basis, lighting), current_shares)


def most_visible_lights(
    basis: Basis, lighting: Lighting, *, among: Indices | None = None
) -> Indices:
    """Return places of the lights to show of many, those with the largest shares; all of few.

    among: places of the lights to choose from, in order; all by default.
    """
    candidates = np.arange(len(basis.lights)) if among is None else among
    if len(candidates) <= ROWS_SHOWN + SPARE_ROWS:
        return candidates
    shares = largest_shares(basis, lighting)[candidates]
    return np.sort(candidates[np.argsort(-shares, kind="stable")[:ROWS_SHOWN]])
