"""A batch of a small scene: one basis for all looks of a sensor, and what is rendered of each."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import run, run_refused, succeed
from renderer import LIGHTS, write_room

from lightpaint.batch import task_bases
from lightpaint.batch.plan.planner import plan_batch
from lightpaint.images.estimate import read_estimate
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.scene.scene_reader import load_scene

#: A look, and the frame that begins with it.
NAMED = ("bright-camera", "path-0")

SIDE = """<sensor type="perspective" id="side"><transform name="to_world">
    <lookat origin="2 1 2" target="0 0.5 0" up="0 1 0"/></transform><film type="hdrfilm">
    <integer name="width" value="24"/><integer name="height" value="20"/></film></sensor>"""

LOOKS = """
[defaults]
scene = "room.xml"
want = ["predict"]
settings = { spp = 8 }

[[look]]
paintings = ["bright.exr", "dark.exr"]
sensors = ["camera", "side"]

[[look]]
name = "both"
views = { camera = "bright.exr", side = "dark.exr" }
variations = ["warmer"]
want = ["predict", "render"]
render = { spp = 8 }

[[look]]
name = "final"
painting = "dark.exr"
want = ["solve", "verify", "report", "render"]
render = { spp = 4, resolution = "1/2" }
variations = ["warmer"]

[[sequence]]
name = "path"
through = ["bright-camera", "dark-side"]
sensors = ["camera", "side", "camera"]

