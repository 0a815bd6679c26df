"""A light that reaches what is painted in some channels only: nothing tells the others.

So it is of a lamp that shines on a teapot that reflects no blue. The channel stays as it was, and
nowhere is it taken for solved.
"""

import csv
import io
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from command import succeed

import lightpaint as lp
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.relit.export.exports import lights_table
from lightpaint.report.page.notebook_html import html_of

SIZE = (12, 10)
BEFORE = (0.4, 0.3, 0.2)


@pytest.fixture
def basis(make_basis: Any) -> lp.Basis:
    """`key` reaches all, `lamp` no blue, and `back` nothing; all with a little noise."""
    rng = np.random.default_rng(0)
    images = 0.1 + rng.random((3, *SIZE, 3))
    images[1, ..., 2] = 0
    images[2] = 0
    halves = 0.01 * rng.normal(size=images.shape) * images
    names, emission = ["key", "lamp", "back"], [BEFORE] * 3
    return make_basis(images=images, half_differences=halves, names=names, emission=emission)


@pytest.fixture
def target(basis: lp.Basis) -> lp.Target:
    return lp.Target.of(basis.images[0] + 0.5 * basis.images[1])


#: What a solve may be given that goes another way: through a display, or coupling the channels.
WAYS: dict[str, dict[str, Any]] = {
    "linear": {},
    "display": {"transform": lp.ViewTransform("srgb", 0.0)},
    "capped": {"constraints": lp.Constraints.of({"lamp": {"limits": {"max": 100.0}}})},
}


@pytest.mark.parametrize("way", WAYS)
def test_what_nothing_tells_stays_and_has_no_error(basis: lp.Basis, target: lp.Target, way: str):
    [analysis] = lp.analyse(lp.solve(basis, target, **WAYS[way]))
    key, lamp, back_light = analysis.solution.lighting.lights
    assert (key.reached, lamp.reached, back_light.reached) == (
        (True, True, True),
        (True, True, False),
        (False, False, False),
    )
    assert lamp.emission[:2] == pytest.approx((0.5, 0.5), rel=0.05)
    assert lamp.emission[2] == pytest.approx(BEFORE[2], rel=1e-6)
    assert back_light.emission == pytest.approx(BEFORE, rel=1e-6)
    assert analysis.solution.certificate.unreached == ("back",)
    for numbers in (lamp.standard_error, lamp.interval):
        assert [x is None for x in numbers] == [False, False, True]
    assert back_light.standard_error is None
    assert back_light.interval is None
    assert np.isnan(analysis.uncertainty.standard_error).tolist() == [
        [not numbers for numbers in light.reached] for light in (key, lamp, back_light)
    ]


def test_one_dimmer_is_told_by_any_channel(basis: lp.Basis, target: lp.Target):
    constraints = lp.Constraints.of({"lamp": {"color": [1, 1, 1]}}, tie=[["key", "back"]])
    [analysis] = lp.analyse(lp.solve(basis, target, constraints=constraints))
    for light in analysis.solution.lighting.lights:
        assert all(light.reached)
        assert None not in light.standard_error
    # What is told of red and green holds of blue.
    errors = analysis.uncertainty.standard_error[1]
    assert errors[2] == pytest.approx(errors[0])
    assert errors[2] > 0


def test_a_correction_and_strokes_know_it_too(basis: lp.Basis, target: lp.Target):
    solution = lp.correct_noise(lp.solve(basis, target, transform=lp.ViewTransform("srgb", 0.0)))
    assert solution.lighting["lamp"].reached == (True, True, False)


def test_files_say_null(basis: lp.Basis, target: lp.Target, tmp_path: Path):
    [analysis] = lp.analyse(lp.solve(basis, target))
    lighting = analysis.solution.lighting
    lp.write_lighting(tmp_path / "l.json", lighting)
    assert read_lighting(tmp_path / "l.json") == lighting
    data = json.loads((tmp_path / "l.json").read_text(encoding="utf-8"))["lights"]
    assert data["lamp"]["reached"] == [True, True, False]
    assert data["lamp"]["standard_error"][2] is None
    assert data["lamp"]["interval"][2] is None
    assert not {"hex", "cct_k", "duv"} & set(data["lamp"]["photometry"])
    assert data["back"]["reached"] == [False, False, False]
    assert not {"standard_error", "interval"} & set(data["back"])
    assert "reached" not in data["key"]
    assert "hex" in data["key"]["photometry"]
    # Who sets a light knows it.
    assert lighting.with_emission("lamp", (1.0, 1.0, 1.0))["lamp"].reached == (True, True, True)


def test_people_see_neither_a_colour_nor_an_error(
    basis: lp.Basis, target: lp.Target, tmp_path: Path
):
    lp.write_basis(tmp_path / "a.basis.exr", basis)
    write_rgb(tmp_path / "t.exr", target.image)
    solved = ("solve", "a.basis.exr", "t.exr", "-o", "out")
    [row] = [x for x in succeed(tmp_path, *solved).splitlines() if x.startswith("lamp")]
    assert "#" not in row
    assert " K" not in row
    output = succeed(tmp_path, *solved, "--table", "full")
    [row] = [line for line in output.splitlines() if line.startswith("lamp")]
    assert "0.2 (blue unchanged)" in row
    assert "#" not in row
    [row] = [line for line in output.splitlines() if line.startswith("back")]
    assert "(unchanged)" in row
    assert "±" not in row
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "no painted pixel shows the blue of lamp: left unchanged" in page
    [row] = [row for row in page.split("<tr>") if 'class="name">lamp' in row and "thumb" in row]
    assert "(0.2)" in row
    assert "background:" not in row
    assert "blue unchanged" in row


def test_notebooks_and_tables_for_others_show_it(basis: lp.Basis, target: lp.Target):
    solution = lp.solve(basis, target)
    for table in (solution, solution.lighting):
        [row] = [row for row in html_of(table).split("<tr>") if ">lamp<" in row]
        assert "background" not in row
    text = lights_table(SimpleNamespace(basis=basis, layers=()), solution.lighting)
    unreached = {row["light"]: row["unreached"] for row in csv.DictReader(io.StringIO(text))}
    assert unreached == {"key": "", "lamp": "B", "back": "RGB"}
