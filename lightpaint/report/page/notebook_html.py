"""Small tables and pictures of scenes, bases, targets and answers for notebooks.

`screen.Shown` calls `html_of` and `png_of`. All has inline styles and takes the notebook's own
colours.
"""

from collections.abc import Callable, Sequence
from functools import singledispatch
from typing import Any

import numpy as np
from markupsafe import Markup
from PIL import Image, ImageDraw, ImageFont

from lightpaint.arrays import RGB, Doubles, Floats
from lightpaint.basis import Basis
from lightpaint.colour import (
    LUMINANCE,
    Photometry,
    ViewTransform,
    choose_exposure,
    luminance,
    photometry,
    to_8_bit,
)
from lightpaint.images import Estimate, covered, denoised, enlarged, resampled
from lightpaint.images.formats import png_bytes
from lightpaint.lighting import Appearance, Lighting, Solution
from lightpaint.relit.verification import Verification
from lightpaint.report.answer_pictures import paint_coverage, report_transform, unpainted_look
from lightpaint.report.comparison import SURROUND, TEXT, shorten_to_width
from lightpaint.report.diagnosis_sentences import UNTOLD_HERE
from lightpaint.report.page.figures import THUMBNAIL_WIDTH, data_uri, thumbnail
from lightpaint.report.page.html import html
from lightpaint.report.page.lights_table import change, hex_color
from lightpaint.report.verdict_sentences import agreement, verdict
from lightpaint.scene import Scene
from lightpaint.target import Target

#: Maximum number of lights in a table; the most pictures of a contact sheet, and in a row.
MAX_LIGHTS, MAX_PICTURES, MAX_COLUMNS = 10, 12, 4
#: Pixels of a picture in a page, and width of one that stands alone.
PIXELS, WIDTH = 2**16, 480

CELL = "text-align: left; padding: 0 1em 0 0"


@singledispatch
def html_of(shown: object) -> str | None:
    """Return a small page of an object; None if it is shown as a picture alone."""
    return None


@singledispatch
def png_of(shown: object) -> bytes | None:
    """Return a small PNG of an object; None if it is shown as a page."""
    return None


@html_of.register
def scene_html(scene: Scene) -> Markup:
    """Return the lights of a scene: kind, brightness and form."""
    (height, width), lights = scene.size, scene.lights

    def row(k: int) -> Sequence[str]:
        x = lights[k]
        colour = _swatch(x.emission, photometry(x.emission, unit=x.unit, unit_flux=x.unit_flux))
        return x.name, x.plugin, colour, _rgb(x.emission), x.unit, x.form

    sensor = scene.sensor_names[scene.sensor]
    lead = f"{scene.path.name}: {len(lights)} lights, {width} × {height} through {sensor}"
    headings = ("light", "kind", "colour", "emission", "unit", "form")
    return _page(lead, _table(headings, row, _sizes(lights)))


@html_of.register
def lighting_html(lighting: Lighting) -> Markup:
    """Return the lights of a lighting and, of a solve, its certificate."""

    def row(k: int) -> Sequence[str]:
        light = lighting.lights[k]
        light_photometry = lighting.photometry(light)
        constraint = "fixed" if light.is_fixed else light.constraint
        constraint = ", ".join(filter(None, (constraint, UNTOLD_HERE if light.untold else "")))
        colour, output = (
            _swatch(light.emission, light_photometry),
            " ".join(light_photometry.amounts),
        )
        if light.is_partly_reached:
            colour = Markup("")
        return light.name, colour, _rgb(light.emission), light.unit, output, constraint

    certificate = "" if lighting.certificate is None else str(lighting.certificate)
    headings = ("light", "colour", "emission", "unit", "output", "asked")
    return _page(certificate, _table(headings, row, _sizes(lighting.lights)))


