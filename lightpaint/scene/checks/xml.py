"""What is looked at in a scene's XML before Mitsuba parses it, and right after.

Mitsuba's parser follows whatever it is given: elements or references nested until the stack
overflows, includes and parameters that multiply without end, pipes that never answer. Here the
same text is gone through with bounds, and each of these is a SceneError of one line.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.errors import SceneError
from lightpaint.file_reading import file_length, read_bytes
from lightpaint.files import one_line
from lightpaint.scene.checks.tokens import attributes, encoding_of, line_of, markup

#: Bytes of XML in all, a file that is included twice counting twice.
MAX_XML = 2**26
#: Elements that make an object each. Mitsuba takes some 20 kB and 0.1 ms for one.
MAX_OBJECTS = 100_000
#: Files that are included, and how deep elements, or references, may be nested.
MAX_INCLUDES = 10_000
MAX_NESTING = 100
#: Elements of any kind, and how often a parameter may be looked for in a value.
MAX_ELEMENTS = 1_000_000
MAX_LOOKED_UP = 10_000_000
#: Longest value of an attribute once its parameters are put in.
MAX_VALUE = 2**16

#: Elements that change what is read, or where.
_FOLLOWED = (b"default", b"path", b"include", b"spectrum")
_OBJECTS = frozenset(
    b"bsdf emitter field film integrator medium phase rfilter sampler scene sensor shape texture "
    b"volume".split()
)


def check_xml(path: Path, parameters: Mapping[str, str], resolver: Any) -> None:
    """Raise SceneError unless Mitsuba can parse the XML at `path` and its includes, in bounds.

    parameters: values of its `$name`; resolver: a mi.FileResolver with the folder of `path`.
    What is wrong in other ways is left to Mitsuba.
    """
    _Walk(parameters).file(path, resolver, 0, ())


def check_nodes(path: Path, state: Any) -> None:
    """Raise SceneError unless what Mitsuba has parsed can be made a scene of.

    That is: objects refer to each other no more than MAX_NESTING deep, and all numbers are such
    as a float32 can be. Cycles are left to Mitsuba.
    """
    import mitsuba as mi

    types = mi.Properties.Type
    index_of = dict(state.id_to_index)
    below: list[list[int]] = []
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
        below.append(children)
    if _deepest(below) > MAX_NESTING:
        raise SceneError(f"{path} has references nested more than {MAX_NESTING} deep")


def _deepest(below: Sequence[Sequence[int]]) -> int:
    """Length of the longest path from a node downwards, cycles cut open; below: its children."""
    depth = [0] * len(below)  # of what is below; -1 while it is being found out
    done = [False] * len(below)
    for root in range(len(below)):
        stack = [root]
        while stack:
            node = stack[-1]
            if done[node]:
                stack.pop()
            elif depth[node] == -1:
                depth[node] = 1 + max((depth[c] for c in below[node] if done[c]), default=0)
                done[node] = True
                stack.pop()
            else:
                depth[node] = -1
                stack += [c for c in below[node] if not done[c] and depth[c] != -1]
    return max(depth, default=0)


class _Walk:
    """Through a scene's files in the order in which Mitsuba parses them."""

    def __init__(self, parameters: Mapping[str, str]) -> None:
        self.parameters = {f"${name}": value for name, value in parameters.items()}
        self.bytes = self.elements = self.objects = self.includes = self.looked_up = 0
        # Files may be included thousands of times: each is looked up and read once.
        self.contents: dict[Path, bytes] = {}

    def file(self, path: Path, resolver: Any, depth: int, chain: tuple[Path, ...]) -> None:
        """depth: of the element that includes it; chain: the files that include each other."""
        import mitsuba as mi

        chain = (*chain, path)
        try:
            data = self._read(path)
        except SceneError as error:
            lead = f"{chain[-2]}: " if len(chain) > 1 else ""
            raise SceneError(f"{lead}{error}") from None
        self.bytes += len(data)
        self.includes += 1
        if self.bytes > MAX_XML or self.includes > MAX_INCLUDES:
            raise SceneError(
                f"{chain[0]} is too large with all that it includes: at most {MAX_INCLUDES} files "
                f"of {MAX_XML} bytes together are read"
            )
        inner = mi.FileResolver(resolver)
        if len(chain) > 1:
            inner.prepend(str(path.parent))
        opened = depth
        for found in _markup(path, data):
            if found["tag"] is not None:
                opened += 1
                if opened > MAX_NESTING:
                    line = line_of(data, found.start())
                    raise SceneError(
                        f"{path}, line {line}: elements are nested more than {MAX_NESTING} deep"
                    )
                self._count(found["tag"], chain[0])
                try:
                    self._element(found, inner, opened, chain)
                except ValueError as error:
                    line = line_of(data, found.start())
                    raise SceneError(f"{path}, line {line}: {error}") from None
            if found["end"] is not None or found["empty"]:
                opened -= 1
                if opened <= depth:
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
                f"{scene} has more than {MAX_OBJECTS} objects or {MAX_ELEMENTS} elements with all "
                "that it includes, too many to load: merge shapes into meshes"
            )

    def _element(
        self, found: re.Match[bytes], resolver: Any, depth: int, chain: tuple[Path, ...]
    ) -> None:
        """Raises ValueError for what its place is to be said of."""
        tag = found["tag"]
        if b"$" not in found["attributes"] and tag not in _FOLLOWED:
            return
        given = {
            key: self._filled_in(value) if "$" in value else value
            for key, value in attributes(found).items()
        }
        if tag == b"default" and given.get("name"):
            self.parameters.setdefault(f"${given['name']}", given.get("value", ""))
        elif tag == b"path" and given.get("value"):
            resolver.prepend(_resolved(resolver, given["value"]))
        elif tag in (b"include", b"spectrum") and given.get("filename"):
            file = Path(_resolved(resolver, given["filename"]))
            if file not in self.contents:
                if not file.exists():
                    return  # which is for Mitsuba to say
                try:
                    file_length(file, "file to read", SceneError)
                except SceneError as error:
                    raise ValueError(str(error)) from None
            if tag == b"include":
                self.file(file, resolver, depth, chain)

    def _filled_in(self, text: str) -> str:
        self.looked_up += len(self.parameters)
        if self.looked_up > MAX_LOOKED_UP:
            raise ValueError("parameters are used too often, and there are too many of them")
        # The longest name first, as one may begin with another.
        for key in sorted((k for k in self.parameters if k in text), key=len, reverse=True):
            value = self.parameters[key]
            if len(text) + text.count(key) * len(value) > MAX_VALUE:
                raise ValueError(
                    f"with its parameters put in, a value has more than {MAX_VALUE} characters"
                )
            text = re.sub(rf"(?<!\\){re.escape(key)}", value.replace("\\", r"\\"), text)
        return text.replace("\\$", "$")


def _markup(path: Path, data: bytes) -> Iterator[re.Match[bytes]]:
    """The tokens of a file. Raises SceneError for what no parser reads."""
    try:
        yield from markup(data)
    except ValueError as error:
        raise SceneError(f"{path}, {error}") from None


def _as_utf8(raw: bytes) -> bytes:
    encoding = encoding_of(raw)
    return raw if encoding == "utf-8" else raw.decode(encoding, "replace").encode()


def _resolved(resolver: Any, name: str) -> str:
    # What is no Unicode, and a NUL, is in no name that Mitsuba can say.
    return str(resolver.resolve(name.encode("utf-8", "replace").decode().replace("\0", "?")))
