"""Shows: places, targets, names, addresses, and one line for what cannot be used."""

from pathlib import Path

import numpy as np
import pytest
from rig_files import (
    EXAMPLE,
    UPRIGHT,
    example_writer,
    fixture,
    gdtf,
    layered,
    unzipped,
    write_mvr,
    zipped,
)

from lightpaint.dmx import mvr
from lightpaint.dmx.console_rig import ConsoleRig, RigLight
from lightpaint.dmx.levels import decode_levels, encode_levels
from lightpaint.dmx.mvr import read_rig, read_show
from lightpaint.errors import RigError

#: Matrices are written with nine decimals.
WRITTEN = 1e-6


def lights_of(rig: ConsoleRig) -> dict[str, RigLight]:
    return {light.name: light for x in rig.fixtures for light in x.lights}


def test_the_example_is_what_its_writer_writes(tmp_path: Path) -> None:
    example_writer().write_show(tmp_path / "show.mvr")
    assert (tmp_path / "show.mvr").read_bytes() == EXAMPLE.read_bytes()


def test_beams_hit_their_targets_however_their_fixtures_are_turned() -> None:
    """Transposed matrices pass where nothing is turned, and miss by metres here."""
    make = example_writer()
    lights = lights_of(read_rig(EXAMPLE))
    assert len(lights) == 6
    for hung in (*make.FRONT, *make.BACK):
        light = lights[f"{hung.number} {hung.name}"]
        way = np.subtract(hung.target, light.position)
        assert np.allclose(light.direction, way / np.linalg.norm(way), atol=WRITTEN)
        assert abs(np.dot(light.direction, light.up)) < 1 or hung.has_focus


def test_a_beam_hangs_below_its_fixture_along_the_fixtures_axes() -> None:
    make = example_writer()
    lights = lights_of(read_rig(EXAMPLE))
    for hung in make.FRONT:
        way = np.subtract(hung.target, hung.place)
        expected = np.array(hung.place) + 0.1 * way / np.linalg.norm(way)
        assert np.allclose(lights[f"{hung.number} {hung.name}"].position, expected, atol=WRITTEN)


def test_a_fixture_that_is_not_turned_points_down_from_its_place_in_metres(tmp_path: Path) -> None:
    path = write_mvr(tmp_path / "a.mvr", layered(fixture(matrix=UPRIGHT + "{1000,-2000,4500}")))
    [light] = lights_of(read_rig(path)).values()
    assert light.position == (1.0, -2.0, 4.5)
    assert light.direction == (0.0, 0.0, -1.0)


def test_places_in_layers_and_nested_groups_add_up_also_with_blanks_in_matrices(
    tmp_path: Path,
) -> None:
    # A quarter turn about z: x becomes y, and y becomes −x.
    quarter = "{0,1,0} {-1,0,0} {0,0,1}"
    truss = fixture(matrix=UPRIGHT + "{1000,0,0}")
    inner = (
        f'<GroupObject name="b"><Matrix>{quarter} {{0,2000,0}}</Matrix>'
        f"<ChildList>{truss}</ChildList></GroupObject>"
    )
    outer = (
        f'<GroupObject name="a"><Matrix>{quarter}{{500,0,0}}</Matrix>'
        f"<ChildList>{inner}</ChildList></GroupObject>"
    )
    path = write_mvr(tmp_path / "a.mvr", layered(outer, matrix=UPRIGHT + "{0,0,3000}"))
    [light] = lights_of(read_rig(path)).values()
    # (1, 0) turns to (0, 1) + (0, 2) = (0, 3), which turns to (−3, 0) + (0.5, 0).
    assert np.allclose(light.position, (-2.5, 0.0, 3.0), atol=WRITTEN)


def test_names_are_number_and_name_and_differ(tmp_path: Path) -> None:
    fixtures = [
        fixture("PAR *1*", number="101", address="1"),
        fixture("PAR *1*", number="101", address="11"),
        fixture("Front, left.", number="0", address="21"),
    ]
    rig = read_rig(write_mvr(tmp_path / "a.mvr", layered(*fixtures)))
    assert [*lights_of(rig)] == ["101 PAR _1_", "101 PAR _1_ (2)", "Front_ left_"]
    assert [x.name for x in rig.fixtures] == ["PAR *1*", "PAR *1*", "Front, left."]


def test_addresses_are_absolute_and_breaks_count_from_0_or_1(tmp_path: Path) -> None:
    two = (
        '<Addresses><Address break="0">513</Address><Address break="1">2.100</Address></Addresses>'
    )
    one = '<Addresses><Address break="1">7</Address></Addresses>'
    old = '<Addresses><Address break="0">1</Address></Addresses>'
    first = fixture("a", number="1").replace(old, two)
    second = fixture("b", number="2").replace(old, one)
    rig = read_rig(write_mvr(tmp_path / "a.mvr", layered(first, second)))
    assert [dict(x.addresses) for x in rig.fixtures] == [{1: 513, 2: 612}, {1: 7}]
    assert rig.universes == [1, 2]


def test_what_has_no_type_is_left_out_and_what_has_no_address_is_only_seen(tmp_path: Path) -> None:
    children = [
        fixture("used"),
        fixture("unpatched", number="2", address="0"),
        fixture("hoist", number="3", spec=""),
        fixture("copy", number="4", address="30").replace("<Fixture ", '<Fixture multipatch="x" '),
    ]
    show = read_show(write_mvr(tmp_path / "a.mvr", layered(*children)))
    assert [x.name for x in show.rig.fixtures] == ["used", "unpatched"]
    assert show.remarks == (
        "hoist: left out, without a GDTF",
        "copy: left out, as a copy of another fixture",
        "2 unpatched: no address, so the lights are in the scene, but nothing is sent to them",
    )


