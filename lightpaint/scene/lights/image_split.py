"""Splits lights that surround the scene into texels, each an emitter of its own."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from lightpaint.arrays import RGB, Doubles, Floats, as_rgb
from lightpaint.display_text import some_names
from lightpaint.errors import SceneError
from lightpaint.scene.lights.emitters import Emitter
from lightpaint.scene.lights.texels import SPLIT_PLUGINS, GridSize, Texel, coarse_image, texel_names
from lightpaint.scene.plane_identity import EmitterDigest
from lightpaint.scene.properties.emission import (
    EmissionKind,
    EmitterSetting,
    Scaling,
    read_emitted_image,
)
from lightpaint.scene.scene_tree import ParsedScene

#: The emission of a texel is its radiance.
TEXEL_KIND = EmissionKind(Scaling.COLOUR, "radiance", "W/(m² sr)")


def with_split(
    facts: Mapping[str, Any], parsed: ParsedScene, split: Mapping[str, GridSize]
) -> dict[str, Any]:
    """Return the facts of `inspect_scene` with some emitters split into texels.

    split: columns and rows by name of an emitter. Raises SceneError for a light that does not exist
    or cannot be split.
    """
    if not split:
        return dict(facts)
    emitters: list[Emitter] = list(facts["emitters"])
    for name, size in split.items():
        k = _index_of(name, emitters, str(parsed.path))
        taken = {x.name for x in emitters}
        if clash := sorted(taken.intersection(texel_names(name, size))):
            raise SceneError(
                f"{parsed.path} has lights with the names of texels of {name!r}, "
                f"{some_names(clash)}: rename them"
            )
        emitters[k : k + 1] = _texels(emitters[k], size, parsed)
    return {**facts, "emitters": tuple(emitters)}


def _index_of(name: str, emitters: Sequence[Emitter], scene: str) -> int:
    """Return the index of an emitter that can be split. Raises SceneError without one."""
    names = [x.name for x in emitters]
    if name not in names:
        surrounding = [x.name for x in emitters if x.plugin in SPLIT_PLUGINS]
        hint = f"it has {some_names(surrounding)}" if surrounding else "none of its lights can be"
        raise SceneError(f"split: {scene} has no light {name!r} to split into texels; {hint}")
    emitter = emitters[names.index(name)]
    if emitter.plugin not in SPLIT_PLUGINS:
        raise SceneError(
            f"split: light {name!r} is of the kind {emitter.plugin}: only lights around the scene, "
            f"{' and '.join(SPLIT_PLUGINS)}, can be split into texels"
        )
    return names.index(name)


def _texels(emitter: Emitter, size: GridSize, parsed: ParsedScene) -> list[Emitter]:
    """Return the texels of an emitter as emitters, row by row, at their current radiance."""
    if emitter.obstacle:
        raise SceneError(f"light {emitter.name!r} {emitter.obstacle}, so it cannot be split")
    current, (columns, rows) = _current_image(emitter, size, parsed), size
    texels = (Texel(emitter.name, x, y, size) for y in range(rows) for x in range(columns))
    return [
        replace(
            emitter,
            name=texel.name,
            kind=TEXEL_KIND,
            emission=as_rgb(current[texel.row, texel.column]),
            form=_form(texel),
            digest=_digest(emitter.digest, texel),
            has_name=True,
            unit_flux=None,
            texel=texel,
        )
        for texel in texels
    ]


def _digest(digest: EmitterDigest | None, texel: Texel) -> EmitterDigest | None:
    place = f"texel {texel.column} {texel.row} of {texel.size}"
    return digest and EmitterDigest(f"{digest.unit} {place}", f"{digest.as_is} {place}")


def _form(texel: Texel) -> str:
    columns, rows = texel.size
    return f"texel {texel.column}, {texel.row} of {columns}x{rows}"


def _current_image(emitter: Emitter, size: GridSize, parsed: ParsedScene) -> Doubles:
    """Return the radiance that each texel has now, (rows, columns, 3), with the same total
    light.
    """
    columns, rows = size
    if emitter.plugin == "constant":
        return np.broadcast_to(np.array(emitter.emission), (rows, columns, 3)).copy()
    assert emitter.kind is not None
    path, is_linear = parsed.image_file(emitter.node, emitter.kind.parameter)
    scale = float(parsed.state.nodes[emitter.node].props.get("scale", 1.0))
    image = scale * read_emitted_image(path, is_linear).astype(np.float64)
    if not np.isfinite(image).all() or image.min() < 0:
        raise SceneError(
            f"light {emitter.name!r} has an image with values that are negative or not finite, "
            f"{path.name}, so it cannot be split"
        )
    return coarse_image(image, size)


def texel_image(radiances: Mapping[Texel, RGB]) -> Floats:
    """Return the image of texels with these radiances, (rows, columns, 3); others are black."""
    columns, rows = next(iter(radiances)).size
    image = np.zeros((rows, columns, 3), np.float32)
    for texel, rgb in radiances.items():
        image[texel.row, texel.column] = rgb
    return image


def with_texels(
    settings: Mapping[str, EmitterSetting], emitters: Sequence[Emitter], *, evenly: bool = False
) -> dict[int, EmitterSetting]:
    """Return settings by node; those of texels become one setting with an image.

    settings: by name of the emitter. Texels without a setting keep their radiance; an image of
    which no texel has one stays as authored. evenly: whether the images of all texels, also these,
    become an even white, unless they are black.
    """
    by_node = {x.node: settings[x.name] for x in emitters if x.name in settings and not x.texel}
    nodes = {x.node for x in emitters if x.texel and (evenly or x.name in settings)}
    for node in nodes:
        texels = [x for x in emitters if x.node == node]
        set_now = {name: setting.emission for name, setting in settings.items()}
        image = texel_image({x.texel: set_now.get(x.name, x.emission) for x in texels if x.texel})
        weight = max(x.sampling_weight for x in texels) or 1.0
        if not image.any():
            weight = 0.0
        elif evenly:
            image = np.ones_like(image)
        by_node[node] = EmitterSetting(TEXEL_KIND, (0.0, 0.0, 0.0), weight, image)
    return by_node
