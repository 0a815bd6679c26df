"""Types of fixtures: what their channels do, how bright their emitters are, what is assumed."""

import math

import numpy as np
import pytest
from rig_files import BEAM, RGBW, RGBW_CHANNELS, channel, gdtf

from lightpaint.colour.luminous_flux import solid_angle, spot_cone
from lightpaint.dmx.gdtf import geometry_tree, mode_channels
from lightpaint.dmx.gdtf.fixture_type import FixtureType
from lightpaint.dmx.gdtf.mode_channels import dmx_value
from lightpaint.dmx.gdtf.mode_lights import FixtureMode
from lightpaint.errors import RigError


def read_mode(data: bytes, *, zoom: float | None = None, pixels: bool = False) -> FixtureMode:
    return FixtureType(data, "lamp.gdtf").mode("One", zoom=zoom, pixels=pixels)


@pytest.mark.parametrize(
    ("text", "byte_count", "level"),
    [
        ("128/1", 1, 128),
        ("128/1", 2, 0x8080),
        ("128/1s", 2, 0x8000),
        ("255/1", 3, 0xFFFFFF),
        ("32768/2", 2, 32768),
        ("32768/2s", 2, 32768),
        ("4660/2", 1, 0x12),
        ("None", 2, 0),
    ],
)
def test_values_are_repeated_or_shifted_as_the_standard_says(
    text: str, byte_count: int, level: int
) -> None:
    assert dmx_value(text, byte_count) == level


def test_older_files_have_the_default_in_the_channel() -> None:
    old = channel("CTO", "6", default="1/1").replace("Offset=", 'Default="17/1" Offset=')
    assert read_mode(gdtf(RGBW_CHANNELS + old)).channels[5].default == 17


def test_flux_is_shared_by_luminance_and_the_spot_radiates_it() -> None:
    """5000 lm in relative luminances 20, 40, 8, 52."""
    mode = read_mode(gdtf())
    [light] = mode.lights
    candelas = {x.name: x.candela for x in light.emitters}
    lumens = sum(candelas.values()) * solid_angle(30, 45)
    assert math.isclose(lumens, 5000, rel_tol=1e-9)
    assert math.isclose(candelas["white"] / candelas["red"], 52 / 20, rel_tol=1e-9)
    assert mode.emission == "LuminousFlux"
    assert light.dimmers == (0,)
    assert [x.channels for x in light.emitters] == [(1,), (2,), (3,), (4,)]
    assert light.emitters[0].xy == (0.69, 0.309)


def test_the_solid_angle_is_the_integral_of_the_spots_profile() -> None:
    cutoff, width = np.radians(spot_cone(30, 45))
    theta = np.linspace(0, cutoff, 200_001)
    profile = np.clip((cutoff - theta) / (cutoff - width), 0, 1)
    integral = np.trapezoid(2 * np.pi * np.sin(theta) * profile, theta)
    assert math.isclose(solid_angle(30, 45), integral, rel_tol=1e-8)  # of the sum of 2e5 steps


def test_a_spot_has_half_its_intensity_at_the_beam_and_a_tenth_at_the_field() -> None:
    cutoff, width = spot_cone(30, 45)
    assert math.isclose((cutoff - 15) / (cutoff - width), 0.5)
    assert math.isclose((cutoff - 22.5) / (cutoff - width), 0.1)
    for beam, field in ((25, 25), (10, 60), (170, 170), (40, 20)):
        cutoff, width = spot_cone(beam, field)
        assert 0 <= width < cutoff < 90


def _measured(candela: float) -> str:
    """Four emitters of which each was measured with this intensity."""
    measurement = f'<Measurement Physical="100" LuminousIntensity="{candela}"/></Emitter>'
    return RGBW.replace("/>", f">{measurement}")


def test_measured_intensity_counts_where_its_flux_agrees() -> None:
    plausible = 5000 / solid_angle(30, 45) / 4
    for candela, source in (
        (plausible, "LuminousIntensity"),
        (2.9 * plausible, "LuminousIntensity"),
        (4 * plausible, "LuminousFlux"),
        (plausible / 4, "LuminousFlux"),
        (1.0, "LuminousFlux"),
    ):
        mode = read_mode(gdtf(described=f"<Emitters>{_measured(candela)}</Emitters>"))
        assert mode.emission == source
        if source == "LuminousIntensity":
            assert all(
                math.isclose(x.candela, candela, rel_tol=1e-6) for x in mode.lights[0].emitters
            )


