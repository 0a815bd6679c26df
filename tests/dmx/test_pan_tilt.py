"""Pan and tilt: turned forward again, they point where lights do, however fixtures hang.

The oracle turns geometries as GDTF has them, matrix by matrix: pan about the z axis of its
geometry, tilt about the x axis of its own, right-handed.
"""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rig_files import BEAM, EXAMPLE, UPRIGHT, channel, fixture, gdtf, layered, write_mvr

from lightpaint.arrays import Doubles, Position
from lightpaint.dmx.console_rig import ConsoleRig, RigFixture
from lightpaint.dmx.levels import decode_levels, encode_levels
from lightpaint.dmx.mvr import read_rig
from lightpaint.dmx.pan_tilt import aimed_rig, angles_for, turned
from lightpaint.scene.properties.site import unit

#: Half a level of 16 bits, in degrees, of the widest range here, for each of two axes.
LEVEL = 540 / 65535

#: Ends of pan and tilt, in degrees; pan falls while its level rises.
PAN, TILT = (270.0, -270.0), (-130.0, 130.0)

HEADS = (
    '<Geometry Name="Body"><Axis Name="Yoke" '
    'Position="{1,0,0,0}{0,1,0,0}{0,0,1,-0.1}{0,0,0,1}"><Axis Name="Head" '
    f'Position="{{1,0,0,0}}{{0,1,0,0}}{{0,0,1,-0.25}}{{0,0,0,1}}">{BEAM}</Axis></Axis></Geometry>'
)


def moving(
    *, geometries: str = HEADS, pan: str = "1,2", tilt: str = "3,4", pan_rest: str = "32768/2"
) -> bytes:
    """A head of one white, whose pan and tilt are of 16 bits unless others are given."""
    ends = 'PhysicalFrom="{}" PhysicalTo="{}"'.format
    return gdtf(
        channel("Pan", pan, geometry="Yoke", default=pan_rest, function=ends(*PAN))
        + channel("Tilt", tilt, geometry="Head", default="32768/2", function=ends(*TILT))
        + channel("ColorAdd_W", "5"),
        geometries=geometries,
    )


#: Rows of matrices as MVR has them: hanging, yawed, lying on its side, standing.
HUNG = {
    "hanging": np.eye(3),
    "yawed": np.array([[0.6, 0.8, 0], [-0.8, 0.6, 0], [0, 0, 1]]),
    "on its side": np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]]),
    "standing": np.array([[1, 0, 0], [0, -1, 0], [0, 0, -1]]),
    "leaning": np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0], [0.48, 0.64, 0.6]]),
}


def written(rows: Doubles) -> str:
    return "".join(f"{{{','.join(map(str, row))}}}" for row in rows.tolist())


def rig_of(path: Path, rows: Doubles, data: bytes) -> ConsoleRig:
    hung = fixture("Spot", matrix=written(rows) + "{0,0,5000}")
    return read_rig(write_mvr(path, layered(hung), lamp=data))


