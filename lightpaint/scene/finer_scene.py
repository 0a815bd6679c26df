"""A scene of which a texel is split again."""

from dataclasses import replace

from lightpaint.scene.lights.image_split import with_split
from lightpaint.scene.lights.light import lights_of
from lightpaint.scene.lights.texels.texel_layout import TexelLayout
from lightpaint.scene.runtime.mitsuba_errors import mitsuba_errors
from lightpaint.scene.runtime.render_lock import MITSUBA
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_inspection import inspect_scene


@MITSUBA.acquired()
def with_layout(scene: Scene, image: str, layout: TexelLayout) -> Scene:
    """Return a scene whose sky `image` has other texels, each a light that shows what it does now.

    Its texels must have been lights of their own.
    """
    split = {**scene.split, image: layout}
    with mitsuba_errors(scene.path):
        facts = inspect_scene(scene.parsed, scene.sensor)
        facts = with_split(facts, scene.parsed, split, scene.symmetric)
    light_of = {name: light.name for light in scene.lights for name in light.member_names}
    members: dict[str, list[str]] = {}
    for emitter in facts["emitters"]:
        members.setdefault(light_of.get(emitter.name, emitter.name), []).append(emitter.name)
    fixed = [light.name for light in scene.lights if light.is_fixed]
    lights = lights_of(facts["emitters"], members, fixed)
    return replace(scene, **facts | {"film": scene.film}, lights=lights, split=split)
