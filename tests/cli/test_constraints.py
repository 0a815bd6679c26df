"""Constraints as a user writes them: options and a lights file, through to a verified render."""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import run, run_refused, succeed
from renderer import write_room

from lightpaint import Constraints, paint_with_light, read_basis
from lightpaint.cli.options.parser import command_parser
from lightpaint.colour.color import kelvin_to_rgb, luminance
from lightpaint.images.formats.exr import write_rgb
from lightpaint.scene.scene_reader import load_scene

FILE = """
sparse = 3
prefer_current = 0.001

[light.sun]
off = true

[light."b*"]
color = "3200K"
limits = { max = "80%" }

[light.panel]
lock = "50%"
"""


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A room, a basis of it and a painting."""
    folder = tmp_path_factory.mktemp("room")
    path = write_room(folder)
    succeed(folder, "basis", path, "--spp", 32, "-o", "room.basis.exr")
    image = read_basis(folder / "room.basis.exr").images.sum(axis=0)
    write_rgb(folder / "t.exr", 0.7 * image)
    return folder


def _lights(folder: Path) -> dict[str, Any]:
    data = json.loads((folder / "lighting.json").read_text(encoding="utf-8"))
    return dict(data["lights"])


def test_a_lights_file_holds_lights_and_the_render_confirms_it(room: Path, tmp_path: Path) -> None:
    for name in ("room.xml", "t.exr"):
        shutil.copy(room / name, tmp_path)
    (tmp_path / "room.lights.toml").write_text(FILE, encoding="utf-8")
    output = succeed(
        tmp_path, "solve", "room.xml", "t.exr", "--spp", 64, "-o", "out", "--table", "full"
    )
    assert "Rendered again: equal within noise." in output
    assert "lock 50%*" in output
    assert "by number of lights" in output
    lights = _lights(tmp_path / "out")
    assert lights["sun"]["emission"] == [0, 0, 0]
    assert lights["panel"]["emission"] == pytest.approx([2, 1.5, 1])
    assert lights["panel"]["constraint"] == "lock 50%"
    bulb = np.array(lights["bulb"]["emission"])
    # The scene's emission has gone through float32.
    assert luminance(bulb) <= 0.8 * luminance(np.array([0.5, 0.6, 0.7])) * (1 + 1e-6)
    np.testing.assert_allclose(bulb, luminance(bulb) * kelvin_to_rgb(3200), rtol=1e-9)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "lock 50% (limits it)" in page

    # The command line goes before the file, the file may be left out, and relight needs neither.
    succeed(tmp_path, "solve", "room.xml", "t.exr", "--spp", 64, "--lock", "sun", "-o", "two")
    assert _lights(tmp_path / "two")["sun"]["emission"] == pytest.approx([1, 0.9, 0.8])
    arguments = ("room.xml", "t.exr", "--spp", 64, "--no-lights-file", "-o", "free")
    succeed(tmp_path, "solve", *arguments)
    assert not any("constraint" in light for light in _lights(tmp_path / "free").values())
    succeed(tmp_path, "relight", "room.xml", "out/lighting.json", "--spp", 4, "-o", "again")

    # The same from Python.
    scene = load_scene(tmp_path / "room.xml")
    look = paint_with_light(
        scene,
        tmp_path / "t.exr",
        tmp_path / "api",
        spp=64,
        constraints=Constraints.of({"sun": {"lock": True}}),
    )
    assert _lights(tmp_path / "api") == _lights(tmp_path / "two")
    assert look.verification is not None
    assert look.verification.agrees


@pytest.mark.nightly
def test_every_option_from_a_saved_basis(room: Path, tmp_path: Path) -> None:
    options = ["--lock", "panel=#ffaa66 2", "--limit", "bulb=0.1:40%", "--tie", "sun,sky"]
    options += ["--color", "beam=1,0.5,0.25", "--prefer-current", "0.01"]
    solve = ("solve", room / "room.basis.exr", room / "t.exr")
    succeed(tmp_path, *solve, *options, "-o", "a")
    lights = _lights(tmp_path / "a")
    assert luminance(np.array(lights["panel"]["emission"])) == pytest.approx(2)
    beam = np.array(lights["beam"]["emission"])
    np.testing.assert_allclose(beam / beam[0], [1, 0.5, 0.25])
    sun, sky = (np.array(lights[name]["emission"]) for name in ("sun", "sky"))
    np.testing.assert_allclose(sun / [1, 0.9, 0.8], (sky / [0.1, 0.2, 0.3])[0])
    assert lights["sun"]["constraint"] == "tied (sun, sky)"

    options = ["--kelvin", "b*=2700:6500", "--primaries", "sky=#f00,#0f0,#00f,3000K"]
    options += ["--off", "sun", "--sparse", "3", "--limit", "panel=:1,1,1"]
    succeed(tmp_path, *solve, *options, "-o", "b")
    lights = _lights(tmp_path / "b")
    assert not any(lights["sun"]["emission"])
    assert max(lights["panel"]["emission"]) <= 1
    assert sum(any(light["emission"]) for light in lights.values()) <= 3
    assert lights["bulb"]["constraint"].startswith("2700 to 6500 K")

    (tmp_path / "l.toml").write_text('lights = ["x"]\n[light.sun]\noff = true\n', encoding="utf-8")
    succeed(tmp_path, *solve, "--lights-file", "l.toml", "-o", "c")
    assert not any(_lights(tmp_path / "c")["sun"]["emission"])


def _parse(*options: str) -> Any:
    return command_parser().parse_args(["solve", "b.basis.exr", "t.exr", *options])


def test_a_temperature_may_be_away_from_plancks_locus() -> None:
    options = _parse("--kelvin", "a=2700:6500,duv=-0.005", "--kelvin", "b=3200K, duv=1e-2")
    assert options.kelvin == [("a", [2700, 6500]), ("b", [3200])]
    assert options.duv == [("a", -0.005), ("b", 0.01)]
    # What is said last holds, and no list is shared between two commands.
    options = _parse("--kelvin", "a=2700,duv=0.01", "--kelvin", "a=3000")
    assert (options.kelvin[-1], options.duv) == (("a", [3000]), [])
    assert (_parse().kelvin, _parse().duv) == ([], [])


def test_a_temperature_away_from_plancks_locus_is_solved_for(room: Path, tmp_path: Path) -> None:
    solve = ("solve", room / "room.basis.exr", room / "t.exr", "-o", "out")
    succeed(tmp_path, *solve, "--kelvin", "bulb=3200,duv=0.01")
    bulb = np.array(_lights(tmp_path / "out")["bulb"]["emission"])
    np.testing.assert_allclose(bulb, luminance(bulb) * kelvin_to_rgb(3200, 0.01), rtol=1e-9)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--lock", "pannel"), "no light 'pannel'; did you mean 'panel'"),
        (("--limit", "bulb=3"), "'3' is not MIN:MAX"),
        (("--limit", "bulb=3:2"), "min of 3 above its max of 2"),
        (("--limit", "bulb=:"), "--limit bulb is empty: expected min, max or both"),
        (("--color", "bulb"), "'bulb' is not NAME=VALUE"),
        (("--color", "bulb=blue"), "--color bulb is 'blue': expected a colour"),
        (("--kelvin", "bulb=warm"), "is not NAME=2700:6500"),
        (("--kelvin", "bulb=2700,duv=green"), "with or without ,duv=0.003 after it"),
        (("--kelvin", "bulb=2700,tint=0.01"), "with or without ,duv=0.003 after it"),
        (("--method", "newton"), "invalid choice: 'newton'"),
        (("--lock", "bulb", "--off", "bulb"), "both 'lock' and 'off'"),
        (("--tie", "bulb"), "a tie has at least two"),
        (("--sparse", "0"), "is not a whole number >= 1"),
        (("--prefer-current", "-1"), "is not a number >= 0"),
    ],
)
def test_options_that_mean_nothing_are_refused_in_one_line(
    room: Path, tmp_path: Path, arguments: tuple[str, ...], words: str
) -> None:
    # From the scene: nothing may have been rendered.
    line = run_refused(tmp_path, "solve", room / "room.xml", room / "t.exr", *arguments)
    assert words in line


def test_a_lights_file_with_a_wrong_value_names_file_light_and_key(
    room: Path, tmp_path: Path
) -> None:
    (tmp_path / "l.toml").write_text('[light.bulb]\ncolor = "blue"\n', encoding="utf-8")
    completed = run(
        tmp_path, "solve", room / "room.xml", room / "t.exr", "--lights-file", tmp_path / "l.toml"
    )
    assert completed.returncode == 2
    assert f"{tmp_path / 'l.toml'}: light.bulb.color is 'blue': expected" in completed.stderr
    assert "basis:" not in completed.stderr


def test_two_scales_are_refused(room: Path) -> None:
    (room / "two.toml").write_text("cd_per_unit = 1000\n")
    words = ["solve", "room.xml", "t.exr", "--lights-file", "two.toml", "--unit", 500]
    assert "cd_per_unit is 1000 in the lights file and 500 by --unit" in run_refused(room, *words)
