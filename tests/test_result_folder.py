"""What a result folder holds is kept, and what is read is never written over."""

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import run, run_refused, succeed
from light_groups import interleaved, pictures
from renderer import LIGHTS, write_room

import lightpaint as lp
from lightpaint.basis.file.basis_file import write_basis
from lightpaint.errors import OutputError
from lightpaint.images.formats.exr import write_rgb
from lightpaint.images.formats.png import png_bytes
from lightpaint.pipeline.job.sources import BasisFile
from lightpaint.pipeline.result_folder import RECORD

SOLVE = ("solve", "a.basis.exr")


@pytest.fixture
def work_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, make_basis: Any) -> Path:
    """A folder with a basis, and two paintings of one name."""
    basis = make_basis(3)
    write_basis(tmp_path / "a.basis.exr", basis)
    for k, folder in enumerate(("template", "gallery"), start=1):
        write_rgb(tmp_path / folder / "evening.exr", k * basis.images.sum(axis=0))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def room(work_folder: Path) -> Path:
    return write_room(work_folder, lights=LIGHTS["panel"] + LIGHTS["bulb"])


@pytest.fixture
def no_render(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is rendered: what is refused is refused before."""

    def fail(*_: object, **__: object) -> None:
        raise AssertionError("this was to be refused before it renders")

    # The modules that import `obtain` first: what they import then must not be `fail` for good.
    for name in (
        "templates.obtain",
        "templates.render",
        "templates.render_surfaces",
        "relit_renders.render",
        "job_bases.obtain",
    ):
        monkeypatch.setattr(f"lightpaint.pipeline.{name}", fail)


def contents(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file()
    }


def test_a_painting_in_the_result_folder_is_not_written_over(work_folder: Path) -> None:
    """Under whatever name, with whatever force."""
    succeed(work_folder, *SOLVE, "gallery/evening.exr")
    painting = work_folder / "evening" / "predicted.exr"
    before = contents(work_folder)
    os.link(painting, work_folder / "hard.exr")
    (work_folder / "symbolic.exr").symlink_to(painting)
    for name in ("evening/predicted.exr", "hard.exr", "symbolic.exr", "gallery/../evening/x.exr"):
        if name.endswith("x.exr"):
            painting.rename(work_folder / "evening" / "x.exr")
            (work_folder / "evening" / "report.html").unlink()
            (work_folder / "evening" / "report.html").symlink_to("x.exr")
        for options in ([], ["--force"]):
            line = run_refused(work_folder, *SOLVE, name, "-o", "evening", *options)
            assert "is an input of this command" in line
            assert line.endswith("(-o)")
    (work_folder / "evening" / "x.exr").rename(painting)
    (work_folder / "evening" / "report.html").unlink()
    files_before = contents(work_folder)
    assert {name: files_before[name] for name in before if name != "evening/report.html"} == {
        name: data for name, data in before.items() if name != "evening/report.html"
    }


@pytest.mark.parametrize(
    ("place", "option"),
    [("lighting.json", "--lights-file"), ("comparison.png", "--mask"), ("predicted.exr", "")],
)
def test_what_goes_with_a_painting_is_not_written_over_either(
    work_folder: Path, place: str, option: str
) -> None:
    file = work_folder / "out" / place
    file.parent.mkdir()
    arguments: list[object] = [*SOLVE, "gallery/evening.exr", option, f"out/{place}"]
    if place == "predicted.exr":
        (work_folder / "a.basis.exr").rename(file)
        arguments = ["solve", "out/predicted.exr", "gallery/evening.exr"]
    elif place == "comparison.png":
        file.write_bytes(png_bytes(np.full((12, 10, 3), 255, np.uint8)))
    else:
        file.write_text("[light.'light 0']\noff = true\n", encoding="utf-8")
    line = run_refused(work_folder, *arguments, "-o", "out", "--force")
    assert f"out/{place} is an input of this command" in line


def test_light_groups_are_not_written_over(work_folder: Path) -> None:
    layers = {f"RGBA_{name}": x for name, x in zip("abc", pictures(), strict=True)}
    interleaved(work_folder / "relit.exr", layers)
    write_rgb(work_folder / "p.exr", pictures()[0])
    assert "relit.exr is an input" in run_refused(
        work_folder, "solve", "relit.exr", "p.exr", "-o", ".", "--force"
    )
    (work_folder / "groups").mkdir()
    (work_folder / "relit.exr").rename(work_folder / "groups" / "relit.exr")
    line = run_refused(work_folder, "solve", "groups", "p.exr", "-o", "groups", "--force")
    assert "groups/relit.exr is an input" in line


@pytest.mark.usefixtures("no_render")
def test_a_scene_is_not_written_over(work_folder: Path, room: Path) -> None:
    write_rgb(work_folder / "p.exr", np.ones((20, 24, 3), np.float32))
    room.rename(work_folder / "relit.xml")
    for command in (
        ("solve", "relit.xml", "p.exr", "-o", "."),
        ("basis", "relit.xml", "-o", "relit.exr"),
    ):
        if command[0] == "basis":
            os.link(work_folder / "relit.xml", work_folder / "relit.exr")
        line = run_refused(work_folder, *command)
        assert "relit.xml belongs to the scene" in line or "relit.exr is an input" in line
    sky = LIGHTS["panel"] + (
        '<emitter type="envmap" id="sky"><string name="filename" value="albedo.exr"/></emitter>'
    )
    write_room(work_folder, lights=sky)
    write_rgb(work_folder / "albedo.exr", np.ones((4, 8, 3), np.float32))
    line = run_refused(work_folder, "template", "room.xml", "-o", ".", "--force")
    assert "albedo.exr is an input of this command" in line
    line = run_refused(work_folder, "template", "room.xml", "-o", "albedo.exr", "--force")
    assert "albedo.exr is an input of this command" in line
    os.link(work_folder / "albedo.exr", work_folder / "verified.exr")
    line = run_refused(work_folder, "solve", "room.xml", "p.exr", "-o", ".", "--force")
    assert "verified.exr is an input of this command" in line


def test_earlier_results_are_kept_unless_they_answer_the_same_painting(work_folder: Path) -> None:
    succeed(work_folder, *SOLVE, "gallery/evening.exr")
    (work_folder / "evening" / "notes.txt").write_text("mine", encoding="utf-8")
    before = contents(work_folder / "evening")
    line = run_refused(work_folder, *SOLVE, "template/evening.exr")
    assert line == (
        "lightpaint solve: evening holds the answer to gallery/evening.exr, not to "
        "template/evening.exr: name another folder (-o), or replace it (--force)"
    )
    assert contents(work_folder / "evening") == before
    # A designer paints on, in the same file.
    os.replace(work_folder / "template" / "evening.exr", work_folder / "gallery" / "evening.exr")
    succeed(work_folder, *SOLVE, "./template/../gallery/evening.exr", "--off", "light 0")
    after = contents(work_folder / "evening")
    assert after["lighting.json"] != before["lighting.json"]
    assert after["notes.txt"] == b"mine"
    # Also where the whole has been moved.
    (work_folder / "moved").mkdir()
    for name in ("evening", "gallery", "a.basis.exr"):
        (work_folder / name).rename(work_folder / "moved" / name)
    succeed(work_folder / "moved", *SOLVE, "gallery/evening.exr")


def test_force_replaces_whatever_it_was(work_folder: Path) -> None:
    succeed(work_folder, *SOLVE, "gallery/evening.exr")
    (work_folder / "evening" / "notes.txt").write_text("mine", encoding="utf-8")
    succeed(work_folder, *SOLVE, "template/evening.exr", "--force")
    assert (work_folder / "evening" / "notes.txt").is_file()
    assert json.loads((work_folder / "evening" / RECORD).read_text())["answers"] == [
        "../template/evening.exr"
    ]
    succeed(work_folder, *SOLVE, "template/evening.exr")


def test_two_paintings_of_one_name_in_one_command(work_folder: Path) -> None:
    line = run_refused(
        work_folder, *SOLVE, "template/evening.exr", "gallery/evening.exr", "-o", "out"
    )
    assert "results would overwrite each other in evening: run equal names" in line


def test_jobs_that_were_born_before_the_other_was_run(work_folder: Path) -> None:
    jobs = [
        lp.Job((), (lp.Painting(f"{name}/evening.exr"),), Path("out"), BasisFile("a.basis.exr"))
        for name in ("template", "gallery")
    ]
    lp.run(jobs[0])
    before = contents(work_folder / "out")
    with pytest.raises(OutputError, match=r"holds the answer to template/evening\.exr"):
        lp.run(jobs[1])
    assert contents(work_folder / "out") == before
    lp.run(jobs[0])


def test_what_comes_to_the_folder_during_a_run_is_kept(
    work_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two of one name at once, as `xargs -P` starts them."""
    from lightpaint.pipeline import job_run

    job, other = (
        lp.Job((), (lp.Painting(f"{name}/evening.exr"),), Path("out"), BasisFile("a.basis.exr"))
        for name in ("template", "gallery")
    )
    analyse = job_run.analyse
    with monkeypatch.context() as patch:

        def write_meanwhile(*arguments: Any, **options: Any) -> Any:
            patch.setattr(job_run, "analyse", analyse)
            lp.run(other)
            return analyse(*arguments, **options)

        patch.setattr(job_run, "analyse", write_meanwhile)
        with pytest.raises(OutputError, match=r"holds the answer to gallery/evening\.exr"):
            lp.run(job)
    assert json.loads((work_folder / "out" / RECORD).read_text())["answers"] == [
        "../gallery/evening.exr"
    ]
    assert [path.name for path in work_folder.glob(".*")] == []


def test_results_of_an_older_version_say_nothing_of_whose_they_are(work_folder: Path) -> None:
    succeed(work_folder, *SOLVE, "gallery/evening.exr")
    (work_folder / "evening" / RECORD).unlink()
    (work_folder / "evening" / "relit.xml").write_text("earlier", encoding="utf-8")
    line = run_refused(work_folder, *SOLVE, "gallery/evening.exr")
    assert "evening holds results of an older lightpaint, which do not name their" in line
    assert line.endswith("name another folder (-o), or replace it (--force)")
    succeed(work_folder, *SOLVE, "gallery/evening.exr", "--force")
    assert not (work_folder / "evening" / "relit.xml").exists()
    succeed(work_folder, *SOLVE, "gallery/evening.exr")


@pytest.mark.parametrize("name", ["report.html", "lighting.json", RECORD])
def test_somebody_else_s_files_are_kept(work_folder: Path, name: str) -> None:
    (work_folder / "out").mkdir()
    (work_folder / "out" / name).write_text("{}", encoding="utf-8")
    line = run_refused(work_folder, *SOLVE, "gallery/evening.exr", "-o", "out")
    assert ("an older lightpaint" if name == "lighting.json" else "not a result of") in line
    assert (work_folder / "out" / name).read_text() == "{}"


@pytest.mark.parametrize("name", ["lighting.json", "report.html"])
def test_what_was_changed_by_hand_is_kept(work_folder: Path, name: str) -> None:
    succeed(work_folder, *SOLVE, "gallery/evening.exr")
    with (work_folder / "evening" / name).open("a", encoding="utf-8") as file:
        file.write("\n")
    line = run_refused(work_folder, *SOLVE, "gallery/evening.exr")
    assert f"evening/{name} was changed since lightpaint wrote it" in line
    (work_folder / "evening" / name).unlink()
    succeed(work_folder, *SOLVE, "gallery/evening.exr")


@pytest.mark.parametrize(
    "damage",
    [
        {"files": {"../gallery/evening.exr": "00000000"}},
        {"files": {"/etc/hostname": "00000000", "lighting.json": 7}},
        {"answers": "all"},
        {"format": "another"},
    ],
)
def test_a_damaged_record_is_none(work_folder: Path, damage: dict[str, Any]) -> None:
    succeed(work_folder, *SOLVE, "gallery/evening.exr")
    path = work_folder / "evening" / RECORD
    record = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps(record | damage), encoding="utf-8")
    line = run_refused(work_folder, *SOLVE, "gallery/evening.exr")
    assert "do not name their painting" in line
    succeed(work_folder, *SOLVE, "gallery/evening.exr", "--force")
    assert (work_folder / "gallery" / "evening.exr").is_file()