@pytest.fixture(scope="module", params=HUNG)
def hung(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> ConsoleRig:
    path = tmp_path_factory.mktemp("rig") / "a.mvr"
    return rig_of(path, HUNG[request.param], moving())


def degrees_of(fixture: RigFixture) -> list[float]:
    """The angles of pan and tilt at which a fixture's channels rest, from their levels alone."""
    levels = [fixture.channels[k].default / 65535 for k in (0, 1)]
    return [a + x * (b - a) for x, (a, b) in zip(levels, (PAN, TILT), strict=True)]


def forward(rows: Doubles, pan: float, tilt: float) -> Doubles:
    """The beam of a fixture at these angles: R · Rz(pan) · Rx(tilt) · (0, 0, −1)."""
    p, t = math.radians(pan), math.radians(tilt)
    c, s = math.cos(p), math.sin(p)
    about_z = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    c, s = math.cos(t), math.sin(t)
    about_x = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    return np.asarray(rows.T @ about_z @ about_x @ (0, 0, -1))


def rows_of(rig: ConsoleRig) -> Doubles:
    """The axes of the only fixture: its lights point along −z, and pan is about z, tilt about x."""
    [head] = rig.fixtures[0].heads
    z, x = np.array(head.axes[0].axis), np.array(head.axes[1].axis)
    return np.array([x, np.cross(z, x), z])


def degrees_between(a: Doubles, b: Doubles | Position) -> float:
    return math.degrees(math.atan2(float(np.linalg.norm(np.cross(a, b))), float(np.dot(a, b))))


def test_the_axes_are_those_of_the_hung_fixture(tmp_path: Path) -> None:
    for name, rows in HUNG.items():
        rig = rig_of(tmp_path / f"{name}.mvr", rows, moving())
        assert np.allclose(rows_of(rig), rows, atol=1e-9)
        assert [x.name for x in rig.fixtures[0].heads[0].axes] == ["pan", "tilt"]


@given(pan=st.floats(-180, 180), tilt=st.floats(-129, 129))
def test_turned_forward_again_a_beam_points_where_its_light_does(
    hung: ConsoleRig, pan: float, tilt: float
) -> None:
    rows = rows_of(hung)
    wanted = unit(forward(rows, pan, tilt))
    aimed, remarks = aimed_rig(hung, {"1 Spot": wanted})
    assert remarks == ()
    assert degrees_between(forward(rows, *degrees_of(aimed.fixtures[0])), wanted) <= LEVEL


def test_pan_is_counter_clockwise_from_above_and_tilt_leans_forwards(tmp_path: Path) -> None:
    """As GDTF has it: up is z, forwards is +y, and at 0° a hung fixture shines down."""
    rig = rig_of(tmp_path / "a.mvr", HUNG["hanging"], moving())
    forwards = unit((0, 1, -1))
    assert degrees_of(aimed_rig(rig, {"1 Spot": forwards})[0].fixtures[0]) == pytest.approx(
        [0, 45], abs=LEVEL
    )
    # Nearly a quarter turn from +y, counter-clockwise from above, ends at −x.
    left = aimed_rig(rig, {"1 Spot": unit((-1, 0.01, -1))})[0].fixtures[0]
    assert degrees_of(left) == pytest.approx([89.4, 45], abs=0.1)


def test_straight_below_pan_stays_where_it_rests(tmp_path: Path) -> None:
    rig = rig_of(tmp_path / "a.mvr", HUNG["hanging"], moving(pan_rest="10000/2"))
    aimed = aimed_rig(rig, {"1 Spot": (0, 0, -1)})[0].fixtures[0]
    assert aimed.channels[0].default == 10000
    assert degrees_of(aimed)[1] == pytest.approx(0, abs=LEVEL)


def test_of_equal_angles_the_nearest_to_rest_is_taken(tmp_path: Path) -> None:
    """Pan goes once and a half around, so that most directions have three pairs of angles."""
    wanted = {"1 Spot": unit((1, 1, -1))}
    for rest, expected in (("32768/2", (-45, None)), ("3000/2", (135, None)), ("100/2", (135, 0))):
        rig = rig_of(tmp_path / "a.mvr", HUNG["hanging"], moving(pan_rest=rest))
        pan, tilt = degrees_of(aimed_rig(rig, wanted)[0].fixtures[0])
        assert pan == pytest.approx(expected[0], abs=2 * LEVEL)
        assert abs(tilt) == pytest.approx(math.degrees(math.atan(math.sqrt(2))), abs=LEVEL)


def test_what_is_out_of_range_comes_as_close_as_it_can_and_is_said_once(tmp_path: Path) -> None:
    """Straight up is 50° beyond a tilt of 130°."""
    rig = rig_of(tmp_path / "a.mvr", HUNG["hanging"], moving())
    aimed, remarks = aimed_rig(rig, {"1 Spot": (0, 0, 1)})
    assert remarks == (
        "'1 Spot' cannot point where its light does: its pan goes from -270° to 270° and tilt goes "
        "from -130° to 130°, so it misses by 50°",
    )
    off = degrees_between(forward(np.eye(3), *degrees_of(aimed.fixtures[0])), (0, 0, 1))
    assert off == pytest.approx(50, abs=LEVEL)


@given(
    ends=st.tuples(st.floats(-200, 200), st.floats(20, 300)),
    tilts=st.tuples(st.floats(-130, 130), st.floats(5, 200)),
    way=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda x: np.linalg.norm(x) > 0.1),
)
def test_no_angles_within_their_ranges_come_closer(
    ends: tuple[float, float], tilts: tuple[float, float], way: Position, hung: ConsoleRig
) -> None:
    """Against all angles of a grid of 12°."""
    [head] = hung.fixtures[0].heads
    ranges = [(low, low + size) for low, size in (ends, tilts)]
    axes = tuple(replace(x, degrees=r) for x, r in zip(head.axes, ranges, strict=True))
    head = replace(head, axes=axes)
    found = angles_for(head, way, [r[0] for r in ranges])
    assert all(r[0] - 1e-6 <= x <= r[1] + 1e-6 for x, r in zip(found, ranges, strict=True))
    rows, wanted = rows_of(hung), np.array(unit(way))
    best = min(
        degrees_between(forward(rows, p, t), wanted)
        for p in np.arange(ranges[0][0], ranges[0][1], 12)
        for t in np.arange(ranges[1][0], ranges[1][1], 12)
    )
    assert degrees_between(turned(head, found), wanted) <= best + 2e-4


