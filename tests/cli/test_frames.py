"""`lightpaint solve 'shot.####.exr' …`: the frames of a shot as views of one lighting, or keyed."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import run, run_refused, succeed
from light_groups import interleaved, pictures

import lightpaint as lp
from lightpaint.basis.lightgroups.frame_sequence import find_frames
from lightpaint.images import formats
from lightpaint.images.formats.exr import read_parts, write_rgb
from lightpaint.lighting.answer.lighting_file import read_lighting

NAMES = ("fill", "key", "rim")
FRAMES = (1, 2, 3, 4)

#: Weights at the frames 1, 2 and 4, and what a solve in float32 finds of them.
SET = np.array([[(2, 1, 0.5), (0, 0, 0), (1, 1, 1)], [(1, 1, 1), (1, 2, 3), (0.5, 1, 1)]])
EXACT = 1e-4


def shot(folder: Path, *, lacks: float = 0.0, size: tuple[int, int] = (12, 16)) -> None:
    """Write four frames of three light groups, and a beauty with an alpha."""
    for frame in FRAMES:
        images = pictures(seed=frame, size=size)
        layers = {f"RGBA_{name}": x for name, x in zip(NAMES, images, strict=True)}
        beauty = images.sum(axis=0) * (1 + lacks * (frame > 1))
        interleaved(folder / f"shot.{frame:04d}.exr", {"RGBA": beauty, **layers})


def paint(folder: Path, frame: int, weights: Any, name: str = "p") -> None:
    """Write a painting that lights of these weights meet exactly."""
    groups = lp.read_light_groups(folder / f"shot.{frame:04d}.exr")
    rest = np.ones((len(groups.basis.lights) - 3, 3))
    image = groups.basis.mix(np.concatenate([weights, rest]))
    write_rgb(folder / f"{name}.{frame:04d}.exr", image)


def weights_in(folder: Path) -> Any:
    lighting = read_lighting(folder / "lighting.json")
    return np.array([lighting[name].weight for name in NAMES])


def relit(folder: Path, frame: int) -> Any:
    return read_parts(folder / f"relit.{frame:04d}.exr")[0].rgb()


def test_one_painting_lights_the_shot(tmp_path: Path) -> None:
    shot(tmp_path)
    paint(tmp_path, 2, SET[0], "evening")
    output = succeed(tmp_path, "solve", "shot.####.exr", "evening.0002.exr", "--frames", "all")
    assert "frames: evening/relit.0001.exr to relit.0004.exr, 4 files" in output
    np.testing.assert_allclose(weights_in(tmp_path / "evening"), SET[0], atol=EXACT)
    assert not (tmp_path / "evening" / "relit.exr").exists()
    for frame in FRAMES:
        basis = lp.read_light_groups(tmp_path / f"shot.{frame:04d}.exr").basis
        found = relit(tmp_path / "evening", frame)
        np.testing.assert_allclose(found, basis.mix(SET[0]), atol=EXACT * 10)


def test_several_frames_are_views_of_one_lighting(tmp_path: Path) -> None:
    shot(tmp_path, lacks=0.3)  # the first frame lacks nothing
    for frame in (1, 4):
        paint(tmp_path, frame, SET[1])
    paint(tmp_path, 2, SET[1], "other")
    completed = run(tmp_path, "solve", "shot.%04d.exr", "p.####.exr", "-o", "out")
    assert completed.returncode == 0, completed.stderr
    assert "one lighting for the frames 1, 4: --animate finds one for each" in completed.stderr
    assert "frame 0001:" in completed.stdout
    assert "frame 0004:" in completed.stdout
    np.testing.assert_allclose(weights_in(tmp_path / "out"), SET[1], atol=EXACT)
    assert (tmp_path / "out" / "0004" / "report.html").is_file()
    assert sorted(x.name for x in (tmp_path / "out").glob("relit.*.exr")) == [
        "relit.0001.exr",
        "relit.0004.exr",
    ]
    # Unpainted frames with a rest, and without, have the same lighting.
    succeed(tmp_path, "solve", "shot.%04d.exr", "p.####.exr", "-o", "out", "--frames", "2-3")
    assert relit(tmp_path / "out", 3).shape == (12, 16, 3)


def test_lights_change_smoothly_between_painted_frames(tmp_path: Path) -> None:
    shot(tmp_path)
    paint(tmp_path, 1, SET[0])
    paint(tmp_path, 4, SET[1])
    arguments = (
        "solve",
        "shot.####.exr",
        "p.####.exr",
        "-o",
        "out",
        "--animate",
        "--frames",
        "all",
    )
    document = json.loads(succeed(tmp_path, *arguments, "--json"))
    assert len(document["frames"]) == 4
    lighting = read_lighting(tmp_path / "out" / "lighting.json")
    assert [(key.frame, key.target) for key in lighting.animation] == [(1, "p.0001"), (4, "p.0004")]
    # The tie of neighbouring keys draws a light that is well seen by little.
    for frame, expected in ((1, SET[0]), (4, SET[1])):
        found = np.array([lighting.at_frame(frame)[name].weight for name in NAMES])
        np.testing.assert_allclose(found, expected, atol=0.05)
    basis = lp.read_light_groups(tmp_path / "shot.0002.exr").basis
    between = basis.mix(lighting.at_frame(2).weights_for(basis))
    np.testing.assert_allclose(relit(tmp_path / "out", 2), between, atol=1e-5)
    export = ("export", "out/lighting.json", "--to", "nuke,blender,csv", "-o", "x")
    succeed(tmp_path, *export, "--lights", "shot.####.exr", "--pattern", "RGBA_{name}")
    script = (tmp_path / "x" / "relit.nk").read_text()
    assert script == (tmp_path / "out" / "relit.nk").read_text()
    assert "shot.####.exr" in script
    line = run_refused(tmp_path, *export[:-1], "y", "--lights", "shot.0001.exr")
    assert "shot.0001.exr is one of its frames: give all, like --lights 'shot.####.exr'" in line


def test_frames_of_this_answer_are_written_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shot(tmp_path)
    paint(tmp_path, 2, SET[0])
    arguments = ("solve", "shot.####.exr", "p.0002.exr", "-o", "out", "--frames", "all")
    written: list[str] = []
    write_parts = formats.write_parts

    def watched(path: Path, parts: Any) -> None:
        if len(written) == 2:
            raise KeyboardInterrupt
        write_parts(path, parts)
        written.append(path.name)

    monkeypatch.setattr(formats, "write_parts", watched)
    completed = run(tmp_path, *arguments)
    assert completed.returncode == 130
    assert "frames that are written stay; the same command goes on" in completed.stderr
    written[:] = ["", ""]  # as if the process were a new one
    monkeypatch.setattr(
        formats, "write_parts", lambda *x: (write_parts(*x), written.append(x[0].name))
    )
    completed = run(tmp_path, *arguments)
    assert completed.returncode == 0, completed.stderr
    assert "2 of 4 frames are already written for this answer" in completed.stderr
    assert written[2:] == ["relit.0003.exr", "relit.0004.exr"]

    # A frame that was rendered again is written again; another answer leaves none of the old.
    written.clear()
    images = pictures(seed=9, size=(12, 16))
    layers = {f"RGBA_{name}": x for name, x in zip(NAMES, images, strict=True)}
    interleaved(tmp_path / "shot.0003.exr", {"RGBA": images.sum(axis=0), **layers})
    assert run(tmp_path, *arguments).returncode == 0
    assert written == ["relit.0003.exr"]
    paint(tmp_path, 2, SET[1])
    assert run(tmp_path, *arguments[:-2]).returncode == 0
    assert [x.name for x in (tmp_path / "out").glob("relit.*.exr")] == ["relit.0002.exr"]


def test_a_foreign_file_among_the_frames_stays(tmp_path: Path) -> None:
    shot(tmp_path)
    paint(tmp_path, 2, SET[0])
    (tmp_path / "out").mkdir()
    write_rgb(tmp_path / "out" / "relit.0003.exr", np.zeros((2, 2, 3), np.float32))
    arguments = ("solve", "shot.####.exr", "p.0002.exr", "-o", "out")
    completed = run(tmp_path, *arguments, "--frames", "all")
    assert completed.returncode == 2
    assert "out/relit.0003.exr exists and is not a frame of" in completed.stderr
    assert not (tmp_path / "out" / "lighting.json").exists()  # it is found before the solve
    assert run(tmp_path, *arguments).returncode == 0
    assert relit(tmp_path / "out", 3).shape == (2, 2, 3)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            "shot.####.exr p.0009.exr",
            "p.0009.exr is of frame 9, which shot.####.exr lacks: it has 1-4",
        ),
        ("gone.####.exr p.0002.exr", "no frame matches gone.####.exr"),
        (
            "shot.####.exr q.####.exr",
            "no frame is in both: shot.####.exr has 1-4, q.####.exr has 9",
        ),
        ("shot.####.exr p.0002.exr r_2.exr", "p.0002.exr and r_2.exr are both of frame 2"),
        ("shot.####.exr evening.exr", "call it like evening.0001.exr, or give it with --target 1="),
        ("shot.####.exr p.0002.exr --animate", "--animate needs paintings of two frames"),
        ("shot.0002.exr p.0002.exr --animate", "--animate needs paintings of two frames"),
        ("shot.0002.exr p.0002.exr --frames all", "--frames are of a shot"),
        ("shot.####.exr p.0002.exr --frames 7-9", "has none of the frames 7-9: it has 1-4"),
        ("shot.####.exr", "no painting to solve for: give a TARGET whose name has its frame"),
        ("shot.####.exr --target a=p.0002.exr", "expected the number of one, like 1=p.0002.exr"),
        ("shot.####.exr p.0002.exr --spp 4", "--spp cannot be used with shot.0002.exr"),
        ("shot.####.exr p.0002.exr --variations warmer", "--variations are of one picture"),
        ("shot.####.exr p.0001.exr p.0002.exr --animate --sparse 2", "sparse chooses the lights"),
        ("shot.####.exr p.0002.exr --mask m.####.png", "no frame matches m.####.png"),
    ],
)
def test_what_is_wrong_is_one_line(tmp_path: Path, arguments: str, words: str) -> None:
    shot(tmp_path)
    for frame in (1, 2):
        paint(tmp_path, frame, SET[0])
    write_rgb(tmp_path / "q.0009.exr", np.zeros((12, 16, 3), np.float32))
    completed = run(tmp_path, "solve", *arguments.split(), "-o", "out")
    assert completed.returncode == 2
    lines = [x for x in completed.stderr.splitlines() if x.startswith("lightpaint solve:")]
    assert len(lines) == 1
    assert words in lines[0]
    assert not (tmp_path / "out").exists()


def test_other_commands_ask_for_one_frame(tmp_path: Path) -> None:
    shot(tmp_path)
    for command in ("paint", "template"):
        run_refused(
            tmp_path,
            "has the frames 1-4: give one of them, like shot.0001.exr",
            command,
            "shot.####.exr",
        )


def test_a_job_of_frames_can_be_sent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shot(tmp_path)
    for frame in (1, 4):
        paint(tmp_path, frame, SET[1])
    sequence = find_frames("shot.####.exr")
    from lightpaint.pipeline.job.sources import GroupsFile

    groups = tuple(GroupsFile(str(sequence.path(frame))) for frame in (1, 4))
    paintings = tuple(lp.Painting(f"p.{frame:04d}.exr") for frame in (1, 4))
    job = lp.Job((), paintings, Path("out"), groups, sequence=sequence)
    assert lp.Job.from_json(job.to_json()) == job
    assert job.painted_frames == (1, 4)
    assert [view.folder for view in job.views] == [Path("out/0001"), Path("out/0004")]


def test_a_frame_of_another_size_is_refused(tmp_path: Path) -> None:
    """It was relit at its own size, without a word; later it was refused, but after the solve."""
    shot(tmp_path)
    paint(tmp_path, 2, SET[0], "evening")
    images = pictures(seed=9, size=(6, 8))
    layers = {f"RGBA_{name}": x for name, x in zip(NAMES, images, strict=True)}
    interleaved(tmp_path / "shot.0003.exr", {"RGBA": images.sum(axis=0), **layers})
    completed = run(tmp_path, "solve", "shot.####.exr", "evening.0002.exr", "--frames", "all")
    assert completed.returncode == 2
    last = completed.stderr.splitlines()[-1]
    assert "shot.0003.exr is 8x6, but the painted frames are 16x12" in last
    assert not (tmp_path / "evening" / "lighting.json").exists()
    succeed(tmp_path, "solve", "shot.####.exr", "evening.0002.exr", "--frames", "1-2")


def test_a_frame_that_is_cut_off_is_refused_before_the_solve(tmp_path: Path) -> None:
    shot(tmp_path)
    paint(tmp_path, 2, SET[0], "evening")
    damaged = tmp_path / "shot.0004.exr"
    damaged.write_bytes(damaged.read_bytes()[:100])
    completed = run(tmp_path, "solve", "shot.####.exr", "evening.0002.exr", "--frames", "all")
    assert completed.returncode == 2
    assert "shot.0004.exr" in completed.stderr.splitlines()[-1]
    assert not (tmp_path / "evening" / "lighting.json").exists()
