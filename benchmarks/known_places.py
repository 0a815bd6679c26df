"""Four places under lightings that are known: references for `benchmarks/references.py`.

A courtyard with a wall, a column, steps, a crate, a ball and a hedge, of brick, plaster, wood and
leaves; a studio, open to the sky, with a window to its side, of blue and green paint, slate and
cloth; a terrace of sandstone, tiles and planks with a parapet, posts and a bench; and a market of
tents, barrels and asphalt: other geometry and other surfaces than the scenes that are shipped.
`references` returns the picture of a place under each lighting, and the same in grey, where nothing
but the light is left. Constants of *Look like this* were chosen on the first three. The market was
made after that.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import lightpaint as lp
from lightpaint.basis.cache.cached_render import obtain_basis
from lightpaint.colour.color import kelvin_to_rgb
from lightpaint.images.denoiser import denoised

WIDTH, HEIGHT, SPP = 240, 160, 256

#: A shape: kind, surface, and what places it: scale, then turn about y, then translation.
Shape = tuple[str, str, str, float | None, str]


@dataclass(frozen=True)
class Place:
    """A place and its lightings.

    surfaces: colours by name. suns: directions by name. points: lamps by name. lightings: the light
    of each lamp that is on, RGB; `sky` is everywhere. camera: origin and target.
    """

    surfaces: Mapping[str, str]
    shapes: tuple[Shape, ...]
    suns: Mapping[str, str]
    points: Mapping[str, str]
    lightings: Mapping[str, Mapping[str, np.ndarray]]
    camera: tuple[str, str]


def _white(kelvin: float, level: float) -> np.ndarray:
    return level * kelvin_to_rgb(kelvin)


COURTYARD = Place(
    surfaces={
        "ground": "0.42, 0.36, 0.30",
        "plaster": "0.70, 0.66, 0.58",
        "brick": "0.46, 0.22, 0.15",
        "stone": "0.55, 0.53, 0.50",
        "wood": "0.40, 0.24, 0.12",
        "ball": "0.16, 0.30, 0.52",
        "hedge": "0.10, 0.20, 0.06",
    },
    shapes=(
        ("rectangle", "ground", "8 8 1", None, "0 0 0"),
        ("cube", "plaster", "2.6 1.5 0.1", 0, "0.4 1.5 -1.6"),
        ("cube", "brick", "0.1 1.1 1.6", 0, "-2.6 1.1 -0.4"),
        ("cube", "stone", "0.16 1.0 0.16", 20, "0.1 1.0 -0.6"),
        ("cube", "stone", "0.8 0.12 0.35", 0, "1.4 0.12 -1.1"),
        ("cube", "stone", "0.8 0.24 0.2", 0, "1.4 0.24 -1.35"),
        ("cube", "wood", "0.32 0.32 0.32", 35, "-1.1 0.32 0.1"),
        ("sphere", "ball", "0.3 0.3 0.3", 0, "0.9 0.3 0.4"),
        ("cube", "hedge", "0.5 0.35 0.25", 0, "2.1 0.35 -0.5"),
    ),
    suns={"low_sun": "1, -0.42, -0.75", "high_sun": "0.45, -1, -0.5"},
    points={
        "flame": "-0.35, 0.75, 0.9",
        "tube_left": "-2.1, 1.3, 0.2",
        "tube_right": "2.1, 1.6, 0.4",
    },
    lightings={
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
    },
    camera=("-0.5, 1.5, 5.2", "0.1, 0.85, 0"),
)

STUDIO = Place(
    surfaces={
        "floor": "0.30, 0.31, 0.33",
        "wall": "0.44, 0.52, 0.56",
        "side": "0.34, 0.46, 0.40",
        "slate": "0.20, 0.21, 0.24",
        "cloth": "0.62, 0.58, 0.56",
        "red": "0.48, 0.12, 0.10",
        "paper": "0.78, 0.78, 0.76",
    },
    shapes=(
        ("rectangle", "floor", "9 9 1", None, "0 0 0"),
        ("cube", "wall", "3.4 1.7 0.1", 0, "0 1.7 -2.2"),
        ("cube", "side", "0.1 0.5 2.2", 0, "3.0 0.5 -0.4"),
        ("cube", "side", "0.1 0.35 2.2", 0, "3.0 2.75 -0.4"),
        ("cube", "side", "0.1 1.6 0.5", 0, "3.0 1.6 -1.9"),
        ("cube", "slate", "0.9 0.06 0.5", 10, "-0.5 0.8 -0.3"),
        ("cube", "slate", "0.06 0.4 0.4", 10, "-1.2 0.4 -0.3"),
        ("cube", "slate", "0.06 0.4 0.4", 10, "0.2 0.4 -0.3"),
        ("sphere", "red", "0.22 0.22 0.22", 0, "-0.8 1.08 -0.3"),
        ("cube", "paper", "0.7 0.5 0.03", 0, "-1.7 1.9 -2.08"),
        ("cube", "cloth", "0.7 0.3 0.5", -25, "1.7 0.3 -0.7"),
        ("cube", "cloth", "0.7 0.4 0.12", -25, "1.9 0.8 -1.15"),
        ("sphere", "paper", "0.3 0.3 0.3", 0, "1.3 0.3 0.9"),
        ("cube", "slate", "0.25 0.9 0.25", 30, "-2.4 0.9 -1.3"),
    ),
    suns={"low_sun": "-1, -0.36, -0.35", "high_sun": "-0.5, -1, -0.35"},
    points={
        "flame": "-0.1, 1.2, 0.0",
        "tube_left": "-2.6, 2.2, 0.3",
        "tube_right": "2.4, 1.2, 0.5",
    },
    lightings={
        "golden hour": {"low_sun": _white(2700, 2.8), "sky": _white(11_000, 0.14)},
        "overcast": {"sky": _white(6900, 0.8)},
        "neon": {
            "tube_left": np.array([0.15, 0.9, 3.0]),
            "tube_right": np.array([3.4, 0.3, 0.9]),
            "sky": _white(8000, 0.012),
        },
        "candle": {"flame": _white(2000, 1.1), "sky": _white(4000, 0.006)},
        "blue hour": {"sky": _white(14_000, 0.15), "flame": _white(2800, 0.12)},
        "noon": {"high_sun": _white(5500, 2.6), "sky": _white(9000, 0.2)},
    },
    camera=("-0.4, 1.6, 5.6", "0, 1.1, -0.5"),
)

TERRACE = Place(
    surfaces={
        "tiles": "0.50, 0.40, 0.34",
        "sandstone": "0.64, 0.56, 0.44",
        "white": "0.76, 0.75, 0.72",
        "planks": "0.34, 0.26, 0.18",
        "leaves": "0.14, 0.24, 0.09",
        "pot": "0.44, 0.20, 0.13",
        "steel": "0.40, 0.42, 0.45",
    },
    shapes=(
        ("rectangle", "tiles", "10 10 1", None, "0 0 0"),
        ("cube", "sandstone", "1.5 2.2 0.15", 0, "-2.0 2.2 -2.4"),
        ("cube", "white", "1.6 0.45 0.12", 0, "1.5 0.45 -2.3"),
        ("cube", "steel", "0.07 1.3 0.07", 45, "1.0 1.3 -1.2"),
        ("cube", "steel", "0.07 1.3 0.07", 45, "2.6 1.3 -1.2"),
        ("cube", "planks", "1.1 0.05 0.6", 0, "1.8 2.6 -1.2"),
        ("cube", "planks", "0.9 0.05 0.28", 15, "-1.4 0.5 -0.8"),
        ("cube", "planks", "0.06 0.24 0.24", 15, "-2.1 0.24 -0.65"),
        ("cube", "planks", "0.06 0.24 0.24", 15, "-0.7 0.24 -1.0"),
        ("cube", "pot", "0.25 0.25 0.25", 30, "0.6 0.25 0.2"),
        ("sphere", "leaves", "0.42 0.42 0.42", 0, "0.6 0.85 0.2"),
        ("sphere", "white", "0.26 0.26 0.26", 0, "2.0 0.26 0.1"),
    ),
    suns={"low_sun": "0.9, -0.3, -0.5", "high_sun": "0.3, -1, -0.7"},
    points={
        "flame": "-0.8, 0.95, -0.3",
        "tube_left": "-2.4, 1.8, 0.6",
        "tube_right": "2.8, 1.5, 0.2",
    },
    lightings={
        "golden hour": {"low_sun": _white(2300, 2.6), "sky": _white(8000, 0.12)},
        "overcast": {"sky": _white(6600, 0.55)},
        "neon": {
            "tube_left": np.array([2.8, 0.5, 0.2]),
            "tube_right": np.array([0.2, 2.0, 2.6]),
            "sky": _white(9000, 0.01),
        },
        "candle": {"flame": _white(1900, 0.8), "sky": _white(5000, 0.004)},
        "blue hour": {"sky": _white(18_000, 0.14), "flame": _white(2600, 0.1)},
        "noon": {"high_sun": _white(5700, 2.0), "sky": _white(9500, 0.18)},
    },
    camera=("0.3, 1.7, 5.8", "0.1, 1.05, -0.6"),
)

MARKET = Place(
    surfaces={
        "asphalt": "0.16, 0.16, 0.17",
        "canvas": "0.66, 0.64, 0.60",
        "stripe": "0.20, 0.34, 0.52",
        "brick": "0.42, 0.26, 0.20",
        "wood": "0.44, 0.33, 0.22",
        "fruit": "0.62, 0.34, 0.08",
        "concrete": "0.46, 0.46, 0.45",
    },
    shapes=(
        ("rectangle", "asphalt", "12 12 1", None, "0 0 0"),
        ("cube", "brick", "4.2 2.4 0.15", 0, "0 2.4 -3.4"),
        ("cube", "concrete", "0.5 1.0 0.16", 0, "-0.4 1.0 -3.2"),
        ("cube", "canvas", "1.0 0.04 0.8", 0, "-1.9 2.0 -1.5"),
        ("cube", "stripe", "1.0 0.2 0.02", 0, "-1.9 1.8 -0.7"),
        ("cube", "wood", "0.9 0.4 0.35", 0, "-1.9 0.4 -1.3"),
        ("sphere", "fruit", "0.14 0.14 0.14", 0, "-2.2 0.92 -1.1"),
        ("sphere", "fruit", "0.14 0.14 0.14", 0, "-1.85 0.92 -1.1"),
        ("cube", "canvas", "1.1 0.04 0.7", -8, "2.0 2.2 -1.7"),
        ("cube", "canvas", "0.9 0.45 0.3", -8, "2.0 0.45 -1.6"),
        ("sphere", "concrete", "0.36 0.36 0.36", 0, "0.4 0.36 -0.4"),
        ("cube", "wood", "0.28 0.45 0.28", 25, "1.3 0.45 0.3"),
    ),
    suns={"low_sun": "-0.8, -0.34, -0.6", "high_sun": "-0.35, -1, -0.45"},
    points={
        "flame": "0.4, 1.1, -0.9",
        "tube_left": "-2.2, 1.5, 0.3",
        "tube_right": "2.4, 1.7, 0.0",
    },
    lightings={
        "golden hour": {"low_sun": _white(2600, 3.0), "sky": _white(9500, 0.15)},
        "overcast": {"sky": _white(7000, 0.9)},
        "neon": {
            "tube_left": np.array([3.2, 0.2, 1.4]),
            "tube_right": np.array([0.2, 1.2, 3.6]),
            "sky": _white(9000, 0.015),
        },
        "candle": {"flame": _white(1950, 1.6), "sky": _white(4000, 0.008)},
        "blue hour": {"sky": _white(15_000, 0.2), "flame": _white(2700, 0.15)},
        "noon": {"high_sun": _white(5600, 2.8), "sky": _white(9000, 0.22)},
    },
    camera=("-0.2, 1.7, 5.4", "0.1, 1.05, -1"),
)

#: The places by name.
PLACES = {"courtyard": COURTYARD, "studio": STUDIO, "terrace": TERRACE, "market": MARKET}


@dataclass(frozen=True)
class KnownReference:
    """A place under a lighting.

    picture, grey: (h, w, 3) linear, with and without colours. is_surface: (h, w), True where no
    sky is seen.
    """

    picture: np.ndarray
    grey: np.ndarray
    is_surface: np.ndarray


def references(name: str) -> dict[str, KnownReference]:
    """Return the place of a name under each lighting, by its name."""
    place = PLACES[name]
    colored = _basis(place, place.surfaces)
    grey = _basis(place, dict.fromkeys(place.surfaces, "0.5, 0.5, 0.5"))
    return {
        title: KnownReference(
            *(_lit(basis, lamps) for basis in (colored, grey)), ~colored.emitters_seen
        )
        for title, lamps in place.lightings.items()
    }


def _lit(basis: lp.Basis, lamps: Mapping[str, np.ndarray]) -> np.ndarray:
    weights = np.array([lamps.get(name, np.zeros(3)) for name in basis.names])
    return denoised(basis.mix(weights), basis.features)


def _basis(place: Place, surfaces: Mapping[str, str]) -> lp.Basis:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "place.xml"
        path.write_text(_xml(place, surfaces))
        return obtain_basis(lp.load_scene(path), spp=SPP)


def _lamps(place: Place) -> str:
    unit = 'value="1, 1, 1"/>'
    suns = "".join(
        f'<emitter type="directional" id="{name}"><vector name="direction" value="{direction}"/>'
        f'<rgb name="irradiance" {unit}</emitter>'
        for name, direction in place.suns.items()
    )
    points = "".join(
        f'<emitter type="point" id="{name}"><point name="position" value="{where}"/>'
        f'<rgb name="intensity" {unit}</emitter>'
        for name, where in place.points.items()
    )
    return f'{suns}{points}<emitter type="constant" id="sky"><rgb name="radiance" {unit}</emitter>'


def _xml(place: Place, surfaces: Mapping[str, str]) -> str:
    shapes = "".join(
        f'<shape type="{kind}" id="{surface}_{k}"><transform name="to_world">'
        f'<scale value="{scale.replace(" ", ", ")}"/>'
        + (f'<rotate y="1" angle="{turn}"/>' if turn is not None else '<rotate x="1" angle="-90"/>')
        + f'<translate value="{place.replace(" ", ", ")}"/></transform>'
        f'<bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" '
        f'value="{surfaces[surface]}"/></bsdf></bsdf></shape>'
        for k, (kind, surface, scale, turn, place) in enumerate(place.shapes)
    )
    origin, target = place.camera
    return f"""<scene version="3.0.0">
<integrator type="path"><integer name="max_depth" value="5"/></integrator>
<sensor type="perspective" id="camera"><float name="fov" value="46"/>
<transform name="to_world">
<lookat origin="{origin}" target="{target}" up="0, 1, 0"/></transform>
<sampler type="independent"><integer name="sample_count" value="64"/></sampler>
<film type="hdrfilm"><integer name="width" value="{WIDTH}"/>
<integer name="height" value="{HEIGHT}"/><string name="pixel_format" value="rgb"/>
<rfilter type="box"/></film></sensor>
{_lamps(place)}{shapes}</scene>
"""
