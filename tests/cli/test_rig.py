"""`lightpaint rig`, and `export --to mvr`: from a show to a scene, and back."""

import json
import shutil
from pathlib import Path

import pytest
from command import run, run_refused, succeed
from rig_files import EXAMPLE, channel, fixture, gdtf, layered, write_mvr

from lightpaint.dmx.mvr import read_rig
from lightpaint.lighting.answer.lighting import Lighting, LightSetting
from lightpaint.lighting.answer.lighting_file import write_lighting


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with the example show and its room."""
    for file in (EXAMPLE, EXAMPLE.with_name("room.xml")):
        shutil.copy(file, tmp_path)
    return tmp_path


def test_a_show_becomes_a_scene_and_a_lights_file(folder: Path) -> None:
    output = succeed(folder, "rig", "show.mvr", "--room", "room.xml", "-o", "out/rig.xml")
    lines = output.splitlines()
    assert lines[0].split() == ["fixtures", "type", "mode", "emitters", "light", "from"]
    assert any("PAR four colours" in x and "LuminousFlux" in x for x in lines)
    assert lines[-3:] == ["6 lights, universes 1, 2", "out/rig.xml", "out/rig.lights.toml"]
    assert sorted(x.name for x in (folder / "out").iterdir()) == ["rig.lights.toml", "rig.xml"]
    assert '<include filename="../room.xml"/>' in (folder / "out" / "rig.xml").read_text()


def test_for_programs_it_prints_all_fixtures(folder: Path) -> None:
    document = json.loads(succeed(folder, "rig", "show.mvr", "--zoom", "48", "--json"))
    assert document["files"] == ["show.xml", "show.lights.toml"]
    assert [x["addresses"] for x in document["fixtures"]][:3] == [
        {"1": "2.1"},
        {"1": "2.25"},
        {"1": "1.1"},
    ]
    assert {x["type"] for x in document["types"]} == {"PAR four colours", "Wash six colours"}
    wide = (folder / "show.xml").read_text()
    succeed(folder, "rig", "show.mvr", "-o", "narrow.xml", "--zoom", "8")
    assert wide != (folder / "narrow.xml").read_text()


def test_remarks_are_beside_the_type_they_are_of(tmp_path: Path) -> None:
    write_mvr(tmp_path / "a.mvr", layered(fixture(), fixture("b", number="2", address="0")))
    completed = run(tmp_path, "rig", "a.mvr", "--only-lights")
    assert completed.returncode == 0
    assert "2 b: no address" in completed.stderr
    assert "<sensor" not in (tmp_path / "a.xml").read_text()


def test_existing_files_are_kept_unless_forced(folder: Path) -> None:
    succeed(folder, "rig", "show.mvr")
    assert "show.xml exists" in run_refused(folder, "rig", "show.mvr")
    succeed(folder, "rig", "show.mvr", "--force")
    shutil.copy(folder / "show.mvr", folder / "in.xml")
    message = run_refused(folder, "rig", "in.xml", "-o", "in.xml", "--force")
    assert "is an input of this command" in message


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("none.mvr",), "no such MVR: none.mvr"),
        (("room.xml",), "room.xml is not an MVR"),
        (("show.mvr", "--room", "none.xml"), "no such scene file: none.xml"),
        (("show.mvr", "--room", "room.xml", "--only-lights"), "give --room, or --only-lights"),
        (("show.mvr", "--gdtf", "none"), "cannot read the folder none: No such file"),
    ],
)
def test_mistakes_are_one_line(arguments: tuple[str, ...], message: str, folder: Path) -> None:
    assert message in run_refused(folder, "rig", *arguments)


def test_a_missing_type_names_the_option(tmp_path: Path) -> None:
    write_mvr(tmp_path / "a.mvr", layered(fixture(spec="x.gdtf")))
    message = run_refused(tmp_path, "rig", "a.mvr")
    assert message.endswith("a.mvr lacks the GDTF x.gdtf: give a folder that has it with --gdtf")


def test_fixtures_without_colour_data_are_listed_with_what_they_lack(tmp_path: Path) -> None:
    lacking = gdtf(described='<Emitters><Emitter Name="Red" Color="0.69,0.3,20"/></Emitters>')
    own = fixture("b", number="2", address="101", spec="whole.gdtf")
    write_mvr(tmp_path / "a.mvr", layered(fixture(), own), lamp=lacking, whole=gdtf(name="Whole"))
    message = run_refused(tmp_path, "rig", "a.mvr")
    assert message.endswith(
        "a.mvr has no colour data for 1 PAR: Lamp lacks the colour of green, the colour of blue, "
        "the colour of white; give GDTF files that have them in a folder with --gdtf, or take "
        "usual colours with --usual-colors"
    )
    assert not (tmp_path / "a.xml").exists()
    completed = run(tmp_path, "rig", "a.mvr", "--usual-colors")
    assert completed.returncode == 0
    assert "its GDTF has no colours of emitters: usual ones are assumed" in completed.stdout


def test_a_lamp_of_one_colour_is_white_and_no_error(tmp_path: Path) -> None:
    white = gdtf(channel("Dimmer", "1"), described="")
    write_mvr(tmp_path / "a.mvr", layered(fixture()), lamp=white)
    succeed(tmp_path, "rig", "a.mvr")
    assert 'name = "white"' in (tmp_path / "a.lights.toml").read_text()


def test_an_answer_goes_back_into_its_show(folder: Path) -> None:
    name = read_rig(folder / "show.mvr").fixtures[0].lights[0].name
    light = LightSetting(name, "spot", "intensity", "W/sr", (1, 0.5, 0.2), (1, 0.5, 0.2))
    write_lighting(folder / "lighting.json", Lighting((light,), target="look.png"))
    export = ("export", "lighting.json", "--to", "mvr")
    succeed(folder, *export, "--rig", "show.mvr", "-o", "out")
    assert read_rig(folder / "out" / "relit.mvr").fixtures == read_rig(folder / "show.mvr").fixtures
    assert "give --rig" in run_refused(folder, *export, "-o", "none")
    csv = ("export", "lighting.json", "--to", "csv", "--rig", "show.mvr", "-o", "none")
    assert "--rig belongs to mvr and cues" in run_refused(folder, *csv)
