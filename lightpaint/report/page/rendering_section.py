"""The section of the report on how lamps render colours, where their spectra are known."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from markupsafe import Markup

from lightpaint.arrays import RGB
from lightpaint.colour import encode_display, to_8_bit
from lightpaint.lighting import Lighting, LightRendering, SurfaceColor, renderings_of
from lightpaint.report.page.html import html
from lightpaint.report.phrases import rendering_sentences


def rendering_section(lighting: Lighting, surfaces: Sequence[SurfaceColor] = ()) -> Markup:
    """Return the section; "" without spectra. surfaces: colours of objects under the lighting."""
    found = renderings_of(lighting)
    if not found:
        return Markup("")
    lamps = [{"name": name, "cells": _cells(x)} for name, x in found.items()]
    return html(
        "rendering",
        lamps=lamps,
        sentences=rendering_sentences(found),
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