def test_targets_in_memory_go_by_their_names(work_folder: Path, make_basis: Any) -> None:
    basis = make_basis(3)
    target = lp.Target.of(basis.images[0], name="key")
    lp.paint_with_light(None, target, "out", basis=basis)
    lp.paint_with_light(None, replace(target, image=2 * target.image), "out", basis=basis)
    other = replace(target, name="fill")
    with pytest.raises(OutputError, match=r"key \(in memory\), not to fill \(in memory\)"):
        lp.paint_with_light(None, other, "out", basis=basis)
    lp.paint_with_light(None, other, "out", basis=basis, force=True)
    # What was read from a file is that file's.
    read = lp.read_target("gallery/evening.exr")
    lp.paint_with_light(None, read, "read", basis=basis)
    lp.paint_with_light(None, "gallery/evening.exr", "read", basis=basis)


def test_relight_keeps_what_is_not_its_own(work_folder: Path, room: Path) -> None:
    def relight(*arguments: object) -> Any:
        return run(work_folder, "relight", "room.xml", *arguments, "--spp", 2)

    scene = lp.load_scene(room)
    write_rgb(work_folder / "look.exr", np.ones((20, 24, 3), np.float32))
    lp.paint_with_light(scene, "look.exr", "look", spp=2)
    # Edited by hand, as the documents say, and relit where it lies.
    lighting = work_folder / "look" / "lighting.json"
    lighting.write_text(lighting.read_text() + "\n", encoding="utf-8")
    assert relight("look/lighting.json").returncode == 0
    assert relight("look/lighting.json").returncode == 0
    names = {"relit.xml", "relit.exr", "relit.png", "report.html", "lighting.json"}
    assert names <= contents(work_folder / "look").keys()
    line = run_refused(work_folder, "solve", "room.xml", "look.exr", "--spp", 2)
    assert "look/lighting.json was changed" in line

    # Another of that name does not meet it, and what is read is not written over.
    (work_folder / "other").mkdir()
    (work_folder / "other" / "lighting.json").write_bytes(lighting.read_bytes())
    before = contents(work_folder)
    completed = relight("other/lighting.json")
    assert completed.returncode == 2
    assert "look holds the answer to look.exr, not to other/lighting.json" in completed.stderr
    completed = relight("other/lighting.json", "look/lighting.json")
    assert "results would overwrite each other in look: run equal names" in completed.stderr
    os.link(lighting, work_folder / "other" / "relit.png")
    completed = relight("look/lighting.json", "-o", "other", "--force")
    assert "other/relit.png is an input of this command" in completed.stderr
    (work_folder / "other" / "relit.png").unlink()
    assert contents(work_folder) == before

    assert relight("other/lighting.json", "-o", "new").returncode == 0
    assert relight("other/lighting.json", "-o", "new").returncode == 0
    completed = relight("look/lighting.json", "-o", "new")
    assert (
        "new holds the answer to other/lighting.json, not to look/lighting.json" in completed.stderr
    )
    # What replaces a solve's results leaves none of them behind.
    assert relight("other/lighting.json", "-o", "look", "--force").returncode == 0
    assert contents(work_folder / "look").keys() == {"relit.xml", "relit.exr", "relit.png", RECORD}


