"""Colour wheels of GDTF, as pygdtf writes them: slots, their light, and their levels."""

from pathlib import Path
from typing import Any

import numpy as np
import pygdtf
import pytest
from rig_files import channel, fixture, gdtf, layered, write_mvr

from lightpaint.colour.color import matching_functions
from lightpaint.colour.lamp import Lamp, LampEmitter
from lightpaint.colour.luminous_flux import solid_angle
from lightpaint.colour.primaries import REC2020, rgb_to_xyz
from lightpaint.dmx.console_rig import ConsoleRig, RigLight
from lightpaint.dmx.gdtf.emitter_colour import rgb_of_xy, xy_of_kelvin
from lightpaint.dmx.gdtf.fixture_type import FixtureType
from lightpaint.dmx.gdtf.mode_lights import FixtureMode
from lightpaint.dmx.levels import DriveFade, check_drives, decode_levels, drives_of, encode_levels
from lightpaint.dmx.mvr import read_rig
from lightpaint.dmx.rig_scene import cd_per_unit, lights_text, scene_text
from lightpaint.lighting.answer.lighting import Lighting, LightSetting
from lightpaint.lighting.constraints.constraint_table import LightConstraint
from lightpaint.relit.export.rig_files import Cue, cue_list_csv, level_rows

#: Name, colour under D65, and the levels of each slot.
SLOTS = (
    ("Open", (0.3127, 0.3290, 100.0), 0),
    ("Red", (0.68, 0.31, 9.0), 10),
    ("Amber", (0.52, 0.44, 55.0), 20),
    ("Blue", (0.15, 0.07, 5.0), 30),
)

#: Level at which the wheel begins to spin.
SPIN = 128

#: Kelvin and lumens of the lamp.
KELVIN, LUMENS = 6500, 20_000.0


def _set(name: str, level: int, slot: int, *physical: float) -> Any:
    ends = [pygdtf.PhysicalValue(x) for x in physical] or [pygdtf.PhysicalValue(None)] * 2
    start = pygdtf.DmxValue(f"{level}/1")
    return pygdtf.ChannelSet(name, start, start, *ends, slot)


def _function(name: str, attribute: str, level: int, sets: list[Any]) -> Any:
    return pygdtf.ChannelFunction(
        name=name,
        attribute=pygdtf.NodeLink("Attributes", attribute),
        dmx_from=pygdtf.DmxValue(f"{level}/1"),
        default=pygdtf.DmxValue("0/1"),
        wheel=pygdtf.NodeLink("WheelCollect", "Wheel 1"),
        channel_sets=sets,
    )


def _channel(attribute: str, offsets: list[int], functions: list[Any], default: str = "0/1") -> Any:
    link = pygdtf.NodeLink("Attributes", attribute)
    logical = pygdtf.LogicalChannel(attribute=link, channel_functions=functions)
    functions[0].default = pygdtf.DmxValue(default)
    return pygdtf.DmxChannel(
        *(1, offsets, None, link),
        initial_function=pygdtf.NodeLink("", f"Beam_{attribute}.{attribute}.{functions[0].name}"),
        geometry="Beam",
        logical_channels=[logical],
    )


