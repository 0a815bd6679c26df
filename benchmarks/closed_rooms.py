"""Closed rooms by seed, with furniture and known lights, for benchmarks that look for others."""

from pathlib import Path

import numpy as np

from lightpaint.arrays import Doubles

#: Colours of walls, floor and furniture.
_COLOURS = ("0.72 0.70 0.66", "0.55 0.15 0.1", "0.15 0.25 0.5", "0.35 0.55 0.3", "0.6 0.5 0.3")

_ROOM = """<scene version="3.0.0">
    <default name="width" value="{width}"/>
    <default name="height" value="{height}"/>
    <integrator type="path"><integer name="max_depth" value="6"/></integrator>
{sensors}
{shapes}
{lights}
</scene>
"""

_SENSOR = """    <sensor type="perspective" id="{name}">
        <float name="fov" value="{fov}"/>
        <string name="fov_axis" value="x"/>
        <transform name="to_world">
            <lookat origin="{eye}" target="{target}" up="0, 1, 0"/></transform>
        <sampler type="independent"><integer name="sample_count" value="64"/></sampler>
        <film type="hdrfilm"><integer name="width" value="$width"/>
            <integer name="height" value="$height"/><rfilter type="box"/></film>
    </sensor>"""

_DIFFUSE = (
    '<bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value="{}"/></bsdf></bsdf>'
)
_GLOSSY = (
    '<bsdf type="twosided"><bsdf type="roughplastic"><float name="alpha" value="{}"/>'
    '<rgb name="diffuse_reflectance" value="{}"/></bsdf></bsdf>'
)


class ClosedRoom:
    """A room of random size with a table, a column, a shelf and two balls, seen from a corner.

    low, high: (3,), corners of the room. box: (2, 3), where lights may hang.
    """

    def __init__(self, seed: int, *, is_wide: bool = False) -> None:
        self._rng = rng = np.random.default_rng([26, seed])
        self.high = np.array([rng.uniform(2.6, 3.4), rng.uniform(2.7, 3.4), 5.0])
        self.low = np.array([-self.high[0], 0.0, -rng.uniform(2.2, 3.0)])
        self.box = np.array([self.low + 0.2, self.high - 0.2])
        self._solids: list[tuple[Doubles, Doubles]] = []
        self._shapes: list[str] = []
        self._is_wide = is_wide
        self._walls()
        self._furniture()

    def free_place(self, *others: Doubles, front: float = 3.6) -> Doubles:
        """Return a random place in the box that is clear of furniture, and 1 m off `others`."""
        while True:
            place = self._rng.uniform(self.box[0], self.box[1])
            is_inside = any(
                np.all(np.abs(place - middle) < half + 0.15) for middle, half in self._solids
            )
            is_near = any(np.linalg.norm(place - other) < 1 for other in others)
            if place[2] < front and not is_inside and not is_near:
                return np.asarray(place)

    def some_target(self) -> tuple[float, float, float]:
        """Return a random point near the floor or the furniture."""
        x, y, z = self._rng.uniform([-2.5, 0, -2.3], [2, 1.5, 2.3])
        return float(x), float(y), float(z)

    def points(self, count: int) -> list[str]:
        """Return the elements of random point lights."""
        lamps, places = [], []
        for k in range(count):
            place = self.free_place(*places)
            places.append(place)
            colour = 3 * self._rng.uniform(0.6, 1, 3)
            lamps.append(point(f"true_{k}", place, colour))
        return lamps

    def spots(self, count: int) -> list[str]:
        """Return the elements of random spots that point at the floor or the furniture."""
        lamps, places = [], []
        for k in range(count):
            place = self.free_place(*places)
            places.append(place)
            target = np.array(self.some_target())
            cutoff = self._rng.uniform(18, 40)
            beam = cutoff * self._rng.uniform(0.4, 0.8)
            colour = 14 * self._rng.uniform(0.6, 1, 3)
            lamps.append(spot(f"true_{k}", place, target, cutoff, beam, colour))
        return lamps

    def panels(self, count: int, side: float = 0.6) -> list[str]:
        """Return the elements of square panels under the ceiling or at a wall, facing inwards."""
        lamps, places = [], []
        for k in range(count):
            place = self.free_place(*places)
            place[1] = self.high[1] - 0.3
            places.append(place)
            target = place + self._rng.uniform([-0.5, -1, -0.5], [0.5, -0.8, 0.5])
            colour = 10 * self._rng.uniform(0.6, 1, 3)
            lamps.append(panel(f"true_{k}", place, target, side, colour))
        return lamps

    def write(
        self, path: Path, lights: list[str], *, size: tuple[int, int] = (160, 90), views: int = 1
    ) -> Path:
        """Write the room with a dim lamp that is known, and with `lights`; return the path."""
        sensors = [
            _SENSOR.format(
                name="camera",
                fov=70,
                eye=_listed([self.high[0] - 0.6, 1.7, 4.6]),
                target="-0.4, 1.1, 0",
            ),
            _SENSOR.format(
                name="other",
                fov=70,
                eye=_listed([self.low[0] + 0.5, 1.7, self.low[2] + 0.5]),
                target=_listed([0.6, 1.0, 2.5]),
            ),
        ]
        known_lamp = point("known", np.array([0.0, self.high[1] - 0.25, 1.0]), np.full(3, 0.6))
        width, height = size
        text = _ROOM.format(
            width=width,
            height=height,
            sensors="\n".join(sensors[:views]),
            shapes="\n".join(self._shapes),
            lights="\n".join([known_lamp, *lights]),
        )
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    def _walls(self) -> None:
        low, high, rng = self.low, self.high, self._rng
        middle, half = (low + high) / 2, (high - low) / 2
        left, right = rng.permutation(len(_COLOURS))[:2]
        floor = _GLOSSY.format(0.25, "0.35 0.25 0.17")
        white = _DIFFUSE.format(_COLOURS[0])
        for name, axis, sign, bsdf in (
            ("floor", 1, -1, floor),
            ("ceiling", 1, 1, white),
            ("back", 2, -1, white),
            ("front", 2, 1, white),
            ("left", 0, -1, _DIFFUSE.format(_COLOURS[left])),
            ("right", 0, 1, _DIFFUSE.format(_COLOURS[right])),
        ):
            place = middle.copy()
            place[axis] += sign * half[axis]
            inwards = np.zeros(3)
            inwards[axis] = -sign
            up = np.eye(3)[2 if axis == 1 else 1]
            across = np.abs(np.cross(up, inwards)) @ half
            scale = f'<scale x="{across:.4f}" y="{up @ half:.4f}"/>'
            lookat = (
                f'<lookat origin="{_listed(place)}" target="{_listed(place + inwards)}" '
                f'up="{_listed(up)}"/>'
            )
            self._shapes.append(
                f'    <shape type="rectangle" id="{name}"><transform name="to_world">'
                f"{scale}{lookat}</transform>{bsdf}</shape>"
            )

    def _furniture(self) -> None:
        rng = self._rng
        white, gloss = _DIFFUSE.format(_COLOURS[0]), _GLOSSY.format(0.15, "0.2 0.4 0.2")
        table = np.array([rng.uniform(-1.0, 0.0), 0.75, rng.uniform(-0.3, 0.6)])
        self._box("table", table, [1.6, 0.06, 0.9], rng.uniform(0, 40), white)
        for k, (x, z) in enumerate([(-0.6, -0.3), (0.6, -0.3), (-0.6, 0.3), (0.6, 0.3)]):
            self._box(f"leg_{k}", table + np.array([x, -0.39, z]), [0.06, 0.72, 0.06], 0, white)
        column = np.array([rng.uniform(0.8, 1.6), self.high[1] / 2, rng.uniform(-1.4, -0.6)])
        self._box("column", column, [0.4, self.high[1], 0.4], rng.uniform(0, 45), white)
        shelf = np.array([self.low[0] + 0.4, 0.9, rng.uniform(-1.6, -0.6)])
        self._box("shelf", shelf, [0.7, 1.8, 0.5], 0, gloss)
        self._ball("ball", table + np.array([0.1, 0.23, 0.05]), 0.2, gloss)
        self._ball("large_ball", [rng.uniform(0.5, 1.1), 0.35, rng.uniform(0.9, 1.6)], 0.35, white)

    def _box(self, name: str, middle: Doubles, sides: list[float], turn: float, bsdf: str) -> None:
        half = np.array(sides) / 2
        x, y, z = half
        a, b, c = middle
        self._shapes.append(
            f'    <shape type="cube" id="{name}"><transform name="to_world">'
            f'<scale x="{x:.4f}" y="{y:.4f}" z="{z:.4f}"/><rotate y="1" angle="{turn:.3f}"/>'
            f'<translate x="{a:.4f}" y="{b:.4f}" z="{c:.4f}"/></transform>{bsdf}</shape>'
        )
        reach = np.array([np.hypot(x, z), y, np.hypot(x, z)])
        self._solids.append((np.asarray(middle), reach))

    def _ball(self, name: str, middle: Doubles | list[float], radius: float, bsdf: str) -> None:
        a, b, c = middle
        self._shapes.append(
            f'    <shape type="sphere" id="{name}"><point name="center" x="{a:.4f}" y="{b:.4f}" '
            f'z="{c:.4f}"/><float name="radius" value="{radius}"/>{bsdf}</shape>'
        )
        self._solids.append((np.asarray(middle), np.full(3, radius)))


