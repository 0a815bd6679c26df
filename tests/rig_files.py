"""Shows (MVR) and types (GDTF) for tests, written as the standards have them, without a library."""

import importlib.util
import io
import zipfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import ModuleType

HERE = Path(__file__).parent

#: A place that is written without a turn: the beam points down.
UPRIGHT = "{1,0,0}{0,1,0}{0,0,1}"

BEAM = '<Beam Name="Beam" LuminousFlux="5000" BeamAngle="30" FieldAngle="45"/>'

RGBW = "".join(
    f'<Emitter Name="{name}" Color="{color}"/>'
    for name, color in {
        "Red": "0.69,0.309,20",
        "Green": "0.18,0.715,40",
        "Blue": "0.15,0.03,8",
        "White": "0.325,0.34,52",
    }.items()
)


def zipped(files: Mapping[str, bytes | str]) -> bytes:
    """An archive of files."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return buffer.getvalue()


def unzipped(data: bytes) -> dict[str, bytes]:
    """The files of an archive."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def channel(
    attribute: str,
    offsets: str,
    *,
    geometry: str = "Beam",
    default: str = "0/1",
    function: str = "",
    dmx_break: str = "1",
) -> str:
    """A channel of one function. function: further attributes of it."""
    return (
        f'<DMXChannel DMXBreak="{dmx_break}" Offset="{offsets}" Geometry="{geometry}" '
        f'InitialFunction="{geometry}_{attribute}.{attribute}.One"><LogicalChannel '
        f'Attribute="{attribute}"><ChannelFunction Name="One" Attribute="{attribute}" '
        f'DMXFrom="0/1" Default="{default}" {function}/></LogicalChannel></DMXChannel>'
    )


#: Dimmer, red, green, blue and white, of one byte each.
RGBW_CHANNELS = "".join(
    channel(attribute, str(k + 1))
    for k, attribute in enumerate(
        ("Dimmer", "ColorAdd_R", "ColorAdd_G", "ColorAdd_B", "ColorAdd_W")
    )
)


def gdtf(
    channels: str = RGBW_CHANNELS,
    *,
    geometries: str = f'<Geometry Name="Body">{BEAM}</Geometry>',
    described: str = f"<Emitters>{RGBW}</Emitters>",
    wheels: str = "",
    name: str = "Lamp",
    root: str = "Body",
) -> bytes:
    """A type with the mode `One`. described: its physical descriptions."""
    return zipped(
        {
            "description.xml": f'<GDTF DataVersion="1.2"><FixtureType Name="{name}">'
            f"<Wheels>{wheels}</Wheels>"
            f"<PhysicalDescriptions>{described}</PhysicalDescriptions>"
            f"<Geometries>{geometries}</Geometries>"
            f'<DMXModes><DMXMode Name="One" Geometry="{root}"><DMXChannels>{channels}'
            "</DMXChannels></DMXMode></DMXModes></FixtureType></GDTF>"
        }
    )


def fixture(
    name: str = "PAR",
    *,
    number: str = "1",
    address: str = "1",
    matrix: str = UPRIGHT + "{0,0,5000}",
    spec: str = "lamp.gdtf",
    mode: str = "One",
    more: str = "",
) -> str:
    """A fixture. address: absolute. more: further elements."""
    return (
        f'<Fixture name="{name}" uuid="{name}-{number}"><Matrix>{matrix}</Matrix>'
        f"<GDTFSpec>{spec}</GDTFSpec><GDTFMode>{mode}</GDTFMode><FixtureID>{number}</FixtureID>"
        f'<Addresses><Address break="0">{address}</Address></Addresses>{more}</Fixture>'
    )


def layered(*children: str, matrix: str = "") -> str:
    """A layer with these children."""
    place = f"<Matrix>{matrix}</Matrix>" if matrix else ""
    return f'<Layer name="L" uuid="L">{place}<ChildList>{"".join(children)}</ChildList></Layer>'


def write_mvr(path: Path, *layers: str, **files: bytes) -> Path:
    """A show with these layers, and GDTF files by their names without the ending."""
    types = {f"{name}.gdtf": data for name, data in (files or {"lamp": gdtf()}).items()}
    text = (
        '<?xml version="1.0" encoding="UTF-8"?><GeneralSceneDescription verMajor="1" verMinor="5">'
        f"<Scene><Layers>{''.join(layers)}</Layers></Scene></GeneralSceneDescription>"
    )
    path.write_bytes(zipped({"GeneralSceneDescription.xml": text, **types}))
    return path


@cache
def example_writer() -> ModuleType:
    """`scenes/rig/make_rig.py`."""
    file = HERE.parent / "scenes" / "rig" / "make_rig.py"
    spec = importlib.util.spec_from_file_location("make_rig", file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    # Its dataclasses look themselves up there.
    import sys

    sys.modules["make_rig"] = module
    spec.loader.exec_module(module)
    return module


#: The show that the writer has written.
EXAMPLE = HERE.parent / "scenes" / "rig" / "show.mvr"