def test_without_any_light_a_thousand_lumens_are_assumed_and_said() -> None:
    mode = read_mode(gdtf(geometries='<Geometry Name="Body"><Beam Name="Beam"/></Geometry>'))
    [light] = mode.lights
    lumens = sum(x.candela for x in light.emitters) * solid_angle(25, 25)
    assert math.isclose(lumens, 1000, rel_tol=1e-9)
    assert mode.emission == "1000 lm"
    assert "its GDTF has no light: 1000 lm are assumed" in mode.remarks


def test_a_placeholder_of_dimmers_is_one_white_that_nothing_is_sent_to() -> None:
    """As some programs write for types that they do not know: pan would be a dimmer, too."""
    channels = "".join(channel(f"Dimmer{k}", str(k), geometry="Body") for k in (1, 2, 3))
    mode = read_mode(gdtf(channels, geometries='<Geometry Name="Body"/>', described=""))
    [light] = mode.lights
    [emitter] = light.emitters
    assert (emitter.name, emitter.channels, light.dimmers) == ("white", (), ())
    assert "its GDTF is a placeholder" in mode.remarks[0]
    assert "no beam in its GDTF" in mode.remarks[1]
    alone = gdtf(
        channel("Dimmer1", "1", geometry="Body"), geometries='<Geometry Name="Body"/>', described=""
    )
    assert read_mode(alone).lights[0].dimmers == (0,)


def test_emitters_without_colour_have_their_spectrum_wavelength_or_usual_colour() -> None:
    line = '<Emitter Name="Red" DominantWaveLength="630"/>'
    peak = "".join(
        f'<MeasurementPoint WaveLength="{wave}" Energy="{energy}"/>'
        # Spectrometers have noise, also below 0.
        for wave, energy in ((450, -0.004), (620, 0), (630, 1), (640, 0), (660, -0.002))
    )
    spectrum = (
        '<Emitter Name="Red"><Measurement Physical="100" LuminousIntensity="0">'
        f"{peak}</Measurement></Emitter>"
    )
    found = {}
    for name, described in {"line": line, "spectrum": spectrum, "none": ""}.items():
        mode = read_mode(
            gdtf(channel("ColorAdd_R", "1"), described=f"<Emitters>{described}</Emitters>")
        )
        found[name] = mode.lights[0].emitters[0].xy
        assert ("usual ones are assumed" in " ".join(mode.remarks)) == (name == "none")
        assert mode.lacking == (("the colour of red",) if name == "none" else ())
    # CIE 1931 at 630 nm.
    assert np.allclose(found["line"], (0.7079, 0.2920), atol=1e-4)  # as tables are rounded
    assert np.allclose(found["spectrum"], found["line"], atol=5e-3)
    assert found["none"] == (0.69, 0.305)


def test_dimmers_in_a_chain_multiply_and_the_finest_carries_the_level() -> None:
    tree = f'<Geometry Name="Body"><Axis Name="Head">{BEAM}</Axis></Geometry>'
    channels = channel("Dimmer", "1", geometry="Body") + channel("Dimmer", "2,3", geometry="Head")
    mode = read_mode(gdtf(channels + channel("ColorAdd_W", "4"), geometries=tree))
    [light] = mode.lights
    assert light.dimmers == (1, 0)
    assert [x.channels for x in light.emitters] == [(2,)]


def _zoomed(rest: str) -> bytes:
    zoom = channel("Zoom", "6,7", default=rest, function='PhysicalFrom="10" PhysicalTo="50"')
    return gdtf(RGBW_CHANNELS + zoom)


