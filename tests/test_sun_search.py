"""A sun in a sky of coarse texels gets finer ones, if the painting gains by it."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from command import run, run_refused, succeed
from nightly import nightly

from lightpaint.basis.lights import light_images
from lightpaint.colour.color import luminance
from lightpaint.colour.color_ranges import white_range
from lightpaint.errors import LightpaintError
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.constraints.values import parse_color
from lightpaint.pipeline.job.solve_job import Job
from lightpaint.pipeline.job_bases import Certainty
from lightpaint.pipeline.look import Look
from lightpaint.pipeline.one_call import paint_with_light
from lightpaint.progress import Listener
from lightpaint.scene.lights.texels.texel import coarse_name
from lightpaint.scene.properties.emission import read_emitted_image
from lightpaint.scene.scene_reader import load_scene
from lightpaint.scene.scene_render import Stream, render
from lightpaint.target.painted_target import Target

SCENE = """<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="3"/></integrator>
    <sensor type="perspective"><transform name="to_world"><lookat origin="0, 3, 3"
        target="0, 0, 0" up="0, 1, 0"/></transform><film type="hdrfilm">
        <integer name="width" value="40"/><integer name="height" value="30"/></film></sensor>
    <shape type="rectangle"><transform name="to_world"><scale value="3"/>
        <rotate x="1" angle="-90"/></transform></shape>
    <shape type="cube"><transform name="to_world"><scale x="0.1" y="0.6" z="0.1"/>
        <translate y="0.6"/></transform></shape>
    <emitter type="envmap" id="sky"><string name="filename" value="{map}.exr"/></emitter>
    {more}
</scene>"""
WALL = """<shape type="rectangle" id="panel"><transform name="to_world"><translate y="5"/>
    </transform><emitter type="area" id="wall"><rgb name="radiance" value="1"/></emitter></shape>"""
BULB = """<emitter type="point" id="bulb"><point name="position" x="0" y="3" z="0"/></emitter>"""
SPLIT = {"sky": "8x5"}


class Remarks(Listener):
    """Remembers what is said."""

    def __init__(self) -> None:
        self.said: list[str] = []

    def say(self, text: str) -> None:
        self.said.append(text)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A post on a plane below an even sky, one with a small sun, one with two, and a softer one."""
    folder = tmp_path_factory.mktemp("suns")
    even = np.full((61, 120, 3), 0.4, np.float32)
    sunny, soft = even.copy(), np.full((5, 8, 3), 0.4, np.float32)
    sunny[20:22, 40:42] = 300.0, 240.0, 180.0
    soft[1, 2] *= 2
    twins = np.maximum(sunny, sunny[:, ::-1])
    skies = (("even", even), ("sunny", sunny), ("twins", twins), ("soft", soft))
    for name, image in skies:
        write_rgb(folder / f"{name}.exr", image)
        (folder / f"{name}.xml").write_text(SCENE.format(map=name, more=""))
    (folder / "wall.xml").write_text(SCENE.format(map="even", more=WALL))
    without_sky = SCENE[: SCENE.index("<emitter")] + "{more}</scene>"
    (folder / "bulb.xml").write_text(without_sky.format(more=BULB))
    return folder


def target_under(folder: Path, sky: str) -> Target:
    """Return a long render under a sky."""
    lit = load_scene(folder / f"{sky}.xml")
    return Target.of(render(lit, spp=512, stream=Stream.TEMPLATE).image)


def answered(
    folder: Path,
    sky: str,
    sun: int,
    remarks: Remarks,
    *,
    symmetric: Sequence[str] = (),
    **options: object,
) -> Look:
    """Return the answer to a sky from the even one, split, with a sun of that many texels."""
    scene = load_scene(folder / "even.xml", split=SPLIT, symmetric=symmetric)
    defaults = {"spp": 64, "colors": "free", "space": "linear", "report": False}
    return paint_with_light(
        scene,
        target_under(folder, sky),
        folder / f"{sky}-{sun}",
        sun=sun,
        progress=remarks,
        **{**defaults, **options},
    )


def missed(look: Look) -> float:
    """Return the missed share of the energy of the painting, for the answer as rendered."""
    goal = look.target.image
    return float(((look.predicted.image - goal) ** 2).sum() / (goal**2).sum())


