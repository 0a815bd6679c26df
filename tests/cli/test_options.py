"""What `solve` starts from, as it is given on the command line."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import run_refused
from light_groups import channels, interleaved, pictures, write
from renderer import write_room

from lightpaint.basis.file.basis_file import write_basis
from lightpaint.basis.lightgroups.light_groups import read_light_groups
from lightpaint.cli.options.job_options import jobs_of, settings_of
from lightpaint.cli.options.parser import command_parser
from lightpaint.cli.options.source_options import basis_of
from lightpaint.cli.output.vocabulary import spoken
from lightpaint.errors import BasisError, ImageError
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.answer.lighting_file import write_lighting
from lightpaint.pipeline.job.sources import BasisFile, GroupsFile
from lightpaint.target.painted_target import Target


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, make_basis: Any) -> Path:
    """A folder with light groups, paintings, a scene, a basis and results."""
    monkeypatch.chdir(tmp_path)
    layers = {f"RGBA_{name}": x for name, x in zip("abc", pictures(), strict=True)}
    interleaved(tmp_path / "groups.exr", layers | {"RGBA": pictures().sum(axis=0)})
    interleaved(tmp_path / "with,comma.exr", layers)
    write(tmp_path / "painting.exr", ("rgb", channels("", pictures()[0])))
    (tmp_path / "scene.xml").write_text("<scene/>")
    write_basis(tmp_path / "a.basis.exr", make_basis(2))
    (tmp_path / "key").mkdir()
    write(tmp_path / "key" / "predicted.exr", ("rgb", channels("", pictures()[0])))
    (tmp_path / "empty").mkdir()
    return tmp_path


def _options(*arguments: str) -> Any:
    return command_parser().parse_args(["solve", *arguments])


def _jobs(*arguments: str) -> Any:
    options = _options(*arguments)
    return jobs_of(options, settings_of(options, arguments))


@pytest.mark.parametrize(
    ("arguments", "path", "targets"),
    [
        ("painting.exr --lights groups.exr", "groups.exr", ["painting.exr"]),
        ("a.exr b.exr --lights groups.exr", "groups.exr", ["a.exr", "b.exr"]),
        ("a.exr --lights with,comma.exr", "with,comma.exr", ["a.exr"]),
        ("a.exr --lights key", "key", ["a.exr"]),
        ("groups.exr a.exr", "groups.exr", ["a.exr"]),
        ("key a.exr", "key", ["a.exr"]),
    ],
)
@pytest.mark.usefixtures("folder")
def test_light_groups_by_either_spelling(arguments: str, path: str, targets: list[str]):
    options = _options(*arguments.split())
    # A painting may lie in the folder of the lights.
    assert basis_of(options) == GroupsFile(path, leave_out=tuple(targets))
    assert options.targets == targets


@pytest.mark.parametrize(
    ("arguments", "basis"),
    [
        ("scene.xml painting.exr", None),
        ("scene.xml painting.exr --lights key,window_*", None),
        ("scene.xml painting.exr --lights key", None),  # though there is such a folder
        ("a.basis.exr painting.exr", BasisFile("a.basis.exr")),
        ("missing.exr painting.exr", BasisFile("missing.exr")),  # which reading it will say
    ],
)
@pytest.mark.usefixtures("folder")
def test_everything_else_is_what_it_was(arguments: str, basis: BasisFile | None):
    assert basis_of(_options(*arguments.split())) == basis


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("painting.exr --lights nowhere.exr", "no such file .* nowhere.exr"),
        ("painting.exr --lights a.basis.exr", "holds no light groups"),
        ("scene.xml p.exr --pattern {name}", "--pattern names the layers"),
        ("groups.exr p.exr --lights a,b", "--lights a,b chooses lights of a scene.* --lock NAME"),
    ],
)
@pytest.mark.usefixtures("folder")
def test_slips_are_said(arguments: str, message: str):
    with pytest.raises(BasisError, match=message):
        basis_of(_options(*arguments.split()))


@pytest.mark.usefixtures("folder")
def test_the_mask_is_no_light_either():
    source = basis_of(_options("a.exr", "--mask", "m.exr", "--lights", "key"))
    assert source == GroupsFile("key", leave_out=("a.exr", "m.exr"))


@pytest.mark.parametrize("name", ["groups", "groups.exr.tmp", "groups.EXR"])
@pytest.mark.parametrize("arguments", ["{} a.exr", "a.exr --lights {}"])
def test_light_groups_are_known_by_how_they_begin(folder: Path, name: str, arguments: str):
    (folder / "groups.exr").rename(folder / name)
    source = basis_of(_options(*arguments.format(name).split()))
    assert source == GroupsFile(name, leave_out=("a.exr",))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (lambda c: c[:200], r"^x\.exr is cut off or damaged in its header: export it again$"),
        (
            lambda c: c[:40] + b"\xff" * 60 + c[100:],
            r"^x\.exr is cut off or damaged in its header \(.*ttribute.*\): export it again$",
        ),
        (lambda c: c[:-50], r"^x\.exr is .*(cut off|damaged)"),
        (lambda c: b"", r"^x\.exr is empty: expected an? "),
        (lambda c: b"\x89PNG\r\n\x1a\n" + c[8:], r"^x\.exr is a PNG file"),
    ],
)
@pytest.mark.parametrize("arguments", ["x.exr painting.exr", "painting.exr --lights x.exr"])
def test_what_is_wrong_with_a_file_is_said(
    folder: Path, content: Any, message: str, arguments: str
):
    (folder / "x.exr").write_bytes(content((folder / "groups.exr").read_bytes()))
    with pytest.raises((BasisError, ImageError)) as raised:
        _jobs(*arguments.split())
    assert re.search(message, str(raised.value)), raised.value


@pytest.mark.parametrize(
    ("arguments", "option"),
    [
        ("--spp 64", "--spp"),
        ("--refine 1 --correct-noise", "--refine, --correct-noise"),
        ("--time 3", "--time"),
        ("--quality final", "--quality"),
        ("--target a=b", "--target"),
        ("--group a=b", "--group"),
        ("--unit 100", "--unit"),
        ("-s 1 -D a=b -m x", "-s, -D, -m"),
    ],
)
@pytest.mark.usefixtures("folder")
def test_options_that_need_a_renderer_are_refused(arguments: str, option: str):
    painting = [] if "--target" in arguments else ["painting.exr"]
    with pytest.raises(BasisError) as refusal:
        _jobs("groups.exr", *painting, *arguments.split())
    assert spoken(refusal.value.sentence).startswith(f"{option} cannot be used with groups.exr")


@pytest.mark.usefixtures("folder")
def test_groups_are_read_with_their_pattern():
    [job] = _jobs("painting.exr", "--lights", "groups.exr")
    assert job.groups.basis.names == ("a", "b", "c")
    [job] = _jobs("painting.exr", "--lights", "groups.exr", "--pattern", "RGBA_{name}")
    assert job.groups.renderer == "pattern RGBA_{name}"


def test_holes_are_taken_from_the_painting(tmp_path: Path):
    images = pictures()
    images[0, 1, 2] = np.nan
    layers = {f"RGBA_{name}": x for name, x in zip("abc", images, strict=True)}
    groups = read_light_groups(interleaved(tmp_path / "a.exr", layers))
    importance = np.ones(images.shape[1:3], np.float32)
    target = Target("t", images[1], importance, everything=True, not_finite=2)
    visible_target = target.without(groups.holes)
    assert (visible_target.importance == 0).sum() == 1
    assert visible_target.importance[1, 2] == 0
    assert visible_target.not_finite == 3
    assert visible_target.without(groups.holes) is visible_target


@pytest.mark.parametrize(
    "name",
    [
        *("", ".", "..", "a/b", "/tmp/x", "../x", "a\0b", "a\nb", "a\r", "\x1b[31ma", "\x7f"),
        *("\u202eabc", "\x9b", "x" * 300, "ü" * 130),
    ],
)
def test_a_target_that_names_no_folder(tmp_path: Path, make_basis: Any, name: str):
    lighting = Lighting.current(make_basis(2)).for_target(name)
    write_lighting(tmp_path / "l.json", lighting)
    write_lighting(tmp_path / "m.json", lighting.for_target("good"))
    if name:  # which is then called as its file is
        refusal = run_refused(tmp_path, "relight", "scene.xml", "l.json")
        assert "cannot be the name of a folder: choose one with -o" in refusal
        assert len(refusal) < 600
        several = run_refused(tmp_path, "relight", "scene.xml", "l.json", "m.json", "-o", "looks")
        assert "cannot be the name of a folder: solve it alone, with -o" in several
    # Named otherwise, it is only looked for where it is not.
    assert "no such scene" in run_refused(tmp_path, "relight", "gone.xml", "l.json", "-o", "there")


def test_numbers_beyond_any_light_are_one_line(tmp_path: Path, make_basis: Any):
    basis = make_basis(2, names=["a", "b"])
    write_basis(tmp_path / "b.basis.exr", basis)
    write(
        tmp_path / "p.exr", ("rgb", channels("", pictures()[0][: basis.size[0], : basis.size[1]]))
    )
    write_lighting(tmp_path / "l.json", Lighting.current(basis).for_target("x"))
    data = json.loads((tmp_path / "l.json").read_text(encoding="utf-8"))
    room = write_room(tmp_path)
    for key in ("emission", "weight", "unit_flux", "standard_error"):
        for huge in (1e39, 1e31, 1e308):
            light = {**data["lights"]["a"], key: [1, huge, 1]}
            bent = {**data, "lights": {**data["lights"], "a": light}}
            (tmp_path / "huge.json").write_text(json.dumps(bent), encoding="utf-8")
            refusal = run_refused(tmp_path, "relight", room, "huge.json")
            assert "huge.json" in refusal
            assert "from 0 to 1e+30" in refusal
    toml = tmp_path / "huge.toml"
    for constraint in (
        "lock = 1e39",
        "lock = [1, 1e39, 1]",
        "limits = {max = 1e39}",
        'lock = "1e41%"',
    ):
        toml.write_text(f"[light.a]\n{constraint}\n", encoding="utf-8")
        refusal = run_refused(tmp_path, "solve", "b.basis.exr", "p.exr", "--lights-file", toml)
        assert "at most 1e+30" in refusal
    for option in ("--unit", "--unpainted", "--prefer-current"):
        assert "<= 1e+30" in run_refused(tmp_path, "solve", "b.basis.exr", "p.exr", option, "1e39")


#: Options with a number in Arabic digits, which Python takes for numbers.
OTHER_DIGITS = (
    ("--hold", "٣"),
    ("--exposure", "٣"),
    ("--exposure", "nan"),
    ("--verify-spp", "٣٢"),
    ("--lock", "a=٣"),
    ("--limit", "a=٣:"),
    ("--kelvin", "a=٣٠٠٠"),
    ("--max-miss", "٣%"),
    ("--hold", "1_0"),
)


@pytest.mark.parametrize(("option", "value"), OTHER_DIGITS)
def test_numbers_are_written_in_plain_digits(
    tmp_path: Path, make_basis: Any, option: str, value: str
):
    basis = make_basis(2, names=["a", "b"])
    write_basis(tmp_path / "b.basis.exr", basis)
    write(
        tmp_path / "p.exr", ("rgb", channels("", pictures()[0][: basis.size[0], : basis.size[1]]))
    )
    assert option in run_refused(tmp_path, "solve", "b.basis.exr", "p.exr", option, value)
