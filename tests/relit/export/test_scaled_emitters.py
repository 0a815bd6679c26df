"""Suns and projectors whose `to_world` is scaled, which Mitsuba makes brighter."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from renderer import write_room

from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.relit.exported_answer import emitters_of, rig_lights
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_reader import load_scene

#: The renderer's numbers are float32.
SINGLE = 1e-5

#: Six standard errors of a mean over the room.
NOISE = 0.1

AIM = '<lookat origin="0.3, 1.8, 0.2" target="0, 0, 0" up="0, 0, 1"/>'


def _scene(folder: Path, scale: str) -> Scene:
    to_world = f'<transform name="to_world"><scale value="{scale}"/>{AIM}</transform>'
    lights = f"""
        <emitter type="directional" id="sun">{to_world}
            <rgb name="irradiance" value="2 1 0.5"/></emitter>
        <emitter type="projector" id="slide">{to_world}<float name="fov" value="40"/>
            <rgb name="irradiance" value="1 1 1"/></emitter>"""
    folder.mkdir()
    return load_scene(write_room(folder, lights=lights))


@pytest.mark.parametrize("scale", ["3", "1, 1, 3", "-1, 1, 3"])
def test_other_programs_get_the_light_that_mitsuba_shows(tmp_path: Path, scale: str) -> None:
    plain, scaled = _scene(tmp_path / "plain", "1"), _scene(tmp_path / "scaled", scale)
    one, three = (render_basis(scene, spp=16) for scene in (plain, scaled))
    sun, slide = (float(three.image(x).mean() / one.image(x).mean()) for x in ("sun", "slide"))
    assert sun == pytest.approx(3, rel=NOISE)
    if scale == "3":  # another scale changes the shape of a slide
        assert slide == pytest.approx(3, rel=NOISE)
    exported = _exported(plain, one)
    assert exported == {"sun": (2, 1, 0.5), "slide": pytest.approx((math.pi,) * 3)}
    for name, light in _exported(scaled, three).items():
        np.testing.assert_allclose(light, 3 * np.array(exported[name]), rtol=SINGLE)
    assert scaled.light("sun").form.endswith("× 3 by its scale")
    assert scaled.light("sun").form.startswith(plain.light("sun").form)
    [in_nuke], _ = rig_lights(scaled, Lighting.current(three))
    np.testing.assert_allclose(in_nuke.emission, (6, 3, 1.5), rtol=SINGLE)


def _exported(scene: Scene, basis: Basis) -> dict[str, Any]:
    return {name: rgb for name, _, rgb in emitters_of(scene, Lighting.current(basis))}