def test_a_sun_is_found_and_casts_its_shadow(folder: Path) -> None:
    remarks = Remarks()
    coarse, finer = (answered(folder, "sunny", sun, remarks) for sun in (0, 50))
    assert missed(finer) < 0.4 * missed(coarse)
    assert finer.verification is not None
    assert finer.verification.agrees
    assert 24 <= len(finer.basis.lights) - len(coarse.basis.lights) <= 50
    [image] = light_images(finer.basis.lights)
    shown = image.radiances(finer.solution.weights).sum(axis=2)
    row, column = np.unravel_index(int(shown.argmax()), shown.shape)
    columns, rows = image.layout.finest
    # Within a texel of the first finer grid; the sun is at 41 of 120 columns, 20.5 of 60 rows.
    assert (column + 0.5) / columns == pytest.approx(41 / 120, abs=1 / 24)
    assert row / (rows - 1) == pytest.approx(20.5 / 60, abs=1 / 12)
    written = read_emitted_image(folder / "sunny-50" / "relit.sky.exr", is_linear=True)
    assert written.shape == (rows, columns, 3)
    [remark] = [text for text in remarks.said if "finer texels of sky" in text]
    assert remark.endswith(f"split={{'sky': '{image.layout.text}'}}")
    # The answer can be opened with these texels, which are what was found.
    again = load_scene(folder / "sunny-50" / "relit.xml", split={"sky": image.layout.text})
    names = [light.name for light in again.lights]
    weights = [finer.solution.weights[finer.basis.names.index(name)] for name in names]
    np.testing.assert_allclose([x.emission for x in again.lights], weights, rtol=1e-4, atol=1e-9)


@pytest.mark.nightly
def test_where_nothing_is_gained_the_texels_stay_as_they_are(folder: Path) -> None:
    remarks = Remarks()
    look = answered(folder, "soft", 24, remarks)
    assert len(look.basis.lights) == 40
    assert any(text.startswith("no sun:") for text in remarks.said)


@pytest.mark.nightly
def test_constraints_on_a_texel_hold_for_the_finer_ones_in_its_place(folder: Path) -> None:
    constraints = Constraints.of({"sky.*.y1": {"limits": {"max": 5}}})
    look = answered(folder, "sunny", 24, Remarks(), constraints=constraints)
    assert len(look.basis.lights) > 40
    its_row = [coarse_name(name).endswith(".y1") for name in look.basis.names]
    assert sum(its_row) == 8 - 1 + 15  # three rows of the finer grid are nearest to it
    assert np.max(luminance(look.solution.weights)[its_row]) == pytest.approx(5, rel=1e-6)


@pytest.mark.nightly
def test_a_symmetric_sky_gets_finer_texels_on_both_sides(folder: Path) -> None:
    remarks = Remarks()
    coarse, finer = (answered(folder, "twins", sun, remarks, symmetric=["sky"]) for sun in (0, 24))
    assert missed(finer) < 0.7 * missed(coarse)
    assert len(finer.basis.lights) - len(coarse.basis.lights) == 24
    [image] = light_images(finer.basis.lights)
    assert image.is_whole
    assert sum(1 for node in image.layout.nodes if node[0]) == 50
    shown = image.radiances(finer.solution.weights)
    np.testing.assert_allclose(shown, shown[:, ::-1], rtol=1e-12)  # it is interpolated
    written = read_emitted_image(folder / "twins-24" / "relit.sky.exr", is_linear=True)
    np.testing.assert_allclose(written, shown, rtol=1e-6)
    assert finer.verification is not None
    assert finer.verification.agrees


#: A palette of two colours, between which the sun of the test is.
PALETTE = ("#ffb060", "#ffffff")


def mixes_of_palette(colors: np.ndarray) -> np.ndarray:
    """Return mixes of the palette near to colours, (n, 3): equal to those that are mixes."""
    palette = np.array([parse_color(x, "the palette") for x in PALETTE])
    parts, *_ = np.linalg.lstsq(palette.T, colors.T)
    return np.maximum(parts.T, 0) @ palette


@pytest.mark.parametrize(
    ("values", "colors"),
    [
        nightly({"limits": {"max": 10}}, "free"),
        nightly({"limits": {"max": 10}}, "gentle"),
        nightly({"kelvin": [3000, 12000]}, "free"),
        nightly({"primaries": list(PALETTE)}, "free"),
    ],
)
def test_constraints_on_the_sky_hold_for_all_its_texels(
    folder: Path, values: dict[str, object], colors: str
) -> None:
    constraints = Constraints.of({"sky": values})
    options = {"constraints": constraints, "colors": colors, "verify": False}
    look = answered(folder, "sunny", 24, Remarks(), **options)
    weights = look.solution.weights
    assert len(weights) == 40 + 24
    if "limits" in values:
        assert np.max(luminance(weights)) == pytest.approx(10, rel=1e-6)
    if "primaries" in values:
        np.testing.assert_allclose(weights, mixes_of_palette(weights), atol=1e-6)
    if "kelvin" in values:
        whites = white_range(3000, 12000).nearest(weights)
        np.testing.assert_allclose(weights, whites, rtol=1e-3, atol=1e-6)