[[look]]
name = "preset"
lighting = "preset.json"
"""


@pytest.fixture(scope="module")
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A cache in which no other test has left planes of these lights with other samples."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LIGHTPAINT_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="module")
def batch_folder(tmp_path_factory: pytest.TempPathFactory, own_cache: None) -> Path:
    folder = tmp_path_factory.mktemp("rendered")
    write_room(folder, lights=LIGHTS["panel"] + LIGHTS["bulb"], sensors=SIDE)
    for name, light in (("bright", 0.8), ("dark", 0.2)):
        write_rgb(folder / f"{name}.exr", np.full((20, 24, 3), light, np.float32))
    succeed(folder, "solve", "room.xml", "bright.exr", "--spp", "8", "-o", "solved")
    (folder / "preset.json").write_bytes((folder / "solved" / "lighting.json").read_bytes())
    (folder / "looks.toml").write_text(LOOKS, encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def batch_record(batch_folder: Path) -> dict[str, Any]:
    """What the batch says of itself; and how often a basis was asked for."""
    requests: list[str] = []
    obtain = task_bases.obtain

    def counting(scene: Any, *rest: Any, **options: Any) -> Any:
        requests.append(scene.sensor_names[scene.sensor])
        return obtain(scene, *rest, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(task_bases, "obtain", counting)
        summary = json.loads(
            succeed(batch_folder, "batch", "looks.toml", "-o", "out", "--json", "-q")
        )
    return {**summary, "asked": requests}


@pytest.mark.nightly
def test_each_basis_is_obtained_once_for_all_its_looks(
    batch_folder: Path, batch_record: dict[str, Any]
) -> None:
    assert batch_record["failed"] == 0
    names = [look["look"] for look in batch_record["looks"]]
    assert names == [
        *("bright-camera", "bright-side", "dark-camera", "dark-side", "both", "both"),
        *("both-warmer", "both-warmer", "final", "final-warmer", "preset"),
        *("path-0", "path-1", "path-2"),
    ]
    sensors = [look["sensor"] for look in batch_record["looks"] if look["look"].startswith("path")]
    assert sensors == ["camera", "side", "camera"]
    bright, path = (read_lighting(batch_folder / "out" / x / "lighting.json") for x in NAMED)
    assert bright.emission == path.emission
    # The first sensor by its name, by default, and both for the design in two views.
    assert len(batch_record["asked"]) <= 7
    assert {look["sensor"] for look in batch_record["looks"] if look["look"] == "both"} == {
        "camera",
        "side",
    }


def test_a_remark_on_a_kept_basis_names_no_option_that_a_batch_lacks(batch_folder: Path) -> None:
    """The fixture has solved the same scene with as many samples."""
    command = ("batch", "looks.toml", "-o", "again", "--only", "dark-camera")
    lines = run(batch_folder, *command).stderr.splitlines()
    remarks = [line for line in lines if "from an earlier run" in line]
    assert len(remarks) == 1, lines
    [remark] = remarks
    assert remark.endswith("basis of 8 samples per pixel kept from an earlier run")


def test_only_what_is_wanted_is_rendered(batch_folder: Path, batch_record: dict[str, Any]) -> None:
    output_folder = batch_folder / "out"
    assert not (output_folder / "dark-side" / "verified.exr").exists()
    assert not (output_folder / "dark-side" / "report.html").exists()
    assert (output_folder / "final" / "report.html").is_file()
    for name in ("both", "both-warmer"):
        assert (output_folder / name / "side" / "predicted.exr").is_file()
    for name in ("final", "final-warmer"):
        render = read_estimate(output_folder / name / "relit.exr")[0]
        assert render.size == (10, 12)
        assert (output_folder / name / "relit.png").is_file()
    # Of several views one through each sensor, which shows what was predicted there.
    for name in ("both", "both-warmer"):
        assert not (output_folder / name / "relit.exr").exists()
        for view in ("camera", "side"):
            render, predicted = (
                read_estimate(output_folder / name / view / file)[0].image.mean()
                for file in ("relit.exr", "predicted.exr")
            )
            assert render == pytest.approx(predicted, rel=0.15)  # noise of 8 samples
    by_name = {look["look"]: look for look in batch_record["looks"]}
    assert by_name["final"]["agrees"] is True
    assert "agrees" not in by_name["dark-side"]


def test_relit_scenes_load_in_plain_mitsuba_with_their_lights(
    batch_folder: Path, batch_record: dict[str, Any]
) -> None:
    import mitsuba as mi

    for name in ("dark-side", "both", "final-warmer", "preset"):
        path = batch_folder / "out" / name / "relit.xml"
        expected = read_lighting(path.with_name("lighting.json")).emission
        actual = {light.name: light.emission for light in load_scene(path).lights}
        for light, emission in expected.items():
            np.testing.assert_allclose(actual[light], emission, rtol=1e-6)  # float32
        loaded = mi.load_file(str(path))
        assert len(loaded.emitters()) == 2
        del loaded
    preset = read_lighting(batch_folder / "out" / "preset" / "lighting.json").emission
    assert preset == read_lighting(batch_folder / "preset.json").emission


@pytest.mark.nightly
def test_other_samples_of_a_final_render_render_it_alone_again(
    batch_folder: Path, batch_record: dict[str, Any]
) -> None:
    (batch_folder / "looks.toml").write_text(
        LOOKS.replace("spp = 4,", "spp = 6,"), encoding="utf-8"
    )
    second_run = run(batch_folder, "batch", "looks.toml", "-o", "out")
    assert second_run.returncode == 0, second_run.stderr
    assert "steps: 2 steps" in second_run.stderr
    assert "final: render done" in second_run.stderr
    assert "answer done" not in second_run.stderr


def test_a_scene_is_checked_before_its_first_sample(batch_folder: Path) -> None:
    for text, message in (
        (LOOKS.replace('side = "dark', 'back = "dark'), "back"),
        (LOOKS.replace('resolution = "1/2"', 'resolution = "7x5"'), "7x5"),
        (LOOKS.replace("preset.json", "other.json"), "other.json"),
    ):
        (batch_folder / "looks.toml").write_text(text, encoding="utf-8")
        completed = run(batch_folder, "batch", "looks.toml", "-o", "none")
        assert completed.returncode == 2, completed.stderr
        assert all(x.startswith("lightpaint batch: ") for x in completed.stderr.splitlines())
        assert message in completed.stderr
        assert not (batch_folder / "none").exists()


BY_ERROR = """
[defaults]
scene = "room.xml"
want = ["solve"]
settings = { error = 0.1 }