def wheel_type(
    path: Path,
    *,
    sets: list[Any] | None = None,
    slots: list[Any] | None = None,
    filters: list[Any] | None = None,
    more: list[Any] | None = None,
    size: int = 1,
) -> bytes:
    """A profile spot with a discharge lamp, a dimmer and a wheel, as pygdtf writes it."""
    made = pygdtf.FixtureType()
    made.name = made.long_name = made.short_name = "Profile"
    made.manufacturer, made.description = "Example", ""
    made.fixture_type_id = "5B0B6F5C-6A39-4B8E-9F6E-3D4D2F6B7C11"
    beam = pygdtf.GeometryBeam(
        name="Beam",
        lamp_type=pygdtf.LampType("Discharge"),
        power_consumption=700.0,
        luminous_flux=LUMENS,
        color_temperature=KELVIN,
        beam_angle=18.0,
        field_angle=26.0,
        beam_type=pygdtf.BeamType("Spot"),
    )
    made.geometries = pygdtf.Geometries(
        [pygdtf.Geometry(name="Body", geometries=pygdtf.Geometries([beam]))]
    )
    own = [pygdtf.WheelSlot(name, pygdtf.ColorCIE(*color)) for name, color, _ in SLOTS]
    made.wheels = [pygdtf.Wheel("Wheel 1", own if slots is None else slots)]
    made.filters = filters or []
    chosen = [_set(name, level, k) for k, (name, _, level) in enumerate(SLOTS, start=1)]
    wheel = [
        _function("Colours", "Color1", 0, chosen if sets is None else sets),
        _function("Rainbow", "Color1WheelSpin", SPIN, []),
    ]
    dimmer = pygdtf.ChannelFunction(
        name="Dimmer 1", attribute=pygdtf.NodeLink("Attributes", "Dimmer")
    )
    offsets = [*range(3, 3 + size)]
    channels = [_channel("Dimmer", [1, 2], [dimmer]), _channel("Color1", offsets, wheel)]
    channels += more or []
    made.dmx_modes = pygdtf.DmxModes([pygdtf.DmxMode("One", "", "Body", _dmx_channels=channels)])
    made.attributes = [
        pygdtf.Attribute(name=name, pretty=name) for name in ("Dimmer", "Color1", "Color1WheelSpin")
    ]
    pygdtf.FixtureTypeWriter(made).write_gdtf(path / "lamp.gdtf")
    return (path / "lamp.gdtf").read_bytes()


def read_mode(data: bytes, *, pixels: bool = False) -> FixtureMode:
    return FixtureType(data, "lamp.gdtf").mode("One", pixels=pixels)


def wheel_rig(tmp_path: Path, **options: Any) -> ConsoleRig:
    data = wheel_type(tmp_path, **options)
    return read_rig(
        write_mvr(tmp_path / "a.mvr", layered(fixture("Spot", address="11")), lamp=data)
    )


def _light(rig: ConsoleRig) -> RigLight:
    return rig.fixtures[0].lights[0]


def _xyz(xy: Any) -> Any:
    x, y = xy
    return np.array([x / y, 1.0, (1 - x - y) / y])


def test_slots_are_emitters_of_the_whole_lamp_in_turn(tmp_path: Path) -> None:
    mode = read_mode(wheel_type(tmp_path))
    [light] = mode.lights
    assert [x.name for x in light.emitters] == ["open", "red", "amber", "blue"]
    assert light.wheel is not None
    # The middle of each slot's levels; the last ends where the wheel spins.
    assert [x.level for [x] in light.wheel.slots] == [4, 14, 24, 78]
    assert [(x.first, x.last) for [x] in light.wheel.slots] == [
        (0, 9),
        (10, 19),
        (20, 29),
        (30, 127),
    ]
    full = LUMENS / solid_angle(18, 26)
    # Y of a slot is relative to the lamp's light (DIN SPEC 15800, Slot).
    assert [x.candela / full for x in light.emitters] == pytest.approx([1, 0.09, 0.55, 0.05])
    assert [x.watts for x in light.emitters] == [700.0] * 4
    assert mode.emission == "LuminousFlux"
    assert "Color1 is a wheel of 4 colours, one at a time" in mode.remarks
    assert not any("at rest" in x for x in mode.remarks)


def test_an_open_slot_has_the_white_of_the_lamp(tmp_path: Path) -> None:
    open_slot, red, amber, blue = read_mode(wheel_type(tmp_path)).lights[0].emitters
    assert open_slot.xy == pytest.approx(xy_of_kelvin(KELVIN), abs=1e-6)
    # 6500 K is nearly D65, under which the file gives its colours.
    for slot, (_, (x, y, _), _) in zip((red, amber, blue), SLOTS[1:], strict=True):
        assert slot.xy == pytest.approx((x, y), abs=0.01)


