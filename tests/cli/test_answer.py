"""What a solve prints: for people, in 80 columns, and colours only where a terminal has them."""

import re
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from command import run, succeed
from light_groups import interleaved, pictures
from rich.cells import cell_len

from lightpaint.basis.file.basis_file import write_basis
from lightpaint.basis.lights import BasisLight
from lightpaint.cli import main
from lightpaint.cli.commands.answer_text import _limit_sentences, _sentences, change
from lightpaint.cli.options.job_options import BY_OPTION
from lightpaint.cli.output import terminal
from lightpaint.cli.output.vocabulary import spoken
from lightpaint.images.formats.exr import write_rgb
from lightpaint.images.formats.png import png_bytes
from lightpaint.lighting.analysis.appearance.color_choices import ColorChoice
from lightpaint.lighting.analysis.appearance.limiting_reasons import Loosening, Reason
from lightpaint.lighting.answer.lighting import LightSetting
from lightpaint.lighting.constraints.constraint_table import Constraints

CURRENT = [[0.5, 0.5, 0.5], [0.4, 0.3, 0.2], [0.2, 0.3, 0.4], [0, 0, 0]]
WEIGHTS = np.array([[1, 1, 1], [0, 0, 0], [0.2, 0.3, 0.4], [0.6, 0.2, 0.1]], np.float32)
NAMES = ("key", "a lamp with a name that goes on and on, as those of exporters do", "fill", "red")
SOLVE = ("solve", "b.basis.exr", "p.exr", "-o", "out", "--no-correct-noise")


@pytest.fixture
def folder(tmp_path: Path, make_basis: Any) -> Path:
    """Four lights, and a painting that they make."""
    basis = make_basis(4, (16, 20), names=NAMES, emission=CURRENT)
    write_basis(tmp_path / "b.basis.exr", basis)
    write_rgb(tmp_path / "p.exr", basis.mix(WEIGHTS))
    return tmp_path


def _row(output: str, name: str) -> str:
    [row] = [line for line in output.splitlines() if line.startswith(name)]
    return row


def test_the_table_is_in_stops_and_fits_80_columns(folder: Path):
    output = succeed(folder, *SOLVE)
    lines = output.splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith("light "))
    # With room for the swatch.
    assert max(cell_len(line) for line in lines[start : start + 5]) <= 77
    assert _row(output, "key").split()[1:4] == ["+1.0", "6504", "K"]
    assert _row(output, "a lamp").split("…")[1].split()[0] == "off"
    assert _row(output, "fill").split()[1] == "0.0"
    assert _row(output, "red").split()[1] == "on"
    assert not re.search(r"W/|\bplugin\b|KKT|RMS", output)
    full = succeed(folder, *SOLVE, "--table", "full")
    for word in (NAMES[1], "plugin", "emission now", "unit"):
        assert word in full


def test_the_headline_comes_first_and_the_folder_last(folder: Path):
    lines = succeed(folder, *SOLVE).strip().splitlines()
    assert lines[0].startswith("Close: it looks as painted.")
    assert lines[-1] == "results in out/"


@pytest.mark.parametrize(
    ("isatty", "variables", "swatches"),
    [
        (True, {"COLORTERM": "truecolor"}, 3),
        (True, {"COLORTERM": "24bit", "NO_COLOR": ""}, 3),
        (True, {"COLORTERM": "truecolor", "NO_COLOR": "1"}, 0),
        (True, {}, 0),
        (False, {"COLORTERM": "truecolor"}, 0),
    ],
)
def test_swatches_only_where_the_terminal_has_colours(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    isatty: bool,
    variables: dict[str, str],
    swatches: int,
):
    monkeypatch.chdir(folder)
    for name in ("COLORTERM", "NO_COLOR"):
        monkeypatch.delenv(name, raising=False)
    for name, value in {**variables, "COLUMNS": "80", "TERM": "xterm"}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys.stdout, "isatty", lambda: isatty)
    assert main([*SOLVE]) == 0
    output = capsys.readouterr().out
    assert len(re.findall(r"\x1b\[38;2;\d+;\d+;\d+m██\x1b\[0m ", output)) == swatches
    assert (output.count("\x1b") > 0) == (swatches > 0)
    if isatty:
        plain = re.sub(r"\x1b\[[\d;]*m", "", output)
        assert max(map(cell_len, plain.splitlines())) <= 80


def test_a_swatch_is_the_colour_that_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    table = terminal.table("light")
    table.row("lamp")
    monkeypatch.setattr(terminal, "has_truecolour", lambda: True)
    terminal.print_table(table, ["#ff8000"])
    assert capsys.readouterr().out.splitlines() == [
        "   light",
        "\x1b[38;2;255;128;0m██\x1b[0m lamp",
    ]


