"""The light mixer of a page: its lights by hand, with no server behind it.

The mix is what the painter's own browser modules make of planes that stand in the page, one for
each light that matters, small and compact; what is left is one more. A page that is sent by mail is
a mixer in any browser, offline.
"""

import base64
import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles, Floats, Indices
from lightpaint.basis.basis import Basis
from lightpaint.basis.lights import BasisLight
from lightpaint.colour.color import kelvin_to_rgb
from lightpaint.colour.display.srgb import to_8_bit
from lightpaint.colour.display.transform_table import curve_of, lattice_of
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.colour.photometry import photometry
from lightpaint.images.denoiser import denoised
from lightpaint.images.page_picture import Compact, compact
from lightpaint.images.pixel_blocks import block_mean
from lightpaint.lighting.answer.light_setting import ALL_REACHED
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.answer.lighting_file import lighting_fields
from lightpaint.report.basis_memo import once, planes_of
from lightpaint.report.measures import that_do_most
from lightpaint.report.page.figures import ENOUGH, data_uri
from lightpaint.threads import side_by_side
from lightpaint.viewer.bundle import bundled, styles

#: Pixels of a plane from left to right, and of all planes together, at most.
WIDEST, MOST_PIXELS = 480, 1_000_000

#: Colour temperatures of the sliders, in kelvin, evenly in mireds; and the distance from Planck's
#: locus up to which a colour is one.
COOLEST, WARMEST, STEPS, WHITE = 15000.0, 1500.0, 41, 0.02

#: Points of the table of a transform: as a curve, as each side of a lattice; its ends in stops.
CURVE, SIDE, LOW, HIGH = 256, 32, -14.0, 7.0

#: What stands above it.
ABOUT = (
    "Every light by hand, from the answer on. Stops count from the light as it is in the scene; S "
    "shows one alone, M the picture without it."
)


def mixer_html(
    basis: Basis,
    lighting: Lighting,
    painting: Floats | None = None,
    *,
    transform: ViewTransform | None = None,
    is_clean: bool = False,
    scene: str | None = None,
    title: str = "Light mixer",
) -> str:
    """A section of HTML; a page with any of them needs `mixer_assets` after the last.

    Args:
        basis: What the lights do.
        lighting: The answer, which it starts from.
        painting: (h, w, 3) display values, to be wiped over the mix.
        transform: What the mix is seen through.
        is_clean: Whether planes are denoised.
        scene: For the command line; None where there is no scene to relight.
        title: Heading.
    """
    shown = that_do_most(basis, lighting)
    size, planes = _told(basis, lighting, shown, is_clean=is_clean)
    transform = transform or ViewTransform()
    data = {
        "size": size,
        "planes": planes,
        "lights": [_light(basis, lighting, k) for k in shown],
        "rest": _rest(basis, lighting, shown),
        "kelvins": kelvins(),
        "transform": told_transform(transform),
        "painting": None if painting is None else _painting(painting, basis, len(planes)),
        "lighting": told_file(lighting),
        "command": None if scene is None else f"lightpaint relight {scene} lighting.json",
    }
    # In a script nothing is escaped, and only `<` can end it.
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    text = text.replace("<", "\\u003c")
    return (
        f'<section class="mixer" hidden><h2>{title}</h2><p>{ABOUT}</p>'
        f'<script type="application/json">{text}</script></section>'
    )


def mixer_assets() -> str:
    """Style and script of all mixers of a page."""
    style, script = styles("viewer/mixer/mixer.css"), bundled("viewer/mixer/mixer.js")
    return f'<style>\n{style}</style><script type="module">\n{script}</script>'


