"""A show with the colours and places of an answer, read back by this reader and by pymvr."""

import io
import zipfile
from pathlib import Path

import numpy as np
import pymvr
import pytest
from rig_files import EXAMPLE

from lightpaint.arrays import RGB, Position
from lightpaint.dmx.console_rig import RigLight
from lightpaint.dmx.mvr import read_rig
from lightpaint.lighting.answer.lighting import Lighting, LightSetting
from lightpaint.relit.export.rig_files import show_copy
from lightpaint.scene.properties.site import EmitterPlace, Site, unit

#: Matrices have nine digits, places are in micrometres.
WRITTEN = 1e-6


def lights_of(path: Path) -> dict[str, RigLight]:
    return {light.name: light for x in read_rig(path).fixtures for light in x.lights}


def lighting_of(emissions: dict[str, RGB], places: tuple[EmitterPlace, ...] = ()) -> Lighting:
    lights = tuple(
        LightSetting(name, "spot", "intensity", "W/sr", rgb, rgb) for name, rgb in emissions.items()
    )
    return Lighting(lights, target="look.png", places=places, up=(0.0, 0.0, 1.0))


def moved(light: RigLight, position: Position, target: Position) -> EmitterPlace:
    way = unit(np.subtract(target, position))
    old = Site(light.position, light.direction, 20.0, 10.0)
    return EmitterPlace.of(light.name, Site(position, way, 20.0, 10.0), old)


def copied(tmp_path: Path, lighting: Lighting) -> tuple[Path, tuple[str, ...]]:
    result = show_copy(EXAMPLE, lighting)
    path = tmp_path / "relit.mvr"
    path.write_bytes(result.data)
    return path, result.left


def test_colours_are_those_of_the_answer(tmp_path: Path) -> None:
    emissions: dict[str, RGB] = {
        "101 PAR 1": (4.0, 4.0, 4.0),
        "102 PAR 2": (1.0, 0.0, 0.0),
        "103 PAR 3": (0.0, 0.0, 0.0),
        "lamp": (1.0, 1.0, 1.0),
    }
    path, left = copied(tmp_path, lighting_of(emissions))
    assert left == ("lamp",)
    with pymvr.GeneralSceneDescription(str(path)) as show:
        [layer] = show.scene.layers
        fixtures = {
            x.name: x for g in layer.child_list.group_objects for x in g.child_list.fixtures
        }
    colors = {name: (x.color.x, x.color.y, x.color.Y) for name, x in fixtures.items()}
    # Rec.709's white and red; the white has four times the red's channel.
    assert np.allclose(colors["PAR 1"], (0.3127, 0.3290, 100), atol=1e-4)
    assert np.allclose(colors["PAR 2"], (0.64, 0.33, 21.26 / 4), atol=1e-2)
    assert colors["PAR 3"] == (0.3127, 0.3290, 0.0)


def test_lights_move_to_their_places_in_the_answer_with_and_without_focus_points(
    tmp_path: Path,
) -> None:
    before = lights_of(EXAMPLE)
    wanted = {
        "102 PAR 2": ((0.5, -3.0, 4.0), (1.0, 2.0, 0.5)),
        "201 Wash 1": ((-1.0, 2.0, 5.5), (0.0, 0.5, 1.0)),
    }
    places = tuple(moved(before[name], *place) for name, place in wanted.items())
    emissions: dict[str, RGB] = dict.fromkeys(before, (1.0, 1.0, 1.0))
    path, left = copied(tmp_path, lighting_of(emissions, places))
    after = lights_of(path)
    assert left == ()
    assert [*after] == [*before]
    for name, light in after.items():
        position, target = wanted.get(name, (before[name].position, None))
        way = before[name].direction
        if target is not None:
            way = unit(np.subtract(target, position))
        assert np.allclose(light.direction, way, atol=WRITTEN)
        if name != "201 Wash 1":
            assert np.allclose(light.position, position, atol=WRITTEN)
    # What has a focus point keeps its own turn, so its beam hangs as far below it as before.
    assert np.allclose(after["201 Wash 1"].position, wanted["201 Wash 1"][0], atol=WRITTEN)


def test_all_else_stays_as_it_is(tmp_path: Path) -> None:
    path, _ = copied(tmp_path, lighting_of({"101 PAR 1": (1.0, 1.0, 1.0)}))
    with zipfile.ZipFile(path) as new, zipfile.ZipFile(EXAMPLE) as old:
        assert new.namelist() == old.namelist()
        for name in old.namelist()[1:]:
            assert new.read(name) == old.read(name)
    assert lights_of(path) == lights_of(EXAMPLE)


@pytest.mark.parametrize("mark", [True, False])
def test_names_of_files_are_kept_however_they_are_marked(
    mark: bool,
    tmp_path: Path,
) -> None:
    with zipfile.ZipFile(EXAMPLE) as old:
        files = {name: old.read(name) for name in old.namelist()}
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as new:
        for name, data in {**files, "Größe.3ds": b"x"}.items():
            new.writestr(name, data)
    data = bytearray(buffer.getvalue())
    if not mark:
        data[data.rindex(b"PK\x01\x02") + 9] &= ~8
        data[data.rindex(b"PK\x03\x04") + 7] &= ~8
    show = tmp_path / "show.mvr"
    show.write_bytes(bytes(data))
    made = show_copy(show, lighting_of({"101 PAR 1": (1.0, 1.0, 1.0)}))
    with zipfile.ZipFile(io.BytesIO(made.data)) as new:
        assert new.read("Größe.3ds") == b"x"
