"""Paint the target of the table over a render of it as it is now.

    python targets/clean.py scenes/table/scene.xml -o targets/table/template.exr
    python targets/table/paint.py

Writes, beside this file:

    sunset.png      the sun goes down on the left, as seen on a screen: what is white there may be
                    brighter

The template is a clean picture of 640 x 360, beside this file. The strokes are placed by eye; no
pixel comes from a render under another sky.
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))  # brush.py lives one folder up

from brush import Canvas, Everywhere, Gradient, Stroke  # noqa: E402
from clean import Surfaces  # noqa: E402
from room import Painted, Room  # noqa: E402

#: Light and shade.
GOLD, EMBER, ROSE = (1.0, 0.62, 0.26), (1.0, 0.44, 0.14), (1.0, 0.60, 0.55)
DUSK, BLUE = (0.62, 0.74, 1.0), (0.50, 0.68, 1.0)
#: Where the sun is, seen from the table: low, on the left.
SUN = (-0.93, 0.25, 0.0)


def paint_sunset(template: Path) -> Canvas:
    """The sun on the left and low, and a sky that is dark overhead."""
    canvas, room = Canvas.read_template(template), Room(Surfaces.read(template))
    albedo = room.surfaces.albedo

    # The day's light is nearly gone, and what falls from overhead is blue.
    canvas.glaze(Everywhere(), BLUE, stops=-1.4)

    # The sun rakes over everything that faces it; the left is brighter than the right.
    sunny = _facing(room, SUN)
    canvas.light(sunny & Gradient((-0.6, 0.5), (1.5, 0.5)), (1.6, 0.66, 0.18), albedo)
    # Beyond the table it is darker, but for one warm edge of each post.
    beyond = ~room.within((-0.9, 0, -0.8), (0.9, 2, 0.9), soft=0.1)
    canvas.glaze(beyond, DUSK, stops=-0.5)
    canvas.light(sunny & beyond, (0.5, 0.20, 0.05), albedo)

    # The table's far left shines: there the low sky lies in the lacquer.
    top = room.within((-0.7, 0.73, -0.7), (0.7, 0.741, 0.7), soft=0.004)
    far = _painted(Stroke([(0.0, 0.47), (0.28, 0.41), (0.45, 0.39)], size=0.12))
    canvas.glaze(far & top, EMBER, stops=2.6)
    near = _painted(Stroke([(0.02, 0.72), (0.20, 0.78)], size=0.16))
    canvas.glaze(near & top, ROSE, stops=0.7)
    # Shade to the right of things, on the linen and the wood.
    for shade in (
        Stroke([(0.49, 0.56), (0.57, 0.595), (0.61, 0.60)], size=0.05),
        Stroke([(0.82, 0.60), (0.90, 0.625), (0.98, 0.64)], size=0.06),
        Stroke([(0.245, 0.665), (0.31, 0.685)], size=0.035),
        Stroke([(0.66, 0.745), (0.72, 0.76)], size=0.035),
        Stroke([(0.885, 0.70), (0.95, 0.725)], size=0.035),
    ):
        canvas.glaze(shade, DUSK, stops=-0.9)

    # The silver shows the sky as it is: gold on the left, blue above, dark on the right.
    pot = room.within((-0.36, 0.746, -0.33), (0.13, 1.0, 0.13), soft=0.004)
    canvas.glaze(_painted(Stroke([(0.333, 0.42), (0.333, 0.49)], size=0.05)) & pot, GOLD, stops=5)
    canvas.glaze(_painted(Stroke([(0.38, 0.30), (0.36, 0.36)], size=0.04)) & pot, EMBER, stops=2)
    canvas.glaze(_painted(Stroke([(0.46, 0.42), (0.465, 0.52)], size=0.07)) & pot, BLUE, stops=-0.8)
    canvas.glaze(Stroke([(0.272, 0.43), (0.270, 0.385)], size=0.010), GOLD, stops=3)
    canvas.glaze(Stroke([(0.518, 0.46), (0.535, 0.36), (0.553, 0.32)], size=0.010), GOLD, stops=3)
    # So do the glaze, the china and the peel, a little.
    canvas.glaze(Stroke([(0.635, 0.48), (0.66, 0.56)], size=0.026), EMBER, stops=2.2)
    canvas.glaze(Stroke([(0.672, 0.45), (0.678, 0.49)], size=0.030), GOLD, stops=1.6)
    canvas.glaze(Stroke([(0.822, 0.62), (0.824, 0.67)], size=0.030), GOLD, stops=1.6)
    canvas.glaze(Stroke([(0.135, 0.60), (0.145, 0.67)], size=0.022), GOLD, stops=1.6)
    canvas.glaze(Stroke([(0.548, 0.67), (0.556, 0.74)], size=0.022), GOLD, stops=1.6)

    return canvas


def _facing(room: Room, direction: tuple[float, float, float]) -> Painted:
    """Surfaces that face a direction, and none that turn away from it."""
    return Painted((2 * room.facing(direction).amount - 1).clip(0, 1))


def _painted(stroke: Stroke) -> Painted:
    """A stroke over this picture, to tape off."""
    return Painted(stroke.coverage(360, 640))


def main() -> None:
    """Paint it over the template beside this file."""
    paint_sunset(HERE / "template.exr").write_png(HERE / "sunset.png")


if __name__ == "__main__":
    main()
