"""A rig as a scene for Mitsuba and a lights file beside it, as texts.

The room around it is the models of the show as meshes, or a scene of the user's own.
"""

import io
import json
import math
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles
from lightpaint.colour import WAVELENGTHS, SlotFilter, Spectrum, spot_cone
from lightpaint.dmx.console_rig import ConsoleRig, RigEmitter, RigFixture, RigLight
from lightpaint.dmx.mvr import KIND, PlacedModel
from lightpaint.errors import SceneError
from lightpaint.files import first_line, read_bytes
from lightpaint.scene.checks.tokens import attributes, decoded, encoding_of, line_of, markup, tag
from lightpaint.scene.properties.site import across
from lightpaint.storage.rig_archive import MAX_XML, RigArchive

#: Share of full at which every light begins.
STARTING_SHARE = 0.5

#: Radiance that a white wall, lit by half of the lights that reach it, is to have.
MIDDLE_RADIANCE = 0.5

#: Resolution and samples of the sensor, and its horizontal field of view in degrees.
FILM, SAMPLES, FIELD_OF_VIEW = (960, 540), 64, 50.0

#: Room around what the sensor shows, relative to it, and height of its eye in metres.
MARGIN, EYE_HEIGHT = 1.15, 1.7

#: Metres around the middle of a beam that it lights.
LIT_AROUND = 1.0

#: Farthest throw of a light that points at no floor, and least size of the floor, in metres.
LONGEST_THROW, LEAST_FLOOR = 10.0, 6.0

#: Bits of a channel that a lights file knows.
MAX_BITS = 24

#: Folder of the meshes, beside the scene.
MESHES = "meshes"

#: Formats of models that are read, which name no other files, and most triangles of all models.
READ_FORMATS, MAX_TRIANGLES = (".glb",), 5_000_000

#: From the axes of glTF, y up, to the axes of MVR, z up.
Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


@dataclass(frozen=True)
class Room:
    """The surroundings of the lights.

    include: file of a scene, from the folder of the rig's; "" for none. has_sensor, has_integrator:
    whether that scene has them. meshes: files beside the rig's scene. points: (k, 3), of the
    meshes' bounds.
    """

    include: str = ""
    has_sensor: bool = False
    has_integrator: bool = False
    meshes: tuple[str, ...] = ()
    points: Doubles | None = None


def cd_per_unit(rig: ConsoleRig) -> float:
    """Return the candelas of an intensity of 1, a round number.

    With all lights at `STARTING_SHARE`, a white wall that some of them reach has a radiance of
    about `MIDDLE_RADIANCE`.
    """
    lights = lights_of(rig)
    lux = [_candela(light) / _throw(light) ** 2 for light in lights]
    wall = STARTING_SHARE * float(np.mean(lux)) * math.sqrt(len(lux)) / 2 / math.pi
    exact = max(wall / MIDDLE_RADIANCE, 1e-6)
    power = 10.0 ** math.floor(math.log10(exact))
    return float(min((k * power for k in (1, 2, 5, 10)), key=lambda x: abs(math.log(x / exact))))


def scene_text(rig: ConsoleRig, unit: float, room: Room | None) -> str:
    """Return the scene. unit: candelas of an intensity of 1. room: None for the lights alone."""
    lines = ['<?xml version="1.0" encoding="utf-8"?>']
    lines += [f"<!-- {_comment(rig.name)}: metres, z up; an intensity of 1 is {unit:g} cd. -->"]
    lines += ['<scene version="3.0.0">']
    if room is not None:
        lines += _indented(_room_lines(rig, room))
    for fixture in rig.fixtures:
        for light in fixture.lights:
            lines += _indented(_spot(light, unit))
    return "\n".join([*lines, "</scene>", ""])


def lights_text(
    rig: ConsoleRig, unit: float, *, open_wheels: bool = False, stem: str = "rig"
) -> str:
    """Return the lights file: all lights of the rig with their emitters.

    unit: candelas of an intensity of 1. open_wheels: whether colour wheels stay open. stem: of the
    files of spectra, as in `spectrum_tables`.
    """
    lines = [f"# Lights of {_comment(rig.name)}. Others in the scene stay as they are."]
    lines += [f"cd_per_unit = {unit:g}"]
    names = [_quoted(light.name) for light in lights_of(rig)]
    lines += ["lights = [", *(f"    {name}," for name in names), "]"]
    for fixture in rig.fixtures:
        for light in fixture.lights:
            lines += ["", f"[light.{_quoted(light.name)}]", "emitters = ["]
            lines += [f"    {_emitter(x, light, fixture, stem)}," for x in light.emitters]
            lines += ["]"]
            if light.has_slots_for_emitters:
                brightest = max(light.emitters, key=lambda x: x.candela)
                lines += [f"wheel = {_quoted(brightest.name) if open_wheels else 'true'}"]
            elif light.wheel is not None and not open_wheels:
                slots = (f"    {_slot(x)}," for x in light.wheel.filters)
                lines += ["wheel = [", *slots, "]"]
            if light.whites:  # which share the light of one lamp
                lines += [f"power_share = {1 / len(light.emitters):g}"]
    return "\n".join([*lines, ""])


