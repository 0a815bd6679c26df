"""Make the example rig: four PARs of red, green, blue and white, and two washes of six colours.

    python scenes/rig/make_rig.py

needs pygdtf and pymvr (`pip install 'lightpaint[stage]'`), and writes `show.mvr`, the same bytes
every time. Both types are invented. Lengths here are in metres, z is up, and the audience looks
towards +y; the stage is in `room.xml`, by hand.
"""

from __future__ import annotations

import io
import sys
import tempfile
import uuid
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pygdtf
import pymvr
from numpy.typing import NDArray

HERE = Path(__file__).resolve().parent

#: Where names of this rig become identifiers.
NAMESPACE = uuid.UUID("5b0b6f5c-6a39-4b8e-9f6e-3d4d2f6b7c11")

#: First level at which a shutter is open.
OPEN = 32

#: Time of every file in the archives, so that equal sources make equal bytes.
TIME = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True)
class Emitter:
    """A kind of LEDs: suffix of its attribute, chromaticity, relative luminance, candelas."""

    suffix: str
    name: str
    x: float
    y: float
    luminance: float
    candela: float = 0.0


@dataclass(frozen=True)
class Kind:
    """A type of fixture: name, mode, bytes of a channel, beam, emitters, watts."""

    name: str
    mode: str
    byte_count: int
    lumens: float
    beam: float
    field: float
    watts: float
    emitters: tuple[Emitter, ...]
    zoom: tuple[float, float] | None = None
    moves: bool = False

    @property
    def file(self) -> str:
        """Its file in the archive."""
        return f"{self.name}.gdtf"


PAR = Kind(
    *("Example@PAR four colours", "5 channels", 1, 7000.0, 30.0, 45.0, 180.0),
    (
        Emitter("R", "Red", 0.690, 0.309, 20.0),
        Emitter("G", "Green", 0.180, 0.715, 38.0),
        Emitter("B", "Blue", 0.152, 0.028, 8.0),
        Emitter("W", "White", 0.325, 0.340, 52.0),
    ),
)

WASH = Kind(
    *("Example@Wash six colours", "Extended", 2, 16000.0, 24.0, 40.0, 420.0),
    (
        Emitter("R", "Red", 0.695, 0.304, 16.0, 12100.0),
        Emitter("RY", "Amber", 0.575, 0.420, 20.0, 15100.0),
        Emitter("GY", "Lime", 0.408, 0.552, 52.0, 39300.0),
        Emitter("G", "Green", 0.168, 0.708, 27.0, 20400.0),
        Emitter("GC", "Cyan", 0.075, 0.420, 15.0, 11300.0),
        Emitter("B", "Blue", 0.151, 0.031, 6.0, 4500.0),
    ),
    zoom=(8.0, 48.0),
    moves=True,
)


@dataclass(frozen=True)
class Hung:
    """A fixture: number, name, type, place, what it points at, address. has_focus: whether that is
    a focus point, and the fixture itself hangs straight.
    """

    number: int
    name: str
    kind: Kind
    place: tuple[float, float, float]
    target: tuple[float, float, float]
    universe: int
    address: int
    has_focus: bool = False


FRONT = [
    Hung(101 + k, f"PAR {k + 1}", PAR, (x, -2.5, 5.2), (0.55 * x, 1.2, 0.6), 1, 1 + 5 * k)
    for k, x in enumerate((-3.6, -1.2, 1.2, 3.6))
]
BACK = [
    Hung(201 + k, f"Wash {k + 1}", WASH, (x, 3.4, 5.6), (0.3 * x, 1.0, 0.4), 2, 1 + 24 * k, True)
    for k, x in enumerate((-2.6, 2.6))
]

#: Place of the front truss, in metres, and its turn about the vertical in degrees: what hangs on it
#: is written in its own axes.
TRUSS_PLACE, TRUSS_TURN = (0.4, -2.5, 5.2), 12.0


def write_type(path: Path, kind: Kind) -> None:
    """Write the GDTF of a type."""
    made = pygdtf.FixtureType()
    made.manufacturer, _, made.name = kind.name.partition("@")
    made.long_name = made.short_name = made.description = made.name
    made.fixture_type_id = str(uuid.uuid5(NAMESPACE, kind.name)).upper()
    made.emitters = [_emitter(x) for x in kind.emitters]
    made.geometries = pygdtf.Geometries([_geometry(kind)])
    made.dmx_modes = pygdtf.DmxModes([_mode(kind)])
    functions = [
        function
        for channel in made.dmx_modes[0]._dmx_channels
        for function in channel.logical_channels[0].channel_functions
    ]
    names = dict.fromkeys(function.attribute.str_link for function in functions)
    made.attributes = [pygdtf.Attribute(name=name, pretty=name) for name in names]
    pygdtf.FixtureTypeWriter(made).write_gdtf(path)