def test_a_measured_filter_is_the_product_of_both_spectra(tmp_path: Path) -> None:
    waves = np.arange(400.0, 701.0, 10.0)
    passed = np.where(waves > 600, 0.9, 0.05)
    points = [
        pygdtf.MeasurementPoint(wave, energy) for wave, energy in zip(waves, passed, strict=True)
    ]
    measured = pygdtf.Measurement(100.0, 0.0, 21.0)
    measured.measurement_points = points
    filters = [pygdtf.Filter("Deep", None, [measured])]
    link = pygdtf.NodeLink("FilterCollect", "Deep")
    slots = [
        pygdtf.WheelSlot("Open", pygdtf.ColorCIE(0.3127, 0.3290, 100)),
        pygdtf.WheelSlot("Deep", None, link),
    ]
    sets = [_set("Open", 0, 1), _set("Deep", 10, 2)]
    data = wheel_type(tmp_path, slots=slots, sets=sets, filters=filters)
    _, deep = read_mode(data).lights[0].emitters
    metres, observer = matching_functions()
    grid = metres * 1e9
    planck = metres**-5 / np.expm1(0.014388 / (metres * KELVIN))
    xyz = (np.interp(grid, waves, passed, left=0, right=0) * planck) @ observer
    assert deep.xy == pytest.approx(tuple(xyz[:2] / xyz.sum()), abs=1e-6)  # as files round
    assert deep.candela == pytest.approx(0.21 * LUMENS / solid_angle(18, 26))


def test_a_filter_cannot_be_brighter_than_its_colour_allows(tmp_path: Path) -> None:
    """Editors write a Y of 100 for every slot, and some none at all."""
    for percent in (100.0, 0.0):
        slots = [pygdtf.WheelSlot(x, pygdtf.ColorCIE(*xy[:2], percent)) for x, xy, _ in SLOTS]
        emitters = read_mode(wheel_type(tmp_path, slots=slots)).lights[0].emitters
        shares = [x.candela / emitters[0].candela for x in emitters]
        assert shares[0] == 1
        assert 0.2 < shares[1] < 0.35  # all the red of a white
        assert 0.04 < shares[3] < 0.12


def test_split_colours_and_spins_are_never_chosen(tmp_path: Path) -> None:
    sets = [
        _set("Open", 0, 1),
        _set("Open/Red", 5, 2),
        _set("Red", 10, 2),
        _set("Red + Amber", 15, 2),
        _set("Half amber", 20, 3, 0.5, 0.5),
        _set("Amber", 25, 3, 0, 0),
        _set("Spin", 120, 0),
    ]
    wheel = read_mode(wheel_type(tmp_path, sets=sets)).lights[0].wheel
    assert wheel is not None
    assert [(x.first, x.last) for [x] in wheel.slots] == [(0, 4), (10, 14), (25, 119)]


def test_a_wheel_that_turns_evenly_stops_at_its_slots(tmp_path: Path) -> None:
    """From half a slot before to half a slot behind, in 16 bits."""
    sets = [_set("Open", 0, 1, -0.5, 0.5), _set("Red", 32, 2, -0.5, 0.5)]
    wheel = read_mode(wheel_type(tmp_path, sets=sets, size=2)).lights[0].wheel
    assert wheel is not None
    half_way = [(0 + 32 * 256 - 1) / 2, (32 * 256 + SPIN * 256 - 1) / 2]
    assert [x.level for [x] in wheel.slots] == pytest.approx(half_way, abs=0.51)


def test_slots_without_a_name_or_of_the_same_one_are_numbered(tmp_path: Path) -> None:
    slots = [
        pygdtf.WheelSlot(name, pygdtf.ColorCIE(*color))
        for name, (_, color, _) in zip(("Open", "Red", "red", ""), SLOTS, strict=True)
    ]
    sets = [_set("", 10 * k, k + 1) for k in range(4)]
    light = read_mode(wheel_type(tmp_path, slots=slots, sets=sets)).lights[0]
    assert [x.name for x in light.emitters] == ["open", "red", "red 3", "slot 4"]


@pytest.mark.parametrize("slot", [x.lower() for x, _, _ in SLOTS])
@pytest.mark.parametrize("drive", [1.0, 0.37])
def test_levels_of_a_slot_come_back(tmp_path: Path, slot: str, drive: float) -> None:
    rig = wheel_rig(tmp_path)
    light = _light(rig)
    levels = encode_levels(rig, {light.name: {slot: drive}})
    index = [x.name for x in light.emitters].index(slot)
    assert light.wheel is not None
    assert levels[1][12] == light.wheel.slots[index][0].level
    assert int.from_bytes(levels[1][10:12], "big") == round(drive * 65535)
    expected = dict.fromkeys([x.name for x in light.emitters], 0.0) | {slot: drive}
    assert decode_levels(rig, levels)[light.name] == pytest.approx(expected, abs=1 / 65535)


