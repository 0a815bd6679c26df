"""What goes on is seen wherever somebody is, can be stopped, and is counted alike.

And no picture is called what it does not show yet.
"""

from typing import Any

import pytest
from painter_page import Painter


def progress(painter: Painter, task: str, steps_done: int, total: int = 16) -> None:
    painter.tell(kind="progress", task=task, done=steps_done, total=total, unit="passes")


@pytest.mark.nightly
def test_files_that_are_written_are_seen_when_their_window_is_closed(painter: Painter) -> None:
    page = painter.page
    page.evaluate("() => { host.isWriting = true; }")
    painter.button("Export").click()
    painter.page.get_by_role("dialog").get_by_role("button", name="Export", exact=True).click()
    progress(painter, "export", 4)
    dialog = page.get_by_role("dialog")
    assert "25 %" in dialog.inner_text()
    assert dialog.get_by_text("You can close this window").is_visible()
    assert page.locator(".working").count() == 0  # it is seen once
    page.keyboard.press("Escape")
    chip = page.locator(".working")
    chip.get_by_text("Exporting files: 25 %").wait_for()
    page.get_by_role("button", name="Stop: exporting files").click()
    assert painter.requests("export")[-1] == {"kind": "export", "outputs": [], "run": False}
    painter.tell(
        kind="exported", files=["/shows/gallery-evening/lighting.json"], command="", is_stopped=True
    )
    page.get_by_text("Stopped. Exported lighting.json.").wait_for()
    assert chip.count() == 0
    # A page that was loaded anew hears of it, too.
    progress(painter, "export", 8)
    chip.get_by_text("Exporting files: 50 %").wait_for()
    files = [f"/shows/gallery-evening/{name}" for name in ("painting.exr", "answer/report.html")]
    painter.tell(kind="exported", files=files, command="")
    page.get_by_text("Exported painting.exr, answer/report.html.", exact=True).wait_for()
    painter.button("Export").click()
    assert page.get_by_role("dialog").get_by_text("answer/report.html", exact=True).is_visible()


@pytest.mark.nightly
def test_reasons_that_are_sought_are_said_to_be(painter: Painter) -> None:
    painter.page.evaluate("() => { host.explain = () => ({ kind: 'started', task: 'explain' }); }")
    painter.button("Analysis").click()
    painter.button("Why not closer?").click()
    button = painter.page.get_by_role("button", name="Finding reasons …")
    button.wait_for()
    assert button.is_disabled()
    assert painter.page.get_by_role("progressbar", name="Finding reasons").is_visible()
    painter.button("Analysis").click()  # its panel closes
    painter.page.locator(".working").get_by_text("Finding reasons").wait_for()
    painter.tell(kind="explained", sentences=["It is so."])
    assert painter.page.locator(".working").count() == 0
    painter.button("Analysis").click()
    assert painter.button("Why not closer?").is_enabled()


def test_all_that_goes_on_is_counted_alike(new_painter: Any) -> None:
    """In percent, and after a while with the time that is left."""
    painter = new_painter(is_fresh=True)
    page = painter.page
    for task, name in (
        ("basis", "Rendering the lights"),
        ("verification", "Verifying"),
        ("export", "Exporting files"),
    ):
        progress(painter, task, 2)
        page.locator(".working").get_by_text(f"{name}: 12 %").wait_for()
    page.evaluate(
        """() => {
          const now = performance.now();
          performance.now = () => now + 10000;  // ten seconds later
          host.tell({ kind: 'progress', task: 'basis', done: 7, total: 16, unit: 'passes' });
        }"""
    )
    page.locator(".working").get_by_text("Rendering the lights: 43 %, 20 s left").wait_for()
    page.evaluate("() => window.painter.store.set({ basis: null })")
    page.evaluate("() => engine.tell('loading', { done: 1, total: 4, isFirst: true })")
    page.locator(".working").get_by_text("Loading the images of the lights: 25 %").wait_for()


@pytest.mark.nightly
def test_samples_that_are_added_are_said_to_be(painter: Painter) -> None:
    chip = painter.page.locator(".working")
    progress(painter, "sampling", 4)
    chip.get_by_text("Adding samples where you painted: 25 %").wait_for()
    progress(painter, "sampling", 16)
    assert chip.count() == 0
    # A basis that is still being rendered comes first.
    progress(painter, "sampling", 4)
    progress(painter, "basis", 2)
    chip.get_by_text("Rendering the lights: 12 %").wait_for()
    assert chip.count() == 1


@pytest.mark.nightly
def test_nothing_to_undo_is_no_mistake(painter: Painter) -> None:
    painter.page.locator(".stage").focus()
    painter.page.keyboard.press("Control+z")
    toast = painter.page.locator(".toast")
    toast.get_by_text("There is nothing to undo.").wait_for()
    assert "is-warn" not in toast.get_attribute("class")


@pytest.mark.nightly
@pytest.mark.parametrize("picture", ["Painting", "Answer"])
def test_until_a_look_is_there_no_picture_is_called_its_own(painter: Painter, picture: str) -> None:
    painter.page.keyboard.press("Control+s")
    painter.page.evaluate(
        """() => {
          const load = host.load_look.bind(host);
          const { send } = host;
          host.send = async (kind, ...rest) => {
            if (kind === 'load_look') await new Promise((go) => { window.go = go; });
            return send.call(host, kind, ...rest);
          };
        }"""
    )
    tag = painter.page.locator(".tag", has_text=picture)
    painter.button("Load Look 1").click()
    tag.get_by_text(f"{picture}: loading Look 1 …").wait_for()
    painter.page.evaluate("() => window.go()")
    painter.still()
    assert tag.inner_text() == picture


@pytest.mark.nightly
def test_an_answer_without_some_of_its_lights_says_so(new_painter: Any) -> None:
    painter = new_painter()
    tag = painter.page.locator(".tag").last
    painter.page.evaluate("() => engine.tell('loading', { done: 1, total: 4, isFirst: true })")
    tag.get_by_text("Answer: some lights are still loading …").wait_for()
    painter.page.evaluate("() => engine.tell('loading', { done: 1, total: 4, isFirst: false })")
    painter.still()
    assert tag.inner_text() == "Answer"  # they are there, and get cleaner


@pytest.mark.nightly
def test_a_small_picture_is_of_what_it_stands_for(painter: Painter) -> None:
    """Not of what stood there before, while its own is on its way."""
    page = painter.page
    page.keyboard.press("Control+s")
    page.locator(".look-picture canvas").wait_for()
    painter.still()
    filled = """() => {
      const one = document.querySelector('.look-picture canvas');
      const copy = new OffscreenCanvas(one.width, one.height).getContext('2d');
      copy.drawImage(one, 0, 0);
      const { data } = copy.getImageData(0, 0, one.width, one.height);
      return data.some((code) => code > 0);
    }"""
    assert page.evaluate(filled)
    page.evaluate(
        """() => {
          host.fetch = () => new Promise(() => {});
          window.painter.store.set(({ looks }) => ({
            looks: looks.map((one) => ({ ...one, thumbnail: 'look/99' })) }));
        }"""
    )
    painter.still()
    assert not page.evaluate(filled)
