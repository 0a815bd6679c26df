"""Every kind of light that is not one colour: its plane, its weight, and its way back to XML."""

from pathlib import Path

import numpy as np
import pytest
from nightly import nightly
from renderer import LIGHTS, SAME_SAMPLES, mitsuba_render, one_pass, write_room

from lightpaint.basis.render.basis_render import render_basis
from lightpaint.basis.render.separate_renders import WHITE
from lightpaint.errors import SceneError
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.default_solve import solve
from lightpaint.relit.relit_scene import relight
from lightpaint.relit.verification_render import verify
from lightpaint.scene.lights.light import settings_for
from lightpaint.scene.properties.emission import MULTIPLE, Scaling
from lightpaint.scene.scene_reader import load_scene
from lightpaint.target.painted_target import Target

PLACE = """<transform name="to_world"><lookat origin="0.5 1.8 1.5" target="0 0.3 0" up="0 1 0"/>
    </transform>"""
PANE = """<transform name="to_world"><scale value="0.4"/><rotate y="1" angle="90"/>
    <translate x="-1" y="1"/></transform>"""
BITMAP = '<texture type="bitmap" name="{}"><string name="filename" value="{}"/></texture>'

#: name → (XML, how it is scaled)
KINDS = {
    "environment": (
        """<emitter type="envmap" id="it"><string name="filename" value="map.exr"/>
        <float name="scale" value="0.5"/></emitter>""",
        Scaling.IMAGE,
    ),
    "screen": (
        f"""<shape type="rectangle" id="it">{PANE}
        <emitter type="area">{BITMAP.format("radiance", "picture.png")}</emitter></shape>""",
        Scaling.IMAGE,
    ),
    "projector": (
        f"""<emitter type="projector" id="it">{BITMAP.format("irradiance", "map.exr")}
        <float name="scale" value="3"/>{PLACE}</emitter>""",
        Scaling.IMAGE,
    ),
    "textured spot": (
        f"""<emitter type="spot" id="it">{BITMAP.format("texture", "picture.png")}{PLACE}
        <rgb name="intensity" value="3 4 5"/></emitter>""",
        Scaling.COLOUR,
    ),
    "sun and sky": (
        """<emitter type="sunsky" id="it"><float name="sun_scale" value="0.01"/>
        <float name="sky_scale" value="0.02"/>
        <vector name="sun_direction" x="0.3" y="0.8" z="0.6"/></emitter>""",
        Scaling.FACTORS,
    ),
    "painted mesh": (
        """<shape type="ply" id="it"><string name="filename" value="painted.ply"/>
        <emitter type="area"><texture type="mesh_attribute" name="radiance">
        <string name="name" value="vertex_color"/><float name="scale" value="2"/></texture>
        </emitter></shape>""",
        Scaling.FACTORS,
    ),
    "screen by reference": (
        f"""<texture type="bitmap" id='a > "b"' name="it"><string name="filename"
        value="picture.png"/></texture><shape type="rectangle" id="it">{PANE}
        <emitter type="area"><ref name="radiance" id="a > &quot;b&quot;"/></emitter></shape>""",
        Scaling.IMAGE,
    ),
    "painted mesh by reference": (
        """<texture type="mesh_attribute" id="paint"><string name="name" value="vertex_color"/>
        </texture><shape type="ply" id="it"><string name="filename" value="painted.ply"/>
        <emitter type="area"><ref id="paint" name="radiance"/></emitter></shape>""",
        Scaling.FACTORS,
    ),
}


@pytest.fixture
def assets(tmp_path: Path) -> Path:
    """A folder with the images and the mesh that the lights above emit."""
    from PIL import Image

    rng = np.random.default_rng(0)
    write_rgb(tmp_path / "map.exr", rng.random((8, 16, 3)).astype(np.float32))
    Image.fromarray(rng.integers(0, 255, (8, 16, 3), np.uint8)).save(tmp_path / "picture.png")
    corners = [
        (-1, 0.5, 0, 1, 0, 0, 0, 0),
        (-1, 1.5, 0, 0, 1, 0, 1, 0),
        (-1, 1, 1, 0, 0, 1, 0, 1),
    ]
    lines = "\n".join(" ".join(map(str, corner)) for corner in corners)
    properties = "".join(f"property float {p}\n" for p in "xyzrgbuv")
    (tmp_path / "painted.ply").write_text(
        f"ply\nformat ascii 1.0\nelement vertex 3\n{properties}element face 1\n"
        f"property list uchar int vertex_indices\nend_header\n{lines}\n3 0 1 2\n",
        encoding="ascii",
    )
    return tmp_path


