"""Presets at a click, about the object that was chosen."""

from typing import Any

from axe import violations
from painter_page import Painter


def test_a_click_asks_for_a_preset_about_the_chosen_object(new_painter: Any, axe: str) -> None:
    painter: Painter = new_painter("lights=5", axe=axe)
    painter.button("Presets").click()
    sheet = painter.page.locator(".sheet button")
    assert sheet.locator("strong").all_inner_texts() == ["Moonlight", "Only this object"]
    drawn = "() => [...document.querySelectorAll('.sheet canvas')].every(({ width }) => width > 1)"
    painter.page.wait_for_function(drawn)
    assert violations(painter.page, ".lightpaint") == []
    sheet.nth(0).click()
    painter.button("Presets").click()
    painter.choose("Subject", painter.ui("state")["objects"][0])
    sheet.nth(1).click()
    assert [(one["preset"], one["subject"]) for one in painter.requests("apply_preset")] == [
        ("moonlight", None),
        ("only_object", painter.ui("state")["objects"][0]),
    ]
    assert painter.ui("open")["layers"]