def test_what_can_be_seen_after_a_run_can_be_rendered_and_relit(
    work_folder: Path, room: Path
) -> None:
    """Also where the scene lies in the folder itself, and the relit one is written there."""
    write_rgb(work_folder / "p.exr", np.ones((20, 24, 3), np.float32))
    for folder in ("out", "."):
        look = lp.paint_with_light(lp.load_scene("room.xml"), "p.exr", folder, spp=2)
        assert look.relit is not None
        assert look.relit.path == Path(folder) / "relit.xml"
        assert lp.verify(look.predicted, look.relit, spp=2).agrees
        second = lp.relight(look.relit, look.lighting, "again.xml")
        assert second.light("panel").emission == pytest.approx(look.lighting.emission["panel"])
        way = f'<path value="{os.path.relpath(".", folder)}"/>'
        assert way in (Path(folder) / "relit.xml").read_text(encoding="utf-8")
        assert run(work_folder, "verify", folder).returncode == 0


def test_views_that_are_not_painted_any_more_go(work_folder: Path, make_basis: Any) -> None:
    from lightpaint.pipeline.result_folder import ResultFolder

    result_folder = ResultFolder(Path("out"), (Path("out/a/x"), Path("out/b/x")), (), ("a", "b"))
    one = replace(result_folder, files=(Path("out/a/x"),), answers=("a",))
    for folder, names in ((one, ["a"]), (result_folder, ["a", "b"])):
        folder.check()
        with folder.filled() as stage:
            for name in names:
                (stage / name).mkdir()
                (stage / name / "x").touch()
    # The answer to b would be lost.
    with pytest.raises(OutputError, match=r"holds the answer to a \(in memory\) and b \(in mem"):
        one.check()
    forced = replace(one, force=True)
    with forced.filled() as stage:
        (stage / "a").mkdir()
        (stage / "a" / "x").touch()
    assert contents(work_folder / "out").keys() == {"a/x", RECORD}
    assert not (work_folder / "out" / "b").exists()


