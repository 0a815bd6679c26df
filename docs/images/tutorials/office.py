"""Makes the pictures of docs/tutorials/an-office-in-the-evening.md, and its painting.

    python docs/images/tutorials/office.py

Somebody plans the lighting of the shipped office for the least power, paints an evening, and gets
the evening that keeps 500 lx on the desks; then eleven looks from 90 W to 190 W. It prints what
each command says. Two cores take about ten minutes.
"""

from __future__ import annotations

import csv
import shutil
from pathlib import Path

from PIL import Image
from steps import FILES, clone, comparison, keep, lightpaint, row, work_folder

from brush import Canvas, Everywhere, Stroke  # isort: skip

OFFICE = "scenes/office/office.xml"
PLANES = "scenes/office/office.planes.toml"

#: Glazes: multiplied with what is there, on the whole room and on the wall at the left.
DUSK, GLOW = (0.26, 0.225, 0.17), (2.6, 2.3, 1.9)
WALL, SIZE = ((0.02, 0.25), (0.55, 0.28)), 0.5

#: Exposure of the template, which template.json has.
STOPS = -8.4

#: Powers of the eleven looks, in watts.
WATTS = range(90, 191, 10)


def paint_evening(folder: Path) -> None:
    """Dim and warm the room, and let the wall glow."""
    canvas = Canvas.read_template(folder / "clean.exr")
    canvas.glaze(Everywhere(), DUSK)
    canvas.glaze(Stroke(WALL, size=SIZE, hardness=0.3), GLOW)
    canvas.write_png(folder / "evening.png", stops=STOPS)


def manifest() -> str:
    """Return a manifest of looks that differ in their power alone."""
    looks = "".join(
        f'\n[[look]]\nname = "{watts} W"\npainting = "template/evening.png"\n'
        f"settings = {{ watts = {watts} }}\n"
        for watts in WATTS
    )
    return f'''[defaults]
scene = "{OFFICE}"

[defaults.settings]
planes = "{PLANES}"
spp = 64
{looks}'''


def main() -> None:
    """Do the job once."""
    with work_folder("office-work") as folder:
        clone(folder, "office")
        lightpaint(folder, "plan", OFFICE, "-o", "least")
        keep(Image.open(folder / "least/planes/desk_2.png"), "office-1-desk")
        lightpaint(folder, "template", OFFICE)
        paint_evening(folder / "template")
        shutil.copy(folder / "template" / "evening.png", FILES / "office-evening.png")
        keep(Image.open(folder / "template" / "template.png"), "office-2-now")
        keep(Image.open(folder / "template" / "evening.png"), "office-3-painting")
        lightpaint(folder, "solve", OFFICE, "template/evening.png", "-o", "mood")
        keep(comparison(folder / "mood" / "comparison.png", 0, 1), "office-4-mood")
        lightpaint(folder, "measure", OFFICE, "--lighting", "mood/lighting.json")
        answer = ("-o", "both", "--planes", PLANES)
        lightpaint(folder, "solve", OFFICE, "template/evening.png", *answer)
        keep(comparison(folder / "both" / "comparison.png", 0, 1), "office-5-both")
        keep(Image.open(folder / "both/planes/desk_2.png"), "office-6-desk")
        (folder / "watts.toml").write_text(manifest(), encoding="utf-8")
        lightpaint(folder, "batch", "watts.toml", "-o", "watts")
        slider(folder / "watts")


def slider(folder: Path) -> None:
    """Keep four of the looks beside each other, and print what each takes and gives."""
    with open(folder / "summary.csv", encoding="utf-8") as file:
        for look in csv.DictReader(file):
            print({key: look[key] for key in look if key.endswith(("lx", "W", "look", "delta_e"))})
    chosen = [WATTS[k] for k in (0, 3, 6, 10)]
    pictures = [comparison(folder / f"{w} W" / "comparison.png", 1) for w in chosen]
    keep(row(*pictures), "office-7-watts")


if __name__ == "__main__":
    main()
