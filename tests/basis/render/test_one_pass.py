"""The one-pass basis against Mitsuba's own renders: its plain twin, n of them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nightly import nightly
from renderer import (
    CORNELL,
    LIGHTS,
    PATH,
    REPOSITORY,
    SAME_SAMPLES,
    mitsuba_render,
    one_pass,
    write_room,
)

from lightpaint.basis.render.banded_film import memory_needed
from lightpaint.basis.render.basis_render import _render_one_by_one, render_basis
from lightpaint.basis.render.integrators import needs_a_bounce, why_not_one_pass
from lightpaint.basis.render.render_budget import Budget, Keeper
from lightpaint.basis.render.rendered_basis import ONE_PASS, SEPARATE
from lightpaint.basis.render.separate_renders import BLACK, WHITE
from lightpaint.errors import SceneError
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.pipeline.job.job_checks import remarks_of_scene
from lightpaint.progress import silent
from lightpaint.relit.relit_scene import relight
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.scene.scene_reader import load_scene
from lightpaint.scene.scene_render import SAMPLES_PER_PASS, Stream, pass_seed, plan_passes, render

INTEGRATORS = {
    "path": '<integrator type="path"><integer name="max_depth" value="5"/></integrator>',
    "unlimited": '<integrator type="path"/>',
    "early roulette": '<integrator type="path"><integer name="rr_depth" value="2"/></integrator>',
    "direct only": '<integrator type="path"><integer name="max_depth" value="2"/></integrator>',
    "emitters only": '<integrator type="path"><integer name="max_depth" value="1"/></integrator>',
}


@pytest.mark.parametrize("kind", INTEGRATORS)
def test_sum_of_planes_is_mitsubas_render_at_the_same_seed(tmp_path: Path, kind: str) -> None:
    scene = load_scene(write_room(tmp_path, integrator=INTEGRATORS[kind]))
    planes = one_pass(scene, seed=11, spp=16)
    white = {light.name: WHITE for light in scene.lights}
    rendered = mitsuba_render(scene, white, seed=11, spp=16)
    assert rendered.max() > 0
    assert np.abs(planes.sum(axis=0) - rendered).max() <= SAME_SAMPLES * rendered.max()


def test_sum_of_planes_on_the_cornell_box() -> None:
    scene = load_scene(CORNELL)
    planes = one_pass(scene, seed=3, spp=16)
    white = {light.name: WHITE for light in scene.lights}
    rendered = mitsuba_render(scene, white, seed=3, spp=16)
    assert np.abs(planes.sum(axis=0) - rendered).max() <= SAME_SAMPLES * rendered.max()


def test_weighted_planes_are_the_relit_render_at_the_same_seed(small_room: Scene) -> None:
    planes = one_pass(small_room, seed=5, spp=16)
    rng = np.random.default_rng(1)
    weights = rng.uniform(0.1, 3, (len(small_room.lights), 3))
    emission = {x.name: tuple(w) for x, w in zip(small_room.lights, weights.tolist(), strict=True)}
    rendered = mitsuba_render(small_room, emission, seed=5, spp=16)
    mixed = np.einsum("nhwc,nc->hwc", planes, weights)
    # float32 throughput times weights in another order.
    assert np.abs(mixed - rendered).max() <= 1e-5 * rendered.max()


@pytest.mark.parametrize("name", LIGHTS)
def test_plane_of_an_only_light_is_exactly_its_render(tmp_path: Path, name: str) -> None:
    scene = load_scene(write_room(tmp_path, lights=LIGHTS[name]))
    [plane] = one_pass(scene, seed=2, spp=8)
    rendered = mitsuba_render(scene, {name: WHITE}, seed=2, spp=8)
    assert rendered.max() > 0
    assert np.abs(plane - rendered).max() <= SAME_SAMPLES * rendered.max()


def test_each_plane_is_that_light_alone_within_noise(
    small_room: Scene, small_room_basis: Any
) -> None:
    basis = small_room_basis(spp=256)
    separate = _render_one_by_one(small_room, Budget(256), 0, None, Keeper(None), silent)
    images, differences = separate.images, separate.half_differences
    emitter_mask = separate.emitters_seen
    for k, name in enumerate(basis.names):
        gap = float((basis.images[k] - images[k]).sum(dtype=np.float64))
        noise = np.square(basis.half_differences[k], dtype=np.float64)
        noise += np.square(differences[k], dtype=np.float64)
        # Noise: four and a half standard errors of the whole image's sum, five lights.
        assert abs(gap) <= 4.5 * np.sqrt(noise.sum()), name
    # The two look for seen emitters in different ways; only edges may differ, by chance.
    assert (basis.emitters_seen != emitter_mask).mean() < 0.02
    assert emitter_mask.any()
    assert not emitter_mask.all()


#: What may be between the camera and a lamp, and whether this is seen through it.
SHEETS = {
    "pane": ('<bsdf type="thindielectric"/>', True),
    "hole": (
        """<bsdf type="mask"><float name="opacity" value="0.3"/><bsdf type="diffuse"/>
        </bsdf>""",
        True,
    ),
    "frosted": ('<bsdf type="roughdielectric"><float name="alpha" value="0.3"/></bsdf>', False),
}

LAMP = """<shape type="sphere" id="lamp"><point name="center" x="-0.4" y="1.3" z="0"/>
        <float name="radius" value="0.3"/><emitter type="area">
        <rgb name="radiance" value="20 20 20"/></emitter></shape>"""


@pytest.mark.parametrize("name", ["pane", "hole", "frosted"])
@pytest.mark.parametrize("method", ["path", nightly("volpath")])
def test_lamps_are_seen_through_clear_surfaces_alone(tmp_path: Path, name: str, method: str):
    """A sheet before the camera, of which a straight ray passes some share unless it is frosted."""
    bsdf, is_clear = SHEETS[name]
    sheet = f"""<shape type="rectangle"><transform name="to_world"><scale value="3"/>
        <translate y="1" z="2.5"/></transform>{bsdf}</shape>"""
    integrator = f'<integrator type="{method}mis"/>' if method == "volpath" else PATH
    emitter_masks = []
    for k, shape_text in enumerate(("", sheet)):
        room = write_room(
            tmp_path, lights=LAMP + shape_text, integrator=integrator, name=f"{k}.xml"
        )
        emitter_masks.append(render_basis(load_scene(room), spp=16).emitters_seen)
    assert 10 < emitter_masks[0].sum() < 60
    if is_clear:
        assert (emitter_masks[1] != emitter_masks[0]).mean() < 0.03
    else:
        assert not emitter_masks[1].any()


def test_a_lamp_in_a_mirror_is_not_seen(tmp_path: Path):
    mirror = """<shape type="rectangle"><transform name="to_world"><scale value="0.5"/>
        <translate y="1" z="-0.9"/></transform><bsdf type="conductor"/></shape>"""
    lamp = """<shape type="sphere" id="lamp"><point name="center" x="0" y="1" z="4.5"/>
        <float name="radius" value="0.3"/><emitter type="area">
        <rgb name="radiance" value="20 20 20"/></emitter></shape>"""
    scene = load_scene(write_room(tmp_path, lights=mirror + lamp))
    assert not render_basis(scene, spp=16).emitters_seen.any()


def test_a_light_alone_is_black_elsewhere(small_room: Scene) -> None:
    names = [light.name for light in small_room.lights]
    single_light = {name: WHITE if name == "beam" else BLACK for name in names}
    image = mitsuba_render(small_room, single_light, seed=0, spp=16)
    full_render = mitsuba_render(small_room, dict.fromkeys(names, WHITE), seed=0, spp=16)
    assert 0 < image.sum() < full_render.sum()


def test_furnace_a_white_room_under_a_white_sky_has_radiance_1(tmp_path: Path) -> None:
    furnace = """<scene version="3.0.0"><integrator type="path"/>
        <sensor type="perspective"><transform name="to_world">
        <lookat origin="0 0 4" target="0 0 0" up="0 1 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="16"/><integer name="height" value="16"/>
        </film></sensor>
        <shape type="sphere"><bsdf type="diffuse"><rgb name="reflectance" value="1"/></bsdf></shape>
        <emitter type="constant" id="sky"><rgb name="radiance" value="5"/></emitter></scene>"""
    path = tmp_path / "furnace.xml"
    path.write_text(furnace, encoding="utf-8")
    basis = render_basis(load_scene(path), spp=1024)
    # A convex white body under a uniform sky of radiance 1 scatters just what it receives.
    # Beside it the sky is seen as it is: precision of float32.
    np.testing.assert_allclose(basis.images[0, 0, 0], 1, rtol=1e-6)
    # On it, noise: four and a half standard errors of the mean.
    error = np.sqrt(np.square(basis.half_differences, dtype=np.float64).sum())
    count = basis.images.size
    assert abs(basis.images.mean(dtype=np.float64) - 1) <= 4.5 * error / count
    assert error / count < 1e-3


def test_point_light_over_a_plane_has_its_closed_form(tmp_path: Path) -> None:
    albedo, height, width = np.array([0.7, 0.5, 0.4]), 1.5, 31
    path = tmp_path / "plane.xml"
    path.write_text(
        f"""<scene version="3.0.0"><integrator type="path"/>
        <sensor type="orthographic"><transform name="to_world">
        <scale x="1" y="1"/><lookat origin="0 5 0" target="0 0 0" up="0 0 1"/></transform>
        <film type="hdrfilm"><integer name="width" value="{width}"/>
        <integer name="height" value="{width}"/></film></sensor>
        <shape type="rectangle"><transform name="to_world"><scale value="9"/>
        <rotate x="1" angle="-90"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.7 0.5 0.4"/></bsdf></shape>
        <emitter type="point" id="bulb"><point name="position" x="0" y="{height}" z="0"/>
        <rgb name="intensity" value="7"/></emitter></scene>""",
        encoding="utf-8",
    )
    basis = render_basis(load_scene(path), spp=64)
    middle = basis.images[0, width // 2, width // 2]
    # Radiance below a lamp of intensity 1: albedo/π · 1/h². A pixel 1/31 wide around it
    # varies by less than 0.2 %.
    np.testing.assert_allclose(middle, albedo / np.pi / height**2, rtol=2e-3)
    # And away from it the cube of the cosine: irradiance I cosθ/r² with r = h/cosθ.
    x = (np.arange(width) + 0.5) / width * 2 - 1
    cos = height / np.hypot(height, x)
    expected = albedo[0] / np.pi / height**2 * cos**3
    row = basis.images[0, width // 2, :, 0]
    np.testing.assert_allclose(row, expected, rtol=1e-2)


def test_the_present_look_comes_back_from_present_weights(small_room: Scene) -> None:
    planes = one_pass(small_room, seed=9, spp=16)
    current = np.array([light.emission for light in small_room.lights])
    rendered = mitsuba_render(small_room, seed=9, spp=16)
    mixed = np.einsum("nhwc,nc->hwc", planes, current)
    assert np.abs(mixed - rendered).max() <= 1e-5 * rendered.max()


def test_a_light_switched_off_in_the_scene_still_has_its_image(tmp_path: Path) -> None:
    dark_lamp = LIGHTS["bulb"].replace("0.5 0.6 0.7", "0 0 0")
    dark_lamp = dark_lamp.replace(
        "</emitter>", '<float name="sampling_weight" value="0"/></emitter>'
    )
    scene = load_scene(write_room(tmp_path, lights=LIGHTS["sky"] + dark_lamp))
    basis = render_basis(scene, spp=16)
    assert basis.images[basis.names.index("bulb")].max() > 0


UNSAMPLED = '<float name="sampling_weight" value="0"/></emitter>'
PROJECTOR = """<emitter type="projector" id="slide"><rgb name="irradiance" value="2 3 4"/>
    <transform name="to_world"><lookat origin="0 1 1" target="0 0 0" up="0 0 1"/></transform>
    </emitter>"""


@pytest.mark.parametrize("lamp", [*(LIGHTS[name] for name in ("bulb", "beam", "sun")), PROJECTOR])
def test_a_lamp_that_is_never_sampled_is_dark_now_and_can_be_lit(tmp_path: Path, lamp: str) -> None:
    """Nothing that a ray could hit shows it, so Mitsuba renders it black."""
    lights = lamp.replace("</emitter>", UNSAMPLED) + LIGHTS["sky"]
    scene = load_scene(write_room(tmp_path, lights=lights))
    name = scene.lights[0].name
    assert scene.light(name).emission == (0, 0, 0)
    current = {light.name: light.emission for light in scene.lights}
    rendered, asked = (mitsuba_render(scene, x, seed=9, spp=16) for x in (None, current))
    assert np.abs(asked - rendered).max() <= SAME_SAMPLES * rendered.max()
    basis = render_basis(scene, spp=16)
    assert basis.images[0].max() > 0
    lit = relight(scene, Lighting.current(basis).with_emission(name, (1, 1, 1)), tmp_path / "r.xml")
    assert lit.light(name).emission == (1, 1, 1)
    assert lit.light(name).members[0].sampling_weight == 1


def test_a_surface_that_is_never_sampled_shines_where_rays_can_hit_it(tmp_path: Path) -> None:
    lights = LIGHTS["panel"].replace("</emitter>", UNSAMPLED) + LIGHTS["bulb"]
    panel = load_scene(write_room(tmp_path, lights=lights)).light("panel")
    np.testing.assert_allclose(panel.emission, (4, 3, 2), rtol=1e-6)
    path = write_room(tmp_path, lights=lights, integrator='<integrator type="ptracer"/>')
    assert load_scene(path).light("panel").emission == (0, 0, 0)


def test_second_sensor_and_crop_window(tmp_path: Path) -> None:
    crop = """<integer name="crop_offset_x" value="5"/><integer name="crop_offset_y" value="3"/>
        <integer name="crop_width" value="12"/><integer name="crop_height" value="9"/>"""
    lens = """<sensor type="thinlens" id="close"><float name="aperture_radius" value="0.1"/>
        <float name="focus_distance" value="3"/><transform name="to_world">
        <lookat origin="1 1 2" target="0 0.5 0" up="0 1 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="10"/><integer name="height" value="14"/>
        </film></sensor>"""
    path = write_room(tmp_path, film=crop, sensors=lens)
    for sensor, size in (("camera", (9, 12)), ("close", (14, 10))):
        scene = load_scene(path, sensor=sensor)
        assert scene.size == size
        planes = one_pass(scene, seed=4, spp=8)
        white = {light.name: WHITE for light in scene.lights}
        rendered = mitsuba_render(scene, white, seed=4, spp=8)
        assert np.abs(planes.sum(axis=0) - rendered).max() <= SAME_SAMPLES * rendered.max()


@pytest.mark.parametrize(
    ("integrator", "reason"),
    [
        ('<integrator type="volpathmis"/>', "volpathmis"),
        nightly('<integrator type="ptracer"/>', "ptracer"),
    ],
)
def test_what_one_pass_cannot_serve_is_rendered_separately(
    tmp_path: Path, integrator: str, reason: str
) -> None:
    scene = load_scene(write_room(tmp_path, integrator=integrator))
    assert reason in str(why_not_one_pass(scene))
    [remark] = remarks_of_scene(scene)
    assert remark == (
        f"the integrator is {reason}: "
        "each of the 5 lights is rendered by itself, 5 times the work; "
        "the integrator path, where it shows the same, renders all in one pass"
    )
    basis = render_basis(scene, spp=4)
    assert basis.origin.method == SEPARATE
    assert (basis.images.reshape(len(basis.lights), -1).sum(axis=1) > 0).all()


#: A box of fog around the room, and a bulb of the light of `bulb` that has a size.
FOG = """<shape type="cube"><transform name="to_world"><scale x="2" y="2" z="2"/></transform>
    <bsdf type="null"/><medium type="homogeneous" name="interior"><rgb name="sigma_t" value="0.3"/>
    <rgb name="albedo" value="0.8"/></medium></shape>"""
BALL = """<shape type="sphere" id="bulb"><point name="center" x="-0.5" y="1" z="0.5"/>
    <float name="radius" value="0.05"/><emitter type="area"><rgb name="radiance" value="60"/>
    </emitter></shape>"""


@pytest.mark.parametrize("has_size", [False, True])
def test_fog_around_a_light_without_a_size_is_remarked(tmp_path: Path, has_size: bool) -> None:
    """One path that scatters beside it may have most of the energy of its image."""
    lights = FOG + (BALL if has_size else LIGHTS["bulb"])
    scene = load_scene(write_room(tmp_path, integrator=_integrator("volpath"), lights=lights))
    told = [x for x in map(str, remarks_of_scene(scene)) if x.startswith("bulb has no size")]
    assert len(told) == (not has_size)
    plain = load_scene(write_room(tmp_path, integrator=_integrator("path"), lights=lights))
    assert not any("no size" in str(x) for x in remarks_of_scene(plain))  # it shows no fog


@pytest.mark.parametrize("option", ["emitter_samples", "bsdf_samples", "shading_samples"])
def test_direct_with_other_sample_counts_is_not_one_path(tmp_path: Path, option: str) -> None:
    integrator = f'<integrator type="direct"><integer name="{option}" value="2"/></integrator>'
    scene = load_scene(write_room(tmp_path, integrator=integrator))
    assert "takes other than one sample" in str(why_not_one_pass(scene))


#: What lets rays pass: a lamp without a surface, a leaf with holes, thin glass, a cloud.
PASSED = {
    "ghost": """<shape type="rectangle" id="ghost"><transform name="to_world">
        <translate z="0.8" y="1"/></transform><bsdf type="null"/><emitter type="area"/></shape>""",
    "leaf": """<shape type="rectangle" id="leaf"><transform name="to_world"><scale value="0.6"/>
        <translate z="1.2" y="1.2"/></transform><bsdf type="mask"><float name="opacity"
        value="0.4"/><bsdf type="twosided"><bsdf type="diffuse"/></bsdf></bsdf></shape>""",
    "pane": """<shape type="rectangle" id="pane"><transform name="to_world"><scale value="0.7"/>
        <translate z="1.6" x="-0.3" y="0.9"/></transform><bsdf type="thindielectric"/></shape>""",
    "cloud": """<shape type="cube" id="cloud"><transform name="to_world"><scale value="0.3"/>
        <translate x="0.5" y="1" z="1"/></transform><bsdf type="null"/>
        <medium type="homogeneous" name="interior"><float name="albedo" value="0.5"/></medium>
        </shape>""",
}
SEVERAL = "".join(PASSED.values()) + LIGHTS["panel"] + LIGHTS["bulb"] + LIGHTS["sun"]


def _integrator(plugin: str, **options: int | bool) -> str:
    names = {bool: "boolean", int: "integer"}
    properties_text = "".join(
        f'<{names[type(value)]} name="{name}" value="{str(value).lower()}"/>'
        for name, value in options.items()
    )
    return f'<integrator type="{plugin}">{properties_text}</integrator>'


def _same_as_mitsuba_at_random_weights(scene: Scene) -> None:
    """Only if every plane is what Mitsuba makes of that light are all their sums."""
    planes = one_pass(scene, seed=3, spp=16)
    weights = np.random.default_rng(1).uniform(0.1, 3, (len(scene.lights), 3))
    emission = {x.name: tuple(w) for x, w in zip(scene.lights, weights.tolist(), strict=True)}
    rendered = mitsuba_render(scene, emission, seed=3, spp=16)
    assert rendered.max() > 0
    mixed = np.einsum("nhwc,nc->hwc", planes, weights)
    # float32 throughput times weights in another order.
    assert np.abs(mixed - rendered).max() <= 1e-5 * rendered.max()


@pytest.mark.parametrize("hide", [False, True])
@pytest.mark.parametrize(
    ("lights", "options"),
    [
        (PASSED["ghost"] + LIGHTS["bulb"], {}),
        (SEVERAL, {"rr_depth": 1}),
        (SEVERAL, {"max_depth": 2}),
        (SEVERAL + LIGHTS["sky"], {"max_depth": 3}),
    ],
)
def test_paths_that_only_pass_surfaces_are_what_they_are_to_mitsuba(
    tmp_path: Path, lights: str, options: dict[str, int], hide: bool
) -> None:
    """Black, with all they gathered on the way, unless an environment is seen behind."""
    integrator = _integrator("path", hide_emitters=hide, **options)
    scene = load_scene(write_room(tmp_path, lights=lights, integrator=integrator))
    assert scene.has_null
    assert needs_a_bounce(scene) == (hide or LIGHTS["sky"] not in lights)
    assert why_not_one_pass(scene) is None
    _same_as_mitsuba_at_random_weights(scene)


def test_each_plane_behind_what_is_passed_is_that_light_alone_within_noise(tmp_path: Path) -> None:
    scene = load_scene(write_room(tmp_path, lights=SEVERAL))
    basis = render_basis(scene, spp=256)
    assert basis.origin.method == ONE_PASS
    separate = _render_one_by_one(scene, Budget(256), 0, None, Keeper(None), silent)
    for k, name in enumerate(basis.names):
        gap = float((basis.images[k] - separate.images[k]).sum(dtype=np.float64))
        noise = np.square(basis.half_differences[k], dtype=np.float64)
        noise += np.square(separate.half_differences[k], dtype=np.float64)
        # Noise: four and a half standard errors of the whole image's sum, four lights.
        assert abs(gap) <= 4.5 * np.sqrt(noise.sum()), name
    # What is gathered and then lost is much: else the test would say nothing.
    plain_basis = one_pass(scene, seed=1, spp=64)
    scene = load_scene(write_room(tmp_path, lights=SEVERAL + LIGHTS["sky"]))
    assert plain_basis.sum() < 0.9 * one_pass(scene, seed=1, spp=64)[: len(plain_basis)].sum()


@pytest.mark.parametrize(
    "integrator",
    [
        _integrator("prb", max_depth=4),
        _integrator("prb", max_depth=3, hide_emitters=True),
        _integrator("prb_projective", max_depth=4),
        _integrator("direct_projective"),
    ],
)
def test_integrators_that_trace_the_paths_of_path_are_one_pass(
    tmp_path: Path, integrator: str
) -> None:
    """They roll the dice of Russian roulette one vertex later, so their paths end before it."""
    lights = "".join(LIGHTS.values())
    if "direct" not in integrator:
        lights += "".join(PASSED.values())
    scene = load_scene(write_room(tmp_path, lights=lights, integrator=integrator))
    assert why_not_one_pass(scene) is None
    assert not needs_a_bounce(scene)
    _same_as_mitsuba_at_random_weights(scene)


@pytest.mark.parametrize(
    ("plugin", "brightness"), [("path", 0.5), ("direct", 1), ("volpath", 1), ("prb", 1)]
)
def test_a_half_masked_lamp_before_nothing_is_as_bright_as_its_integrator_shows_it(
    tmp_path: Path, plugin: str, brightness: float
) -> None:
    """`path` alone discards what a path gathered that met nothing but masks."""
    path = tmp_path / "masked.xml"
    path.write_text(
        f"""<scene version="3.0.0">{_integrator(plugin)}
        <sensor type="perspective"><float name="fov" value="20"/><transform name="to_world">
        <lookat origin="0 0 4" target="0 0 0" up="0 1 0"/></transform>
        <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="8"/>
        </film></sensor><shape type="rectangle" id="lamp"><bsdf type="mask">
        <float name="opacity" value="0.5"/><bsdf type="diffuse"/></bsdf><emitter type="area">
        <rgb name="radiance" value="1"/></emitter></shape></scene>"""
    )
    scene = load_scene(path)
    shown = mitsuba_render(scene, seed=1, spp=256).mean()
    predicted = render_basis(scene, spp=256).images.mean()
    # Noise: five standard errors of the mean of 64 pixels with 256 samples that are 0 or 1.
    noise = 5 * 0.5 / np.sqrt(64 * 256)
    assert abs(shown - brightness) <= noise
    assert abs(predicted - brightness) <= noise


def test_depth_of_integrators_that_nobody_told(tmp_path: Path) -> None:
    for plugin, depth in {"prb": 6, "prb_projective": 6, "path": -1, "volpath": -1}.items():
        scene = load_scene(write_room(tmp_path, integrator=_integrator(plugin)))
        assert scene.integrator.max_depth == depth


@pytest.mark.parametrize(
    ("plugin", "lights", "options"),
    [
        nightly("volpath", LIGHTS["bulb"] + LIGHTS["sky"], {}),
        ("volpath", "".join(LIGHTS.values()), {"max_depth": 3, "rr_depth": 1}),
        ("direct", SEVERAL, {}),
    ],
)
def test_integrators_that_take_other_samples_have_the_same_mean(
    tmp_path: Path, plugin: str, lights: str, options: dict[str, int]
) -> None:
    integrator = _integrator(plugin, **options)
    scene = load_scene(write_room(tmp_path, lights=lights, integrator=integrator))
    assert why_not_one_pass(scene) is None
    basis = render_basis(scene, spp=256)
    white = {light.name: WHITE for light in scene.lights}
    rendered = render(scene, white, spp=1024, stream=Stream.VERIFICATION)
    gap = basis.images.sum(axis=0, dtype=np.float64) - rendered.image
    noise = np.square(basis.half_differences.sum(axis=0), dtype=np.float64)
    noise += np.square(rendered.half_difference, dtype=np.float64)
    # Noise: five standard errors of the sum, and of pixels in the mean square.
    assert abs(gap.sum()) <= 5 * np.sqrt(noise.sum())
    assert np.square(gap).sum() <= 1.5 * noise.sum()
    # Less than a hundredth of the picture: what is missed would be seen.
    assert np.sqrt(noise.sum()) <= 2e-3 * rendered.image.sum()


@pytest.mark.parametrize(
    ("name", "size"),
    [
        nightly("cornell", "1/4"),
        nightly("stage", "1/10"),
        nightly("gallery", "1/10"),
        nightly("table", "1/10"),
    ],
)
def test_planes_of_the_scenes_that_come_along_add_up_to_their_render(name: str, size: str) -> None:
    """Of all emitters as they are, textured ones and environments among them."""
    # A sky whole, since its texels have the mean of what they cover.
    scene = load_scene(REPOSITORY / "scenes" / name / "scene.xml", split={}).reduced(size)
    basis = render_basis(scene, spp=128)
    rendered = render(scene, spp=256, stream=Stream.VERIFICATION)
    weights = basis.current_weights.astype(np.float32)[:, None, None, :]
    gap = (basis.images * weights).sum(axis=0, dtype=np.float64) - rendered.image
    noise = np.square((basis.half_differences * weights).sum(axis=0), dtype=np.float64)
    noise += np.square(rendered.half_difference, dtype=np.float64)
    # Noise: four and a half standard errors, of the sums over nine blocks of the picture.
    for rows in np.array_split(np.arange(gap.shape[0]), 3):
        for columns in np.array_split(np.arange(gap.shape[1]), 3):
            pixels = np.ix_(rows, columns)
            assert abs(gap[pixels].sum()) <= 4.5 * np.sqrt(noise[pixels].sum()), (rows, columns)


@pytest.mark.parametrize("emitter_samples", [(2, 1), *map(nightly, [(1, 1), (8, 8)])])
def test_any_number_of_emitter_samples_has_the_same_mean(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, emitter_samples: tuple[int, int]
) -> None:
    """By chance, by choice and, on a glossy wall beside a panel, by both."""
    use_variant()
    from lightpaint.basis.render.tracer import one_pass as module

    lights = LIGHTS["panel"] + LIGHTS["beam"] + LIGHTS["sky"]
    scene = load_scene(write_room(tmp_path, lights=lights))
    usual = render_basis(scene, spp=1024, seed=1)
    monkeypatch.setattr(module, "FIRST_EMITTER_SAMPLES", emitter_samples[0])
    monkeypatch.setattr(module, "LATER_EMITTER_SAMPLES", {2**32: emitter_samples[1]})
    other = render_basis(scene, spp=1024, seed=2)
    gap = (other.images - usual.images).sum(axis=(1, 2), dtype=np.float64)
    noise = np.square(usual.half_differences, dtype=np.float64).sum(axis=(1, 2))
    noise += np.square(other.half_differences, dtype=np.float64).sum(axis=(1, 2))
    # Noise: four and a half standard errors, three lights in three channels.
    assert (np.abs(gap) <= 4.5 * np.sqrt(noise)).all()
    # Less than a hundredth of each light: what is counted twice or never would be seen.
    assert (4.5 * np.sqrt(noise) <= 0.03 * usual.images.sum(axis=(1, 2))).all()


@pytest.mark.parametrize(
    ("integrator", "lights", "reason"),
    [
        (_integrator("volpath"), SEVERAL, "fog, smoke or liquids"),
        (_integrator("volpath"), PASSED["pane"] + LIGHTS["bulb"], "behind masks, thin glass"),
        (_integrator("volpath", hide_emitters=True), LIGHTS["bulb"], "hides emitters in a way"),
        (_integrator("direct_projective", hide_emitters=True), LIGHTS["bulb"], "hides emitters"),
    ],
)
def test_what_integrators_do_otherwise_than_path_is_left_to_them(
    tmp_path: Path, integrator: str, lights: str, reason: str
) -> None:
    scene = load_scene(write_room(tmp_path, lights=lights, integrator=integrator))
    assert reason in str(why_not_one_pass(scene))
    # One light costs no more than it does.
    is_said = any(reason in remark for remark in remarks_of_scene(scene))
    assert is_said == (len(scene.lights) > 1)


@pytest.mark.parametrize("sampler", ["stratified", "multijitter", "orthogonal", "ldsampler"])
def test_other_samplers(tmp_path: Path, sampler: str) -> None:
    path = write_room(tmp_path)
    text = path.read_text(encoding="utf-8").replace('"independent"', f'"{sampler}"')
    path.write_text(text, encoding="utf-8")
    scene = load_scene(path)
    planes = one_pass(scene, seed=3, spp=16)
    rendered = mitsuba_render(scene, {x.name: WHITE for x in scene.lights}, seed=3, spp=16)
    assert np.abs(planes.sum(axis=0) - rendered).max() <= SAME_SAMPLES * rendered.max()


@pytest.mark.parametrize(
    "wrapper",
    [
        '<integrator type="aov"><string name="aovs" value="dd:depth,nn:sh_normal"/>{}</integrator>',
        '<integrator type="moment">{}</integrator>',
        '<integrator type="moment"><integrator type="aov"><string name="aovs" value="dd:depth"/>'
        "{}</integrator></integrator>",
    ],
)
def test_a_wrapped_path_is_one_pass(tmp_path: Path, wrapper: str) -> None:
    scene = load_scene(write_room(tmp_path, integrator=wrapper.format(INTEGRATORS["path"])))
    assert why_not_one_pass(scene) is None
    planes = one_pass(scene, seed=11, spp=16)
    rendered = mitsuba_render(scene, {x.name: WHITE for x in scene.lights}, seed=11, spp=16)
    assert rendered.max() > 0
    assert np.abs(planes.sum(axis=0) - rendered).max() <= SAME_SAMPLES * rendered.max()
    inner_scene = load_scene(
        write_room(tmp_path, integrator=wrapper.format("<integrator type='volpathmis'/>"))
    )
    assert "volpathmis" in str(why_not_one_pass(inner_scene))


def test_wrapped_integrators_hide_what_the_inner_one_hides(tmp_path: Path) -> None:
    inner = '<integrator type="path"><boolean name="hide_emitters" value="true"/></integrator>'
    aovs = '<string name="aovs" value="dd:depth"/>'
    scene = load_scene(
        write_room(tmp_path, integrator=f'<integrator type="aov">{aovs}{inner}</integrator>')
    )
    assert scene.integrator.hide_emitters
    assert not render_basis(scene, spp=4).emitters_seen.any()
    with pytest.raises(SceneError, match="without one inside that renders light"):
        load_scene(write_room(tmp_path, integrator=f'<integrator type="aov">{aovs}</integrator>'))


def test_direct_is_path_of_depth_2(tmp_path: Path) -> None:
    scene = load_scene(write_room(tmp_path, integrator='<integrator type="direct"/>'))
    assert why_not_one_pass(scene) is None
    basis = render_basis(scene, spp=256)
    assert basis.origin.method == ONE_PASS
    white = {light.name: WHITE for light in scene.lights}
    rendered = render(scene, white, spp=256, stream=Stream.VERIFICATION)
    gap = float((basis.images.sum(axis=0) - rendered.image).sum(dtype=np.float64))
    noise = np.square(basis.half_differences.sum(axis=0), dtype=np.float64).sum()
    noise += np.square(rendered.half_difference, dtype=np.float64).sum()
    # Noise: five standard errors of the difference of the sums.
    assert abs(gap) <= 5 * np.sqrt(noise)


def test_equal_seeds_repeat_and_others_differ(small_room: Scene) -> None:
    a, b, c = (render_basis(small_room, spp=4, seed=s) for s in (0, 0, 1))
    assert a.images.tobytes() == b.images.tobytes()
    assert a.half_differences.tobytes() == b.half_differences.tobytes()
    assert np.abs(a.images - c.images).max() > 0.01 * a.images.max()


@pytest.mark.parametrize("lights", [("panel", "sky"), ("panel", "bulb", "beam")])
def test_hidden_emitters_are_hidden_from_the_camera_alone(
    tmp_path: Path, lights: tuple[str, ...]
) -> None:
    hidden = '<integrator type="path"><boolean name="hide_emitters" value="true"/></integrator>'
    veil = """<shape type="rectangle" id="veil"><transform name="to_world"><scale value="0.4"/>
        <translate z="1.5" y="1"/></transform><emitter type="area"/></shape>"""
    lights_text = "".join(LIGHTS[name] for name in lights) + veil
    scene = load_scene(write_room(tmp_path, lights=lights_text, integrator=hidden))
    assert why_not_one_pass(scene) is None
    white = {light.name: WHITE for light in scene.lights}
    planes = one_pass(scene, seed=3, spp=16)
    rendered = mitsuba_render(scene, white, seed=3, spp=16)
    assert np.abs(planes.sum(axis=0) - rendered).max() <= SAME_SAMPLES * rendered.max()
    assert not render_basis(scene, spp=4).emitters_seen.any()
    image = mitsuba_render(
        load_scene(write_room(tmp_path, lights=lights_text)), white, seed=3, spp=16
    )
    assert image.sum() > 1.1 * rendered.sum()


@pytest.mark.nightly
def test_better_numbers_are_unbiased_at_any_length_and_less_noisy(tmp_path: Path) -> None:
    """Against choosing at random, for a scene whose lights have no other noise."""
    lamps = "".join(
        f"""<emitter type="point"><point name="position" x="{0.4 * k - 0.8}" y="1" z="1"/>
        </emitter>"""
        for k in range(5)
    )
    integrator = '<integrator type="path"><integer name="max_depth" value="2"/></integrator>'
    scene = load_scene(write_room(tmp_path, lights=lamps, integrator=integrator))
    for spp in (3, 40):
        better = np.stack([one_pass(scene, seed=k, spp=spp, plain=False) for k in range(1, 9)])
        chance = np.stack([one_pass(scene, seed=k, spp=spp) for k in range(100, 108)])
        gap = better.mean(axis=(0, 2, 3)) - chance.mean(axis=(0, 2, 3))
        error = np.sqrt(
            sum(x.mean(axis=(2, 3)).var(axis=0, ddof=1) / len(x) for x in (better, chance))
        )
        # Noise: four and a half standard errors, five lights in three channels.
        assert (np.abs(gap) <= 4.5 * error).all()
        # What is left is the noise of edges within a pixel.
        assert better.var(axis=0).mean() < 0.8 * chance.var(axis=0).mean()


def test_pass_seeds_never_meet() -> None:
    seeds = [
        pass_seed(seed, stream, k) for seed in range(20) for stream in Stream for k in range(20)
    ]
    assert len(set(seeds)) == len(seeds)


@pytest.mark.parametrize("pixels", [1, 400, 230_400, 8_294_400])
@pytest.mark.parametrize("spp", [2, 3, 64, 1000])
def test_passes_make_up_two_equal_halves_of_the_samples(pixels: int, spp: int) -> None:
    plan = plan_passes(pixels, spp)
    sizes = [[size for half, size in plan if half == h] for h in range(2)]
    assert sizes[0] == sizes[1]
    assert spp <= sum(map(sum, sizes)) <= spp + 1
    assert [half for half, _ in plan] == [0, 1] * len(sizes[0])
    assert min(sizes[0]) >= 1
    assert max(sizes[0]) * pixels <= max(SAMPLES_PER_PASS, pixels)


def test_what_does_not_fit_is_refused_before_it_is_tried(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    free_memory = "lightpaint.basis.render.banded_film._free_memory"
    monkeypatch.setattr(free_memory, lambda: 2**33)
    path = write_room(tmp_path)
    huge = load_scene(path, parameters={"width": 10_000_000})
    with pytest.raises(SceneError, match="5 lights at 10000000x20"):
        render_basis(huge, spp=2)
    large = load_scene(path, parameters={"width": 600_000})
    assert memory_needed(large) > 5 * 600_000 * 20 * 3 * 4 * 6


def test_samples_that_are_there_need_no_room(
    small_room: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    basis = render_basis(small_room, spp=2)
    monkeypatch.setattr("lightpaint.basis.render.banded_film._free_memory", lambda: 1)
    assert render_basis(small_room, spp=2, start=basis).origin == basis.origin
    with pytest.raises(SceneError, match="are free"):
        render_basis(small_room, spp=4, start=basis)


def test_too_few_samples_are_refused(small_room: Scene) -> None:
    with pytest.raises(SceneError, match="too few for two halves"):
        render_basis(small_room, spp=1)


def test_what_is_no_number_is_left_out(small_room: Scene) -> None:
    """One such path in a pixel would make every sum over the picture none."""
    # What there is of Dr.Jit depends on the variant, which a scene that was loaded has set.
    import drjit as dr
    import mitsuba as mi

    from lightpaint.basis.render.tracer.light_planes import LightPlanes
    from lightpaint.basis.render.tracer.one_pass import Tracer

    tracer = Tracer(small_room, 0)
    planes = LightPlanes(tracer.light_of, len(small_room.lights), (1, 3))
    emitter = dr.gather(mi.EmitterPtr, tracer.loaded.emitters_dr(), mi.UInt32(0, 0, 0))
    value = mi.Color3f(mi.Float(1, np.nan, 2), mi.Float(1, 1, np.inf), mi.Float(1, 1, 1))
    way, uv = mi.Vector3f(0, 0, 1), mi.Point2f(0)
    planes.add(mi.UInt32(0, 1, 2), emitter, value, way, uv, mi.UInt32(0), mi.Bool(True))
    planes.evaluate()
    np.testing.assert_array_equal(planes.sums().sum(axis=0)[0], [[1] * 3, [0] * 3, [0] * 3])
    tracer.close()


def test_all_samples_are_traced_by_one_kernel(small_room: Scene) -> None:
    """Compiling it takes longer than the first samples of a picture."""
    use_variant()
    import drjit as dr

    from lightpaint.basis.render.tracer.one_pass import Tracer

    rows = range(small_room.size[0])
    pixels = np.arange(len(rows) * small_room.size[1])
    tracer = Tracer(small_room, 0)
    planes, listed = tracer.planes(rows), tracer.pixel_planes(7)
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        for k in range(3):
            tracer.learn(rows[k:], k, 1)
        tracer.end_training()
        for k in range(4):  # wherever the arrays of a call happen to lie in memory
            tracer.add(planes, k % 2, rows, k, 1)
            some = pixels[k : k + 7]
            tracer.top_up(listed, 0, some, np.zeros_like(some), np.ones_like(some))
        history = dr.kernel_history((dr.KernelType.JIT,))
    tracer.close()
    # A path tracer is hundreds of times as long as what fills or copies an array.
    long = [kernel["hash"] for kernel in history if len(kernel["ir"].getvalue()) > 2**16]
    assert len(long) == 3 + 4 * 2
    assert len(set(long)) == 1


@pytest.mark.parametrize("size", [(1, 1), (3, 9), (8, 12), (5, 4)])
def test_tiles_hold_each_pixel_once_and_squares_together(size: tuple[int, int]) -> None:
    from lightpaint.basis.render.tracer.one_pass import TILE, places_by_tile

    rows, columns = size
    places = places_by_tile(rows, columns)
    assert sorted(places.tolist()) == list(range(rows * columns))
    tiles = [(place // columns // TILE, place % columns // TILE) for place in places.tolist()]
    assert tiles == sorted(tiles)
