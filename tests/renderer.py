"""Small scenes, and plain Mitsuba renders of them, for tests that need the renderer."""

import gc
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from lightpaint.arrays import RGB
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.relit.relit_scene import relight
from lightpaint.scene.mitsuba_scene import Scene

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

#: A lamp of the kind and the colour of `bulb`.
TWIN = LIGHTS["bulb"].replace('"bulb"', '"twin"').replace("-0.5", "0.6")
#: A light that renders but that lightpaint cannot scale.
SCREEN = """<shape type="rectangle" id="screen"><transform name="to_world"><scale value="0.4"/>
    <rotate y="1" angle="90"/><translate x="-1" y="1"/></transform><emitter type="area">
    <texture type="checkerboard" name="radiance"/></emitter></shape>"""

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
    from lightpaint.scene.runtime.variant import use_variant

    use_variant()
    from lightpaint.basis.render.tracer.one_pass import Tracer, trace_plainly

    if plain:
        unit = {light.name: (1.0, 1.0, 1.0) for light in scene.lights}
        loaded = scene.load(unit, evenly=True)
        planes = trace_plainly(scene, loaded, seed=seed, spp=spp)
        del loaded
        gc.collect()
        return planes
    tracer = Tracer(scene, seed)
    tracer.end_training()
    rows = range(scene.size[0])
    traced = tracer.planes(rows)
    tracer.add(traced, 0, rows, 0, spp)
    tracer.close()
    return traced.sums() / spp


def render_in_parts(scene: Scene, *, spp: int, seed: int = 0, start: Basis | None = None) -> Basis:
    """Render all parts of a basis one after the other, as processes of a batch share them."""
    from lightpaint.basis.render.basis_render import train_guide
    from lightpaint.basis.render.render_parts import PartRenderer, PartSums, plan_parts

    guide_table = None if start is None else start.guide_table
    if guide_table is None:
        guide_table = train_guide(scene, seed)
    parts = plan_parts(scene, spp, start=start)
    sums = PartSums(scene, parts, seed=seed, start=start)
    renderer = PartRenderer(scene, seed, guide_table)
    try:
        for part in parts:
            sums.add(part, *renderer.render(part))
    finally:
        renderer.close()
    return sums.basis(guide_table)


def same_basis(a: Basis, b: Basis, *, of_file: bool = False) -> None:
    """Assert that two bases are of the same samples.

    of_file: whether one was gone on with from its file, which has half floats.
    """
    assert a.origin == b.origin
    # float32 sums, or half floats, once taken apart and put together again.
    tolerance = 4 * (2**-11 if of_file else SAME_SAMPLES) * a.images.max()
    assert np.abs(a.images - b.images).max() <= tolerance
    assert np.abs(a.half_differences - b.half_differences).max() <= tolerance
    np.testing.assert_array_equal(a.emitters_seen, b.emitters_seen)


def assert_equal_bits(a: Basis, b: Basis) -> None:
    """Assert that two bases are equal to the last bit, but for what is of memory only."""
    assert a.origin == b.origin
    for name in ("images", "half_differences", "emitters_seen", "guide_table"):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name), err_msg=name)
    assert (a.indirect is None) == (b.indirect is None)
    if a.indirect is not None and b.indirect is not None:
        for part in ("planes", "noise"):
            actual, other = (getattr(x.indirect, part).array() for x in (a, b))
            np.testing.assert_array_equal(actual, other, err_msg=f"indirect {part}")


def map_file(folder: Path) -> None:
    """Write a map whose pixels all differ, `map.exr`."""
    image = np.random.default_rng(0).random((16, 32, 3)).astype(np.float32)
    write_rgb(folder / "map.exr", image)


def painted(scene: Scene, seed: int = 3) -> Lighting:
    """Return a lighting in which all lights differ, but for the fixed one."""
    lighting = Lighting.current(render_basis(scene, spp=2))
    values = np.random.default_rng(seed).random((len(scene.lights), 3)) * 2
    for light, rgb in zip(scene.lights, values.tolist(), strict=True):
        if not light.is_fixed:
            lighting = lighting.with_emission(light.name, tuple(rgb))
    return lighting


def predicted_and_shown(scene: Scene, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return the prediction of a painted lighting by one pass, and what Mitsuba shows of the
    written scene with the same samples, (h, w, 3) each.
    """
    lighting = painted(scene)
    planes = one_pass(scene, seed=5, spp=16)
    weights = np.array([lighting.emission[light.name] for light in scene.lights])
    relit = relight(scene, lighting, folder / "relit.xml")
    shown = mitsuba_render(relit, seed=5, spp=16)
    return np.einsum("nc,nhwc->hwc", weights, planes), shown
