"""The list of steps: where the painting stands, and any other state at a click."""

from typing import Any

import pytest
from axe import violations
from nightly import nightly
from painter_page import Painter


@pytest.fixture
def painter(new_painter: Any, axe: str) -> Painter:
    """A painter with its history open, after three strokes."""
    opened: Painter = new_painter(axe=axe)
    opened.button("History", exact=True).click()
    assert "Every step is listed here" in opened.page.locator(".is-history").inner_text()
    for _ in range(3):
        opened.stroke()
        opened.still()
    return opened


def rows(painter: Painter) -> list[tuple[str, str]]:
    """Name and state of each step, the topmost first."""
    painter.still()
    return [
        (row.locator(".step-label").inner_text(), row.get_attribute("class").removeprefix("step "))
        for row in painter.page.locator(".step").all()
    ]


@pytest.mark.nightly
def test_a_click_goes_to_a_step_and_what_is_undone_stays(painter: Painter) -> None:
    names = [name for name, _ in rows(painter)]
    assert names == ["Brush", "Brush", "Brush", "Beginning"]
    painter.page.locator(".step").nth(2).click()
    assert painter.requests("go_to_step") == [{"kind": "go_to_step", "step": 1}]
    assert [state for _, state in rows(painter)] == ["is-undone", "is-undone", "is-current", "step"]
    assert painter.page.locator(".step").nth(0).inner_text().count("undone") == 1
    # The step that it is at needs no request.
    painter.page.locator("[aria-current=step]").click()
    assert len(painter.requests("go_to_step")) == 1
    painter.page.locator(".step").nth(0).click()
    assert rows(painter)[0][1] == "is-current"
    painter.page.locator(".step").nth(3).click()
    assert painter.requests("go_to_step")[-1]["step"] == 0
    painter.stroke()
    assert [name for name, _ in rows(painter)] == ["Brush", "Beginning"]


@pytest.mark.nightly
def test_the_picture_of_the_last_step_follows_its_answer(painter: Painter) -> None:
    lit = """() => [...document.querySelectorAll('.step canvas')].map(({ width, height }, k, all) =>
      all[k].getContext('2d').getImageData(width / 2, height / 2, 1, 1).data[3])"""
    painter.page.wait_for_function(f"() => ({lit})().every((alpha) => alpha === 255)")


@pytest.mark.nightly
def test_clearing_and_starting_over_are_one_step_each(painter: Painter) -> None:
    painter.button("Start over").click()
    assert rows(painter)[0] == ("Start over", "is-current")
    assert painter.button("Clear painting").is_disabled()
    painter.page.evaluate("() => painter.store.set({ isPaintingEmpty: false })")
    painter.button("Clear painting").click()
    assert len(painter.requests("start_over")) == len(painter.requests("clear_painting")) == 1
    painter.button("Undo").click()
    assert rows(painter)[0] == ("Clear painting", "is-undone")


@pytest.mark.nightly
def test_many_steps_are_listed_in_parts_and_reduced_to_milestones(painter: Painter) -> None:
    painter.page.evaluate(
        "() => { for (let k = 0; k < 130; k += 1) window.host.step(`step ${k}`); }"
    )
    painter.stroke()
    assert len(rows(painter)) == 100
    earlier = painter.page.get_by_role("button", name="Earlier steps (34)")
    earlier.click()
    assert [name for name, _ in rows(painter)][-1] == "Beginning"
    assert len(rows(painter)) == 135
    painter.page.get_by_label("Milestones only").check()
    # Every twentieth, the beginning, and the current one.
    assert len(rows(painter)) == 8


@pytest.mark.nightly
@pytest.mark.parametrize("size", [(1280, 720), nightly((820, 1180))])
def test_nothing_in_the_history_is_cut_or_unnamed(painter: Painter, size: tuple[int, int]) -> None:
    painter.page.set_viewport_size({"width": size[0], "height": size[1]})
    painter.page.locator(".step").nth(1).click()
    painter.still()
    assert violations(painter.page, ".lightpaint") == []
    overflow = """() => {
      const right = (part) => part.getBoundingClientRect().right;
      const side = right(document.querySelector('.side'));
      const parts = [...document.querySelectorAll('.is-history, .is-history *')];
      return parts.filter((part) => right(part) > side + 0.5).length;
    }"""
    assert painter.page.evaluate(overflow) == 0


@pytest.mark.nightly
@pytest.mark.parametrize("by", ["key", "button", nightly("focus")])
def test_the_answer_before_the_last_step_shows_while_a_key_or_button_is_held(
    painter: Painter, by: str
) -> None:
    page, name = painter.page, "Answer before the last step"
    button = painter.button("Hold: the answer before the last step")
    shown = page.locator(".tag", has_text=name)
    painter.still()
    if by == "key":
        page.locator(".stage").focus()
        press, release = lambda: page.keyboard.down("q"), lambda: page.keyboard.up("q")
    elif by == "focus":
        button.focus()
        press, release = lambda: page.keyboard.down("Space"), lambda: page.keyboard.up("Space")
    else:
        button.hover()
        press, release = page.mouse.down, page.mouse.up
    press()
    shown.wait_for()
    dark = "() => window.engine.shown.solutionWeights?.flat().every((x) => x === 0)"
    page.wait_for_function(dark)
    release()
    shown.wait_for(state="detached")
    page.wait_for_function("() => window.engine.shown.solutionWeights === null")
    assert len(painter.requests("show_previous")) == 1


@pytest.mark.parametrize("by", ["key", nightly("button")])
def test_the_original_scene_shows_while_a_key_or_button_is_held(painter: Painter, by: str) -> None:
    """In place of the answer, wherever that is, and whichever lights are shown alone."""
    page = painter.page
    painter.stroke()
    painter.still()
    if by == "key":
        page.locator(".stage").focus()
        press, release = lambda: page.keyboard.down("y"), lambda: page.keyboard.up("y")
    else:
        painter.button("Hold: the original scene").hover()
        press, release = page.mouse.down, page.mouse.up
    pairs = {
        "painting solution": ["painting", "present"],
        "present solution": ["present", "present"],
        "solution verified": ["present", "verified"],
        "present painting": ["present", "painting"],
    }
    names = page.locator(".tag")
    for pair, shown in pairs.items():
        left, right = pair.split(" ")
        page.evaluate(
            "([left, right]) => painter.store.set(({ display }) => ({ solo: [0],"
            " display: { ...display, left, right } }))",
            [left, right],
        )
        painter.still()
        press()
        painter.still()
        assert page.evaluate("() => [engine.shown.left, engine.shown.right]") == shown
        assert "Original scene" in names.all_inner_texts()
        release()
        painter.still()
        assert page.evaluate("() => [engine.shown.left, engine.shown.right]") == [left, right]
        assert "Original scene" not in names.all_inner_texts()


@pytest.mark.nightly
def test_the_original_scene_shows_in_blink_and_ends_with_the_window(painter: Painter) -> None:
    page = painter.page
    page.locator(".stage").focus()
    page.keyboard.press("k")
    page.keyboard.press("k")
    painter.still()
    assert page.evaluate("() => engine.shown.blink") == "left"
    page.keyboard.down("y")
    painter.still()
    assert page.evaluate("() => [engine.shown.blink, engine.shown.right]") == ["right", "present"]
    page.evaluate("() => window.dispatchEvent(new Event('blur'))")
    painter.still()
    assert page.evaluate("() => [engine.shown.blink, engine.shown.right]") == ["left", "solution"]
    page.keyboard.up("y")
