"""Paint the targets of the stage over renders of it as it is now.

    python targets/clean.py scenes/stage/scene.xml -o targets/stage/template.exr
    python targets/clean.py scenes/stage/scene.xml -s box -o targets/stage/box-template.exr
    python targets/stage/paint.py

Writes, beside this file:

    moonlight.exr                 night, a lantern, a house still awake; its alpha says where
    sunset.exr, sunset.mask.exr   the sun goes down behind the house; the mask says where
    moonlight-box.exr             that night as it is to be seen from the box at the side

The templates are clean pictures of 640 x 360, beside this file. The
strokes are placed by eye; no pixel comes from a render of one light alone.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))  # brush.py lives one folder up

from brush import Area, Canvas, Everywhere, Gradient, Mark, Stroke  # noqa: E402
from clean import Surfaces  # noqa: E402
from room import Room  # noqa: E402


@dataclass(frozen=True)
class Within:
    """A mark that stops at the edge of another, as with masking tape."""

    mark: Mark
    tape: Mark

    def coverage(self, height: int, width: int) -> NDArray[np.float32]:
        """Returns (height, width) in [0, 1]."""
        return self.mark.coverage(height, width) * self.tape.coverage(height, width)


@dataclass(frozen=True)
class Outside:
    """Everything that a mark leaves bare."""

    mark: Mark

    def coverage(self, height: int, width: int) -> NDArray[np.float32]:
        """Returns (height, width) in [0, 1]."""
        return 1 - self.mark.coverage(height, width)


# Where things are in the picture: x to the right, y down, both from 0 to 1.
WOMAN = Area(
    [
        *((0.457, 0.596), (0.471, 0.599), (0.496, 0.597), (0.505, 0.583), (0.513, 0.566)),
        *((0.525, 0.559), (0.521, 0.535), (0.525, 0.508), (0.531, 0.502), (0.539, 0.510)),
        *((0.541, 0.535), (0.538, 0.558), (0.552, 0.565), (0.565, 0.604), (0.563, 0.632)),
        *((0.556, 0.646), (0.594, 0.860), (0.478, 0.860), (0.512, 0.652), (0.509, 0.618)),
        *((0.496, 0.624), (0.476, 0.614), (0.457, 0.607)),
    ],
    feather=0.004,
)
CYC = Area(
    [
        *((0.128, 0.65), (0.128, 0.40), (0.225, 0.085), (0.775, 0.085), (0.826, 0.30)),
        *((0.826, 0.36), (0.70, 0.222), (0.595, 0.335), (0.595, 0.63), (0.50, 0.635)),
        *((0.36, 0.62), (0.25, 0.635)),
    ],
    feather=0.012,
)
SKY = Within(CYC, Outside(WOMAN))
DOORWAY = Area(
    [
        *((0.693, 0.68), (0.693, 0.411), (0.705, 0.412), (0.716, 0.420), (0.726, 0.438)),
        *((0.734, 0.463), (0.738, 0.49), (0.738, 0.68)),
    ],
    feather=0.004,
)
HOUSE = Area(
    [(0.593, 0.68), (0.593, 0.335), (0.70, 0.222), (0.815, 0.34), (0.815, 0.69), (0.755, 0.69)],
    feather=0.01,
)
BOARDS = Area([(0.06, 0.92), (0.12, 0.75), (0.88, 0.79), (0.94, 0.92)], feather=0.05)
CURTAIN_LEFT = Area([(0, 0), (0.24, 0.06), (0.06, 0.58), (0.07, 0.88), (0, 0.88)], feather=0.03)
CURTAIN_RIGHT = Area([(1, 0), (0.77, 0.06), (0.94, 0.58), (0.92, 0.86), (1, 0.86)], feather=0.03)
VALANCE = Area([(0, 0), (1, 0), (1, 0.09), (0, 0.09)], feather=0.03)
GOWN = Area([(0.513, 0.57), (0.555, 0.57), (0.585, 0.84), (0.485, 0.85)], feather=0.012)
CLOTH = Area([(0.345, 0.715), (0.43, 0.715), (0.445, 0.83), (0.333, 0.84)], feather=0.012)
STEPS = Area([(0.66, 0.695), (0.74, 0.68), (0.745, 0.725), (0.655, 0.725)], 0.015)
DOORSTEP = Area([(0.645, 0.82), (0.755, 0.82), (0.76, 0.89), (0.60, 0.89)], 0.012)
MOON, FLAME = (0.378, 0.279), (0.3906, 0.6885)
LANTERN = (-1.11, 0.93, -0.73)


def paint_moonlight(template: Path) -> Canvas:
    """Night: the moon over the tree, a lantern on the table, a house that is still awake."""
    canvas, room = Canvas.read_template(template), Room(Surfaces.read(template))
    albedo, below = room.surfaces.albedo, Outside(CYC)
    night, moon = (0.30, 0.50, 1.0), (0.60, 0.82, 1.0)

    # Night falls over everything. A wash is only a hint: it gets little say.
    canvas.glaze(Everywhere(), night, stops=-1.6)
    canvas.glaze(Outside(CYC), (0.66, 0.76, 1.0), stops=-0.4)
    canvas.weight[:] = 0.2

    # The sky: deepest at the top, a breath of green-blue where it meets the hills.
    canvas.glaze(SKY, (0.45, 0.70, 1.0), stops=-0.3)
    canvas.glaze(Within(Gradient((0.5, 0.08), (0.5, 0.50)), SKY), (0.50, 0.65, 1.0), stops=-0.7)
    canvas.glaze(
        Within(Stroke([(0.12, 0.62), (0.60, 0.62)], size=0.24), SKY), (0.62, 1.0, 1.0), stops=1.1
    )
    # The moon and its halo.
    canvas.glaze(Within(Stroke([MOON], size=0.34), SKY), moon, stops=0.9)
    canvas.paint(Stroke([MOON], size=0.070, hardness=0.75), (0.62, 0.76, 0.86), opacity=0.92)

    # Moonlight comes from behind, on the left: along the boards, the tree, her shoulder.
    behind = room.beam((-3.6, 5.6, -4.0), (0.0, 0.4, -0.2), cutoff=30, full=8)
    canvas.light(behind & below, (0.10, 0.17, 0.30), albedo)
    canvas.glaze(Stroke([(0.228, 0.77), (0.232, 0.55), (0.225, 0.40)], size=0.03), moon, stops=1.2)
    canvas.glaze(Stroke([(0.60, 0.36), (0.70, 0.235), (0.80, 0.33)], size=0.035), moon, stops=0.9)

    # The lantern: a pool on the cloth and the boards, its warmth on her, the chair and the tree.
    canvas.light(room.glow(LANTERN, 0.32, wrap=0.10) & below, (1.3, 0.43, 0.09), albedo)
    around = room.within((-3.0, -0.5, -2.2), (1.2, 2.4, 1.0), soft=1.6)
    canvas.light(room.glow(LANTERN, 1.0, wrap=0.02) & around & below, (1.9, 0.58, 0.11), albedo)
    canvas.glaze(Within(Stroke([(0.39, 0.72)], size=0.16), CLOTH), (1.0, 0.38, 0.09), stops=2.2)

    # Its flame is as bright as it has to be for that.
    canvas.paint(Stroke([FLAME], size=0.011, hardness=0.7), (24.0, 11.0, 2.8))

    # Somebody is at home: a low light through the arch, down the steps, over the boards.
    canvas.paint(DOORWAY, (0.085, 0.036, 0.014), opacity=0.8)
    home = room.beam((3.55, 3.4, -6.1), (2.2, 0.5, -2.4), cutoff=28, full=18)
    canvas.light(home & STEPS, (3.6, 1.15, 0.20), albedo)
    canvas.light(home & DOORSTEP, (3.6, 1.15, 0.20), albedo)

    # The cloth that frames it all almost disappears.
    for frame in (CURTAIN_LEFT, CURTAIN_RIGHT, VALANCE):
        canvas.glaze(frame, (0.8, 0.7, 1.0), stops=-1.0)
    canvas.glaze(HOUSE, (0.75, 0.85, 1.0), stops=-0.5, opacity=0.7)
    return canvas


def paint_moonlight_from_the_box(template: Path) -> Canvas:
    """The same night from the side, where the lantern is near and the velvet is in the way."""
    canvas = Canvas.read_template(template)
    night, moon = (0.30, 0.50, 1.0), (0.60, 0.82, 1.0)
    candle, ember = (1.0, 0.38, 0.09), (1.0, 0.32, 0.06)
    sky = Area(
        [
            (0.17, 0),
            (0.41, 0),
            (0.40, 0.59),
            (0.30, 0.63),
            (0.12, 0.57),
            (0.02, 0.55),
            (0.06, 0.25),
        ],
        feather=0.02,
    )
    boards = Area([(0, 0.82), (0.22, 0.72), (0.72, 0.68), (0.94, 0.74), (0.5, 1), (0, 1)], 0.05)
    doorway = Area([(0.475, 0.53), (0.475, 0.30), (0.50, 0.24), (0.55, 0.28), (0.555, 0.53)], 0.015)

    canvas.glaze(Everywhere(), night, stops=-1.6)
    canvas.glaze(Outside(sky), (0.66, 0.76, 1.0), stops=-0.4)
    canvas.weight[:] = 0.2
    # The moon is out of sight; what it does to the sky and along the boards is not.
    canvas.glaze(Within(Stroke([(0.10, 0.55), (0.40, 0.58)], size=0.24), sky), moon, stops=0.9)
    canvas.glaze(Within(Stroke([(0.10, 0.90), (0.30, 0.76)], size=0.16), boards), moon, stops=1.3)
    canvas.glaze(Stroke([(0.43, 0.10), (0.43, 0.40)], size=0.04), moon, stops=0.9)
    # The lantern: on the cloth, up her gown and sleeve, over the boards around the table.
    canvas.glaze(Stroke([(0.355, 0.60)], size=0.30), candle, stops=1.7)
    canvas.glaze(Area([(0.30, 0.69), (0.42, 0.70), (0.43, 0.86), (0.29, 0.87)], 0.02), candle,
                 stops=2.0)  # fmt: skip
    canvas.glaze(Stroke([(0.495, 0.58), (0.485, 0.80)], size=0.06), candle, stops=2.4)
    canvas.glaze(Within(Stroke([(0.25, 0.90), (0.50, 0.88)], size=0.12), boards), candle, stops=1.0)
    # Its flame is the same flame.
    canvas.paint(Stroke([(0.3585, 0.670)], size=0.019, hardness=0.8), (24.0, 11.0, 2.8))
    # The house is awake.
    canvas.glaze(doorway, ember, stops=1.6)
    # And the velvet keeps to itself.
    for velvet in (
        Area([(0.78, 0), (1, 0), (1, 0.68), (0.86, 0.74)], feather=0.03),
        Area([(0, 0), (0.17, 0), (0.06, 0.26), (0, 0.30)], feather=0.03),
    ):
        canvas.glaze(velvet, (0.8, 0.7, 1.0), stops=-1.2)
    return canvas


def paint_sunset(template: Path) -> Canvas:
    """The last of the sun, low behind the house; she has come out to see it."""
    canvas = Canvas.read_template(template)
    gold, orange, rose = (1.0, 0.66, 0.24), (1.0, 0.46, 0.12), (1.0, 0.42, 0.40)
    violet, dusk = (0.50, 0.40, 0.95), (0.72, 0.62, 1.0)

    # The day's light is nearly gone; what is left of it is warm.
    canvas.glaze(Everywhere(), (1.0, 0.70, 0.58), stops=-1.0)
    canvas.weight[:] = 0.2

    # The sky, from violet at the top through rose to gold on the hills, and brighter to the right.
    sky = canvas.image[90:112, 282:300].mean(axis=(0, 1))
    canvas.paint(Stroke([MOON], size=0.13, hardness=0.55), (sky[0], sky[1], sky[2]))
    canvas.glaze(Within(Gradient((0.4, 0.10), (0.4, 0.48)), SKY), violet, stops=0.2)
    canvas.glaze(Within(Stroke([(0.10, 0.40), (0.90, 0.40)], size=0.20), SKY), rose, stops=0.7)
    canvas.glaze(Within(Stroke([(0.10, 0.60), (0.62, 0.60)], size=0.24), SKY), orange, stops=1.4)
    canvas.glaze(Within(Stroke([(0.45, 0.62), (0.62, 0.62)], size=0.22), SKY), gold, stops=1.0)
    canvas.glaze(Within(Stroke([(0.82, 0.60), (0.82, 0.42)], size=0.08), SKY), orange, stops=0.9)

    # The sun itself stands in the doorway, runs down the steps and out over the boards.
    canvas.glaze(DOORWAY, (1.0, 0.70, 0.26), stops=2.4)
    canvas.glaze(Area([(0.655, 0.695), (0.745, 0.68), (0.75, 0.725), (0.645, 0.725)], 0.02), gold,
                 stops=2.2)  # fmt: skip
    canvas.glaze(Area([(0.64, 0.82), (0.76, 0.82), (0.765, 0.89), (0.57, 0.89)], 0.03), gold,
                 stops=1.7)  # fmt: skip
    canvas.glaze(
        Within(Stroke([(0.30, 0.90), (0.60, 0.88), (0.82, 0.85)], size=0.15), BOARDS),
        orange,
        stops=1.0,
    )
    # Against it the front of the house is in shade.
    canvas.glaze(Within(HOUSE, Outside(DOORWAY)), dusk, stops=-0.9)

    # It catches her from the right: shoulder, sleeve, the fall of the gown. Her left side cools.
    canvas.glaze(
        Within(Stroke([(0.560, 0.57), (0.566, 0.66), (0.590, 0.84)], size=0.060), WOMAN),
        gold,
        stops=2.2,
    )
    canvas.glaze(Stroke([(0.536, 0.52), (0.537, 0.55)], size=0.022), gold, stops=1.6)
    canvas.glaze(Within(Stroke([(0.508, 0.60), (0.497, 0.84)], size=0.06), GOWN), dusk, stops=-0.7)
    canvas.glaze(Within(Stroke([(0.43, 0.73), (0.44, 0.82)], size=0.06), CLOTH), gold, stops=1.0)
    canvas.glaze(Within(Stroke([(0.345, 0.74), (0.34, 0.84)], size=0.08), CLOTH), dusk, stops=-0.8)
    # The tree is a silhouette with one warm edge.
    canvas.glaze(Stroke([(0.228, 0.77), (0.232, 0.52)], size=0.04), dusk, stops=-0.8)
    canvas.glaze(Stroke([(0.250, 0.77), (0.250, 0.60), (0.27, 0.50)], size=0.02), gold, stops=1.0)

    # Footlights on the velvet: the frame glows.
    for frame in (CURTAIN_LEFT, CURTAIN_RIGHT):
        canvas.glaze(frame, (1.0, 0.75, 0.60), stops=0.5)
    return canvas


def main() -> None:
    """Paint all of them over the templates beside this file."""
    template = HERE / "template.exr"
    paint_moonlight(template).write_with_alpha(HERE / "moonlight.exr")
    sunset = paint_sunset(template)
    sunset.write(HERE / "sunset.exr")
    sunset.write_mask(HERE / "sunset.mask.exr")
    box = paint_moonlight_from_the_box(HERE / "box-template.exr")
    box.write_with_alpha(HERE / "moonlight-box.exr")


if __name__ == "__main__":
    main()
