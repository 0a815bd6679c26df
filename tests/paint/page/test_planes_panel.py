"""The panel of measuring planes: what it says, live, and how wishes are ignored."""

from typing import Any

import numpy as np
from axe import violations
from painter_page import Painter

CAMERA = {
    "origin": [0, 0, 0],
    "x_axis": [1, 0, 0],
    "y_axis": [0, 1, 0],
    "forward": [0, 0, 1],
    "is_parallel": False,
}

PLANES = {
    "planes": [
        {
            "name": "desk",
            "plane": "desk",
            "case": "",
            "size": [2, 3],
            "cells": [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1]],
            "points": [[0, 0, 1]] * 5,
            "sides": None,
            "seen": [[0, 1, 2, 3, 4]],
        }
    ],
    "floor_m2": 20.0,
    "budget_watts": 60.0,
    "cameras": [CAMERA],
}


def reading(mean: float, *, is_met: bool = True, **fields: Any) -> dict[str, Any]:
    wishes = [
        {"kind": "mean", "asked": 500, "reached": mean, "is_met": is_met, "to": ""},
        {"kind": "uniformity", "asked": 0.6, "reached": 0.5, "is_met": False, "to": ""},
    ]
    plane = {
        "mean": mean,
        "mean_error": 1.0,
        "uniformity": 0.5,
        "least": 0.0,
        "most": 1000.0,
        "lux": [0, 250, 500, 750, 1000],
        "wishes": wishes,
    }
    power = {"kind": "power", "asked": 60, "reached": 50, "is_met": True, "to": ""}
    given = {"watts": 50.0, "power": power, "is_required": True, "is_old": False}
    return {"planes": [plane], **given, **fields}


def measured(new_painter: Any, **options: Any) -> Painter:
    """A painter whose planes have been measured."""
    painter: Painter = new_painter(**options)
    painter.page.evaluate(
        "(given) => window.host.tell({ ...window.host.state(), ...given })",
        {"planes": PLANES, "reading": reading(512.3)},
    )
    painter.still()
    return painter


def test_without_planes_there_is_no_panel(new_painter: Any) -> None:
    painter = new_painter()
    assert painter.page.get_by_role("button", name="Planes", exact=True).count() == 0


def test_a_plane_says_what_it_gets_and_what_it_misses(new_painter: Any) -> None:
    painter = measured(new_painter)
    text = painter.page.locator(".plane").inner_text().split("\n")
    assert " ".join(text).split() == [
        *("desk", "Em", "512", "lx", "U0", "0.50"),
        *("✓", "500", "lx", "or", "more", "met", "✕", "U0", "0.60", "or", "more", "missed"),
    ]
    power = " ".join(painter.page.locator(".plane-power").inner_text().split())
    assert power == "Power 50 W, 2.5 W/m² ✓ 60 W at most met"
    name = "Illuminance on desk: 0 to 1000 lx"
    assert painter.page.get_by_role("img", name=name).count() == 1
    # Cells from the last row to the first, in the first and last colours of reports.
    codes = painter.page.locator(".plane canvas").evaluate(
        "(one) => [...one.getContext('2d').getImageData(0, 0, 3, 2).data]"
    )
    pixels = np.array(codes).reshape(2, 3, 4)
    assert pixels[1, 0].tolist() == [38, 14, 74, 255]
    assert pixels[0, 1].tolist() == [248, 230, 60, 255]
    assert pixels[0, 2].tolist() == [0, 0, 0, 0]


def test_numbers_follow_the_brush_and_say_that_lights_have_moved(new_painter: Any) -> None:
    painter = measured(new_painter)
    version = painter.ui("version") + 1
    new = reading(320.0, is_met=False, is_old=True)
    painter.tell(kind="answer", version=version, stroke=1, exact=False, reading=new, arrays={})
    painter.page.get_by_text("320").wait_for()  # panels come after pictures
    numbers = painter.page.locator(".plane-numbers").inner_text()
    assert "Em 320 lx" in " ".join(numbers.split())
    assert painter.page.locator(".plane-wish.is-missed").count() == 2
    note = painter.page.locator(".planes-note").inner_text()
    assert note.startswith("Lights have moved: these numbers are of before.")


def test_wishes_can_be_ignored(new_painter: Any) -> None:
    painter = measured(new_painter)
    painter.page.get_by_role("checkbox", name="Answers meet the wishes").uncheck()
    assert painter.requests("change_settings") == [
        {"kind": "change_settings", "settings": {"ignore_wishes": True}}
    ]


def test_axe_finds_nothing_in_planes(new_painter: Any, axe: str) -> None:
    painter = measured(new_painter, axe=axe)
    assert violations(painter.page, ".side") == []
