"""The answer in other programs' hands: each form is read back as that program would read it."""

import ast
import csv
import io
import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from blender import has_working_spaces, in_blender
from hypothesis import example, given
from hypothesis import strategies as st
from light_groups import channels, interleaved, multi_part, pictures, write

import lightpaint as lp
from lightpaint.basis.lightgroups.light_groups import LightGroups, read_light_groups
from lightpaint.colour.primaries import ACESCG, from_rec709
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.relit.export.exports import (
    EXPORTS,
    blender_script,
    lights_table,
    plain_cell,
    write_exports,
)
from lightpaint.relit.export.nuke import (
    LAYERS,
    copied_part,
    nuke_layer,
    nuke_script,
    spoken_unreadable,
)

#: Names that break careless quoting, in the order of an EXR's channels.
NASTY = sorted(['Key "Area"', "it's", "a\\n$HOME [exit] {", '"""', "grün, }"])

WEIGHTS = np.array([[2, 0.5, 0], [0.1, 1, 3], [1, 1, 1], [0, 0, 0], [1.25, 1.25, 0.3]])

#: float32 pixels, a few of which are added.
FLOAT32 = 1e-5


def _groups(
    folder: Path, *, lacks: float = 0.0, names: Any = NASTY, alpha: bool = True, **options: Any
) -> LightGroups:
    images = pictures(6)
    beauty = images[:5].sum(axis=0) + lacks * images[5]
    layers = {"ViewLayer.Combined": beauty}
    layers |= {f"ViewLayer.Combined_{n}": x for n, x in zip(names, images, strict=False)}
    folder.mkdir(exist_ok=True, parents=True)
    path = interleaved(folder / "groups.exr", layers, **options)
    if alpha:
        part = OpenEXR.File(str(path), separate_channels=True).parts[0]
        layer_pixels = {name: c.pixels for name, c in part.channels.items()}
        a = np.linspace(0, 1, beauty[..., 0].size, dtype=np.float32).reshape(beauty.shape[:2])
        layer_pixels["ViewLayer.Combined.A"] = a.astype(options.get("kind", np.float32))
        header = {"chromaticities": x} if (x := part.header.get("chromaticities")) else {}
        write(path, ("", layer_pixels), **header)
    return read_light_groups(path)


def _lighting(groups: LightGroups) -> Lighting:
    weights = np.ones((len(groups.basis.lights), 3))
    weights[: len(groups.layers)] = WEIGHTS[: len(groups.layers)]
    return Lighting.of_weights(groups.basis, weights, target='a "painting"')


def _sum(groups: LightGroups, lighting: Lighting) -> Any:
    weights = lighting.weights_for(groups.basis)
    return np.einsum("nhwc,nc->hwc", groups.basis.images.astype(np.float64), weights)


@pytest.mark.parametrize("lacks", [0.0, 0.5])
def test_relit_is_the_sum(tmp_path: Path, lacks: float):
    groups = _groups(tmp_path, lacks=lacks)
    lighting = _lighting(groups)
    files = write_exports(tmp_path / "out", groups, lighting)
    assert [file.name for file in files] == [name for name in EXPORTS if name != LAYERS]
    assert all(file.is_file() for file in files)
    [part] = OpenEXR.File(str(tmp_path / "out" / "relit.exr")).parts
    pixels = part.channels["RGBA"].pixels
    np.testing.assert_allclose(pixels[..., :3], _sum(groups, lighting), rtol=FLOAT32, atol=FLOAT32)
    assert groups.beauty is not None
    np.testing.assert_array_equal(pixels[..., 3], groups.beauty.alpha)


def test_relit_is_as_precise_as_the_file_and_never_infinite(tmp_path: Path):
    groups = _groups(tmp_path, kind=np.float16)
    lighting = _lighting(groups).with_emission(NASTY[0], (1e9, 1.0, 1.0))
    write_exports(tmp_path, groups, lighting)
    pixels = OpenEXR.File(str(tmp_path / "relit.exr")).parts[0].channels["RGBA"].pixels
    assert pixels.dtype == np.float16
    assert np.isfinite(pixels).all()