def test_of_many_lights_the_ten_that_matter_and_what_the_others_do(tmp_path: Path, make_basis: Any):
    rng = np.random.default_rng(2)
    power = np.where(np.arange(125) % 13 == 5, 1, 0.01)[:, None, None, None]
    names = [f"light_{k:03d}" for k in range(125)]
    images = power * rng.random((125, 8, 40, 3))
    basis = make_basis(images=images, names=names, emission=[[0.1] * 3] * 125)
    write_basis(tmp_path / "b.basis.exr", basis)
    write_rgb(tmp_path / "p.exr", basis.mix(np.full((125, 3), 0.2)))
    output = succeed(tmp_path, *SOLVE)
    rows = [line for line in output.splitlines() if line.startswith("light_")]
    assert [row.split()[0] for row in rows] == [f"light_{k:03d}" for k in range(5, 125, 13)]
    [rest] = [line for line in output.splitlines() if line.startswith("and 115 more")]
    listed_share = sum(float(re.findall(r"([\d.]+) %", row)[-1]) for row in rows)
    stated_share = float(re.findall(r"together ([\d.]+) % of the picture", rest)[0])
    assert listed_share + stated_share == pytest.approx(100, abs=1.2)
    counts = re.findall(r"(\d+) (?:off|switched|fixed|brighter|dimmer|as)", rest)
    assert sum(map(int, counts)) == 115


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ((), "The painting is fitted literally: linear light, nothing held, any colour."),
        (
            ("--space", "display", "--hold", "0.5", "--colors", "gentle", "--mask", "m.png"),
            # Most of the painting is brighter than middle grey, a quarter brighter than white.
            "Fitted as the eye sees it (srgb at -1.2 stops); unpainted parts are held (0.5 times "
            "the weight of the paint); "
            "lights are pulled to their own colour (gentle); --literal turns this off.",
        ),
        (("--colors", "white"), "Lights are white; --literal turns this off."),
        (
            ("--unpainted", "0.1", "--mask", "m.png"),
            "Each unpainted pixel counts 0.1 times a painted one; --literal turns this off.",
        ),
    ],
)
def test_one_line_says_what_else_was_asked(folder: Path, options: tuple[str, ...], sentence: str):
    mask = np.full((16, 20, 3), 255, np.uint8)
    mask[:2] = 0
    (folder / "m.png").write_bytes(png_bytes(mask))
    assert sentence in succeed(folder, *SOLVE, *options).splitlines()


def test_a_picture_of_eight_bits_says_what_it_was_fitted_in(folder: Path):
    (folder / "p.png").write_bytes(png_bytes(np.full((16, 20, 3), 120, np.uint8)))
    output = succeed(folder, "solve", "b.basis.exr", "p.png", "-o", "out")
    [line] = [x for x in output.splitlines() if "--literal" in x]
    output = "Fitted as the eye sees it (srgb); lights are pulled to their own colour (gentle)"
    assert line.startswith(output)


def test_one_line_says_what_the_painting_leaves_open(tmp_path: Path, make_basis: Any):
    images = np.random.default_rng(1).random((5, 8, 8, 3))
    images[1] = images[0]
    images[2], images[3, :, :4] = 0, 0
    names = ["one", "twin", "dark", "right", "key"]
    write_basis(tmp_path / "b.basis.exr", make_basis(images=images, names=names))
    write_rgb(tmp_path / "p.exr", images.sum(axis=0).astype(np.float32))
    mask = np.zeros((8, 8, 3), np.uint8)
    mask[:, :4] = 255
    (tmp_path / "m.png").write_bytes(png_bytes(mask))
    completed = run(tmp_path, *SOLVE, "--mask", "m.png")
    assert completed.returncode == 0, completed.stderr
    [line] = [x for x in completed.stderr.splitlines() if "leaves lights open" in x]
    for words in (
        "the picture shows nothing of dark: left unchanged",
        "no painted pixel sees right: left unchanged",
        "one and twin light the painted part alike",
    ):
        assert words in line
    assert "left unchanged" not in completed.stderr.replace(line, "")


