"""The integrator of a scene, which decides its light paths, and replacing it."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from lightpaint.errors import SceneError
from lightpaint.files import one_line

#: Parameters that a replacement inherits from the scene's own integrator, by its plugin.
INHERITED = {
    **dict.fromkeys(("path", "volpath", "volpathmis"), ("max_depth", "rr_depth", "hide_emitters")),
    "direct": ("hide_emitters",),
}

#: Integrators that only wrap another one.
WRAPPERS = ("aov", "moment")

#: Default max_depth of integrators that limit it.
DEPTHS = {"prb": 6, "prb_basic": 6, "prb_projective": 6, "prbvolpath": 6}

_CHOICE = re.compile(r"([a-z]\w*)(?::(.*))?", re.DOTALL)
_OPTION = re.compile(r"([a-z]\w*)=(\S+)")


@dataclass(frozen=True)
class Integrator:
    """The parameters of the scene's integrator that decide its light paths.

    plugin: the integrator that computes light, inside any wrappers (`aov`, `moment`). samples: for
    `direct`, numbers of emitter and BSDF samples per surface point.
    """

    plugin: str
    max_depth: int
    rr_depth: int
    hide_emitters: bool
    samples: tuple[int, int] = (1, 1)


@dataclass(frozen=True)
class IntegratorChoice:
    """A replacement for the scene's integrator: plugin and options."""

    plugin: str
    options: Mapping[str, bool | int | float | str] = field(default_factory=dict)

    @classmethod
    def of(cls, text: str) -> "IntegratorChoice":
        """Parse a choice such as `path` or `path:max_depth=8,hide_emitters=true`. Raises
        SceneError.
        """
        match = _CHOICE.fullmatch(text)
        parts = [] if match is None or match[2] is None else match[2].split(",")
        options = [_OPTION.fullmatch(part.strip()) for part in parts]
        if match is None or not all(options):
            raise SceneError(
                f"{one_line(repr(text))} is not an integrator: expected the name of one of "
                "Mitsuba's, with or without options, like 'path' or 'path:max_depth=8,rr_depth=5'"
            )
        return cls(match[1], {part[1]: _value(part[2]) for part in options if part is not None})

    def __str__(self) -> str:
        options = ",".join(f"{key}={_xml_value(value)}" for key, value in self.options.items())
        return f"{self.plugin}:{options}" if options else self.plugin

    @property
    def xml(self) -> str:
        """The XML element for a scene file."""
        # Imported late, since it imports many network modules.
        from xml.sax.saxutils import quoteattr

        inner = "".join(
            f"<{_element(value)} name={quoteattr(key)} value={quoteattr(_xml_value(value))}/>"
            for key, value in self.options.items()
        )
        return f'<integrator type="{self.plugin}">{inner}</integrator>'

    def over(self, own: Mapping[str, Any]) -> "IntegratorChoice":
        """Return the choice with parameters inherited from the scene's `own` integrator added."""
        inherited = {key: own[key] for key in INHERITED.get(self.plugin, ()) if key in own}
        return IntegratorChoice(self.plugin, {**inherited, **self.options})


def read_integrator(state: Any, path: Any) -> Integrator:
    """Return the integrator of a parsed scene whose references are resolved. Raises SceneError."""
    nodes = integrator_nodes(state)
    if not nodes:
        # Mitsuba's default.
        return Integrator("path", -1, 5, False)
    outermost = state.nodes[nodes[0]].props.plugin_name()
    while state.nodes[nodes[0]].props.plugin_name() in WRAPPERS:
        nodes = integrator_nodes(state, nodes[0])
        if not nodes:
            raise SceneError(
                f"{path} has an {outermost!r} integrator without one inside that renders light: "
                "put a path integrator into it"
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
    """Replace all integrators of a parsed scene with another one.

    Returns the choice with inherited parameters, each taken from the outermost integrator that sets
    it.
    """
    import mitsuba as mi

    given_values: dict[str, Any] = {}
    nodes = integrator_nodes(state)
    while nodes:
        props = state.nodes[nodes[0]].props
        given_values = {
            **{key: props[key] for key in INHERITED["path"] if key in props},
            **given_values,
        }
        nodes = nodes[1:] + integrator_nodes(state, nodes[0])
    choice = choice.over(given_values)
    node = mi.parser.SceneNode()
    node.type = mi.ObjectType.Integrator
    node.props = mi.Properties(choice.plugin)
    for key, value in choice.options.items():
        node.props[key] = value
    replaced_keys = [key for key, _ in _references(state, 0, mi.ObjectType.Integrator)]
    state.nodes.append(node)  # appending moves the nodes in memory: keep no references to them
    root = state.nodes[0].props
    for key in replaced_keys:
        del root[key]
    root["integrator of lightpaint"] = mi.Properties.ResolvedReference(len(state.nodes) - 1)
    return choice


def integrator_nodes(state: Any, parent: int = 0) -> list[int]:
    """Return the integrators directly inside a node, by default the scene itself."""
    import mitsuba as mi

    return [node for _, node in _references(state, parent, mi.ObjectType.Integrator)]


def _references(state: Any, parent: int, kind: Any) -> list[tuple[str, int]]:
    import mitsuba as mi

    props = state.nodes[parent].props
    resolved = mi.Properties.Type.ResolvedReference
    references = [(key, int(props[key].index())) for key in props if props.type(key) == resolved]
    return [(key, node) for key, node in references if state.nodes[node].type == kind]


def _value(text: str) -> bool | int | float | str:
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _xml_value(value: bool | int | float | str) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def _element(value: bool | int | float | str) -> str:
    """Return the name of the XML element for a value."""
    kinds = {bool: "boolean", int: "integer", float: "float", str: "string"}
    return kinds[type(value)]
