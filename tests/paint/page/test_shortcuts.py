"""Keys of commands: shown wherever a command is, and changed by a person."""

import re
from typing import Any

import pytest
from axe import violations
from painter_page import Painter
from renderer import REPOSITORY

TABLE = """async () => {
  const { DEFAULT_KEYS, keyText, shortcutsOf } = await import('/ui/key_bindings.js');
  const { SHORTCUTS } = await import('/ui/shortcuts.js');
  const entries = SHORTCUTS.flatMap(({ keys }) => keys).filter(({ command }) => command);
  const ui = window.painter.store.value;
  return Object.keys(DEFAULT_KEYS).map((command) => ({ command, shown: keyText(ui, command),
    shortcut: shortcutsOf(ui, command),
    description: entries.find((entry) => entry.command === command)?.description }));
}"""

#: Commands that the list of shortcuts alone shows: no control does the same.
LISTED_ONLY = {"zoomIn", "zoomOut"}


def open_keys(painter: Painter) -> None:
    painter.page.locator(".stage").focus()
    painter.page.keyboard.press("?")
    painter.page.get_by_role("dialog").wait_for()


def key_button(painter: Painter, description: str) -> Any:
    name = re.compile(rf"^{re.escape(description)}: .*Change the key$")
    return painter.page.get_by_role("dialog").get_by_role("button", name=name)


def close(painter: Painter) -> None:
    painter.page.keyboard.press("Escape")
    painter.page.wait_for_function("() => !document.querySelector('dialog')")
    painter.page.locator(".stage").focus()


def test_every_key_is_in_the_list_and_in_the_tip_of_its_control(new_painter: Any) -> None:
    painter: Painter = new_painter("lights=5")
    shown = set()
    for changes in (
        "{ open: { truth: true, select: true } }",
        "{ tool: 'select', open: { select: true } }",
        "{ tool: 'eraser' }",
        "{ views: [{ name: 'a', size: [27, 48] }, { name: 'b', size: [27, 48] }] }",
    ):
        painter.page.evaluate(f"() => painter.store.set({changes})")
        painter.still()
        keys = "() => [...document.querySelectorAll('[data-keys]')].map((one) => one.dataset.keys)"
        shown |= {key for text in painter.page.evaluate(keys) for key in text.split(" ")}
    table = painter.page.evaluate(TABLE)
    open_keys(painter)
    for entry in table:
        assert entry["description"], entry
        row = key_button(painter, entry["description"])
        assert row.inner_text().split() == entry["shown"].split(), entry
    assert {one["command"] for one in table if one["shortcut"] not in shown} == LISTED_ONLY


def test_the_keys_that_the_document_names_are_those_of_the_page(new_painter: Any) -> None:
    painter: Painter = new_painter()
    keys = painter.page.evaluate(
        """async () => {
          const { DEFAULT_KEYS, keySymbols } = await import('/ui/key_bindings.js');
          const { SHORTCUTS } = await import('/ui/shortcuts.js');
          return SHORTCUTS.flatMap(({ keys }) => keys).map((key) =>
            [key.symbols ?? keySymbols(DEFAULT_KEYS[key.command]), key.description]);
        }"""
    )
    rows = [f"| {' '.join(f'`{name}`' for name in names)} | {does} |" for names, does in keys]
    document = (REPOSITORY / "docs" / "painter.md").read_text()
    [table] = re.findall(r"\| key \| does \|\n\|[-|]+\|\n((?:\|.*\n)+)", document)
    assert len(rows) > 40
    assert len(named := table.splitlines()) > 15
    assert named == [row for row in rows if row in named]


@pytest.mark.nightly
def test_a_key_is_changed_shown_kept_and_reset(new_painter: Any, axe: str) -> None:
    painter: Painter = new_painter(axe=axe)
    open_keys(painter)
    button = key_button(painter, "Eraser")
    button.focus()
    painter.page.keyboard.press("Enter")
    painter.page.keyboard.press("j")
    assert painter.page.get_by_role("dialog").get_by_role("status").inner_text() == "Eraser: J"
    assert button.inner_text().strip() == "J"
    assert violations(painter.page, ".lightpaint") == []
    close(painter)
    painter.page.keyboard.press("e")
    assert painter.ui("tool") == "brush"
    painter.page.keyboard.press("j")
    assert painter.ui("tool") == "eraser"
    eraser = painter.button("Eraser")
    assert eraser.get_attribute("aria-keyshortcuts") == eraser.get_attribute("data-keys") == "J"
    painter.page.reload()
    painter.page.wait_for_selector(".lightpaint .tag")
    assert painter.ui("keyBindings") == {"eraser": "j"}
    open_keys(painter)
    painter.button("Reset all keys").click()
    painter.still()
    assert painter.ui("keyBindings") == {}
    assert button.inner_text().strip() == "E"
    assert painter.button("Reset all keys").is_disabled()


@pytest.mark.nightly
def test_a_conflict_is_named_and_chosen(new_painter: Any) -> None:
    painter: Painter = new_painter()
    open_keys(painter)
    conflict = painter.page.locator(".key-conflict")

    def ask() -> None:
        key_button(painter, "Brush").click()
        painter.page.keyboard.press("e")
        assert "E is: Eraser" in conflict.inner_text()

    ask()
    painter.button("Leave it").click()
    painter.still()
    assert painter.ui("keyBindings") == {}
    ask()
    painter.page.keyboard.press("Enter")  # *Take it* has the focus
    painter.still()
    assert painter.ui("keyBindings") == {"brush": "e", "eraser": ""}
    assert key_button(painter, "Eraser").inner_text() == "none"
    painter.button("Reset to E").click()
    assert "E is: Brush" in conflict.inner_text()
    painter.page.keyboard.press("Enter")
    painter.still()
    assert painter.ui("keyBindings") == {"brush": ""}


@pytest.mark.nightly
def test_escape_ends_the_change_and_not_the_dialog(new_painter: Any) -> None:
    painter: Painter = new_painter()
    open_keys(painter)
    button = key_button(painter, "undo")
    button.click()
    painter.page.keyboard.press("Escape")
    assert painter.page.get_by_role("dialog").is_visible()
    assert button.inner_text().split() == ["Ctrl", "Z"]
    button.click()
    painter.page.keyboard.press("Control+1")
    status = painter.page.get_by_role("dialog").get_by_role("status")
    assert status.inner_text() == "Ctrl 1 cannot be set: the browser or the page needs it."
    painter.page.keyboard.press("Control+u")
    assert painter.ui("keyBindings") == {"undo": "mod+u"}
    button.click()
    painter.page.keyboard.press("Delete")
    assert painter.ui("keyBindings") == {"undo": ""}
    close(painter)
    painter.stroke()
    painter.page.keyboard.press("Control+z")
    assert not painter.requests("undo")


@pytest.mark.nightly
def test_a_held_key_may_be_another(new_painter: Any) -> None:
    """The answer before the last step is there while the key is down, whichever it is."""
    painter: Painter = new_painter()
    painter.stroke()
    painter.page.wait_for_function("() => painter.store.value.history.undo.length")
    painter.page.evaluate("() => painter.store.set({ keyBindings: { previous: 'j' } })")
    painter.page.keyboard.down("j")
    painter.still()
    assert painter.ui("isPreviousHeld") is True
    painter.page.keyboard.up("j")
    painter.still()
    assert painter.ui("isPreviousHeld") is False
