"""Paints the two targets of the gallery over its current look, stroke by stroke.

    lightpaint template scenes/gallery/scene.xml -o targets/gallery/template.exr
    python targets/gallery/paint.py [template.exr]

writes beside itself

    evening.exr                     the room at dusk; alpha says what was painted and how firmly
    morning.exr, morning.mask.exr   the first sun; what was painted is in the mask

These are paintings. No light was rendered on its own to make them; each stroke puts brightness and
colour where it would please the eye and where some light could perhaps put it. Whether the twelve
lights of the scene can follow is the solver's question.
"""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from brush import Area, Canvas, Everywhere, Gradient, Stroke  # noqa: E402

# Where things are in the picture. Points are fractions of its width and height.
FIELD = Area([(0.345, 0.338), (0.563, 0.334), (0.563, 0.622), (0.345, 0.612)], feather=0.012)
TIDE_LEFT = Area([(0.0, 0.295), (0.112, 0.330), (0.112, 0.630), (0.0, 0.648)], feather=0.012)
TIDE_RIGHT = Area([(0.124, 0.334), (0.207, 0.358), (0.207, 0.608), (0.124, 0.626)], feather=0.012)
DOORWAY = Area([(0.647, 0.325), (0.761, 0.322), (0.761, 0.70), (0.647, 0.70)], feather=0.008)
SKYLIGHT = Area([(0.29, -0.1), (0.65, -0.1), (0.645, 0.068), (0.390, 0.106)], feather=0.012)
WINDOW_FAR = Area([(0.881, 0.182), (0.914, 0.130), (0.914, 0.795), (0.881, 0.753)], feather=0.008)
WINDOW_NEAR = Area([(0.984, -0.02), (1.05, -0.1), (1.05, 1.0), (0.984, 0.905)], feather=0.008)
COVE = Stroke([(-0.02, 0.04), (0.15, 0.155), (0.30, 0.245)], size=0.12)
BRONZE = Area(
    [
        (0.569, 0.505),
        (0.582, 0.478),
        (0.612, 0.500),
        (0.640, 0.478),
        (0.650, 0.505),
        (0.643, 0.55),
        (0.628, 0.618),
        (0.598, 0.618),
        (0.580, 0.56),
    ]
)
BRONZE_PLINTH = Area([(0.577, 0.625), (0.641, 0.625), (0.641, 0.868), (0.577, 0.865)])
VASE = Area(
    [
        (0.793, 0.497),
        (0.808, 0.497),
        (0.812, 0.53),
        (0.823, 0.56),
        (0.822, 0.60),
        (0.812, 0.63),
        (0.790, 0.63),
        (0.778, 0.60),
        (0.776, 0.565),
        (0.788, 0.53),
    ]
)
VASE_PLINTH = Area([(0.773, 0.635), (0.829, 0.635), (0.829, 0.842), (0.773, 0.842)])
FIGURE = Area(
    [
        (0.292, 0.475),
        (0.302, 0.475),
        (0.304, 0.53),
        (0.313, 0.60),
        (0.314, 0.668),
        (0.282, 0.668),
        (0.279, 0.56),
        (0.287, 0.51),
    ]
)
FIGURE_PLINTH = Area([(0.264, 0.673), (0.324, 0.668), (0.324, 0.722), (0.264, 0.729)])
BENCH = Area([(0.248, 0.735), (0.284, 0.728), (0.453, 0.752), (0.441, 0.774), (0.256, 0.757)])
SUN_FAR_LEFT = Area([(0.470, 0.745), (0.573, 0.766), (0.573, 0.806), (0.455, 0.782)], feather=0.012)
SUN_FAR_RIGHT = Area(
    [(0.646, 0.781), (0.769, 0.806), (0.769, 0.850), (0.646, 0.822)], feather=0.012
)
SUN_NEAR = Area(
    [(0.392, 0.845), (0.900, 0.968), (0.900, 1.06), (0.535, 0.990), (0.335, 0.910)], feather=0.012
)

