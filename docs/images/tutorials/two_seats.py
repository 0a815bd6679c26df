"""Makes the pictures of docs/tutorials/a-stage-from-two-seats.md, and its two paintings.

    python docs/images/tutorials/two_seats.py

Somebody paints dawn on a stage as it is seen from the balcony and from a box. The brush comes from
targets/brush.py, on the templates that lightpaint writes; the paintings are written beside the
tutorial. It prints what each command says. Two cores take about eight minutes, nearly all of it
for the bases, which are kept where all bases are.
"""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image
from steps import (
    FILES,
    clone,
    column,
    comparison,
    keep,
    lightpaint,
    report_picture,
    row,
    work_folder,
)

from brush import Canvas, Everywhere, Gradient, Mark, Stroke  # isort: skip
from clean import Floats  # isort: skip

SCENE = "scenes/stage/scene.xml"
SEATS = ("balcony", "box")

#: Glazes: multiplied with what is there.
NIGHT, ROSE, CANDLE = (0.42, 0.55, 1.0), (1.0, 0.42, 0.36), (1.0, 0.62, 0.3)


@dataclass(frozen=True)
class Masked:
    """A mark within a matte that `lightpaint template` has written, (h, w) from 0 to 1."""

    mark: Mark
    matte: Floats

    def coverage(self, height: int, width: int) -> Floats:
        return self.mark.coverage(height, width) * self.matte


def matte(folder: Path, *names: str) -> Floats:
    """Return how much of each pixel some objects fill."""
    paths = [folder / "mattes" / f"{name}.png" for name in names]
    pictures = [np.asarray(Image.open(path).convert("L"), np.float32) / 255 for path in paths]
    return np.clip(sum(pictures), 0, 1)


def dusky(folder: Path, horizon: tuple[tuple[float, float], tuple[float, float]]) -> Canvas:
    """Return a canvas with a stage before sunrise: cold, and rose above the hills."""
    canvas = Canvas.read_template(folder / "clean.exr")
    canvas.glaze(Everywhere(), NIGHT, stops=-1.2)
    sky = matte(folder, "cyclorama", "ground_row")
    canvas.glaze(Masked(Gradient(*horizon), sky), ROSE, stops=2.6)
    return canvas


def paint_balcony(folder: Path) -> None:
    """Dawn, and lantern light on the table and on the gown."""
    canvas = dusky(folder, ((0.5, 0.62), (0.5, 0.3)))
    warm = matte(folder, "tablecloth", "books", "chair", "figure_gown", "figure_skin")
    canvas.glaze(Masked(Stroke([(0.39, 0.7)], size=0.34), warm), CANDLE, stops=2.4)
    canvas.write_png(folder / "dawn.png")


def paint_box(folder: Path) -> None:
    """The same dawn, lantern light on the table, and a first light on the stones of the arch."""
    canvas = dusky(folder, ((0.2, 0.55), (0.2, 0.2)))
    warm = matte(folder, "tablecloth", "books", "chair", "figure_gown", "figure_skin")
    canvas.glaze(Masked(Stroke([(0.37, 0.68)], size=0.4), warm), CANDLE, stops=2.4)
    stones = matte(folder, "door_wall", "door_trim")
    canvas.glaze(Masked(Stroke([(0.44, 0.1), (0.46, 0.5)], size=0.2), stones), ROSE, stops=2.2)
    canvas.write_png(folder / "dawn.png")


def pictures(folder: Path, name: str) -> Image.Image:
    """Return pictures of that name of both seats, beside each other."""
    return row(*(Image.open(folder / seat / name) for seat in SEATS))


def main() -> None:
    """Do the job once."""
    with work_folder("stage-work") as folder:
        clone(folder, "stage")
        for seat in SEATS:
            lightpaint(folder, "template", SCENE, "--sensor", seat, "-o", f"seats/{seat}")
        keep(pictures(folder / "seats", "template.png"), "two-seats-1-templates")
        paint_balcony(folder / "seats" / "balcony")
        paint_box(folder / "seats" / "box")
        keep(pictures(folder / "seats", "dawn.png"), "two-seats-2-paintings")
        for seat in SEATS:
            shutil.copy(folder / "seats" / seat / "dawn.png", FILES / f"dawn-{seat}.png")
            print(seat, (FILES / f"dawn-{seat}.png").stat().st_size)
        solve(folder)


def solve(folder: Path) -> None:
    """Solve for the balcony alone, and for both."""
    balcony, box = (f"seats/{seat}/dawn.png" for seat in SEATS)
    lightpaint(folder, "solve", SCENE, balcony, "--sensor", "balcony", "-o", "alone")
    relight(folder, "alone")
    keep(pictures(folder / "alone-seen", "relit.png"), "two-seats-3-alone")
    both = ("--target", f"balcony={balcony}", "--target", f"box={box}")
    lightpaint(folder, "solve", SCENE, *both, "-o", "dawn")
    relight(folder, "dawn")
    keep(pictures(folder / "dawn-seen", "relit.png"), "two-seats-4-dawn")
    sheets = (comparison(folder / "dawn" / seat / "comparison.png", 0, 1) for seat in SEATS)
    keep(column(*sheets), "two-seats-5-comparison")
    report_picture(folder / "dawn" / "box" / "report.html", "two-seats-6-report")


def relight(folder: Path, name: str) -> None:
    """Render a lighting from both seats."""
    for seat in SEATS:
        words = (SCENE, f"{name}/lighting.json", "--sensor", seat, "-o", f"{name}-seen/{seat}")
        lightpaint(folder, "relight", *words)


if __name__ == "__main__":
    main()