def _emitter(emitter: Emitter) -> pygdtf.Emitter:
    made = pygdtf.Emitter(
        name=emitter.name,
        color=pygdtf.ColorCIE(emitter.x, emitter.y, emitter.luminance),
        dominant_wave_length=0.0,
    )
    measured = [pygdtf.Measurement(100.0, emitter.candela)] if emitter.candela else []
    made.measurements = measured
    return made


def _geometry(kind: Kind) -> pygdtf.Geometry:
    beam = pygdtf.GeometryBeam(
        name="Beam",
        position=_offset(-0.15 if kind.moves else -0.1),
        lamp_type=pygdtf.LampType("LED"),
        power_consumption=kind.watts,
        luminous_flux=kind.lumens,
        color_temperature=6500,
        beam_angle=kind.beam,
        field_angle=kind.field,
        beam_type=pygdtf.BeamType("Wash"),
    )
    if kind.moves:
        head = pygdtf.GeometryAxis(name="Head", position=_offset(-0.25), geometries=[beam])
        yoke = pygdtf.GeometryAxis(name="Yoke", position=_offset(-0.1), geometries=[head])
        beam = yoke
    return pygdtf.Geometry(name="Body", geometries=pygdtf.Geometries([beam]))


def _offset(z: float) -> pygdtf.Matrix:
    return pygdtf.Matrix(f"{{1,0,0,0}}{{0,1,0,0}}{{0,0,1,{z}}}{{0,0,0,1}}")


def _mode(kind: Kind) -> pygdtf.DmxMode:
    rows: list[tuple[str, str, int, str, tuple[float, float], str | None]] = []
    n, lamp = kind.byte_count, "Beam"
    if kind.moves:
        rows += [("Pan", "Yoke", 2, "32768/2", (270, -270), None)]
        rows += [("Tilt", "Head", 2, "32768/2", (-130, 130), None)]
        rows += [("Shutter1", lamp, 1, f"{OPEN}/1", (0, 1), None)]
    rows += [("Dimmer", lamp, n, f"0/{n}", (0, 1), None)]
    rows += [(f"ColorAdd_{x.suffix}", lamp, n, f"0/{n}", (0, 1), x.name) for x in kind.emitters]
    if kind.zoom is not None:
        start, end = kind.zoom
        rest = round(65535 * (kind.beam - start) / (end - start))
        rows += [("Zoom", lamp, 2, f"{rest}/2", kind.zoom, None)]
    channels, first = [], 1
    for attribute, geometry, count, default, physical, emitter in rows:
        offsets = [*range(first, first + count)]
        channels.append(_channel(attribute, geometry, offsets, default, physical, emitter))
        first += count
    return pygdtf.DmxMode(kind.mode, kind.mode, "Body", _dmx_channels=channels)


def _channel(
    attribute: str,
    geometry: str,
    offsets: list[int],
    default: str,
    physical: tuple[float, float],
    emitter: str | None,
) -> pygdtf.DmxChannel:
    link = pygdtf.NodeLink("Attributes", attribute)
    # What each range of levels does, from its first one: a shutter is closed, open, or flashes.
    ranges = [(f"{attribute} 1", attribute, 0, physical)]
    if attribute == "Shutter1":
        ranges = [("Closed", attribute, 0, (0, 0)), ("Open", attribute, OPEN, (1, 1))]
        ranges += [("Strobe", f"{attribute}Strobe", OPEN + 32, (1, 20))]
    functions = [
        pygdtf.ChannelFunction(
            name=name,
            attribute=pygdtf.NodeLink("Attributes", controlled),
            dmx_from=pygdtf.DmxValue(f"{first}/1"),
            default=pygdtf.DmxValue(default),
            physical_from=pygdtf.PhysicalValue(start),
            physical_to=pygdtf.PhysicalValue(end),
            emitter=pygdtf.NodeLink("EmitterCollect", emitter),
        )
        for name, controlled, first, (start, end) in ranges
    ]
    logical = pygdtf.LogicalChannel(attribute=link, channel_functions=functions)
    resting = "Open" if attribute == "Shutter1" else ranges[0][0]
    initial = pygdtf.NodeLink("", f"{geometry}_{attribute}.{attribute}.{resting}")
    return pygdtf.DmxChannel(
        *(1, offsets, None, link),
        initial_function=initial,
        geometry=geometry,
        logical_channels=[logical],
    )


