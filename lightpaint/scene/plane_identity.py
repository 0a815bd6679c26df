"""Identities of planes: hashes of everything that the image of one light at unit emission depends
on.

That is the scene without the parameters of its emitters (`unlit_content`), and the light's own
emitters: kind, position, shape, cone, texture (`EmitterDigest`). Names do not count, nor do colour
and brightness if the unit of a light is white. The shape of an area light blocks and reflects the
light of all others, so it belongs to the scene, including its position.
"""

import hashlib
import re
from collections.abc import Container
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.scene.properties.emission import EmissionKind, Scaling
from lightpaint.scene.properties.film import Film
from lightpaint.scene.scene_tree import ParsedScene

#: Names that Mitsuba's parser generates for nested elements.
_MADE_UP = re.compile(r"_(arg|unnamed)_\d+")

#: Number of bytes of a file that are hashed at a time.
CHUNK = 2**24


@dataclass(frozen=True)
class EmitterDigest:
    """Hashes of an emitter together with its shape.

    unit: hash of what its light at unit emission depends on. as_is: also includes its emission and
    sampling weight.
    """

    unit: str
    as_is: str


class SceneHasher:
    """Hashes of a parsed scene, seen through one of its sensors.

    The hash of a node covers its plugin, its values and the hashes of its children; if a value
    names a file, the content of the file counts instead of its name.
    """

    def __init__(self, parsed: ParsedScene) -> None:
        self._parsed, self._nodes = parsed, parsed.state.nodes
        self._hashes: dict[int, str] = {}
        self._files: dict[str, str] = {}

    def unlit_content(self, film: Film, *, has_environment: bool, has_null: bool) -> str:
        """Return the hash of the scene without its lights, seen through the sensor of `film`.

        has_environment: whether a light surrounds the scene, which decides how integrators treat
        paths that meet only null surfaces, and therefore counts if there are any. has_null: whether
        there are null surfaces.
        """
        import mitsuba as mi

        other_sensors = {*self._parsed.sensor_nodes} - {self._parsed.sensor_nodes[film.sensor]}
        passes = has_null or self._parsed.has_media()
        # The index of the sensor counts, since views have independent random numbers.
        children = self._unlit_children(other_sensors)
        return _digest((mi.__version__, film.sensor, has_environment and passes, children))

    @classmethod
    def surroundings(cls, parsed: ParsedScene) -> str:
        """Return a hash of all of a scene but its lights, with every sensor.

        parsed: not loaded yet. Mitsuba still finds the parameters in it that nothing reads.
        """
        return _digest(cls(parsed.copied())._unlit_children(()))

    def _unlit_children(self, left_out: Container[int]) -> list[str]:
        """Return hashes of what the scene consists of besides lights. left_out: nodes."""
        import mitsuba as mi

        emitter = mi.ObjectType.Emitter
        return [
            self._hash(k)
            for k in self._parsed.children_of(0)
            if self._nodes[k].type != emitter and k not in left_out
        ]

    def emitter(self, node: int, kind: EmissionKind | None) -> EmitterDigest:
        """Return the hashes of the emitter at `node`. kind: how it is scaled."""
        shape = self._parsed.shape_of.get(node)
        shape_hash = "" if shape is None else self._hash(shape)
        left_out = {"sampling_weight"}
        if kind is not None and kind.scaling is Scaling.COLOUR:
            left_out.add(kind.parameter)
        return EmitterDigest(
            _digest((shape_hash, self._content(node, frozenset(left_out)))),
            _digest((shape_hash, self._content(node))),
        )

    def _hash(self, node: int) -> str:
        """Return the hash of a node, which is the same for all emitters."""
        import mitsuba as mi

        if node not in self._hashes:
            is_emitter = self._nodes[node].type == mi.ObjectType.Emitter
            self._hashes[node] = "emitter" if is_emitter else self._content(node)
        return self._hashes[node]

    def _content(self, node: int, left_out: frozenset[str] = frozenset()) -> str:
        import mitsuba as mi

        tree_node, props = self._nodes[node], self._nodes[node].props
        kinds, parts = mi.Properties.Type, []
        # A basis replaces the filter by a box, and the sampler by its own.
        replaced_types = (mi.ObjectType.Sampler, mi.ObjectType.ReconstructionFilter)
        for key in props:
            if key in left_out:
                continue
            kind = props.type(key)
            if kind == kinds.ResolvedReference:
                child = props[key].index()
                if self._nodes[child].type in replaced_types:
                    continue
                value: Any = self._hash(child)
            elif kind == kinds.String and "file" in key:
                value = self._file(str(props[key]))
            else:
                value = self._value(kind, props[key])
            parts.append((_MADE_UP.sub("", key), str(kind), value))
        # The order of parameters does not matter, except for unnamed children.
        parts.sort(key=lambda entry: entry[0])
        return _digest((str(tree_node.type), props.plugin_name(), parts))

    def _value(self, kind: Any, value: Any) -> Any:
        """Return the value of a property as plain values in full precision."""
        import mitsuba as mi

        kinds = mi.Properties.Type
        if kind in (kinds.Bool, kinds.Integer, kinds.Float, kinds.String):
            return value
        if kind in (kinds.Vector, kinds.Color):
            return np.array(value, dtype=float).ravel().tolist()
        if kind == kinds.Transform:
            return np.array(value.matrix, dtype=float).ravel().tolist()
        if kind == kinds.Spectrum:
            return [np.array(x, dtype=float).tolist() for x in (value.wavelengths, value.values)]
        # A value of unknown type may be anything, so the whole scene counts.
        return self._everything

    @property
    def _everything(self) -> str:
        return self._parsed.content(0)

    def _file(self, name: str) -> str:
        """Return the hash of a file's content, with the suffix, which decides how it is read."""
        if name not in self._files:
            path, digest = Path(str(self._parsed.resolver.resolve(name))), hashlib.sha256()
            if path.is_file():
                with path.open("rb") as file:
                    while data := file.read(CHUNK):
                        digest.update(data)
            else:
                digest.update(name.encode())
            self._files[name] = f"{digest.hexdigest()} {path.suffix}"
        return self._files[name]


def combined_identity(unlit_content: str, *own: object) -> str:
    """Return the identity of a plane from the hash of the unlit scene and the hash of the light."""
    return _digest((unlit_content, *own))


def _digest(content: object) -> str:
    return hashlib.sha256(repr(content).encode()).hexdigest()[:32]
