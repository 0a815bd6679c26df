"""What a prompt and a notebook show: one screen, one small page, at any number of lights."""

import io
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from light_groups import interleaved, pictures
from PIL import Image

import lightpaint as lp
from lightpaint.basis.light_basis import Basis
from lightpaint.lighting.analysis.answer_analysis import analyse
from lightpaint.lighting.problem import Problem
from lightpaint.pipeline.look import Look
from lightpaint.relit.verification import compare
from lightpaint.scene.mitsuba_scene import Scene

MANY = 120
NAUGHTY = "<script>alert('x')</script> & co"
#: Characters of a repr, and of a page.
SCREEN, PAGE = 1000, 60_000


def _look(basis: Basis) -> Look:
    half = np.zeros(basis.size, np.float32)
    half[:, : basis.size[1] // 2] = 1
    target = lp.Target.of(0.3 * basis.images.sum(axis=0), half, name=NAUGHTY)
    solution = lp.solve(basis, target)
    [analysis] = analyse(solution)
    predicted = lp.combine(basis, solution.lighting)
    verification = compare(predicted, predicted)
    return Look(target, basis, solution, predicted, None, verification, analysis)


@pytest.fixture(scope="module")
def many(make_basis: Any) -> Look:
    names = [f"chandelier_{k:03}_of_the_great_hall" for k in range(MANY)]
    noise = np.random.default_rng(2).normal(0, 1e-3, (MANY, 30, 40, 3))
    return _look(make_basis(MANY, (30, 40), names=names, half_differences=noise))


@pytest.fixture(scope="module")
def naughty(make_basis: Any) -> Look:
    return _look(make_basis(3, names=[NAUGHTY, "b", "c"]))


def _parts(look: Look) -> list[Any]:
    """Everything of it that a person may look at."""
    constraints = {f"{name}": {"lock": True} for name in look.basis.names}
    parts = [look, look.target, look.basis, look.solution, look.lighting, look.predicted]
    parts += [look.verification, look.analysis, look.diagnosis, look.uncertainty]
    parts += [look.solution.certificate, look.solution.problem, lp.Constraints.of(constraints)]
    return [*parts, Problem.of(look.basis, look.target, constraints=parts[-1])]


def test_reprs_fit_on_one_screen(many: Look, naughty: Look):
    for part in [*_parts(many), *_parts(naughty)]:
        text = repr(part)
        assert 20 < len(text) < SCREEN, (type(part), len(text), text)
        assert text.count("\n") < 24
    assert "closest there is" in repr(many.solution)
    assert "agrees" in repr(many.verification)
    assert "… and " in repr(many.lighting)
    assert "importance" not in repr(many.uncertainty)
    assert f"scatter=float64 ({MANY}, 3)" in repr(many.uncertainty)


def test_reprs_of_groups_jobs_and_settings(tmp_path: Path):
    layers = {f"RGBA_{name}": x for name, x in zip("abc", pictures(), strict=True)}
    groups = lp.read_light_groups(interleaved(tmp_path / "groups.exr", layers))
    job = lp.Job((), (lp.Target.of(pictures()[0]),), tmp_path / "out", groups)
    for part in (groups, job, lp.Settings()):
        assert 20 < len(repr(part)) < SCREEN, repr(part)


def test_pages_are_small_and_show_what_matters(many: Look):
    for part in (many, many.solution, many.lighting, many.verification):
        page = part._repr_html_()
        assert page is not None
        assert len(page) < PAGE, type(part)
    page = many.solution._repr_html_()
    assert page is not None
    assert page.count("<tr>") == 1 + 10
    assert f"and {MANY - 10} more" in page
    assert "closest there is" in page
    # Those that change the picture most.
    distances = np.abs(many.solution.weights - many.basis.current_weights) * many.basis.totals
    first = many.basis.names[int(np.argmax(distances @ [0.2126, 0.7152, 0.0722]))]
    assert f">{first}<" in page


def test_pictures_are_small_and_dim_what_is_not_painted(many: Look):
    sheet = many.basis._repr_png_()
    assert sheet is not None
    assert len(sheet) < 400_000
    assert Image.open(io.BytesIO(sheet)).size[0] < 800
    painting = many.target._repr_png_()
    assert painting is not None
    pixels = np.asarray(Image.open(io.BytesIO(painting)), np.float64)
    left, right = np.split(pixels, 2, axis=1)
    assert left.mean() > 1.5 * right.mean()
    assert np.ptp(right, axis=-1).max() == 0  # grey
    assert np.ptp(left, axis=-1).max() > 0
    # One is shown as a page or as a picture, not as both.
    for part in (many.basis, many.target):
        assert part._repr_html_() is None
    assert many.solution._repr_png_() is None


def test_names_stay_text(naughty: Look):
    for part in (naughty, naughty.solution, naughty.lighting):
        page = part._repr_html_()
        assert page is not None
        assert "<script" not in page
        assert "&lt;script&gt;" in page
    assert naughty.basis._repr_png_()


def test_a_scene_shows_its_lights(small_room: Scene):
    page = small_room._repr_html_()
    assert page is not None
    assert small_room._repr_png_() is None
    for light in small_room.lights:
        assert f">{light.name}</td>" in page
    assert "24 × 20 through camera" in page
    assert len(page) < PAGE


def test_to_be_shown_a_room_need_not_know_the_report():
    code = (
        "import sys, numpy as np, lightpaint as lp\n"
        "target = lp.Target.of(np.ones((4, 4, 3)))\n"
        "assert 'lightpaint.report.page.notebook_html' not in sys.modules\n"
        "assert target._repr_png_().startswith(b'\\x89PNG')\n"
        "assert 'mitsuba' not in sys.modules and 'IPython' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