def test_of_two_drives_the_larger_one_is_shown(tmp_path: Path) -> None:
    rig = wheel_rig(tmp_path)
    levels = encode_levels(rig, {_light(rig).name: {"red": 0.4, "blue": 0.6}})
    assert decode_levels(rig, levels)[_light(rig).name]["blue"] == pytest.approx(0.6, abs=1e-4)


def test_a_dark_wheel_rests_and_a_spinning_one_has_no_drive(tmp_path: Path) -> None:
    rig = wheel_rig(tmp_path)
    assert encode_levels(rig, {}) == dict(rig.rest)
    levels = bytearray(encode_levels(rig, {_light(rig).name: {"red": 1.0}})[1])
    levels[12] = SPIN + 10
    assert not any(decode_levels(rig, {1: bytes(levels)})[_light(rig).name].values())


def test_the_lights_file_has_the_slots(tmp_path: Path) -> None:
    import tomllib

    rig = wheel_rig(tmp_path)
    table = tomllib.loads(lights_text(rig, 100))["light"]["1 Spot"]
    assert table["wheel"] is True
    assert [x["name"] for x in table["emitters"]] == ["open", "red", "amber", "blue"]
    assert {x["bits"] for x in table["emitters"]} == {16}  # of the dimmer
    left_open = tomllib.loads(lights_text(rig, 100, open_wheels=True))["light"]["1 Spot"]
    assert left_open["wheel"] == "open"
    # The light begins at half of its open light, and not of the sum of all slots.
    unit = cd_per_unit(rig)
    level = 0.5 * _light(rig).emitters[0].candela / unit
    assert f'<rgb name="intensity" value="{level:.6g}"/>' in scene_text(rig, unit, None)


def test_tables_and_cues_have_the_wheel(tmp_path: Path) -> None:
    rig = wheel_rig(tmp_path)
    drives = {_light(rig).name: {"amber": 0.5}}
    rows = {x.emitter: x for x in level_rows(rig, drives, {1: 1})}
    assert (rows["wheel"].channels, rows["wheel"].value) == ((13,), 24)
    assert rows["amber"].drive == 0.5
    assert rows["amber"].value is None
    lines = cue_list_csv(rig, [Cue("look", 2, drives)]).splitlines()
    assert f"1,look,2,1,Color1,{round(24 / 255 * 65535)}" in lines


def test_without_an_address_a_wheel_stays_a_wheel(tmp_path: Path) -> None:
    data = wheel_type(tmp_path)
    rig = read_rig(write_mvr(tmp_path / "a.mvr", layered(fixture(address="0")), lamp=data))
    assert "wheel = true" in lights_text(rig, 100)
    assert encode_levels(rig, {"1 PAR": {"red": 1.0}}) == {}
    [row] = level_rows(rig, {"1 PAR": {"red": 1.0}}, {})
    assert (row.emitter, row.value) == ("red", None)


MIXING = "".join(channel(f"ColorAdd_{x}", str(k)) for k, x in enumerate("RGB", start=2))
WHEEL = channel("Color1", "5", function='Wheel="Wheel 1"')


def _wheel_of(name: str, *slots: tuple[str, str]) -> str:
    """A wheel of slots by name and colour."""
    inside = "".join(f'<Slot Name="{slot}" Color="{color}"/>' for slot, color in slots)
    return f'<Wheel Name="{name}">{inside}</Wheel>'


def _turning(attribute: str, offset: str, wheel: str, count: int) -> str:
    """A channel with a set of ten levels for each slot of a wheel."""
    sets = "".join(
        f'<ChannelSet Name="s{k}" DMXFrom="{10 * k}/1" WheelSlotIndex="{k + 1}"/>'
        for k in range(count)
    )
    one = channel(attribute, offset, function=f'Wheel="{wheel}"')
    return one.replace("/></LogicalChannel>", f">{sets}</ChannelFunction></LogicalChannel>")


