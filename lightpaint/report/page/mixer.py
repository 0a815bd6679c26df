"""The light mixer of a page, which sets lights by hand, without a server.

The page contains a small, compact plane for each light that matters, and two for those that share
a row: the texels of an image, and all lights with small shares. The painter's own browser modules
mix them, so that a page sent by mail is a mixer in any browser, offline.
"""

import base64
import re
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, TypedDict, Unpack

import numpy as np
from markupsafe import Markup

from lightpaint import colour
from lightpaint.arrays import Doubles, Floats, Indices
from lightpaint.basis import (
    Basis,
    BasisLight,
    LightImage,
    denoise_mixes,
    denoise_plane,
    light_images,
    make_once,
)
from lightpaint.images import (
    PackedPicture,
    Size,
    block_mean,
    in_turns,
    pack_picture,
    resampled,
    whole_factor,
)
from lightpaint.lighting import ALL_REACHED, Lighting, lighting_fields
from lightpaint.progress import with_progress
from lightpaint.report.answer_pictures import MixesOfBlocks
from lightpaint.report.basis_memo import MAX_PIXELS, cached_clean_planes, page_reduction
from lightpaint.report.page.figures import CLEAN_REDUCTION, data_uri
from lightpaint.report.page.html import html, script_json
from lightpaint.report.page.lights_table import most_visible_lights
from lightpaint.threads import parallel_map
from lightpaint.viewer import bundled, compact_script, source, styles

#: Colour temperatures of the sliders, in kelvin, evenly in mireds.
COOLEST, WARMEST, STEPS = 15000.0, 1500.0, 31

#: Points of the table of a transform: as a curve, as each side of a lattice; its ends in stops.
CURVE, SIDE, LOW, HIGH = 256, 32, -14.0, 7.0


class PlaneOptions(TypedDict):
    """Options of the planes in a page: whether to denoise them, and their pixels at most."""

    is_clean: bool
    max_pixels: int


@dataclass(frozen=True)
class JointLights:
    """Several lights in one row of a mixer, which sets them together.
    label: of the row. lights: their indices. image: if they are the texels of one.
    """

    label: str
    lights: Indices
    image: LightImage | None = None

    def level(self, weights: Doubles, current: Doubles) -> float:
        """Return the brightness of an image relative to that in the scene; 1 without one.

        weights, current: (n, 3), in a look and in the scene.
        """
        if self.image is None:
            return 1.0
        now, new = (float(colour.luminance(self.image.mean(x))) for x in (current, weights))
        return new / now if now > 0 and new > 0 else 1.0

    def mixes(self, lighting: Lighting, basis: Basis) -> list[Doubles]:
        """Return the weights (n, 3) of its planes: in the answer at the level 1, and in the
        scene.
        """
        answer, current = lighting.weights_for(basis), basis.current_weights
        is_its = np.isin(np.arange(len(current)), self.lights)[:, None]
        level = self.level(answer, current)
        return [np.where(is_its, x, 0) for x in (answer / level, current)]

    def data(self, basis: Basis, lighting: Lighting) -> dict[str, Any]:
        """Return its record for the page. `columns` and `places` are the columns of its map, if
        any."""
        answer, current = lighting.weights_for(basis), basis.current_weights
        image = self.image if self.image is not None and self.image.is_whole else None

        def by_name(weights: Doubles) -> dict[str, list[float]]:
            lights = [k for k in self.lights if not basis.is_fixed[k]]
            return {basis.names[k]: weights[k].tolist() for k in lights}

        return {
            "label": self.label,
            "columns": 0 if image is None else image.size[0],
            "places": [] if image is None else image.map_order,
            "levels": {"answer": self.level(answer, current), "present": 1.0},
            "answer": by_name(answer / self.level(answer, current)),
            "present": by_name(current),
        }