def test_the_table_has_every_light(tmp_path: Path):
    groups = _groups(tmp_path, lacks=1)
    rows = list(csv.DictReader(io.StringIO(lights_table(groups, _lighting(groups)))))
    assert [row["light"] for row in rows] == [*NASTY, "rest"]
    assert rows[0]["layer"] == f"ViewLayer.Combined_{NASTY[0]}"
    numbers = [[float(row[c]) for c in ("red", "green", "blue")] for row in rows]
    np.testing.assert_allclose(numbers[:5], WEIGHTS, rtol=1e-8)
    assert [row["stops"] for row in rows[2:4]] == ["+0.000", "off"]
    assert [row["kept"] for row in rows] == ["no"] * 5 + ["yes"]


def test_what_nothing_tells_of_is_unknown(tmp_path: Path):
    """Neither off nor as it was: a group without a pixel, and one that is painted off."""
    images = pictures(3)
    layers = {"RGBA": images[:2].sum(axis=0), "RGBA_none": 0 * images[2]}
    layers |= {"RGBA_key": images[0], "RGBA_fill": images[1]}
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers))
    target = lp.Target.of((2 * images[0]).astype(np.float32))
    lighting = lp.solve(groups.basis, target).lighting
    rows = list(csv.DictReader(io.StringIO(lights_table(groups, lighting))))
    assert {row["light"]: row["stops"] for row in rows} == {
        "key": "+1.000",
        "fill": "off",
        "none": "unknown",
    }


def test_the_blender_script_holds_the_multipliers(tmp_path: Path):
    groups = _groups(tmp_path, lacks=1)
    script = blender_script(groups, replace(_lighting(groups), target='x"""; raise\\'))
    tree = ast.parse(script)
    constants = {
        node.targets[0].id: ast.literal_eval(node.value)  # type: ignore[attr-defined]
        for node in tree.body
        if isinstance(node, ast.Assign)
        and isinstance(node.targets[0], ast.Name)
        and isinstance(node.value, ast.Dict | ast.Constant)
    }
    assert list(constants["MULTIPLIERS"]) == NASTY  # what is kept is not in it
    np.testing.assert_allclose(list(constants["MULTIPLIERS"].values()), WEIGHTS, rtol=1e-8)
    assert constants["RENDER"] == groups.basis.origin.scene_identity
    assert "raise" in (ast.get_docstring(tree) or "")


def test_only_what_may_be_of_blender_gets_its_script(tmp_path: Path):
    layers = {f"RGBA_{name}": x for name, x in zip("ab", pictures(2), strict=True)}
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers))
    files = [file.name for file in write_exports(tmp_path, groups, _lighting(groups))]
    assert files == ["lights.csv", "relit.nk", "relit.exr"]


def evaluated(text: str, run: Any = None) -> str:
    """What Nuke makes of the name of a file: Tcl's substitutions, frame 1, and the view `main`.

    run: the commands in brackets go there; nobody else runs them.
    """

    def one(match: Any) -> str:
        value = match[0]
        if value[0] == "[":
            return str(run(value[1:-1])) if run else ""
        return value[1] if value[0] == "\\" else ""

    text = re.sub(r"\[.*?\]|\$\w+|\$\{.*?\}|\\.", one, text, flags=re.DOTALL)
    text = re.sub(r"#+|%\d*d", lambda match: "1", text)
    return text.replace("%V", "main").replace("%v", "m")


def knobs_in(script: str) -> list[dict[str, str]]:
    """The knobs of each node, as Tcl's parser takes them: braces, then words in quotes."""
    nodes = []
    for body in re.findall(r"^\w+ \{\n((?: .*\n)*)\}$", script, flags=re.MULTILINE):
        braces = re.sub(r"\\.", "", body)
        depth = np.cumsum([{"{": 1, "}": -1}.get(c, 0) for c in braces])
        assert depth.min() >= 0  # or the body would end there
        assert depth[-1] == 0
        knobs = dict(line[1:].split(" ", 1) for line in body.splitlines())
        for name, value in knobs.items():
            if value.startswith('"'):
                assert re.fullmatch(r'"(?:[^"\\]|\\.)*"', value)
                knobs[name] = re.sub(
                    r"\\(.)", lambda x: {"n": "\n", "r": "\r"}.get(x[1], x[1]), value[1:-1]
                )
        nodes.append(knobs)
    return nodes


