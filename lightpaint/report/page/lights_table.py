"""The table of lights in the report, and the section on how lamps render colours, where their
spectra are known.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from markupsafe import Markup

from lightpaint.arrays import RGB, Doubles, Floats, Indices
from lightpaint.basis import Basis, BasisLight, LightImage, light_images, make_once
from lightpaint.colour import Photometry, encode_display, luminance, rgb_to_hex, to_8_bit
from lightpaint.images import block_mean, in_turns
from lightpaint.lighting import (
    ALL_REACHED,
    Lighting,
    LightRendering,
    LightSetting,
    Solution,
    SurfaceColor,
    Uncertainty,
    renderings_of,
)
from lightpaint.report import diagnosis_sentences, phrases
from lightpaint.report.basis_memo import ROWS_SHOWN, SPARE_ROWS, cached_clean_planes, page_reduction
from lightpaint.report.measures import energy_shares
from lightpaint.report.page.figures import data_uri, thumbnail
from lightpaint.report.page.html import html

#: Width of the map of an image in pixels.
MAP_WIDTH = 144
#: Share of its pixels that the map may show too bright to tell.
CLIPPED_SHARE = 0.02


def rendering_section(lighting: Lighting, surfaces: Sequence[SurfaceColor] = ()) -> Markup:
    """Return the section; "" without spectra. surfaces: colours of objects under the lighting."""
    found = renderings_of(lighting)
    if not found:
        return Markup("")
    lamps = [{"name": name, "cells": _cells(x)} for name, x in found.items()]
    return html(
        "rendering",
        lamps=lamps,
        sentences=phrases.rendering_sentences(found),
        surfaces=[_surface(x) for x in surfaces],
    )


def rendering_numbers(lighting: Lighting) -> dict[str, dict[str, Any]] | None:
    """Return the same for programs, by name of lamp; None without spectra."""
    numbers = {
        name: {
            **({} if x.color is None else vars(x.color)),
            "best_rf": x.best_rf,
            "lm_per_w": x.lm_per_w,
            **({} if x.wanted_rf is None else _wish(x)),
        }
        for name, x in renderings_of(lighting).items()
    }
    return numbers or None


def _surface(found: SurfaceColor) -> dict[str, Any]:
    """Return a row of the table of objects."""
    return {
        "name": found.name,
        "colors": [None if x is None else _hex(x) for x in (found.daylight, found.seen)],
        "delta_e": "coloured light" if found.delta_e is None else f"{found.delta_e:.1f}",
    }


def _hex(rgb: RGB) -> str:
    red, green, blue = to_8_bit(encode_display(np.clip(rgb, 0, 1))).tolist()
    return f"#{red:02x}{green:02x}{blue:02x}"


def _wish(found: LightRendering) -> dict[str, Any]:
    keys = ("wanted_rf", "watts", "plain_rf", "plain_watts", "held_mix_change")
    return {key: getattr(found, key) for key in keys}


def _cells(found: LightRendering) -> list[str]:
    efficacy = "" if found.lm_per_w is None else f"{found.lm_per_w:.0f}"
    if (color := found.color) is None:
        return ["coloured", *[""] * 6, efficacy]
    return [
        f"{color.kelvin:.0f} K",
        f"{round(color.duv, 4) + 0.0:+.4f}",
        *(f"{x:.0f}" for x in (color.ra, color.r9, color.rf)),
        "" if found.best_rf is None else f"{found.best_rf:.0f}",
        f"{color.rg:.0f}",
        efficacy,
    ]


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


@dataclass(frozen=True)
class Thumbnail:
    """A small picture of a light alone. uri: data: URI. stops: of exposure."""

    uri: str
    width: int
    height: int
    stops: float

    def labelled(self, name: str) -> RowPicture:
        """Return it as the picture of the light of this name."""
        label = f"What {name} lights alone, shown at {self.stops:+.1f} stops"
        return RowPicture(self.uri, self.width, self.height, label)


def lights_table(
    basis: Basis,
    solution: Solution,
    uncertainty: Uncertainty | None = None,
    *,
    is_clean: bool = False,
) -> Markup:
    """Return a row per light, in document order; of many those with the largest shares, and the
    rest folded.

    Shares are of the picture's energy, now or as solved, whichever is more. is_clean: whether to
    denoise the pictures, of many lights those that are not folded.
    """
    rows = _rows(basis, solution, uncertainty, is_clean=is_clean)
    lead, shown = "", rows
    folded: list[tuple[str, list[LightEntry]]] = []
    if images := [image for image in light_images(basis.lights) if image.is_whole]:
        shown, folded = _fold_images(images, rows, basis, solution)
    elif len(rows) > ROWS_SHOWN + SPARE_ROWS:
        shares = largest_shares(basis, solution.lighting)
        visible_indices = most_visible_lights(basis, solution.lighting)
        other_indices = np.setdiff1d(np.arange(len(rows)), visible_indices)
        lead = (
            f"The {len(visible_indices)} lights with the largest shares of the picture, "
            "now or as solved."
        )
        note = (
            f"{len(other_indices)} more lights, each at most "
            f"{phrases.spoken_percent(float(shares[other_indices].max()))} of the picture, now or "
            "as solved"
        )
        shown = [rows[k] for k in visible_indices]
        folded = [(note, [rows[k] for k in other_indices])]
    has_scale = solution.lighting.cd_per_unit is not None
    lights = solution.lighting.lights
    lead = " ".join(
        filter(None, (lead, phrases.spoken_preference(lights), phrases.spoken_wheels(lights)))
    )
    return html("lights", lead=lead, shown=shown, folded=folded, has_scale=has_scale)


def _fold_images(
    images: Sequence[LightImage], rows: Sequence[LightEntry], basis: Basis, solution: Solution
) -> tuple[list[LightEntry], list[tuple[str, list[LightEntry]]]]:
    """Return a row for each image and each other light; and the folded rows of texels, with what
    they are.
    """
    shares = energy_shares(basis, solution.lighting)
    in_images = {int(k) for image in images for k in image.lights}
    shown = [image_row(image, basis, solution, shares) for image in images]
    shown += [row for k, row in enumerate(rows) if k not in in_images]
    folded = [
        (
            f"the {len(image.lights)} texels of {image.name}, row by row from the top",
            [rows[k] for k in image.lights],
        )
        for image in images
    ]
    return shown, folded


def _rows(
    basis: Basis, solution: Solution, uncertainty: Uncertainty | None, *, is_clean: bool
) -> list[LightEntry]:
    shares, lighting = energy_shares(basis, solution.lighting), solution.lighting
    errors = diagnosis_sentences.spoken_errors(uncertainty, len(shares))
    settings = {light.name: light for light in lighting.lights}
    rows: list[LightEntry] = []
    thumbnails = _thumbnails_of_rows(basis, lighting, is_clean=is_clean)
    for k, light in enumerate(basis.lights):
        setting = settings[light.name]
        error = (
            diagnosis_sentences.UNTOLD_HERE
            if errors[k] == diagnosis_sentences.UNDETERMINED
            else errors[k]
        )
        changed = change(light, setting)
        notes = filter(None, (*changed.notes, error, _constraint_note(setting)))
        row = LightEntry(
            [thumbnails[k].labelled(light.name)] if k in thumbnails else [],
            light.name,
            " · ".join(filter(None, (light.plugin, light.form))),
            LevelChange(changed.text, tuple(notes)),
            float(shares[k]),
        )
        rows.append(row if light.is_fixed else _with_emission(row, light, setting, lighting))
    return rows


def _thumbnails_of_rows(
    basis: Basis, lighting: Lighting, *, is_clean: bool
) -> Mapping[int, Thumbnail]:
    """Return the pictures of the rows, by the number of the light: of many lights only of rows that
    are not folded.
    """
    if len(basis.lights) <= ROWS_SHOWN + SPARE_ROWS:
        return thumbnails_of(basis, is_clean=is_clean)
    texels = [k for image in light_images(basis.lights) if image.is_whole for k in image.lights]
    others = np.setdiff1d(np.arange(len(basis.lights)), texels)
    shown = most_visible_lights(basis, lighting, among=others)
    return _thumbnails(basis, shown, is_clean=is_clean)


def thumbnails_of(basis: Basis, *, is_clean: bool) -> Mapping[int, Thumbnail]:
    """Return the picture of each light alone, by its number, made once for a basis.

    is_clean: whether denoised; then of the planes that the page shows, if these are there.
    """
    all_lights = range(len(basis.lights))
    return make_once(
        basis.planes,
        ("thumbnails", is_clean),
        lambda: _thumbnails(basis, all_lights, is_clean=is_clean),
    )


def _thumbnails(basis: Basis, lights: Iterable[int], *, is_clean: bool) -> Mapping[int, Thumbnail]:
    """Return the pictures of some lights, by their numbers."""
    clean, seen = cached_clean_planes(basis) if is_clean else None, basis.emitters_seen
    if clean is not None and not clean.is_whole:
        factor = page_reduction(basis, len(basis.lights))
        seen = block_mean(seen[..., None].astype(np.float32), factor)[..., 0] > 0

    def shown(k: int) -> Thumbnail:
        plane = basis.planes.plane(k) if clean is None else clean.plane(k)
        picture, stops = thumbnail(plane, seen, is_clean=is_clean and clean is None)
        height, width = picture.shape[:2]
        return Thumbnail(data_uri(to_8_bit(picture), largest_png=0), width, height, stops)

    numbers = [int(k) for k in lights]
    made = in_turns(shown, numbers, basis.size, unit="lights")
    return dict(zip(numbers, made, strict=True))


def _with_emission(
    row: LightEntry, light: BasisLight, setting: LightSetting, lighting: Lighting
) -> LightEntry:
    """Return a row with colour, emission before and after, their unit, and photometry."""
    light_photometry = lighting.photometry(setting)
    return replace(
        row,
        color=_color(setting, light_photometry),
        now=_rgb(light.emission),
        new=_rgb(setting.emission, setting.reached),
        parameter=light.parameter,
        unit=light.unit,
        amounts=_amounts(light_photometry),
        is_relative=lighting.cd_per_unit is None,
    )


def change(light: BasisLight, setting: LightSetting) -> LevelChange:
    """Return the change of a light in words or as a ratio of luminance, for channels that reach
    anything.
    """
    if light.is_fixed:
        return LevelChange("fixed")
    if not any(setting.reached):
        return LevelChange("unchanged: reaches nothing painted")
    is_reached = np.array(setting.reached)
    now, new = (np.where(is_reached, rgb, 0) for rgb in (light.emission, setting.emission))
    changed = luminance_change(now, new)
    if not setting.is_partly_reached:
        return changed
    note = f"{diagnosis_sentences.unreached_channels(setting)} unchanged: reaches nothing painted"
    return LevelChange(changed.text, (*changed.notes, note))


def _constraint_note(setting: LightSetting) -> str:
    """Return the constraint on a light, and whether it holds the light."""
    note = " (limits it)" if setting.is_active else ""
    if setting.lamp is not None:
        return f"{phrases.spoken_lamp(setting)}{note}"
    return f"{setting.constraint}{note}" if setting.constraint else ""


def hex_color(emission: RGB) -> str | None:
    """Return the colour of a light as #rrggbb, its brightest channel at full; None if it is off."""
    return rgb_to_hex(np.array(emission)) if any(emission) else None


