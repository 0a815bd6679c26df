"""Hundreds of emitters that are alike and without names are one light, unless they are parted."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command import run, run_refused, succeed
from renderer import LIGHTS, write_room

from lightpaint.colour.luminous_flux import point_flux
from lightpaint.errors import SceneError
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.pipeline.job.job_checks import remarks_of_scene
from lightpaint.scene.lights.emitters import Emitter
from lightpaint.scene.lights.light_choice import (
    MAX_SEPARATE,
    SIZE_TOLERANCE,
    alike_groups,
    choose_lights,
)
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.properties.emission import EmissionKind, Scaling
from lightpaint.scene.scene_reader import load_scene

GLASS = '<bsdf type="twosided" id="glass"><bsdf type="diffuse" id="inner"/></bsdf>'
BARE = '<bsdf type="mask"><ref id="inner"/></bsdf>'


def sphere(
    k: int, *, bsdf: str = "", lamp: str = "", radius: float = 0.02, power: float = 4
) -> str:
    """An area light in a grid under the ceiling. about: of the shape; lamp: of its emitter."""
    x, y = -0.8 + 0.1 * (k % 17), 1.8 - 0.1 * (k // 17)
    return f"""<shape type="sphere" {bsdf}><point name="center" x="{x}" y="{y}" z="-0.5"/>
        <float name="radius" value="{radius}"/>{{}}
        <emitter type="area" {lamp}><rgb name="radiance" value="{power} 3 2"/></emitter></shape>"""


def point(k: int) -> str:
    return f"""<emitter type="point"><point name="position" x="{k / 100}" y="1" z="0"/>
        <rgb name="intensity" value="1 1 1"/></emitter>"""


#: 300 emitters: of one material, of another with a material inside, without any, named, and points.
CITY = (
    GLASS
    + "".join(sphere(k, radius=0.01 + k / 1e4).format('<ref id="glass"/>') for k in range(100))
    + "".join(sphere(k, power=5).format(BARE) for k in range(60))
    + "".join(sphere(k, lamp=f'id="elm__{k}"').format("") for k in range(50))
    + "".join(sphere(k, bsdf=f'id="lamp{k}"').format('<ref id="glass"/>') for k in range(30))
    + "".join(point(k) for k in range(40))
    + "".join(sphere(k, power=9).format("") for k in range(19))
    + LIGHTS["sky"]
)
FOUND = {"glass": 100, "inner": 60, "area_lights": 50, "point_lights": 40}


@pytest.fixture(scope="module")
def city(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return load_scene(write_room(tmp_path_factory.mktemp("city"), lights=CITY))


def found(scene: Scene) -> dict[str, int]:
    return {light.name: len(light.members) for light in scene.lights if light.is_found}


def test_alike_and_without_names_are_one_light(city: Scene) -> None:
    assert len(city.emitters) == 300
    assert found(city) == FOUND
    single = [light.name for light in city.lights if len(light.members) == 1]
    assert single[:30] == [f"lamp{k}" for k in range(30)]
    # Of these there are too few to be one; and a name was given to none of them.
    assert len(single) == 30 + 19 + 1
    assert sum(len(light.members) for light in city.lights) == 300
    glass = city.light("glass")
    assert (glass.emission, glass.unit) == ((4, 3, 2), "W/(m² sr)")
    remarks = [remark for remark in remarks_of_scene(city) if "similar lamps" in remark]
    assert len(remarks) == len(FOUND)
    assert "100 similar lamps without names form one light, glass" in remarks[0]


@pytest.mark.nightly
def test_they_can_be_parted(city: Scene) -> None:
    separate = load_scene(city.path, group_alike=False)
    assert len(separate.lights) == 300
    assert separate.identity == separate.content == city.content != city.identity
    # A group takes its own; what is left is as alike as before.
    some = load_scene(city.path, groups={"half": ["area_?", "area_1?"]})
    assert found(some) == {**FOUND, "glass": 80}
    assert not some.light("half").is_found
    # Who means one by the name that it has got here knows what it is; patterns mean lights first.
    one = load_scene(city.path, lights=["area_7", "sky"])
    assert [light.name for light in one.lights] == ["area_7", "sky", "rest"]
    some = load_scene(city.path, lights=["gl*", "*ea_11?", "p*"])
    assert [x.name for x in some.lights][:2] == ["glass", "area_110"]
    assert found(some) == {"glass": 100, "point_lights": 40}


def test_the_lights_file_may_part_them(city: Scene, tmp_path: Path) -> None:
    file = tmp_path / "a.toml"
    file.write_text("group_alike = false")
    assert len(load_scene(city.path, lights_file=file).lights) == 300
    file.write_text("group_alike = 1")
    with pytest.raises(SceneError, match="group_alike is true or false, not 1"):
        load_scene(city.path, lights_file=file)
    # What is asked of one that is written down there is asked of that one.
    file.write_text('tie = [["area_3", "area_4"]]\n[light.area_5]\nlock = true\n[light."p*"]\n')
    assert found(load_scene(city.path, lights_file=file)) == {**FOUND, "glass": 97}


def test_few_stay_apart() -> None:
    bulb = Emitter(
        name="bulb",
        plugin="point",
        kind=EmissionKind(Scaling.COLOUR, "intensity", "W/sr"),
        emission=(1.0, 1.0, 1.0),
        form="at the origin",
        sampling_weight=1.0,
        node=0,
        file=0,
        offset=-1,
        unit_flux=point_flux(),
        has_name=False,
    )

    def lamp(k: int, **changes: object) -> Emitter:
        return replace(bulb, **{"name": f"point_{k}", "node": k, **changes})

    many = [lamp(k) for k in range(MAX_SEPARATE + 1)]
    assert alike_groups(many[:-1], ()) == {}
    assert alike_groups(many, ()) == {"point_lights": tuple(many)}
    assert alike_groups(many, {"point_lights"}) == {"point_lights_2": tuple(many)}
    image = EmissionKind(Scaling.IMAGE, "radiance", "× as authored")
    for other in (
        {"has_name": True},
        {"emission": (2.0, 1.0, 1.0)},
        {"plugin": "spot"},
        {"unit_flux": None},
        {"unit_flux": 1.0},
        {"obstacle": "is a picture"},
        {"belongs_to": "glass"},
        {"kind": image},
    ):
        assert alike_groups([*many[:-1], lamp(MAX_SEPARATE, **other)], ()) == {}
    # Sizes that differ by round-off are one; those of the same thing may differ.
    sizes = [lamp(k, unit_flux=7 * (1 + 1e-6 * (-1) ** k)) for k in range(MAX_SEPARATE + 1)]
    assert [*alike_groups(sizes, ())] == ["point_lights"]
    assert (
        alike_groups(
            [lamp(k, unit_flux=(2 * SIZE_TOLERANCE) ** k) for k in range(MAX_SEPARATE + 1)], ()
        )
        == {}
    )
    hung = [lamp(k, unit_flux=2.0**k, belongs_to="glass") for k in range(MAX_SEPARATE + 1)]
    assert alike_groups(hung, {"glass"}) == {"glass_2": tuple(hung)}
    [light] = choose_lights(hung, scene="s.xml")
    assert (light.name, light.is_found) == ("glass", True)
    assert len(choose_lights(hung, scene="s.xml", group_alike=False)) == MAX_SEPARATE + 1


def test_from_the_listing_to_the_relit_scene(tmp_path: Path) -> None:
    lamps = "".join(sphere(k).format('<ref id="glass"/>') for k in range(40))
    room = write_room(tmp_path, lights=GLASS + lamps + LIGHTS["sky"])
    small = ("-D", "width=16", "--spp", 2)
    completed = run(tmp_path, "lights", room, "--no-sheet")
    assert [line.split()[0] for line in completed.stdout.splitlines()] == ["light", "glass", "sky"]
    assert "--no-group-alike separates them, --group name=VALUE makes a light" in completed.stderr
    listed = json.loads(succeed(tmp_path, "lights", room, "--json"))["lights"]
    assert [len(light["members"]) for light in listed] == [40, 1]
    separate_lights = json.loads(succeed(tmp_path, "lights", room, "--json", "--no-group-alike"))[
        "lights"
    ]
    assert len(separate_lights) == 41

    write_rgb(tmp_path / "p.exr", np.full((20, 16, 3), 0.4, np.float32))
    completed = run(tmp_path, "solve", room, "p.exr", *small, "-o", "out")
    assert completed.returncode == 0, completed.stderr
    assert completed.stderr.count("similar lamps") == 1
    lighting = read_lighting(tmp_path / "out" / "lighting.json")
    assert [light.name for light in lighting.lights] == ["glass", "sky"]
    relit = load_scene(tmp_path / "out" / "relit.xml", group_alike=False)
    solved = np.float32(lighting.emission["glass"])
    assert all(np.array_equal(np.float32(x.emission), solved) for x in relit.emitters[:40])
    # The basis that is kept is found again.
    assert "kept from an earlier run" in run(tmp_path, "basis", room, *small).stderr
    message = run_refused(tmp_path, "solve", room, "p.exr", *small, "--lock", "area_3")
    assert "'area_3' is part of the light 'glass': constrain that light" in message