class Nuke:
    """The few nodes that the script uses, over Tcl's own parser: what a pixel comes to."""

    def __init__(self) -> None:
        tkinter = pytest.importorskip("tkinter", reason="Tk")
        self.tcl = tkinter.Tcl()
        self.stack: list[Any] = []
        self.layers = {"rgba"}
        self.read: list[str] = []
        self.kept: dict[str, Any] = {}
        for name in ("Read", "Shuffle", "Multiply", "Merge2", "Copy", "ColorMatrix", "StickyNote"):
            self.tcl.createcommand(name, lambda body, name=name: self._node(name, body))
        self.tcl.createcommand("version", lambda *_: "")
        self.tcl.createcommand("add_layer", self._add_layer)
        self.tcl.createcommand("stack", self._keep)
        self.tcl.createcommand("push", lambda key: self.stack.append(self.kept[key]))

    def run(self, script: str) -> Any:
        self.tcl.eval(script)
        [*_, result] = self.stack
        return result

    def _keep(self, depth: str) -> str:
        assert depth == "0"
        self.kept[key := f"node{len(self.kept)}"] = self.stack[-1]
        return key

    def _add_layer(self, body: str) -> None:
        layer, *channel_names = self.tcl.splitlist(body)
        assert channel_names == [f"{layer}.{c}" for c in ("red", "green", "blue", "alpha")]
        self.layers.add(layer)

    def _node(self, kind: str, body: str) -> None:
        words = self.tcl.splitlist(body)
        knobs = dict(zip(words[::2], words[1::2], strict=True))
        # The top of the stack is input 0, which Merge2 and Copy call B.
        inputs = [self.stack.pop() for _ in range(int(knobs.get("inputs", 1)))]
        self.stack.append(getattr(self, f"_{kind.lower()}")(knobs, *inputs))

    def _stickynote(self, _knobs: Any) -> Any:
        return None

    def _read(self, knobs: Any) -> Any:
        assert knobs["raw"] == "true"
        assert evaluated(knobs["file"]) == knobs["file"]
        self.read.append(knobs["file"])
        layers = {}
        parts = OpenEXR.File(knobs["file"], separate_channels=True).parts
        for part in parts:
            for name, channel in part.channels.items():
                prefix, _, last = name.rpartition(".")
                layer = prefix or (part.name() if len(parts) > 1 else "")
                layer = re.sub(rb"[^A-Za-z0-9]", b"_", layer.encode()).decode() or "rgba"
                # Of two that become one, one is read.
                layers.setdefault(layer, {})[last] = channel.pixels.astype(np.float64)
        return layers

    def _shuffle(self, knobs: Any, read: Any) -> Any:
        assert knobs["in"] in self.layers
        planes = read[knobs["in"]]
        return np.stack([planes.get(c, 0 * planes["R"]) for c in "RGBA"], axis=-1)

    def _multiply(self, knobs: Any, a: Any) -> Any:
        assert knobs["channels"] == "rgb"
        return a * [*map(float, self.tcl.splitlist(knobs["value"])[:3]), 1]

    def _merge2(self, knobs: Any, b: Any, a: Any) -> Any:
        return {"plus": a + b, "minus": a - b}[knobs["operation"]]

    def _copy(self, knobs: Any, b: Any, a: Any) -> Any:
        assert (knobs["from0"], knobs["to0"]) == ("rgba.alpha", "rgba.alpha")
        return np.concatenate([b[..., :3], a[..., 3:]], axis=-1)

    def _colormatrix(self, knobs: Any, a: Any) -> Any:
        rows = [self.tcl.splitlist(row) for row in self.tcl.splitlist(knobs["matrix"])]
        matrix = np.array(rows, dtype=float)
        return np.concatenate([a[..., :3] @ matrix.T, a[..., 3:]], axis=-1)