def _color(setting: LightSetting, light_photometry: Photometry) -> RowColor:
    """Return the colour of a light; for a multiplier, the colour of its factor."""
    if setting.is_partly_reached:
        return RowColor(None, ("not known",))
    emission = setting.emission
    color = light_photometry.hex or hex_color(emission)
    if color is None or not any(emission):
        return RowColor(None, ("off",))
    notes = []
    if light_photometry.kelvin is not None:
        notes.append(f"{light_photometry.kelvin:.0f} K")
        if light_photometry.duv is not None:
            notes.append(f"Duv {light_photometry.duv:+.3f}".replace("-", "−"))
    return RowColor(color, tuple(notes))


def _amounts(light_photometry: Photometry) -> list[str]:
    """Return luminous quantity and flux; without a scale, the relative flux."""
    if light_photometry.luminous is not None or light_photometry.flux_lm is not None:
        return list(filter(None, light_photometry.amounts))
    return [] if light_photometry.flux_y is None else [f"{light_photometry.flux_y:.3g}"]


def _rgb(emission: RGB | Doubles, reached: Sequence[bool] = ALL_REACHED) -> list[str]:
    """Return a line for each channel, in brackets if it is undetermined."""
    if not any(emission):
        return ["off"]
    channels = zip(emission, reached, strict=True)
    return [f"{v:.4g}" if is_reached else f"({v:.4g})" for v, is_reached in channels]


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


def luminance_change(now: Doubles, new: Doubles) -> LevelChange:
    """Return the change of luminance from `now` to `new`, (3,) each, as a ratio and in stops."""
    before, after = (float(luminance(color)) for color in (now, new))
    if after == 0:
        return LevelChange("off" if before > 0 else "stays off")
    if before == 0:
        return LevelChange("was off, now on")
    stops = f"{np.log2(after / before):+.2f} stops".replace("-", "−")
    return LevelChange(f"×{after / before:.3g}", (stops,))
