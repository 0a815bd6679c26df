"""Identities of planes: hashes of all that the image of one light at unit emission depends on.

That is the scene without what its emitters say of themselves (`unlit_content`), and the light's own
emitters: kind, place, shape, cone, texture (`EmitterDigest`). Names of things do not count, nor do
colour and brightness where the unit of a light is white. An area light's shape blocks and reflects
the light of all others, so it belongs to the scene, with its place in it.
"""

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.scene.properties.emission import EmissionKind, Scaling
from lightpaint.scene.properties.film import Film
from lightpaint.scene.scene_tree import ParsedScene

#: Names that Mitsuba's parser makes up for what stands in another element.
_MADE_UP = re.compile(r"_(arg|unnamed)_\d+")

#: Bytes of a file that are hashed at a time.
CHUNK = 2**24


@dataclass(frozen=True)
class EmitterDigest:
    """Hashes of an emitter and the shape that it belongs to.

    unit: of what its light at unit emission depends on; as_is: with its emission, and how often it
    is sampled.
    """

    unit: str
    as_is: str


class SceneHasher:
    """Hashes of a parsed scene, seen through one of its sensors.

    A node's hash is that of its plugin, its values and the hashes of its children; where a value
    names a file, that file's content counts and not its name.
    """

    def __init__(self, parsed: ParsedScene) -> None:
        self._parsed, self._nodes = parsed, parsed.state.nodes
        self._hashes: dict[int, str] = {}
        self._files: dict[str, str] = {}

    def unlit_content(self, film: Film, *, has_environment: bool, has_null: bool) -> str:
        """Return the hash of the scene without its lights, seen through the sensor of `film`.

        has_environment: whether a light surrounds the scene. It decides what integrators make of
        paths that met nothing but surfaces which let them pass, and so counts where there are any.
        has_null: whether there are such surfaces.
        """
        import mitsuba as mi

        parsed, kinds = self._parsed, mi.ObjectType
        others = {*parsed.sensor_nodes} - {parsed.sensor_nodes[film.sensor]}
        children = [
            self._hash(k)
            for k in parsed.children_of(0)
            if self._nodes[k].type != kinds.Emitter and k not in others
        ]
        passes = has_null or parsed.has_media()
        # Views share no random numbers, and go by their index.
        facts = (mi.__version__, film.sensor, has_environment and passes, children)
        return _digest(facts)

    def emitter(self, node: int, kind: EmissionKind | None) -> EmitterDigest:
        """Return the hashes of the emitter at `node`, which is scaled by `kind`."""
        shape = self._parsed.shape_of.get(node)
        where = "" if shape is None else self._hash(shape)
        left_out = {"sampling_weight"}
        if kind is not None and kind.scaling is Scaling.COLOUR:
            left_out.add(kind.parameter)
        return EmitterDigest(
            _digest((where, self._content(node, frozenset(left_out)))),
            _digest((where, self._content(node))),
        )

    def _hash(self, node: int) -> str:
        """Return the hash of a node, in which emitters are nothing but there."""
        import mitsuba as mi

        if node not in self._hashes:
            is_emitter = self._nodes[node].type == mi.ObjectType.Emitter
            self._hashes[node] = "emitter" if is_emitter else self._content(node)
        return self._hashes[node]

    def _content(self, node: int, left_out: frozenset[str] = frozenset()) -> str:
        import mitsuba as mi

        tree_node, props = self._nodes[node], self._nodes[node].props
        kinds, parts = mi.Properties.Type, []
        # A basis has a box filter, and samples of its own.
        replaced = (mi.ObjectType.Sampler, mi.ObjectType.ReconstructionFilter)
        for key in props:
            if key in left_out:
                continue
            kind = props.type(key)
            if kind == kinds.ResolvedReference:
                child = props[key].index()
                if self._nodes[child].type in replaced:
                    continue
                value: Any = self._hash(child)
            elif kind == kinds.String and "file" in key:
                value = self._file(str(props[key]))
            else:
                value = self._value(kind, props[key])
            parts.append((_MADE_UP.sub("", key), str(kind), value))
        # Parameters may stand in any order, but for children without a name.
        parts.sort(key=lambda entry: entry[0])
        return _digest((str(tree_node.type), props.plugin_name(), parts))

    def _value(self, kind: Any, value: Any) -> Any:
        """Return what a property holds, as plain values in full precision."""
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
        # What cannot be looked into may be anything: then all of the scene counts.
        return self._everything

    @property
    def _everything(self) -> str:
        return self._parsed.content(0)

    def _file(self, name: str) -> str:
        """Return the hash of a file's content, with the ending that says how it is read."""
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
    """Return the identity of a plane: of the scene without its lights, and of a light's own."""
    return _digest((unlit_content, *own))


def _digest(content: object) -> str:
    return hashlib.sha256(repr(content).encode()).hexdigest()[:32]