@html_of.register
def solution_html(solution: Solution) -> Markup:
    """Return the change of each light, for those that change the picture most, and the
    certificate.
    """
    basis, lighting = solution.basis, solution.lighting

    def row(k: int) -> Sequence[str]:
        light, setting = basis.lights[k], lighting.lights[k]
        changed = change(light, setting)
        # Parts that the report page stacks are side by side here.
        change_text = " ".join((changed.text, *changed.notes))
        change_text += f", {UNTOLD_HERE}" if setting.untold else ""
        colour = _swatch(setting.emission, lighting.photometry(setting))
        colour = Markup("") if setting.is_partly_reached else colour
        now, new = _rgb(light.emission), _rgb(setting.emission)
        return light.name, colour, now, new, change_text, setting.constraint

    change_size = np.abs(solution.weights - basis.current_weights) * basis.totals @ LUMINANCE
    headings = ("light", "colour", "now", "new", "change", "asked")
    return _page(str(solution.certificate), _table(headings, row, change_size))


@html_of.register
def verification_html(verification: Verification) -> Markup:
    """Return the render, and whether it agrees with the prediction."""
    sentence, image = agreement(verification), verification.verified.image
    text = (
        f"{sentence[0].upper() + sentence[1:]}; ΔE2000 {verification.delta_e_mean:.2f} on average, "
        f"below {verification.delta_e_95:.2f} in 95 % of the pixels."
    )
    return _page(_picture("verified", [image], _transform(image)), text)


def look_html(
    target: Target,
    solution: Solution,
    predicted: Estimate,
    verification: Verification | None,
    *,
    appearance: Appearance | None = None,
) -> Markup:
    """Return painting, prediction and render side by side, the verdict, and the lights."""
    images = [_on_grey(target.image, target.importance), predicted.image]
    names = ["target", "predicted"]
    if verification is not None:
        images.append(covered(verification.verified.image, predicted.size))
        names.append("verified")
    transform = report_transform(target, solution.basis, predicted.image)
    sentence = verdict(solution, predicted, verification, appearance=appearance)
    label = ", ".join(names)
    picture = _picture(label, images, transform, paintings=1)
    return _page(picture, label, sentence, solution_html(solution))


