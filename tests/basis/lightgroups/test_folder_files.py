"""A folder of light groups in which other things lie: what is no light is left out, and told."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import run, succeed
from light_groups import channels, interleaved, pictures, write

from lightpaint.basis.file.basis_file import write_basis
from lightpaint.basis.lightgroups.light_groups import read_light_groups
from lightpaint.errors import BasisError
from lightpaint.images.estimate import Estimate, write_estimate
from lightpaint.images.formats.exr import write_rgb

LIGHTS = ["fill", "key", "rim"]


def _write_plain(path: Path, image: Any, **extra_channels: Any) -> Path:
    return write(path, ("rgb", channels("", image) | extra_channels))


@pytest.fixture(params=["beauty", "final", None])
def folder(tmp_path: Path, request: pytest.FixtureRequest) -> Path:
    """Three lights; and their sum under a name that is known, under one that is not, or not."""
    lights_folder = tmp_path / "lights"
    lights_folder.mkdir()
    for name, image in zip(LIGHTS, pictures(), strict=True):
        _write_plain(lights_folder / f"{name}.exr", image)
    if request.param:
        _write_plain(lights_folder / f"{request.param}.exr", pictures().sum(axis=0))
    return lights_folder


def _remarks(groups: Any) -> str:
    return "\n".join(groups.remarks)


def test_what_lightpaint_has_made_is_no_light(folder: Path, make_basis: Any):
    image = pictures(4)[3]
    write_rgb(folder / "template.exr", image)
    write_estimate(folder / "predicted.exr", Estimate(image, 0 * image), {})
    write_basis(folder / "a.basis.exr", make_basis(2))
    groups = read_light_groups(folder)
    assert groups.basis.names == tuple(LIGHTS)
    assert "a.basis.exr, predicted.exr, template.exr (made by lightpaint)" in _remarks(groups)


def test_a_result_from_before_there_was_a_mark_is_no_light(folder: Path):
    half = channels("half_difference", pictures()[0])
    write(folder / "verified.exr", ("rgb", channels("", pictures(4)[3]) | half))
    groups = read_light_groups(folder)
    assert groups.basis.names == tuple(LIGHTS)
    assert "verified.exr (made by lightpaint)" in _remarks(groups)


def test_the_painting_of_the_command_is_no_light(folder: Path):
    path = _write_plain(folder / "evening.exr", 2 * pictures()[1])
    groups = read_light_groups(folder, leave_out=[path])
    assert groups.basis.names == tuple(LIGHTS)
    assert "left out of the lights: evening.exr" in _remarks(groups)


def test_paintings_are_known_by_their_weights_and_by_krita(folder: Path):
    _write_plain(folder / "noon.exr", pictures(4)[3], W=np.ones((6, 8), np.float32))
    header = {"krita_layers_info": "<layers/>"}
    write(folder / "night.exr", ("rgb", channels("", pictures(5)[4])), **header)
    groups = read_light_groups(folder)
    assert groups.basis.names == tuple(LIGHTS)
    assert "noon.exr (a painting, with weights W)" in _remarks(groups)
    assert "night.exr (painted in Krita)" in _remarks(groups)


@pytest.mark.parametrize("folder", ["beauty", "final"], indirect=True)
def test_what_the_others_need_not_to_add_up_is_no_light(folder: Path):
    _write_plain(folder / "noon.exr", 1.5 * pictures()[1] + pictures()[0])
    groups = read_light_groups(folder)
    assert groups.basis.names == tuple(LIGHTS)
    assert not groups.has_rest
    assert "left out of the lights: noon.exr (without it the others add up to" in _remarks(groups)


@pytest.mark.parametrize("folder", [None], indirect=True)
def test_where_nothing_tells_that_is_told(folder: Path):
    _write_plain(folder / "noon.exr", pictures(4)[3])
    groups = read_light_groups(folder)
    assert groups.basis.names == ("fill", "key", "noon", "rim")
    remarks = _remarks(groups)
    assert (
        "unknown whether the groups add up to all of it, and whether each of them is a light"
        in remarks
    )


def test_what_systems_leave_is_passed_by(folder: Path):
    before = read_light_groups(folder)
    for name in ("._key.exr", ".hidden.exr"):
        (folder / name).write_bytes(b"\0\5\x16\7" + bytes(100))
    for name in (".DS_Store", "Thumbs.db", "desktop.ini"):
        (folder / name).write_bytes(b"\0\1")
    after = read_light_groups(folder)
    assert after.basis.names == before.basis.names
    assert after.remarks == before.remarks


def test_an_exr_of_another_name_is_told(folder: Path):
    (folder / "key.exr").rename(folder / "key.exr.tmp")
    groups = read_light_groups(folder)
    assert "key" not in groups.basis.names
    assert "key.exr.tmp (not named .exr)" in _remarks(groups)


def test_a_folder_of_nothing_else_is_refused(tmp_path: Path):
    write_rgb(tmp_path / "relit.exr", pictures()[0])
    with pytest.raises(
        BasisError, match=r"holds no light: relit\.exr \(made by lightpaint\); give"
    ):
        read_light_groups(tmp_path)


def test_the_groups_of_one_file_beside_a_painting(tmp_path: Path):
    layers = {f"RGBA_{n}": x for n, x in zip(LIGHTS, pictures(), strict=True)}
    interleaved(tmp_path / "shot.exr", layers)
    path = _write_plain(tmp_path / "evening.exr", pictures()[0])
    groups = read_light_groups(tmp_path, leave_out=[path])
    assert groups.basis.names == tuple(LIGHTS)


def test_of_a_group_without_a_pixel_nobody_is_told_to_paint_it(tmp_path: Path):
    a, b = pictures(2)
    layers = {"Combined": a + b, "Combined_key": a, "Combined_old": 0 * a}
    interleaved(tmp_path / "a.exr", layers)
    _write_plain(tmp_path / "p.exr", 0.5 * a + b)
    completed = run(tmp_path, "solve", "a.exr", "p.exr")
    assert completed.returncode == 0
    assert "the picture shows nothing of old: left unchanged" in completed.stderr
    assert "of the light of the beauty is in no group" in completed.stderr
    assert "paint where it shines" not in completed.stderr
    rows = (tmp_path / "p" / "lights.csv").read_text().splitlines()
    assert [row.split(",")[6] for row in rows if row.startswith("old")] == ["unknown"]


@pytest.mark.nightly
def test_a_solve_into_the_folder_of_its_lights_twice(folder: Path):
    """The painting lies there, and so does the first answer when it is asked again."""
    _write_plain(folder / "evening.exr", 2 * pictures()[1] + 0.5 * pictures()[2])
    arguments = ("solve", "--lights", "lights", "lights/evening.exr", "-o", "lights")
    printed = []
    for _ in range(2):
        printed.append(succeed(folder.parent, *arguments))
        table = (folder / "lights.csv").read_text().splitlines()[1:]
        assert [row.split(",")[0] for row in table] == LIGHTS
        assert [row.split(",")[6] for row in table] == ["off", "+1.000", "-1.000"]
    assert printed[0] == printed[1]
