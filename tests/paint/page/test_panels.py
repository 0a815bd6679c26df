"""The side panels: the lights stay in view, and the order of panels is the person's own."""

from typing import Any

import pytest
from axe import violations
from painter_page import Painter

#: The window of a common laptop.
LAPTOP = {"width": 1440, "height": 900}

DEFAULT = ["Colour", "Adjust by numbers", "Layers", "Lights", "History", "Scopes", "Analysis"]

MODULE = "async (given) => { const m = await import('/ui/panels/panel_order.js');"


def titles(painter: Painter) -> list[str]:
    """Return the titles of the panels, from top to bottom as they are seen."""
    painter.still()
    heads = painter.page.locator(".side .fold-head h2").all()
    boxes = [(head.bounding_box()["y"], head.inner_text()) for head in heads]
    assert boxes == sorted(boxes)  # as they are read
    return [text for _, text in boxes]


def visible_lights(painter: Painter) -> list[str]:
    """Return the lights whose row is wholly in view."""
    painter.still()
    names: list[str] = painter.page.evaluate(
        """() => [...document.querySelectorAll('.light')].filter((row) => {
          const box = row.getBoundingClientRect();
          const places = [box.top + 3, box.bottom - 3].map((y) =>
            document.elementFromPoint(box.left + box.width / 2, y));
          return places.every((found) => row.contains(found));
        }).map((row) => row.dataset.light ?? row.getAttribute('aria-label'))"""
    )
    return names


@pytest.mark.nightly
def test_lights_are_in_view_at_1440x900(new_painter: Any) -> None:
    """As the page opens; and with ten layers, one of them unfolded, a selection and a history."""
    painter = new_painter("lights=12", viewport=LAPTOP)
    assert len(visible_lights(painter)) >= 4
    painter.page.evaluate("() => engine.makeLayers(10)")
    painter.page.evaluate("() => painter.store.set({ openLayer: 9, tool: 'select' })")
    assert len(visible_lights(painter)) >= 2
    for name in ("History", "Selection", "Adjust by numbers"):
        painter.button(name, exact=True).click()
    assert len(visible_lights(painter)) >= 2
    # What lies behind them can be scrolled to.
    field = painter.page.locator(".is-select .button", has_text="Select").last
    field.focus()
    painter.still()
    hit = "(one) => { const box = one.getBoundingClientRect(); return one.contains("
    hit += "document.elementFromPoint(box.left + 5, box.top + 5)); }"
    assert field.evaluate(hit)


@pytest.mark.nightly
def test_panels_are_moved_by_key_and_by_drag_and_stay_there(new_painter: Any) -> None:
    painter = new_painter(viewport=LAPTOP)
    assert titles(painter) == DEFAULT
    lights = painter.page.locator(".is-lights .fold-head h2 button")
    lights.focus()
    for _ in range(2):
        lights.press("Alt+ArrowUp")
        painter.still()
    assert titles(painter) == [
        "Colour",
        "Lights",
        "Adjust by numbers",
        "Layers",
        "History",
        "Scopes",
        "Analysis",
    ]
    assert lights.evaluate("(one) => one === document.activeElement")
    assert painter.page.get_by_text("Lights: 2 of 7 panels").count() == 1
    head = painter.page.locator(".is-truth .fold-head h2").bounding_box()
    target = painter.page.locator(".is-colour .fold-head").bounding_box()
    painter.page.mouse.move(head["x"] + 60, head["y"] + 10)
    painter.page.mouse.down()
    painter.page.mouse.move(head["x"] + 60, head["y"] - 40, steps=4)
    painter.page.mouse.move(target["x"] + 60, target["y"] + 4, steps=4)
    painter.page.mouse.up()
    assert titles(painter)[:2] == ["Analysis", "Colour"]
    assert not painter.ui("open")["truth"]  # the drag unfolds nothing
    painter.page.reload()
    painter.page.wait_for_selector(".lightpaint .tag")
    assert titles(painter)[:3] == ["Analysis", "Colour", "Lights"]
    painter.button("Solve settings").click()
    painter.button("Order as at first").click()
    painter.page.keyboard.press("Escape")
    assert titles(painter) == DEFAULT


@pytest.mark.nightly
def test_escape_ends_the_drag_of_a_panel(new_painter: Any) -> None:
    painter = new_painter(viewport=LAPTOP)
    head = painter.page.locator(".is-truth .fold-head h2").bounding_box()
    painter.page.mouse.move(head["x"] + 60, head["y"] + 10)
    painter.page.mouse.down()
    painter.page.mouse.move(head["x"] + 60, 60, steps=4)
    assert painter.page.locator("[data-drop]").count() == 1
    painter.page.keyboard.press("Escape")
    assert painter.page.locator("[data-drop]").count() == 0
    painter.page.mouse.up()
    assert titles(painter) == DEFAULT


@pytest.mark.parametrize(
    ("names", "order", "expected"),
    [
        ("abcd", "", "abcd"),
        ("abcd", "dcba", "dcba"),
        ("abcd", "dba", "dbca"),  # one that an older page lacked, after the one before it
        ("abcd", "zcx", "abcd"),  # others' names are skipped
        ("bd", "dcba", "db"),
    ],
)
def test_unknown_panels_follow_their_neighbours(
    page: Any, names: str, order: str, expected: str
) -> None:
    ordered = page.evaluate(
        MODULE + "return m.orderedNames(...given); }", [list(names), list(order)]
    )
    assert "".join(ordered) == expected


def test_hidden_panels_keep_their_place(page: Any) -> None:
    """One that is shown for a while, such as that of a selection, is not lost by a move."""
    moved = page.evaluate(
        MODULE + "return m.withPanelBefore(...given); }", [list("pqrs"), list("pqs"), "s", "p"]
    )
    assert moved == list("spqr")
    steps = page.evaluate(
        MODULE + "return [-1, 1].map((k) => m.withPanelStepped([], ...given, k)); }",
        [list("abc"), "a"],
    )
    assert steps == [None, list("bac")]


@pytest.mark.nightly
def test_axe_finds_nothing_in_panels_with_grips(new_painter: Any, axe: str) -> None:
    painter = new_painter(axe=axe, viewport=LAPTOP)
    painter.page.locator(".is-history .fold-head").hover()
    assert violations(painter.page, ".side") == []
