"""A batch whose looks have to give some light on measuring planes."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from batches import contents
from renderer import LIGHTS, write_room

from lightpaint.basis.cache.cached_render import obtain_basis
from lightpaint.basis.file.basis_file import write_basis
from lightpaint.batch.gallery.summary import (
    LightRow,
    ObserverRow,
    PlaneRow,
    SummaryRow,
    observers_of_answer,
    planes_of_answer,
    summary_csv,
)
from lightpaint.batch.parcels import FileHashes, ParcelStore, pack, pieces
from lightpaint.batch.plan.plan_steps import estimate
from lightpaint.batch.plan.planner import plan_batch
from lightpaint.batch.run import run_batch
from lightpaint.batch.run_options import RunOptions
from lightpaint.batch.work.item_execution import run_item
from lightpaint.batch.work.worker_storage import WorkerCache
from lightpaint.errors import BatchError
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.constraints.absolute_scale import Scale
from lightpaint.photometry.measure import error_excess, weights_on
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.wished_planes import measure_planes
from lightpaint.progress import listener, silent
from lightpaint.scene.scene_reader import load_scene

LAMP = 'emitters = [{ name = "white", rgb = [9, 9, 9], watts = 30 }]\n'
LAMPS = f"cd_per_unit = 100\n[light.panel]\n{LAMP}[light.bulb]\n{LAMP}"

PLANES = '[plane.floor]\nshape = "floor"\nheight = 0.1\ngrid = 0.5\nmean = 400\n'

LOOKS = """
[defaults]
scene = "project/room.xml"
want = ["predict"]
settings = { spp = 4, planes = "project/floor.planes.toml" }

[[look]]
painting = "dark.exr"
variations = ["warmer"]
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "home" / "project").mkdir(parents=True)
    home = tmp_path / "home"
    write_room(home / "project", lights=LIGHTS["panel"] + LIGHTS["bulb"])
    (home / "project" / "room.lights.toml").write_text(LAMPS, encoding="utf-8")
    (home / "project" / "floor.planes.toml").write_text(PLANES, encoding="utf-8")
    write_rgb(home / "dark.exr", np.full((20, 24, 3), 0.02, np.float32))
    (home / "looks.toml").write_text(LOOKS, encoding="utf-8")
    monkeypatch.chdir(tmp_path)  # paths are relative to the manifest, not to this
    return home


def run_looks(folder: Path) -> list[str]:
    return run_batch(plan_batch(folder / "looks.toml", folder / "out"), RunOptions()).done


def summary_rows(folder: Path) -> list[dict[str, str]]:
    return [*csv.DictReader((folder / "out/summary.csv").read_text("utf-8").splitlines())]


def test_looks_give_the_light_and_another_planes_file_makes_them_stale(folder: Path) -> None:
    assert run_looks(folder) == ["dark", "dark-warmer"]
    row, warmer = summary_rows(folder)
    # The painting is too dark for 400 lx; the wish counts the noise, so the mean is a bit more.
    assert 400 <= float(row["floor Em lx"]) < 420
    report = json.loads((folder / "out/dark/report.json").read_text("utf-8"))["planes"]
    assert float(row["floor U0"]) == pytest.approx(
        report["planes"]["floor"]["uniformity"],
        rel=1e-3,  # four digits
    )
    assert float(row["W"]) == pytest.approx(report["watts"], rel=1e-3)
    assert float(warmer["floor Em lx"]) > 0
    look = json.loads((folder / "out/summary.json").read_text("utf-8"))["looks"][0]
    assert look["planes"][0]["mean_lx"] == pytest.approx(float(row["floor Em lx"]), rel=1e-3)
    assert run_looks(folder) == []
    text = PLANES.replace("400", "450")
    (folder / "project" / "floor.planes.toml").write_text(text, encoding="utf-8")
    assert run_looks(folder) == ["dark", "dark-warmer"]
    row, _ = summary_rows(folder)
    assert 450 <= float(row["floor Em lx"]) < 470
    assert row["wishes missed"] == ""


