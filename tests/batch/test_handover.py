"""Looks of light groups, and what other programs get of each look."""

import json
from pathlib import Path
from typing import Any

import pytest
from batches import contents
from command import run, run_refused, succeed
from light_groups import interleaved, pictures
from renderer import write_room

from lightpaint import read_light_groups, write_basis
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting_file import read_lighting

LOOKS = """
[defaults]
light_groups = "groups.exr"
want = ["predict", "export"]
export = { to = ["csv", "nuke"] }

[[look]]
painting = "dim.exr"
variations = ["warmer", "white only"]

[[look]]
painting = "bright.exr"

[[look]]
name = "by hand"
lighting = "by-hand.json"
want = ["predict"]

[[sequence]]
name = "on"
through = ["dim", "bright"]
frames = 3
want = ["predict", "export"]
export = { to = ["json"] }
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Light groups of another renderer, two paintings of them, and an answer by hand."""
    images = pictures()
    interleaved(
        tmp_path / "groups.exr", {f"RGBA_{n}": x for n, x in zip("abc", images, strict=True)}
    )
    write_rgb(tmp_path / "dim.exr", sum(images) / 4)
    write_rgb(tmp_path / "bright.exr", 2 * images[0] + images[2])
    succeed(tmp_path, "solve", "groups.exr", "dim.exr", "-o", "solved")
    (tmp_path / "by-hand.json").write_bytes((tmp_path / "solved" / "lighting.json").read_bytes())
    (tmp_path / "looks.toml").write_text(LOOKS, encoding="utf-8")
    return tmp_path


def run_looks(folder: Path, *arguments: Any) -> dict[str, Any]:
    """What the batch says of itself."""
    return dict(
        json.loads(succeed(folder, "batch", "looks.toml", "-o", "out", "--json", "-q", *arguments))
    )


@pytest.mark.parametrize("key", ["light_groups", "basis"])
def test_a_first_manifest_of_lights_without_a_scene_can_be_run(folder: Path, key: str) -> None:
    """It wants nothing that a scene is needed for."""
    source = "groups.exr"
    if key == "basis":
        source = "b.basis.exr"
        write_basis(folder / source, read_light_groups(folder / "groups.exr").basis)
    succeed(folder, "batch", "--init", source, "dim.exr", "bright.exr", "-o", "l.toml")
    assert f'{key} = "{source}"' in (folder / "l.toml").read_text("utf-8")
    plan = succeed(folder, "batch", "l.toml", "--dry-run", "-o", "out").splitlines()
    assert [x.split(maxsplit=1)[0] for x in plan] == ["look", "dim", "bright", "looks"]


@pytest.mark.nightly
def test_light_groups_stand_for_a_scene(folder: Path) -> None:
    summary = run_looks(folder, "--workers", "2")
    assert summary["failed"] == 0
    names = ["dim", "bright", "dim-warmer", "dim-white-only", "by hand", "on-0", "on-1", "on-2"]
    assert sorted(x["look"] for x in summary["looks"]) == sorted(names)
    output_folder = folder / "out"
    # As solve answers them, with what it leaves for other programs.
    lock_folder, batch_answer = (
        read_lighting(x / "lighting.json") for x in (folder / "solved", output_folder / "dim")
    )
    assert lock_folder.emission == batch_answer.emission
    for name in ("dim", "dim-warmer", "by hand", "on-1"):
        assert (output_folder / name / "relit.nk").is_file()
    assert sorted(x.name for x in (output_folder / "dim-warmer" / "export").iterdir()) == [
        *("fixtures.csv", "relit.nk", "result.json")
    ]
    assert (output_folder / "on-1" / "export" / "fixtures.json").is_file()
    assert not (output_folder / "by hand" / "export").exists()
    by_name = {look["look"]: look for look in summary["looks"]}
    assert "dim/export/fixtures.csv" in by_name["dim"]["files"]
    # The same to the last byte by one process.
    before = contents(output_folder)
    assert "done earlier" in run(folder, "batch", "looks.toml", "-o", "out").stderr
    assert contents(output_folder) == before


@pytest.mark.nightly
def test_what_other_programs_get_is_made_again_alone(folder: Path) -> None:
    run_looks(folder)
    output_folder = folder / "out"
    inodes = {
        name: (output_folder / name / "lighting.json").stat().st_ino for name in ("dim", "bright")
    }
    text = LOOKS.replace('"csv", "nuke"', '"json"')
    (folder / "looks.toml").write_text(text, encoding="utf-8")
    run_looks(folder)
    assert sorted(x.name for x in (output_folder / "dim" / "export").iterdir()) == [
        *("fixtures.json", "result.json")
    ]
    for name, inode in inodes.items():
        assert (output_folder / name / "lighting.json").stat().st_ino == inode
    # What somebody has deleted, and what follows from another painting, comes again.
    (output_folder / "bright" / "export" / "fixtures.json").unlink()
    write_rgb(folder / "dim.exr", 3 * pictures()[1])
    before = (output_folder / "dim" / "export" / "fixtures.json").read_bytes()
    run_looks(folder)
    assert (output_folder / "bright" / "export" / "fixtures.json").is_file()
    assert (output_folder / "dim" / "export" / "fixtures.json").read_bytes() != before
    # As if nothing had been there.
    second_contents = contents(output_folder)
    (folder / "looks.toml").write_text(text, encoding="utf-8")
    succeed(folder, "batch", "looks.toml", "-o", "fresh", "-q")
    assert contents(folder / "fresh").keys() == second_contents.keys()


def test_forms_that_a_look_has_nothing_for_are_told_before(folder: Path) -> None:
    write_room(folder)
    groups, want_export = 'light_groups = "groups.exr"\n', 'want = ["export"]\n'
    for extra_lines, message in (
        ('light_groups = "gone.exr"\n', "light_groups: no such file or folder: gone.exr"),
        (groups + 'basis = "groups.exr"\n', "light_groups stand for scene and basis: give them"),
        ('scene = "room.xml"\npattern = "{name}"\n', "pattern is of light_groups"),
        ('basis = "groups.exr"\n', 'are given as light_groups = "groups.exr"'),
        (groups + 'sensors = ["a"]\n', "a basis has only one view"),
        (groups + "settings = { spp = 4 }\n", "spp"),
        (
            groups + want_export + 'export = { to = ["mitsuba"] }\n',
            "'mitsuba' is of a scene, and no",
        ),
        (
            groups + want_export + 'export = { to = ["maya"] }\n',
            "to is ['maya']: expected a list of",
        ),
        (groups + want_export + 'export = { stage = "a.usda" }\n', "stage is of the form 'usd'"),
        (groups + 'want = ["predict"]\nexport = {}\n', "want does not have 'export'"),
    ):
        text = f'[[look]]\npainting = "dim.exr"\n{extra_lines}'
        (folder / "looks.toml").write_text(text, encoding="utf-8")
        line = run_refused(folder, "batch", "looks.toml", "-o", "none")
        assert line.startswith("lightpaint batch: looks.toml: look 'dim.exr'"), line
        assert message in line
        assert not (folder / "none").exists()
