"""Levels and drives are inverse to each other, however a light mixes its colour."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rig_files import channel, fixture, gdtf, layered, write_mvr

from lightpaint.colour.color import cct_and_duv
from lightpaint.dmx.console_rig import (
    ConsoleRig,
    DmxChannel,
    RigEmitter,
    RigFilter,
    RigFixture,
    RigLight,
)
from lightpaint.dmx.gdtf.emitter_colour import rgb_of_xy, xy_of_kelvin
from lightpaint.dmx.levels import can_invert, decode_levels, encode_levels
from lightpaint.dmx.mvr import read_rig
from lightpaint.dmx.rig_scene import lights_text

#: Half a step of 16 bits, over the steepest of the curves and filters here.
ROUNDING = 1e-3

SHARES = st.floats(0, 1)
DRIVES = st.tuples(SHARES, SHARES, SHARES)

#: Filters that each take a little of the other channels, too.
CYAN, MAGENTA, YELLOW = (4.0, 0.3, 0.1), (0.2, 4.5, 0.3), (0.05, 0.2, 4.0)


def rig_of(count: int, **fields: object) -> ConsoleRig:
    """A fixture with so many channels of 16 bits, and one light of red, green and blue."""
    corners = {"red": (0.64, 0.33), "green": (0.30, 0.60), "blue": (0.15, 0.06)}
    candelas = (212.6, 715.2, 72.2)
    emitters = tuple(
        RigEmitter(name, xy, candela, ())
        for (name, xy), candela in zip(corners.items(), candelas, strict=True)
    )
    places = ((0.0, 0.0, 3.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0))
    light = replace(RigLight("a", *places, 20.0, 30.0, emitters), **fields)  # type: ignore[arg-type]
    channels = tuple(DmxChannel("X", "B", (2 * k + 1, 2 * k + 2)) for k in range(count))
    return ConsoleRig("a.mvr", (RigFixture("1", "a", "A", "M", {1: 1}, channels, (light,)),))


def sent(rig: ConsoleRig, drives: tuple[float, float, float]) -> np.ndarray:
    names = ("red", "green", "blue")
    values = dict(zip(names, drives, strict=True))
    return np.array([*decode_levels(rig, encode_levels(rig, {"a": values}))["a"].values()])


def filtered(dimmers: tuple[int, ...] = (3,)) -> ConsoleRig:
    filters = tuple(
        RigFilter(name, density, (k,))
        for k, (name, density) in enumerate(
            {"cyan": CYAN, "magenta": MAGENTA, "yellow": YELLOW}.items()
        )
    )
    return rig_of(4, filters=filters, dimmers=dimmers)


@given(SHARES, SHARES, SHARES, st.floats(0.01, 1))
def test_what_filters_can_make_comes_back(c: float, m: float, y: float, dimmer: float) -> None:
    rig = filtered()
    density = np.array([CYAN, MAGENTA, YELLOW]).T
    drives = dimmer * np.exp(-density @ [c, m, y])
    red, green, blue = drives.tolist()
    assert np.allclose(sent(rig, (red, green, blue)), drives, atol=ROUNDING * dimmer + 2e-5)


def test_filters_are_out_as_far_as_they_can_be() -> None:
    levels = encode_levels(filtered(), {"a": {"red": 0.5, "green": 0.5, "blue": 0.5}})[1]
    assert levels[:6] == bytes(6)
    assert int.from_bytes(levels[6:8], "big") == 32768
    assert encode_levels(filtered(), {})[1][6:8] == bytes(2)


def test_filters_that_are_alike_cannot_be_told_apart() -> None:
    assert can_invert([CYAN, MAGENTA, YELLOW])
    assert not can_invert([CYAN, (3.9, 0.3, 0.1), YELLOW])


@given(DRIVES)
def test_what_x_and_y_name_comes_back(drives: tuple[float, float, float]) -> None:
    """The bytes of x and y are coarse where there is hardly any light."""
    rig = rig_of(3, chromaticity=(0, 1), dimmers=(2,))
    level = float(np.dot([0.2126, 0.7152, 0.0722], drives))
    tolerance = ROUNDING * (1 + 4 * level) + (1 if level < 2e-5 else 0)
    assert np.allclose(sent(rig, drives), drives, atol=tolerance)


@given(DRIVES)
def test_what_emitters_mix_comes_back_through_curves_and_dimmers(
    drives: tuple[float, float, float],
) -> None:
    rig = rig_of(6, dimmers=(3, 4), masters=(5,))
    [one] = rig.fixtures
    falling = ((1.0, 0.0), (0.6, 0.4), (0.2, 1.0))
    channels = [replace(x, curve=falling) if k in (1, 3) else x for k, x in enumerate(one.channels)]
    [light] = one.lights
    bent = ((0.0, 0.0), (0.5, 0.8), (1.0, 1.0))
    emitters = tuple(
        replace(x, channels=(k,), curve=bent if k == 2 else ())
        for k, x in enumerate(light.emitters)
    )
    made = replace(one, channels=tuple(channels), lights=(replace(light, emitters=emitters),))
    assert np.allclose(sent(ConsoleRig("a", (made,)), drives), drives, atol=1e-4)


def whites(tmp_path: Path, function: str, more: str = "", beam: str = "") -> ConsoleRig:
    """A lamp of one colour with a dimmer and a colour temperature of 16 bits each."""
    channels = channel("Dimmer", "1,2") + channel("CTO", "3,4", function=function) + more
    geometry = (
        '<Geometry Name="Body"><Beam Name="Beam" LuminousFlux="5000" BeamAngle="30" '
        f'FieldAngle="45" PowerConsumption="300" ColorTemperature="6500" {beam}/></Geometry>'
    )
    data = gdtf(channels, geometries=geometry, described="")
    show = write_mvr(tmp_path / "a.mvr", layered(fixture()), lamp=data)
    return read_rig(show, usual_colors=True)


@pytest.mark.parametrize(
    "function",
    [
        'PhysicalFrom="6500" PhysicalTo="2800"',
        'PhysicalFrom="2800" PhysicalTo="6500"',
        'PhysicalFrom="2800" PhysicalTo="6500" DMXInvert="Yes"',
    ],
)
def test_a_colour_temperature_mixes_its_coolest_and_its_warmest_white(
    function: str, tmp_path: Path
) -> None:
    rig = whites(tmp_path, function)
    [light] = rig.fixtures[0].lights
    assert [x.name for x in light.emitters] == ["cool white", "warm white"]
    for emitter, kelvin in zip(light.emitters, (6500, 2800), strict=True):
        assert np.allclose(emitter.xy, xy_of_kelvin(kelvin))
        assert emitter.watts == 300
    # A filter to 2800 K lets all the red through. Of 6500 K, red has 1/1.93 of what 2800 K has at
    # equal luminance (Planck's law in Rec.709).
    cool, warm = (x.candela for x in light.emitters)
    reds = [rgb_of_xy(x.xy)[0] for x in light.emitters]
    assert warm / cool == pytest.approx(reds[0] / reds[1])
    assert 0.5 < warm / cool < 0.6
    # Of one dimmer: drives of 1 together.
    assert "power_share = 0.5" in lights_text(rig, 100)


@given(total=SHARES, share=SHARES)
def test_drives_of_whites_come_back_from_dimmer_and_temperature(
    whites_rig: ConsoleRig, total: float, share: float
) -> None:
    wanted = {"cool white": total * (1 - share), "warm white": total * share}
    levels = encode_levels(whites_rig, {"1 PAR": wanted})
    found = decode_levels(whites_rig, levels)["1 PAR"]
    # Steps of 16 bits, of which one of the temperature is up to 1/20000 of the mix.
    assert np.allclose([*found.values()], [*wanted.values()], atol=2e-4)


@pytest.fixture(scope="module")
def whites_rig(tmp_path_factory: pytest.TempPathFactory) -> ConsoleRig:
    return whites(tmp_path_factory.mktemp("rig"), 'PhysicalFrom="6500" PhysicalTo="2800"')


def test_the_temperature_sent_is_that_of_the_mix(whites_rig: ConsoleRig) -> None:
    [light] = whites_rig.fixtures[0].lights
    for share in (0.0, 0.25, 0.6, 1.0):
        drives = {"cool white": 0.5 * (1 - share), "warm white": 0.5 * share}
        levels = encode_levels(whites_rig, {"1 PAR": drives})[1]
        dimmer, place = (int.from_bytes(levels[k : k + 2], "big") / 65535 for k in (0, 2))
        mix = sum(
            d * x.candela * rgb_of_xy(x.xy)
            for d, x in zip(drives.values(), light.emitters, strict=True)
        )
        found = cct_and_duv(mix)
        assert found is not None
        # In mireds, between 65 points of a table.
        assert 1e6 / (6500 - place * 3700) == pytest.approx(1e6 / found[0], abs=0.1)
        assert dimmer == pytest.approx(0.5, abs=1e-4)


@pytest.mark.parametrize(
    ("function", "more"),
    [
        ('PhysicalFrom="0" PhysicalTo="1"', ""),
        ("", ""),
        (
            'PhysicalFrom="6500" PhysicalTo="2800"',
            channel("ColorAdd_R", "5") + channel("ColorAdd_G", "6"),
        ),
    ],
)
def test_temperatures_without_kelvin_or_beside_emitters_rest(
    function: str, more: str, tmp_path: Path
) -> None:
    [light] = whites(tmp_path, function, more).fixtures[0].lights
    assert light.whites == ()
    assert "cool white" not in [x.name for x in light.emitters]


def _types() -> dict[str, bytes]:
    filters = "".join(channel(f"ColorSub_{x}", str(k + 2)) for k, x in enumerate("CMY"))
    named = "".join(
        channel(f"ColorRGB_{x}", str(k + 2)) for k, x in enumerate(("Red", "Green", "Blue"))
    )
    xy = channel("CIE_X", "2,3", function='PhysicalTo="0.8"') + channel(
        "CIE_Y", "4,5", function='PhysicalTo="0.8"'
    )
    dimmer = channel("Dimmer", "1")
    return {
        "filters": gdtf(dimmer + filters),
        "named": gdtf(dimmer + named),
        "xy": gdtf(dimmer + xy),
    }


@pytest.mark.parametrize("kind", [*_types()])
def test_types_that_do_not_add_emitters_have_red_green_and_blue(kind: str, tmp_path: Path) -> None:
    show = write_mvr(tmp_path / "a.mvr", layered(fixture()), lamp=_types()[kind])
    rig = read_rig(show, usual_colors=True)
    [light] = rig.fixtures[0].lights
    assert [x.name for x in light.emitters] == ["red", "green", "blue"]
    assert light.dimmers == (0,)
    wanted = {"red": 0.8, "green": 0.5, "blue": 0.4}
    found = decode_levels(rig, encode_levels(rig, {light.name: wanted}))[light.name]
    # A step of 8 bits of a filter with a density of 4 is 1.6 % of the light.
    assert np.allclose([*found.values()], [*wanted.values()], atol=0.02)


def test_filters_that_a_file_measured_are_fitted_in_their_logarithm(tmp_path: Path) -> None:
    """A filter that is alike at all wavelengths, measured half in and all in."""

    def gray(physical: int, transmission: float) -> str:
        points = "".join(
            f'<MeasurementPoint WaveLength="{wave}" Energy="1"/>' for wave in (360, 830)
        )
        return (
            f'<Measurement Physical="{physical}" Transmission="{transmission}">{points}'
            "</Measurement>"
        )

    filters = f'<Filter Name="F">{gray(50, 50)}{gray(100, 25)}</Filter>'
    colors = '<Filter Name="M" Color="0.3127,0.1,20"/><Filter Name="Y" Color="0.41,0.51,90"/>'
    channels = channel("Dimmer", "1") + "".join(
        channel(f"ColorSub_{x}", str(k + 2), function=f'Filter="{name}"')
        for k, (x, name) in enumerate(zip("CMY", "FMY", strict=True))
    )
    data = gdtf(channels, described=f"<Filters>{filters}{colors}</Filters>")
    rig = read_rig(write_mvr(tmp_path / "a.mvr", layered(fixture()), lamp=data))
    [light] = rig.fixtures[0].lights
    assert np.allclose(light.filters[0].density, np.log(4), atol=1e-6)


def test_filters_of_one_kind_leave_one_colour(tmp_path: Path) -> None:
    same = '<Filters><Filter Name="F" Color="0.2,0.25,20"/></Filters>'
    channels = channel("Dimmer", "1") + "".join(
        channel(f"ColorSub_{x}", str(k + 2), function='Filter="F"') for k, x in enumerate("CMY")
    )
    show = write_mvr(tmp_path / "a.mvr", layered(fixture()), lamp=gdtf(channels, described=same))
    [light] = read_rig(show).fixtures[0].lights
    assert [x.name for x in light.emitters] == ["white"]
    assert light.filters == ()
