"""The materials of the scene that was loaded last, for the next load.

Some of Mitsuba's materials integrate their reflectance over all directions when they are built,
which takes most of the time of loading a small scene. A scene is loaded several times in a row, and
its relit form has the same materials. So those of the last scene stay alive after it, and the next
scene takes the equal ones. Only those of one scene are kept, since Dr.Jit traces all materials that
are alive. Materials that read files are not kept: the files may change, and textures are large.
"""

import atexit
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class _Material:
    """A built material. nodes: ids and properties of its nodes, depth first, without references."""

    nodes: tuple[Any, ...]
    built: Any


_kept: list[_Material] = []


def take_materials(state: Any) -> None:
    """Put kept materials in the place of equal ones in a parser state, and keep none any longer.

    From now on they belong to the scene that is built from `state`, whose owner may change them.
    """
    import mitsuba as mi

    kept, _kept[:] = tuple(_kept), []
    if not kept:
        return
    found: dict[int, Any] = {}
    for number, node in enumerate(state.nodes):
        if node.type == mi.ObjectType.BSDF and (nodes := _description(state, number)):
            equal = (x.built for x in kept if x.nodes == nodes)
            if (built := next(equal, None)) is not None:
                found[number] = built
    for node in state.nodes:
        for key, number in _references(node.props):
            if number in found:
                node.props[key] = found[number]


def keep_materials(state: Any, shapes: Sequence[int], loaded: Any) -> None:
    """Keep the materials of a loaded scene that nobody has changed, and that is released next.

    state: the parser state that it was built from. shapes: the nodes of its shapes, in their order.
    """
    import mitsuba as mi

    _kept.clear()
    built_shapes = loaded.shapes()
    if len(built_shapes) != len(shapes):
        return  # Mitsuba has merged or added some
    atexit.unregister(_kept.clear)
    atexit.register(_kept.clear)  # before Mitsuba ends
    built_of: dict[int, Any] = {}
    for shape, built in zip(shapes, built_shapes, strict=True):
        numbers = [number for _, number in _references(state.nodes[shape].props)]
        materials = [x for x in numbers if state.nodes[x].type == mi.ObjectType.BSDF]
        if len(materials) == 1:
            built_of[materials[0]] = built.bsdf()
    described = ((_description(state, number), built) for number, built in built_of.items())
    _kept.extend(_Material(nodes, built) for nodes, built in described if nodes)


def _description(state: Any, number: int) -> tuple[Any, ...]:
    """Return `_Material.nodes` of a node; nothing if it reads a file or holds a built object."""
    import mitsuba as mi

    kinds = mi.Properties.Type
    props = mi.Properties(state.nodes[number].props)
    children: list[Any] = []
    for key in list(props):
        kind = props.type(key)
        if kind in (kinds.Object, kinds.Any) or (kind == kinds.String and "file" in key):
            return ()
        if kind == kinds.ResolvedReference:
            described = _description(state, props[key].index())
            if not described:
                return ()
            children += [key, *described]
            del props[key]
    return (props.id(), props, *children)


def _references(props: Any) -> Iterator[tuple[str, int]]:
    """Yield name and node of each reference to another node."""
    import mitsuba as mi

    for key in list(props):
        if props.type(key) == mi.Properties.Type.ResolvedReference:
            yield key, int(props[key].index())
