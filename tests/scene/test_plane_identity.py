"""Identities of planes: what changes a light's image changes it, and nothing else does."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from renderer import GLOSSY, LIGHTS, PATH, write_room

from lightpaint.images.formats.exr import write_rgb
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

#: Lights of the test room.
ALL = set(LIGHTS)


def identities(folder: Path, edits: dict[str, str] | None = None, **options: Any) -> dict[str, str]:
    """Identities in the test room by name of light, after some edits of its XML."""
    room_options = {
        key: options.pop(key) for key in ("integrator", "wall", "lights", "film") if key in options
    }
    path = write_room(folder, **room_options)
    text = path.read_text(encoding="utf-8")
    for old, new in (edits or {}).items():
        assert old in text
        text = text.replace(old, new)
    path.write_text(text, encoding="utf-8")
    return by_name(load_scene(path, **options))


def by_name(scene: Scene) -> dict[str, str]:
    return dict(zip([x.name for x in scene.lights], scene.light_identities, strict=True))


def changed(before: dict[str, str], after: dict[str, str]) -> set[str]:
    return {name for name in before if after.get(name) != before[name]}


@pytest.mark.parametrize(
    ("edit", "changed_names"),
    [
        # Where a lamp is, where it points, how wide its cone is.
        ({'x="-0.5" y="1" z="0.5"': 'x="-0.4" y="1" z="0.5"'}, {"bulb"}),
        ({'origin="0.8 1.8 1.5"': 'origin="0.8 1.8 1.4"'}, {"beam"}),
        ({'"cutoff_angle" value="30"': '"cutoff_angle" value="31"'}, {"beam"}),
        ({'x="0.3" y="-1" z="-1"': 'x="0.3" y="-1" z="-0.99999999"'}, {"sun"}),
        # A shape that shines blocks and reflects the light of all.
        ({'<translate y="1.9"/>': '<translate y="1.8"/>'}, ALL),
        ({'<shape type="rectangle" id="panel">': '<shape type="disk" id="panel">'}, ALL),
        # What all light meets, and what it is seen by.
        ({"0.7 0.5 0.4": "0.7 0.5 0.41"}, ALL),
        ({'"radius" value="0.3"': '"radius" value="0.31"'}, ALL),
        ({'"fov" value="50"': '"fov" value="51"'}, ALL),
        ({'"height" value="20"': '"height" value="18"'}, ALL),
        ({'"max_depth" value="5"': '"max_depth" value="6"'}, ALL),
        # Colour and brightness, and names, also of what is no light.
        ({"4 3 2": "1 1 9", "0.5 0.6 0.7": "0 0 0", "3 3 3": "8 3 3", "1 0.9 0.8": "0 2 0"}, set()),
        ({'rgb name="radiance" value="0.1 0.2 0.3"': 'spectrum name="radiance" value="2"'}, set()),
        ({'id="floor"': 'id="ground"'}, set()),
        ({"<shape type=": "<!-- a remark --><shape type="}, set()),
        # Samples per pixel and the filter, which a basis replaces.
        ({'"spp" value="16"': '"spp" value="32"'}, set()),
        ({"</film>": '<rfilter type="gaussian"/></film>'}, set()),
    ],
)  # fmt: skip
def test_what_a_change_changes(
    tmp_path: Path, edit: dict[str, str], changed_names: set[str]
) -> None:
    assert changed(identities(tmp_path), identities(tmp_path, edit)) == changed_names


def test_a_name_is_no_part_of_it(tmp_path: Path) -> None:
    before = identities(tmp_path)
    renames = {f'id="{name}"': f'id="a_{name}"' for name in LIGHTS}
    after = identities(tmp_path, renames)
    assert {f"a_{name}": identity for name, identity in before.items()} == after


def test_lights_are_told_apart(tmp_path: Path) -> None:
    assert len(set(identities(tmp_path).values())) == len(LIGHTS)


def test_a_lamp_that_comes_or_goes_leaves_the_others(tmp_path: Path) -> None:
    before = identities(tmp_path)
    lamps = "".join(LIGHTS.values()) + '<emitter type="point" id="new"/>'
    after = identities(tmp_path, lights=lamps)
    assert set(after) - set(before) == {"new"}
    assert changed(before, after) == set()
    # In another order, and without those that are not shapes.
    fewer = identities(tmp_path, lights=LIGHTS["sun"] + LIGHTS["panel"])
    assert {name: before[name] for name in ("panel", "sun")} == fewer
    assert changed(before, identities(tmp_path, lights=LIGHTS["sun"] + LIGHTS["bulb"])) == ALL


def test_what_surrounds_a_scene_counts_where_paths_pass_surfaces(tmp_path: Path) -> None:
    """There Mitsuba counts a path as one that met nothing, and what it gathered as nothing."""
    lights = LIGHTS["bulb"] + LIGHTS["panel"]
    assert changed(
        identities(tmp_path, lights=lights), identities(tmp_path, lights=lights + LIGHTS["sky"])
    ) == set()  # fmt: skip
    mask = f'<bsdf type="mask"><float name="opacity" value="0.5"/>{GLOSSY}</bsdf>'
    options = {"wall": mask, "lights": lights}
    before = identities(tmp_path, **options)
    options["lights"] += LIGHTS["sky"]
    assert changed(before, identities(tmp_path, **options)) == {"bulb", "panel"}


def test_parameters_count_by_what_they_change(tmp_path: Path) -> None:
    default = '<default name="spp"'
    edit = {'x="-0.5" y="1"': 'x="$x" y="1"', default: f'<default name="x" value="0"/>{default}'}
    before = identities(tmp_path, edit)
    assert changed(before, identities(tmp_path, edit, parameters={"spp": 99})) == set()
    assert changed(before, identities(tmp_path, edit, parameters={"x": 1})) == {"bulb"}
    assert changed(before, identities(tmp_path, edit, parameters={"width": 28})) == ALL


def test_another_integrator_is_another_scene(tmp_path: Path) -> None:
    before = identities(tmp_path)
    assert changed(before, identities(tmp_path, integrator=PATH.replace("path", "volpath"))) == ALL
    direct_scene = load_scene(write_room(tmp_path), integrator="direct")
    assert changed(before, by_name(direct_scene)) == ALL


def test_includes_and_folders_do_not_count(tmp_path: Path) -> None:
    """Where a scene lies, and over how many files it is spread, is not part of it."""
    before = identities(tmp_path)
    other = tmp_path / "other"
    other.mkdir()
    path = write_room(other, lights='<include filename="bulb.xml"/>' + "".join(
        LIGHTS[name] for name in LIGHTS if name != "bulb"
    ), name="hall.xml")  # fmt: skip
    part = other / "bulb.xml"
    part.write_text(f'<scene version="3.0.0">{LIGHTS["bulb"]}</scene>', encoding="utf-8")
    assert by_name(load_scene(path)) == before
    part.write_text(part.read_text().replace('y="1"', 'y="0.9"'), encoding="utf-8")
    assert changed(before, by_name(load_scene(path))) == {"bulb"}


def test_textures_count_as_they_are_on_disk(tmp_path: Path) -> None:
    """The one of a lamp for it alone, the one of a wall for all."""
    image = np.ones((4, 4, 3), np.float32)
    for name in ("lamp.exr", "wall.exr"):
        write_rgb(tmp_path / name, image)
    bitmap = """<texture type="bitmap" name="{}"><string name="filename" value="{}"/>
        <boolean name="raw" value="true"/></texture>"""
    slide = bitmap.format("irradiance", "lamp.exr")
    lamp = f'<emitter type="projector" id="beamer">{slide}</emitter>'
    wall = f'<bsdf type="diffuse">{bitmap.format("reflectance", "wall.exr")}</bsdf>'
    options: dict[str, Any] = {"lights": LIGHTS["bulb"] + lamp, "wall": wall}
    before = identities(tmp_path, **options)
    write_rgb(tmp_path / "lamp.exr", image * 0.5)
    assert changed(before, after := identities(tmp_path, **options)) == {"beamer"}
    write_rgb(tmp_path / "wall.exr", image * 0.5)
    assert changed(after, identities(tmp_path, **options)) == {"bulb", "beamer"}
    write_rgb(tmp_path / "lamp.exr", image)
    write_rgb(tmp_path / "wall.exr", image)
    assert identities(tmp_path, **options) == before
    # By content, under whatever name.
    (tmp_path / "lamp.exr").rename(tmp_path / "slide.exr")
    options["lights"] = options["lights"].replace("lamp.exr", "slide.exr")
    assert identities(tmp_path, **options) == before


def test_groups_and_what_is_kept_count_by_their_members(tmp_path: Path) -> None:
    pair = {"groups": {"pair": ["bulb", "beam"]}}
    before = identities(tmp_path, **pair)  # of two kinds: in proportion, as they are authored
    assert changed(before, identities(tmp_path, groups={"couple": ["bulb", "beam"]})) == {"pair"}
    assert before["pair"] == identities(tmp_path, groups={"couple": ["bulb", "beam"]})["couple"]
    assert changed(before, identities(tmp_path, {"0.5 0.6 0.7": "0.5 0.6 0.8"}, **pair)) == {"pair"}
    assert changed(before, identities(tmp_path, {'y="1" z="0.5"': 'y="1.1" z="0.5"'}, **pair)) == {
        "pair"
    }
    assert changed(before, identities(tmp_path, groups={"pair": ["bulb", "sun"]})) >= {"pair"}
    # What is kept is kept as it is, colour and brightness included.
    scene = load_scene(write_room(tmp_path), lights=["panel", "beam"])
    rest = by_name(scene)
    assert set(rest) == {"panel", "beam", "rest"}
    text = scene.path.read_text(encoding="utf-8")
    scene.path.write_text(text.replace("0.5 0.6 0.7", "0.5 0.6 0.8"), encoding="utf-8")
    assert changed(rest, by_name(load_scene(scene.path, lights=["panel", "beam"]))) == {"rest"}
    scene.path.write_text(text.replace("4 3 2", "4 3 1"), encoding="utf-8")
    assert changed(rest, by_name(load_scene(scene.path, lights=["panel", "beam"]))) == set()


def test_emitters_of_one_colour_that_are_tied_have_no_colour(tmp_path: Path) -> None:
    two = LIGHTS["bulb"] + LIGHTS["bulb"].replace('"bulb"', '"other"').replace('y="1"', 'y="0.5"')
    tied: dict[str, Any] = {"lights": two, "groups": {"pair": ["bulb", "other"]}}
    before = identities(tmp_path, **tied)
    assert identities(tmp_path, {"0.5 0.6 0.7": "1 2 3"}, **tied) == before
    # One of them another way: then they keep their proportion.
    tied["lights"] = re.sub("0.5 0.6 0.7", "1 2 3", two, count=1)
    assert changed(before, identities(tmp_path, **tied)) == {"pair"}


def test_views_are_told_apart_and_others_do_not_count(tmp_path: Path) -> None:
    second = """<sensor type="perspective" id="second"><film type="hdrfilm">
        <integer name="width" value="{}"/><integer name="height" value="20"/></film></sensor>"""
    write_room(tmp_path, sensors=second.format(24))
    first = by_name(load_scene(tmp_path / "room.xml"))
    other = by_name(load_scene(tmp_path / "room.xml", sensor="second"))
    assert changed(first, other) == ALL
    write_room(tmp_path, sensors=second.format(30))
    assert by_name(load_scene(tmp_path / "room.xml")) == first
    assert changed(other, by_name(load_scene(tmp_path / "room.xml", sensor="second"))) == ALL


def test_a_reduced_film_and_only_some_lights_leave_identities(tmp_path: Path) -> None:
    scene = load_scene(write_room(tmp_path))
    assert by_name(scene.reduced("1/2")) == by_name(scene)
    some = scene.only(["sun", "panel"])
    assert by_name(some) == {name: by_name(scene)[name] for name in ("panel", "sun")}
    assert some.identity != scene.identity != scene.only(["sun"]).identity
