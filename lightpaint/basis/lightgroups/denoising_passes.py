"""Passes in the file of light groups that help to denoise: surfaces, and parts of lights.

Layers are proposed by name. A layer named as the direct or indirect part of a light is accepted if
it is nowhere brighter than the light. Octane may write both parts of a light and not the light,
which is then their sum.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.lightgroups.beauty_comparison import rounding
from lightpaint.basis.lightgroups.naming_conventions import SEPARATORS, is_fixed_name, is_known
from lightpaint.basis.lightgroups.render_layers import RenderLayer
from lightpaint.images import Features

#: Names in lower case, without the view layer and with spaces for underscores; best first.
ALBEDO_NAMES = (
    "denoising albedo",
    "denoise albedo",
    "albedo",
    "diffuse albedo",
    "diffcol",
    "diffuse color",
)
NORMAL_NAMES = (
    *("denoising normal", "denoise normal", "normal", "n", "nn"),
    *("avg shading normal", "shading normal"),
)
POSITION_NAMES = ("position", "p", "pworld")

#: Names of the parts of a light: a suffix of its layer's name or a prefix of its own name.
PART = re.compile(
    r"(?P<owner>.+)[ ._-](?P<after>direct|indirect)"
    r"|(?:.+\.)?(?P<before>direct|indirect)[ ._-](?P<name>.+)",
    re.I,
)

#: Share of pixels in which a part may exceed its light, since filters have negative lobes.
MAX_EXCEEDING_SHARE = 1e-3


@dataclass(frozen=True)
class DenoisingPasses:
    """The passes of a file that are not lights.

    surfaces: layers of albedo, normals and positions. indirect: the indirect part of each light for
    which it is known, by the name of the light's layer, (h, w, 3) as stored.
    """

    surfaces: tuple[RenderLayer, ...]
    indirect: Mapping[str, Floats]

    def features(self, view: str) -> Features | None:
        """Return the surface features of a view layer; None without albedo or normals."""
        albedo, normal, position = (
            self._surface(names, view) for names in (ALBEDO_NAMES, NORMAL_NAMES, POSITION_NAMES)
        )
        if albedo is None or normal is None:
            return None
        length = np.linalg.norm(normal, axis=-1, keepdims=True)
        unit = normal / np.where(length > 0, length, 1)
        return Features(np.clip(albedo, 0, 1), unit, position)

    def _surface(self, names: Sequence[str], view: str) -> Floats | None:
        """Return the pixels of the first of these names that exists, (h, w, 3) float32, all
        finite.
        """
        of_view = [x for x in self.surfaces if not view or x.name.startswith(f"{view}.")]
        for name in names:
            for layer in of_view or self.surfaces:
                if _plain_name(layer) == name:
                    pixels = layer.image.astype(np.float32)
                    return np.nan_to_num(pixels, nan=0, posinf=0, neginf=0)
        return None


def split_passes(layers: Sequence[RenderLayer]) -> tuple[list[RenderLayer], DenoisingPasses]:
    """Split layers into those that may be lights or the whole picture, and the passes.

    Normals in R, G, B are recognised only next to an albedo, since a light may have their name.
    """
    has_albedo = any(_plain_name(x) in ALBEDO_NAMES for x in layers)
    of_surfaces = {*ALBEDO_NAMES, *(NORMAL_NAMES + POSITION_NAMES if has_albedo else ())}
    surfaces: list[RenderLayer] = []
    light_layers: list[RenderLayer] = []
    for layer in layers:
        is_surface = layer.is_vector or _plain_name(layer) in of_surfaces
        (surfaces if is_surface else light_layers).append(layer)
    light_layers += _sums_of_parts(light_layers)
    by_name = {x.name: x for x in light_layers}
    parts: dict[str, dict[str, RenderLayer]] = {}
    for layer in light_layers:
        match = PART.fullmatch(layer.name)
        owner = None if match is None else _owner(match, by_name)
        if match and owner and (owner.is_sum or _is_part(layer, owner)):
            which = (match["after"] or match["before"]).casefold()
            parts.setdefault(owner.name, {})[which] = layer
    used_names = [layer.name for pair in parts.values() for layer in pair.values()]
    indirect = {
        owner: pair["indirect"].image.astype(np.float32)
        if "indirect" in pair
        else by_name[owner].image.astype(np.float32) - pair["direct"].image
        for owner, pair in parts.items()
    }
    lights = [x for x in light_layers if x.name not in used_names]
    return lights, DenoisingPasses(tuple(surfaces), indirect)


def _sums_of_parts(layers: Sequence[RenderLayer]) -> list[RenderLayer]:
    """Return the lights of which there are both parts alone, each as their sum.

    Only of names that a renderer fixes: a user may call two lamps `cove direct` and `cove
    indirect`.
    """
    names = {layer.name for layer in layers}
    pairs: dict[str, list[RenderLayer]] = {}
    for layer in layers:
        match = PART.fullmatch(layer.name)
        if match and is_fixed_name(match["owner"] or "") and match["owner"] not in names:
            pairs.setdefault(match["owner"], []).append(layer)
    return [
        replace(pair[0], name=owner, image=pair[0].image + pair[1].image, is_sum=True, others=())
        for owner, pair in pairs.items()
        if len(pair) == 2
    ]


def _plain_name(layer: RenderLayer) -> str:
    return layer.name.rpartition(".")[2].casefold().replace("_", " ")


def _owner(match: re.Match[str], layers: Mapping[str, RenderLayer]) -> RenderLayer | None:
    """Return the layer of the light that a part is named after; None if it is missing or
    ambiguous.
    """
    if match["owner"]:
        return layers.get(match["owner"])
    name = match["name"]
    if name in layers:
        return layers[name]
    ends = tuple(f"{joint}{name}" for joint in SEPARATORS)
    owners = [x for x in layers if x != match[0] and x.endswith(ends) and is_known(x)]
    return layers[owners[0]] if len(owners) == 1 else None


def _is_part(part: RenderLayer, owner: RenderLayer) -> bool:
    """Return True if a layer is not black, and nowhere brighter than the light that it may be part
    of.
    """
    beyond = part.image.astype(np.float64) - owner.image - 2 * rounding([part, owner])
    exceeds = (np.nan_to_num(beyond, nan=0, posinf=0, neginf=0) > 0).any(axis=-1)
    return bool(part.image.any()) and float(exceeds.mean()) <= MAX_EXCEEDING_SHARE