def test_other_colours_are_offered_once():
    """By the line that says which lamp turns; both would have the same ΔE."""
    white, green = (1.0, 1.0, 1.0), (0.5, 1.2, 0.5)
    choices = tuple(
        ColorChoice(colors, colors == "gentle", delta_e, "lamp", white, green, np.ones((1, 3)))
        for colors, delta_e in (("free", 4.6), ("gentle", 5.9))
    )
    reason = Reason("colors", (), 0.12, delta_e=(5.9, 4.6))
    appearance = SimpleNamespace(
        reasons=(reason,), reasons_wish="", is_close=False, compensating_lights=()
    )
    constraints = SimpleNamespace(constraints=Constraints())
    look = SimpleNamespace(
        solution=SimpleNamespace(problem=constraints),
        analysis=SimpleNamespace(appearance=appearance, color_choices=choices),
    )
    told = _sentences(look, "short")  # type: ignore[arg-type]
    assert told == [
        "Other colours come closer: --colors free: ΔE 4.6 instead of 5.9, but lamp turns green."
    ]
    alone = replace(choices[0], delta_e=5.8), choices[1]
    look.analysis.color_choices = alone
    told = _sentences(look, "short")  # type: ignore[arg-type]
    assert [spoken(sentence) for sentence in told] == [
        "Lights keep their colours; --colors free would bring the mean ΔE from 5.9 to 4.6."
    ]


def _setting(r: float, g: float, b: float) -> LightSetting:
    return LightSetting("x", "area", "radiance", "W/(m² sr)", (r, g, b), (r, g, b))


@pytest.mark.parametrize(
    ("current", "new", "sentence"),
    [
        ((1.0, 1.0, 1.0), (2, 2, 2), "+1.0"),
        ((1.0, 1.0, 1.0), (0.5, 0.5, 0.5), "−1.0"),
        ((1.0, 1.0, 1.0), (1.01, 1, 1), "0.0"),
        ((0.0, 0.0, 0.0), (1, 1, 1), "on"),
        ((1.0, 1.0, 1.0), (0, 0, 0), "off"),
        ((1.0, 1.0, 1.0), (1e-6, 0, 0), "off"),
        ((0.0, 0.0, 0.0), (0, 0, 0), "off"),
    ],
)
def test_what_became_of_a_light(current: Any, new: Any, sentence: str):
    light = BasisLight("x", "area", "radiance", "W/(m² sr)", current)
    assert change(light, _setting(*new)) == sentence
    assert change(light, replace(_setting(*new), reached=(False,) * 3)) == "unchanged"


@pytest.mark.parametrize(
    ("reason", "option_place", "line"),
    [
        (Reason("off", ("cove",), 0.57), BY_OPTION, ": leave out --off co*."),
        (Reason("limits", ("key",), 0.5), BY_OPTION, ": leave out --limit key."),
        (
            Reason("off", ("cove",), 0.57),
            "room.toml",
            "57 % of the difference from the painting.",
        ),  # of a lights file
        (Reason("hold", loosening=Loosening(0.8, 0.35, None)), "", "(--hold 0.8) would remove"),
        (
            Reason("hold", loosening=Loosening(0.8, 0.35, None, (9.14, 6.0), 4.0)),
            "",
            "(--hold 0.8 instead of 4) would bring the mean ΔE from 9.1 to 6.0.",
        ),
        (
            Reason("colors", (), 0.5),
            "",
            "; --colors free would remove 50 % of the difference from the painting.",
        ),
        (
            Reason("colors", (), 0.12, delta_e=(5.9, 4.5)),
            "",
            "; --colors free would bring the mean ΔE from 5.9 to 4.5.",
        ),
    ],
)
def test_what_holds_the_lights_is_said_with_its_option(
    reason: Reason, option_place: str, line: str
):
    constraint_words = {"co*": {"off": True}, "key": {"limits": {"max": 1}}}
    constraints = Constraints.of(constraint_words, where=option_place)
    look = SimpleNamespace(
        solution=SimpleNamespace(problem=SimpleNamespace(constraints=constraints)),
        analysis=SimpleNamespace(appearance=SimpleNamespace(reasons=(reason,), reasons_wish="")),
    )
    [sentence] = _limit_sentences(look)  # type: ignore[arg-type]
    assert line in spoken(sentence)


def test_factors_that_differ_are_a_colour(tmp_path: Path) -> None:
    """Light groups have no colour of their own; the column was empty."""
    images = pictures(2)
    layers = {f"RGBA_{name}": x for name, x in zip(("key", "fill"), images, strict=True)}
    interleaved(tmp_path / "shot.exr", {"RGBA": images.sum(axis=0), **layers})
    write_rgb(tmp_path / "p.exr", images[0] * [1.5, 1, 0] + 0.5 * images[1])
    output = succeed(tmp_path, "solve", "shot.exr", "p.exr", "--literal")
    [key] = [line for line in output.splitlines() if line.startswith("key ")]
    [fill] = [line for line in output.splitlines() if line.startswith("fill ")]
    assert "× 1.5, 1, " in key
    assert "×" not in fill
