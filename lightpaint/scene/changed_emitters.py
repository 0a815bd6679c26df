"""Copies of parsed scenes with changed emitters: moved, black or added, without reading files
again.
"""

from collections.abc import Collection, Mapping
from copy import copy
from typing import Any

from lightpaint.scene.properties.emission import EmitterSetting, set_emission
from lightpaint.scene.properties.pose import Motion, moved_parameters
from lightpaint.scene.scene_tree import ParsedScene


def with_motions(parsed: ParsedScene, motions: Mapping[int, Motion]) -> ParsedScene:
    """Return a copy of a scene with moved emitters. motions: by emitter node."""
    import mitsuba as mi

    copied = copy(parsed)
    copied.state = mi.parser.ParserState(parsed.state)
    copied.moved = dict(parsed.moved)
    for emitter, motion in motions.items():
        node = parsed.shape_of.get(emitter, emitter)
        props = copied.state.nodes[node].props
        parameters = moved_parameters(props, motion)
        for parameter in parameters:
            props[parameter.name] = parameter.value
        copied.moved[node] = {**parsed.moved.get(node, {}), **{p.name: p.xml for p in parameters}}
    return copied


def darkened(parsed: ParsedScene, dark: Mapping[int, EmitterSetting]) -> ParsedScene:
    """Return a copy of a scene in which emitters have other settings. dark: settings by emitter
    node.
    """
    import mitsuba as mi

    copied = copy(parsed)
    copied.state = mi.parser.ParserState(parsed.state)
    for node, setting in dark.items():
        set_emission(copied.state, node, setting, on_shape=node in parsed.shape_of)
    return copied


def without_emitters(parsed: ParsedScene, emitters: Collection[int]) -> ParsedScene:
    """Return a copy of a scene without the emitters of these nodes, and the shapes of theirs."""
    import mitsuba as mi

    copied = copy(parsed)
    copied.state = mi.parser.ParserState(parsed.state)
    copied.emitter_nodes = [node for node in parsed.emitter_nodes if node not in emitters]
    left_out = {*emitters, *(parsed.shape_of[node] for node in emitters if node in parsed.shape_of)}
    reference = mi.Properties.Type.ResolvedReference
    for node in copied.state.nodes:
        for key in list(node.props):
            if node.props.type(key) == reference and node.props[key].index() in left_out:
                del node.props[key]
    return copied


def with_elements(parsed: ParsedScene, elements: Mapping[str, str]) -> ParsedScene:
    """Return a copy of a scene with emitters added, or earlier added ones replaced.

    elements: XML by the name of its emitter, which must not occur in the files.
    """
    import mitsuba as mi

    copied = copy(parsed)
    copied.state = mi.parser.ParserState(parsed.state)
    copied.emitter_nodes, copied.names = [*parsed.emitter_nodes], dict(parsed.names)
    copied.shape_of = dict(parsed.shape_of)
    node_of = {name: node for node, name in parsed.names.items()}
    for name, text in elements.items():
        fragment = mi.parser.parse_string(parsed.config, f'<scene version="3.0.0">{text}</scene>')
        mi.parser.transform_all(parsed.config, fragment)
        kinds = [node.type for node in fragment.nodes]
        inner = kinds.index(mi.ObjectType.Emitter)
        if name in node_of:
            first = node_of[name] - inner + 1
        else:
            first = len(copied.state.nodes)
            copied.emitter_nodes.append(first + inner - 1)
            copied.names[first + inner - 1] = name
            if inner > 1:
                copied.shape_of[first + inner - 1] = first
            root = copied.state.nodes[0].props
            root[f"{name} of lightpaint"] = mi.Properties.ResolvedReference(first)
        _put_nodes(copied.state, first, fragment)
    return copied


def _put_nodes(state: Any, first: int, fragment: Any) -> None:
    """Store the nodes of a parsed fragment, except its root, in `state` from index `first` on."""
    import mitsuba as mi

    reference = mi.Properties.Type.ResolvedReference
    for k, node in enumerate(list(fragment.nodes)[1:]):
        for key in list(node.props):
            if node.props.type(key) == reference:
                child = node.props[key].index() - 1 + first
                node.props[key] = mi.Properties.ResolvedReference(child)
        if first + k < len(state.nodes):
            state.nodes[first + k] = node
        else:
            state.nodes.append(node)