def test_nothing_is_sent_to_what_has_no_address(tmp_path: Path) -> None:
    children = [fixture("a", address="0"), fixture("b", number="2")]
    rig = read_rig(write_mvr(tmp_path / "a.mvr", layered(*children)))
    full = {
        x.name: dict.fromkeys(("red", "green", "blue", "white"), 1.0)
        for x in lights_of(rig).values()
    }
    levels = encode_levels(rig, full)
    assert levels == {1: bytes([255] * 5 + [0] * 507)}
    found = decode_levels(rig, levels)
    assert [*found["1 a"].values()] == [0.0] * 4
    assert [*found["2 b"].values()] == [1.0] * 4


def test_a_gdtf_is_found_whatever_its_letters_and_its_ending(tmp_path: Path) -> None:
    path = tmp_path / "a.mvr"
    write_mvr(path, layered(fixture(spec="Wäsche@Größe")), **{"Wäsche@Größe": gdtf()})
    assert len(read_rig(path).fixtures) == 1


def test_a_folder_completes_and_replaces_types(tmp_path: Path) -> None:
    path = write_mvr(tmp_path / "a.mvr", layered(fixture()), lamp=gdtf(name="of the show"))
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "Lamp.gdtf").write_bytes(gdtf(name="of the folder"))
    assert read_rig(path).fixtures[0].kind == "of the show"
    assert read_rig(path, gdtf_folder=tmp_path / "own").fixtures[0].kind == "of the folder"


@pytest.mark.parametrize(
    ("children", "message"),
    [
        ([], "a.mvr has no fixture"),
        ([fixture(mode="Two")], "lamp.gdtf has no mode 'Two': it has One"),
        (
            [fixture(spec="x.gdtf"), fixture("b", number="2", spec="y.gdtf")],
            "a.mvr lacks the GDTF x.gdtf, y.gdtf: give a folder that has them with gdtf_folder",
        ),
        (
            [fixture(), fixture("b", number="2", address="3")],
            "a.mvr: 'PAR' and 'b' are both on 1.3: give one of them another address",
        ),
        (
            [fixture(address="510")],
            "a.mvr: 'PAR' at 1.510 needs channel 514 of its universe, which has 512: give it a "
            "lower address",
        ),
        ([fixture(spec="")], "a.mvr has no fixture to use: PAR left out, without a GDTF"),
        ([fixture(matrix="{1,0}")], "a.mvr has a value that cannot be read: "),
        ([fixture(matrix="{0,0,0}{0,0,0}{0,0,0}{0,0,0}")], "a.mvr has a value that cannot be rea"),
        ([fixture(address="x")], "a.mvr has a value that cannot be read: "),
    ],
)
def test_a_show_that_cannot_be_used_is_one_line(
    children: list[str], message: str, tmp_path: Path
) -> None:
    path = write_mvr(tmp_path / "a.mvr", layered(*children))
    with pytest.raises(RigError) as caught:
        read_rig(path)
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


def test_damaged_types_are_one_line(tmp_path: Path) -> None:
    for data, message in {
        b"no archive": "lamp.gdtf is not a GDTF: ",
        zipped({"a.txt": "x"}): "lamp.gdtf has no description.xml",
        zipped({"description.xml": "<GDTF"}): "lamp.gdtf: description.xml is not XML: ",
        zipped({"description.xml": "<GDTF/>"}): "lamp.gdtf is not a GDTF: its description.xml has",
        gdtf(root="Elsewhere", geometries="<Axis/><Axis/>"): "lamp.gdtf has no geometry 'Elsewhe",
    }.items():
        path = write_mvr(tmp_path / "a.mvr", layered(fixture()), lamp=data)
        with pytest.raises(RigError) as caught:
            read_rig(path)
        assert str(caught.value).startswith(message)


def test_without_its_library_the_line_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(mvr.library.__globals__, "import_module", _missing)
    with pytest.raises(RigError, match=r"pip install 'lightpaint\[stage\]'"):
        read_rig(EXAMPLE)


def _missing(name: str) -> None:
    raise ImportError(name)


def test_models_of_symbols_are_in_their_places_and_repetition_has_an_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    box = (
        f'<SceneObject name="s"><Matrix>{UPRIGHT}{{0,0,1000}}</Matrix><Geometries>'
        f'<Symbol symdef="A"><Matrix>{UPRIGHT}{{500,0,0}}</Matrix></Symbol></Geometries>'
        "</SceneObject>"
    )
    path = write_mvr(tmp_path / "a.mvr", layered(fixture(), box))
    symbol = (
        '<AUXData><Symdef uuid="A"><ChildList><Geometry3D fileName="box.glb"/>'
        '<Symbol symdef="A"/></ChildList></Symdef></AUXData></Scene>'
    )
    _replace_in(path, "</Scene>", symbol)
    [model] = read_show(path).models
    assert model.file == "box.glb"
    assert np.allclose(model.matrix[:3, 3], (0.5, 0.0, 1.0))
    monkeypatch.setattr(mvr, "MAX_MODELS", 0)
    with pytest.raises(RigError, match=r"a.mvr shows more than 0 models"):
        read_show(path)


def _replace_in(path: Path, old: str, new: str) -> None:
    files = unzipped(path.read_bytes())
    name = "GeneralSceneDescription.xml"
    files[name] = files[name].decode().replace(old, new).encode()
    path.write_bytes(zipped(files))
