"""The painter in a real JupyterLab and in marimo: painted by hand, told to Python, set from a cell.

Both are large and take half a minute each, so that they are not part of what tests install:

    pip install jupyterlab marimo && pytest tests/paint/page/test_notebooks.py
"""

import html
import json
import os
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import psutil
import pytest
from renderer import REPOSITORY

import lightpaint as lp

pytestmark = pytest.mark.long

PAINTER = """\
import lightpaint as lp
basis = lp.read_basis("made.basis.exr")
painter = lp.Painter(basis, height=560)
def told(change):
    with open("told.txt", "a") as file:
        print(change.name, painter.target is not None, file=file)
painter.observe(told, "lighting")
"""

ASK = 'painter.constraints = lp.Constraints.of({"light 0": {"off": True}})'

#: Seconds in which a server is there, in which anything shows, and after which a stroke and a cell
#: that nothing came of are tried again.
START_S, SHOW_MS, STROKE_S, CELL_S = 90, 90_000, 10.0, 20.0


@pytest.fixture
def folder(make_basis: Any, tmp_path: Path) -> Path:
    """Where a notebook runs."""
    lp.write_basis(tmp_path / "made.basis.exr", make_basis(3, (54, 96)))
    return tmp_path


@contextmanager
def serve_notebooks(folder: Path, *command: str) -> Iterator[str]:
    """A server on a port of its own, with settings of its own, until the end of the test."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    homes = ("JUPYTER_CONFIG_DIR", "JUPYTER_RUNTIME_DIR", "JUPYTERLAB_SETTINGS_DIR")
    homes += (
        "JUPYTER_DATA_DIR",
        "JUPYTERLAB_WORKSPACES_DIR",
        "IPYTHONDIR",
        "XDG_CONFIG_HOME",
        "XDG_STATE_HOME",
    )
    env = {**os.environ, "PYTHONPATH": str(REPOSITORY)}
    env |= {name: str(folder / "home" / name) for name in homes}
    url = f"http://127.0.0.1:{port}"
    with (folder / "server.log").open("wb") as log:
        server = subprocess.Popen(
            [sys.executable, "-m", *command, "--port", str(port)],
            cwd=folder,
            env=env,
            stdout=log,
            stderr=log,
        )
    try:
        wait_for(lambda: is_reachable(url), START_S)
        yield url
    finally:
        end_at_once(server)


def end_at_once(server: "subprocess.Popen[bytes]") -> None:
    """End a server and its kernels; asked for it, JupyterLab takes ten seconds."""
    processes = psutil.Process(server.pid).children(recursive=True)
    server.kill()
    server.wait()
    for process in processes:
        with suppress(psutil.NoSuchProcess):
            process.kill()
    _, alive = psutil.wait_procs(processes, START_S)
    assert alive == []


def is_reachable(url: str) -> bool:
    """Whether somebody is there."""
    try:
        with urllib.request.urlopen(url, timeout=5):
            return True
    except OSError:
        return False


def wait_for(condition: Callable[[], Any], limit_s: float = SHOW_MS / 1000) -> Any:
    """What it gives, once it does."""
    end_s = time.monotonic() + limit_s
    while not (value := condition()):
        assert time.monotonic() < end_s
        time.sleep(0.1)
    return value


@contextmanager
def open_tab(browser: Any) -> Iterator[Any]:
    """A page on which nothing of the painter's goes wrong."""
    context = browser.new_context(viewport={"width": 1400, "height": 950})
    page, errors = context.new_page(), []
    page.set_default_timeout(SHOW_MS)
    page.on("pageerror", lambda error: errors.append(str(error)))
    yield page
    context.close()
    assert errors == []


