"""Helpers of all tutorials' scripts: run commands, drive the painter's page, and save pictures.

Each tutorial in docs/tutorials/ has a script here, which does its job in a folder of its own and
writes a picture for every step beside itself. `python docs/images/tutorials/NAME.py` runs one.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, sync_playwright

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[2]
FILES = ROOT / "docs" / "tutorials" / "files"
for folder in (HERE.parent, ROOT / "targets"):
    sys.path.insert(0, str(folder))

from record import Hand, using  # noqa: E402

#: Pixels of a browser's window, and the most that a picture is wide.
WINDOW, MAX_WIDTH = (1280, 800), 1280

#: Bytes of a picture, and the qualities that are tried until it fits.
MAX_BYTES, QUALITIES = 118_000, range(90, 40, -4)

#: Pixels between pictures that lie beside each other.
GAP = 8

#: Pixels of a picture in a comparison.png, and between two.
PANEL_WIDTH, PANEL_GAP = 640, 26


def keep(picture: Image.Image | bytes, name: str) -> None:
    """Write a picture beside this file, as large as pages show it and small enough to load."""
    if isinstance(picture, bytes):
        picture = Image.open(BytesIO(picture))
    picture = picture.convert("RGB")
    if picture.width > MAX_WIDTH:
        size = (MAX_WIDTH, round(picture.height * MAX_WIDTH / picture.width))
        picture = picture.resize(size, Image.Resampling.LANCZOS)
    for quality in QUALITIES:
        data = BytesIO()
        picture.save(data, "JPEG", quality=quality, optimize=True, progressive=True)
        if data.tell() <= MAX_BYTES:
            break
    path = HERE / f"{name}.jpg"
    path.write_bytes(data.getvalue())
    print(
        f"{path.name}: {picture.size}, quality {quality}, {data.tell() / 1000:.0f} kB", flush=True
    )


def row(*pictures: Image.Image, gap: int = GAP) -> Image.Image:
    """Put pictures of one height beside each other, with white gaps."""
    width = sum(picture.width for picture in pictures) + gap * (len(pictures) - 1)
    sheet = Image.new("RGB", (width, max(picture.height for picture in pictures)), "white")
    left = 0
    for picture in pictures:
        sheet.paste(picture.convert("RGB"), (left, 0))
        left += picture.width + gap
    return sheet


def column(*pictures: Image.Image, gap: int = GAP) -> Image.Image:
    """Put pictures of one width below each other, with white gaps."""
    height = sum(picture.height for picture in pictures) + gap * (len(pictures) - 1)
    sheet = Image.new("RGB", (max(picture.width for picture in pictures), height), "white")
    top = 0
    for picture in pictures:
        sheet.paste(picture.convert("RGB"), (0, top))
        top += picture.height + gap
    return sheet


def comparison(path: Path, *panels: int) -> Image.Image:
    """Return panels of a comparison.png, by default all, two in a row so that text can be read.

    A panel is a picture of 640 pixels with its captions; 26 pixels lie before, between and after.
    """
    sheet = Image.open(path)
    step = PANEL_WIDTH + PANEL_GAP
    count = (sheet.width - PANEL_GAP) // step
    pictures = [
        sheet.crop((k * step + PANEL_GAP // 2, 0, (k + 1) * step + PANEL_GAP // 2, sheet.height))
        for k in panels or range(count)
    ]
    rows = [row(*pictures[k : k + 2], gap=0) for k in range(0, len(pictures), 2)]
    return column(*rows, gap=0)


def lightpaint(folder: Path, *words: str) -> str:
    """Run a command as somebody would in that folder, and print it with what it said."""
    start = time.monotonic()
    print(f"$ lightpaint {' '.join(words)}", flush=True)
    environment = {**os.environ, "COLUMNS": "100", "PYTHONPATH": str(ROOT)}
    run = subprocess.run(
        [sys.executable, "-m", "lightpaint", *words],
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    print(run.stdout)
    print(f"[{run.returncode}, {time.monotonic() - start:.0f} s]", flush=True)
    return run.stdout


def clone(folder: Path, *scenes: str) -> None:
    """Copy scenes of the repository into a folder, as a clone of it has them."""
    for name in scenes:
        shutil.copytree(ROOT / "scenes" / name, folder / "scenes" / name)


@contextmanager
def work_folder(name: str) -> Iterator[Path]:
    """Make a folder of that name, which pages show, and remove it in the end."""
    folder = Path(tempfile.gettempdir()) / name
    folder.mkdir()
    try:
        yield folder
    finally:
        shutil.rmtree(folder)


@contextmanager
def painter(folder: Path, *words: str) -> Iterator[Hand]:
    """Start a painter in a folder, and open its page."""
    run = [sys.executable, "-m", "lightpaint", "paint", *words, "--no-browser"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    server = subprocess.Popen(
        run,
        cwd=folder,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert server.stdout is not None
    try:
        url = next(word for line in server.stdout for word in line.split() if "#token=" in word)
        with using(url) as hand:
            hand.page.set_viewport_size({"width": WINDOW[0], "height": WINDOW[1]})
            yield hand
    finally:
        server.terminate()
        server.wait(60)


@contextmanager
def browser_page(size: Sequence[int] = WINDOW) -> Iterator[Page]:
    """Open an empty page of headless Chromium."""
    with sync_playwright() as playwright:
        path = shutil.which("chromium") or playwright.chromium.executable_path
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser.new_page(viewport={"width": size[0], "height": size[1]})
        browser.close()


def report_picture(report: Path, name: str) -> None:
    """Keep what a report shows first."""
    with browser_page() as page:
        page.goto(report.as_uri())
        page.wait_for_timeout(2500)
        keep(page.screenshot(), name)
