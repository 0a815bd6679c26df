"""Shows and types with values of another form: each is read, or is one line."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from nightly import nightly
from rig_files import RGBW_CHANNELS, channel, fixture, gdtf, layered, unzipped, write_mvr, zipped

from lightpaint.dmx.mvr import read_rig
from lightpaint.errors import LightpaintError

#: Values that no attribute has, or only some.
ODD = ("", "x", "-1", "nan", "1e999", "99999999999", "1,2", "a.b.c")

#: A type with much of what types have.
DESCRIBED = (
    '<Emitters><Emitter Name="Red" Color="0.69,0.3,20"/><Emitter Name="White" '
    'DominantWaveLength="0"><Measurement Physical="100" LuminousIntensity="900" '
    'InterpolationTo="Linear"><MeasurementPoint WaveLength="450" Energy="1"/><MeasurementPoint '
    'WaveLength="600" Energy="2"/></Measurement></Emitter></Emitters><DMXProfiles><DMXProfile '
    'Name="P"><Point DMXPercentage="0" CFC0="0" CFC1="1"/></DMXProfile></DMXProfiles>'
)
GEOMETRIES = (
    '<Geometry Name="Cell"><Beam Name="Beam" LuminousFlux="5000" BeamAngle="30" FieldAngle="40" '
    'PowerConsumption="90" ColorTemperature="6000" BeamType="Wash"/></Geometry>'
    '<Geometry Name="Body" Position="{1,0,0,0}{0,1,0,0}{0,0,1,0}{0,0,0,1}"><GeometryReference '
    'Name="R" Geometry="Cell"><Break DMXBreak="1" DMXOffset="1"/></GeometryReference></Geometry>'
)
CHANNELS = (
    RGBW_CHANNELS.replace("<ChannelFunction", '<ChannelFunction DMXProfile="P"')
    + channel("Zoom", "6,7", function='PhysicalFrom="10" PhysicalTo="50"')
    + channel("Shutter1", "8", default="32/1")
)

#: A type with a colour wheel.
WHEELS = (
    '<Wheel Name="W"><Slot Name="Open" Color="0.3127,0.3290,100"/><Slot Name="Red" '
    'Filter="F"/></Wheel>'
)
FILTERS = (
    '<Filters><Filter Name="F" Color="0.6,0.3,9"><Measurement Physical="100" Transmission="20">'
    '<MeasurementPoint WaveLength="450" Energy="0.1"/><MeasurementPoint WaveLength="650" '
    'Energy="0.9"/></Measurement></Filter></Filters>'
)
WHEEL_CHANNELS = channel("Dimmer", "1", geometry="Cell") + channel(
    "Color1", "2", geometry="Cell", function='Wheel="W"'
).replace(
    "/></LogicalChannel>",
    '><ChannelSet Name="Open" DMXFrom="0/1" WheelSlotIndex="1"/><ChannelSet Name="Red" '
    'DMXFrom="9/1" PhysicalFrom="-0.5" PhysicalTo="0.5" WheelSlotIndex="2"/></ChannelFunction>'
    "</LogicalChannel>",
)
TYPES = {
    "mixing": gdtf(CHANNELS, geometries=GEOMETRIES, described=DESCRIBED),
    "wheel": gdtf(WHEEL_CHANNELS, geometries=GEOMETRIES, described=FILTERS, wheels=WHEELS),
}


def _texts(text: str) -> Iterator[str]:
    """The text with each value replaced by each odd one."""
    for match in re.finditer(r'(?<==")[^"]*(?=")|(?<=>)[^<>]+(?=<)', text):
        for value in ODD:
            yield text[: match.start()] + value + text[match.end() :]


@pytest.mark.parametrize("kind", TYPES)
@pytest.mark.parametrize("step", [7, nightly(1)])
def test_types_with_odd_values_are_read_or_are_one_line(
    step: int, kind: str, tmp_path: Path
) -> None:
    data = TYPES[kind]
    path, text = tmp_path / "a.mvr", unzipped(data)["description.xml"].decode()
    show = write_mvr(path, layered(fixture()), lamp=data)
    assert read_rig(show, usual_colors=True).fixtures
    for odd in [*_texts(text)][::step]:
        damaged = zipped({"description.xml": odd})
        _read(write_mvr(path, layered(fixture()), lamp=damaged))


@pytest.mark.parametrize("step", [3, nightly(1)])
def test_shows_with_odd_values_are_read_or_are_one_line(step: int, tmp_path: Path) -> None:
    box = (
        '<SceneObject name="s"><Matrix>{1,0,0}{0,1,0}{0,0,1}{0,0,0}</Matrix><Geometries>'
        '<Geometry3D fileName="a.glb"/></Geometries></SceneObject>'
    )
    text = layered(fixture(more="<Focus>F</Focus>"), box)
    for odd in [*_texts(text)][::step]:
        _read(write_mvr(tmp_path / "a.mvr", odd))


def _read(path: Path) -> None:
    try:
        rig = read_rig(path, pixels=True, usual_colors=True)
    except LightpaintError:
        return
    for light in (light for x in rig.fixtures for light in x.lights):
        numbers = (*light.position, *light.direction, light.beam_angle, light.field_angle)
        emitted = [(*x.xy, x.candela) for x in light.emitters]
        assert np.isfinite(numbers).all()
        assert np.isfinite(emitted).all()