def paint(page: Any, folder: Path) -> None:
    """Strokes over the painting, as soon as there is one, until Python has heard of them: what is
    around the picture may still move it from under the first.
    """
    page.locator(".lightpaint .tag").first.wait_for()
    picture = page.locator(".lightpaint .pictures canvas").first
    picture.wait_for()
    wait_for(lambda: page.locator(".lightpaint .loading, .lightpaint .waiting").count() == 0)
    end_s = time.monotonic() + SHOW_MS / 1000
    while not has_painting(folder):
        assert time.monotonic() < end_s
        box = picture.bounding_box()
        x, y = box["x"] + 0.3 * box["width"], box["y"] + 0.22 * box["height"]
        page.mouse.move(x, y)
        page.mouse.down()
        for k in range(6):
            page.mouse.move(x + 12 * k, y)
        page.mouse.up()
        told_s = time.monotonic() + STROKE_S
        while time.monotonic() < told_s and not has_painting(folder):
            time.sleep(0.1)


def run_cell(page: Any, k: int, is_done: Callable[[], bool]) -> None:
    """Runs cell ``k`` of JupyterLab until it is done: a key before the kernel is there is lost."""
    end_s = time.monotonic() + SHOW_MS / 1000
    while not is_done():
        assert time.monotonic() < end_s
        page.locator(".jp-Cell .cm-content").nth(k).click()
        page.keyboard.press("Shift+Enter")
        done_s = time.monotonic() + CELL_S
        while time.monotonic() < done_s and not is_done():
            time.sleep(0.1)


def paste_picture(page: Any) -> None:
    """Copies a picture, and pastes it where the focus is."""
    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.evaluate(
        """async () => {
          const canvas = new OffscreenCanvas(32, 24), context = canvas.getContext('2d')
          context.fillStyle = 'orange'
          context.fillRect(4, 4, 12, 12)
          const picture = await canvas.convertToBlob()
          await navigator.clipboard.write([new ClipboardItem({ 'image/png': picture })])
        }"""
    )
    page.keyboard.press("Control+V")


def check_saved(page: Any, path: Path) -> None:
    """Check that saving a notebook keeps the last painting, in an output that the page hides."""
    assert not page.locator(".lightpaint-saved").is_visible()
    end_s = time.monotonic() + SHOW_MS / 1000
    while True:
        page.keyboard.press("Control+S")
        outputs = json.loads(path.read_text("utf-8"))["cells"][0].get("outputs", [])
        saved = ["".join(x["data"]["text/html"]) for x in outputs]
        # Of a picture with a painting, the mixer has a wipe.
        if len(saved) == 2 and '"painting":"data:' in html.unescape(saved[1]):
            return
        assert time.monotonic() < end_s
        time.sleep(0.5)


def check_without_kernel(page: Any, url: str, folder: Path) -> None:
    """The mixer stands in place of the error message; where nothing is trusted, the picture does.

    The kernel of a notebook that is opened again knows no painter.
    """
    notebook = json.loads((folder / "paint.ipynb").read_text("utf-8"))
    page.goto(f"{url}/lab/tree/paint.ipynb?reset")
    page.locator(".lightpaint-saved").wait_for()
    page.frame_locator(".lightpaint-saved iframe").locator(".mixer-mix").wait_for()
    page.locator(".jp-OutputArea-output.jupyter-widgets").wait_for(state="hidden")
    assert "model not found" not in page.locator(".jp-Notebook").inner_text()
    assert not page.locator(".lightpaint-saved img").is_visible()
    # A signature holds for the outputs that were signed.
    notebook["cells"][0]["outputs"][0]["data"]["text/plain"] = "another"
    (folder / "foreign.ipynb").write_text(json.dumps(notebook), "utf-8")
    page.goto(f"{url}/lab/tree/foreign.ipynb?reset")
    page.locator(".jp-OutputArea-output img").wait_for()
    assert page.locator(".jp-OutputArea-output iframe").count() == 0
    assert page.locator(".jp-OutputArea-output.jupyter-widgets").count() == 0
    # What has no widgets at all shows the same mixer.
    from nbconvert import HTMLExporter

    text, _ = HTMLExporter().from_filename(folder / "paint.ipynb")
    assert text.count("lightpaint-static") > 0 == text.count("jupyter-widgets-view")


