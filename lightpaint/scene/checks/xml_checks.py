"""Checks of a scene's XML, immediately before and after Mitsuba parses it.

Mitsuba's parser accepts everything: nesting until the stack overflows, includes and parameters that
multiply without end, pipes that never answer. These functions read the same text within limits, and
report each such fault as a SceneError, as well as missing parameters without which a plugin
crashes.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.errors import SceneError
from lightpaint.files import file_length, one_line, read_bytes
from lightpaint.scene.checks.tokens import attributes, encoding_of, line_of, markup, place_of_node

#: Maximum size of all XML in bytes; a file that is included twice counts twice.
MAX_XML = 2**26
#: Maximum number of elements that create an object; each costs Mitsuba about 20 kB and 0.1 ms.
MAX_OBJECTS = 100_000
#: Maximum number of included files, and maximum nesting of elements or references.
MAX_INCLUDES = 10_000
MAX_NESTING = 100
#: Maximum number of elements of any kind, and of searches for a parameter in a value.
MAX_ELEMENTS = 1_000_000
MAX_LOOKUPS = 10_000_000
#: Maximum length of an attribute value after substitution of parameters.
MAX_VALUE = 2**16

#: Elements that change which files are read.
_FOLLOWED = (b"default", b"path", b"include", b"spectrum")
_OBJECTS = frozenset(
    b"bsdf emitter field film integrator medium phase rfilter sampler scene sensor shape texture "
    b"volume".split()
)

#: Plugin → alternative parameters, one of which is required, and XML for the error message. Loading
#: and rendering each plugin without parameters found these; others report what they lack.
REQUIRED = {
    "bitmap": (("filename", "bitmap", "data"), '<string name="filename" value="..."/>'),
    "blendbsdf": (("weight",), '<float name="weight" value="..."/>'),
    "volume": (("volume",), '<volume name="volume" type="..."/>'),
}


def check_xml(path: Path, parameters: Mapping[str, str], resolver: Any) -> None:
    """Raise SceneError unless Mitsuba can parse the XML at `path` and its includes within the
    limits.

    parameters: values of `$name` parameters. resolver: an mi.FileResolver that includes the folder
    of `path`. Other faults are left to Mitsuba.
    """
    _Walk(parameters).file(path, resolver, 0, ())


def check_nodes(path: Path, state: Any) -> None:
    """Raise SceneError unless a scene can be built from what Mitsuba has parsed.

    References between objects must be at most MAX_NESTING deep, and all numbers finite as float32.
    Cycles are left to Mitsuba.
    """
    import mitsuba as mi

    types = mi.Properties.Type
    index_of = dict(state.id_to_index)
    children_of: list[list[int]] = []
    for node in state.nodes:
        props, children = node.props, []
        for key in props:
            kind = props.type(key)
            if kind == types.ResolvedReference:
                children.append(int(props[key].index()))
            elif kind == types.Reference:
                children += [index_of[i] for i in [str(props[key].id())] if i in index_of]
            elif kind in (types.Float, types.Vector, types.Color, types.Transform, types.Spectrum):
                value = props[key]
                if kind == types.Transform:
                    value = value.matrix
                elif kind == types.Spectrum:
                    value = value.values
                numbers = np.array(value, np.float64).ravel()
                if not (np.abs(numbers) <= np.finfo(np.float32).max).all():
                    name = one_line(props.id() or props.plugin_name())
                    raise SceneError(
                        f"{path}: {name!r} has the {one_line(key)} {one_line(str(numbers))}: not "
                        "finite as a float32"
                    )
        children_of.append(children)
    if _deepest(children_of) > MAX_NESTING:
        raise SceneError(f"{path} has references nested more than {MAX_NESTING} deep")


def _deepest(children: Sequence[Sequence[int]]) -> int:
    """Return the length of the longest downward path from any node; edges that close a cycle are
    ignored.
    """
    depth = [0] * len(children)  # of the subtree; -1 while it is being computed
    is_done = [False] * len(children)
    for root in range(len(children)):
        stack = [root]
        while stack:
            node = stack[-1]
            if is_done[node]:
                stack.pop()
            elif depth[node] == -1:
                depth[node] = 1 + max((depth[c] for c in children[node] if is_done[c]), default=0)
                is_done[node] = True
                stack.pop()
            else:
                depth[node] = -1
                stack += [c for c in children[node] if not is_done[c] and depth[c] != -1]
    return max(depth, default=0)


class _Walk:
    """A traversal of a scene's files in the order in which Mitsuba parses them."""

    def __init__(self, parameters: Mapping[str, str]) -> None:
        self.parameters = {f"${name}": value for name, value in parameters.items()}
        self.bytes = self.elements = self.objects = self.includes = self.looked_up = 0
        # A file may be included thousands of times, but is read only once.
        self.contents: dict[Path, bytes] = {}

    def file(self, path: Path, resolver: Any, depth: int, chain: tuple[Path, ...]) -> None:
        """Traverse a file.

        depth: nesting depth of the element that includes it. chain: the including files, outermost
        first.
        """
        import mitsuba as mi

        chain = (*chain, path)
        try:
            data = self._read(path)
        except SceneError as error:
            prefix = f"{chain[-2]}: " if len(chain) > 1 else ""
            raise SceneError(prefix, error) from None
        self.bytes += len(data)
        self.includes += 1
        if self.bytes > MAX_XML or self.includes > MAX_INCLUDES:
            raise SceneError(
                f"{chain[0]} is too large with its includes: expected at most {MAX_INCLUDES} files "
                f"of {MAX_XML} bytes together"
            )
        inner = mi.FileResolver(resolver)
        if len(chain) > 1:
            inner.prepend(str(path.parent))
        open_count = depth
        for token in _markup(path, data):
            if token["tag"] is not None:
                open_count += 1
                if open_count > MAX_NESTING:
                    line = line_of(data, token.start())
                    raise SceneError(
                        f"{path}, line {line}: elements are nested more than {MAX_NESTING} deep"
                    )
                self._count(token["tag"], chain[0])
                try:
                    self._element(token, inner, open_count, chain)
                except ValueError as error:
                    line = line_of(data, token.start())
                    raise SceneError(f"{path}, line {line}: {error}") from None
            if token["end"] is not None or token["empty"]:
                open_count -= 1
                if open_count <= depth:
                    return

    def _read(self, path: Path) -> bytes:
        if path not in self.contents:
            raw = read_bytes(path, "scene file", SceneError, limit=MAX_XML)
            self.contents[path] = _as_utf8(raw)
        return self.contents[path]

    def _count(self, tag: bytes, scene: Path) -> None:
        self.elements += 1
        self.objects += tag in _OBJECTS
        if self.objects > MAX_OBJECTS or self.elements > MAX_ELEMENTS:
            raise SceneError(
                f"{scene} has more than {MAX_OBJECTS} objects or {MAX_ELEMENTS} elements with "
                "its includes, too many to load: merge shapes into meshes"
            )

    def _element(
        self, token: re.Match[bytes], resolver: Any, depth: int, chain: tuple[Path, ...]
    ) -> None:
        """Process an element. Raises ValueError for faults; the caller adds their position."""
        tag = token["tag"]
        if b"$" not in token["attributes"] and tag not in _FOLLOWED:
            return
        values = {
            key: self._substituted(value) if "$" in value else value
            for key, value in attributes(token).items()
        }
        if tag == b"default" and values.get("name"):
            self.parameters.setdefault(f"${values['name']}", values.get("value", ""))
        elif tag == b"path" and values.get("value"):
            resolver.prepend(_resolved(resolver, values["value"]))
        elif tag in (b"include", b"spectrum") and values.get("filename"):
            file = Path(_resolved(resolver, values["filename"]))
            if file not in self.contents:
                if not file.exists():
                    return  # Mitsuba reports it
                try:
                    file_length(file, "file to read", SceneError)
                except SceneError as error:
                    raise ValueError(error.sentence) from None
            if tag == b"include":
                self.file(file, resolver, depth, chain)

    def _substituted(self, text: str) -> str:
        self.looked_up += len(self.parameters)
        if self.looked_up > MAX_LOOKUPS:
            raise ValueError("too many parameters are used too often: use fewer")
        # Longest name first, since one name may be a prefix of another.
        for key in sorted((k for k in self.parameters if k in text), key=len, reverse=True):
            value = self.parameters[key]
            if len(text) + text.count(key) * len(value) > MAX_VALUE:
                raise ValueError(
                    f"a value has more than {MAX_VALUE} characters after its parameters are "
                    "substituted"
                )
            text = re.sub(rf"(?<!\\){re.escape(key)}", value.replace("\\", r"\\"), text)
        return text.replace("\\$", "$")


