"""The tour: it greets a person once, never stands in the way, and comes when it is called."""

from typing import Any

import pytest
from axe import violations
from nightly import nightly
from painter_page import Painter

BUBBLE = ".tour"


def title(painter: Painter) -> str:
    painter.still()
    return str(painter.page.locator(f"{BUBBLE} h2").inner_text())


def is_within(painter: Painter) -> bool:
    return bool(
        painter.page.evaluate(
            """() => {
              const [a, b] = ['.tour', '.lightpaint'].map((where) =>
                document.querySelector(where).getBoundingClientRect());
              return a.left >= b.left && a.top >= b.top
                && a.right <= b.right && a.bottom <= b.bottom;
            }"""
        )
    )


@pytest.mark.nightly
@pytest.mark.parametrize("size", [(1280, 720), nightly((820, 1180))])
def test_five_steps_greet_a_person_once(new_painter: Any, axe: str, size: Any) -> None:
    viewport = {"width": size[0], "height": size[1]}
    painter: Painter = new_painter("tour&lights=5", axe=axe, viewport=viewport)
    titles = []
    for number in range(5):
        titles.append(title(painter))
        assert f"Step {number + 1} of 5" in painter.page.locator(BUBBLE).inner_text()
        assert is_within(painter)
        ring = painter.page.locator(".tour-ring").bounding_box()
        assert min(ring["width"], ring["height"]) > 20
        if number == 2:
            assert violations(painter.page, ".lightpaint") == []
        painter.button("Done" if number == 4 else "Next", exact=True).click()
    assert len(set(titles)) == 5
    assert painter.page.locator(BUBBLE).count() == 0
    painter.page.reload()
    painter.page.wait_for_selector(".lightpaint .tag")
    painter.still()
    assert painter.page.locator(BUBBLE).count() == 0


@pytest.mark.nightly
def test_one_paints_below_it_and_escape_ends_it(new_painter: Any) -> None:
    painter: Painter = new_painter("tour")
    painter.page.locator(BUBBLE).wait_for()
    painter.stroke()
    assert painter.calls("begin")
    assert painter.page.locator(BUBBLE).count() == 1
    painter.page.keyboard.press("Escape")
    painter.still()
    assert painter.page.locator(BUBBLE).count() == 0


@pytest.mark.nightly
def test_it_folds_again_what_it_unfolded(new_painter: Any) -> None:
    painter: Painter = new_painter("tour")
    painter.page.locator(BUBBLE).wait_for()
    fields = painter.page.locator(".fold.is-ask").get_by_role("button", name="Apply")
    assert not fields.is_visible()
    for _ in range(2):
        painter.button("Next", exact=True).click()
    assert fields.is_visible()
    for name in ("Next", "Next", "Done"):
        painter.button(name, exact=True).click()
    assert not fields.is_visible()


@pytest.mark.nightly
def test_by_keyboard_alone(new_painter: Any) -> None:
    painter: Painter = new_painter("tour")
    bubble = painter.page.locator(BUBBLE)
    assert bubble.locator("[aria-live]").count() == 1
    first = title(painter)
    # It takes no focus from the painting; Tab reaches it.
    assert not painter.page.evaluate("() => document.activeElement.closest('.tour')")
    painter.button("Next", exact=True).focus()
    painter.page.keyboard.press("Enter")
    second = title(painter)
    painter.page.keyboard.press("ArrowRight")
    assert title(painter) not in (first, second)
    painter.page.keyboard.press("ArrowLeft")
    assert title(painter) == second
    painter.page.keyboard.press("Escape")
    painter.still()
    assert bubble.count() == 0
    assert painter.ui("tool") == "brush"


@pytest.mark.nightly
def test_it_is_called_again_from_settings_and_shortcuts(new_painter: Any) -> None:
    painter: Painter = new_painter()
    assert painter.page.locator(BUBBLE).count() == 0  # nobody asked for it
    painter.button("Solve settings").click()
    painter.button("Show the tour").click()
    assert title(painter) == "Paint how it should look"
    painter.button("End the tour").click()
    painter.page.evaluate("() => painter.store.set({ panel: null, dialog: 'keys' })")
    painter.button("Show the tour").click()
    assert title(painter) == "Paint how it should look"
    assert painter.ui("dialog") is None


def test_a_small_painter_has_no_tour(new_painter: Any) -> None:
    painter: Painter = new_painter("tour", viewport={"width": 700, "height": 400})
    painter.still()
    assert painter.page.locator(BUBBLE).count() == 0
    assert painter.ui("hasSeenTour") is False
