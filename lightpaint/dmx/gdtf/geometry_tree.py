"""The geometries of a mode, each in its place: references to other geometries are followed."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.errors import RigError
from lightpaint.storage.rig_archive import library

#: Largest number of geometries of a mode, with those that references repeat.
MAX_GEOMETRIES = 10_000

#: Types of beams that are only to be looked at.
_UNLIT = ("None", "Glow")


@dataclass(frozen=True)
class Placed:
    """A geometry in its place.

    name: its own, with the names of the references that lead to it. source: name by which channels
    refer to it. matrix: from its axes to the axes of the fixture, (4, 4), column vectors in metres.
    ancestry: places, in the list of all geometries, of those it hangs on, from the first to itself.
    beam: pygdtf's beam, if it is one that lights. given: attributes that the file gives of that.
    offsets: what references add to offsets of channels, by break. overwrite: the break, and what is
    added there, of channels that leave their break to the reference.
    """

    name: str
    source: str
    matrix: Doubles
    ancestry: tuple[int, ...]
    beam: Any = None
    given: frozenset[str] = frozenset()
    offsets: Mapping[int, int] = field(default_factory=dict)
    overwrite: tuple[int, int] = (1, 0)


def geometry_tree(collection: Element | None, root: str, name: str) -> list[Placed]:
    """Return the geometries of a mode. root: name of its first one. name: of the type, for errors.

    Raises RigError for a missing geometry, or references that form a cycle.
    """
    if collection is None or not len(collection):
        return []
    by_name = {x.get("Name", ""): x for x in reversed([*collection.iter()])}
    first = by_name.get(root)
    if first is None:
        if root and len(collection) > 1:
            raise RigError(f"{name} has no geometry {root!r}, to which its mode refers")
        first = collection[0]
    placed: list[Placed] = []
    for item in _GeometryWalk(by_name, name).visit(first, _START, ""):
        if len(placed) >= MAX_GEOMETRIES:
            raise RigError(f"{name} has more than {MAX_GEOMETRIES} geometries in a mode")
        placed.append(item)
    return placed


_START = Placed("", "", np.eye(4), ())


class _GeometryWalk:
    """A traversal of geometries in the order of the file."""

    def __init__(self, by_name: Mapping[str, Element], name: str) -> None:
        self.by_name, self.name, self.count = by_name, name, 0
        self.references: list[str] = []

    def visit(self, element: Element, parent: Placed, prefix: str) -> Iterator[Placed]:
        own_name = element.get("Name", "")
        matrix = parent.matrix @ matrix_of(element.get("Position"))
        ancestry = (*parent.ancestry, self.count)
        offsets, overwrite, referred = parent.offsets, parent.overwrite, element
        if element.tag == "GeometryReference":
            target = element.get("Geometry", "")
            if target not in self.by_name or self.by_name[target].tag == "GeometryReference":
                raise RigError(f"{self.name} has no geometry {target!r}, to which it refers")
            if target in self.references:
                raise RigError(f"{self.name}: its geometry {target!r} refers to itself")
            referred = self.by_name[target]
            offsets, overwrite = dict(parent.offsets), parent.overwrite
            for entry in element.findall("Break"):
                number = int(entry.get("DMXBreak", "1"))
                universe, _, address = entry.get("DMXOffset", "1").rpartition(".")
                added = int(address) - 1 + 512 * (int(universe or 1) - 1)
                offsets[number] = parent.offsets.get(number, 0) + added
                overwrite = number, offsets[number]
            self.references.append(target)
        beam, given = _beam_of(referred)
        source = referred.get("Name", "")
        here = Placed(
            f"{prefix}{own_name}", source, matrix, ancestry, beam, given, offsets, overwrite
        )
        self.count += 1
        yield here
        inner = prefix if referred is element else f"{prefix}{own_name}."
        for child in referred:
            if child.tag != "Break":
                yield from self.visit(child, here, inner)
        if referred is not element:
            self.references.pop()


def _beam_of(element: Element) -> tuple[Any, frozenset[str]]:
    """Return pygdtf's beam and the attributes that the file gives; None if it does not light."""
    if element.tag != "Beam" or element.get("BeamType") in _UNLIT:
        return None, frozenset()
    alone = Element("Beam", {k: v for k, v in element.attrib.items() if k != "Position"})
    return library("pygdtf").GeometryBeam(xml_node=alone), frozenset(element.keys())


def matrix_of(text: str | None) -> Doubles:
    """Return a matrix of GDTF, (4, 4): column vectors, metres."""
    # pygdtf reads no blanks between the braces.
    written: Any = re.sub(r"\}\s*\{", "}{", text) if text else 0
    matrix = np.array(library("pygdtf").value.Matrix(written).matrix, float)
    if not np.isfinite(matrix).all():
        raise ValueError(f"the matrix {text}")
    return matrix