def mixer_html(
    basis: Basis,
    lighting: Lighting,
    painting: Floats | None = None,
    *,
    transform: colour.ViewTransform | None = None,
    is_clean: bool = False,
    scene: str | None = None,
    max_pixels: int = MAX_PIXELS,
    denoised_mixes: Sequence[Floats] = (),
) -> Markup:
    """Return a section of HTML; a page with mixers needs `mixer_assets` after the last.

    Args:
        basis: The basis of the lights.
        lighting: The answer, from which it starts.
        painting: (h, w, 3) display values, for the wipe over the mix.
        transform: The view transform of the mix.
        is_clean: Whether to denoise planes.
        scene: For the command line; None without a scene to relight.
        max_pixels: Maximum number of pixels in all planes.
        denoised_mixes: Pictures of `mixes_of_mixer`, if they are denoised already.
    """
    shown, joint = rows_of_mixer(basis, lighting)
    options: PlaneOptions = {"is_clean": is_clean, "max_pixels": max_pixels}
    size, planes = _shown_planes(basis, lighting, shown, joint, denoised_mixes, **options)
    transform = transform or colour.ViewTransform()
    data = {
        "size": size,
        "planes": planes,
        "lights": [_light(basis, lighting, k) for k in shown],
        "joint": [lights.data(basis, lighting) for lights in joint],
        "kelvins": kelvin_colors(),
        "gels": packed_gels(),
        "transform": transform_data(transform),
        "painting": None if painting is None else _painting(painting, (size[0], size[1])),
        "lighting": lighting_data(lighting),
        "command": None if scene is None else f"lightpaint relight {scene} lighting.json",
    }
    return html("mixer", data=script_json(data))


def mixer_assets() -> Markup:
    """Return style and script of all mixers of a page."""
    style = styles("viewer/mixer/mixer.css")
    script = compact_script(bundled("viewer/mixer/mixer.js"))
    return Markup(f'<style>\n{style}</style><script type="module">\n{script}</script>')


def _shown_planes(
    basis: Basis,
    lighting: Lighting,
    shown: Indices,
    joint: Sequence[JointLights],
    denoised_mixes: Sequence[Floats],
    **options: Unpack[PlaneOptions],
) -> tuple[list[int], list[dict[str, Any]]]:
    """Return size and planes of each light; then of joint ones, in the answer and in the scene."""
    if not joint:
        return planes_for_page(basis, **options)
    mixes = _joint_mixes(basis, lighting, joint)
    return _compact_planes(basis, shown, mixes, denoised_mixes, **options)


def _joint_mixes(
    basis: Basis, lighting: Lighting, joint: Sequence[JointLights]
) -> Sequence[Doubles]:
    return [mix for lights in joint for mix in lights.mixes(lighting, basis)]


def mixes_of_mixer(basis: Basis, lighting: Lighting) -> MixesOfBlocks:
    """Return the mixes of lights that share a row, in the answer and in the scene, as far as
    `mixer_html` denoises them.
    """
    shown, joint = rows_of_mixer(basis, lighting)
    mixes = _joint_mixes(basis, lighting, joint)
    factor = page_reduction(basis, len(shown) + len(mixes))
    return MixesOfBlocks(mixes if factor < CLEAN_REDUCTION else (), factor)


def planes_for_page(
    basis: Basis, *, is_clean: bool, max_pixels: int = MAX_PIXELS
) -> tuple[list[int], list[dict[str, Any]]]:
    """Return height and width of the planes in a page, and the plane of each light.

    is_clean: whether they are denoised.
    """
    all_lights = np.arange(len(basis.lights))
    return make_once(
        basis.planes,
        ("mixer", is_clean, max_pixels),
        lambda: _compact_planes(
            basis, all_lights, [], [], is_clean=is_clean, max_pixels=max_pixels
        ),
    )


def _compact_planes(
    basis: Basis,
    lights: Indices,
    mixes: Sequence[Doubles],
    denoised_mixes: Sequence[Floats],
    *,
    is_clean: bool,
    max_pixels: int,
) -> tuple[list[int], list[dict[str, Any]]]:
    """Return planes of some lights and mixes of others, (n, 3) each, compact for the page.

    denoised_mixes: the pictures of the mixes if they have to be denoised, and already are.
    """
    planes = cached_clean_planes(basis) if is_clean else None
    count = len(lights) + len(mixes)
    factor = page_reduction(basis, count, max_pixels=max_pixels)
    # The mean of many pixels has hardly any noise left to remove.
    must_denoise = is_clean and planes is None and factor < CLEAN_REDUCTION

    def small(picture: Floats) -> Floats:
        is_small = planes is not None and not planes.is_whole
        return np.asarray(picture if is_small else block_mean(picture, factor), np.float32)

    def plane(k: int) -> Floats:
        return small((planes or basis.planes).plane(int(lights[k])))

    if must_denoise:  # by a denoiser that uses all processors itself
        pictures = [
            denoise_plane(basis, k, factor=factor, quality="coarse")
            for k in with_progress(lights.tolist(), "planes")
        ]
        if denoised_mixes:
            pictures += denoised_mixes
        elif mixes:
            pictures += denoise_mixes(basis, mixes, factor=factor, quality="coarse")
    else:
        pictures = in_turns(plane, range(len(lights)), basis.size, unit="planes")
        if planes is not None:
            pictures += [small(planes.mix(mix)) for mix in mixes]
        elif mixes:
            pictures += [small(mix) for mix in basis.mixes(np.array(mixes))]
    return list(pictures[0].shape[:2]), parallel_map(plane_data, pictures)


