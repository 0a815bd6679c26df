"""The integrator of a scene: which light paths there are, and another one in its place."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from lightpaint.errors import SceneError
from lightpaint.files import one_line

#: What the scene's own integrator says that goes on to hold for another that knows it, too.
KEPT = {
    **dict.fromkeys(("path", "volpath", "volpathmis"), ("max_depth", "rr_depth", "hide_emitters")),
    "direct": ("hide_emitters",),
}

#: Integrators that only hand on what others render, which stand inside them.
WRAPPERS = ("aov", "moment")

#: How long paths are where nobody says, if not without end.
DEPTHS = {"prb": 6, "prb_basic": 6, "prb_projective": 6, "prbvolpath": 6}

_CHOICE = re.compile(r"([a-z]\w*)(?::(.*))?", re.DOTALL)
_OPTION = re.compile(r"([a-z]\w*)=(\S+)")


@dataclass(frozen=True)
class Integrator:
    """The part of the scene's integrator that decides which light paths there are.

    plugin: of the integrator that renders light, inside those that wrap it (`aov`, `moment`).
    samples: what `direct` draws per surface point of emitters and of the BSDF.
    """

    plugin: str
    max_depth: int
    rr_depth: int
    hide_emitters: bool
    samples: tuple[int, int] = (1, 1)


@dataclass(frozen=True)
class IntegratorChoice:
    """An integrator to render with instead of the scene's own: its plugin, and its options."""

    plugin: str
    options: Mapping[str, bool | int | float | str] = field(default_factory=dict)

    @classmethod
    def of(cls, text: str) -> "IntegratorChoice":
        """From `path` or `path:max_depth=8,hide_emitters=true`. Raises SceneError."""
        found = _CHOICE.fullmatch(text)
        given = [] if found is None or found[2] is None else found[2].split(",")
        options = [_OPTION.fullmatch(one.strip()) for one in given]
        if found is None or not all(options):
            raise SceneError(
                f"{one_line(repr(text))} is no integrator: give one of Mitsuba's by name, with or "
                "without options, like 'path' or 'path:max_depth=8,rr_depth=5'"
            )
        return cls(found[1], {one[1]: _value(one[2]) for one in options if one is not None})

    def __str__(self) -> str:
        options = ",".join(f"{key}={_written(value)}" for key, value in self.options.items())
        return f"{self.plugin}:{options}" if options else self.plugin

    @property
    def xml(self) -> str:
        """As an element of a scene."""
        # It brings half of the network's protocols along.
        from xml.sax.saxutils import quoteattr

        inner = "".join(
            f"<{_element(value)} name={quoteattr(key)} value={quoteattr(_written(value))}/>"
            for key, value in self.options.items()
        )
        return f'<integrator type="{self.plugin}">{inner}</integrator>'

    def over(self, own: Mapping[str, Any]) -> "IntegratorChoice":
        """With what the scene's `own` says of the paths, where nothing else is asked."""
        kept = {key: own[key] for key in KEPT.get(self.plugin, ()) if key in own}
        return IntegratorChoice(self.plugin, {**kept, **self.options})


def read_integrator(state: Any, path: Any) -> Integrator:
    """That of a parsed scene, whose references are resolved. Raises SceneError."""
    nodes = integrator_nodes(state)
    if not nodes:
        # Mitsuba's own choice for a scene that names none.
        return Integrator("path", -1, 5, False)
    outermost = state.nodes[nodes[0]].props.plugin_name()
    while state.nodes[nodes[0]].props.plugin_name() in WRAPPERS:
        nodes = integrator_nodes(state, nodes[0])
        if not nodes:
            raise SceneError(
                f"{path} has an {outermost!r} integrator with none inside that renders light: put "
                "a path integrator into it"
            )
    props = state.nodes[nodes[0]].props
    shading = int(props.get("shading_samples", 1))
    samples = (props.get("emitter_samples", shading), props.get("bsdf_samples", shading))
    return Integrator(
        props.plugin_name(),
        int(props.get("max_depth", DEPTHS.get(props.plugin_name(), -1))),
        int(props.get("rr_depth", 5)),
        bool(props.get("hide_emitters", False)),
        (int(samples[0]), int(samples[1])),
    )


def replace_integrator(state: Any, choice: IntegratorChoice) -> IntegratorChoice:
    """Put another integrator in the place of all that a parsed scene has.

    Returns it with what it keeps of them: of the first one that says it, from outside inwards.
    """
    import mitsuba as mi

    own: dict[str, Any] = {}
    nodes = integrator_nodes(state)
    while nodes:
        props = state.nodes[nodes[0]].props
        own = {**{key: props[key] for key in KEPT["path"] if key in props}, **own}
        nodes = nodes[1:] + integrator_nodes(state, nodes[0])
    choice = choice.over(own)
    node = mi.parser.SceneNode()
    node.type = mi.ObjectType.Integrator
    node.props = mi.Properties(choice.plugin)
    for key, value in choice.options.items():
        node.props[key] = value
    replaced = [key for key, _ in _references(state, 0, mi.ObjectType.Integrator)]
    state.nodes.append(node)  # which moves the others: no reference to one may be held meanwhile
    root = state.nodes[0].props
    for key in replaced:
        del root[key]
    root["integrator of lightpaint"] = mi.Properties.ResolvedReference(len(state.nodes) - 1)
    return choice


def integrator_nodes(state: Any, parent: int = 0) -> list[int]:
    """The integrators that stand directly in a node, in the scene itself by default."""
    import mitsuba as mi

    return [node for _, node in _references(state, parent, mi.ObjectType.Integrator)]


def _references(state: Any, parent: int, kind: Any) -> list[tuple[str, int]]:
    import mitsuba as mi

    props = state.nodes[parent].props
    resolved = mi.Properties.Type.ResolvedReference
    found = [(key, int(props[key].index())) for key in props if props.type(key) == resolved]
    return [(key, node) for key, node in found if state.nodes[node].type == kind]


def _value(text: str) -> bool | int | float | str:
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _written(value: bool | int | float | str) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _element(value: bool | int | float | str) -> str:
    """The XML element that holds such a value."""
    kinds = {bool: "boolean", int: "integer", float: "float", str: "string"}
    return kinds[type(value)]