@pytest.mark.parametrize("lacks", [0.0, 0.5])
@pytest.mark.parametrize("alpha", [True, False])
def test_the_nuke_script_comes_to_the_same(tmp_path: Path, lacks: float, alpha: bool):
    folder = tmp_path / 'in "a {c'  # unbalanced, too
    groups = _groups(folder, lacks=lacks, alpha=alpha)
    lighting = _lighting(groups)
    nuke = Nuke()
    result = nuke.run(nuke_script(groups, lighting, tmp_path))
    assert nuke.read == [str(groups.path)]
    np.testing.assert_allclose(result[..., :3], _sum(groups, lighting), rtol=FLOAT32, atol=FLOAT32)
    if alpha:
        assert groups.beauty is not None
        np.testing.assert_array_equal(result[..., 3], groups.beauty.alpha)


@pytest.mark.parametrize(
    "name",
    ["[exec touch owned]", "$env(HOME)", "a\\nb", "take #2", "100%d", "%V", "a\nb\rc", "a\tb"],
)
@pytest.mark.parametrize("is_file", [True, False])
def test_nuke_evaluates_nothing_of_a_path(tmp_path: Path, name: str, is_file: bool):
    folder = tmp_path / ("plain" if is_file else name)
    groups = _groups(folder)
    if is_file:
        groups = read_light_groups(groups.path.rename(folder / f"{name}.exr"))
    ran: list[str] = []
    nodes = knobs_in(nuke_script(groups, _lighting(groups), tmp_path))
    for knob in [node[k] for node in nodes for k in ("file", "label") if k in node]:
        assert evaluated(knob, ran.append) == knob
    assert ran == []
    assert [node["file"] for node in nodes if "file" in node] == [""]
    [message] = spoken_unreadable(groups, tmp_path)
    assert "relit.nk leaves it out" in message
    assert message.isprintable()


def test_a_path_that_nuke_takes_as_it_is_is_named(tmp_path: Path):
    folder = tmp_path / 'it\'s "a" {b ~ grün'
    groups = _groups(folder)
    nodes = knobs_in(nuke_script(groups, _lighting(groups), tmp_path))
    assert [node["file"] for node in nodes if "file" in node] == [str(groups.path)]
    assert spoken_unreadable(groups, tmp_path) == []


ALIKE = ["key 1", "key-1", "key/1", "key_1", "1key 1"]


@pytest.mark.parametrize("lacks", [0.0, 0.5])
def test_layers_that_nuke_would_read_as_one_are_copied(tmp_path: Path, lacks: float):
    groups = _groups(tmp_path, names=ALIKE, lacks=lacks)
    lighting = _lighting(groups)
    files = write_exports(tmp_path / "out", groups, lighting)
    assert LAYERS in [file.name for file in files]
    script = (tmp_path / "out" / "relit.nk").read_text()
    assert script == nuke_script(groups, lighting, tmp_path / "out")
    nodes = knobs_in(script)
    shuffles = [node["in"] for node in nodes if node.get("name", "").startswith("Layer_")]
    assert len(set(shuffles)) == len(ALIKE)
    labels = [node["label"] for node in nodes if node.get("name", "").startswith("Light_")]
    assert len(set(labels)) == len(ALIKE)
    result = Nuke().run(script)
    np.testing.assert_allclose(result[..., :3], _sum(groups, lighting), rtol=FLOAT32, atol=FLOAT32)
    assert groups.beauty is not None
    np.testing.assert_array_equal(result[..., 3], groups.beauty.alpha)
    # The other forms have the names as they are.
    rows = list(csv.DictReader(io.StringIO(lights_table(groups, lighting))))
    assert [row["light"] for row in rows][:5] == sorted(ALIKE)
    assert repr("key 1") in (tmp_path / "out" / "set_lights.py").read_text()


