"""What `solve` starts from, as it is given on the command line."""

from argparse import Namespace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from light_groups import channels, interleaved, pictures, write

from lightpaint.basis.file import write_basis
from lightpaint.basis.lightgroups.read import read_light_groups
from lightpaint.cli.sources import GroupSource, light_group_source, read_source
from lightpaint.errors import BasisError
from lightpaint.target.target import Target


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, make_basis: Any) -> Path:
    """A folder with light groups, paintings, a scene, a basis and results."""
    monkeypatch.chdir(tmp_path)
    layers = {f"RGBA_{name}": x for name, x in zip("abc", pictures(), strict=True)}
    interleaved(tmp_path / "groups.exr", layers | {"RGBA": pictures().sum(axis=0)})
    interleaved(tmp_path / "with,comma.exr", layers)
    write(tmp_path / "painting.exr", ("rgb", channels("", pictures()[0])))
    (tmp_path / "scene.xml").write_text("<scene/>")
    write_basis(tmp_path / "a.basis.exr", make_basis(2))
    (tmp_path / "key").mkdir()
    write(tmp_path / "key" / "predicted.exr", ("rgb", channels("", pictures()[0])))
    (tmp_path / "empty").mkdir()
    return tmp_path


def _options(source: str, *targets: str, lights: str | None = None, **given: Any) -> Namespace:
    names = None if lights is None else lights.split(",")
    return Namespace(source=source, targets=list(targets), lights=names, **given)


@pytest.mark.parametrize(
    ("options", "path", "targets"),
    [
        (_options("painting.exr", lights="groups.exr"), "groups.exr", ["painting.exr"]),
        (_options("a.exr", "b.exr", lights="groups.exr"), "groups.exr", ["a.exr", "b.exr"]),
        (_options("a.exr", lights="with,comma.exr"), "with,comma.exr", ["a.exr"]),
        (_options("a.exr", lights="key"), "key", ["a.exr"]),
        (_options("groups.exr", "a.exr"), "groups.exr", ["a.exr"]),
        (_options("key", "a.exr"), "key", ["a.exr"]),
    ],
)
@pytest.mark.usefixtures("here")
def test_light_groups_by_either_spelling(options: Namespace, path: str, targets: list[str]):
    assert light_group_source(options) == GroupSource(Path(path), tuple(targets))


@pytest.mark.parametrize(
    "options",
    [
        _options("scene.xml", "painting.exr"),
        _options("scene.xml", "painting.exr", lights="key,window_*"),
        _options("scene.xml", "painting.exr", lights="key"),  # though there is such a folder
        _options("a.basis.exr", "painting.exr"),
        _options("missing.exr", "painting.exr"),  # which reading it will say
    ],
)
@pytest.mark.usefixtures("here")
def test_everything_else_is_what_it_was(options: Namespace):
    assert light_group_source(options) is None


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (_options("painting.exr", lights="nowhere.exr"), "no such file .* nowhere.exr"),
        (_options("painting.exr", lights="a.basis.exr"), "holds no light groups"),
        (_options("scene.xml", "p.exr", pattern="{name}"), "--pattern names the layers"),
    ],
)
@pytest.mark.usefixtures("here")
def test_slips_are_said(options: Namespace, says: str):
    with pytest.raises(BasisError, match=says):
        light_group_source(options)


@pytest.mark.parametrize(
    ("given", "named"),
    [
        ({"spp": 64}, "--spp"),
        ({"refine": 1, "noise_correction": True}, "--refine, --correct-noise"),
        ({"time_s": 3.0}, "--time"),
        ({"quality": "final"}, "--quality"),
        ({"views": [("a", "b")]}, "--target"),
        ({"groups": [("a", ["b"])]}, "--group"),
        ({"cd_per_unit": 100.0}, "--unit"),
        ({"sensor": "1", "parameters": [("a", "b")], "variant": "x"}, "-s, -D, -m"),
    ],
)
@pytest.mark.usefixtures("here")
def test_options_that_need_a_renderer_are_refused(given: dict[str, Any], named: str):
    options = _options("groups.exr", "painting.exr", **given)
    source = light_group_source(options)
    assert source is not None
    with pytest.raises(BasisError, match=f"^{named} cannot be had from groups.exr"):
        read_source(source, options)


@pytest.mark.usefixtures("here")
def test_names_of_lights_are_refused_with_a_way_out():
    options = _options("groups.exr", "painting.exr", lights="a,b")
    source = light_group_source(options)
    assert source is not None
    with pytest.raises(BasisError, match=r"--lights a,b chooses lights of a scene.* --lock NAME"):
        read_source(source, options)


@pytest.mark.usefixtures("here")
def test_groups_are_read_with_their_pattern():
    options = _options("painting.exr", lights="groups.exr", seed=0, spp=None, cache=True)
    source = light_group_source(options)
    assert source is not None
    assert read_source(source, options).basis.names == ("a", "b", "c")
    options.pattern = "RGBA_{name}"
    assert read_source(source, options).renderer == "--pattern RGBA_{name}"


def test_holes_are_taken_from_the_painting(tmp_path: Path):
    images = pictures()
    images[0, 1, 2] = np.nan
    layers = {f"RGBA_{name}": x for name, x in zip("abc", images, strict=True)}
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers))
    importance = np.ones(images.shape[1:3], np.float32)
    target = Target("t", images[1], importance, everything=True, not_finite=2)
    counted = target.without(groups.holes)
    assert (counted.importance == 0).sum() == 1
    assert counted.importance[1, 2] == 0
    assert counted.not_finite == 3
    assert counted.without(groups.holes) is counted