def test_the_estimate_has_the_lux_once_for_all_looks(folder: Path) -> None:
    def bases_s(planes: str = PLANES) -> float:
        (folder / "project" / "floor.planes.toml").write_text(planes, encoding="utf-8")
        return estimate(plan_batch(folder / "looks.toml", folder / "out")).bases_s

    planned = plan_batch(folder / "looks.toml", folder / "out")
    assert [*planned.measurements] == ["dark", "dark-warmer"]
    without = estimate(replace(planned, measurements={})).bases_s
    alone = estimate(replace(planned, measurements={"dark": planned.measurements["dark"]})).bases_s
    assert without < alone == bases_s()
    assert bases_s('error = "1%"\n' + PLANES) - without > 3 * (alone - without)


def test_a_summary_names_planes_that_miss_their_wishes(folder: Path) -> None:
    text = PLANES.replace("400", "400000")
    (folder / "project" / "floor.planes.toml").write_text(text, encoding="utf-8")
    run_looks(folder)
    row, _ = summary_rows(folder)
    assert float(row["floor Em lx"]) < 400000
    assert row["wishes missed"] == "floor"
    [look, _] = json.loads((folder / "out/summary.json").read_text("utf-8"))["looks"]
    assert look["missed_planes"] == ["floor"]


def test_a_light_that_is_no_lamp_leaves_the_power_known(folder: Path) -> None:
    lights = f"cd_per_unit = 100\n[light.panel]\n{LAMP}[light.bulb]\nlock = true\n"
    (folder / "project" / "room.lights.toml").write_text(lights, encoding="utf-8")
    run_looks(folder)
    report = json.loads((folder / "out/dark/report.json").read_text("utf-8"))["planes"]
    row, _ = summary_rows(folder)
    assert float(row["W"]) == pytest.approx(report["watts"], rel=1e-3)


def test_a_worker_elsewhere_gets_the_planes_file_and_does_the_same(
    folder: Path, tmp_path: Path
) -> None:
    run_looks(folder)
    task = plan_batch(folder / "looks.toml", folder / "again").looks[0].steps[0].task
    scene = load_scene(folder / "project" / "room.xml")
    write_basis(tmp_path / "b.basis.exr", obtain_basis(scene, spp=4))
    task = replace(task, files=(str(tmp_path / "b.basis.exr"),))
    parcel = pack(task, FileHashes(), run="a", is_shared=False)
    store = ParcelStore(tmp_path / "worker")
    for file, digest in (*parcel.files, *parcel.local_files):
        for data, is_first, is_last in pieces(Path(file).read_bytes()):
            store.put(digest, data, is_first=is_first, is_last=is_last)
    outcome = store.run_parcel(parcel, lambda item: run_item(item, WorkerCache(), silent))
    assert outcome.failure == ""
    assert outcome.files is not None
    expected = contents(folder / "out/dark")
    for name in ("lighting.json", "planes/planes.csv", "planes/planes.json"):
        assert outcome.files[name] == expected[name]


def _points_and_error(folder: Path, out: str) -> tuple[bytes, float]:
    """The points of the look, and the relative error of the mean of its plane."""
    assert run_batch(plan_batch(folder / "looks.toml", folder / out), RunOptions()).done
    planes = json.loads((folder / out / "dark/planes/planes.json").read_text("utf-8"))["planes"]
    error = planes["floor"]["mean_error"] / planes["floor"]["mean"]
    return (folder / out / "dark/planes/planes.csv").read_bytes(), error


def test_planes_are_measured_as_well_as_they_ask_whatever_is_cached(folder: Path) -> None:
    """A finer measurement in the cache must not change the answers of a batch."""
    first, usual = _points_and_error(folder, "first")
    finer = f'error = "0.5%"\n{PLANES}'
    (folder / "project" / "floor.planes.toml").write_text(finer, encoding="utf-8")
    _, finest = _points_and_error(folder, "finer")
    assert finest < 0.0026  # half of the 95 % interval is .5 %
    assert usual > 2 * finest
    (folder / "project" / "floor.planes.toml").write_text(PLANES, encoding="utf-8")
    again, _ = _points_and_error(folder, "again")
    assert again == first


