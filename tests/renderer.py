"""Small scenes, and plain Mitsuba renders of them, for tests that need the renderer."""

import gc
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from lightpaint.arrays import RGB
from lightpaint.basis.basis import Basis
from lightpaint.scene.scene import Scene

REPOSITORY = Path(__file__).parent.parent
CORNELL = REPOSITORY / "scenes" / "cornell" / "scene.xml"

#: float32 sums of a few hundred samples per pixel, relative to the brightest pixel.
SAME_SAMPLES = 1e-6

#: A room of a few rectangles: one light of each one-colour kind, a glossy and a rough thing; of
#: plugins that load in no time, unlike roughplastic with its tables.
LIGHTS = {
    "panel": """<shape type="rectangle" id="panel"><transform name="to_world">
        <scale value="0.3"/><rotate x="1" angle="90"/><translate y="1.9"/></transform>
        <emitter type="area"><rgb name="radiance" value="4 3 2"/></emitter></shape>""",
    "bulb": """<emitter type="point" id="bulb"><point name="position" x="-0.5" y="1" z="0.5"/>
        <rgb name="intensity" value="0.5 0.6 0.7"/></emitter>""",
    "beam": """<emitter type="spot" id="beam"><transform name="to_world">
        <lookat origin="0.8 1.8 1.5" target="0 0 0" up="0 1 0"/></transform>
        <rgb name="intensity" value="3 3 3"/><float name="cutoff_angle" value="30"/></emitter>""",
    "sun": """<emitter type="directional" id="sun"><vector name="direction" x="0.3" y="-1" z="-1"/>
        <rgb name="irradiance" value="1 0.9 0.8"/></emitter>""",
    "sky": """<emitter type="constant" id="sky"><rgb name="radiance" value="0.1 0.2 0.3"/>
        </emitter>""",
}

ROOM = """<scene version="3.0.0">
    <default name="spp" value="16"/>
    <default name="width" value="24"/>
    {integrator}
    <sensor type="perspective" id="camera">
        <float name="fov" value="50"/>
        <transform name="to_world"><lookat origin="0 1 3.5" target="0 0.8 0" up="0 1 0"/>
        </transform>
        <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
        <film type="hdrfilm"><integer name="width" value="$width"/>
        <integer name="height" value="20"/>{film}</film>
    </sensor>
    {sensors}
    <shape type="rectangle" id="floor"><transform name="to_world"><rotate x="1" angle="-90"/>
        </transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.7 0.5 0.4"/></bsdf></shape>
    <shape type="rectangle" id="wall"><transform name="to_world">
        <translate y="1" z="-1"/></transform>
        {wall}</shape>
    <shape type="sphere" id="ball"><point name="center" x="0.3" y="0.3" z="0.2"/>
        <float name="radius" value="0.3"/>
        <bsdf type="roughconductor"><float name="alpha" value="0.3"/></bsdf></shape>
    {lights}
</scene>
"""

#: What the wall is of; the second has more of its light in all directions, and loads slowly.
GLOSSY = """<bsdf type="principled"><rgb name="base_color" value="0.3 0.5 0.6"/>
        <float name="roughness" value="0.3"/></bsdf>"""
PLASTIC = (
    """<bsdf type="roughplastic"><rgb name="diffuse_reflectance" value="0.3 0.5 0.6"/></bsdf>"""
)

PATH = '<integrator type="path"><integer name="max_depth" value="5"/></integrator>'


def write_room(
    folder: Path,
    *,
    lights: str | None = None,
    integrator: str = PATH,
    film: str = "",
    sensors: str = "",
    wall: str = GLOSSY,
    name: str = "room.xml",
) -> Path:
    """Write the test room to `folder`, by default with a light of every one-colour kind."""
    path = folder / name
    filled = "\n    ".join(LIGHTS.values()) if lights is None else lights
    path.write_text(
        ROOM.format(integrator=integrator, film=film, sensors=sensors, wall=wall, lights=filled),
        encoding="utf-8",
    )
    return path


def mitsuba_render(
    scene: Scene, emission: Mapping[str, RGB] | None = None, *, seed: int, spp: int
) -> np.ndarray:
    """What Mitsuba's own integrator makes of the scene in one call, (h, w, 3) float32."""
    import mitsuba as mi

    loaded = scene.load(emission)
    image = np.array(mi.render(loaded, sensor=scene.camera(loaded), seed=seed, spp=spp))[..., :3]
    del loaded
    gc.collect()
    return image


def one_pass(scene: Scene, *, seed: int, spp: int, plain: bool = True) -> np.ndarray:
    """The planes of a single pass at exactly this seed, (n, h, w, 3) float32.

    plain: with Mitsuba's own numbers and choices; else as a basis is rendered, unguided yet.
    """
    import drjit as dr
    import mitsuba as mi

    from lightpaint.basis.render.guide import Guide
    from lightpaint.basis.render.integrators import needs_a_bounce
    from lightpaint.basis.render.one_pass import Guided, accumulate, lights_by_instance

    names = [light.name for light in scene.lights]
    height, width = scene.size
    loaded = scene.load(dict.fromkeys(names, (1.0, 1.0, 1.0)))
    planes = dr.zeros(mi.Float, len(names) * height * width * 3)
    light_of = lights_by_instance(loaded, scene.plane_of)
    guide = Guide(loaded, light_of, scene.eye(loaded))
    traced = accumulate(
        loaded,
        scene.integrator,
        camera=scene.camera(loaded),
        light_of=light_of,
        planes=planes,
        seen=dr.zeros(mi.Float, height * width),
        seed=seed,
        spp=spp,
        guided=None if plain else Guided(seed, 0, guide),
        block=scene.film.block,
        must_bounce=needs_a_bounce(scene),
    )
    del loaded
    gc.collect()
    return np.array(planes).reshape(len(names), height, width, 3) / traced


def same_basis(a: Basis, b: Basis, *, of_file: bool = False) -> None:
    """Assert that two bases are of the same samples.

    of_file: whether one was gone on with from its file, which has half floats.
    """
    assert a.origin == b.origin
    # float32 sums, or half floats, once taken apart and put together again.
    same = 4 * (2**-11 if of_file else SAME_SAMPLES) * a.images.max()
    assert np.abs(a.images - b.images).max() <= same
    assert np.abs(a.half_differences - b.half_differences).max() <= same
    np.testing.assert_array_equal(a.emitters_seen, b.emitters_seen)