def _markup(path: Path, data: bytes) -> Iterator[re.Match[bytes]]:
    """Yield the tokens of a file. Raises SceneError for text that is not XML."""
    try:
        yield from markup(data)
    except ValueError as error:
        raise SceneError(f"{path}, {error}") from None


def _as_utf8(raw: bytes) -> bytes:
    encoding = encoding_of(raw)
    return raw if encoding == "utf-8" else raw.decode(encoding, "replace").encode()


def _resolved(resolver: Any, name: str) -> str:
    # Mitsuba's file names contain neither invalid Unicode nor NUL.
    return str(resolver.resolve(name.encode("utf-8", "replace").decode().replace("\0", "?")))


def check_required(path: Path, state: Any) -> None:
    """Raise SceneError if a plugin of a parsed scene lacks a parameter without which it crashes."""
    for node in state.nodes:
        plugin = str(node.props.plugin_name())
        names, form = REQUIRED.get(plugin, ((), ""))
        if names and not any(name in node.props for name in names):
            kind = str(node.type).rpartition(".")[2].lower()
            given_names = [name for name in node.props if not name.startswith("_")]
            has = f", which has {one_line(', '.join(given_names))}," if given_names else ""
            place = place_of_node(state, node)
            raise SceneError(
                f"{path}: {place}the {kind} {plugin!r}{has} needs {names[0]!r}: write {form} in it"
            )
