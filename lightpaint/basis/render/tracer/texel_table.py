"""Tables on the device that divide the light of an image among its texels.

The texels of a sky may be split again, into texels of finer grids.

Import this module after setting a Dr.Jit variant, since its array types do not exist before.
"""

# mypy: disable-error-code="no-untyped-def, no-untyped-call"

from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any, ClassVar

import drjit as dr
import mitsuba as mi
import numpy as np

from lightpaint.arrays import Floats
from lightpaint.scene import Emitter, Scene, even_image
from lightpaint.scene.lights.texels import RATIO, FlatDomain, ImageDomain, Sky, TexelLayout

#: Number of a texel where there is none.
NO_TEXELS = np.uint32(2**32 - 1)


class TexelTable:
    """The texels of all split images of a loaded scene, which shine in an even white.

    A place in an image lies between four texels. Each gets the light from there, multiplied by the
    value of its hat (see texel.py), and in units of the light that it belongs to.
    """

    def __init__(self, scene: Scene, loaded: Any) -> None:
        instances = np.array(dr.reinterpret_array(mi.UInt32, loaded.emitters_dr())).tolist()
        instance_of = {
            emitter.id(): instance
            for instance, emitter in zip(instances, loaded.emitters(), strict=True)
        }
        count = max(instances) + 1
        firsts, sizes = np.full(count, NO_TEXELS), np.ones((2, count), np.uint32)
        self._finer: FinerTexels | None = None
        by_image: dict[str, list[Emitter]] = {}
        for emitter in scene.emitters:
            if emitter.texel is not None:
                by_image.setdefault(emitter.texel.image, []).append(emitter)
        texels: list[Emitter | None] = []
        grids = [grid(scene, count) for grid in (_SkyGrid, _FlatGrid)]
        for image, emitters in by_image.items():
            instance, texel = instance_of[image], emitters[0].texel
            assert texel is not None
            layout = texel.layout
            firsts[instance], sizes[:, instance] = len(texels), layout.size
            next(x for x in grids if isinstance(texel.domain, x.domain)).add(emitters[0], instance)
            columns, rows = layout.size
            emitter_of = dict(zip(layout.nodes, emitters, strict=True))
            if layout.splits:
                lit = {m.name for x in scene.lights if not x.is_fixed for m in x.members}
                first_finer = len(texels) + columns * rows
                even = even_image(emitters, lit)
                self._finer = FinerTexels(instance, layout, first_finer, even)
            # A texel that is split again has no light, but a place.
            texels += [emitter_of.get((0, x, y)) for y in range(rows) for x in range(columns)]
            texels += [emitter_of[node] for node in layout.nodes if node[0]]
        self._firsts = mi.UInt32(firsts)
        self._columns, self._rows = (mi.UInt32(x) for x in sizes)
        self._grids = [grid for grid in grids if grid.instances]
        for grid in self._grids:
            grid.freeze()
        planes = [scene.plane_of.get(x.name, 0) if x else 0 for x in texels]
        self._lights = mi.UInt32(np.array(planes))
        self._factors = [mi.Float(x) for x in _factors(scene, texels).T]

    @classmethod
    def of(cls, scene: Scene, loaded: Any) -> "TexelTable | None":
        """Return the table of a scene as loaded evenly; None without split images."""
        return cls(scene, loaded) if scene.split else None

    def is_image(self, instance, active):
        """Return whether an emitter, by its instance, is a split image."""
        return active & (dr.gather(mi.UInt32, self._firsts, instance, active) != NO_TEXELS)

    def shares(self, instance, direction, uv, active) -> Iterator[tuple[Any, Any, Any]]:
        """Yield light, RGB factor and mask of each of the texels around a place in an image: four,
        or some more at the edge of those that are split again.

        direction: unit vector from the scene, in world space. uv: texture coordinates. A sky has
        its places by direction, other images by texture coordinates.
        """
        first = dr.gather(mi.UInt32, self._firsts, instance, active)
        columns = dr.gather(mi.UInt32, self._columns, instance, active)
        rows = dr.gather(mi.UInt32, self._rows, instance, active)
        across, down = self._place(instance, direction, uv, columns, rows, active)
        left = dr.minimum(dr.floor(across), mi.Float(columns - 1))
        top = dr.clip(dr.floor(down), 0, mi.Float(rows - 2))
        corners = GridCorners(mi.Int32(left), mi.Int32(top), across - left, down - top)
        unit = mi.Float(1)
        if self._finer is not None:
            is_finer, unit, corners = self._finer.coarser(instance, across, down, corners, active)
            for texel, weight, is_there in is_finer:
                yield self._share(texel, weight * unit, is_there)
        # Only the columns of a sky wrap around; in others the place lies between the outermost.
        for column, row, weight in corners:
            column = mi.UInt32(dr.select(column < 0, mi.Int32(columns) - 1, column))
            column = dr.select(column == columns, 0, column)
            texel = dr.fma(mi.UInt32(row), columns, column) + first
            yield self._share(texel, weight * unit, active)

    def _share(self, texel, weight, active):
        """Return light, RGB factor and mask of a texel. weight: value of its hat."""
        factors = (dr.gather(mi.Float, x, texel, active) for x in self._factors)
        light = dr.gather(mi.UInt32, self._lights, texel, active)
        return light, mi.Color3f(*factors) * weight, active

    def _place(self, instance, direction, uv, columns, rows, active):
        """Return how many texels a place is right of the leftmost and below the top ones."""
        across, down = mi.Float(0), mi.Float(0)
        for grid in self._grids:
            its_across, its_down = grid.place(instance, direction, uv, columns, rows, active)
            if len(self._grids) == 1:
                return its_across, its_down
            is_its = grid.has(instance, active)
            across = dr.select(is_its, its_across, across)
            down = dr.select(is_its, its_down, down)
        return across, down


