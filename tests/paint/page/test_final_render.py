"""The dialog for final renders: what it asks for, and what it shows of them."""

from pathlib import Path
from typing import Any

import pytest
from axe import violations
from painter_page import Painter

FOLDER = "/shows/gallery-evening"


@pytest.fixture
def painter(new_painter: Any, axe: str) -> Painter:
    opened: Painter = new_painter(axe=axe)
    opened.stroke()
    return opened


def open_dialog(painter: Painter) -> Any:
    painter.button("Export").click()
    dialog = painter.page.get_by_role("dialog")
    dialog.get_by_role("button", name="Final render").click()
    return dialog


def change(painter: Painter, render: int, **changes: Any) -> None:
    """Have the session say what has changed about a render."""
    painter.page.evaluate(
        "([render, changes]) => host.tell(host.changeRender(render, changes))", [render, changes]
    )
    painter.still()


def begin(dialog: Any) -> None:
    dialog.get_by_role("button", name="Render", exact=True).click()


def test_a_final_render_is_asked_for_and_shows_where_its_files_are(painter: Painter) -> None:
    dialog = open_dialog(painter)
    assert "× 1080 pixels" in dialog.inner_text()  # of a film of 48 by 27
    dialog.get_by_role("button", name="4K").click()
    assert "× 2160 pixels" in dialog.inner_text()
    painter.type("Width", "960")
    painter.type("Samples", "512")
    dialog.get_by_role("checkbox", name="EXR").uncheck()
    dialog.get_by_label("Name").fill("Act 1")
    assert violations(painter.page) == []
    begin(dialog)
    [request] = painter.requests("render_final")
    asked = {"name": "Act 1", "width": 960, "spp": 512, "formats": ["png"], "view": 0}
    assert request == {"kind": "render_final", **asked}
    row = dialog.locator(".render")
    painter.tell(kind="progress", task="final", done=5, total=20, unit="passes")
    assert "25 %" in row.inner_text()
    painter.tell(kind="progress", task="final", done=20, total=20, unit="passes")
    assert "denoising" in row.inner_text()
    files = [f"{FOLDER}/renders/Act 1/{x}" for x in ("render.png", "lighting.json")]
    change(painter, 1, state="done", height=540, files=files)
    assert "960 × 540" in row.inner_text()
    assert row.locator("code").all_inner_texts() == [
        "renders/Act 1/render.png",
        "renders/Act 1/lighting.json",
    ]
    assert violations(painter.page) == []
    dialog.get_by_role("button", name="Take Act 1 off this list").click()
    assert painter.requests("drop_render")[-1]["render"] == 1
    assert row.count() == 0


@pytest.mark.nightly
def test_a_file_of_a_render_is_saved_by_the_browser(painter: Painter, tmp_path: Path) -> None:
    dialog = open_dialog(painter)
    begin(dialog)
    painter.still()
    files = [f"{FOLDER}/renders/gallery/render.png"]
    change(painter, 1, state="done", height=1080, files=files)
    painter.page.evaluate(
        """() => { host.fetch = async (name) =>
            ({ data: new TextEncoder().encode(name), shape: [name.length] }); }"""
    )
    with painter.page.expect_download() as download:
        dialog.get_by_role("button", name="Download render.png").click()
    assert download.value.suggested_filename == "gallery render.png"
    download.value.save_as(tmp_path / "a")
    assert (tmp_path / "a").read_text() == "render_file/1/render.png"


@pytest.mark.nightly
def test_renders_outlive_the_dialog_and_the_page(painter: Painter) -> None:
    dialog = open_dialog(painter)
    begin(dialog)
    begin(dialog)
    painter.still()
    assert "Waits for the render before it" in dialog.inner_text()
    painter.page.keyboard.press("Escape")
    chip = painter.page.locator(".working", has_text="Final render")
    painter.tell(kind="progress", task="final", done=5, total=20, unit="passes")
    assert "25 %" in chip.inner_text()
    # As a page that opens later is told.
    painter.page.evaluate(
        """() => { host.changeRender(1, { done: 10, total: 20 });
            painter.store.set({ renders: [], renderProgress: null }); host.tell(host.state()); }"""
    )
    painter.still()
    assert "50 %" in chip.inner_text()
    files = [f"{FOLDER}/renders/gallery/render.exr"]
    change(painter, 1, state="done", height=1080, files=files)
    toast = painter.page.locator(".toast")
    assert "renders/gallery/render.exr" in toast.inner_text()
    change(painter, 2, state="rendering", done=0, total=9)
    painter.button("Stop: final render").click()
    assert painter.requests("stop_render")[-1]["render"] == 2
    assert chip.count() == 0
    assert toast.count() == 1
    assert "Stopped; no file was written" in open_dialog(painter).inner_text()


@pytest.mark.nightly
def test_without_a_scene_it_says_why_there_is_none(painter: Painter) -> None:
    painter.page.evaluate("() => host.tell({ ...host.state(), can_render: false })")
    painter.still()
    dialog = open_dialog(painter)
    assert "There is no scene to render" in dialog.inner_text()
    for control in ("button", "textbox", "checkbox"):
        for one in dialog.locator(".render-settings").get_by_role(control).all():
            assert one.is_disabled()