WARM = (1.0, 0.72, 0.42)
AMBER = (1.0, 0.58, 0.26)
DUSK = (0.42, 0.58, 1.0)


def paint_evening(canvas: Canvas) -> None:
    """The room is dark, the works glow, and the last blue of the day stands in the doorway."""
    # An underpainting for the eye only: everything sinks into dusk.
    canvas.glaze(Everywhere(), (0.78, 0.86, 1.0), stops=-2.2, say=0.0)

    # Darkness that is meant: the skylight, the ceiling, the cove, the windows, the floor in front.
    canvas.glaze(SKYLIGHT, (0.50, 0.66, 1.0), stops=-2.0, say=0.8)
    canvas.glaze(COVE, stops=-1.2, say=0.6)
    canvas.glaze(Stroke([(0.62, 0.16), (0.85, 0.20)], size=0.16), stops=-0.5, say=0.5)
    canvas.glaze(WINDOW_FAR, DUSK, stops=-0.6, say=0.8)
    canvas.glaze(WINDOW_NEAR, DUSK, stops=-0.6, say=0.8)
    canvas.glaze(Stroke([(0.50, 0.95), (0.95, 0.99)], size=0.13), stops=-0.6, say=0.6)
    canvas.glaze(Stroke([(0.02, 0.93), (0.22, 0.98)], size=0.12), stops=-0.4, say=0.5)

    # The big canvas: a scallop of warm light on the wall above it, strongest at the top.
    canvas.glaze(Stroke([(0.385, 0.29), (0.455, 0.25), (0.525, 0.29)], size=0.13), WARM, stops=2.2)
    canvas.glaze(FIELD, WARM, stops=2.9)
    canvas.glaze(Stroke([(0.38, 0.39), (0.53, 0.39)], size=0.10), WARM, stops=0.5)
    canvas.glaze(Stroke([(0.37, 0.66), (0.54, 0.675)], size=0.05), WARM, stops=1.3, opacity=0.8)

    # The pair on the left, calmer, and the wall round it.
    canvas.glaze(Stroke([(0.0, 0.24), (0.10, 0.28), (0.19, 0.33)], size=0.10), WARM, stops=1.9)
    canvas.glaze(TIDE_LEFT, (1.0, 0.80, 0.56), stops=2.4)
    canvas.glaze(TIDE_RIGHT, (1.0, 0.80, 0.56), stops=2.4)

    # The stone figure, lit from the upper right.
    canvas.glaze(FIGURE, WARM, stops=2.1)
    canvas.glaze(Stroke([(0.300, 0.50), (0.305, 0.60)], size=0.03), WARM, stops=0.7)
    canvas.glaze(FIGURE_PLINTH, WARM, stops=1.5)

    # The bronze is the brightest thing in the room; its light runs down the plinth onto the floor.
    canvas.glaze(BRONZE, AMBER, stops=3.4)
    canvas.glaze(BRONZE_PLINTH, WARM, stops=2.0)
    canvas.glaze(Stroke([(0.585, 0.66), (0.632, 0.66)], size=0.06), WARM, stops=0.5)
    canvas.glaze(Stroke([(0.52, 0.88), (0.60, 0.93), (0.68, 0.90)], size=0.10), AMBER, stops=2.2)

    # The vase keeps its own green: a whiter light.
    canvas.glaze(VASE, (1.0, 0.88, 0.70), stops=2.6)
    canvas.glaze(VASE_PLINTH, WARM, stops=1.5)
    canvas.glaze(Stroke([(0.77, 0.87), (0.84, 0.875)], size=0.06), WARM, stops=1.3, opacity=0.9)

    # The pendant draws an amber pool over the bench.
    canvas.glaze(BENCH, AMBER, stops=2.6)
    canvas.glaze(Stroke([(0.22, 0.85), (0.33, 0.88), (0.45, 0.85)], size=0.16), AMBER, stops=2.0)

    # The cool note: dusk in the annex, and a little of it on the boards this side of the door.
    canvas.glaze(DOORWAY, DUSK, stops=2.5)
    canvas.glaze(Stroke([(0.705, 0.72), (0.715, 0.80)], size=0.07), DUSK, stops=1.3, opacity=0.8)