def test_zoom_is_at_rest_or_as_wanted_and_then_sent() -> None:
    [light] = read_mode(_zoomed("0/2")).lights
    assert (light.beam_angle, light.field_angle) == (10, 15)  # the field in proportion
    mode = read_mode(_zoomed("0/2"), zoom=30)
    assert math.isclose(mode.lights[0].beam_angle, 30, abs_tol=40 / 65535)
    assert mode.channels[5].default == 32768
    wide = read_mode(_zoomed("0/2"), zoom=80)
    assert wide.lights[0].beam_angle == 50
    assert "its zoom goes from 10° to 50°: 50° is used" in wide.remarks
    # The same light in a wider beam.
    narrow = read_mode(_zoomed("0/2"))
    totals = [
        sum(x.candela for x in m.lights[0].emitters)
        * solid_angle(m.lights[0].beam_angle, m.lights[0].field_angle)
        for m in (narrow, wide)
    ]
    assert np.allclose(totals, 5000)


def test_what_was_measured_holds_where_the_zoom_rests_and_falls_with_the_solid_angle() -> None:
    zoom = channel("Zoom", "6,7", default="0/2", function='PhysicalFrom="10" PhysicalTo="50"')
    measured = 5000 / solid_angle(10, 15) / 4
    data = gdtf(RGBW_CHANNELS + zoom, described=f"<Emitters>{_measured(measured)}</Emitters>")
    for wanted in (None, 30):
        mode = read_mode(data, zoom=wanted)
        [light] = mode.lights
        assert mode.emission == "LuminousIntensity"
        lumens = sum(x.candela for x in light.emitters) * solid_angle(
            light.beam_angle, light.field_angle
        )
        assert math.isclose(lumens, 5000, rel_tol=1e-6)  # as files round
    assert light.beam_angle > 29


#: Three pixels that repeat one geometry of two levels, whose colours are below its first.
PIXELS = '<Geometry Name="Cell"><Axis Name="Inner">' + BEAM + "</Axis></Geometry>"
ROW = "".join(
    f'<GeometryReference Name="P{k}" Geometry="Cell" '
    f'Position="{{1,0,0,{k / 10}}}{{0,1,0,0}}{{0,0,1,0}}{{0,0,0,1}}">'
    f'<Break DMXBreak="1" DMXOffset="{2 + 3 * k}"/></GeometryReference>'
    for k in range(3)
)
CELLS = channel("Dimmer", "1", geometry="Bar") + "".join(
    channel(f"ColorAdd_{c}", str(k + 1), geometry="Inner", dmx_break="Overwrite")
    for k, c in enumerate("RGB")
)


def _bar() -> bytes:
    geometries = PIXELS + f'<Geometry Name="Bar">{ROW}</Geometry>'
    return gdtf(CELLS, geometries=geometries, root="Bar")


def test_pixels_below_references_have_channels_and_places_of_their_own() -> None:
    mode = read_mode(_bar(), pixels=True)
    assert [x.offsets for x in mode.channels] == [(k,) for k in range(1, 11)]
    assert [light.name for light in mode.lights] == ["px1", "px2", "px3"]
    channels = [[x.channels for x in light.emitters] for light in mode.lights]
    assert channels == [[(1,), (2,), (3,)], [(4,), (5,), (6,)], [(7,), (8,), (9,)]]
    assert np.allclose([light.position[0] for light in mode.lights], [0, 0.1, 0.2])
    # The dimmer of all stays at full.
    assert [(x.dimmers, x.masters) for x in mode.lights] == [((), (0,))] * 3


def test_without_pixels_a_fixture_is_one_light_of_all_its_beams() -> None:
    [light] = read_mode(_bar()).lights
    assert [x.channels for x in light.emitters] == [(1, 4, 7), (2, 5, 8), (3, 6, 9)]
    assert light.dimmers == (0,)
    assert np.allclose(light.position, (0.1, 0, 0))
    parts = read_mode(_bar(), pixels=True).lights
    whole = sum(x.candela for x in light.emitters)
    assert math.isclose(sum(x.candela for p in parts for x in p.emitters), whole)


def test_references_in_a_circle_and_too_many_geometries_are_one_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    circle = (
        '<Geometry Name="Body"><GeometryReference Name="R" Geometry="Other"/></Geometry>'
        '<Geometry Name="Other"><GeometryReference Name="S" Geometry="Other"/></Geometry>'
    )
    with pytest.raises(RigError, match=r"lamp.gdtf: its geometry 'Other' refers to itself"):
        read_mode(gdtf(geometries=circle))
    monkeypatch.setattr(geometry_tree, "MAX_GEOMETRIES", 3)
    with pytest.raises(RigError, match="more than 3 geometries"):
        read_mode(_bar())
    monkeypatch.undo()
    monkeypatch.setattr(mode_channels, "MAX_CHANNELS", 9)
    with pytest.raises(RigError, match="more than 9 channels"):
        read_mode(_bar())