@pytest.fixture(params=KINDS)
def kind(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def test_unit_is_what_the_scene_has(assets: Path, kind: str) -> None:
    xml, scaling = KINDS[kind]
    scene = load_scene(write_room(assets, lights=xml + LIGHTS["bulb"]))
    light = scene.light("it")
    kind_found = light.members[0].kind
    assert kind_found is not None
    assert kind_found.scaling is scaling
    if scaling is not Scaling.COLOUR:
        assert light.emission == (1, 1, 1)
        assert light.unit == MULTIPLE
    planes = one_pass(scene, seed=3, spp=16)
    unit = {x.name: WHITE for x in scene.lights}
    rendered = mitsuba_render(scene, unit, seed=3, spp=16)
    assert planes[0].max() > 0
    assert np.abs(planes.sum(axis=0) - rendered).max() <= SAME_SAMPLES * rendered.max()


def _lit_blocks(image: np.ndarray) -> np.ndarray:
    """The means of blocks of 4x4 pixels of the room, (30,)."""
    return image.reshape(5, 4, 6, 4, 3).mean(axis=(1, 3, 4)).ravel()


@pytest.mark.nightly
def test_a_basis_of_sun_and_sky_is_what_mitsuba_renders(assets: Path) -> None:
    """As a basis chooses emitters and places on them, in blocks of pixels, within their noise."""
    scene = load_scene(write_room(assets, lights=KINDS["sun and sky"][0]))
    bases, renders = (
        np.stack([_lit_blocks(image) for image in images])
        for images in (
            [render_basis(scene, spp=256, seed=seed).images[0] for seed in range(4)],
            [mitsuba_render(scene, seed=seed, spp=256) for seed in range(8)],
        )
    )
    lit = renders.mean(axis=0) > 0
    assert lit.sum() > 20
    errors2 = sum(x.var(axis=0, ddof=1) / len(x) for x in (bases, renders))
    differences = (bases.mean(axis=0) - renders.mean(axis=0))[lit]
    # Noise: the errors are known of few renders, so all blocks are judged at once. Each block is
    # lit within 4 %.
    assert np.sqrt((differences**2).sum() / errors2[lit].sum()) < 2
    assert np.abs(differences / renders.mean(axis=0)[lit]).max() < 0.04


def test_a_slide_that_is_never_sampled_is_dark_and_comes_back(assets: Path) -> None:
    xml = KINDS["projector"][0]
    dark = xml.replace("</emitter>", '<float name="sampling_weight" value="0"/></emitter>')
    dark = dark.replace('id="it"', 'id="dark"')
    scene = load_scene(write_room(assets, lights=xml + dark + LIGHTS["bulb"]))
    assert [x.emission for x in scene.lights[:2]] == [(1, 1, 1), (0, 0, 0)]
    lighting = Lighting.current(render_basis(scene, spp=2))
    lit = lighting.with_emission("dark", (1, 1, 1)).with_emission("it", (0, 0, 0))
    relit = relight(scene, lit, assets / "out" / "relit.xml")
    assert [x.emission for x in relit.lights[:2]] == [(0, 0, 0), (1, 1, 1)]
    shown = mitsuba_render(relit, seed=4, spp=16)
    # Other choices of emitters lead to other samples.
    assert shown.mean() == pytest.approx(mitsuba_render(scene, seed=4, spp=16).mean(), rel=0.02)
    # Tied to one that shines it stays as dark beside it.
    tied = scene.with_lights({"slides": ["it", "dark"], "bulb": ["bulb"]})
    [slides, _] = tied.lights
    assert slides.emission == (1, 1, 1)
    assert [slides.emission_of(x, (2, 2, 2)) for x in slides.members] == [(2, 2, 2), (0, 0, 0)]


def test_a_texture_that_lights_share_is_changed_for_one_of_them(assets: Path) -> None:
    """It may be defined in an included file, and have textures in it with ids of their own."""
    (assets / "textures").mkdir()
    (assets / "textures" / "all.xml").write_text(
        """<scene version="3.0.0"><texture type="bitmap" id="shown">
        <string name="filename" value="picture.png"/>
        <transform name="to_uv"><scale x="2" y="2"/></transform></texture></scene>"""
    )
    screens = "".join(
        f"""<shape type="rectangle" id="{name}"><transform name="to_world">
        <scale value="0.4"/><translate x="{x}" y="1"/></transform>
        <emitter type="area"><ref id="shown" name="radiance"/></emitter></shape>"""
        for name, x in (("left", -0.5), ("right", 0.5))
    )
    include = '<include filename="textures/all.xml"/>'
    scene = load_scene(write_room(assets, lights=include + screens))
    lighting = Lighting.current(render_basis(scene, spp=2))
    relit = relight(scene, lighting.with_emission("left", (1, 0.5, 2)), assets / "out" / "r.xml")
    written = (assets / "out" / "r.xml").read_text()
    assert written.count('<ref id="shown" name="radiance"/>') == 1  # that of the other
    planes = one_pass(scene, seed=4, spp=16)
    weights = np.array([[1, 0.5, 2] if x.name == "left" else [1, 1, 1] for x in scene.lights])
    mixed = np.einsum("nhwc,nc->hwc", planes, weights)
    rendered = mitsuba_render(relit, seed=4, spp=16)
    # Samples of an image are chosen by its brightness, so the noise of 16 of them remains.
    assert abs(mixed.mean() - rendered.mean()) <= 0.05 * rendered.mean()


@pytest.mark.parametrize("factor", [2.0, nightly(0.25)])
def test_grey_multiples_are_the_relit_render_at_the_same_seed(
    assets: Path, kind: str, factor: float
) -> None:
    xml, scaling = KINDS[kind]
    scene = load_scene(write_room(assets, lights=xml + LIGHTS["bulb"]))
    basis = render_basis(scene, spp=2)
    light = scene.light("it")
    emission = (factor * light.emission[0],) * 3
    lighting = Lighting.current(basis).with_emission("it", emission)
    relit = relight(scene, lighting, assets / "out" / "relit.xml")
    planes = one_pass(scene, seed=4, spp=16)
    mixed = np.einsum("nhwc,nc->hwc", planes, lighting.weights_for(basis))
    rendered = mitsuba_render(relit, seed=4, spp=16)
    # float32 throughout; images chosen by brightness may fall on the other side of a step.
    tolerance = 1e-5 if scaling is not Scaling.IMAGE else 1e-4
    assert np.abs(mixed - rendered).max() <= tolerance * rendered.max()


def test_predicted_is_the_relit_render(assets: Path, kind: str) -> None:
    xml, scaling = KINDS[kind]
    scene = load_scene(write_room(assets, lights=xml + LIGHTS["bulb"]))
    basis = render_basis(scene, spp=256)
    lighting = Lighting.current(basis)
    for emission in ((0.5, 1.5, 2.0), (0.0, 0.0, 0.0), (1.0, 1.0, 1.0)):
        rgb = (emission[0],) * 3 if scaling is Scaling.FACTORS else emission
        changed = lighting.with_emission("it", rgb).with_emission("bulb", (0.3, 0.2, 0.1))
        relit = relight(scene, changed, assets / "out" / "relit.xml")
        verification = verify(combine(basis, changed), relit, spp=256)
        assert verification.agrees, (emission, verification.difference)


def test_known_multiples_come_back(assets: Path, kind: str) -> None:
    xml, scaling = KINDS[kind]
    scene = load_scene(write_room(assets, lights=xml + LIGHTS["bulb"]))
    basis = render_basis(scene, spp=32)
    multiples = (1.7,) * 3 if scaling is Scaling.FACTORS else (0.5, 0.0, 2.0)
    lighting = Lighting.current(basis).with_emission("it", multiples)
    target = Target("t", combine(basis, lighting).image, np.ones(basis.size, np.float32), False)
    solution = solve(basis, target)
    # The target is float32.
    for name, emission in solution.lighting.emission.items():
        np.testing.assert_allclose(emission, lighting.emission[name], rtol=1e-5, atol=1e-5)


def test_a_light_with_one_weight_keeps_its_colour(assets: Path) -> None:
    scene = load_scene(write_room(assets, lights=KINDS["sun and sky"][0] + LIGHTS["bulb"]))
    basis = render_basis(scene, spp=32)
    red = np.zeros((*basis.size, 3), np.float32)
    red[..., 0] = basis.image("it")[..., 0]
    solution = solve(basis, Target("t", red, np.ones(basis.size, np.float32), everything=False))
    r, g, b = solution.lighting.emission["it"]
    assert r == g == b
    assert 0 < r < 1
    assert solution.certificate.converged


CHECKERS = """<shape type="rectangle" id="it"><emitter type="area">
    <texture type="checkerboard" name="radiance"/></emitter></shape>"""
CANNOT = {
    "is a timed_sunsky emitter": ('<emitter type="timed_sunsky" id="it"/>', "path"),
    "Not implemented for non-spectral": (
        """<emitter type="point" id="it"><spectrum type="blackbody" name="intensity">
        <float name="temperature" value="3000"/></spectrum></emitter>""",
        "path",
    ),
    # Fine for a path tracer, which never starts at a light.
    "by ptracer .*not implemented": (CHECKERS, "ptracer"),
}


@pytest.mark.parametrize("words", CANNOT)
def test_what_mitsuba_cannot_render_is_named(tmp_path: Path, words: str) -> None:
    light, integrator = CANNOT[words]
    integrator = f'<integrator type="{integrator}"/>'
    path = write_room(tmp_path, lights=light + LIGHTS["bulb"], integrator=integrator)
    with pytest.raises(SceneError, match=f"light 'it' .*{words}") as refusal:
        load_scene(path)
    assert "\n" not in str(refusal.value)


def test_images_of_lights_with_nearly_the_same_name_stay_apart(assets: Path) -> None:
    screens = "".join(
        KINDS["screen"][0].replace('id="it"', f'id="{name}"') for name in ("key 1", "key/1")
    )
    scene = load_scene(write_room(assets, lights=screens))
    basis = render_basis(scene, spp=64)
    lighting = Lighting.current(basis).with_emission("key 1", (1, 2, 3))
    lighting = lighting.with_emission("key/1", (3, 1, 0.5))
    relit = relight(scene, lighting, assets / "out" / "a.xml")
    predicted = combine(basis, lighting)
    other = Lighting.current(basis).with_emission("key 1", (9, 1, 1))
    relight(scene, other, assets / "out" / "b.xml")
    assert len(list((assets / "out").glob("*.exr"))) == 3
    assert verify(predicted, relit, spp=64).agrees


def test_what_is_hit_by_chance_is_not_sampled_though_all_else_is_off(assets: Path) -> None:
    """Mitsuba wants an emitter that may be sampled: it gets a black one."""
    scene = load_scene(write_room(assets, lights=KINDS["painted mesh"][0] + LIGHTS["bulb"]))
    emission = {"it": (1.0, 1.0, 1.0), "bulb": (0.0, 0.0, 0.0)}
    settings = settings_for(scene.lights, scene.emitters, emission, scene="room")
    sampling_weights = {x.name: settings[x.node].sampling_weight for x in scene.emitters}
    assert sampling_weights == {"it": 0, "bulb": 1}
    basis = render_basis(scene, spp=256)
    lighting = Lighting.current(basis).with_emission("bulb", (0.0, 0.0, 0.0))
    relit = relight(scene, lighting, assets / "out" / "relit.xml")
    assert {x.name: x.sampling_weight for x in relit.emitters} == {"it": 0, "bulb": 1}
    assert verify(combine(basis, lighting), relit, spp=256).agrees
    # And where it is all there is, Mitsuba has to sample it.
    only = load_scene(write_room(assets, lights=KINDS["painted mesh"][0]))
    relit = relight(only, Lighting.current(render_basis(only, spp=2)), assets / "2" / "relit.xml")
    assert [x.sampling_weight for x in relit.emitters] == [1]