[[look]]
paintings = ["bright.exr", "dark.exr"]
"""


@pytest.mark.nightly
def test_looks_get_the_samples_that_an_error_needs(
    batch_folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They begin with the same samples, and each goes on as `solve --error` does."""
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(tmp_path / "cache"))
    (batch_folder / "by-error.toml").write_text(BY_ERROR, encoding="utf-8")
    succeed(batch_folder, "batch", "by-error.toml", "-o", str(tmp_path / "out"), "-q")
    for name in ("bright", "dark"):
        arguments = ("room.xml", f"{name}.exr", "--error", "10%", "--no-cache", "--no-verify")
        completed = run(batch_folder, "solve", *arguments, "-o", tmp_path / name)
        assert "where the painting needs them" in completed.stderr
        single, of_batch = (
            read_lighting(tmp_path / folder / "lighting.json") for folder in (name, f"out/{name}")
        )
        assert of_batch.emission == single.emission
        assert [x.interval for x in of_batch.lights] == [x.interval for x in single.lights]


@pytest.mark.parametrize("count", [0, 72])
def test_a_batch_says_that_it_finds_no_sun(tmp_path: Path, count: int) -> None:
    write_room(tmp_path, lights=LIGHTS["sky"])
    write_rgb(tmp_path / "p.exr", np.full((20, 24, 3), 0.5, np.float32))
    lights = f"[light.sky]\nsplit = [4, 3]\nsun = {count}\n"
    (tmp_path / "room.lights.toml").write_text(lights, encoding="utf-8")
    looks = '[[look]]\nname = "one"\nscene = "room.xml"\npainting = "p.exr"\nwant = ["predict"]\n'
    (tmp_path / "looks.toml").write_text(looks, encoding="utf-8")
    [look] = plan_batch(tmp_path / "looks.toml", tmp_path / "out").looks
    assert not look.failure
    remarks = [text for text in look.remarks if "asks for a sun in sky" in text]
    assert len(remarks) == (1 if count else 0)
    (tmp_path / "looks.toml").write_text(f"{looks}settings.sun = 72\n", encoding="utf-8")
    line = run_refused(tmp_path, "batch", "looks.toml", "-o", "out")
    assert "leave it out here, and solve that look alone for its sun" in line


CACHED = """
[[look]]
name = "bright"
scene = "room.xml"
painting = "bright.exr"
want = ["predict"]
settings = {{ spp = 8{more} }}
"""


@pytest.mark.nightly
def test_the_cache_decides_no_answer(batch_folder: Path, tmp_path: Path) -> None:
    """A batch of 8 samples took 352 that a killed run had left."""
    cache = str(tmp_path / "cache")
    manifest = batch_folder / "cached.toml"
    manifest.write_text(CACHED.format(more=""))
    succeed(batch_folder, "batch", manifest, "-o", tmp_path / "first", LIGHTPAINT_CACHE=cache)
    succeed(batch_folder, "basis", "room.xml", "--spp", "32", LIGHTPAINT_CACHE=cache)
    rows = {}
    for name, more in (("second", ""), ("third", ", exact_spp = false")):
        manifest.write_text(CACHED.format(more=more))
        succeed(batch_folder, "batch", manifest, "-o", tmp_path / name, LIGHTPAINT_CACHE=cache)
        [rows[name]] = json.loads((tmp_path / name / "summary.json").read_text())["looks"]
    assert (rows["second"]["spp"], rows["third"]["spp"]) == (8, 32)
    first, second, third = (
        read_lighting(tmp_path / name / "bright" / "lighting.json").emission
        for name in ("first", "second", "third")
    )
    assert first == second != third
    # The same fingerprint means the same answer, whatever the cache holds.
    [row] = json.loads((tmp_path / "first" / "summary.json").read_text())["looks"]
    assert row["fingerprint"] == rows["second"]["fingerprint"] != rows["third"]["fingerprint"]
    [heading, cells] = (tmp_path / "first" / "summary.csv").read_text().splitlines()
    table = dict(zip(heading.split(","), cells.split(","), strict=True))
    assert (table["spp"], table["fingerprint"]) == ("8", row["fingerprint"])