def paint_morning(canvas: Canvas) -> None:
    """Low sun through the window wall, a clear sky, the lamps off."""
    # Cool air everywhere, for the eye only; brighter towards the windows.
    canvas.glaze(Everywhere(), (0.74, 0.88, 1.08), stops=-0.35, say=0.0)
    canvas.glaze(Gradient((1.0, 0.4), (0.2, 0.6)), (1.0, 0.98, 0.95), stops=0.3, say=0.0)

    # The sky: in the skylight, and softly over the left wall, the back wall and the pictures.
    canvas.glaze(SKYLIGHT, (0.86, 0.96, 1.05), stops=0.1, say=0.7)
    canvas.glaze(
        Stroke([(0.0, 0.75), (0.20, 0.68)], size=0.12), (0.90, 1.0, 1.06), stops=0.3, say=0.7
    )
    canvas.glaze(TIDE_LEFT, (0.92, 1.0, 1.08), stops=0.2, say=0.8)
    canvas.glaze(TIDE_RIGHT, (0.92, 1.0, 1.08), stops=0.2, say=0.8)
    canvas.glaze(FIELD, (1.0, 1.0, 1.0), stops=0.1, say=0.8)
    canvas.glaze(
        Stroke([(0.66, 0.20), (0.83, 0.26)], size=0.12), (0.92, 1.0, 1.06), stops=0.2, say=0.6
    )

    # Lamps off: the cove, the scallop over the big canvas, the inside of the pendant.
    canvas.glaze(COVE, (0.95, 1.0, 1.05), stops=-1.7)
    canvas.glaze(Stroke([(0.39, 0.29), (0.455, 0.255), (0.525, 0.29)], size=0.09), stops=-0.45)
    canvas.glaze(Stroke([(0.325, 0.303), (0.372, 0.303)], size=0.024), stops=-1.6)

    # The sun: on the boards in two long patches, on the reveals, on the plinth and the vase.
    gold = (1.0, 0.76, 0.45)
    canvas.glaze(SUN_FAR_LEFT, gold, stops=2.3)
    canvas.glaze(SUN_FAR_RIGHT, gold, stops=2.3)
    canvas.glaze(SUN_NEAR, gold, stops=2.3)
    canvas.glaze(WINDOW_FAR, gold, stops=1.2)
    canvas.glaze(WINDOW_NEAR, gold, stops=1.2)
    canvas.glaze(
        Area([(0.776, 0.64), (0.829, 0.64), (0.829, 0.69), (0.776, 0.74)], feather=0.01),
        gold,
        stops=2.0,
    )
    canvas.glaze(
        Area([(0.776, 0.775), (0.829, 0.72), (0.829, 0.84), (0.776, 0.84)], feather=0.01),
        gold,
        stops=2.0,
    )
    canvas.glaze(Stroke([(0.807, 0.53), (0.812, 0.59)], size=0.024, hardness=0.2), gold, stops=2.0)

    # What the sunny floor throws back: warm on the bronze, its plinth and the foot of the wall.
    canvas.glaze(BRONZE, gold, stops=0.8)
    canvas.glaze(BRONZE_PLINTH, (1.0, 0.88, 0.72), stops=0.4)
    canvas.glaze(
        Stroke([(0.38, 0.68), (0.54, 0.69)], size=0.06), (1.0, 0.88, 0.72), stops=0.4, say=0.7
    )

    # The annex still sleeps: a cool, quiet doorway.
    canvas.glaze(DOORWAY, (0.80, 0.94, 1.10), stops=0.1, say=0.8)


def main() -> None:
    """Paint both targets over the template named on the command line."""
    template = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "template.exr"

    evening = Canvas.read_template(template)
    paint_evening(evening)
    evening.write_with_alpha(HERE / "evening.exr")

    morning = Canvas.read_template(template)
    paint_morning(morning)
    morning.write(HERE / "morning.exr")
    morning.write_mask(HERE / "morning.mask.exr")


if __name__ == "__main__":
    main()
