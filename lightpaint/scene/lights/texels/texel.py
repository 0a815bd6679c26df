"""Texels: the pixels of a coarse image of a light, each of which is a light of its own.

Mitsuba interpolates the pixels of an image bilinearly, so a texel shines as a hat: it is 1 at its
own place and falls to 0 towards its neighbours. Hats sum to one, so an image with a value for each
texel is the sum of their lights. Where texels lie depends on the kind of light (image_domains.py).

A finer grid has three times as many columns, and the rows of a sky three times as close: it has a
texel at each place of the coarser grid, so an image on that is also one on the finer grid. A texel
that is split is replaced by all texels of the next grid on which its hat is not 0, and these take
from the hats of its neighbours what they cover. So all hats are never negative and sum to one, a
texel shines with its radiance at its own place, and every part of the image is a mix of radiances.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.errors import SceneError
from lightpaint.files import one_line
from lightpaint.scene.lights.texels.image_domains import GridSize, ImageDomain
from lightpaint.validation import MAX_TEXELS

#: Longest side of a written image, in pixels: a larger one is a typing error.
MAX_MAP_SIDE = 8192

_SIZE = re.compile(r"([0-9]{1,9})\s*[x×,]\s*([0-9]{1,9})")
_NAME = re.compile(r"(.+?)(?:\.sun([1-9]))?\.x([0-9]{1,6})\.y([0-9]{1,6})", re.DOTALL)

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
    before finer ones; only texels of a sky can be.
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
        """Return the texel at a place of a grid: the texel of the grid, or of a finer one."""
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
        """The finer texels that take a part of a hat, by its texel, for the texels of which some
        do."""
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


@dataclass(frozen=True)
class Texel:
    """A texel of the image of a light.

    image: name of the light. node: its place. layout: of all texels of the image. domain: where
    they lie.
    """

    image: str
    node: Node
    layout: TexelLayout
    domain: ImageDomain

    @property
    def name(self) -> str:
        """Its name as a light: the names of its image, its column and its row."""
        return node_name(self.image, self.node)

    @property
    def form(self) -> str:
        """Its place as text."""
        level, column, row = self.node
        columns, rows = self.layout.grid(level)
        return f"texel {column}, {row} of {columns}x{rows}"

    @property
    def identity(self) -> str:
        """Everything that its hat depends on."""
        level, column, row = self.node
        finer = self.layout.finer_under.get(self.node)
        without = f" without {finer}" if finer else ""
        return f"texel {column} {row} of {self.layout.grid(level)}{without}"


def texel_name(image: str, column: int, row: int) -> str:
    """Return the name of a texel, from the name of its image."""
    return f"{image}.x{column}.y{row}"


def node_name(image: str, node: Node) -> str:
    """Return the name of a texel of any level, from the name of its image."""
    level, column, row = node
    return texel_name(f"{image}.sun{level}" if level else image, column, row)


def image_of(name: str) -> str:
    """Return the name of the image that a texel of this name belongs to; "" for other names."""
    found = _node_of(name)
    return "" if found is None else found[0]


def coarse_name(name: str) -> str:
    """Return the name of the texel of the coarsest grid in whose place a texel is; "" for other
    names.
    """
    found = _node_of(name)
    return "" if found is None else node_name(found[0], coarsest(found[1]))


def texel_place(name: str) -> tuple[int, int]:
    """Return column and row of the texel of this name, of its level."""
    found = _node_of(name)
    if found is None:
        raise ValueError(f"{name!r:.40} is the name of no texel")
    return found[1][1], found[1][2]


def _node_of(name: str) -> tuple[str, Node] | None:
    """Return image and place of the texel of this name; None for other names."""
    found = _NAME.fullmatch(name)
    if found is None:
        return None
    return found[1], (int(found[2] or 0), int(found[3]), int(found[4]))


def layouts_of(names: Iterable[str]) -> dict[str, TexelLayout]:
    """Return the images of which `names` has all texels."""
    nodes: dict[str, set[Node]] = {}
    for name in names:
        if (found := _node_of(name)) is not None:
            nodes.setdefault(found[0], set()).add(found[1])
    return {
        image: layout
        for image, present in nodes.items()
        if len(present) > 1 and (layout := _layout_of(present)) is not None
    }


def _layout_of(present: set[Node]) -> TexelLayout | None:
    """Return the layout that has these texels and no others; None if some are missing."""
    columns, rows = TexelLayout.of_nodes(present).size
    # No larger one has as few texels, and its texels need not be listed.
    if columns * rows > len(present) * CHILDREN or max(x[0] for x in present) > MAX_LEVEL:
        return None
    layout = TexelLayout.of_nodes(present)
    return layout if present == set(layout.nodes) else None


def images_of(names: Iterable[str]) -> dict[str, GridSize]:
    """Return the images of which `names` has all texels, with their sizes on the coarsest grid."""
    return {image: layout.size for image, layout in layouts_of(names).items()}


def mirrored_pairs(image: str, layout: TexelLayout) -> dict[str, list[str]]:
    """Return the texels of an image, row by row, by the name of the left one of each pair that are
    mirror images of each other; one in the middle is alone.
    """
    pairs = (sorted({node, layout.mirrored(node)}) for node in layout.nodes)
    return {node_name(image, pair[0]): [node_name(image, x) for x in pair] for pair in pairs}


def parse_size(value: object, where: str) -> GridSize | TexelLayout:
    """Return columns and rows of texels from `16x8` or [16, 8], or a layout of them.

    where: their place, for errors. `16x8+x4.y3+sun1.x13.y10` has texels that are split again.
    """
    size, splits = value, list[str]()
    if isinstance(value, str):
        size, *splits = value.split("+")
    columns, rows = _parsed_size(size, where, "16x8")
    count = columns * rows + (CHILDREN - 1) * len(splits)
    if count > MAX_TEXELS:
        raise SceneError(
            f"{where} is {columns}x{rows}, {count:,} texels: expected at most "
            f"{MAX_TEXELS:,}, each of which is a light with pictures of its own"
        )
    layout = TexelLayout((columns, rows))
    for split in splits:
        found = _node_of(f"{where}.{split.strip()}")
        node = None if found is None or found[0] != where else found[1]
        if node not in layout.number_of or node[0] == MAX_LEVEL:
            raise SceneError(
                f"{where} has {one_line(repr(split))} after a +: expected a texel to split again, "
                f"such as x{columns // 2}.y{rows // 2}"
            )
        layout = layout.split_again(node)
    return layout if splits else (columns, rows)


def parse_map_size(value: object) -> GridSize:
    """Return columns and rows of written images from `1024x512` or [1024, 512]."""
    columns, rows = _parsed_size(value, "the map size", "1024x512")
    if not 1 <= min(columns, rows) <= max(columns, rows) <= MAX_MAP_SIDE:
        raise SceneError(
            f"the map size is {columns}x{rows}: expected from 1 to {MAX_MAP_SIDE} columns and rows"
        )
    return columns, rows


def _parsed_size(value: object, where: str, example: str) -> GridSize:
    """Return columns and rows from a text or two numbers."""
    size: GridSize | None = None
    if isinstance(value, str) and (found := _SIZE.fullmatch(value.strip())) is not None:
        size = int(found[1]), int(found[2])
    if isinstance(value, list | tuple) and len(value) == 2 and all(type(v) is int for v in value):
        size = value[0], value[1]
    if size is None:
        raise SceneError(
            f"{where} is {one_line(repr(value))}: expected columns and rows, such as {example}"
        )
    return size
