"""Paints six targets of the gallery over a clean picture of its current look.

    python targets/clean.py scenes/gallery/scene.xml -o targets/gallery/template.exr
    python targets/gallery/paint.py [template.exr]

writes beside itself

    evening.exr                     dusk, the works glow; alpha says how firmly each part is meant
    evening.png                     the same as a painter's program saves it, for `lightpaint demo`
    morning.exr, morning.mask.exr   the first sun, the lamps off; what was painted is in the mask
    opening.png                     opening night: everything that can shine does
    after-hours.png                 a lamp left on in the annex
    overcast.png                    a white sky and nothing else
    last-sun.png                    the sun goes down

These are paintings. Nothing was rendered of one light alone to make them: cones and distances say
where light would fall, as a painter constructs it, without shadows or anything reflected. Whether
the twelve lights of the scene can follow is the solver's question.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from brush import Area, Canvas, Color, Everywhere, Floats, Stroke  # noqa: E402
from clean import Surfaces  # noqa: E402
from room import Painted, Room, Vector  # noqa: E402


@dataclass(frozen=True)
class Spot:
    """Where a track spot hangs, what it points at, and its cone in degrees."""

    at: Vector
    towards: Vector
    cutoff: float
    full: float


SPOTS = {
    "field": Spot((-1.1, 3.55, 1.55), (-1.1, 1.55, 0.0), 45, 16),
    "tide": Spot((-1.8, 3.5, 2.95), (-3.4, 1.6, 2.95), 40, 14),
    "figure": Spot((-1.8, 3.5, 2.0), (-2.72, 1.1, 0.95), 22, 9),
    "knot": Spot((2.2, 3.5, 4.6), (1.28, 1.3, 3.0), 20, 9),
    "vase": Spot((2.2, 3.5, 3.4), (2.72, 1.2, 2.25), 20, 9),
}
PENDANT: Vector = (-0.75, 2.5, 3.35)
ANNEX_LAMP: Vector = (1.42, 1.55, -3.6)
SUN: Vector = (-0.80, -0.56, -0.20)
WINDOWS = (((3.4, 0.35, 1.8), (3.85, 3.05, 2.9)), ((3.4, 0.35, 4.2), (3.85, 3.05, 5.3)))
PLINTHS = (
    ((1.05, 0.0, 2.77), (1.51, 1.02, 3.23)),
    ((2.52, 0.0, 2.05), (2.92, 0.95, 2.45)),
    ((1.0, 1.02, 2.85), (1.56, 1.58, 3.15)),
    ((2.57, 0.95, 2.10), (2.87, 1.5, 2.40)),
)
SHADE = Stroke([(0.326, 0.3005), (0.371, 0.3005)], size=0.0075, hardness=0.2)
PANE = Area([(0.29, -0.1), (0.65, -0.1), (0.645, 0.068), (0.390, 0.106)], feather=0.006)

WARM, AMBER, BRONZE = (1.0, 0.70, 0.40), (1.0, 0.55, 0.22), (0.66, 0.43, 0.29)


def scaled(color: Color, amount: float) -> Color:
    """A colour, brighter or darker."""
    return (amount * color[0], amount * color[1], amount * color[2])


@dataclass
class Sheet:
    """A canvas over one room, and what is done to it in every mood."""

    canvas: Canvas
    room: Room
    template: Floats
    albedo: Floats

    @classmethod
    def over(cls, template: Path) -> Sheet:
        """A fresh one."""
        canvas, room = Canvas.read_template(template), Room(Surfaces.read(template).at_edges())
        # To a painter bronze has a colour; in the scene it has an index of refraction.
        bronze = room.within((0.8, 1.025, 2.5), (1.75, 1.8, 3.5)).amount[..., None]
        albedo = room.surfaces.albedo * (1 + bronze * (np.array(BRONZE, np.float32) - 1))
        return cls(canvas, room, canvas.image.copy(), albedo)

    def begin(self, tint: Color, stops: float, air: Color, *, share: float) -> None:
        """Underpainting: the current light goes down, and an even air takes its place."""
        self.canvas.glaze(Everywhere(), tint, stops=stops, say=0.3)
        self.canvas.wash(Everywhere(), self.albedo * air, opacity=share, say=0.0)

    def light(self, mark: Painted, color: Color, *, say: float = 1.0) -> None:
        """Light of a colour on what the mark covers."""
        self.canvas.light(mark, color, self.albedo, say=say)

    def spots(self, **colors: Color) -> None:
        """The track spots that are on, by the work that they light."""
        for name, color in colors.items():
            spot = SPOTS[name]
            self.light(
                self.room.beam(spot.at, spot.towards, cutoff=spot.cutoff, full=spot.full), color
            )
            # What the work throws back into the room.
            x, y, z = spot.towards
            inwards = (x + (0.5 if name == "tide" else 0.0), y, z + 0.5)
            self.light(self.room.glow(inwards, 1.2), scaled(color, 0.05), say=0.3)

    def pendant(self, color: Color) -> None:
        """The pool below the pendant, and the rim of its shade."""
        x, _, z = PENDANT
        pool = self.room.beam(PENDANT, (x, 0.45, z), cutoff=66, full=22)
        self.light(pool & self.room.within((-9, -1, -9), (9, 2.4, 9)), color)
        self.canvas.paint(SHADE, scaled(color, 1.6), opacity=0.9)
        self.light(self.room.glow((x, 0.4, z), 1.0), scaled(color, 0.10), say=0.3)

    def cove(self, color: Color) -> None:
        """The strip on its ledge along the left wall, over the ceiling."""
        high = self.room.within((-3.5, 3.14, -0.1), (9, 3.9, 10), soft=0.01)
        for z in (0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5):
            self.light(self.room.glow((-3.22, 3.2, z), 0.42, wrap=0.25) & high, color)
        self.light(self.room.facing((0.3, 1.0, 0.0)), scaled(color, 0.12), say=0.2)

    def skylight(self, sky: Color, falls: Color) -> None:
        """What stands in the pane, and what falls from it into the room."""
        self.canvas.wash(PANE, self.template * scaled(sky, 0.45))
        shaft = self.room.within((-1.2, 3.79, 1.7), (1.5, 4.52, 5.65), soft=0.02)
        self.light(shaft, scaled(sky, 0.55))
        if max(falls) > 0:
            down = self.room.glow((0.15, 4.3, 3.7), 2.6, wrap=0.12)
            self.light(down & ~shaft, falls, say=0.6)

    def annex(self, color: Color, *, lamp: bool) -> None:
        """The room behind the doorway, from its floor lamp or its window."""
        inside = self.room.within((-0.7, -0.1, -4.7), (4.3, 3.4, -0.01))
        at = ANNEX_LAMP if lamp else (3.9, 1.8, -2.2)
        self.light(self.room.glow(at, 1.1 if lamp else 1.7, wrap=0.35) & inside, color)

    def doorstep(self, color: Color) -> None:
        """What the annex sends through its doorway, over the boards of this room."""
        boards = self.room.within((0.9, -0.05, -0.3), (3.3, 0.03, 3.0), soft=0.06)
        self.light(self.room.glow((1.95, 0.6, 0.0), 0.75, wrap=0.0) & boards, color, say=0.8)

    def sun(self, color: Color, *, back: float) -> None:
        """Through both windows: on boards, plinths and reveals; and what that throws back."""
        for low, high in WINDOWS:
            beam = self.room.sunlight(SUN, (low, high), panes=(3, 2), blocks=PLINTHS)
            self.light(beam, color)
            there = (1.6, 0.0, (low[2] + high[2]) / 2 - 0.35)
            self.light(self.room.glow(there, 1.4, wrap=0.2), scaled(color, back), say=0.5)

    def windows(self, color: Color) -> None:
        """The reveals of the windows, as the sky lights them, and the wall across the room."""
        for low, high in WINDOWS:
            reveal = self.room.within(
                (low[0] - 0.02, low[1] - 0.05, low[2] - 0.05),
                (high[0] + 0.1, high[1] + 0.05, high[2] + 0.05),
            )
            self.light(reveal, color)
            at = (low[0] - 0.1, 1.7, (low[2] + high[2]) / 2)
            self.light(self.room.glow(at, 1.5, wrap=0.1) & ~reveal, scaled(color, 0.3), say=0.5)


def evening(sheet: Sheet) -> None:
    """The room is dark, the works glow, and the last blue of the day stands in the doorway."""
    sheet.begin((0.60, 0.75, 1.0), -4.2, (0.016, 0.020, 0.032), share=0.6)
    sheet.skylight((0.016, 0.034, 0.085), (0.006, 0.012, 0.030))
    sheet.windows((0.020, 0.040, 0.095))
    sheet.spots(
        field=scaled(WARM, 0.75),
        tide=scaled((1.0, 0.80, 0.56), 0.42),
        figure=scaled(WARM, 0.95),
        knot=scaled((1.0, 0.66, 0.34), 1.15),
        vase=scaled((1.0, 0.86, 0.66), 0.75),
    )
    sheet.pendant(scaled(AMBER, 0.60))
    sheet.annex((0.07, 0.15, 0.42), lamp=False)
    sheet.doorstep((0.03, 0.06, 0.16))


def morning(sheet: Sheet) -> None:
    """Low sun through the window wall, a clear sky, the lamps off."""
    sheet.begin((0.80, 0.92, 1.10), -0.9, (0.215, 0.25, 0.30), share=0.78)
    sheet.skylight((0.80, 0.95, 1.15), (0.08, 0.10, 0.13))
    sheet.windows((0.24, 0.27, 0.31))
    sheet.canvas.glaze(SHADE, stops=-1.5)
    sheet.sun((2.7, 2.0, 1.15), back=0.05)
    sheet.annex((0.10, 0.125, 0.16), lamp=False)


def opening(sheet: Sheet) -> None:
    """Opening night: a rose ceiling, white light on the works, a warm room beyond."""
    sheet.begin((1.0, 0.86, 0.78), -2.6, (0.10, 0.072, 0.068), share=0.6)
    sheet.skylight((0.010, 0.012, 0.030), (0.0, 0.0, 0.0))
    sheet.cove((1.15, 0.22, 0.40))
    white = (1.0, 0.88, 0.72)
    sheet.spots(
        field=scaled(white, 0.95),
        tide=scaled(white, 0.70),
        figure=scaled(white, 1.2),
        knot=scaled(white, 1.3),
        vase=scaled(white, 1.05),
    )
    sheet.pendant(scaled((1.0, 0.74, 0.46), 0.85))
    sheet.annex((1.25, 0.60, 0.30), lamp=True)
    sheet.doorstep((0.55, 0.27, 0.13))


def after_hours(sheet: Sheet) -> None:
    """Everybody has gone. A lamp burns in the annex; a little moon comes through the roof."""
    sheet.begin((0.50, 0.68, 1.0), -4.9, (0.013, 0.019, 0.034), share=0.6)
    sheet.skylight((0.055, 0.085, 0.15), (0.040, 0.062, 0.11))
    sheet.windows((0.030, 0.048, 0.085))
    sheet.annex((2.3, 1.0, 0.36), lamp=True)
    sheet.doorstep((1.3, 0.56, 0.20))
    sheet.light(
        sheet.room.beam((1.42, 1.5, -3.6), (2.2, 0.0, 1.6), cutoff=19, full=5)
        & sheet.room.within((0.5, -0.1, 0.0), (3.4, 2.0, 5.0)),
        (1.0, 0.43, 0.15),
    )


def overcast(sheet: Sheet) -> None:
    """A white sky: soft light from the roof and the front, cool and even, and no lamp on."""
    sheet.begin((0.86, 0.93, 1.0), -0.7, (0.25, 0.27, 0.29), share=0.78)
    sheet.skylight((0.95, 1.0, 1.06), (0.21, 0.23, 0.245))
    sheet.light(sheet.room.facing((0.1, 0.55, 0.8)), (0.055, 0.06, 0.064), say=0.4)
    sheet.windows((0.22, 0.235, 0.25))
    sheet.canvas.glaze(SHADE, stops=-1.5)
    sheet.annex((0.16, 0.175, 0.185), lamp=False)


def last_sun(sheet: Sheet) -> None:
    """The sun goes down: red gold on the boards, violet in the shade, rose overhead."""
    sheet.begin((0.72, 0.60, 0.92), -2.7, (0.058, 0.042, 0.066), share=0.8)
    sheet.skylight((0.34, 0.17, 0.26), (0.035, 0.020, 0.036))
    sheet.windows((0.16, 0.060, 0.040))
    sheet.sun((3.4, 1.15, 0.24), back=0.06)
    sheet.light(sheet.room.glow((-3.0, 1.4, 3.4), 2.2), (0.11, 0.040, 0.014), say=0.4)
    sheet.annex((0.34, 0.15, 0.11), lamp=False)
    sheet.doorstep((0.06, 0.025, 0.016))


def main() -> None:
    """Paint all six over the template named on the command line."""
    template = Path(sys.argv[1]) if len(sys.argv) > 1 else HERE / "template.exr"
    for mood in (evening, morning, opening, after_hours, overcast, last_sun):
        sheet = Sheet.over(template)
        mood(sheet)
        name = mood.__name__.replace("_", "-")
        if mood is evening:
            sheet.canvas.write_with_alpha(HERE / f"{name}.exr")
            sheet.canvas.write_png(HERE / f"{name}.png")
        elif mood is morning:
            sheet.canvas.write(HERE / f"{name}.exr")
            sheet.canvas.write_mask(HERE / f"{name}.mask.exr")
        else:
            sheet.canvas.write_png(HERE / f"{name}.png")


if __name__ == "__main__":
    main()
