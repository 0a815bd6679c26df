"""Makes the pictures of docs/tutorials/a-rig-that-follows.md, and its painting.

    pip install '.[stage]'
    python docs/images/tutorials/rig.py

Somebody makes a scene of the shipped show, paints one side blue and the other amber, solves it, and
lets a receiver on this machine follow the painter. It prints what each command says. Two cores take
about two minutes.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

from PIL import Image
from steps import FILES, browser_page, clone, comparison, keep, lightpaint, painter, work_folder

from brush import Canvas, Everywhere, Stroke  # isort: skip

SHOW, ROOM = "scenes/rig/show.mvr", "scenes/rig/room.xml"

#: Glazes: multiplied with what is there.
BLUE, AMBER = (0.12, 0.28, 1.1), (0.95, 0.48, 0.13)

#: The stroke over the left side, and how wide the brush is.
LEFT, SIZE = ((0.14, 0.1), (0.14, 0.95)), 0.55

#: A loopback address: nothing leaves this machine.
TARGET = "sacn://127.0.0.1"


def paint_sides(folder: Path) -> None:
    """Amber everywhere, and blue on the left."""
    canvas = Canvas.read_template(folder / "clean.exr")
    canvas.glaze(Everywhere(), AMBER)
    to_blue = tuple(b / a for a, b in zip(AMBER, BLUE, strict=True))
    canvas.glaze(Stroke(LEFT, size=SIZE, hardness=0.3), to_blue)
    canvas.write_png(folder / "blue-and-amber.png")


def main() -> None:
    """Do the job once."""
    with work_folder("rig-work") as folder:
        clone(folder, "rig")
        lightpaint(folder, "rig", SHOW, "--room", ROOM, "-o", "rig.xml")
        lightpaint(folder, "template", "rig.xml")
        paint_sides(folder / "template")
        shutil.copy(folder / "template" / "blue-and-amber.png", FILES / "blue-and-amber.png")
        keep(Image.open(folder / "template" / "template.png"), "rig-1-now")
        keep(Image.open(folder / "template" / "blue-and-amber.png"), "rig-2-painting")
        lightpaint(folder, "solve", "rig.xml", "template/blue-and-amber.png", "-o", "two-sides")
        keep(comparison(folder / "two-sides" / "comparison.png", 0, 1), "rig-3-answer")
        lights_table(folder / "two-sides" / "report.html")
        lightpaint(folder, "send", "two-sides/lighting.json", "--rig", SHOW)
        follow(folder)


def lights_table(report: Path) -> None:
    """Keep the table of lights of a report, with the drives of each."""
    with browser_page() as page:
        page.goto(report.as_uri())
        page.wait_for_timeout(2000)
        keep(page.locator("table.lights").first.screenshot(), "rig-4-drives")


def follow(folder: Path) -> None:
    """Paint with the console on, and print what a receiver got."""
    words = [sys.executable, "-m", "lightpaint", "listen", "--rig", SHOW, "--seconds", "40"]
    receiver = subprocess.Popen(words, cwd=folder, stdout=subprocess.PIPE, text=True)
    with painter(folder, "rig.xml", "--rig", SHOW, "--to", TARGET) as hand:
        page = hand.page
        page.get_by_role("checkbox", name="Console").click()
        page.wait_for_timeout(500)
        page.mouse.move(430, 200)
        page.mouse.down()
        page.mouse.move(560, 230, steps=20)
        page.mouse.up()
        page.wait_for_timeout(6000)
        keep(page.screenshot(), "rig-5-console")
        page.get_by_role("checkbox", name="Console").click()
    print("\n".join(receiver.communicate()[0].splitlines()[-12:]))


if __name__ == "__main__":
    main()
