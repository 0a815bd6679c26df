"""Scenes with closed forms of their illuminance, and planes of given points to measure it on."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from lightpaint.photometry.illuminance import MeasuringPlane
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

UP = (0.0, 1.0, 0.0)

SCENE = """<scene version="3.0.0">
    <integrator type="{integrator}"><integer name="max_depth" value="{max_depth}"/>
    <boolean name="hide_emitters" value="{hide}"/></integrator>
    <sensor type="perspective" id="camera"><transform name="to_world">
    <lookat origin="0 1 2.5" target="0 0.8 0" up="0 1 0"/></transform>
    <sampler type="independent"><integer name="sample_count" value="4"/></sampler>
    <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/></film>
    </sensor>
    {content}
</scene>"""

BULB = """<emitter type="point" id="bulb"><point name="position" x="0" y="2" z="0"/>
    <rgb name="intensity" value="100 100 100"/></emitter>"""
SUN = """<emitter type="directional" id="sun"><vector name="direction" x="0" y="-1" z="1"/>
    <rgb name="irradiance" value="3 3 3"/></emitter>"""
BLACK = '<bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>'
#: A disc of radius 0.5 at a height of 2 that shines downwards.
DISC = f"""<shape type="disk" id="disc"><transform name="to_world"><scale value="0.5"/>
    <rotate x="1" angle="90"/><translate y="2"/></transform>{BLACK}
    <emitter type="area"><rgb name="radiance" value="50 50 50"/></emitter></shape>"""
#: A sphere around everything that shines inwards and reflects half of the light.
FURNACE = """<shape type="sphere" id="furnace"><float name="radius" value="5"/>
    <boolean name="flip_normals" value="true"/>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf>
    <emitter type="area"><rgb name="radiance" value="2 1 0.5"/></emitter></shape>"""
GRAY = (
    '<bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf></bsdf>'
)


def write_scene(
    folder: Path,
    content: str,
    *,
    integrator: str = "path",
    max_depth: int = 8,
    hide_emitters: bool = False,
) -> Path:
    """Write a scene of lights and shapes, seen from (0, 1, 2.5)."""
    path = folder / "lit.xml"
    hide = str(hide_emitters).lower()
    values = {"integrator": integrator, "max_depth": max_depth, "hide": hide}
    path.write_text(SCENE.format(content=content, **values), encoding="utf-8")
    return path


def lit_scene(folder: Path, content: str, **options: object) -> Scene:
    """Return a scene of lights and shapes; options: those of `write_scene`."""
    return load_scene(write_scene(folder, content, **options))  # type: ignore[arg-type]


def plane_of(
    points: Sequence[Sequence[float]],
    normal: Sequence[float] = UP,
    *,
    name: str = "plane",
    is_cylindrical: bool = False,
) -> MeasuringPlane:
    """Return a plane of these points, in one row."""
    count = len(points)
    cells = np.stack([np.zeros(count, int), np.arange(count)], axis=1)
    normals = np.tile(np.array(normal, float) / np.linalg.norm(normal), (count, 1))
    places = np.array(points, float)
    return MeasuringPlane(
        name, places, normals, 0.0, 0.0, None, cells, is_cylindrical=is_cylindrical
    )


def box(name: str, low: Sequence[float], high: Sequence[float]) -> str:
    """Return a gray box, whose normals face outwards."""
    (x, y, z), size = np.mean([low, high], axis=0), (np.array(high) - low) / 2
    scale = " ".join(f'{axis}="{v}"' for axis, v in zip("xyz", size, strict=True))
    return (
        f'<shape type="cube" id="{name}"><transform name="to_world"><scale {scale}/>'
        f'<translate x="{x}" y="{y}" z="{z}"/></transform>{GRAY}</shape>'
    )


def rectangle(name: str, side: float, transform: str) -> str:
    """Return a gray square that faces +z before its transform."""
    return (
        f'<shape type="rectangle" id="{name}"><transform name="to_world">'
        f'<scale value="{side / 2}"/>{transform}</transform>{GRAY}</shape>'
    )


def floor(side: float = 4.0) -> str:
    """Return a square floor at a height of 0."""
    return rectangle("floor", side, '<rotate x="1" angle="-90"/>')
