"""Whether somebody gave an emitter a name, and what it hangs on if nobody did."""

import re
from pathlib import Path

from lightpaint.scene.scene_tree import ParsedScene

#: Ids that Mitsuba's own writer and parser make up.
_MADE_UP = re.compile(r"(__)?elm__\d+|_(unnamed|arg)_\d+")


def has_name(parsed: ParsedScene, emitter: int) -> bool:
    """Whether that node, or the shape that it belongs to, has an id that somebody chose."""
    nodes = (emitter, parsed.shape_of.get(emitter))
    return any(node is not None and _id(parsed, node) for node in nodes)


def hangs_on(parsed: ParsedScene, emitter: int) -> str:
    """Name of what that node without one belongs to; "" if nothing there has a name.

    That is what its shape is part of, the shape's material, or its file.
    """
    import mitsuba as mi

    shape = parsed.shape_of.get(emitter)
    if shape is None:
        return ""
    parents = [parsed.parent_of[shape]] if shape in parsed.parent_of else []
    materials = parsed.children_of(shape, mi.ObjectType.BSDF)
    # What is under a twosided or a mask, too.
    materials += [k for m in materials for k in parsed.children_of(m, mi.ObjectType.BSDF)]
    named = (_id(parsed, node) for node in (*parents, *materials))
    props = parsed.state.nodes[shape].props
    file = Path(str(props["filename"])).stem if "filename" in props else ""
    return next(filter(None, named), file)


def _id(parsed: ParsedScene, node: int) -> str:
    said = str(parsed.state.nodes[node].props.id())
    return "" if _MADE_UP.fullmatch(said) else said
