"""Makes the pictures of docs/tutorials/hang-three-lights.md, and its painting.

    python docs/images/tutorials/three_lights.py

Somebody paints three pools of light in a gallery whose lamps do not reach there, and lets a search
hang three spots. The brush comes from targets/brush.py, on the template that lightpaint writes; the
painting is written beside the tutorial. It prints what each command says. Two cores take about
twelve minutes; the basis is kept where all bases are.
"""

from __future__ import annotations

import shutil
from io import BytesIO
from pathlib import Path

from PIL import Image
from steps import FILES, browser_page, clone, comparison, keep, lightpaint, work_folder

from brush import Canvas, Everywhere, Stroke  # isort: skip

SCENE = "scenes/gallery/scene.xml"

#: Half of the film in each direction: the search takes a quarter of the time.
SMALL = ("--resolution", "1/2")

#: The part of a report's section with the picture and the plan, and what is left around it.
PLAN, MARGIN = (960, 1340), 24

#: Glazes: multiplied with what is there.
DUSK, WARM = (0.75, 0.85, 1.0), (1.0, 0.72, 0.45)

#: Pools of light: along which line, and how wide the brush is.
POOLS = (
    (((0.03, 0.74), (0.16, 0.69)), 0.10),
    (((0.36, 0.84), (0.50, 0.92)), 0.14),
    (((0.945, 0.38), (0.945, 0.55)), 0.10),
)


def paint_pools(folder: Path) -> None:
    """Dusk, and warm light on the bricks, on the floor, and on the picture at the right."""
    canvas = Canvas.read_template(folder / "clean.exr")
    canvas.glaze(Everywhere(), DUSK, stops=-1.7)
    for line, size in POOLS:
        canvas.glaze(Stroke(line, size=size, hardness=0.3), WARM, stops=2.8)
    canvas.write_png(folder / "pools.png")


def solved(folder: Path, name: str, *words: str) -> None:
    """Solve for the painting, and print which lights moved or were added."""
    command = ("solve", SCENE, "template/pools.png", "-o", name, *SMALL, *words)
    lightpaint(folder, *command)


def main() -> None:
    """Do the job once."""
    with work_folder("lights-work") as folder:
        clone(folder, "gallery")
        lightpaint(folder, "template", SCENE)
        paint_pools(folder / "template")
        shutil.copy(folder / "template" / "pools.png", FILES / "pools.png")
        shutil.copy(FILES / "rig.toml", folder / "rig.toml")
        keep(Image.open(folder / "template" / "pools.png"), "three-lights-1-painting")
        solved(folder, "as-hung")
        keep(comparison(folder / "as-hung" / "comparison.png"), "three-lights-2-as-hung")
        solved(folder, "three-more", "--add", "spot:3@ceiling")
        keep(comparison(folder / "three-more" / "comparison.png", 0, 1), "three-lights-3-added")
        report(folder / "three-more", "three-lights-4-plan")
        solved(folder, "rig", "--lights-file", "rig.toml")
        keep(comparison(folder / "rig" / "comparison.png", 0, 1), "three-lights-5-rig")
        report(folder / "rig", "three-lights-6-rail")


def report(folder: Path, name: str) -> None:
    """Keep the section of a report that draws where the lights hang."""
    with browser_page() as page:
        page.goto((folder / "report.html").as_uri())
        page.wait_for_timeout(2000)
        section = page.locator("section", has_text="Where the lights hang").first
        picture = Image.open(BytesIO(section.screenshot())).crop((0, 0, *PLAN))
        sheet = Image.new("RGB", (PLAN[0] + 2 * MARGIN, PLAN[1] + MARGIN), picture.getpixel((0, 0)))
        sheet.paste(picture, (MARGIN, MARGIN))
        keep(sheet, name)


if __name__ == "__main__":
    main()