def aimed(
    place: Sequence[float], target: Sequence[float], turn: float = 0.0
) -> NDArray[np.float64]:
    """Return a matrix of MVR, (4, 4), whose rows are axes and then the place, in metres: its −z
    points from `place` at `target`. turn: about that, in degrees.
    """
    down = np.subtract(target, place)
    w = -down / np.linalg.norm(down)
    u = np.cross([0.0, 1.0, 0.0] if abs(w[1]) < 0.9 else [1.0, 0.0, 0.0], w)
    u /= np.linalg.norm(u)
    v = np.cross(w, u)
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    matrix = np.eye(4)
    matrix[:3, :3], matrix[3, :3] = [c * u + s * v, c * v - s * u, w], place
    return matrix


def standing(place: Sequence[float], turn: float = 0.0) -> NDArray[np.float64]:
    """Return the matrix of what stands upright, turned about the vertical, in degrees."""
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    matrix = np.eye(4)
    matrix[:2, :2], matrix[3, :3] = [[c, s], [-s, c]], place
    return matrix


def written(matrix: NDArray[np.float64]) -> pymvr.Matrix:
    """Return a matrix as pymvr writes it: its place in millimetres."""
    rows = matrix.copy()
    rows[3, :3] *= 1000
    return pymvr.Matrix([[round(float(x), 9) for x in row] for row in rows])


def write_show(path: Path) -> None:
    """Write the MVR."""
    truss = standing(TRUSS_PLACE, TRUSS_TURN)
    inverse = np.linalg.inv(truss)
    # Row vectors: a place in the truss's axes, times its matrix, is one in the world.
    front = [(x, aimed(x.place, x.target, 30.0 * k) @ inverse) for k, x in enumerate(FRONT)]
    back = [(x, standing(x.place, 90.0)) for x in BACK]
    group = pymvr.GroupObject(
        name="Front truss",
        uuid=_id("Front truss"),
        matrix=written(truss),
        child_list=pymvr.ChildList(fixtures=[_fixture(*x) for x in front]),
    )
    focus = [
        pymvr.FocusPoint(
            uuid=_id(f"focus {x.number}"),
            name=f"Focus {x.name}",
            matrix=written(standing(x.target)),
        )
        for x in BACK
    ]
    children = pymvr.ChildList(
        group_objects=[group], fixtures=[_fixture(*x) for x in back], focus_points=focus
    )
    layer = pymvr.Layer(name="Rig", uuid=_id("Rig"), child_list=children)
    writer = pymvr.GeneralSceneDescriptionWriter()
    writer.serialize_scene(pymvr.Scene(layers=pymvr.Layers([layer])))
    with tempfile.TemporaryDirectory() as folder:
        for kind in (PAR, WASH):
            file = Path(folder) / kind.file
            write_type(file, kind)
            file.write_bytes(with_fixed_times(file.read_bytes()))
            writer.files_list.append((str(file), kind.file))
        writer.write_mvr(str(path))
    path.write_bytes(with_fixed_times(path.read_bytes()))


def _fixture(hung: Hung, matrix: NDArray[np.float64]) -> pymvr.Fixture:
    address = pymvr.Address(dmx_break=0, universe=hung.universe, address=hung.address)
    return pymvr.Fixture(
        name=hung.name,
        uuid=_id(f"{hung.number} {hung.name}"),
        gdtf_spec=hung.kind.file,
        gdtf_mode=hung.kind.mode,
        matrix=written(matrix),
        fixture_id=str(hung.number),
        fixture_id_numeric=hung.number,
        addresses=pymvr.Addresses(addresses=[address]),
        focus=_id(f"focus {hung.number}") if hung.has_focus else None,
    )


def _id(name: str) -> str:
    return str(uuid.uuid5(NAMESPACE, name)).upper()


def with_fixed_times(data: bytes) -> bytes:
    """Return an archive with the same files, whose times are all equal."""
    buffer = io.BytesIO()
    with (
        zipfile.ZipFile(io.BytesIO(data)) as old,
        zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as new,
    ):
        for name in old.namelist():
            new.writestr(zipfile.ZipInfo(name, TIME), old.read(name), zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


if __name__ == "__main__":
    write_show(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "show.mvr")
