"""The mixers of a gallery: one for each basis, which begins from any of its looks."""

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from lightpaint.batch.gallery.small_planes import SUFFIX, read_planes
from lightpaint.batch.gallery.summary import Row
from lightpaint.batch.manifest.folder_names import THUMBNAILS
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import LightpaintError
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.report.page.mixer import kelvins, told_file, told_transform

#: Mixers of a page, at most: each may be two megabytes. Lights of one that have sliders.
MOST_MIXERS, MOST_LIGHTS = 8, 40


def mixers_html(folder: Path, rows: Sequence[Row], bases: Mapping[str, str]) -> dict[str, str]:
    """The first of them as sections of HTML, by their names.

    folder: of the batch. rows: that can be mixed. bases: name of the planes of each, by its folder.
    """
    found: dict[str, list[Row]] = {}
    for row in rows:
        if row.lights and row.folder in bases:
            found.setdefault(bases[row.folder], []).append(row)
    made: dict[str, str] = {}
    for name, its in found.items():
        told = read_planes(folder / THUMBNAILS / f"{name}{SUFFIX}")
        if len(made) < MOST_MIXERS and told:
            # A file that is damaged costs the mixer, and not the gallery.
            with suppress(LightpaintError, AttributeError, LookupError, TypeError, ValueError):
                made[name] = _mixer(folder, name, told, its)
    return made


def _mixer(folder: Path, name: str, told: Mapping[str, Any], rows: Sequence[Row]) -> str:
    """One of them. told: as `keep_planes` wrote it."""
    lights = [
        {**light, "answer": light["present"], "kelvin": {"present": None, "answer": None}}
        for light in told["lights"]
    ]
    # Results of several views have one lighting, in the folder of the look.
    lighting = read_lighting(folder / rows[0].look / "lighting.json")
    data = {
        "size": told["size"],
        "planes": told["planes"],
        "lights": lights,
        "shown": _that_do_most(told, rows),
        "rest": None,
        "kelvins": kelvins(),
        "transform": told_transform(ViewTransform()),
        "painting": None,
        "lighting": told_file(lighting),
        "command": None,
    }
    text = f'<script type="application/json">{in_script(data)}</script>'
    return f'<section class="mixer" data-ready data-basis="{name}" hidden>{text}</section>'


def _that_do_most(told: Mapping[str, Any], rows: Sequence[Row]) -> list[int]:
    """The lights that are worth sliders, by their place in the basis; of few all of them."""
    names = [light["name"] for light in told["lights"]]
    if len(names) <= MOST_LIGHTS:
        return list(range(len(names)))
    does = dict.fromkeys(names, 0.0)
    for row in rows:
        for light in row.lights:
            does[light.name] = max(does.get(light.name, 0.0), light.y)
    share = {name: does[name] * total for name, total in zip(names, told["totals"], strict=True)}
    first = sorted(share, key=lambda name: -share[name])[:MOST_LIGHTS]
    return sorted(map(names.index, first))


def transforms_of(rows: Sequence[Row]) -> dict[str, Any]:
    """By name, what looks are seen through; their stops are of each look."""
    made = {"srgb": told_transform(ViewTransform())}
    for name in dict.fromkeys(row.view[0] for row in rows if row.view):
        with suppress(LightpaintError):
            made.setdefault(name, told_transform(ViewTransform(name)))
    return made


def in_script(told: Any) -> str:
    """JSON for a script of a page, where nothing is escaped and only `<` can end it."""
    text = json.dumps(told, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")
