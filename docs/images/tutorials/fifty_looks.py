"""Makes the pictures of docs/tutorials/fifty-looks-overnight.md.

    python docs/images/tutorials/fifty_looks.py

Runs the batch of docs/tutorials/files/fifty.toml by two workers, stops it after a while as Ctrl-C
does, continues it, and looks at the page that it leaves, in headless Chromium. It prints what each
command says. Two idle cores take about six minutes.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

from PIL import Image
from steps import FILES, ROOT, browser_page, clone, keep, lightpaint, row, work_folder

from make import read_painting  # isort: skip

MANIFEST = "docs/tutorials/files/fifty.toml"
BATCH = ("batch", MANIFEST, "-o", "looks", "--workers", "2")

#: Looks after which the batch is stopped.
STOP_AFTER = 20

#: Paintings, and the size at which they are shown.
PAINTINGS = ("evening.exr", "morning.exr", "opening.png", "after-hours.png", "overcast.png",
             "last-sun.png", "dusk-2.png", "pools.png")  # fmt: skip
SMALL = (314, 177)

#: The size at which the contact sheet is shown.
SHEET = (1080, 1116)


def paintings() -> Image.Image:
    """Return the eight paintings in two rows."""
    pictures = []
    for name in PAINTINGS:
        path = FILES / name
        path = path if path.exists() else ROOT / "targets" / "gallery" / name
        pictures.append(read_painting(path).resize(SMALL, Image.Resampling.LANCZOS))
    rows = [row(*pictures[:4]), row(*pictures[4:])]
    sheet = Image.new("RGB", (rows[0].width, 2 * SMALL[1] + 8), "white")
    sheet.paste(rows[0], (0, 0))
    sheet.paste(rows[1], (0, SMALL[1] + 8))
    return sheet


def interrupted(folder: Path) -> None:
    """Start the batch, and press Ctrl-C after a while."""
    run = subprocess.Popen(
        [sys.executable, "-m", "lightpaint", *BATCH],
        cwd=folder,
        env={**os.environ, "COLUMNS": "100", "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )
    while len(list(folder.glob("looks/*/lighting.json"))) < STOP_AFTER and run.poll() is None:
        time.sleep(0.5)
    run.send_signal(signal.SIGINT)
    print(run.communicate()[0], run.returncode)
    print(sorted(path.name for path in (folder / "looks").iterdir()))


def look_at(index: Path) -> None:
    """Use the page as a person does, and keep pictures."""
    with browser_page() as page:
        page.goto(index.as_uri())
        page.wait_for_timeout(2000)
        keep(page.screenshot(), "fifty-3-gallery")
        page.locator("#filter").fill("dusk-2")
        page.wait_for_timeout(1000)
        keep(page.screenshot(), "fifty-4-filter")
        page.get_by_label("dusk-2 as A", exact=True).click()
        page.get_by_label("dusk-2-white-only as B", exact=True).click()
        page.locator("#wipe").wait_for()
        page.wait_for_timeout(1000)
        keep(page.screenshot(), "fifty-5-compare")
        page.keyboard.press("Escape")
        page.locator("#filter").fill("")
        card = page.locator(".card", has=page.get_by_text("pools", exact=True))
        card.get_by_label("Mix the lights of pools", exact=True).click()
        page.locator(".mixer:not([hidden]) .mixer-body").wait_for()
        page.wait_for_timeout(2000)
        keep(page.screenshot(), "fifty-6-mixer")


def main() -> None:
    """Do the job once."""
    keep(paintings(), "fifty-1-paintings")
    with work_folder("looks-work") as folder:
        clone(folder, "gallery")
        shutil.copytree(ROOT / "targets" / "gallery", folder / "targets" / "gallery")
        shutil.copytree(FILES, folder / "docs" / "tutorials" / "files")
        lightpaint(folder, *BATCH[:2], "--dry-run")
        interrupted(folder)
        lightpaint(folder, *BATCH)
        sheet = Image.open(folder / "looks" / "contact.png")
        print("contact sheet", sheet.size)
        keep(sheet.resize(SHEET, Image.Resampling.LANCZOS), "fifty-2-sheet")
        look_at(folder / "looks" / "index.html")
        lightpaint(folder, *BATCH)


if __name__ == "__main__":
    main()