def spectrum_tables(rig: ConsoleRig, stem: str) -> dict[str, str]:
    """Return a table for each spectrum that was measured, by the name of its file.

    stem: with which the names of files begin.
    """
    return {
        _spectrum_file(stem, fixture, emitter): _table(emitter.spectrum)
        for fixture in rig.fixtures
        for light in fixture.lights
        for emitter in light.emitters
        if emitter.spectrum is not None
    }


def _spectrum_file(stem: str, fixture: RigFixture, emitter: RigEmitter) -> str:
    parts = (stem, *(re.sub(r"[^\w-]+", "_", x) for x in (fixture.kind, emitter.name)))
    return f"{'.'.join(parts)}.csv"


def _table(spectrum: Spectrum) -> str:
    pairs = zip(WAVELENGTHS.tolist(), spectrum, strict=True)
    return "\n".join(["nm,power", *(f"{nm},{power:g}" for nm, power in pairs), ""])


def lights_of(rig: ConsoleRig) -> list[RigLight]:
    """Return the lights of all fixtures."""
    return [light for fixture in rig.fixtures for light in fixture.lights]


def _candela(light: RigLight) -> float:
    amounts = [x.candela for x in light.emitters]
    # Of two whites that share their light, each is all of it, and so is each slot of a wheel.
    return max(amounts) if light.whites or light.has_slots_for_emitters else sum(amounts)


def _emitter(emitter: RigEmitter, light: RigLight, fixture: RigFixture, stem: str) -> str:
    """Return an emitter as an inline table of TOML."""
    x, y = emitter.xy
    channels = emitter.channels or light.dimmers
    if light.filters:
        channels = tuple(k for filter_ in light.filters for k in filter_.channels)
    channels = light.chromaticity or channels
    byte_counts = [len(fixture.channels[k].offsets) for k in channels]
    bits = min(8 * min(byte_counts, default=1), MAX_BITS)
    color = f"xy = [{x:.5g}, {y:.5g}]"
    if emitter.spectrum is not None:
        color = f"spectrum = {_quoted(_spectrum_file(stem, fixture, emitter))}"
    fields = [f"name = {_quoted(emitter.name)}", color]
    fields += [f"cd = {emitter.candela:.6g}", "max = 1", f"bits = {bits}"]
    if emitter.watts is not None:
        fields.append(f"watts = {emitter.watts:.6g}")
    return f"{{ {', '.join(fields)} }}"


def _slot(slot: SlotFilter) -> str:
    """Return a slot in front of emitters as an inline table of TOML."""
    passed = ", ".join(f"{x:.4g}" for x in slot.transmission)
    return f"{{ name = {_quoted(slot.name)}, transmission = [{passed}] }}"


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _comment(text: str) -> str:
    return text.replace("--", "- -")


def _indented(lines: Sequence[str]) -> list[str]:
    return [f"    {line}" for line in lines]


def _spot(light: RigLight, unit: float) -> list[str]:
    cutoff, width = spot_cone(light.beam_angle, light.field_angle)
    level = STARTING_SHARE * _candela(light) / unit
    direction = np.array(light.direction)
    up = np.array(light.up)
    if np.linalg.norm(np.cross(direction, up)) < 1e-3:
        up = across(direction)[0]
    origin, target = np.array(light.position), np.array(light.position) + direction
    lookat = tag("lookat", origin=_point(origin), target=_point(target), up=_point(up))
    return [
        tag("emitter", type="spot", id=light.name).replace("/>", ">"),
        f'    <transform name="to_world">{lookat}</transform>',
        f"    {tag('float', name='cutoff_angle', value=f'{cutoff:.6g}')}",
        f"    {tag('float', name='beam_width', value=f'{width:.6g}')}",
        f"    {tag('rgb', name='intensity', value=f'{level:.6g}')}",
        "</emitter>",
    ]


def _point(values: Doubles) -> str:
    # To a micrometre, and without -0.
    return ", ".join(f"{round(v, 6) + 0.0:.9g}" for v in values.tolist())


