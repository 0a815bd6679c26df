"""A hall with as many lights as asked for: no scene of the project has more than fourteen."""

import math
from collections.abc import Iterator
from pathlib import Path

#: Metres. Rows of four lights each, down-light, washer, bulb, washer, hang along its length.
WIDTH, HEIGHT, LENGTH = 9.0, 4.5, 30.0
#: Metres between two pairs of columns.
BAY = 3.6

DIFFUSE = '<bsdf type="diffuse"><rgb name="reflectance" value="{}"/></bsdf>'


def write_hall(folder: Path, lights: int, *, width: int, height: int) -> Path:
    """Write the scene XML of a hall with `lights` lights and return its path.

    Spots point down, washers are small areas along the walls, bulbs hang between; columns
    and partitions hide most of them from most places, as in a building.
    """
    path = folder / f"hall_{lights}.xml"
    body = [
        *_room(LENGTH),
        *(_light(k, 4 * LENGTH / lights) for k in range(lights)),
        *_things(LENGTH),
    ]
    path.write_text(
        f"""<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="6"/></integrator>
    <sensor type="perspective">
        <float name="fov" value="65"/>
        <transform name="to_world"><lookat origin="1.2, 2.6, -1.5" target="-0.3, 1.4, {LENGTH / 3}"
        up="0, 1, 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="{width}"/>
        <integer name="height" value="{height}"/></film>
    </sensor>
    {chr(10).join(body)}
</scene>
""",
        encoding="utf-8",
    )
    return path


def write_floor(folder: Path, points: int) -> Path:
    """Write a planes file for the hall's floor, 0.8 m high, and return its path.

    points: their approximate number.
    """
    grid = math.sqrt((WIDTH - 0.4) * (LENGTH - 0.4) / points)
    corners = [[-WIDTH / 2 + 0.2, 0.8, 0.2], [WIDTH / 2 - 0.2, 0.8, 0.2]]
    corners += [[WIDTH / 2 - 0.2, 0.8, LENGTH - 0.2]]
    path = folder / "hall.planes.toml"
    path.write_text(f"[plane.floor]\ncorners = {corners}\ngrid = {grid}\n", "utf-8")
    return path


def _light(k: int, spacing: float) -> str:
    row, place = divmod(k, 4)
    z = spacing * (row + 0.5)
    name = f'id="light_{k}"'
    if place == 0:
        return f"""<emitter type="spot" {name}><float name="cutoff_angle" value="28"/>
        <transform name="to_world"><lookat origin="-2, {HEIGHT - 0.1}, {z}"
        target="-2, 0, {z}" up="0, 0, 1"/></transform></emitter>"""
    if place == 2:
        return f"""<emitter type="point" {name}>
        <point name="position" x="2" y="{HEIGHT - 1.2}" z="{z}"/></emitter>"""
    x, angle = (-WIDTH / 2 + 0.3, 15) if place == 1 else (WIDTH / 2 - 0.3, -15)
    return f"""<shape type="rectangle" {name}><transform name="to_world">
        <scale x="0.06" y="0.3"/><rotate x="1" angle="90"/><rotate z="1" angle="{angle}"/>
        <translate x="{x}" y="{HEIGHT - 0.15}" z="{z}"/></transform>
        <emitter type="area"/></shape>"""


def _room(length: float) -> Iterator[str]:
    x, y, z = WIDTH / 2, HEIGHT / 2, length / 2
    for scale, rotation, place, colour in (
        ((x, z + 2), ("x", -90), (0, 0, z), "0.4 0.35 0.3"),
        ((x, z + 2), ("x", 90), (0, HEIGHT, z), "0.8 0.8 0.8"),
        ((z + 2, y), ("y", 90), (-x, y, z), "0.7 0.6 0.5"),
        ((z + 2, y), ("y", -90), (x, y, z), "0.5 0.6 0.7"),
        ((x, y), ("y", 180), (0, y, length), "0.6 0.6 0.6"),
        ((x, y), ("y", 0), (0, y, -2), "0.6 0.6 0.6"),
    ):
        yield f"""<shape type="rectangle"><transform name="to_world">
        <scale x="{scale[0]}" y="{scale[1]}"/><rotate {rotation[0]}="1" angle="{rotation[1]}"/>
        <translate x="{place[0]}" y="{place[1]}" z="{place[2]}"/></transform>
        {DIFFUSE.format(colour)}</shape>"""


def _things(length: float) -> Iterator[str]:
    for k in range(int(length / BAY) - 1):
        z = BAY * (k + 1)
        for x in (-0.7, 3.2):
            yield f"""<shape type="cube"><transform name="to_world">
            <scale x="0.2" y="{HEIGHT / 2}" z="0.2"/><translate x="{x}" y="{HEIGHT / 2}" z="{z}"/>
            </transform>{DIFFUSE.format("0.7 0.7 0.65")}</shape>"""
        yield f"""<shape type="sphere"><point name="center" x="{-2 + k % 3}" y="0.6"
        z="{z - 0.9}"/><float name="radius" value="0.6"/><bsdf type="roughplastic">
        <rgb name="diffuse_reflectance" value="0.5 0.3 0.2"/></bsdf></shape>"""
