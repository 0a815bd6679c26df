"""Painted pixels in which the camera sees an emitter: which count, and what is said of the others.

A bulb is painted as bright as it is, on a wall that it would have to be 350 times as bright for.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import run, run_refused, succeed
from texel_grid import texel_names

import lightpaint as lp
from lightpaint.basis.lights import Lights
from lightpaint.images.formats.exr import ExrPart, rgb_channels, write_parts
from lightpaint.report.visible_emitters import emitter_remarks

SIZE = (12, 10)
TIMES = 350.0


@pytest.fixture
def basis(make_basis: Any) -> lp.Basis:
    """`sky` lights the wall evenly; `bulb` little, and is seen in four pixels."""
    emitter_mask = np.zeros(SIZE, bool)
    emitter_mask[5:7, 5:7] = True
    images = np.zeros((2, *SIZE, 3))
    images[0, :, :5] = 0.5
    images[1] = np.where(emitter_mask, 1.0, 0.01)[..., None]
    return make_basis(images=images, names=["sky", "bulb"], seen=emitter_mask)


@pytest.fixture
def image(basis: lp.Basis) -> Any:
    wall = basis.mix(np.array([[1.0] * 3, [TIMES] * 3]))
    return np.where(basis.emitters_seen[..., None], 1, wall).astype(np.float32)


def _said(basis: lp.Basis, target: lp.Target, **fit: Any) -> tuple[float, list[str]]:
    """How bright the bulb is, and what is said of it."""
    solution = lp.solve(basis, target, **fit)
    predicted = lp.combine(basis, solution.lighting)
    return solution.lighting["bulb"].emission[1], emitter_remarks(target, solution, predicted)


ALL, PAINTED = None, np.ones(SIZE)


@pytest.mark.parametrize(
    ("importance", "emitters", "counts"),
    [
        (ALL, "auto", False),
        (ALL, "count", True),
        (ALL, "skip", False),
        (PAINTED, "auto", True),
        (PAINTED, "count", True),
        (PAINTED, "skip", False),
    ],
)
def test_which_pixels_count(
    basis: lp.Basis, image: Any, importance: Any, emitters: str, counts: bool
):
    target = lp.Target.of(image, importance)
    times, remarks = _said(basis, target, emitters=emitters)
    if counts:
        assert times < 5
        assert remarks == []
        return
    assert times == pytest.approx(TIMES, rel=1e-4)
    remark, warning = remarks
    assert "4 of 120 painted pixels (3.3 %), and count nothing" in remark
    assert 'emitters="count"' in remark
    assert warning.startswith("WARNING")
    assert "bulb (350 times)" in warning


def test_a_wall_in_texels_is_named_once(make_basis: Any):
    """Each of its texels is seen in one pixel, and lights a quarter of the room."""
    images, seen = np.full((4, *SIZE, 3), 0.001), np.zeros(SIZE, bool)
    for k in range(4):
        images[k, 3 * k : 3 * k + 3] = 0.01
        images[k, 3 * k, 0], seen[3 * k, 0] = 1.0, True
    basis = make_basis(images=images, names=texel_names("led", (2, 2)), seen=seen)
    lights = Lights(tuple(replace(x, plugin="area") for x in basis.lights))
    basis = replace(basis, lights=lights)
    room = basis.mix(np.full((4, 3), TIMES))
    target = lp.Target.of(np.where(seen[..., None], 1, room).astype(np.float32))
    solution = lp.solve(basis, target)
    remarks = emitter_remarks(target, solution, lp.combine(basis, solution.lighting))
    [warning] = (x for x in remarks if "brighter than painted" in x)
    assert "led (3" in warning
    assert "led.x" not in warning


def test_a_bulb_as_painted_is_no_warning(basis: lp.Basis):
    target = lp.Target.of(basis.mix(np.array([[1.0] * 3, [2.0] * 3])))
    _, remarks = _said(basis, target)
    assert len(remarks) == 1
    assert "WARNING" not in remarks[0]


def test_where_brighter_is_as_good_nothing_is_too_bright(basis: lp.Basis, image: Any):
    at_least = np.broadcast_to(basis.emitters_seen[..., None], image.shape)
    target = lp.Target("t", image, np.ones(SIZE, np.float32), everything=True, at_least=at_least)
    _, remarks = _said(basis, target)
    assert len(remarks) == 1


def test_a_bulb_that_is_painted_black_is_a_warning(basis: lp.Basis, image: Any):
    black = np.where(basis.emitters_seen[..., None], 0, image)
    _, remarks = _said(basis, lp.Target.of(black))
    assert "bulb (painted black)" in remarks[1]


def test_emitters_that_rule_the_fit_are_named(basis: lp.Basis, image: Any):
    bright = np.where(basis.emitters_seen[..., None], 100, image)
    _, [remark] = _said(basis, lp.Target.of(bright, PAINTED))
    assert "of the painted energy and rule the fit" in remark
    assert 'emitters="skip"' in remark
    assert _said(basis, lp.Target.of(image, ~basis.emitters_seen))[1] == []


def test_nothing_left_is_an_error(basis: lp.Basis, image: Any):
    only = lp.Target.of(image, basis.emitters_seen)
    with pytest.raises(lp.LightpaintError, match=r'sees an emitter in every painted.*"count"'):
        lp.solve(basis, only, emitters="skip")
    lp.solve(basis, only)


def test_the_terminal_and_the_report_say_so(basis: lp.Basis, image: Any, tmp_path: Path):
    lp.write_basis(tmp_path / "a.basis.exr", basis)
    write_parts(tmp_path / "t.exr", [ExrPart("", rgb_channels(image))])
    completed = run(tmp_path, "solve", "a.basis.exr", "t.exr", "-o", "out")
    assert completed.returncode == 0
    assert "emitters are seen in 4 of 120 painted pixels (3.3 %)" in completed.stderr
    assert "--emitters count holds the emitters themselves" in completed.stderr
    assert "WARNING: brighter than painted where they are seen: bulb" in completed.stderr
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "emitters are seen in 4 of 120 painted pixels" in page
    assert "WARNING: brighter than painted" in page
    args = ("solve", "a.basis.exr", "t.exr", "-o", "counted", "--emitters", "count")
    completed = run(tmp_path, *args)
    assert "emitters are seen" not in completed.stderr
    page = (tmp_path / "counted" / "report.html").read_text(encoding="utf-8")
    assert "emitters are seen in" not in page
    assert "bulb" in succeed(tmp_path, *args[:-1], "skip")


def test_light_groups_know_of_no_emitters(tmp_path: Path, image: Any):
    channels = rgb_channels(image)
    write_parts(tmp_path / "g.exr", [ExrPart("ViewLayer.Combined_key", channels)])
    write_parts(tmp_path / "t.exr", [ExrPart("", channels)])
    message = run_refused(tmp_path, "solve", "g.exr", "t.exr", "--emitters", "count")
    assert "--emitters" in message


@pytest.mark.parametrize("untold", [True, False])
def test_a_bulb_that_is_known_by_sight_alone_can_be_told_so(
    basis: lp.Basis, image: Any, untold: bool
):
    """As one in a glass ball, whose light few paths find on walls."""
    target = lp.Target.of(image)
    solution = lp.solve(basis, target)
    lights = [replace(x, untold=untold) for x in solution.lighting.lights]
    solution = replace(solution, lighting=replace(solution.lighting, lights=tuple(lights)))
    remarks = emitter_remarks(target, solution, lp.combine(basis, solution.lighting))
    remarks_of_bulb = [text for text in remarks if "the camera sees it" in text]
    assert len(remarks_of_bulb) == untold
    assert all(
        "light of bulb on surfaces" in text for text in remarks_of_bulb
    )  # and nothing of the sky
