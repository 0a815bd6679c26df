"""Makes the picture of a batch's gallery that docs/gallery.md shows.

    python docs/images/gallery.py [--spp 64] [--to looks.webp]

finds the looks of scenes/gallery/looks.toml on half the film, with so many samples that their
pictures are clean, and without verifying them; then takes a picture of the page that they leave, in
Chromium, which Playwright drives (`pip install playwright`). Two cores take about a minute.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from pathlib import Path

from PIL import Image

from lightpaint.batch.plan.planner import plan_batch
from lightpaint.batch.run import run_batch

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
LOOKS = ROOT / "scenes" / "gallery" / "looks.toml"
SIZE = (1400, 872)


def manifest(folder: Path, spp: int) -> Path:
    """The shipped one, elsewhere and of finer pictures."""
    text = LOOKS.read_text(encoding="utf-8")
    for there, here in (
        ('"scene.xml"', f'"{LOOKS.with_name("scene.xml")}"'),
        ("../../targets", str(ROOT / "targets")),
        ('resolution = "1/2"', f'resolution = "1/2"\nspp = {spp}'),
        ('"predict", "verify", "report"]', '"predict"]'),
    ):
        assert there in text, there
        text = text.replace(there, here)
    (folder / LOOKS.name).write_text(text, encoding="utf-8")
    return folder / LOOKS.name


def photographed(page: Path, path: Path) -> None:
    """A page in a browser, as a picture."""
    from playwright.sync_api import sync_playwright

    names = ("chromium", "chromium-browser", "google-chrome")
    program = next(filter(None, map(shutil.which, names)), None)
    with sync_playwright() as playwright:
        how = {} if program is None else {"executable_path": program}
        browser = playwright.chromium.launch(args=["--no-sandbox"], **how)
        size = {"width": SIZE[0], "height": SIZE[1]}
        opened = browser.new_page(viewport=size)
        opened.goto(page.as_uri())
        opened.wait_for_timeout(1000)
        opened.screenshot(path=path)
        browser.close()


def main() -> None:
    """Make it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--to", type=Path, default=HERE / "looks.webp")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        outcome = run_batch(plan_batch(manifest(folder, asked.spp), folder / "looks"))
        assert not outcome.failed, outcome.failed
        photographed(folder / "looks" / "index.html", folder / "page.png")
        with Image.open(folder / "page.png") as picture:
            picture.convert("RGB").save(asked.to, quality=82, method=6)


if __name__ == "__main__":
    main()