def test_a_channel_that_dims_in_a_part_of_its_range_is_inverted_by_its_curve() -> None:
    both = (
        '<DMXChannel DMXBreak="1" Offset="1" Geometry="Beam"><LogicalChannel Attribute="Dimmer">'
        '<ChannelFunction Name="a" Attribute="Shutter1" DMXFrom="0/1"/>'
        '<ChannelFunction Name="b" Attribute="Dimmer" DMXFrom="51/1" PhysicalFrom="1" '
        'PhysicalTo="0"/></LogicalChannel></DMXChannel>'
    )
    mode = read_mode(gdtf(both))
    curve = mode.channels[0].curve
    assert np.allclose(curve[0], (1.0, 0.0))
    assert np.allclose(curve[-1], (0.2, 1.0))


def test_a_profile_is_inverted_whether_of_a_hundred_or_of_one() -> None:
    for points in (
        '<Point DMXPercentage="0" CFC2="0.01"/>',
        '<Point DMXPercentage="0" CFC2="1"/>',
    ):
        profiles = f'<DMXProfiles><DMXProfile Name="square">{points}</DMXProfile></DMXProfiles>'
        data = gdtf(channel("Dimmer", "1", function='DMXProfile="square"'), described=profiles)
        levels, shares = np.transpose(read_mode(data).channels[0].curve)
        assert np.allclose(shares, levels**2, atol=1e-12)


def test_emitters_that_were_measured_at_several_levels_have_a_curve() -> None:
    measured = (
        '<Emitter Name="White" Color="0.31,0.33,100"><Measurement Physical="50" '
        'LuminousIntensity="1500"/><Measurement Physical="100" LuminousIntensity="2000"/></Emitter>'
    )
    data = gdtf(
        channel("ColorAdd_W", "1"),
        geometries='<Geometry Name="Body"><Beam Name="Beam"/></Geometry>',
        described=f"<Emitters>{measured}</Emitters>",
    )
    [emitter] = read_mode(data).lights[0].emitters
    assert emitter.candela == 2000
    assert emitter.curve == ((0.0, 0.0), (0.5, 0.75), (1.0, 1.0))


def _named_rgb(described: str, function: str = "") -> FixtureMode:
    channels = "".join(
        channel(f"ColorRGB_{x}", str(k + 1), function=function.format(x))
        for k, x in enumerate(("Red", "Green", "Blue"))
    )
    return read_mode(gdtf(channels, described=described))


def _sum_of(mode: FixtureMode) -> tuple[float, float]:
    """The chromaticity of all emitters at full."""
    xyz = np.sum(
        [
            x.candela * np.array([x.xy[0], x.xy[1], 1 - sum(x.xy)]) / x.xy[1]
            for x in mode.lights[0].emitters
        ],
        axis=0,
    )
    return float(xyz[0] / xyz.sum()), float(xyz[1] / xyz.sum())


CUSTOM = (
    '<{0} Mode="Custom" Red="0.68,0.32,1" Green="0.26,0.69,1" Blue="0.15,0.06,1" '
    'WhitePoint="0.35,0.36,1"/>'
)


@pytest.mark.parametrize(
    ("described", "function", "red", "white"),
    [
        ("", "", (0.64, 0.33), (0.3127, 0.3290)),
        ('<ColorSpace Mode="sRGB"/>', "", (0.64, 0.33), (0.3127, 0.3290)),
        ('<ColorSpace Mode="ProPhoto"/>', "", (0.7347, 0.2653), (0.3457, 0.3585)),
        ('<ColorSpace Mode="ANSI"/>', "", (0.7347, 0.2653), (0.4254, 0.4044)),
        (CUSTOM.format("ColorSpace"), "", (0.68, 0.32), (0.35, 0.36)),
        (
            '<ColorSpace Mode="ANSI"/><AdditionalColorSpaces>'
            + CUSTOM.format('ColorSpace Name="own"')
            + "</AdditionalColorSpaces>",
            'ColorSpace="own"',
            (0.68, 0.32),
            (0.35, 0.36),
        ),
    ],
)
def test_named_colours_are_those_of_the_files_space(
    described: str, function: str, red: tuple[float, float], white: tuple[float, float]
) -> None:
    mode = _named_rgb(described, function)
    assert [x.name for x in mode.lights[0].emitters] == ["red", "green", "blue"]
    assert [x.channels for x in mode.lights[0].emitters] == [(0,), (1,), (2,)]
    assert mode.lights[0].emitters[0].xy == pytest.approx(red)
    assert _sum_of(mode) == pytest.approx(white, abs=1e-4)  # of a blue that is moved to y = 0.002


