"""Texels: the pixels of a coarse image of a light, each of which is a light of its own.

Mitsuba interpolates the pixels of an image bilinearly, so a texel shines as a hat: it is 1 at its
own place and falls to 0 towards its neighbours. Hats sum to one, so an image with a value for each
texel is the sum of their lights. Where texels lie depends on the kind of light (image_domains.py).
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from lightpaint.errors import SceneError
from lightpaint.files import one_line
from lightpaint.scene.lights.texels.image_domains import GridSize, ImageDomain
from lightpaint.scene.lights.texels.texel_layout import (
    CHILDREN,
    MAX_LEVEL,
    Node,
    TexelLayout,
    coarsest,
)
from lightpaint.scene.limits import MAX_TEXELS

#: Longest side of a written image, in pixels: a larger one is a typing error.
MAX_MAP_SIDE = 8192

_SIZE = re.compile(r"([0-9]{1,9})\s*[x×,]\s*([0-9]{1,9})")
_NAME = re.compile(r"(.+?)(?:\.sun([1-9]))?\.x([0-9]{1,6})\.y([0-9]{1,6})", re.DOTALL)


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
        """Its name as a light: those of its image, its column and its row."""
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


def texel_names(image: str, size: GridSize) -> list[str]:
    """Return the names of all texels of an image, row by row."""
    columns, rows = size
    return [texel_name(image, x, y) for y in range(rows) for x in range(columns)]


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