def _factor(basis: Basis, count: int) -> int:
    """Side of the blocks of pixels that one of a plane stands for."""
    height, width = basis.size
    factor = max(1, -(-width // WIDEST))
    while count * (height // factor) * (width // factor) > MOST_PIXELS and factor < min(
        height, width
    ):
        factor += 1
    return min(factor, height, width)


def _told(
    basis: Basis, lighting: Lighting, shown: Indices, *, is_clean: bool
) -> tuple[list[int], list[dict[str, Any]]]:
    """Size and planes of each light; then all others, as they are in the answer and at present."""
    rest = np.setdiff1d(np.arange(len(basis.lights)), shown)
    if not rest.size:
        return planes_for_page(basis, is_clean=is_clean)
    looks = [
        np.where(np.isin(np.arange(len(x)), rest)[:, None], x, 0)
        for x in (lighting.weights_for(basis), basis.present_weights)
    ]
    return _made(basis, shown, looks, is_clean=is_clean)


def planes_for_page(basis: Basis, *, is_clean: bool) -> tuple[list[int], list[dict[str, Any]]]:
    """Height and width of what stands in a page for the plane of each light, and these.

    is_clean: whether they are denoised.
    """
    every = np.arange(len(basis.lights))
    return once(basis, ("mixer", is_clean), lambda: _made(basis, every, [], is_clean=is_clean))


def _made(
    basis: Basis, lights: Indices, mixes: Sequence[Doubles], *, is_clean: bool
) -> tuple[list[int], list[dict[str, Any]]]:
    """Planes of some lights and mixes of others, (n, 3) each, small and written."""
    planes = planes_of(basis) if is_clean else None
    factor = _factor(basis, len(lights) + len(mixes))

    def small(k: int) -> Floats:
        if k >= len(lights):
            made = (planes or basis).mix(mixes[k - len(lights)])
        else:
            made = planes.plane(lights[k]) if planes else basis.planes.plane(lights[k])
        return np.asarray(block_mean(made, factor), np.float32)

    pictures = side_by_side(small, range(len(lights) + len(mixes)))
    if is_clean and planes is None and factor < ENOUGH:
        features = basis.features and basis.features.reduced(factor)
        pictures = [denoised(picture, features) for picture in pictures]
    return list(pictures[0].shape[:2]), side_by_side(told_plane, pictures)


def _light(basis: Basis, lighting: Lighting, k: int) -> dict[str, Any]:
    light = basis.lights[k]
    looks = {"present": light.emission, "answer": lighting[light.name].emission}
    return {
        **told_light(light),
        **{look: [float(x) for x in emission] for look, emission in looks.items()},
        "kelvin": {look: _kelvin(emission, light.unit) for look, emission in looks.items()},
    }


def told_light(light: BasisLight) -> dict[str, Any]:
    """A light for the page, whatever it is set to."""
    return {
        "name": light.name,
        "unit": light.unit,
        "isFixed": light.is_fixed,
        "isScalar": light.is_scalar,
    }


def _kelvin(emission: Any, unit: str) -> float | None:
    seen = photometry(emission, unit=unit)
    is_white = seen.kelvin is not None and seen.duv is not None and abs(seen.duv) <= WHITE
    return seen.kelvin if is_white else None


def _rest(basis: Basis, lighting: Lighting, shown: Indices) -> dict[str, Any] | None:
    rest = np.setdiff1d(np.arange(len(basis.lights)), shown)
    if not rest.size:
        return None

    def by_name(weights: Doubles) -> dict[str, list[float]]:
        return {basis.names[k]: weights[k].tolist() for k in rest if not basis.is_fixed[k]}

    return {
        "label": f"{len(rest)} more lights together",
        "answer": by_name(lighting.weights_for(basis)),
        "present": by_name(basis.present_weights),
    }


def kelvins() -> list[Any]:
    """Colours of luminance 1 by temperature, for the sliders."""
    mireds = np.linspace(1e6 / COOLEST, 1e6 / WARMEST, STEPS)
    return [
        [float(1e6 / mired), [round(float(x), 6) for x in kelvin_to_rgb(float(1e6 / mired))]]
        for mired in mireds
    ]


def told_transform(transform: ViewTransform) -> dict[str, Any]:
    """A transform for the page: sRGB it knows; else a curve, or where channels mix a lattice."""
    about: dict[str, Any] = {"stops": transform.stops, "low": LOW, "high": HIGH}
    plain = ViewTransform(transform.name)
    curve, lattice = None, None
    if transform.name != "srgb" and transform.is_per_channel:
        curve = [round(float(x), 5) for x in curve_of(plain, CURVE, LOW, HIGH)]
    elif transform.name != "srgb":
        table = lattice_of(plain, SIDE, LOW, HIGH).reshape(SIDE * SIDE, SIDE, 3)
        lattice = _written(compact(table, dropped=1))
    return {**about, "curve": curve, "lattice": lattice}


def _painting(painting: Floats, basis: Basis, count: int) -> str:
    small = block_mean(np.asarray(painting, np.float32), _factor(basis, count))
    return data_uri(to_8_bit(np.clip(small, 0, 1)))


def told_plane(picture: Floats) -> dict[str, Any]:
    """A picture of light, (h, w, 3), for the page."""
    return _written(compact(picture))


def _written(its: Compact) -> dict[str, Any]:
    data = "data:;base64," + base64.b64encode(its.data).decode("ascii")
    return {"data": data, "scale": its.scale, "dropped": its.dropped, "size": list(its.size)}


def told_file(lighting: Lighting) -> dict[str, Any]:
    """The answer's file without what is said of the answer alone."""
    lights = tuple(
        replace(
            light,
            constraint="",
            is_active=False,
            reached=ALL_REACHED,
            standard_error=None,
            interval=None,
        )
        for light in lighting.lights
    )
    target = f"{lighting.target}-mix" if lighting.target else "mix"
    data = lighting_fields(replace(lighting, lights=lights, certificate=None, target=target))
    for light in data["lights"].values():
        light.pop("photometry", None)
    return data
