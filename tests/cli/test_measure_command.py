"""`lightpaint measure` as a user meets it: a table, files, and one line for each mistake."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import run, run_refused, succeed
from lit_planes import BULB, DISC, floor, write_scene
from PIL import Image
from webs import cosine, ies_text, write_web

from lightpaint.lighting.answer.lighting import Lighting, LightSetting
from lightpaint.lighting.answer.lighting_file import write_lighting
from lightpaint.scene.scene_reader import load_scene

PLANES = """
[plane.desk]
shape = "floor"
height = 0.5
grid = 1.0
preset = "office"
[plane.spots]
points = [[0, 0, 0], [0.8, 0, 0]]
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with a scene lit.xml and its planes file."""
    write_scene(tmp_path, BULB + floor(), max_depth=2)
    (tmp_path / "lit.planes.toml").write_text(PLANES, encoding="utf-8")
    return tmp_path


def mean_of(folder: Path, plane: str = "spots") -> float:
    document = json.loads((folder / "measured" / "planes.json").read_text("utf-8"))
    return float(document["planes"][plane]["mean"])


BELOW = """<emitter type="point" id="below"><point name="position" x="0" y="-2" z="0"/>
    <rgb name="intensity" value="100"/></emitter>"""


def test_lights_without_a_scale_may_reach_no_plane(folder: Path) -> None:
    write_web(folder / "lamp.ies", ies_text(cosine))
    toml = '[light.bulb]\nphotometry = "lamp.ies"\n'
    (folder / "lit.lights.toml").write_text(toml, encoding="utf-8")
    write_scene(folder, BULB + floor(8) + BELOW, max_depth=2)
    succeed(folder, "measure", "lit.xml")
    write_scene(folder, BULB + floor(8) + BELOW + DISC, max_depth=2)
    refused = run(folder, "measure", "lit.xml", "-o", "refused")
    assert refused.returncode == 2
    assert not (folder / "refused").exists()
    error = refused.stderr.splitlines()[-1]  # after the remarks of the measurement
    assert "'disc', which reaches desk, is in W/(m² sr), beside lamps" in error
    assert "--unit 1" in error
    succeed(folder, "measure", "lit.xml", "--force", "--unit", "1")


def test_a_table_and_files(folder: Path) -> None:
    output = succeed(folder, "measure", "lit.xml", "--unit", "4")
    head, desk, spots, *rest = output.splitlines()
    assert head.split() == [
        "plane",
        "points",
        "Em",
        "lx",
        "±",
        "U0",
        "±",
        "least",
        "lx",
        "most",
        "lx",
    ]
    assert desk.split()[:2] == ["desk", "16"]
    distance = np.array([2, np.hypot(2, 0.8)])
    expected = 4 * 100 * 2 / distance**3
    words = spots.split()
    assert words[0] == "spots"
    assert float(words[2]) == pytest.approx(expected.mean(), rel=1e-3)
    assert float(words[4]) == pytest.approx(expected[1] / expected.mean(), abs=0.006)
    assert rest[0].startswith("desk: a mean of ")
    with open(folder / "measured" / "planes.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 18
    lux = [float(row["lux"]) for row in rows if row["plane"] == "spots"]
    np.testing.assert_allclose(lux, expected, rtol=1e-3)
    document = json.loads((folder / "measured" / "planes.json").read_text("utf-8"))
    desk_document = document["planes"]["desk"]
    assert desk_document["wishes"]["mean"] == 500
    assert "EN 12464-1:2021" in desk_document["wishes"]["preset_from"]
    assert sum(desk_document["mean_by_light"].values()) == pytest.approx(desk_document["mean"])
    for name in ("desk", "spots"):
        with Image.open(folder / "measured" / f"{name}.png") as picture:
            assert min(picture.size) > 100


def test_the_figures_of_a_preset_are_said_with_their_source(folder: Path) -> None:
    completed = run(folder, "measure", "lit.xml", "--unit", "4")
    assert "EN 12464-1:2021: 500 lx at a uniformity of 0.6" in completed.stderr
    assert "check them" in completed.stderr


def test_a_document_for_programs(folder: Path) -> None:
    output = succeed(folder, "measure", "lit.xml", "--unit", "4", "--json", "--spp", "16")
    document = json.loads(output)
    assert document["cd_per_unit"] == 4
    assert set(document["planes"]) == {"desk", "spots"}
    assert all((folder / file).is_file() for file in document["files"])


def test_the_unit_comes_from_the_lights_file_or_an_answer(folder: Path) -> None:
    (folder / "lit.lights.toml").write_text("cd_per_unit = 4.0", encoding="utf-8")
    succeed(folder, "measure", "lit.xml")
    of_scene = mean_of(folder)
    assert of_scene == pytest.approx(4 * 50 * (2 / 8 + 2 / np.hypot(2, 0.8) ** 3), rel=1e-3)
    assert "is 4 in the lights file and 5 by --unit" in run_refused(
        folder, "measure", "lit.xml", "--unit", "5"
    )
    (folder / "lit.lights.toml").unlink()
    scene = load_scene(folder / "lit.xml")
    bulb = scene.light("bulb")
    setting = LightSetting("bulb", "point", bulb.parameter, bulb.unit, (50, 50, 50), (1, 1, 1))
    answer = Lighting((setting,), scene_identity=scene.identity, cd_per_unit=4.0)
    write_lighting(folder / "lighting.json", answer)
    succeed(folder, "measure", "lit.xml", "--lighting", "lighting.json")
    assert mean_of(folder) == pytest.approx(of_scene / 2, rel=1e-3)
    write_lighting(folder / "lighting.json", replace(answer, cd_per_unit=None))
    line = run_refused(folder, "measure", "lit.xml", "--lighting", "lighting.json")
    assert "a radiance of 1 is how many cd/m²? Lux need that number: add --unit" in line


def test_mistakes_have_one_line(folder: Path) -> None:
    assert "add --unit" in run_refused(folder, "measure", "lit.xml")
    both = run_refused(folder, "measure", "lit.xml", "--unit", "4", "--spp", "8", "--error", "1%")
    assert "either the largest error" in both
    (folder / "lit.planes.toml").unlink()
    line = run_refused(folder, "measure", "lit.xml", "--unit", "4")
    assert "lit.planes.toml does not exist" in line
    assert "--planes" in line


def test_foreign_files_are_kept_and_own_ones_replaced(folder: Path) -> None:
    (folder / "measured").mkdir()
    (folder / "measured" / "desk.png").write_text("mine", encoding="utf-8")
    line = run_refused(folder, "measure", "lit.xml", "--unit", "4", "--spp", "8")
    assert "exists and is of no measurement" in line
    succeed(folder, "measure", "lit.xml", "--unit", "4", "--spp", "8", "--force")
    again = run(folder, "measure", "lit.xml", "--unit", "4", "--spp", "8")
    assert again.returncode == 0
    assert "measured had a measurement, lit.xml: it is replaced (-o names another)" in again.stderr


def test_all_lights_count_also_those_that_are_kept(folder: Path) -> None:
    write_scene(folder, BULB + DISC, max_depth=2)
    text = "[plane.spots]\npoints = [[0, 0, 0], [0.8, 0, 0]]\n"
    (folder / "lit.planes.toml").write_text(text, encoding="utf-8")
    succeed(folder, "measure", "lit.xml", "--unit", "4")
    every = mean_of(folder)
    succeed(folder, "measure", "lit.xml", "--unit", "4", "--lights", "bulb")
    assert mean_of(folder) == pytest.approx(every, rel=0.02)