def _room_lines(rig: ConsoleRig, room: Room) -> list[str]:
    """Return the elements of a scene but for the lights of the rig."""
    lines = []
    if room.include:
        lines += [tag("include", filename=room.include)]
    if not room.has_integrator:
        lines += ['<integrator type="path"><integer name="max_depth" value="6"/></integrator>']
    if not room.has_sensor:
        lines += _sensor(rig, room)
    for mesh in room.meshes:
        bsdf = '<bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf>'
        file = tag("string", name="filename", value=str(PurePosixPath(mesh)))
        lines += [
            '<shape type="ply">',
            f"    {file}",
            f'    <bsdf type="twosided">{bsdf}</bsdf>',
            "</shape>",
        ]
    if not room.include and not room.meshes:
        lines += _floor(_lit_points(rig))
    return lines


def _lit_points(rig: ConsoleRig) -> Doubles:
    """Return where the lights are and where their beams end, (2n, 3)."""
    lights = lights_of(rig)
    places = np.array([light.position for light in lights])
    ways = np.array([light.direction for light in lights])
    throws = np.array([_throw(light) for light in lights])
    return np.concatenate([places, places + throws[:, None] * ways])


def _throw(light: RigLight) -> float:
    """Return the metres from a light to the floor, z = 0, along its axis."""
    height, fall = light.position[2], -light.direction[2]
    distance = height / fall if height > 0 and fall > 1e-3 else LONGEST_THROW
    return max(min(distance, LONGEST_THROW), 1.0)