def test_the_copy_is_named_where_it_lies_in_the_end(tmp_path: Path):
    """Results are written elsewhere first, and appear all at once."""
    groups = _groups(tmp_path, names=ALIKE)
    painting = _sum(groups, _lighting(groups)).astype(np.float32)
    write(tmp_path / "painting.exr", ("rgb", channels("", painting)))
    look = lp.paint_with_light(None, tmp_path / "painting.exr", tmp_path / "out", basis=groups)
    result = Nuke().run((tmp_path / "out" / "relit.nk").read_text())
    expected = _sum(groups, look.lighting)
    np.testing.assert_allclose(result[..., :3], expected, rtol=FLOAT32, atol=FLOAT32)


def test_a_name_with_more_dots_than_nuke_parts_is_copied(tmp_path: Path):
    layers = {f"C_{name}": x for name, x in zip(["a.b.c", "a.b.d"], pictures(2), strict=True)}
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers))
    assert sorted(copied_part(groups).channels) == [
        f"a_b_{name}.{c}" for name in "cd" for c in "BGR"
    ]


@pytest.mark.parametrize("names", [NASTY, ALIKE])
def test_the_nuke_script_keeps_the_primaries_of_the_file(tmp_path: Path, names: list[str]):
    groups = _groups(tmp_path, lacks=0.5, names=names, header={"chromaticities": ACESCG})
    lighting = _lighting(groups)
    write_exports(tmp_path, groups, lighting)
    result = Nuke().run(nuke_script(groups, lighting, tmp_path))
    # The renderer multiplies red, green and blue of its own primaries.
    *images, rest = pictures(6).astype(np.float64)
    own = dict(zip(groups.basis.names, WEIGHTS @ from_rec709(ACESCG).T, strict=False))
    expected = sum(own[name] * x for name, x in zip(names, images, strict=True)) + 0.5 * rest
    np.testing.assert_allclose(result[..., :3], expected, rtol=FLOAT32, atol=FLOAT32)


def test_the_nuke_script_reads_a_folder(tmp_path: Path):
    images = pictures(3)
    for name, image in zip(["key", "fill"], images, strict=False):
        write(tmp_path / f"{name}.exr", ("rgb", channels("", image)))
    write(tmp_path / "beauty.exr", ("rgb", channels("", images.sum(axis=0))))
    groups = read_light_groups(tmp_path)
    assert groups.has_rest
    lighting = _lighting(groups)
    nuke = Nuke()
    result = nuke.run(nuke_script(groups, lighting, tmp_path))
    assert len(nuke.read) == 3
    np.testing.assert_allclose(result[..., :3], _sum(groups, lighting), rtol=FLOAT32, atol=FLOAT32)


@pytest.mark.parametrize(
    ("layer", "is_part", "called"),
    [
        ("ViewLayer.Combined_Key Area", False, "ViewLayer_Combined_Key_Area"),
        ("2shot.3Combined_é", False, "shot_Combined___"),
        ("Ci", False, "rgba"),
        ("", False, "rgba"),
        ("LightSelect_a", True, "LightSelect_a"),
    ],
)
def test_what_nuke_calls_a_layer(tmp_path: Path, layer: str, is_part: bool, called: str):
    pictures_by_layer = {layer: pictures()[0], "other": pictures()[1]}
    make = multi_part if is_part else interleaved
    options = {"is_plain": True} if is_part else {}
    pattern = "{name}"
    groups = read_light_groups(
        make(tmp_path / "a.exr", pictures_by_layer, **options), pattern=pattern
    )
    layers = [*groups.layers, *([groups.beauty] if groups.beauty else [])]
    assert called in {nuke_layer(x) for x in layers}


