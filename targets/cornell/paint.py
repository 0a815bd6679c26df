"""Paint the two targets of the Cornell box over a render of it as it is now.

    lightpaint template scenes/cornell/scene.xml -o targets/cornell/template.exr
    python targets/cornell/paint.py [template.exr]

Writes, beside this file:

    warm.exr                  lamplight behind the tall box; its alpha says where it matters
    cool.exr, cool.mask.exr   moonlight through the window; the mask says where it matters

The template is a linear RGB EXR of 128 x 128; by default `template.exr` beside this file. The
strokes are placed by eye. No light was rendered alone to make them.
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))  # brush.py lives one folder up

from brush import Area, Canvas, Everywhere, Stroke  # noqa: E402

# Where things are in the picture: x to the right, y down, both from 0 to 1.
RIGHT_WALL = [(1.0, 0.0), (0.82, 0.18), (0.82, 0.80), (1.0, 0.99)]
CEILING = [(0.0, 0.0), (1.0, 0.0), (0.82, 0.18), (0.19, 0.18)]
TALL_FRONT = [(0.30, 0.445), (0.50, 0.455), (0.49, 0.85), (0.44, 0.86), (0.37, 0.80), (0.31, 0.83)]
SHORT_TOP = [(0.52, 0.68), (0.61, 0.66), (0.80, 0.67), (0.76, 0.70)]
SHORT_FRONT = [(0.52, 0.69), (0.76, 0.70), (0.755, 0.92), (0.525, 0.91)]


def paint_warm(template: Path) -> Canvas:
    """Evening: a lamp is on behind the tall box, and one light picks out the vase."""
    canvas = Canvas.read_template(template)
    amber, gold = (1.0, 0.56, 0.20), (1.0, 0.74, 0.42)

    # The day is over: the whole room goes down, and warmer.
    canvas.glaze(Everywhere(), (1.0, 0.58, 0.30), stops=-3.1, opacity=0.3)

    # The lamp: a halo on the wall that spills over the edge of the box and up to the ceiling.
    canvas.glaze(Stroke([(0.37, 0.50), (0.36, 0.62)], size=0.90), amber, stops=1.1)
    canvas.glaze(Stroke([(0.27, 0.42), (0.36, 0.38), (0.47, 0.42)], size=0.42), amber, stops=1.0)
    canvas.glaze(Stroke([(0.20, 0.45), (0.16, 0.58), (0.19, 0.70)], size=0.30), amber, stops=0.9)
    canvas.glaze(Stroke([(0.25, 0.15), (0.50, 0.15)], size=0.26), amber, stops=0.6)
    # Seen against it, the front of the box is dark.
    canvas.glaze(Area(TALL_FRONT, feather=0.03), (0.80, 0.66, 0.60), stops=-1.8)

    # One light from the left, on the vase and what it stands on; a shadow falls to its right.
    canvas.glaze(Stroke([(0.66, 0.55), (0.66, 0.68)], size=0.13, hardness=0.3), gold, stops=1.5)
    canvas.glaze(Area(SHORT_TOP, feather=0.03), gold, stops=1.6)
    canvas.glaze(Area(SHORT_FRONT, feather=0.04), gold, stops=0.9)
    canvas.glaze(Stroke([(0.52, 0.95), (0.80, 0.95)], size=0.12), gold, stops=0.5)

    # The corners stay quiet.
    canvas.glaze(Stroke([(0.98, 0.10), (0.97, 0.45)], size=0.40), (0.9, 0.8, 0.7), stops=-0.8)
    return canvas


def paint_cool(template: Path) -> Canvas:
    """Night: the moon comes in at the window, and the ceiling light is off."""
    canvas = Canvas.read_template(template)
    moon, deep = (0.40, 0.66, 1.0), (0.34, 0.46, 0.85)

    # Night: everything goes down, and blue.
    canvas.glaze(Everywhere(), (0.15, 0.24, 0.72), stops=-2.4, opacity=0.3)

    # The moon falls in from the right: the fronts that face it, and the floor before them.
    canvas.glaze(Area(TALL_FRONT, feather=0.03), moon, stops=1.7)
    canvas.glaze(Area(SHORT_FRONT, feather=0.03), moon, stops=1.3)
    canvas.glaze(Stroke([(0.10, 0.93), (0.40, 0.95), (0.66, 0.95)], size=0.16), moon, stops=1.1)
    canvas.glaze(Stroke([(0.09, 0.38), (0.09, 0.82)], size=0.26), (0.55, 0.72, 1.0), stops=1.1)
    canvas.glaze(Stroke([(0.66, 0.54), (0.66, 0.66)], size=0.11, hardness=0.4), moon, stops=1.0)

    # What it cannot reach goes to near black: the ceiling, and the wall on the window's side.
    canvas.glaze(Area(CEILING, feather=0.08), deep, stops=-1.6)
    canvas.glaze(Area(RIGHT_WALL, feather=0.08), deep, stops=-1.8)
    canvas.glaze(Stroke([(0.70, 0.26), (0.76, 0.55)], size=0.30), deep, stops=-0.9)
    return canvas


def main() -> None:
    """Paint both over the template named on the command line."""
    template = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "template.exr"
    paint_warm(template).write_with_alpha(HERE / "warm.exr")
    cool = paint_cool(template)
    cool.write(HERE / "cool.exr")
    cool.write_mask(HERE / "cool.mask.exr")


if __name__ == "__main__":
    main()