@pytest.mark.usefixtures("no_render")
def test_a_folder_where_a_result_should_go_is_said_before_it_renders(
    work_folder: Path, room: Path
) -> None:
    write_rgb(work_folder / "p.exr", np.ones((20, 24, 3), np.float32))
    for folder in ("out/predicted.exr", "out/relit.png", "x.exr", "y.png", "t/albedo.exr"):
        (work_folder / folder).mkdir(parents=True)
    lp.write_lighting("l.json", replace(_lighting(room), target="out"))
    for command, file in (
        (("solve", "room.xml", "p.exr", "-o", "out"), "out/predicted.exr"),
        (("relight", "room.xml", "l.json"), "out/relit.png"),
        (("basis", "room.xml", "-o", "x.exr"), "x.exr"),
        (("template", "room.xml", "-o", "x.exr"), "x.exr"),
        (("template", "room.xml", "-o", "y.exr"), "y.png"),
        (("template", "room.xml", "-o", "t"), "t/albedo.exr"),
    ):
        line = run_refused(work_folder, *command)
        assert f"{file} is a folder, but a file is to be written there" in line


@pytest.mark.usefixtures("no_render")
def test_places_that_are_not_utf_8_are_said_before_it_renders(
    work_folder: Path, room: Path
) -> None:
    name = os.fsdecode(b"evening\xff")
    write_rgb(work_folder / "p.exr", np.ones((20, 24, 3), np.float32))
    for ending in ("png", "exr"):
        os.link(work_folder / "p.exr", work_folder / f"{name}.{ending}")
        line = run_refused(work_folder, *SOLVE, f"{name}.{ending}")
        assert f"evening\\udcff.{ending} is a name that is not UTF-8: rename the file" in line
    lp.write_lighting("l.json", _lighting(room))
    for command in (
        ("solve", "room.xml", "p.exr", "-o", name),
        ("relight", "room.xml", "l.json", "-o", name),
        ("basis", "room.xml", "-o", f"{name}.basis.exr"),
        ("template", "room.xml", "-o", name),
        ("template", "room.xml", "-o", f"{name}.exr"),
    ):
        line = run_refused(work_folder, *command)
        assert "evening\\udcff" in line
        assert "is not UTF-8: choose another (-o)" in line