class _TexelGrid(ABC):
    """The places of the texels of some images, on the device.

    domain: of these images. instances: of their emitters. count: number of all instances.
    """

    domain: ClassVar[type[ImageDomain]]

    def __init__(self, scene: Scene, count: int) -> None:
        self.scene = scene
        self.instances: list[int] = []
        self._is_its = np.zeros(count, bool)

    def add(self, emitter: Emitter, instance: int) -> None:
        """Add the image that `emitter` is a texel of."""
        self.instances.append(instance)
        self._is_its[instance] = True

    def freeze(self) -> None:
        """Copy the tables of all images to the device."""
        self._is_its = mi.Bool(self._is_its)

    def has(self, instance, active):
        """Return whether an emitter is one of these images."""
        return dr.gather(mi.Bool, self._is_its, instance, active)

    @abstractmethod
    def place(self, instance, direction, uv, columns, rows, active):
        """Return how many texels a place is right of the leftmost and below the top ones."""


class _SkyGrid(_TexelGrid):
    """Skies, of which a direction is a place."""

    domain = Sky

    def __init__(self, scene: Scene, count: int) -> None:
        super().__init__(scene, count)
        self._rotations: Any = np.zeros((9, count), np.float32)

    def add(self, emitter: Emitter, instance: int) -> None:
        super().add(emitter, instance)
        self._rotations[:, instance] = _to_local(self.scene, emitter).ravel()

    def freeze(self) -> None:
        super().freeze()
        self._rotations = [mi.Float(x) for x in self._rotations]

    def place(self, instance, direction, uv, columns, rows, active):
        r = [dr.gather(mi.Float, x, instance, active) for x in self._rotations]
        x, y, z = direction
        local_x, local_y, local_z = (r[k] * x + r[k + 1] * y + r[k + 2] * z for k in (0, 3, 6))
        # As in Mitsuba's envmap.cpp.
        u = dr.atan2(local_x, -local_z) * dr.inv_two_pi
        v = dr.safe_acos(local_y) * dr.inv_pi
        return dr.fma(u - dr.floor(u), mi.Float(columns), -0.5), v * mi.Float(rows - 1)


class _FlatGrid(_TexelGrid):
    """Walls and slides, of which texture coordinates are a place."""

    domain = FlatDomain

    def __init__(self, scene: Scene, count: int) -> None:
        super().__init__(scene, count)
        self._is_upside_down: Any = np.zeros(count, bool)

    def add(self, emitter: Emitter, instance: int) -> None:
        super().add(emitter, instance)
        assert emitter.texel is not None
        assert isinstance(emitter.texel.domain, FlatDomain)
        self._is_upside_down[instance] = emitter.texel.domain.is_upside_down

    def freeze(self) -> None:
        super().freeze()
        self._is_upside_down = mi.Bool(self._is_upside_down)

    def place(self, instance, direction, uv, columns, rows, active):
        is_upside_down = dr.gather(mi.Bool, self._is_upside_down, instance, active)
        v = dr.select(is_upside_down, 1 - uv.y, uv.y)
        # As in Mitsuba's bitmap.cpp, clamped.
        return (
            dr.clip(dr.fma(uv.x, mi.Float(columns), -0.5), 0, mi.Float(columns - 1)),
            dr.clip(dr.fma(v, mi.Float(rows), -0.5), 0, mi.Float(rows - 1)),
        )


def _to_local(scene: Scene, emitter: Emitter) -> Any:
    """Return the matrix (3, 3) from world space to the space of an image."""
    props = scene.parsed.state.nodes[emitter.node].props
    if "to_world" not in props or emitter.plugin == "constant":
        return np.eye(3)
    return np.array(props["to_world"].inverse().matrix, dtype=float).reshape(4, 4)[:3, :3]


def _factors(scene: Scene, texels: list[Emitter | None]) -> Any:
    """Return the radiance of each texel when its light is at unit emission, (texels, 3)."""
    factors = {x.name: (0.0, 0.0, 0.0) for x in texels if x}
    for light in scene.lights:
        for member in light.members:
            unit = light.emission_of(member, (1.0, 1.0, 1.0))
            factors[member.name] = member.emission if light.is_fixed else unit
    return np.array([factors[x.name] if x else (0, 0, 0) for x in texels], np.float32)