def _light(basis: Basis, lighting: Lighting, k: int) -> dict[str, Any]:
    light = basis.lights[k]
    looks = {"present": light.emission, "answer": lighting[light.name].emission}
    return {
        **light_data(light),
        **{look: [float(x) for x in emission] for look, emission in looks.items()},
        "kelvin": {look: _kelvin(emission, light.unit) for look, emission in looks.items()},
    }


def light_data(light: BasisLight) -> dict[str, Any]:
    """Return the data of a light for the page, without its setting."""
    return {
        "name": light.name,
        "unit": light.unit,
        "isFixed": light.is_fixed,
        "isScalar": light.is_scalar,
    }


def _kelvin(emission: Any, unit: str) -> float | None:
    return colour.photometry(emission, unit=unit).kelvin


def kelvin_colors() -> dict[str, Any]:
    """Return colours of luminance 1 by temperature, evenly in mireds, for the sliders."""
    mireds = np.linspace(1e6 / COOLEST, 1e6 / WARMEST, STEPS)
    colors = [[round(float(x), 5) for x in colour.kelvin_to_rgb(float(1e6 / m))] for m in mireds]
    return {"coolest": COOLEST, "warmest": WARMEST, "colors": colors}


@cache
def packed_gels() -> str:
    """Return the table of colour filters that the painter has, deflated, for the page."""
    [rows] = re.findall(r"`\n([^`]*)`", source("viewer/gels/gel_table.js"))
    return "data:;base64," + base64.b64encode(zlib.compress(rows.encode(), 9)).decode("ascii")


def transform_data(transform: colour.ViewTransform) -> dict[str, Any]:
    """Return a transform for the page: sRGB by name, a curve, or a lattice if channels mix."""
    data: dict[str, Any] = {"stops": transform.stops, "low": LOW, "high": HIGH}
    transform_without_exposure = colour.ViewTransform(transform.name)
    curve, lattice = None, None
    if transform.name != "srgb" and transform.is_per_channel:
        curve = [
            round(float(x), 5)
            for x in colour.curve_of(transform_without_exposure, CURVE, LOW, HIGH)
        ]
    elif transform.name != "srgb":
        table = colour.lattice_of(transform_without_exposure, SIDE, LOW, HIGH).reshape(
            SIDE * SIDE, SIDE, 3
        )
        lattice = _plane_data(pack_picture(table, dropped=1))
    return {**data, "curve": curve, "lattice": lattice}


def _painting(painting: Floats, size: Size) -> str:
    """Return a picture of the film, possibly reduced, at the size of the planes."""
    factor = whole_factor(painting.shape[:2], size)
    if factor is None:
        small = resampled(painting, size)
    else:
        small = block_mean(np.asarray(painting, np.float32), factor)
    return data_uri(colour.to_8_bit(np.clip(small, 0, 1)))


def plane_data(picture: Floats) -> dict[str, Any]:
    """Return a picture of light, (h, w, 3), for the page."""
    return _plane_data(pack_picture(picture))


def _plane_data(picture: PackedPicture) -> dict[str, Any]:
    data = "data:;base64," + base64.b64encode(picture.data).decode("ascii")
    return {
        "data": data,
        "scale": picture.scale,
        "dropped": picture.dropped,
        "size": list(picture.size),
    }


def lighting_data(lighting: Lighting) -> dict[str, Any]:
    """Return the data of the answer's file without statements that hold for the answer only."""
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


def rows_of_mixer(basis: Basis, lighting: Lighting) -> tuple[Indices, Sequence[JointLights]]:
    """Return the lights with a row of their own, and those that share one."""
    images = light_images(basis.lights)
    texels = [k for image in images for k in image.lights]
    singles = np.setdiff1d(np.arange(len(basis.lights)), texels)
    shown = most_visible_lights(basis, lighting, among=singles)
    joint = [JointLights(image.name, image.lights, image) for image in images]
    if (others := np.setdiff1d(singles, shown)).size:
        joint.append(JointLights(f"{len(others)} more lights together", others))
    return shown, joint