def test_a_bar_that_only_tilts_comes_as_close_as_one_axis_can(tmp_path: Path) -> None:
    tilt = channel("Tilt", "1,2", geometry="Head", function='PhysicalFrom="-90" PhysicalTo="90"')
    data = gdtf(tilt + channel("ColorAdd_W", "3"), geometries=HEADS)
    rig = rig_of(tmp_path / "a.mvr", HUNG["hanging"], data)
    aimed, remarks = aimed_rig(rig, {"1 Spot": unit((0.1, 1, -1))})
    level = aimed.fixtures[0].channels[0].default
    assert -90 + level / 65535 * 180 == pytest.approx(45, abs=LEVEL)
    [remark] = remarks
    assert "its tilt goes from -90° to 90°, so it misses by 4.04°" in remark


def test_a_fixture_without_pan_and_tilt_is_named_once_it_should_turn(tmp_path: Path) -> None:
    rig = read_rig(write_mvr(tmp_path / "a.mvr", layered(fixture(matrix=UPRIGHT + "{0,0,5000}"))))
    assert aimed_rig(rig, {}) == (rig, ())
    aimed, remarks = aimed_rig(rig, {"1 PAR": unit((0, 1, -1))})
    assert aimed == rig
    assert remarks == ("'1 PAR' has no pan and tilt: turn it by 45° by hand",)


def test_without_an_answer_heads_point_at_the_focus_points_of_the_show() -> None:
    rig = read_rig(EXAMPLE)
    aimed, remarks = aimed_rig(rig, {})
    assert remarks == ()
    moving_heads = [x for x in aimed.fixtures if x.heads]
    assert len(moving_heads) == 2
    for x in moving_heads:
        [head] = x.heads
        angles = [axis.degrees_at(x.channels[axis.channel].default) for axis in head.axes]
        assert degrees_between(turned(head, angles), x.lights[0].direction) <= LEVEL
    # No other channel changes, and the light neither.
    drives = {"201 Wash 1": {"red": 0.5}}
    old, new = encode_levels(rig, drives), encode_levels(aimed, drives)
    assert old[1] == new[1]
    assert [k for k in range(512) if old[2][k] != new[2][k]] == [0, 1, 2, 3, 24, 25, 26, 27]
    assert decode_levels(rig, new) == decode_levels(rig, old)


def test_an_inverted_channel_turns_the_other_way(tmp_path: Path) -> None:
    data = moving()
    plain = rig_of(tmp_path / "a.mvr", HUNG["hanging"], data)
    ends = 'PhysicalFrom="{}" PhysicalTo="{}" DMXInvert="Yes"'.format
    inverted = rig_of(
        tmp_path / "b.mvr",
        HUNG["hanging"],
        gdtf(
            channel("Pan", "1,2", geometry="Yoke", default="32768/2", function=ends(*PAN))
            + channel("Tilt", "3,4", geometry="Head", default="32768/2", function=ends(*TILT))
            + channel("ColorAdd_W", "5"),
            geometries=HEADS,
        ),
    )
    levels = [
        [x.default for x in aimed_rig(rig, {"1 Spot": unit((1, 2, -1))})[0].fixtures[0].channels]
        for rig in (plain, inverted)
    ]
    assert [65535 - x for x in levels[0][:2]] == pytest.approx(levels[1][:2], abs=1)


def test_heads_on_one_yoke_share_its_pan(tmp_path: Path) -> None:
    """The first head decides pan, the second tilts as close as that lets it."""
    heads = "".join(
        f'<Axis Name="Head{k}">{BEAM.replace("Beam", f"Beam{k}", 2).replace(f"<Beam{k}", "<Beam")}'
        "</Axis>"
        for k in (1, 2)
    )
    ends = 'PhysicalFrom="{}" PhysicalTo="{}"'.format
    data = gdtf(
        channel("Pan", "1,2", geometry="Yoke", default="32768/2", function=ends(*PAN))
        + "".join(
            channel("Tilt", f"{2 * k + 1},{2 * k + 2}", geometry=f"Head{k}", function=ends(*TILT))
            + channel("ColorAdd_W", str(6 + k), geometry=f"Beam{k}")
            for k in (1, 2)
        ),
        geometries=f'<Geometry Name="Body"><Axis Name="Yoke">{heads}</Axis></Geometry>',
    )
    hung = layered(fixture("Duo", matrix=UPRIGHT + "{0,0,5000}"))
    rig = read_rig(write_mvr(tmp_path / "a.mvr", hung, lamp=data), pixels=True)
    assert [x.lights for x in rig.fixtures[0].heads] == [("1 Duo px1",), ("1 Duo px2",)]
    for second, off in (((0, -1, -1), 0.0), ((1, 0, 0), 90.0)):
        wanted = {"1 Duo px1": unit((0, 1, -1)), "1 Duo px2": unit(second)}
        aimed, remarks = aimed_rig(rig, wanted)
        pan, *_ = degrees_of(aimed.fixtures[0])
        assert pan == pytest.approx(0, abs=LEVEL)
        assert len(remarks) == (off > 0)
        assert all(x.startswith("'1 Duo px2' cannot") for x in remarks)
        assert all(x.endswith("so it misses by 90°") for x in remarks)