def test_a_solve_from_a_file_writes_it_all(tmp_path: Path):
    """The whole way: groups, a painting, and the multipliers in lighting.json."""
    groups = _groups(tmp_path, lacks=0.5)
    expected = _lighting(groups)
    painting = _sum(groups, expected).astype(np.float32)
    write(tmp_path / "painting.exr", ("rgb", channels("", painting)))
    look = lp.paint_with_light(
        None, tmp_path / "painting.exr", tmp_path / "out", basis=groups.basis
    )
    write_exports(tmp_path / "out", groups, look.lighting)
    settings = json.loads((tmp_path / "out" / "lighting.json").read_text())["lights"]
    weights = [settings[name]["weight"] for name in NASTY]
    np.testing.assert_allclose(weights, WEIGHTS, atol=FLOAT32)
    assert "standard_error" not in settings[NASTY[0]]
    assert look.uncertainty is None
    page = (tmp_path / "out" / "report.html").read_text()
    assert "says nothing of its samples and noise" in page
    assert "How sure" not in page


def test_no_renderer_is_imported(tmp_path: Path):
    groups = _groups(tmp_path)
    write(tmp_path / "painting.exr", ("rgb", channels("", groups.basis.images[0])))
    code = (
        "import sys, lightpaint as lp\n"
        "from pathlib import Path\n"
        "from lightpaint.cli.options.job_options import *\n"
        "from lightpaint.basis.lightgroups.light_groups import read_light_groups\n"
        "from lightpaint.relit.export.exports import write_exports\n"
        "here = Path(sys.argv[1])\n"
        "groups = read_light_groups(here / 'groups.exr')\n"
        "look = lp.paint_with_light(None, here / 'painting.exr', here / 'o', basis=groups.basis)\n"
        "write_exports(here / 'o', groups, look.lighting)\n"
        "print([m for m in ('mitsuba', 'drjit') if m in sys.modules])\n"
    )
    run = [sys.executable, "-c", code, str(tmp_path)]
    completed = subprocess.run(run, capture_output=True, text=True, check=True)
    assert completed.stdout == "[]\n"


# ------------------------------------------------------------------------------- in Blender


def test_lights_set_in_blender_render_the_answer(tmp_path: Path, blender: list[str]):
    """Cycles' own groups, solved on, set by the script and rendered again."""
    scene = Path(__file__).parent / "blender_scene.py"
    in_blender(blender, scene, "render", tmp_path)
    groups = read_light_groups(tmp_path / "first.exr")
    assert groups.basis.names == ('Key "Area"', "fill", "glow", "world", "rest")
    assert groups.exceeding is not None
    assert groups.exceeding < 1e-6  # float32
    weights = np.ones((5, 3))
    weights[:4] = [[1.5, 0.8, 0.4], [0, 0.5, 2], [2, 1, 0.5], [0.2, 1.5, 1]]
    painting = groups.basis.mix(weights)
    write(tmp_path / "p.exr", ("rgb", channels("", painting)))
    look = lp.paint_with_light(None, tmp_path / "p.exr", tmp_path / "o", basis=groups.basis)
    answer_weights = look.lighting.weights_for(groups.basis)
    np.testing.assert_allclose(answer_weights, weights, atol=FLOAT32)

    write_exports(tmp_path, groups, look.lighting)
    in_blender(blender, scene, "again", tmp_path)
    relit = OpenEXR.File(str(tmp_path / "relit.exr")).parts[0].channels["RGBA"].pixels[..., :3]
    once, thrice, other_seed = (
        read_light_groups(tmp_path / f"{name}.exr").beauty for name in ("once", "thrice", "seed")
    )
    assert once is not None
    assert thrice is not None
    assert other_seed is not None
    # Run again, saved and loaded between, it multiplies nothing again.
    np.testing.assert_array_equal(once.image, thrice.image)
    noise = np.sqrt(np.square(once.image - other_seed.image).mean() / 2)
    rms_error = np.sqrt(np.square(once.image - relit).mean())
    # Two renders differ by √2 of the noise of one, and fireflies make noise vary from seed to seed.
    assert rms_error < 1.6 * np.sqrt(2) * noise
    # A light that went wrong would be far beyond: so far is the scene as it was.
    assert groups.beauty is not None
    assert np.sqrt(np.square(once.image - groups.beauty.image).mean()) > 5 * noise
    assert relit.mean(axis=(0, 1)) == pytest.approx(once.image.mean(axis=(0, 1)), rel=0.01)
    reread = read_light_groups(tmp_path / "once.exr")
    # Each group by itself, and what is in none, comes out as it was solved.
    for name in groups.basis.names:
        mean = groups.basis.image(name).mean(axis=(0, 1)) * look.lighting.emission[name]
        assert reread.basis.image(name).mean(axis=(0, 1)) == pytest.approx(mean, rel=0.02, abs=1e-4)