def test_the_error_of_a_manifest_holds_for_planes_too(folder: Path) -> None:
    (folder / "looks.toml").write_text(LOOKS.replace("spp = 4", "error = 0.004"), encoding="utf-8")
    step = plan_batch(folder / "looks.toml", folder / "out").looks[0].steps[0]
    values = json.loads(step.task.job)["settings"]
    settings = Settings(**{key: values[key] for key in ("planes", "error")})
    scene = load_scene(folder / "project" / "room.xml")
    scale, listen = Scale(100.0), listener(silent)
    found = measure_planes(scene, values["planes"], settings, scale, listen).illuminance
    assert error_excess(found, weights_on(found.lights), 0.004) <= 1


@pytest.mark.parametrize(
    ("lamps", "planes", "expected"),
    [
        (LAMPS, None, "floor.planes.toml"),
        (LAMPS, PLANES.replace('"floor"', '"flor"'), "flor"),
        (LAMPS.replace("cd_per_unit = 100", ""), PLANES, "settings.cd_per_unit = 1"),
        (LAMPS.replace(", watts = 30", ""), f"{PLANES}[power]\nwatts = 9", "power of each lamp"),
    ],
    ids=["no file", "no shape", "no unit", "no watts"],
)
def test_a_plan_finds_what_planes_lack_before_anything_is_rendered(
    folder: Path, lamps: str, planes: str | None, expected: str
) -> None:
    (folder / "project" / "room.lights.toml").write_text(lamps, encoding="utf-8")
    (folder / "project" / "floor.planes.toml").unlink()
    if planes is not None:
        (folder / "project" / "floor.planes.toml").write_text(planes, encoding="utf-8")
    with pytest.raises(BatchError) as error:
        plan_batch(folder / "looks.toml", folder / "out")
    assert expected in str(error.value)
    assert "look 'dark.exr'" in str(error.value)


def test_each_case_has_columns_of_its_own(tmp_path: Path) -> None:
    for case, mean in (("night", 300.0), ("noon", 900.0)):
        folder = tmp_path / "planes" / case
        folder.mkdir(parents=True)
        planes = {"desk": {"mean": mean, "uniformity": 0.5}}
        document = {"planes": planes, "observers": {"me": {"ugr": mean / 50}}}
        (folder / "planes.json").write_text(json.dumps(document), encoding="utf-8")
    assert planes_of_answer(tmp_path) == (
        PlaneRow("desk, night", 300.0, 0.5),
        PlaneRow("desk, noon", 900.0, 0.5),
    )
    assert observers_of_answer(tmp_path) == (
        ObserverRow("me, night", 6.0),
        ObserverRow("me, noon", 18.0),
    )


def test_columns_of_planes_are_those_of_no_light() -> None:
    names = ["desk Em lx", "W", "desk"]
    lights = tuple(LightRow(name, k + 0.5, (2.0, 3.0, 4.0)) for k, name in enumerate(names))
    planes = (PlaneRow("desk", 500.0, 0.6),)
    seen = (ObserverRow("me", 18.4), ObserverRow("camera", None))
    rows = [
        SummaryRow(
            "dusk", "done", "", "dusk", lights=lights, planes=planes, observers=seen, watts=70.0
        ),
        SummaryRow("noon", "failed", "no sun", "noon"),
    ]
    [heading, cells, failed] = csv.reader(summary_csv(rows).splitlines())
    assert len(set(heading)) == len(heading) == len(cells) == len(failed)
    table = dict(zip(heading, cells, strict=True))
    assert (table["desk Em lx"], table["desk U0"], table["W"]) == ("500", "0.6", "70")
    assert (table["me UGR"], table["camera UGR"]) == ("18.4", "")
    assert (table["light desk Em lx"], table["light W"], table["desk"]) == ("0.5", "1.5", "2.5")