class GridCorners:
    """The four places of a grid around one, with their weights.

    left, top: column and row of the first, of which the column may be outside. right, lower: the
    distance from there, in columns and rows.
    """

    def __init__(self, left, top, right, lower) -> None:
        self.left, self.top = left, top
        self.weights = [
            [(1 - right) * (1 - lower), (1 - right) * lower],
            [right * (1 - lower), right * lower],
        ]

    def __iter__(self) -> Iterator[tuple[Any, Any, Any]]:
        """Yield column, row and weight of each."""
        for x in range(2):
            for y in range(2):
                yield self.left + x, self.top + y, self.weights[x][y]


class FinerTexels:
    """The texels of a sky on finer grids; see TexelLayout.

    instance: of its emitter. first: number of the first of them. even: (rows, columns), the image
    that is sampled.
    """

    def __init__(self, instance: int, layout: TexelLayout, first: int, even: Floats) -> None:
        self._instance, self._layout = instance, layout
        self._even = mi.Float(even.ravel())
        self._numbers = []
        finer = [node for node in layout.nodes if node[0]]
        for level in range(1, layout.level + 1):
            columns, rows = layout.grid(level)
            numbers = np.full((rows, columns), NO_TEXELS)
            for k, (its_level, column, row) in enumerate(finer):
                if its_level == level:
                    numbers[row, column] = first + k
            self._numbers.append(mi.UInt32(numbers.ravel()))

    def coarser(self, instance, across, down, coarsest, active):
        """Return the finer texels around a place, the factor of its light, and the corners of the
        coarsest grid with the weights that remain for these.

        across, down: the place on the coarsest grid. coarsest: the corners there. The first result
        is a list of texel, weight and mask; the factor makes up for the brightness of the even
        image.
        """
        is_its = active & (instance == mi.UInt32(self._instance))
        for _ in self._numbers:
            across, down = dr.fma(across, RATIO, 1), down * RATIO
        rows = self._layout.finest[1]
        left, top = dr.floor(across), dr.clip(dr.floor(down), 0, rows - 2)
        corners = GridCorners(mi.Int32(left), mi.Int32(top), across - left, down - top)
        unit = dr.select(is_its, dr.rcp(self._brightness(corners, is_its)), 1)
        found = []
        for level in range(self._layout.level, 0, -1):
            found += self._taken(corners, level, is_its)
            corners = self._passed_on(corners, level)
        return found, unit, _merged(corners, coarsest, is_its)

    def _index(self, column, row, level: int):
        """Return the index of a place of a grid, whose columns wrap around."""
        columns = self._layout.grid(level)[0]
        column = dr.select(column < 0, column + columns, column)
        column = dr.select(column >= columns, column - columns, column)
        return mi.UInt32(row * columns + column)

    def _brightness(self, corners, active):
        """Return the brightness of the even image at a place."""
        level, total = self._layout.level, mi.Float(0)
        for column, row, weight in corners:
            index = self._index(column, row, level)
            total += weight * dr.gather(mi.Float, self._even, index, active)
        return total

    def _taken(self, corners, level: int, active):
        """Return the texels at some corners, and set the weights there to 0."""
        found = []
        for k, (column, row, weight) in enumerate(list(corners)):
            index = self._index(column, row, level)
            texel = dr.gather(mi.UInt32, self._numbers[level - 1], index, active)
            is_there = active & (texel != mi.UInt32(NO_TEXELS))
            found.append((texel, weight, is_there & (weight > 0)))
            corners.weights[k // 2][k % 2] = dr.select(is_there, 0, weight)
        return found

    def _passed_on(self, corners, level: int):
        """Return the corners on the next coarser grid, with the weights that remain."""
        rows = self._layout.grid(level - 1)[1]
        # Columns before the first are negative, and division is towards 0.
        left = (corners.left + (RATIO - 1)) // RATIO - 1
        top = dr.minimum(corners.top // RATIO, rows - 2)
        coarser = GridCorners(left, top, mi.Float(0), mi.Float(0))
        coarser.weights = [[mi.Float(0), mi.Float(0)], [mi.Float(0), mi.Float(0)]]
        for column, row, weight in corners:
            beside = mi.Float(column - (RATIO * left + 1)) / RATIO
            below = mi.Float(row - RATIO * top) / RATIO
            for x, share in enumerate((1 - beside, beside)):
                for y, part in enumerate((1 - below, below)):
                    coarser.weights[x][y] = dr.fma(weight * share, part, coarser.weights[x][y])
        return coarser


def _merged(corners, others, is_its):
    """Return `corners` where `is_its`, and `others` elsewhere."""
    merged = GridCorners(
        dr.select(is_its, corners.left, others.left),
        dr.select(is_its, corners.top, others.top),
        mi.Float(0),
        mi.Float(0),
    )
    merged.weights = [
        [dr.select(is_its, corners.weights[x][y], others.weights[x][y]) for y in range(2)]
        for x in range(2)
    ]
    return merged