def _sensor(rig: ConsoleRig, room: Room) -> list[str]:
    """Return a sensor in front, at -y, that shows the room; of a floor alone, what is lit of it."""
    points = _lit_points(rig)
    points = points[len(points) // 2 :] if room.points is None else room.points
    low, high = points.min(axis=0) - LIT_AROUND, points.max(axis=0) + LIT_AROUND
    aspect = FILM[0] / FILM[1]
    width = MARGIN * max(high[0] - low[0], aspect * (high[2] - low[2]), 1.0)
    distance = width / 2 / math.tan(math.radians(FIELD_OF_VIEW / 2))
    middle = (low + high) / 2
    eye = low[2] + EYE_HEIGHT if room.points is not None else middle[2] + distance / 2
    origin = np.array([middle[0], low[1] - distance, max(eye, 0.0)])
    lookat = tag("lookat", origin=_point(origin), target=_point(middle), up="0, 0, 1")
    width_px, height_px = FILM
    return [
        '<sensor type="perspective" id="front">',
        f"    {tag('float', name='fov', value=f'{FIELD_OF_VIEW:g}')}",
        f'    <transform name="to_world">{lookat}</transform>',
        '    <sampler type="independent">',
        f"        {tag('integer', name='sample_count', value=str(SAMPLES))}",
        "    </sampler>",
        '    <film type="hdrfilm">',
        f"        {tag('integer', name='width', value=str(width_px))}",
        f"        {tag('integer', name='height', value=str(height_px))}",
        '        <rfilter type="box"/>',
        "    </film>",
        "</sensor>",
    ]


def _floor(points: Doubles) -> list[str]:
    """Return a floor below all points."""
    low, high = points.min(axis=0), points.max(axis=0)
    middle = (low + high) / 2
    half = np.maximum(MARGIN * (high - low), LEAST_FLOOR) / 2
    (x, y), (across_x, across_y), z = middle[:2].round(3), half[:2].round(3), min(low[2], 0.0)
    scale = tag("scale", x=f"{across_x:g}", y=f"{across_y:g}")
    place = tag("translate", x=f"{x + 0.0:g}", y=f"{y + 0.0:g}", z=f"{z:g}")
    return [
        '<shape type="rectangle" id="floor">',
        f'    <transform name="to_world">{scale}{place}</transform>',
        '    <bsdf type="twosided"><bsdf type="diffuse">'
        '<rgb name="reflectance" value="0.4"/></bsdf></bsdf>',
        "</shape>",
    ]


@dataclass(frozen=True)
class RoomFiles:
    """A room, the content of its meshes by name of the file, and remarks on what was left out."""

    room: Room
    files: Mapping[str, bytes]
    remarks: tuple[str, ...] = ()


def room_of_scene(path: Path, folder: Path) -> Room:
    """Return the room of a user's scene, for a rig's scene in `folder`.

    Raises SceneError for a file that is not the XML of a scene. Mitsuba checks the rest of it.
    """
    raw = read_bytes(path, "scene file", SceneError, limit=MAX_XML)
    try:
        tags = _scene_tags(raw.decode(encoding_of(raw), "replace").encode())
    except ValueError as error:
        raise SceneError(f"{path}, {error}") from None
    # What it includes may have them as well.
    has_more = b"include" in tags
    place = os.path.relpath(path.resolve(), folder.resolve())
    has_sensor, has_integrator = (has_more or x in tags for x in (b"sensor", b"integrator"))
    return Room(Path(place).as_posix(), has_sensor, has_integrator)


def _scene_tags(text: bytes) -> list[bytes]:
    """Return the names of the elements of a scene. text: UTF-8. Raises ValueError for other XML."""
    names: list[bytes] = []
    open_names: list[bytes] = []
    roots = []
    for token in markup(text):
        if (name := token["tag"]) is not None:
            names.append(name)
            if not open_names:
                roots.append(token)
            if not token["empty"]:
                open_names.append(name)
        elif (end := token["end"]) is not None and (not open_names or open_names.pop() != end):
            raise ValueError(f"line {line_of(text, token.start())}: </{decoded(end)}> ends nothing")
    if open_names:
        raise ValueError(f"it ends before </{decoded(open_names[-1])}>")
    if [x["tag"] for x in roots] != [b"scene"] or "version" not in attributes(roots[0]):
        raise ValueError('it is not a scene of Mitsuba: expected one <scene version="3.0.0">')
    return names


def room_of_show(path: Path, models: Sequence[PlacedModel]) -> RoomFiles:
    """Return the room that an MVR has, a mesh for each of its files.

    Without trimesh it is empty. Other formats than glTF are named in a remark.
    """
    by_file: dict[str, list[Doubles]] = {}
    for model in models:
        by_file.setdefault(model.file, []).append(model.matrix)
    known = {x: places for x, places in by_file.items() if x.lower().endswith(READ_FORMATS)}
    remarks = _left_out(by_file.keys() - known.keys())
    if known and (trimesh := _trimesh()) is None:
        names = f"{len(known)} models" if len(known) > 1 else "1 model"
        remarks.append(f"{names} in .glb left out: pip install trimesh to read them")
        known = {}
    files: dict[str, bytes] = {}
    bounds, triangles = [], 0
    with RigArchive(path, path.name, KIND) as archive:
        for file, places in known.items():
            if (member := archive.find(file)) is None:
                remarks.append(f"{file} is not in {path.name}: left out")
                continue
            try:
                scene = trimesh.load_scene(
                    io.BytesIO(archive.read(member)), file_type=Path(file).suffix[1:].lower()
                )
                mesh = scene.to_mesh()
            except Exception as error:  # any kind, of a library that reads strangers' files
                remarks.append(f"{file} cannot be read: {first_line(error)}")
                continue
            triangles += len(mesh.faces) * len(places)
            if triangles > MAX_TRIANGLES:
                remarks.append(f"{file} and what follows left out: over {MAX_TRIANGLES} triangles")
                break
            points, faces = _copies(mesh, places)
            if len(faces):
                files[f"{MESHES}/{len(files) + 1:03d}.ply"] = ply(points, faces)
                bounds += [points.min(axis=0), points.max(axis=0)]
    room = Room(meshes=tuple(files), points=np.array(bounds) if bounds else None)
    return RoomFiles(room, files, tuple(remarks))


def _left_out(files: Iterable[str]) -> list[str]:
    """Return a remark for each format that is not read."""
    counts: dict[str, int] = {}
    for file in files:
        ending = Path(file).suffix.lower() or "no format"
        counts[ending] = counts.get(ending, 0) + 1
    remarks: list[str] = []
    for ending, count in sorted(counts.items()):
        models = f"{count} {'models' if count > 1 else 'model'} in {ending}"
        remarks.append(f"{models} left out: give a scene as the room, or export .glb")
    return remarks


def _trimesh() -> Any:
    try:
        import trimesh
    except ImportError:
        return None
    return trimesh


def _copies(mesh: Any, places: Sequence[Doubles]) -> tuple[Doubles, npt.NDArray[np.int32]]:
    """Return points (v, 3) and faces (f, 3) of a mesh in all its places."""
    local = np.c_[np.asarray(mesh.vertices, float), np.ones(len(mesh.vertices))]
    points = [(local @ (place @ Z_UP).T)[:, :3] for place in places]
    faces = [np.asarray(mesh.faces, np.int32) + k * len(local) for k in range(len(places))]
    return np.concatenate(points), np.concatenate(faces)


def ply(points: Doubles, faces: npt.NDArray[np.int32]) -> bytes:
    """Return a mesh as binary PLY. points: (v, 3). faces: (f, 3), places of points."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    rows = np.zeros(len(faces), np.dtype([("count", "u1"), ("places", "<i4", 3)]))
    rows["count"], rows["places"] = 3, faces
    return header.encode() + points.astype("<f4").tobytes() + rows.tobytes()