def _lighting(room: Path) -> lp.Lighting:
    """As the scene is now."""
    basis = lp.render_basis(lp.load_scene(room), spp=2)
    image = basis.images.sum(axis=0)
    return lp.solve(basis, lp.Target.of(image)).lighting


@pytest.mark.usefixtures("no_render")
def test_a_template_keeps_what_is_there(work_folder: Path, room: Path) -> None:
    (work_folder / "mattes").mkdir()
    for name in ("mattes/mine.png", "depth.exr"):
        (work_folder / name).write_text("mine", encoding="utf-8")
        line = run_refused(work_folder, "template", "room.xml", "-o", ".")
        assert f"{name} exists and may have been painted on" in line
        (work_folder / name).unlink()


def test_a_forced_template_leaves_what_is_not_its_own(work_folder: Path, room: Path) -> None:
    arguments = ("template", "room.xml", "--spp", 2)
    succeed(work_folder, *arguments)
    (work_folder / "template" / "mattes" / "mine.png").write_text("mine", encoding="utf-8")
    assert (work_folder / "template" / "evening.exr").is_file()
    succeed(work_folder, *arguments, "--force")
    assert (work_folder / "template" / "mattes" / "mine.png").is_file()
    assert (work_folder / "template" / "evening.exr").is_file()
    metadata = json.loads((work_folder / "template" / "template.json").read_text(encoding="utf-8"))
    assert all((work_folder / "template" / name).is_file() for name in metadata["files"])
