"""The places of the texels of an image: on a grid, and on finer ones where some are split again.

A finer grid has three times as many columns, and the rows of a sky three times as close: it has a
texel at each place of the coarser grid, so an image on that is also one on the finer grid. A texel
that is split is replaced by all texels of the next grid on which its hat is not 0, and these take
from the hats of its neighbours what they cover. So all hats are never negative and sum to one, a
texel shines with its radiance at its own place, and every part of the image is a mix of radiances.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.scene.lights.texels.image_domains import GridSize

#: A texel: the level of its grid, of which 0 is the coarsest, its column and its row.
Node = tuple[int, int, int]

#: Places of a grid to each side of a coarser place to which the hat there reaches.
REACH = 2
#: Ratio of a grid to the next coarser one.
RATIO = 3
#: The finest level: texels of 1/27 of the coarsest.
MAX_LEVEL = 3
#: Most texels that take the place of one.
CHILDREN = (2 * REACH + 1) ** 2


@dataclass(frozen=True)
class TexelLayout:
    """The texels of an image.

    size: columns and rows of the coarsest grid. splits: texels that are split again, coarse ones
    before finer ones; only those of a sky can be.
    """

    size: GridSize
    splits: tuple[Node, ...] = ()

    @classmethod
    def of_nodes(cls, nodes: Iterable[Node]) -> "TexelLayout":
        """Return the layout that has these texels, of those that have some of them."""
        present = set(nodes)
        size = (1 + max(coarsest(x)[1] for x in present), 1 + max(coarsest(x)[2] for x in present))
        # A texel that is split has one of the next grid at its own place, or that is split again.
        splits, todo = set[Node](), {x for x in present if x[0]}
        while todo:
            todo = {x for node in todo if (x := _same_place(node)) is not None} - present
            splits |= todo
            todo = {x for x in todo if x[0]}
        return cls(size, tuple(sorted(splits)))

    def split_again(self, *nodes: Node) -> "TexelLayout":
        """Return the layout with more of its texels split."""
        return TexelLayout(self.size, tuple(sorted({*self.splits, *nodes})))

    def made_symmetric(self) -> "TexelLayout":
        """Return the layout with the mirror images of its splits, left and right."""
        return self.split_again(*map(self.mirrored, self.splits))

    def mirrored(self, node: Node) -> Node:
        """Return the place of a texel in the mirror image, left and right."""
        level, column, row = node
        return level, self.grid(level)[0] - 1 - column, row

    @cached_property
    def level(self) -> int:
        """The level of its finest grid."""
        return 1 + max(x[0] for x in self.splits) if self.splits else 0

    def grid(self, level: int) -> GridSize:
        """Return columns and rows of the grid of a level."""
        columns, rows = self.size
        return columns * RATIO**level, (rows - 1) * RATIO**level + 1 if level else rows

    @property
    def finest(self) -> GridSize:
        """Columns and rows of its image, which has every texel."""
        return self.grid(self.level)

    @cached_property
    def nodes(self) -> tuple[Node, ...]:
        """Its texels: level by level, and row by row from the top."""
        columns, rows = self.size
        found = {(0, x, y) for x in range(columns) for y in range(rows)}
        for node in self.splits:
            found.update(self.children(node))
        found.difference_update(self.splits)
        return tuple(sorted(found, key=lambda x: (x[0], x[2], x[1])))

    @cached_property
    def number_of(self) -> dict[Node, int]:
        """The index of each of its texels among `nodes`."""
        return {node: k for k, node in enumerate(self.nodes)}

    @property
    def size_text(self) -> str:
        """The number of its texels for people."""
        columns, rows = self.size
        finer = sum(1 for node in self.nodes if node[0])
        return f"{columns}x{rows}{f' + {finer}' if finer else ''} texels"

    @property
    def text(self) -> str:
        """Its size and the texels that are split again, `16x8+x4.y3+sun1.x13.y10`."""
        columns, rows = self.size
        places = (f"{f'sun{level}.' if level else ''}x{x}.y{y}" for level, x, y in self.splits)
        return "+".join([f"{columns}x{rows}", *places])

    @cached_property
    def nearest(self) -> Indices:
        """The index of the texel that is nearest to each place of the finest grid, (rows, columns).

        One around which others are split has fewer places than its grid gives it.
        """
        columns, rows = self.size
        nearest = np.full((rows, columns), -1)
        for level, (places, which) in enumerate(self._by_level):
            if level:
                columns, rows = self.grid(level)
                y, x = (np.arange(rows) + 1) // RATIO, np.arange(columns) // RATIO
                nearest = nearest[y[:, None], x]
            nearest[places[:, 1], places[:, 0]] = which
        return np.asarray(nearest)

    def shown_by(self, image: Doubles) -> Doubles | None:
        """Return the values of its texels that make an image, (nodes, k); None if none do.

        image: (rows, columns, k) of the finest grid.
        """
        finer = RATIO ** (self.level - np.array([x[0] for x in self.nodes]))
        columns, rows = (np.array([x[k] for x in self.nodes]) for k in (1, 2))
        values = image[finer * rows, finer * columns + (finer - 1) // 2]
        return values if np.allclose(self.image(values), image, rtol=1e-3, atol=0) else None

    def texel_at(self, place: Node) -> Node:
        """Return the texel at a place of a grid: that of the grid, or of a finer one."""
        while place not in self.number_of:
            level, column, row = place
            place = level + 1, RATIO * column + 1, RATIO * row
        return place

    def children(self, node: Node) -> Iterator[Node]:
        """Yield the texels of the next grid that take the place of one."""
        level, column, row = node
        columns, rows = self.grid(level + 1)
        for y in range(RATIO * row - REACH, RATIO * row + REACH + 1):
            if 0 <= y < rows:
                for x in range(RATIO * column + 1 - REACH, RATIO * column + 2 + REACH):
                    yield level + 1, x % columns, y

    def image(self, values: Doubles) -> Doubles:
        """Return the image of texels with these values, (rows, columns, k) of the finest grid.

        values: (nodes, k).
        """
        numbers = self._by_level
        columns, rows = self.size
        image = np.zeros((rows, columns, values.shape[1]))
        for level, (places, which) in enumerate(numbers):
            if level:
                down, across = self._rises(level)
                image = np.einsum("rh,hwc,kw->rkc", down, image, across, optimize=True)
            image[places[:, 1], places[:, 0]] = values[which]
        return np.asarray(image)

    def values(self, coarse: Doubles) -> Doubles:
        """Return the values of its texels that show a coarse image unchanged, (nodes, k).

        coarse: (rows, columns, k).
        """
        values = np.zeros((len(self.nodes), coarse.shape[2]))
        for level, (places, which) in enumerate(self._by_level):
            if level:
                down, across = self._rises(level)
                coarse = np.einsum("rh,hwc,kw->rkc", down, coarse, across, optimize=True)
            values[which] = coarse[places[:, 1], places[:, 0]]
        return values

    def sums(self, pixels: Doubles) -> Doubles:
        """Return the sum over the pixels of the finest grid under each hat, (nodes,).

        pixels: (rows, columns).
        """
        sums = np.zeros(len(self.nodes))
        pixels = pixels.copy()
        for level in range(self.level, -1, -1):
            places, which = self._by_level[level]
            sums[which] = pixels[places[:, 1], places[:, 0]]
            pixels[places[:, 1], places[:, 0]] = 0
            if level:
                down, across = self._rises(level)
                pixels = down.T @ pixels @ across
        return sums

    @cached_property
    def finer_under(self) -> dict[Node, list[Node]]:
        """The finer texels that take a part of a hat, by its texel, for those of which some do."""
        found: dict[Node, list[Node]] = {}
        for finer in self.nodes:
            for node in self._below(finer) if finer[0] else ():
                found.setdefault(node, []).append(finer)
        return found

    def _stencil(self, node: Node) -> dict[Node, float]:
        """Return the texels whose hats are not 0 at a place of a grid, with their values there."""
        if node[0] == 0 or node in self.number_of:
            return {node: 1.0}
        return self._below(node)

    def _below(self, node: Node) -> dict[Node, float]:
        """Return the texels of coarser grids that make the image at a place, with their shares."""
        level, column, row = node
        columns, rows = self.grid(level - 1)
        left, beside = divmod(column - 1, RATIO)
        top = min(row // RATIO, rows - 2)
        below, found = row - RATIO * top, dict[Node, float]()
        for x, across in ((left, 1 - beside / RATIO), (left + 1, beside / RATIO)):
            for y, down in ((top, 1 - below / RATIO), (top + 1, below / RATIO)):
                if across * down > 0:
                    for one, share in self._stencil((level - 1, x % columns, y)).items():
                        found[one] = found.get(one, 0.0) + across * down * share
        return found

    @cached_property
    def _by_level(self) -> list[tuple[Indices, Indices]]:
        """For each level the places of its texels, (n, 2), and their indices, (n,)."""
        nodes = np.array(self.nodes)
        which = [np.flatnonzero(nodes[:, 0] == level) for level in range(self.level + 1)]
        return [(nodes[numbers, 1:], numbers) for numbers in which]

    def _rises(self, level: int) -> tuple[Doubles, Doubles]:
        """Return the weights by which an image gets finer: (rows, coarser rows), and of columns."""
        columns, rows = self.grid(level - 1)
        finer_columns, finer_rows = self.grid(level)
        y = np.arange(finer_rows) / RATIO
        x = (np.arange(finer_columns) - 1) / RATIO
        distance = np.abs(x[:, None] - np.arange(columns)) % columns
        down = np.maximum(1 - np.abs(y[:, None] - np.arange(rows)), 0)
        across = np.maximum(1 - np.minimum(distance, columns - distance), 0)
        return down, across


def _same_place(node: Node) -> Node | None:
    """Return the place of the next coarser grid where a texel lies; None if it has none there."""
    level, column, row = node
    if column % RATIO != 1 or row % RATIO:
        return None
    return level - 1, column // RATIO, row // RATIO


def coarsest(node: Node) -> Node:
    """Return the texel of the coarsest grid that is nearest to one."""
    level, column, row = node
    while level:
        level, column, row = level - 1, column // RATIO, (row + 1) // RATIO
    return level, column, row