@png_of.register
def basis_png(basis: Basis) -> bytes:
    """Return a contact sheet of each light alone, at exposures of their own."""
    power = (basis.current_weights * basis.totals) @ LUMINANCE
    chosen = _largest_indices(power, MAX_PICTURES)
    pictures = [
        _wide(thumbnail(basis.planes.plane(k), basis.emitters_seen, is_clean=True)[0])
        for k in chosen
    ]
    height, width = pictures[0].shape[:2]
    text = 12
    rows, columns = -(-len(chosen) // MAX_COLUMNS), min(MAX_COLUMNS, len(chosen))
    rest = len(basis.lights) - len(chosen)
    size = (columns * (width + 4) + 4, rows * (height + 2 * text) + 4 + (2 * text if rest else 0))
    sheet = Image.new("RGB", size, SURROUND)
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(text)
    for k, (light, picture) in enumerate(zip(chosen, pictures, strict=True)):
        x, y = 4 + k % MAX_COLUMNS * (width + 4), 4 + k // MAX_COLUMNS * (height + 2 * text)
        sheet.paste(Image.fromarray(to_8_bit(picture)), (x, y))
        draw.text(
            (x, y + height + 2), shorten_to_width(basis.names[light], font, width), TEXT, font
        )
    if rest:
        draw.text((4, size[1] - 2 * text), f"and {rest} more", TEXT, font)
    return png_bytes(np.asarray(sheet))


@png_of.register
def target_png(target: Target) -> bytes:
    """Return the painting; grey and dim where nothing was painted."""
    transform = target.transform or _transform(target.image)
    share = _sized(paint_coverage(target.importance)[..., None], WIDTH)
    image = _sized(target.image, WIDTH)
    paint, rest = transform.encode(image), unpainted_look(image, transform=transform)
    return png_bytes(to_8_bit(_wide(share * paint + (1 - share) * rest)))


def _page(*parts: str) -> Markup:
    """Return parts below each other: texts as paragraphs, and Markup as it is."""
    paragraph = Markup("<p>{}</p>")
    return Markup().join(
        part if isinstance(part, Markup) else paragraph.format(part) for part in parts if part
    )


def _table(headings: Sequence[str], row: Callable[[int], Sequence[str]], sizes: Any) -> Markup:
    """Return the rows of the largest, and the number of others."""
    chosen = _largest_indices(np.asarray(sizes, np.float64), MAX_LIGHTS)
    rows = [[x if isinstance(x, Markup) else _shorten(x) for x in row(k)] for k in chosen]
    rest = len(sizes) - len(chosen)
    return html("notebook_table", cell=CELL, headings=headings, rows=rows, rest=rest)


def _largest_indices(sizes: Any, count: int) -> list[int]:
    """Return indices of the largest, in their order."""
    return sorted(np.argsort(-sizes, kind="stable")[:count].tolist())


def _sizes(lights: Sequence[Any]) -> Doubles:
    """Return the brightness of lights: their flux or, if it is unknown for some, their emission."""
    emission = np.array([light.emission for light in lights])
    if all(light.unit_flux is not None for light in lights):
        emission = emission * [light.unit_flux for light in lights]
    return np.asarray(emission @ LUMINANCE)


def _shorten(text: str, room: int = 120) -> str:
    return text if len(text) <= room else text[: room - 1] + "…"


def _rgb(emission: RGB) -> str:
    return " ".join(f"{v:.4g}" for v in emission) if any(emission) else "off"


def _swatch(emission: RGB, light_photometry: Photometry) -> Markup:
    """Return the colour of a light; for a multiplier, the colour of its factor."""
    color = (light_photometry.hex or hex_color(emission)) if any(emission) else None
    if color is None:
        return Markup("")
    box = f"display: inline-block; width: 1em; height: 1em; background: {color}"
    kelvin = "" if light_photometry.kelvin is None else f" {light_photometry.kelvin:.0f} K"
    return Markup('<span style="{}" title="{}"></span>{}').format(box, color, kelvin)


def _transform(image: Floats) -> ViewTransform:
    return ViewTransform("srgb", choose_exposure(image))


def _on_grey(image: Floats, importance: Floats) -> Floats:
    """Return an image (h, w, 3), linear, with unpainted parts in a dim grey of their own
    luminance.
    """
    share = paint_coverage(importance)[..., None]
    return np.asarray(share * image + (1 - share) * 0.2 * luminance(image)[..., None])


def _picture(
    alt: str, images: Sequence[Floats], transform: ViewTransform, *, paintings: int = 0
) -> Markup:
    """Return linear pictures side by side, at one size, as an element of HTML.

    paintings: how many of them, the first, were not rendered.
    """
    height, width = images[0].shape[:2]
    wide = int(min(WIDTH, np.sqrt(PIXELS * width / (height * len(images)))))
    # Pictures for people: without their grain, once they are small.
    small = [_sized(image, wide) for image in images]
    small[paintings:] = map(denoised, small[paintings:])
    shown = [_wide(transform.encode(image), wide) for image in small]
    height = min(x.shape[0] for x in shown)
    strip = to_8_bit(np.concatenate([x[:height] for x in shown], axis=1))
    return Markup('<img alt="{}" src="{}">').format(alt, data_uri(strip, largest_png=2**13))


def _sized(image: Floats, width: int) -> Floats:
    """Return an image (h, w, n) no wider than that, averaged in linear light."""
    height, wide = image.shape[:2]
    if wide <= width:
        return image
    return resampled(image, (max(1, round(height * width / wide)), width))


def _wide(picture: Floats, width: int = THUMBNAIL_WIDTH) -> Floats:
    """Return a small picture with larger pixels, about as wide as a thumbnail."""
    return np.asarray(enlarged(picture, max(1, width // picture.shape[1])))