def test_named_colours_are_emitters_where_the_file_has_those() -> None:
    three = "".join(
        f'<Emitter Name="{name}" Color="{color}"/>'
        for name, color in (
            ("Blue", "0.14,0.05,7"),
            ("Red", "0.7,0.29,21"),
            ("Green", "0.17,0.7,62"),
        )
    )
    space = '<ColorSpace Mode="ANSI"/>'
    expected = [(0.7, 0.29), (0.17, 0.7), (0.14, 0.05)]
    alone = _named_rgb(f"{space}<Emitters>{three}</Emitters>")
    white = '<Emitter Name="White" Color="0.32,0.33,90"/>'
    linked = _named_rgb(f"{space}<Emitters>{three}{white}</Emitters>", 'Emitter="{}"')
    for mode in (alone, linked):
        assert [x.xy for x in mode.lights[0].emitters] == expected
    shares = [x.candela for x in alone.lights[0].emitters]
    assert np.allclose(np.array(shares) / sum(shares), np.array([21, 62, 7]) / 90)
    # Beside others, nothing says that red means the red LEDs.
    beside = _named_rgb(f"{space}<Emitters>{RGBW}</Emitters>")
    assert beside.lights[0].emitters[0].xy == (0.7347, 0.2653)


def test_a_space_whose_colours_lie_on_a_line_is_one_line() -> None:
    line = CUSTOM.format("ColorSpace").replace("0.26,0.69", "0.415,0.19")
    with pytest.raises(RigError, match="lie on a line"):
        _named_rgb(line)


def test_what_changes_the_colour_and_stays_at_rest_is_named() -> None:
    more = channel("CTO", "6", default="17/1") + channel("Color1", "7") + channel("Gobo1", "8")
    mode = read_mode(gdtf(RGBW_CHANNELS + more))
    assert mode.remarks == ("at rest: CTO, Color1",)
    assert mode.channels[5].default == 17


def test_a_fixture_whose_channels_dim_nothing_has_no_light() -> None:
    mode = read_mode(gdtf(channel("Pan", "1")))
    assert mode.lights == ()
    assert "no channel of it dims light, so it is left out" in mode.remarks


def _shutter(default: int) -> str:
    """A shutter that is closed up to 31, open up to 63, and flashes above."""
    functions = "".join(
        f'<ChannelFunction Name="{name}" Attribute="{attribute}" DMXFrom="{first}/1" '
        f'Default="{default}/1" PhysicalFrom="{start}" PhysicalTo="{end}"/>'
        for name, attribute, first, start, end in (
            ("Closed", "Shutter1", 0, 0, 0),
            ("Open", "Shutter1", 32, 1, 1),
            ("Flash", "Shutter1Strobe", 64, 1, 20),
        )
    )
    return (
        '<DMXChannel DMXBreak="1" Offset="6" Geometry="Beam" InitialFunction="Beam_Shutter1.'
        f'Shutter1.Open"><LogicalChannel Attribute="Shutter1">{functions}</LogicalChannel>'
        "</DMXChannel>"
    )


@pytest.mark.parametrize(
    ("default", "sent", "remark"),
    [(40, 40, ""), (200, 47, "flashes"), (0, 0, "its shutter rests closed")],
)
def test_nothing_flashes_and_a_closed_shutter_is_named(
    default: int, sent: int, remark: str
) -> None:
    mode = read_mode(gdtf(RGBW_CHANNELS + _shutter(default)))
    assert mode.channels[5].default == sent
    assert (remark in " ".join(map(str, mode.remarks))) if remark else not mode.remarks