WHEELS = _wheel_of(
    "W1", ("Open", "0.3127,0.3290,100"), ("Red", "0.68,0.31,9"), ("Blue", "0.15,0.07,5")
) + _wheel_of("W2", ("Open", "0.3127,0.3290,100"), ("Red", "0.6,0.33,20"), ("Half", "0.38,0.38,60"))
TURNING = _turning("Color1", "6", "W1", 3) + _turning("Color2", "7", "W2", 3)
LAMP = (
    '<Geometry Name="Body"><Beam Name="Beam" LuminousFlux="5000" BeamAngle="30" FieldAngle="45" '
    'ColorTemperature="6500" PowerConsumption="300"/></Geometry>'
)


def _rig_of(tmp_path: Path, data: bytes) -> ConsoleRig:
    show = write_mvr(tmp_path / "a.mvr", layered(fixture("Spot", address="11")), lamp=data)
    return read_rig(show, usual_colors=True)


def test_slots_of_two_wheels_multiply(tmp_path: Path) -> None:
    data = gdtf(channel("Dimmer", "1") + TURNING, geometries=LAMP, wheels=WHEELS)
    rig = _rig_of(tmp_path, data)
    light = _light(rig)
    by_name = {x.name: x for x in light.emitters}
    several = ["red + half", "red + red", "blue + half", "blue + red"]  # the brightest first
    assert [*by_name] == ["open", "red", "blue", "red (2)", "half", *several]
    both = by_name["blue + half"]
    wide, full = rgb_to_xyz(REC2020), by_name["open"].candela
    lamp = np.linalg.solve(wide, _xyz(xy_of_kelvin(6500)))

    def passed(name: str) -> Any:
        share = by_name[name].candela / full
        return np.clip(share * np.linalg.solve(wide, _xyz(by_name[name].xy)) / lamp, 0, 1)

    xyz = wide @ (np.maximum(passed("blue") * passed("half"), 1e-4) * lamp)
    assert both.candela / full == pytest.approx(xyz[1], rel=1e-9)
    assert both.xy == pytest.approx(tuple(xyz[:2] / xyz.sum()), abs=1e-9)
    for name in by_name:
        levels = encode_levels(rig, {light.name: {name: 0.6}})
        found = decode_levels(rig, levels)[light.name]
        assert {x for x, drive in found.items() if drive} == {name}
    assert [*encode_levels(rig, {light.name: {"blue + half": 1.0}})[1][15:17]] == [137, 137]


BESIDE = {
    "emitters": channel("Dimmer", "1") + MIXING,
    "filters": channel("Dimmer", "1")
    + "".join(channel(f"ColorSub_{x}", str(k)) for k, x in enumerate("CMY", start=2)),
    "whites": channel("Dimmer", "1")
    + channel("CTO", "2,3", function='PhysicalFrom="6500" PhysicalTo="2800"'),
}


@pytest.mark.parametrize("kind", BESIDE)
def test_wheels_in_front_of_what_a_lamp_mixes_filter_it(tmp_path: Path, kind: str) -> None:
    import tomllib

    rig = _rig_of(tmp_path, gdtf(BESIDE[kind] + TURNING, geometries=LAMP, wheels=WHEELS))
    light = _light(rig)
    assert light.wheel is not None
    first, *others = light.wheel.filters
    assert first.is_open
    assert not any(x.is_open for x in others)
    table = tomllib.loads(lights_text(rig, 100))["light"]["1 Spot"]
    assert [x["name"] for x in table["wheel"]] == [x.name for x in light.wheel.filters]
    assert "wheel" not in tomllib.loads(lights_text(rig, 100, open_wheels=True))["light"]["1 Spot"]
    [constraint] = [LightConstraint.of(table)]
    assert [x.name for x in constraint.slots] == [x["name"] for x in table["wheel"]]
    # A slot has a drive of its own, beside those of emitters; without one the wheels are open.
    drives = {x.name: 0.4 for x in light.emitters}
    for name in ("blue", "red + half", ""):
        sent = {**drives, **({f"wheel {name}": 1.0} if name else {})}
        check_drives(rig, {light.name: sent})
        levels = encode_levels(rig, {light.name: sent})
        found = decode_levels(rig, levels)[light.name]
        shown = [x for x in found if x.startswith("wheel ")]
        assert shown == [f"wheel {name or 'open'}"]
        assert [found[x.name] for x in light.emitters] == pytest.approx(
            [0.4] * len(drives), abs=0.02
        )
    assert [*levels[1][15:17]] == [0, 0]  # where they rest, which is open
    [*rows] = [x for x in level_rows(rig, {light.name: sent}, {1: 1}) if x.emitter == "wheel"]
    assert [x.channels for x in rows] == [(16,), (17,)]


