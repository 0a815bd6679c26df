"""Makes the pictures of docs/tutorials/the-sky-for-a-picture.md, and its painting.

    python docs/images/tutorials/sky.py

Somebody paints a morning over a table at noon, and gets the sky for it. The brush comes from
targets/brush.py, on the template that lightpaint writes; the painting is written beside the
tutorial. It prints what each command says. Two cores take about ten minutes, nearly all of it for
the basis of 130 lights, which is kept where all bases are.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image
from steps import FILES, clone, comparison, keep, lightpaint, report_picture, row, work_folder

from brush import Canvas, Everywhere, Gradient, Stroke  # isort: skip
from clean import Floats  # isort: skip
from make import shown  # isort: skip

import lightpaint as lp

SCENE = "scenes/table/scene.xml"

#: Where the sun is, seen from the table: low, on the right; and what colours it brings.
SUN = (0.88, 0.28, 0.38)
COLD, GOLD = (0.55, 0.75, 1.0), (1.0, 0.62, 0.28)


@dataclass(frozen=True)
class Facing:
    """Surfaces that face a direction, by the normals that `lightpaint template` has written."""

    normals: Floats
    direction: tuple[float, float, float]

    def coverage(self, height: int, width: int) -> Floats:
        return np.clip(self.normals @ np.asarray(self.direction, np.float32), 0, 1)


def paint_morning(folder: Path) -> None:
    """A cold sky overhead, a low sun from the right, and its glint on silver and lacquer."""
    canvas = Canvas.read_template(folder / "clean.exr")
    normals, albedo = (
        lp.read_target(folder / f"{name}.exr", find=False).image for name in ("normals", "albedo")
    )
    canvas.glaze(Everywhere(), COLD, stops=-1.3)
    canvas.light(Facing(normals, SUN), (1.3, 0.62, 0.24), albedo)
    canvas.glaze(Gradient((0.0, 0.6), (0.55, 0.6)), COLD, stops=-0.6)
    canvas.glaze(Stroke([(0.70, 0.80), (0.86, 0.74), (0.97, 0.70)], size=0.16), GOLD, stops=1.2)
    canvas.glaze(Stroke([(0.475, 0.42), (0.47, 0.52)], size=0.04), GOLD, stops=2.4)
    canvas.glaze(Stroke([(0.295, 0.42), (0.30, 0.54)], size=0.06), COLD, stops=-1)
    canvas.write_png(folder / "morning.png")


def maps(folder: Path) -> Image.Image:
    """Return the sky of the scene, the one that was found in its texels, and the one to export."""
    before = lp.read_target(folder / "scenes" / "table" / "sky.exr", find=False).image
    texels = lp.read_target(folder / "morning" / "relit.sky.exr", find=False).image
    written = lp.read_target(folder / "hdri" / "sky.latlong.exr", find=False).image
    print("maps:", before.shape, texels.shape, written.shape, written.max(), written.min())
    size = (420, 210)
    sharp, smooth = Image.Resampling.NEAREST, Image.Resampling.BICUBIC
    return row(
        shown(before).resize(size, smooth),
        shown(texels).resize(size, sharp),
        shown(written).resize(size, smooth),
    )


def main() -> None:
    """Do the job once."""
    with work_folder("table-work") as folder:
        clone(folder, "table")
        lightpaint(folder, "template", SCENE, "--split", "sky=16x8")
        keep(Image.open(folder / "template" / "template.png"), "sky-1-template")
        paint_morning(folder / "template")
        shutil.copy(folder / "template" / "morning.png", FILES / "morning.png")
        keep(Image.open(folder / "template" / "morning.png"), "sky-2-painting")
        free = ("--colors", "free")
        lightpaint(folder, "solve", SCENE, "template/morning.png", "--split", "sky=16x8", *free)
        keep(comparison(folder / "morning" / "comparison.png"), "sky-3-comparison")
        report_picture(folder / "morning" / "report.html", "sky-4-report")
        words = ("morning/lighting.json", "--to", "blender", "--scene", SCENE, "-o", "hdri")
        lightpaint(folder, "export", *words)
        keep(maps(folder), "sky-5-maps")
        lightpaint(folder, "export", *words[:-1], "small", "--map-size", "128x64")
        shutil.copy(folder / "small" / "sky.latlong.exr", FILES / "morning-sky.exr")
        coarse = ("--split", "sky=8x4", "-o", "coarse")
        lightpaint(folder, "solve", SCENE, "template/morning.png", *coarse, *free)
        keep(comparison(folder / "coarse" / "comparison.png"), "sky-6-coarse")


if __name__ == "__main__":
    main()
