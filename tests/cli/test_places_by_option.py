"""Options for places of lights: hostile values are told by the option, in one line."""

from pathlib import Path

import pytest
from command import run
from renderer import write_room

import lightpaint as lp
from lightpaint.images.formats.exr import write_rgb

#: In a lights file: rails and surfaces, and what no light can do.
LIGHTS_FILE = """
[on.rail]
line = [[-1, 1.5, 0], [1, 1.5, 0]]
[on.buried]
line = [[0, -5, 0], [1, -5, 0]]
"""


@pytest.fixture(scope="module")
def work_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A room, and a painting of it with its spot turned."""
    folder = tmp_path_factory.mktemp("room")
    scene = lp.load_scene(write_room(folder))
    turned_scene = scene.moved({"beam": lp.Pose(target=(-0.6, 0, -0.3))})
    write_rgb(folder / "p.exr", lp.render_basis(turned_scene, spp=16).current_look)
    (folder / "room.lights.toml").write_text(LIGHTS_FILE, encoding="utf-8")
    return folder


def run_refused(folder: Path, *options: str) -> str:
    """The one line that a command with these options ends in."""
    completed = run(folder, "solve", "room.xml", "p.exr", "-o", "out", *options)
    assert completed.returncode == 2
    assert not (folder / "out").exists()
    [line] = [x for x in completed.stderr.splitlines() if x.startswith("lightpaint solve: ")]
    return line.removeprefix("lightpaint solve: ")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--move bulb=nan", "--move bulb is nan: expected a distance > 0"),
        ("--move bulb=0", "--move bulb is 0.0: expected a distance > 0"),
        ("--move bulb=1e30", "--move bulb is 1e+30: expected"),
        ("--move bulb=@nowhere", "--move bulb: no rail, surface or shape 'nowhere'"),
        ("--cone panel=10:20", "--cone panel: light 'panel' has no cone"),
        ("--move sky=1", "--move sky: light 'sky' is of the kind constant"),
        ("--aim nobody=30", "--aim nobody: no light 'nobody'; there are panel"),
        ("--aim beem=30", "did you mean 'beam'?"),
        ("--aim beam=900", "--aim beam is 900.0: expected degrees"),
        ("--aim bulb=10", "--aim bulb: light 'bulb' has no direction"),
        ("--cone beam=50:10", "--cone beam is [50.0, 10.0]: expected two angles"),
        ("--beam beam=50:10", "--beam beam is [50.0, 10.0]: expected two angles"),
        ("--beam beam=wide", "'beam=wide' is not NAME=5:20, in degrees, or NAME=any"),
        ("--beam panel=any", "--beam panel: light 'panel' has no beam"),
        ("--add spot:0", "--add: count is 0: expected a whole number from 1 to 100"),
        ("--add spot:1000000", "--add: count is 1000000: expected a whole number from 1 to 100"),
        ("--add spot:2@nowhere", "--add: no rail, surface or shape 'nowhere'"),
        ("--add point --add spot:0", "--add 2: count is 0"),
        (
            "--add lamp",
            "--add: no light 'lamp' that new ones could be like; there are the kinds point, spot, "
            "panel, and the lights panel, bulb, beam",
        ),
        ("--add sopt", "no light 'sopt' that new ones could be like; did you mean 'spot'? There"),
        ("--add baem:2", "no light 'baem' that new ones could be like; did you mean 'beam'? There"),
        ("--add bulb@flor", "--add: no rail, surface or shape 'flor'; did you mean 'floor'?"),
        (
            "--move bulb=1 --no-move",
            "--move bulb and --no-move, which keeps all lights in place and adds none: leave",
        ),
        ("--no-move --add spot:2", "--add and --no-move, which keeps all"),
        ("--kelvin beam=1:2", "--kelvin beam: a colour temperature of 1 K"),
        ("--limit beam=5:1", "--limit beam "),
        ("--off nobody", "no light 'nobody'"),
    ],
)
def test_hostile_values_are_told_by_their_option(
    work_folder: Path, options: str, words: str
) -> None:
    line = run_refused(work_folder, *options.split())
    assert words in line
    assert "light." not in line
    assert "on the command line" not in line


def test_places_that_see_nothing(work_folder: Path) -> None:
    """Known only once the room is looked at: one line, nothing written."""
    line = run_refused(work_folder, "--add", "point@buried", "--spp", "4")
    assert "'new_point' has no free place that sees anything of the picture" in line


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[on.x]\nline = [[0, 1, 0], [0, 1, 0]]", "on.x.line is"),
        ("[light.beam]\nmove = { box = [[0, 0, nan], [1, 1, 1]] }", "light.beam.move.box is"),
        ("[[pair]]\nlights = ['beam', 'bulb']\nmirror = 'x = nan'", "pair.mirror is"),
        ("[[new]]\nkind = 'spot'\ncount = 0", "new.count is 0"),
        (
            "[[pair]]\nlights = ['beam', 'nope']\nmirror = 'x = 0'",
            "l.toml: pair.lights: no light 'nope'; there are panel, bulb, beam, sun, sky",
        ),
        (
            "[on.unused]\nshapes = ['flor']",
            "l.toml: on.unused.shapes: no shape 'flor'; did you mean 'floor'? There are floor, ",
        ),
        ("[[new]]\nkind = 'spot'\napart = nan", "new.apart is nan"),
    ],
)
def test_a_lights_file_is_told_by_its_keys(
    work_folder: Path, tmp_path: Path, text: str, words: str
) -> None:
    (tmp_path / "l.toml").write_text(text, encoding="utf-8")
    line = run_refused(work_folder, "--lights-file", str(tmp_path / "l.toml"))
    assert words in line


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[light.beem]\naim = 30", "light.beem.aim: no light 'beem'; did you mean 'beam'?"),
        ("[[pair]]\nlights = ['beam', 'nope']\nmirror = 'x = 0'", "no light 'nope'"),
        ("[on.unused]\nshapes = ['flor']", "no shape 'flor'"),
    ],
)
@pytest.mark.parametrize("options", ["--no-move", "--aim beam=10"])
def test_names_are_checked_whatever_moves(
    work_folder: Path, tmp_path: Path, text: str, words: str, options: str
) -> None:
    (tmp_path / "l.toml").write_text(text, encoding="utf-8")
    lights_file = ("--lights-file", str(tmp_path / "l.toml"))
    assert words in run_refused(work_folder, *lights_file, *options.split())
