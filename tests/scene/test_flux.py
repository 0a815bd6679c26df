"""The flux of loaded lights against closed forms and against Mitsuba's own emission."""

import gc
import math
from pathlib import Path

import numpy as np
import pytest
from renderer import LIGHTS, write_room

from lightpaint.scene.lights.light import Light
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

#: The renderer's numbers are float32.
SINGLE = 1e-5

BALL = """<shape type="sphere" id="ball_light"><point name="center" x="0" y="1.5" z="0"/>
    <float name="radius" value="0.2"/>
    <emitter type="area"><rgb name="radiance" value="1 2 3"/></emitter></shape>"""


def _scene(folder: Path, **chosen: object) -> Scene:
    lights = "\n".join([*LIGHTS.values(), BALL])
    return load_scene(write_room(folder, lights=lights), **chosen)  # type: ignore[arg-type]


def _flux(light: Light) -> float:
    assert light.unit_flux is not None
    assert len(set(light.unit_flux)) == 1
    return light.unit_flux[0]


def test_flux_by_form(tmp_path: Path) -> None:
    scene = _scene(tmp_path)
    # A square of half-width 0.3, a sphere of radius 0.2.
    assert _flux(scene.light("panel")) == pytest.approx(math.pi * 0.6**2, rel=SINGLE)
    assert _flux(scene.light("ball_light")) == pytest.approx(
        math.pi * 4 * math.pi * 0.2**2, rel=SINGLE
    )
    assert _flux(scene.light("bulb")) == pytest.approx(4 * math.pi, rel=SINGLE)
    assert scene.light("sun").unit_flux is None
    assert scene.light("sky").unit_flux is None


def test_flux_of_a_spot_is_what_arrives_on_a_sphere_around_it(tmp_path: Path) -> None:
    import drjit as dr
    import mitsuba as mi

    scene = _scene(tmp_path)
    loaded = scene.load({"beam": (1.0, 1.0, 1.0)})
    spot = next(emitter for emitter in loaded.emitters() if emitter.id() == "beam")
    frame = mi.traverse(spot)["to_world"]
    count = 20_000
    theta = ((np.arange(count) + 0.5) / count * np.pi).astype(np.float32)
    surface = dr.zeros(mi.SurfaceInteraction3f, count)
    on_sphere = mi.Point3f(np.sin(theta), np.zeros_like(theta), np.cos(theta))
    surface.p = frame @ on_sphere
    _, arrives = spot.sample_direction(surface, mi.Point2f(0.5))
    irradiance = np.array(arrives)[0]
    flux = float((2 * np.pi * np.sin(theta) * irradiance).sum() * np.pi / count)
    del loaded, spot, frame, surface, arrives
    gc.collect()
    assert _flux(scene.light("beam")) == pytest.approx(flux, rel=1e-4)


def test_flux_of_a_group_is_the_sum_of_its_members(tmp_path: Path) -> None:
    single = _scene(tmp_path)
    tied = _scene(tmp_path, groups={"both": ["bulb", "panel"], "sun_too": ["beam", "sun"]})
    expected = [
        sum(
            _flux(single.light(name)) * single.light(name).emission[k] for name in ("bulb", "panel")
        )
        for k in range(3)
    ]
    assert tied.light("both").unit_flux == pytest.approx(expected, rel=SINGLE)
    assert tied.light("sun_too").unit_flux is None


def test_a_textured_or_stretched_cone_has_no_closed_form(tmp_path: Path) -> None:
    stretched = LIGHTS["beam"].replace("<lookat", '<scale x="2"/><lookat')
    squares = LIGHTS["beam"].replace(
        "<float", '<texture type="checkerboard" name="texture"/><float'
    )
    for lights in (stretched, squares):
        scene = load_scene(write_room(tmp_path, lights=lights))
        assert scene.light("beam").unit_flux is None


def test_the_flux_of_a_rest_that_takes_light_away_is_unknown(tmp_path: Path) -> None:
    """A light of negative intensity is not adjusted; a solve beside it writes no negative flux."""
    dark = LIGHTS["bulb"].replace("bulb", "dark").replace('"0.5 0.6 0.7"', '"-1 1 1"')
    scene = load_scene(write_room(tmp_path, lights=LIGHTS["panel"] + dark))
    assert scene.light("rest").unit_flux is None
    assert scene.light("panel").unit_flux is not None
