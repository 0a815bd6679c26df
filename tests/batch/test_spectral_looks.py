"""Batches of looks with spectra: each is what `solve` finds, for the eye or for a camera."""

import csv
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from spectral_room import DRIVES, PEAKS, paint_spectral_room, write_spectral_room

from lightpaint.batch.gallery.summary import SummaryRow, lights_of_answer, summary_csv
from lightpaint.batch.manifest.keys import shift
from lightpaint.batch.manifest.sequence import interpolate
from lightpaint.batch.plan.planner import plan_batch
from lightpaint.batch.run import run_batch
from lightpaint.batch.run_options import RunOptions
from lightpaint.colour.color import luminance
from lightpaint.colour.lamp import Lamp, LampEmitter
from lightpaint.colour.spectrum import rgb_of_powers, spectrum_of
from lightpaint.errors import BatchError
from lightpaint.lighting.answer.combination import dimmed
from lightpaint.lighting.answer.lighting import Lighting, LightSetting
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.solve_job import Job
from lightpaint.pipeline.job.sources import Painting, SceneFile
from lightpaint.pipeline.job_run import run

LOOKS = """
[defaults]
scene = "room.xml"
settings = { spectral = true, spp = 16, literal = true }

[[look]]
name = "eye"
painting = "painting.exr"
want = ["solve", "predict", "report", "render", "export"]
render = { spp = 4 }
export = { to = ["csv", "spectra"] }
variations = ["warmer"]

[[look]]
name = "camera"
painting = "painting.exr"
want = ["solve", "predict"]
settings = { observer = "camera.csv" }

[[look]]
name = "dark"
painting = "painting.exr"
want = ["solve", "predict"]
[look.constraints.light.panel]
off = true

[[sequence]]
name = "fade"
through = ["eye", "dark"]
frames = 3
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a manifest, and what its batch leaves in `one`."""
    folder = tmp_path_factory.mktemp("looks")
    paint_spectral_room(write_spectral_room(folder))
    waves = np.arange(380, 781, 10.0)
    curves = [np.exp(-0.5 * ((waves - x) / 35) ** 2) for x in (600, 540, 460)]
    np.savetxt(folder / "camera.csv", np.stack([waves, *curves], axis=1), delimiter=",")
    (folder / "looks.toml").write_text(LOOKS, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LIGHTPAINT_CACHE", str(folder / "cache"))
        assert not run_batch(plan_batch(folder / "looks.toml", folder / "one")).failed
    return folder


def _answer(folder: Path, name: str) -> Lighting:
    return read_lighting(folder / name / "lighting.json")


@pytest.mark.parametrize("observer", [None, "camera.csv"], ids=["eye", "camera"])
def test_a_look_is_what_a_solve_finds(observer: str | None, folder: Path, tmp_path: Path):
    camera = None if observer is None else str(folder / observer)
    options: dict[str, Any] = {"spectral": True, "spp": 16, "literal": True, "use_cache": False}
    job = Job(
        (SceneFile(str(folder / "room.xml")),),
        (Painting(str(folder / "painting.exr")),),
        tmp_path / "out",
        settings=Settings(**options, observer=camera, verify=False, report=False),
    )
    run(job)
    found = _answer(folder / "one", "eye" if observer is None else "camera")
    expected = read_lighting(tmp_path / "out" / "lighting.json")
    assert found.observer == expected.observer
    assert found.scene_identity == expected.scene_identity
    for name in DRIVES:
        assert found[name].mix == expected[name].mix


def test_everything_made_of_a_look_keeps_its_spectra(folder: Path):
    one = folder / "one"
    eye, warmer, dark = (_answer(one, x) for x in ("eye", "eye-warmer", "dark"))
    frames = [_answer(one, f"fade-{k}") for k in range(3)]
    for lighting in (eye, warmer, dark, *frames):
        assert all(lighting[name].mix is not None for name in DRIVES)
    for name in DRIVES:
        assert frames[0][name].mix == pytest.approx(eye[name].mix)
        assert frames[2][name].mix == pytest.approx(dark[name].mix)
    assert "<spectrum" in (one / "fade-1" / "relit.xml").read_text()
    table = list(csv.reader((one / "eye" / "export" / "spectra.csv").read_text().splitlines()))
    assert table[0] == ["nm", *DRIVES]
    assert (one / "eye" / "relit.exr").is_file()


def test_the_summary_says_how_lamps_render_colours(folder: Path):
    report = {"rendering": {"panel": {"ra": 91.25, "rf": 88.0}}}
    lights = lights_of_answer(folder / "one" / "eye", report)
    assert [(x.name, x.ra, x.rf) for x in lights[:2]] == [
        ("panel", 91.25, 88.0),
        ("bulb", None, None),
    ]
    row = SummaryRow("eye", "done", "", "eye", lights=(replace(lights[0], duv=0.00123), lights[1]))
    [header, cells] = csv.reader(summary_csv([row]).splitlines())
    found = dict(zip(header, cells, strict=True))
    assert [found[f"panel {x}"] for x in ("Duv", "Ra", "Rf")] == ["0.0012", "91.2", "88.0"]
    assert [found[f"bulb {x}"] for x in ("Duv", "Ra", "Rf")] == ["", "", ""]
    [header, _] = csv.reader(summary_csv([replace(row, lights=lights[1:2])]).splitlines())
    assert "bulb K" in header
    assert "bulb Rf" not in header


@pytest.mark.nightly
@pytest.mark.parametrize("how", ["processes", "cluster"])
def test_processes_find_what_one_finds(how: str, folder: Path, tmp_path: Path, monkeypatch):
    """Those of a cluster get the files of the scene, and render parts of its basis."""
    monkeypatch.setenv("LIGHTPAINT_CACHE", str(folder / f"cache-{how}"))
    with ExitStack() as stack:
        options = RunOptions(workers=2)
        if how == "cluster":
            from dask_cluster import cluster_of  # which skips without Dask

            workers = stack.enter_context(cluster_of(2, tmp_path, can_be_held=False))
            options = RunOptions(cluster=workers.address)
        outcome = run_batch(plan_batch(folder / "looks.toml", folder / how), options)
    assert not outcome.failed
    for name in ("eye", "camera", "dark", "fade-1", "eye-warmer"):
        for file in ("lighting.json", "relit.xml"):
            found = (folder / how / name / file).read_bytes()
            assert found == (folder / "one" / name / file).read_bytes()


WRONG = {
    "no curves": ("camera.csv", "none.csv", "no such observer"),
    "no spectra": (
        "spectral = true, ",
        "",
        "a camera sees spectra alone: also pass settings.spectral = true",
    ),
    "sums alone": (
        'want = ["solve", "predict"]\n[look.constraints.light.panel]\noff = true',
        'want = ["lights"]\n[look.constraints.light.panel]\nrf = 80',
        "takes sums alone, and with spectra, mixes of one colour are chosen by their pictures",
    ),
    "own emitters": (
        "off = true",
        'emitters = [{name = "red", spectrum = "D65", Y = 4}]',
        "looks with spectra share: give them there, and not for one look",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_mistakes_are_found_before_anything_is_rendered(case: str, folder: Path):
    old, new, message = WRONG[case]
    manifest = folder / f"{case.replace(' ', '-')}.toml"
    manifest.write_text(LOOKS.replace(old, new), encoding="utf-8")
    with pytest.raises(BatchError) as error:
        plan_batch(manifest, folder / "wrong")
    assert any(message in str(line) for line in error.value.mistakes)


def _lamp(drives: tuple[float, ...]) -> LightSetting:
    """A lamp of three LEDs at some drives, which a solve with spectra has found."""
    waves, emitters = np.arange(380, 781.0), []
    for name, (peak, width) in PEAKS.items():
        spectrum = spectrum_of(waves, np.exp(-0.5 * ((waves - peak) / width) ** 2))
        red, green, blue = rgb_of_powers(spectrum).tolist()
        emitters.append(LampEmitter(name, (red, green, blue), watts=10, spectrum=spectrum))
    lamp = Lamp(tuple(emitters))
    red, green, blue = lamp.mix(np.array(drives)).tolist()
    rgb = (red, green, blue)
    return LightSetting("lamp", "point", "intensity", "W/sr", rgb, rgb, lamp=lamp, mix=drives)


def test_between_two_mixes_shares_change_evenly_and_brightness_in_stops():
    first, second = (0.2, 0.4, 0.1), (0.02, 0.05, 0.3)
    ends = [Lighting((_lamp(x),)) for x in (first, second)]
    [mixed] = interpolate(ends, 0.5, space="log").lights
    y = [float(luminance(np.array(x["lamp"].emission))) for x in ends]
    level = float(luminance(np.array(mixed.emission)))
    assert level == pytest.approx((y[0] * y[1]) ** 0.5)
    expected = (np.array(first) / y[0] + np.array(second) / y[1]) / 2
    assert np.array(mixed.mix) / level == pytest.approx(expected)
    off = Lighting((_lamp((0.0, 0.0, 0.0)),))
    [fading] = interpolate([ends[0], off], 0.5, space="log").lights
    assert np.array(fading.mix) / fading.mix[0] == pytest.approx(np.array(first) / first[0])


def test_a_dimmed_lamp_keeps_its_mix_and_a_warmer_one_has_another():
    lighting = Lighting((_lamp((0.2, 0.4, 0.1)),))
    [half] = dimmed(lighting, 0.5).lights
    assert half.mix == pytest.approx((0.1, 0.2, 0.05))
    assert half.watts == pytest.approx(0.5 * (lighting["lamp"].watts or 0))
    [warmer] = shift(lighting, 50).lights
    assert warmer.mix is not None
    assert warmer.lamp is not None
    assert warmer.emission == pytest.approx(tuple(warmer.lamp.mix(np.array(warmer.mix))))
    assert warmer.mix[0] > 0.2
