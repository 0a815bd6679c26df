"""Another integrator in the place of the scene's own, from loading to the relit scene."""

import gc
from dataclasses import replace
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import run, run_refused, succeed
from renderer import LIGHTS, write_room

import lightpaint as lp
from lightpaint.basis.file.basis_file import read_origin
from lightpaint.errors import SceneError
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.relit.relit_files import relit_files
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.properties.integrator import IntegratorChoice
from lightpaint.scene.scene_reader import load_scene

#: Of Mitsuba 0.6, which Mitsuba 3 lacks.
LACKING = '<integrator type="bdpt" id="mine"><integer name="max_depth" value="6"/></integrator>'

BULB = LIGHTS["bulb"]

#: What stands where the integrator does, and the depth that it says.
WRITTEN = {
    "lacking": (LACKING, 6),
    "none": ("", -1),
    "wrapped": (f'<integrator type="aov"><string name="aovs" value="d:depth"/>{LACKING}', 6),
    "nested": (f'<integrator type="irrcache">{LACKING}', 6),
    "two": ('<integrator type="path"/>' + LACKING, 6),
    "included": ('<include filename="parts/of.xml"/>', 6),
    "by parameter": ('<default name="how" value="bdpt"/><integrator type="$how"/>', -1),
    "handled": ('<integrator type="direct"/>', -1),
}


def room(folder: Path, integrator_text: str = "lacking") -> Path:
    """The room with its bulb alone, and `integrator_text` for its integrator."""
    text, _ = WRITTEN[integrator_text]
    if integrator_text in ("wrapped", "nested"):
        text += "</integrator>"
    (folder / "parts").mkdir(exist_ok=True)
    (folder / "parts" / "of.xml").write_text(f'<scene version="3.0.0">{LACKING}</scene>')
    return write_room(folder, integrator=text, lights=BULB)


@pytest.mark.parametrize(
    ("text", "xml"),
    [
        ("path", '<integrator type="path"></integrator>'),
        (
            "path:max_depth=8,hide_emitters=True",
            '<integrator type="path"><integer name="max_depth" value="8"/>'
            '<boolean name="hide_emitters" value="true"/></integrator>',
        ),
        (
            "volpath:max_depth=-1, x=0.5,y=a<b",
            '<integrator type="volpath"><integer name="max_depth" value="-1"/>'
            '<float name="x" value="0.5"/><string name="y" value="a&lt;b"/></integrator>',
        ),
    ],
)
def test_a_choice_as_text_and_as_xml(text: str, xml: str) -> None:
    choice = IntegratorChoice.of(text)
    assert choice.xml == xml
    assert IntegratorChoice.of(str(choice)) == choice


@pytest.mark.parametrize(
    "text", ["", "Path", "path:", "path:max_depth", "path:=3", "path:a=", 'a"b', "path,x", "a\n"]
)
def test_what_is_no_choice(text: str) -> None:
    with pytest.raises(
        SceneError, match="is not an integrator: expected the name of one of Mitsuba's"
    ):
        IntegratorChoice.of(text)


@pytest.mark.parametrize("integrator_text", WRITTEN)
def test_it_is_loaded_and_the_relit_scene_has_it(tmp_path: Path, integrator_text: str) -> None:
    path, (_, depth) = room(tmp_path, integrator_text), WRITTEN[integrator_text]
    if integrator_text not in ("none", "handled"):
        with pytest.raises(SceneError):
            load_scene(path)
    scene = load_scene(path, integrator="path:rr_depth=4")
    integrator = scene.integrator
    assert (integrator.plugin, integrator.max_depth, integrator.rr_depth) == ("path", depth, 4)
    relit = lp.relight(scene, _lighting(scene), tmp_path / "relit" / "relit.xml")
    assert relit.integrator == integrator
    assert relit.integrator_choice is None  # it is its own now
    _loads_in_plain_mitsuba(tmp_path / "relit" / "relit.xml")
    # What is not in the place of the integrator is untouched.
    assert (tmp_path / "relit" / "parts" / "of.xml").exists() == (integrator_text == "included")


def _lighting(scene: Scene) -> Lighting:
    basis = lp.render_basis(scene, spp=2)
    return Lighting.of_weights(basis, np.full((1, 3), 0.25))


def _loads_in_plain_mitsuba(path: Path) -> None:
    import mitsuba as mi

    loaded = mi.load_file(str(path))
    assert loaded.integrator().class_name() == "PathIntegrator"
    del loaded
    gc.collect()


def test_an_include_elsewhere_cannot_be_edited(tmp_path: Path) -> None:
    (tmp_path / "scenes").mkdir()
    (tmp_path / "of.xml").write_text(f'<scene version="3.0.0">{LACKING}</scene>')
    path = write_room(
        tmp_path / "scenes", integrator='<include filename="../of.xml"/>', lights=BULB
    )
    scene = load_scene(path, integrator="path")
    with pytest.raises(SceneError, match="has to be edited, but it lies outside"):
        relit_files(scene, {"bulb": (1.0, 1.0, 1.0)}, tmp_path / "relit.xml")


def test_each_is_a_basis_of_its_own(tmp_path: Path) -> None:
    path = write_room(tmp_path, lights=BULB)
    plain = load_scene(path)
    chosen = [load_scene(path, integrator=x) for x in ("path", "path:max_depth=2", "direct")]
    assert len({scene.identity for scene in (plain, *chosen)}) == 4
    assert chosen[0].identity == load_scene(path, integrator="path").identity
    # Chosen or written, the same picture: to the last bit, of the same samples.
    images = [lp.render_basis(scene, spp=4).images for scene in (plain, chosen[0])]
    np.testing.assert_array_equal(*images)
    basis = lp.render_basis(chosen[1], spp=2)
    assert basis.origin.integrator == "path:max_depth=2"
    lp.write_basis(tmp_path / "b.exr", basis)
    assert lp.read_basis(tmp_path / "b.exr").origin == basis.origin
    assert read_origin(tmp_path / "b.exr")[0].integrator == "path:max_depth=2"


