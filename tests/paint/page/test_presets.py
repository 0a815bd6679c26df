"""Presets at a click, about the object that was chosen."""

from typing import Any

import pytest
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


@pytest.mark.nightly
def test_pictures_that_come_move_nothing(painter: Painter) -> None:
    painter.page.evaluate(
        """() => {
          const { host } = window, fetch = host.fetch.bind(host), [height, width] = [18, 32];
          const picture = { data: new Uint8Array(3 * width * height), shape: [height, width, 3] };
          window.painter.store.set({ views: [{ name: 'camera', size: [height, width] }] });
          const sent = new Promise((send) => { window.sendPictures = () => send(picture); });
          host.fetch = (name) => (name.startsWith('preset/') ? sent : fetch(name));
        }"""
    )
    painter.button("Presets").click()
    items = painter.page.locator(".sheet button, .sheet canvas")
    before = [item.bounding_box() for item in items.all()]
    painter.page.evaluate("() => window.sendPictures()")
    drawn = "() => [...document.querySelectorAll('.sheet canvas')].every(({ width }) => width > 1)"
    painter.page.wait_for_function(drawn)
    assert before
    assert [item.bounding_box() for item in items.all()] == before