def point(name: str, place: Doubles, colour: Doubles) -> str:
    """Return the element of a point light."""
    x, y, z = place
    return (
        f'    <emitter type="point" id="{name}"><point name="position" x="{x:.5f}" y="{y:.5f}" '
        f'z="{z:.5f}"/><rgb name="intensity" value="{_listed(colour, " ")}"/></emitter>'
    )


def spot(
    name: str, place: Doubles, target: Doubles, cutoff: float, beam: float, colour: Doubles
) -> str:
    """Return the element of a spot."""
    return (
        f'    <emitter type="spot" id="{name}">{_lookat(place, target)}'
        f'<float name="cutoff_angle" value="{cutoff:.3f}"/>'
        f'<float name="beam_width" value="{beam:.3f}"/>'
        f'<rgb name="intensity" value="{_listed(colour, " ")}"/></emitter>'
    )


def panel(name: str, place: Doubles, target: Doubles, side: float, colour: Doubles) -> str:
    """Return the element of a square panel that shines towards `target`."""
    scale = f'<scale value="{side / 2:.4f}"/>'
    return (
        f'    <shape type="rectangle" id="{name}">{_lookat(place, target, scale)}'
        f'<bsdf type="diffuse"><rgb name="reflectance" value="0"/></bsdf>'
        f'<emitter type="area"><rgb name="radiance" value="{_listed(colour, " ")}"/></emitter>'
        "</shape>"
    )


def _lookat(place: Doubles, target: Doubles, before: str = "") -> str:
    way = np.subtract(target, place)
    up = np.eye(3)[np.argmin(np.abs(way))]
    return (
        f'<transform name="to_world">{before}<lookat origin="{_listed(place)}" '
        f'target="{_listed(target)}" up="{_listed(up)}"/></transform>'
    )


def _listed(values: Doubles | list[float], separator: str = ", ") -> str:
    return separator.join(f"{float(v):.5f}" for v in values)