def test_every_kind_of_light_is_multiplied_once(tmp_path: Path, new_blender: list[str]):
    groups = _groups(tmp_path, names=["a", "b", "gone", "linked", "world"])
    write_exports(tmp_path, groups, _lighting(groups))
    output = in_blender(new_blender, Path(__file__).parent / "blender_scene.py", "kinds", tmp_path)
    assert "all as expected" in output
    assert "no light is in the group gone" in output
    assert "inside the node group hidden, set it by hand" in output


def test_multipliers_are_those_of_rec709_in_a_file_of_another_space(
    tmp_path: Path, new_blender: list[str]
):
    if not has_working_spaces(new_blender):
        pytest.skip("Blender 5 (LIGHTPAINT_BPY: a Python with its module bpy)")
    groups = _groups(tmp_path, names=["a", "b", "gone", "linked", "world"])
    write_exports(tmp_path, groups, _lighting(groups))
    output = in_blender(new_blender, Path(__file__).parent / "blender_scene.py", "space", tmp_path)
    found = next(x for x in output.splitlines() if x.startswith("FOUND "))
    # Blender's own conversion has matrices of six digits.
    glow = [0.1 * 1, 1 * 0.25, 3 * 0.0625]
    expected = np.array([[6, 0.75, 0], [1, 10, 30], glow]) @ from_rec709(ACESCG).T
    np.testing.assert_allclose(json.loads(found.partition(" ")[2]), expected, rtol=2e-5)


#: What a name may hold to be taken for a formula, or to end its cell or its line.
FORMULAS = [
    "=cmd|'/C calc'!A0",
    "+1",
    "-1.5",
    "@sum",
    "\t=a",
    "a\r=b",
    "a\n=b",
    "a;=b",
    "'q",
    'a,"b',
]


def _without_marks(cell: str) -> str:
    """As docs/light-groups.md says how."""
    return re.sub(r"(\A|[;\t\r\n])'", r"\1", cell)


@given(st.text("ab'=+-@;, \t\r\n＝", max_size=8))
@example("\t\t=")
@example("';'=")
def test_cells_are_no_formulas_and_names_come_back(name: str) -> None:
    cell = plain_cell(name)
    assert _without_marks(cell) == name
    for column in re.split("[;\t\r\n]", cell):
        assert not column.startswith(tuple("=+-@＝"))


def test_the_table_of_names_that_are_formulas(tmp_path: Path, make_basis: Any) -> None:
    groups = replace(_groups(tmp_path), basis=make_basis(len(FORMULAS), names=FORMULAS))
    lighting = Lighting.current(groups.basis)
    text = lights_table(groups, lighting)
    # However a reader ends its lines, and where it reads none but what is quoted as one.
    for lines in (io.StringIO(text, newline=""), io.StringIO(text.replace("\n", "\r\n"), "")):
        rows = list(csv.DictReader(lines))
        assert len(rows) == len(FORMULAS)
    rows = list(csv.DictReader(io.StringIO(text, newline="")))
    assert [_without_marks(row["light"]) for row in rows] == FORMULAS
    for row, light in zip(rows, lighting.lights, strict=True):
        assert row["light"][0] not in "=+-@\t\r"
        assert float(row["red"]) == pytest.approx(light.weight[0], rel=1e-8)
        assert re.fullmatch(r"[+-]\d+\.\d{3}", row["stops"])  # a number, with its sign