def has_painting(folder: Path) -> bool:
    """Whether Python has heard of a painting."""
    path = folder / "told.txt"
    return path.exists() and "lighting True" in path.read_text()


@pytest.mark.nightly
@pytest.mark.skipif(find_spec("jupyterlab") is None, reason="JupyterLab")
def test_in_jupyterlab(browser: Any, folder: Path) -> None:
    def cell(k: int, text: str) -> dict[str, Any]:
        cell_fields = {"metadata": {}, "outputs": [], "execution_count": None}
        return {"cell_type": "code", "id": f"c{k}", "source": text, **cell_fields}

    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    notebook = {"metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}
    cells = [cell(0, PAINTER + "painter"), cell(1, ASK)]
    (folder / "paint.ipynb").write_text(json.dumps({**notebook, "cells": cells}))
    options = ["--no-browser", "--allow-root", "--ServerApp.token=", "--ServerApp.password="]
    with serve_notebooks(folder, "jupyterlab", *options) as url, open_tab(browser) as page:
        # A slow JupyterLab may ask which kernel it is, before it has read that: it knows by then.
        dialog_button = page.locator(".jp-Dialog .jp-mod-accept")
        page.add_locator_handler(dialog_button, lambda: dialog_button.click())
        page.goto(f"{url}/lab/tree/paint.ipynb?reset")
        run_cell(page, 0, lambda: page.locator(".lightpaint").count() == 1)
        paint(page, folder)
        # A key of the painter is none of the notebook's: `b` would put a cell below.
        page.keyboard.press("b")
        assert page.locator(".jp-CodeCell").count() == 2
        paste_picture(page)
        page.locator(".lightpaint .reference-name").wait_for()
        assert page.locator(".jp-CodeCell").count() == 2
        row = page.locator('.lightpaint [data-light="light 0"]')
        assert "is-dim" not in row.get_attribute("class")
        run_cell(page, 1, lambda: "is-dim" in row.get_attribute("class"))
        check_saved(page, folder / "paint.ipynb")
        # What is painted for a kernel that is there no more would be lost.
        page.remove_locator_handler(dialog_button)
        page.locator('.jp-NotebookPanel-toolbar [data-jp-item-name="restart"] *').first.click()
        dialog_button.click()
        page.get_by_text("The kernel has ended. Run the cell again to continue.").wait_for()
        page.add_locator_handler(dialog_button, lambda: dialog_button.click())
        check_without_kernel(page, url, folder)


@pytest.mark.nightly
@pytest.mark.skipif(find_spec("marimo") is None, reason="marimo")
def test_in_marimo(browser: Any, folder: Path) -> None:
    state = ["import marimo as mo", "lighting, set_lighting = mo.state(painter.lighting)"]
    state += ['painter.observe(lambda change: set_lighting(change.new), "lighting")', "painter"]
    label_cell = ["mo.md(f\"for {lighting().target or 'nothing'}\")"]
    text = "import marimo\napp = marimo.App()\n"
    for head, cell, outcome in (
        ("", [*PAINTER.splitlines(), *state], "lighting, mo"),
        ("lighting, mo", label_cell, ""),
    ):
        lines = "".join(f"    {line}\n" for line in cell)
        text += f"\n@app.cell\ndef _({head}):\n{lines}    return {outcome}\n"
    (folder / "paint.py").write_text(text)
    options = ["--headless", "--no-token", "--host", "127.0.0.1"]
    with (
        serve_notebooks(folder, "marimo", "run", "paint.py", *options) as url,
        open_tab(browser) as page,
    ):
        page.goto(url)
        page.get_by_text("for nothing").wait_for()
        paint(page, folder)
        # Cells that use a state run again when a callback sets it.
        page.get_by_text("for painting").first.wait_for()
        # The style of the page stays within: marimo shows it in a shadow root.
        styled = page.locator(".lightpaint").evaluate("x => getComputedStyle(x).display")
        assert styled == "grid"