def test_from_solve_to_verify(tmp_path: Path) -> None:
    path = room(tmp_path)
    line = run_refused(tmp_path, "lights", path)
    assert "no integrator plugin 'bdpt'; --integrator path renders it with another" in line
    chosen = ("--integrator", "path", "--spp", 16)
    assert "bulb" in succeed(tmp_path, "lights", "--no-sheet", path, *chosen[:2])
    succeed(tmp_path, "template", path, *chosen, "-o", "t.exr")
    completed = run(tmp_path, "solve", path, *chosen, "t.exr", "-o", "out")
    assert completed.returncode == 0, completed.stderr
    assert (
        "rendered with path:max_depth=6 instead of the scene's own integrator" in completed.stderr
    )
    assert "nothing found against it." in completed.stdout  # of one dim bulb
    page = unescape((tmp_path / "out" / "report.html").read_text(encoding="utf-8"))
    assert "path:max_depth=6, not the scene's own" in page
    # The relit scene says it itself.
    assert "agree within noise" in succeed(tmp_path, "verify", "out", "--spp", 256)
    succeed(tmp_path, "relight", path, "out/lighting.json", *chosen, "-o", "again")
    second_relit, relit = (tmp_path / name / "relit.xml" for name in ("again", "out"))
    assert second_relit.read_bytes() == relit.read_bytes()
    assert "bdpt" not in relit.read_text(encoding="utf-8")
    succeed(tmp_path, "basis", path, *chosen, "-o", "b.basis.exr")
    line = run_refused(tmp_path, "solve", "b.basis.exr", "t.exr", *chosen[:2], "-o", "no")
    assert "--integrator cannot change a saved basis" in line


@pytest.mark.parametrize(
    ("choice", "message"),
    [
        ("nope", "no integrator plugin 'nope'; the requested integrator is nope"),
        ("path:max_deep=3", "unreferenced property .* the requested integrator"),
        ("path:max_depth=many", "wrong type"),
        ("Path", "'Path' is not an integrator"),
    ],
)
def test_a_choice_that_mitsuba_refuses(tmp_path: Path, choice: str, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        load_scene(write_room(tmp_path), integrator=choice)


def test_a_job_carries_it(tmp_path: Path, make_basis: Any) -> None:
    path = room(tmp_path)
    scene = lp.SceneFile(str(path), integrator="path")
    height, width = scene.content.size
    write_rgb(tmp_path / "p.exr", np.ones((height, width, 3), np.float32))
    job = lp.Job((scene,), (lp.Painting(str(tmp_path / "p.exr")),), tmp_path / "out")
    reread = lp.Job.from_json(job.to_json())
    assert reread == job
    assert reread.scenes[0].integrator == "path"
    other = replace(job, scenes=(lp.SceneFile(str(path), integrator="direct"),))
    assert other != job
    look = lp.paint_with_light(path, tmp_path / "p.exr", tmp_path / "o", integrator="path", spp=2)
    assert look.basis.origin.integrator == "path:max_depth=6"


OLD = """<scene version="0.6.0">
 <integrator type="path"><integer name="maxDepth" value="8"/></integrator>
 <sensor type="perspective"><transform name="toWorld">
  <lookat origin="0,1,3" target="0,1,0" up="0,1,0"/></transform>
  <sampler type="independent"><integer name="sampleCount" value="16"/></sampler>
  <film type="hdrfilm"><integer name="width" value="24"/></film></sensor>
 <emitter type="point" id="lamp"/>
</scene>"""


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (("hdrfilm", "ldrfilm"), r"\(version 0.6.0\).*line 6.*'ldrfilm'.*; write hdrfilm there"),
        (("lookat ", "lookAt "), r"\(version 0.6.0\).*line 3.*<lookAt>.*; write lookat there"),
        (("path", "bdpt"), r"'bdpt'; integrator=\"path\" renders it with another, or"),
        (("independent", "odd"), r"sampler plugin 'odd'; write its equivalent of Mitsuba 3, or"),
        ((' version="0.6.0"', ""), r"the parameter maxDepth.*; write version=.0.6.0. in <scene>"),
        (
            ("0.6.0", "3.0.0"),
            r"the parameter maxDepth, not in snake_case\).*; write version=.0.6.0",
        ),
    ],
)
def test_a_scene_of_mitsuba_0_6_is_told(
    tmp_path: Path, changes: tuple[str, str], message: str
) -> None:
    path = tmp_path / "old.xml"
    path.write_text(OLD, encoding="utf-8")
    assert load_scene(path).integrator.max_depth == 8  # where nothing else is missing, it is read
    path.write_text(OLD.replace(*changes), encoding="utf-8")
    with pytest.raises(SceneError, match=f"is a scene of Mitsuba 0.6 .*{message}") as raised:
        load_scene(path)
    assert str(raised.value).count("old.xml") <= 2


def test_a_scene_of_today_is_not_called_old(tmp_path: Path) -> None:
    path = room(tmp_path)
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace('"spp"', '"sampleCount"').replace("$spp", "$sampleCount"))
    with pytest.raises(
        SceneError, match=r"room\.xml: line 4: Mitsuba has no integrator plugin 'bdpt'; integrator"
    ):
        load_scene(path)
