"""Skies that are equal to their mirror images, and skies of few colours."""

from pathlib import Path

import numpy as np
import pytest
from command import run_refused, succeed
from renderer import LIGHTS, write_room

import lightpaint as lp
from lightpaint.arrays import RGB
from lightpaint.colour.color import cct_and_duv
from lightpaint.images.formats.exr import write_rgb
from lightpaint.scene.properties.emission import read_emitted_image
from lightpaint.scene.scene_render import Stream, render

#: What float32 files leave of equal numbers.
FLOAT32 = 1e-6
#: A range of white is a chain of straight pieces: how far these are from the locus, in parts of
#: the temperature and in Duv.
PIECE, DUV = 1e-2, 1e-3


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A room below a lopsided sky, and a target under another one."""
    folder = tmp_path_factory.mktemp("symmetric")
    rng = np.random.default_rng(6)
    for name in ("sky", "other"):
        write_rgb(folder / f"{name}.exr", rng.uniform(0.05, 0.6, (4, 5, 3)).astype(np.float32))
        sky = LIGHTS["sky"].replace("constant", "envmap")
        sky = sky.replace(
            '<rgb name="radiance" value="0.1 0.2 0.3"/>',
            f'<string name="filename" value="{name}.exr"/>',
        )
        write_room(folder, lights=sky + LIGHTS["bulb"], name=f"{name}.xml")
    other = lp.load_scene(folder / "other.xml")
    write_rgb(folder / "target.exr", render(other, spp=64, stream=Stream.TEMPLATE).image)
    return folder


def assert_white(emissions: list[RGB], coolest: float, hottest: float) -> None:
    """Assert that those that are not off are between two temperatures, on the locus."""
    lit = [np.array(rgb) for rgb in emissions if max(rgb) > 0]
    assert lit
    for rgb in lit:
        found = cct_and_duv(rgb)
        assert found is not None
        assert coolest * (1 - PIECE) <= found[0] <= hottest * (1 + PIECE)
        assert abs(found[1]) <= DUV


def test_two_texels_are_one_light_at_their_mean(folder: Path) -> None:
    whole = lp.load_scene(folder / "sky.xml", split={"sky": (5, 4)})
    scene = lp.load_scene(folder / "sky.xml", split={"sky": (5, 4)}, symmetric=["sky"])
    assert len(scene.lights) == 3 * 4 + 1
    pair = scene.light("sky.x1.y2")
    assert pair.member_names == ("sky.x1.y2", "sky.x3.y2")
    emissions = {x.name: np.array(x.emission) for x in whole.emitters}
    mean = (emissions["sky.x1.y2"] + emissions["sky.x3.y2"]) / 2
    np.testing.assert_allclose(pair.emission, mean)
    assert scene.light("sky.x2.y2").member_names == ("sky.x2.y2",)


@pytest.mark.nightly
def test_a_symmetric_sky_keeps_to_its_limits_and_whites(folder: Path) -> None:
    (folder / "sky.lights.toml").write_text("[light.sky]\nsplit = [5, 4]\nsymmetric = true\n")
    options = ["--kelvin", "sky=3000:9000", "--limit", "sky.*.y1=:0.3", "--spp", 32, "-o", "out"]
    output = succeed(folder, "solve", "sky.xml", "target.exr", *options)
    (folder / "sky.lights.toml").unlink()
    assert "sky, 5x4 texels" in output
    assert "Rendered again: equal within noise" in output
    image = read_emitted_image(folder / "out" / "relit.sky.exr", is_linear=True)
    np.testing.assert_array_equal(image, image[:, ::-1])
    assert len(np.unique(image[2], axis=0)) == 3
    lighting = lp.read_lighting(folder / "out" / "lighting.json")
    assert lighting.certificate is not None
    texels = [x for x in lighting.lights if x.name.startswith("sky.")]
    assert len(texels) == 12
    luminances = {x.name: float(np.dot(x.emission, (0.2126, 0.7152, 0.0722))) for x in texels}
    assert max(y for name, y in luminances.items() if name.endswith("y1")) <= 0.3 * (1 + FLOAT32)
    assert_white([x.emission for x in texels], 3000, 9000)
    succeed(folder, "relight", "sky.xml", "out/lighting.json", "--spp", 2, "-o", "again")
    again = (folder / "again" / "relit.sky.exr").read_bytes()
    assert again == (folder / "out" / "relit.sky.exr").read_bytes()


def test_the_list_of_lights_has_the_whole_image(folder: Path) -> None:
    options = ["--split", "sky=5x4", "--symmetric", "sky", "--no-sheet"]
    output = succeed(folder, "lights", "sky.xml", *options)
    assert "5x4 texels sky.xCOLUMN.yROW, symmetric" in output
    assert [line.split()[0] for line in output.splitlines()] == ["light", "sky", "bulb"]


def test_an_image_that_is_not_split_cannot_be_symmetric(folder: Path) -> None:
    error = run_refused(folder, "lights", "sky.xml", "--symmetric", "sky", "--no-sheet")
    assert "symmetric: 'sky' is not split into texels" in error
    (folder / "wrong.toml").write_text('[light.sky]\nsplit = [5, 4]\nsymmetric = "yes"\n')
    error = run_refused(folder, "lights", "sky.xml", "--lights-file", "wrong.toml", "--no-sheet")
    assert "light.sky.symmetric is 'yes': expected true or false" in error


@pytest.fixture(scope="module")
def basis(folder: Path) -> lp.Basis:
    """The planes of the sky's texels, each by itself."""
    scene = lp.load_scene(folder / "sky.xml", split={"sky": (5, 4)})
    return lp.render_basis(scene, spp=32)


def test_a_palette_holds_for_all_texels(folder: Path, basis: lp.Basis) -> None:
    """Every texel is a mix of the two colours, and what is found is certified."""
    warm, cool = np.array([1.0, 0.5, 0.2]), np.array([0.3, 0.5, 1.0])
    palette = lp.Constraints.of({"sky": {"primaries": [warm.tolist(), cool.tolist()]}})
    solution = lp.solve(basis, lp.read_target(folder / "target.exr"), constraints=palette)
    assert solution.certificate.converged
    normal = np.cross(warm, cool)
    skies = solution.weights[[name.startswith("sky.") for name in basis.names]]
    np.testing.assert_allclose(skies @ normal, 0, atol=1e-9 * skies.max())
    assert len(np.unique(np.round(skies, 6), axis=0)) > 6  # not one colour for all


def test_a_sky_of_whites_is_certified(folder: Path, basis: lp.Basis) -> None:
    whites = lp.Constraints.of({"sky": {"kelvin": [2700, 10000]}})
    solution = lp.solve(basis, lp.read_target(folder / "target.exr"), constraints=whites)
    assert solution.certificate.converged
    skies = [solution.lighting[name].emission for name in basis.names if name != "bulb"]
    assert_white(skies, 2700, 10000)