@pytest.mark.nightly
def test_the_errors_of_finer_texels_are_as_small_as_asked_for(folder: Path) -> None:
    remarks = Remarks()
    options = {"spp": None, "error": 0.6, "use_cache": False, "verify": False}
    look = answered(folder, "sunny", 24, remarks, **options)
    assert len(look.basis.lights) == 40 + 24
    state = Certainty.of(look.solution)
    assert len(state.errors) == 40 + 24
    assert state.error <= 0.6
    assert look.basis.extra is not None
    finer = [x for x in look.lighting.lights if x.name.startswith("sky.sun1.")]
    assert len(finer) == 25
    assert all(x.interval is not None for x in finer)
    assert any("texels are known to" in text for text in remarks.said)


@pytest.mark.nightly
def test_several_views_share_the_finer_texels(folder: Path) -> None:
    for sky in ("even", "sunny"):
        scene = (folder / f"{sky}.xml").read_text()
        one, rest = scene[scene.index("<sensor") :].split("</sensor>", 1)
        sensors = [one.replace("<sensor", f'<sensor id="{name}"') for name in ("left", "right")]
        both = "</sensor>".join([*sensors, rest]).replace("0, 3, 3", "0.5, 3, 3", 1)
        (folder / f"{sky}-twice.xml").write_text(scene[: scene.index("<sensor")] + both)
    options = []
    for index, name in enumerate(("left", "right")):
        lit = load_scene(folder / "sunny-twice.xml", sensor=index)
        write_rgb(folder / f"{name}.exr", render(lit, spp=256, stream=Stream.TEMPLATE).image)
        options += ["--target", f"{name}={name}.exr"]
    options += ["--split", "sky=8x5", "--sun", "24", "--spp", "64", "--colors", "free"]
    succeed(folder, "solve", "even-twice.xml", *options, "--no-verify", "-o", "views")
    names = list(read_lighting(folder / "views" / "lighting.json"))
    assert len(names) == 40 + 24
    assert sum(name.startswith("sky.sun1.") for name in names) == 25


def test_the_lights_file_may_ask_for_a_sun(folder: Path) -> None:
    path = folder / "asks.xml"
    path.write_text((folder / "even.xml").read_text())
    lights = folder / "asks.lights.toml"
    lights.write_text("[light.sky]\nsplit = [8, 5]\nsun = 3\n")
    with pytest.raises(LightpaintError, match="sun=3: a texel that is split again becomes 25"):
        Job((load_scene(path),), (target_under(folder, "soft"),), folder / "out")
    lights.write_text("[light.sky]\nsplit = [8, 5]\nsun = -3\n")
    with pytest.raises(LightpaintError, match=r"light.sky.sun is -3: expected how many"):
        Job((load_scene(path),), (target_under(folder, "soft"),), folder / "out")


@pytest.mark.nightly
def test_the_remark_on_a_sun_has_the_option_that_paints_with_it(folder: Path) -> None:
    write_rgb(folder / "sunny-painting.exr", target_under(folder, "sunny").image)
    options = ("--split", "sky=8x5", "--sun", "24", "--spp", "64", "--no-verify")
    arguments = ("solve", "even.xml", "sunny-painting.exr", *options, "-o", "told")
    told = run(folder, *arguments).stderr
    assert "to paint with them or solve again: --split sky=8x5+x2.y1\n" in told
    listed = succeed(folder, "lights", "told/relit.xml", "--split", "sky=8x5+x2.y1")
    assert "8x5 + 25 texels" in listed
    text = "not a sky: only its texels can be split again"
    assert text in run_refused(folder, "lights", "wall.xml", "--split", "wall=4x4+x1.y1")


@pytest.mark.parametrize(
    ("scene", "options", "part"),
    [
        ("even", ["--sun"], "even.xml has none: split its sky with --split sky=VALUE"),
        ("even", ["--split", "sky=8x5", "--sun", "-1"], "--sun: '-1' is not a whole number"),
        ("even", ["--split", "sky=8x5", "--sun", "10"], "expected at least 24 more"),
        ("even", ["--split", "sky=8x5", "--sun", "9999"], "too large: expected at most 4096"),
        (
            "even",
            ["--split", "sky=8x5", "--group", "dome=sky.*.y0", "--sun"],
            "each texel of sky must be a light of its own",
        ),
        (
            "wall",
            ["--split", "wall=4x3", "--sun"],
            "the texels of wall are not split again; split it more finely, such as 8x6, and leave "
            "--sun out",
        ),
        ("bulb", ["--sun"], "bulb.xml has none: leave --sun out"),
    ],
)
def test_what_has_no_sun_is_refused_in_one_line(
    folder: Path, scene: str, options: list[str], part: str
) -> None:
    write_rgb(folder / "flat.exr", np.full((30, 40, 3), 0.4, np.float32))
    line = run_refused(folder, "solve", f"{scene}.xml", "flat.exr", *options, "-o", "refused")
    assert part in line