@pytest.mark.parametrize("kind", ["emitters", "filters"])
def test_a_cto_beside_what_mixes_its_whites_rests(kind: str, tmp_path: Path) -> None:
    """Whatever such a filter leaves of full drives, less of each drive is the same light."""
    cto = channel("CTO", "8,9", function='PhysicalFrom="6500" PhysicalTo="2800"')
    mode = read_mode(gdtf(BESIDE[kind] + cto, geometries=LAMP))
    assert mode.lights[0].wheel is None
    assert "at rest: CTO" in mode.remarks
    columns = np.array([rgb_of_xy(x.xy) * x.candela for x in mode.lights[0].emitters])
    full = columns.sum(axis=0)
    for kelvin in (2800, 3200, 4200, 5600):
        filtered = rgb_of_xy(xy_of_kelvin(kelvin))
        # No channel has more light than the lamp.
        filtered *= (full / filtered).min()
        drives = np.linalg.solve(columns.T, filtered)
        assert (drives >= 0).all()
        assert (drives <= 1 + 1e-9).all()


def test_very_many_combinations_are_left_out(tmp_path: Path) -> None:
    """Nine wheels of 25 slots have four million million combinations."""
    slots = [(f"S{k}", f"0.3,0.{300 + k},90") for k in range(40)]
    wheels = "".join(_wheel_of(f"W{j}", *slots) for j in range(9))
    turning = "".join(_turning(f"Color{j + 1}", str(10 + j), f"W{j}", 25) for j in range(9))
    data = gdtf(channel("Dimmer", "1") + turning, geometries=LAMP, wheels=wheels)
    assert len(_light(_rig_of(tmp_path, data)).emitters) == 40


def test_of_several_slots_alike_the_brightest_remains(tmp_path: Path) -> None:
    grey = _wheel_of("W2", ("Open", "0.3127,0.3290,100"), ("Grey", "0.3127,0.3290,50"))
    wheels = _wheel_of("W1", ("Open", "0.3127,0.3290,100"), ("Red", "0.68,0.31,9")) + grey
    turning = _turning("Color1", "6", "W1", 2) + _turning("Color2", "7", "W2", 2)
    data = gdtf(channel("Dimmer", "1") + turning, geometries=LAMP, wheels=wheels)
    assert [x.name for x in _light(_rig_of(tmp_path, data)).emitters] == ["open", "red", "grey"]


def test_a_fade_turns_a_wheel_in_its_middle(tmp_path: Path) -> None:
    rig = _rig_of(tmp_path, gdtf(BESIDE["emitters"] + TURNING, geometries=LAMP, wheels=WHEELS))
    name = _light(rig).name
    fade = DriveFade(
        {name: {"red": 1.0, "wheel red": 1.0}}, {name: {"red": 1.0, "wheel blue": 1.0}}, 0, 2
    )
    levels = [encode_levels(rig, fade.at(now))[1][15] for now in (0, 0.9, 1.1, 2)]
    assert levels == [14, 14, 137, 137]


def test_an_answer_sends_the_slot_in_front_of_its_emitters(tmp_path: Path) -> None:
    rig = _rig_of(tmp_path, gdtf(BESIDE["emitters"] + TURNING, geometries=LAMP, wheels=WHEELS))
    slot = _light(rig).wheel.filters[3]
    lamp = Lamp((LampEmitter("red", (1, 0, 0)), LampEmitter("green", (0, 1, 0)))).behind_slot(slot)
    emission = tuple(lamp.mix(np.array([0.5, 0.2])).tolist())
    light = LightSetting("1 Spot", "spot", "intensity", "W/sr", emission, emission, lamp=lamp)
    drives = drives_of(Lighting((light,)))["1 Spot"]
    assert drives == pytest.approx({"red": 0.5, "green": 0.2, f"wheel {slot.name}": 1.0})


def test_a_wheel_without_slots_rests() -> None:
    for more in ("", MIXING):
        mode = read_mode(gdtf(channel("Dimmer", "1") + more + WHEEL))
        assert mode.lights[0].wheel is None
        assert "at rest: Color1" in mode.remarks
