"""Rows of levels for lights that mix by filters, or are told x and y."""

import csv
import io

from lightpaint.dmx.console_rig import (
    ConsoleRig,
    DmxChannel,
    RigEmitter,
    RigFilter,
    RigFixture,
    RigLight,
)
from lightpaint.dmx.levels import encode_levels
from lightpaint.relit.export.rig_files import Cue, cue_list_csv, level_csv, level_rows

EMITTERS = tuple(
    RigEmitter(name, xy, 1000.0, ())
    for name, xy in (("red", (0.64, 0.33)), ("green", (0.3, 0.6)), ("blue", (0.15, 0.06)))
)
PLACE = (0.0, 0.0, 4.0), (0.0, 0.0, -1.0), (0.0, 1.0, 0.0), 20.0, 30.0

FILTERS = tuple(
    RigFilter(name, tuple(5.0 * (j == k) for j in range(3)), (1 + k,))
    for k, name in enumerate(("cyan", "magenta", "yellow"))
)
FILTERED = RigFixture(
    *("1", "profile", "Profile", "basic", {1: 1}),
    tuple(DmxChannel(x, "Head", (k,)) for k, x in enumerate(("Dimmer", "C", "M", "Y"), start=1)),
    (RigLight("profile", *PLACE, EMITTERS, (0,), filters=FILTERS),),
)
BY_XY = RigFixture(
    *("2", "wash", "Wash", "xy", {1: 101}),
    (
        DmxChannel("Dimmer", "Base", (1,)),
        DmxChannel("Dimmer", "Head", (2,)),
        DmxChannel("CIE_X", "Head", (3, 4)),
        DmxChannel("CIE_Y", "Head", (5, 6)),
    ),
    (RigLight("wash", *PLACE, EMITTERS, (1,), masters=(0,), chromaticity=(2, 3)),),
)
RIG = ConsoleRig("show.mvr", (FILTERED, BY_XY))
DRIVES = {"profile": {"red": 1.0, "green": 0.5, "blue": 0.25}, "wash": {"green": 0.5}}


def test_all_channels_that_lights_set_have_rows() -> None:
    levels = encode_levels(RIG, DRIVES)
    rows = level_rows(RIG, DRIVES, {1: 9})
    by_name = {(x.light, x.emitter, x.channels): x for x in rows}
    places = {(x.universe, channel): x for x in rows for channel in x.channels}
    set_by_lights = [*range(1, 5), *range(101, 107)]
    assert sorted(channel for _, channel in places) == set_by_lights
    for (universe, first), row in places.items():
        assert universe == 9
        data = bytes(levels[1][channel - 1] for channel in row.channels)
        assert row.value == int.from_bytes(data, "big"), first
    assert by_name["profile", "magenta", (3,)].value == levels[1][2] > 0
    assert by_name["wash", "dimmer", (101,)].value == 255
    assert by_name["wash", "y", (105, 106)].drive is None


def test_drives_without_channels_have_rows_of_their_own() -> None:
    rows = list(csv.DictReader(io.StringIO(level_csv(level_rows(RIG, DRIVES, {1: 1})))))
    alone = [(x["light"], x["emitter"], x["drive"]) for x in rows if not x["channels"]]
    assert alone == [
        *(("profile", "blue", "0.25"), ("profile", "green", "0.5"), ("profile", "red", "1")),
        *(("wash", "blue", "0"), ("wash", "green", "0.5"), ("wash", "red", "0")),
    ]


def test_cues_tell_channels_of_one_attribute_apart() -> None:
    text = cue_list_csv(RIG, [Cue("=dusk", 1.5, DRIVES)])
    rows = list(csv.DictReader(io.StringIO(text)))
    assert [x["channel"] for x in rows] == [
        *("Dimmer", "C", "M", "Y", "Base.Dimmer", "Head.Dimmer", "CIE_X", "CIE_Y")
    ]
    assert {(x["cue"], x["label"], x["fade"]) for x in rows} == {("1", "'=dusk", "1.5")}
    assert all(0 <= int(x["value"]) <= 65535 for x in rows)
