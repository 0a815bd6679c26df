"""A room of its own, under six lightings that are known: references for `benchmarks/references.py`.

A courtyard with a wall, a column, steps, a crate, a ball and a hedge, of brick, plaster, wood and
leaves: other geometry and other surfaces than the scenes that are shipped. `references` returns its
picture under each lighting, and the same in grey, where nothing but the light is left.
"""

from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import lightpaint as lp
from lightpaint.basis.cache.cached_render import obtain_basis
from lightpaint.colour.color import kelvin_to_rgb
from lightpaint.images.denoiser import denoised

WIDTH, HEIGHT, SPP = 240, 160, 256

#: Lamps of the courtyard, each of one unit of light.
LAMPS = """
<emitter type="directional" id="low_sun">
    <vector name="direction" x="1" y="-0.42" z="-0.75"/><rgb name="irradiance" value="1, 1, 1"/>
</emitter>
<emitter type="directional" id="high_sun">
    <vector name="direction" x="0.45" y="-1" z="-0.5"/><rgb name="irradiance" value="1, 1, 1"/>
</emitter>
<emitter type="constant" id="sky"><rgb name="radiance" value="1, 1, 1"/></emitter>
<emitter type="point" id="flame">
    <point name="position" x="-0.35" y="0.75" z="0.9"/><rgb name="intensity" value="1, 1, 1"/>
</emitter>
<emitter type="point" id="tube_left">
    <point name="position" x="-2.1" y="1.3" z="0.2"/><rgb name="intensity" value="1, 1, 1"/>
</emitter>
<emitter type="point" id="tube_right">
    <point name="position" x="2.1" y="1.6" z="0.4"/><rgb name="intensity" value="1, 1, 1"/>
</emitter>
"""

#: Colours of its surfaces.
SURFACES = {
    "ground": "0.42, 0.36, 0.30",
    "plaster": "0.70, 0.66, 0.58",
    "brick": "0.46, 0.22, 0.15",
    "stone": "0.55, 0.53, 0.50",
    "wood": "0.40, 0.24, 0.12",
    "ball": "0.16, 0.30, 0.52",
    "hedge": "0.10, 0.20, 0.06",
}

#: Shapes: kind, surface, and what places it: scale, then turn about y, then translation.
SHAPES = (
    ("rectangle", "ground", "8 8 1", None, "0 0 0"),
    ("cube", "plaster", "2.6 1.5 0.1", 0, "0.4 1.5 -1.6"),
    ("cube", "brick", "0.1 1.1 1.6", 0, "-2.6 1.1 -0.4"),
    ("cube", "stone", "0.16 1.0 0.16", 20, "0.1 1.0 -0.6"),
    ("cube", "stone", "0.8 0.12 0.35", 0, "1.4 0.12 -1.1"),
    ("cube", "stone", "0.8 0.24 0.2", 0, "1.4 0.24 -1.35"),
    ("cube", "wood", "0.32 0.32 0.32", 35, "-1.1 0.32 0.1"),
    ("sphere", "ball", "0.3 0.3 0.3", 0, "0.9 0.3 0.4"),
    ("cube", "hedge", "0.5 0.35 0.25", 0, "2.1 0.35 -0.5"),
)


def _white(kelvin: float, level: float) -> np.ndarray:
    return level * kelvin_to_rgb(kelvin)


#: The lightings: the light of each lamp that is on.
LIGHTINGS = {
    "golden hour": {"low_sun": _white(2500, 2.4), "sky": _white(9000, 0.10)},
    "overcast": {"sky": _white(7200, 0.65)},
    "neon": {
        "tube_left": np.array([2.6, 0.15, 1.9]),
        "tube_right": np.array([0.1, 1.5, 2.4]),
        "sky": _white(9000, 0.01),
    },
    "candle": {"flame": _white(1950, 0.9), "sky": _white(3000, 0.004)},
    "blue hour": {"sky": _white(16000, 0.17), "flame": _white(2700, 0.22)},
    "noon": {"high_sun": _white(5600, 2.3), "sky": _white(8500, 0.16)},
}


@dataclass(frozen=True)
class KnownReference:
    """The courtyard under a lighting.

    picture, grey: (h, w, 3) linear, with and without colours. is_surface: (h, w), True where no
    sky is seen.
    """

    picture: np.ndarray
    grey: np.ndarray
    is_surface: np.ndarray


def references() -> dict[str, KnownReference]:
    """Return the courtyard under each lighting, by name."""
    colored, grey = _basis(SURFACES), _basis(dict.fromkeys(SURFACES, "0.5, 0.5, 0.5"))
    return {
        name: KnownReference(
            *(_lit(basis, lamps) for basis in (colored, grey)), ~colored.emitters_seen
        )
        for name, lamps in LIGHTINGS.items()
    }


def _lit(basis: lp.Basis, lamps: dict[str, np.ndarray]) -> np.ndarray:
    weights = np.array([lamps.get(name, np.zeros(3)) for name in basis.names])
    return denoised(basis.mix(weights), basis.features)


def _basis(surfaces: dict[str, str]) -> lp.Basis:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "courtyard.xml"
        path.write_text(_xml(surfaces))
        return obtain_basis(lp.load_scene(path), spp=SPP)


def _xml(surfaces: dict[str, str]) -> str:
    shapes = "".join(
        f'<shape type="{kind}" id="{surface}_{k}"><transform name="to_world">'
        f'<scale value="{scale.replace(" ", ", ")}"/>'
        + (f'<rotate y="1" angle="{turn}"/>' if turn is not None else '<rotate x="1" angle="-90"/>')
        + f'<translate value="{place.replace(" ", ", ")}"/></transform>'
        f'<bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" '
        f'value="{surfaces[surface]}"/></bsdf></bsdf></shape>'
        for k, (kind, surface, scale, turn, place) in enumerate(SHAPES)
    )
    return f"""<scene version="3.0.0">
<integrator type="path"><integer name="max_depth" value="5"/></integrator>
<sensor type="perspective" id="camera"><float name="fov" value="46"/>
<transform name="to_world">
<lookat origin="-0.5, 1.5, 5.2" target="0.1, 0.85, 0" up="0, 1, 0"/></transform>
<sampler type="independent"><integer name="sample_count" value="64"/></sampler>
<film type="hdrfilm"><integer name="width" value="{WIDTH}"/>
<integer name="height" value="{HEIGHT}"/><string name="pixel_format" value="rgb"/>
<rfilter type="box"/></film></sensor>
{LAMPS}{shapes}</scene>
"""
