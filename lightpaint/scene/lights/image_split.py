"""Splits lights that show an image into texels, each an emitter of its own."""

import gc
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from lightpaint.arrays import RGB, Doubles, Floats, Indices, as_rgb
from lightpaint.display_text import some_names
from lightpaint.errors import SceneError
from lightpaint.scene.lights.emitters import Emitter
from lightpaint.scene.lights.texels import image_domains
from lightpaint.scene.lights.texels.texel import RATIO, Texel, TexelLayout, node_name
from lightpaint.scene.plane_identity import EmitterDigest
from lightpaint.scene.properties.emission import (
    EmissionKind,
    EmittedImage,
    EmitterSetting,
    Scaling,
    child_named,
    read_emitted_image,
)
from lightpaint.scene.properties.site import Site
from lightpaint.scene.scene_tree import ParsedScene

#: Longest side of the image that is averaged, in pixels.
MAX_SIDE = 8192

#: Shapes that are meshes, whose texture coordinates are in their files.
MESHES = ("obj", "ply", "serialized", "cube")

#: Distance by which coordinates may leave the image, from rounding.
COORDINATE_TOLERANCE = 1e-4
#: Number of places at which a mesh is searched for a second triangle with the same coordinates, and
#: number of comparisons in all.
MAX_PLACES, MAX_COMPARISONS = 512, 2**23


def with_split(
    facts: Mapping[str, Any],
    parsed: ParsedScene,
    split: Mapping[str, image_domains.GridSize | TexelLayout],
    symmetric: Collection[str] = (),
) -> dict[str, Any]:
    """Return the facts of `inspect_scene` with some emitters split into texels.

    split: columns and rows, or a layout of texels, by name of an emitter. symmetric: names of those
    whose images become their means with their mirror images. Raises SceneError for a light that
    does not exist or cannot be split.
    """
    if not split:
        return dict(facts)
    emitters: list[Emitter] = list(facts["emitters"])
    for name, size in split.items():
        layout = size if isinstance(size, TexelLayout) else TexelLayout(size)
        k = _index_of(name, emitters, str(parsed.path))
        taken = {x.name for x in emitters}
        if clash := sorted(taken.intersection(node_name(name, x) for x in layout.nodes)):
            raise SceneError(
                f"{parsed.path} has lights with the names of texels of {name!r}, "
                f"{some_names(clash)}: rename them"
            )
        emitters[k : k + 1] = _texels(emitters[k], layout, parsed, is_symmetric=name in symmetric)
    return {**facts, "emitters": tuple(emitters)}


def images_to_split(
    sizes: Mapping[str, image_domains.GridSize | TexelLayout],
    emitters: Sequence[Emitter],
    scene: str,
) -> dict[str, image_domains.GridSize | TexelLayout]:
    """Return columns and rows, or layouts, by name of an emitter, of names and patterns of lights.

    A pattern stands for the lights of its name that can be split; the name of one comes before
    patterns that match it. Raises SceneError for a pattern that matches none.
    """
    names = [x.name for x in emitters]
    possible = [x.name for x in emitters if x.plugin in image_domains.DOMAINS]
    named = {name: size for name, size in sizes.items() if name in names or not _is_pattern(name)}
    matched: dict[str, image_domains.GridSize | TexelLayout] = {}
    for pattern, size in sizes.items():
        if pattern in named:
            continue
        matches = [name for name in possible if fnmatchcase(name, pattern)]
        if not matches:
            raise _no_light_to_split(pattern, possible, scene)
        matched |= dict.fromkeys(matches, size)
    return matched | named


def _is_pattern(name: str) -> bool:
    return any(character in name for character in "*?[")


def _no_light_to_split(name: str, possible: Sequence[str], scene: str) -> SceneError:
    hint = f"it has {some_names(possible)}" if possible else "none of its lights can be"
    return SceneError(f"split: {scene} has no light {name!r} to split into texels; {hint}")


def _index_of(name: str, emitters: Sequence[Emitter], scene: str) -> int:
    """Return the index of an emitter that can be split. Raises SceneError without one."""
    names = [x.name for x in emitters]
    if name not in names:
        raise _no_light_to_split(
            name, [x.name for x in emitters if x.plugin in image_domains.DOMAINS], scene
        )
    emitter = emitters[names.index(name)]
    if emitter.plugin not in image_domains.DOMAINS:
        *others, last = image_domains.DOMAINS
        raise SceneError(
            f"split: light {name!r} is of the kind {emitter.plugin}: only {', '.join(others)} and "
            f"{last} lights can be split into texels"
        )
    return names.index(name)


def _texels(
    emitter: Emitter, layout: TexelLayout, parsed: ParsedScene, *, is_symmetric: bool
) -> list[Emitter]:
    """Return the texels of an emitter as emitters, row by row, at their current emission."""
    shape = parsed.shape_plugin(emitter.node)
    domain = image_domains.domain_of(emitter.plugin, shape)
    if emitter.obstacle:
        raise SceneError(f"light {emitter.name!r} {emitter.obstacle}, so it cannot be split")
    assert emitter.kind is not None
    if emitter.kind.scaling is Scaling.FACTORS:
        raise SceneError(
            f"light {emitter.name!r} has an emission that is neither a bitmap nor a single colour, "
            "so it cannot be split"
        )
    if shape and (reason := _why_no_image(emitter, shape, parsed)):
        raise SceneError(
            f"light {emitter.name!r} {reason}, so it cannot be split: give it a rectangle, or a "
            "mesh with texture coordinates (uv) for one flat image"
        )
    if layout.splits and not isinstance(domain, image_domains.Sky):
        raise SceneError(f"light {emitter.name!r} is not a sky: only its texels can be split again")
    radiances = _current_radiances(emitter, layout, domain, parsed)
    if is_symmetric:
        mirrored = [layout.number_of.get(layout.mirrored(x), k) for k, x in enumerate(layout.nodes)]
        radiances = (radiances + radiances[mirrored]) / 2
    texels = (Texel(emitter.name, node, layout, domain) for node in layout.nodes)
    return [
        replace(
            emitter,
            name=texel.name,
            kind=kind_of(domain),
            emission=as_rgb(radiance),
            form=texel.form,
            digest=_digest(emitter.digest, texel),
            has_name=True,
            unit_flux=None,
            # A texel cannot move without the others.
            site=Site(),
            texel=texel,
        )
        for texel, radiance in zip(texels, radiances, strict=True)
    ]


def _current_radiances(
    emitter: Emitter, layout: TexelLayout, domain: image_domains.ImageDomain, parsed: ParsedScene
) -> Doubles:
    """Return what the texels of an emitter show now, (nodes, 3)."""
    assert emitter.kind is not None
    if emitter.is_dark:
        return np.zeros((len(layout.nodes), 3))
    shown = (emitter.node, emitter.kind, emitter.emission, domain)
    # An image that was written from these texels has their values.
    if layout.splits:
        radiances = layout.shown_by(current_image(*shown, layout.finest, parsed))
        if radiances is not None:
            return radiances
    return layout.values(current_image(*shown, layout.size, parsed))


def _why_no_image(emitter: Emitter, shape: str, parsed: ParsedScene) -> str:
    """Return why the shape of an emitter cannot show an image; "" if it can."""
    if shape not in MESHES:
        return why_no_image(shape, None)
    reason = _why_no_image_on_mesh(parsed.names[emitter.node], shape, parsed.instantiate({}))
    gc.collect()  # no other scene may be loaded before this one is gone
    return reason


def _why_no_image_on_mesh(name: str, shape: str, loaded: Any) -> str:
    """Return why the mesh of an emitter in a loaded scene cannot show an image."""
    for mesh in loaded.shapes():
        if mesh.emitter() is not None and mesh.emitter().id() == name:
            return why_no_image(shape, mesh)
    raise SceneError(f"light {name!r} is on a shape that is not loaded")


def _digest(digest: EmitterDigest | None, texel: Texel) -> EmitterDigest | None:
    place = texel.identity
    return digest and EmitterDigest(f"{digest.unit} {place}", f"{digest.as_is} {place}")


def kind_of(domain: image_domains.ImageDomain) -> EmissionKind:
    """Return how the texels of an image are scaled."""
    return EmissionKind(Scaling.COLOUR, domain.parameter, domain.unit)


def texel_image(radiances: Mapping[Texel, RGB]) -> Floats:
    """Return the image of texels with these radiances, (rows, columns, 3); others are black."""
    layout = next(iter(radiances)).layout
    values = np.zeros((len(layout.nodes), 3))
    for texel, rgb in radiances.items():
        values[layout.number_of[texel.node]] = rgb
    return layout.image(values).astype(np.float32)


def with_texels(
    settings: Mapping[str, EmitterSetting], emitters: Sequence[Emitter], *, evenly: bool = False
) -> dict[int, EmitterSetting]:
    """Return settings by node; the settings of texels become one setting with an image.

    settings: by name of the emitter. Texels without a setting keep their radiance; an image of
    which no texel has one stays as authored. evenly: whether the images of all texels, also these,
    become even ones (`even_image`), unless they are black.
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
            image = np.repeat(even_image(texels, settings)[..., None], 3, axis=2)
        domain = next(x.texel.domain for x in texels if x.texel)
        shown = EmittedImage(
            domain.as_stored(image), domain.parameter, domain.has_texture, domain.has_proportions
        )
        by_node[node] = EmitterSetting(kind_of(domain), (0.0, 0.0, 0.0), weight, shown)
    return by_node


def even_image(texels: Sequence[Emitter], lit: Collection[str]) -> Floats:
    """Return the image of white light in which all texels are sampled alike, (rows, columns).

    It is even, but where some texels are split again it is as much brighter as they are smaller,
    and black where nothing is lit. texels: of one image. lit: names of those that are lit; others
    with a radiance are, too.
    """
    layout = texels[0].texel.layout if texels[0].texel else TexelLayout((1, 1))
    if not layout.splits:
        return np.ones(layout.size[::-1], np.float32)
    brightness, is_lit = np.zeros((2, len(layout.nodes), 1))
    for k, (texel, node) in enumerate(zip(texels, layout.nodes, strict=True)):
        brightness[k] = RATIO ** (2 * node[0])
        is_lit[k] = texel.name in lit or any(texel.emission)
    shown = layout.image(brightness) * (layout.image(is_lit) > 0)
    return np.asarray(shown[..., 0], np.float32)


def current_image(
    node: int,
    kind: EmissionKind,
    emission: RGB,
    domain: image_domains.ImageDomain,
    size: image_domains.GridSize,
    parsed: ParsedScene,
) -> Doubles:
    """Return the emission that each texel of an emitter has now, (rows, columns, 3), with the same
    total light.

    node, kind, emission: of the emitter. Raises SceneError for an image that cannot be split.
    """
    columns, rows = size
    scale = float(parsed.state.nodes[node].props.get("scale", 1.0))
    name = parsed.names[node]
    if kind.scaling is Scaling.COLOUR:
        domain.check_size(size, (1, 1), name)
        return np.broadcast_to(scale * np.array(emission), (rows, columns, 3)).copy()
    path, is_linear = parsed.image_file(node, kind.parameter)
    image: Floats = scale * read_emitted_image(path, is_linear).astype(np.float64)
    if not np.isfinite(image).all() or image.min() < 0:
        raise SceneError(
            f"light {name!r} has an image with values that are negative or not "
            f"finite, {path.name}, so it cannot be split"
        )
    domain.check_size(size, image.shape[1::-1], name)
    texture = child_named(parsed.state, node, kind.parameter)
    if texture is not None:
        props = parsed.state.nodes[texture].props
        image = domain.as_stored(
            shown_image(
                image,
                size,
                np.array(props["to_uv"].matrix, float) if "to_uv" in props else np.eye(4),
                filter_type=str(props.get("filter_type", "bilinear")),
                wrap_mode=str(props.get("wrap_mode", "repeat")),
            )
        )
    return domain.coarse(image, size)


def shown_image(
    image: Floats, size: image_domains.GridSize, to_uv: Doubles, *, filter_type: str, wrap_mode: str
) -> Doubles:
    """Return what a bitmap shows on texture coordinates from 0 to 1, (h, w, 3).

    image: its pixels. size: least columns and rows of the result. to_uv: (4, 4), from these
    coordinates to the coordinates of the bitmap. filter_type, wrap_mode: as Mitsuba names them.
    """
    height, width = image.shape[:2]
    # As many places as the bitmap has pixels there: its own pixels, if nothing is transformed.
    repeats = np.maximum(1, np.ceil(np.abs(to_uv[:2, :2]).max(axis=1)))
    counts = np.maximum(repeats * (width, height), size)
    columns, rows = np.minimum(counts, MAX_SIDE).astype(int).tolist()
    u, v = np.meshgrid((np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows)
    (a, b, _, left), (c, d, _, top) = to_uv[:2]
    x, y = (a * u + b * v + left) * width, (c * u + d * v + top) * height
    if filter_type == "nearest":
        return _pixels(image, np.floor(x), np.floor(y), wrap_mode)
    x, y = x - 0.5, y - 0.5
    first_column, first_row = np.floor(x), np.floor(y)
    across, down = (x - first_column)[..., None], (y - first_row)[..., None]
    upper, lower = (
        _pixels(image, first_column, row, wrap_mode) * (1 - across)
        + _pixels(image, first_column + 1, row, wrap_mode) * across
        for row in (first_row, first_row + 1)
    )
    return np.asarray(upper * (1 - down) + lower * down)


def _pixels(image: Floats, columns: Doubles, rows: Doubles, wrap_mode: str) -> Doubles:
    """Return pixels of a bitmap, some of which lie outside of it."""
    places = (
        _wrapped(rows.astype(int), image.shape[0], wrap_mode),
        _wrapped(columns.astype(int), image.shape[1], wrap_mode),
    )
    return np.asarray(image[places], np.float64)


def _wrapped(index: Indices, count: int, wrap_mode: str) -> Indices:
    if wrap_mode == "clamp":
        return np.clip(index, 0, count - 1)
    if wrap_mode == "mirror":
        index = index % (2 * count)
        return np.where(index < count, index, 2 * count - 1 - index)
    return np.asarray(index % count)


def why_no_image(shape: str, mesh: Any) -> str:
    """Return why a shape cannot show an image, phrased to follow the name of its light; "" if it
    can.

    shape: its plugin. mesh: the loaded shape, for one of MESHES.
    """
    if shape == "rectangle":
        return ""
    if shape not in MESHES:
        return f"is a {shape}, whose texture coordinates no flat image follows"
    import mitsuba as mi

    if not mesh.has_vertex_texcoords():
        return "is a mesh without texture coordinates (uv)"
    parameters = mi.traverse(mesh)
    coordinates = np.array(parameters["vertex_texcoords"], float).reshape(-1, 2)
    return why_not_flat(coordinates, np.array(parameters["faces"], int).reshape(-1, 3))


def why_not_flat(coordinates: Doubles, faces: Indices) -> str:
    """Return why the triangles of a mesh do not lie beside each other in an image; "" if they do.

    coordinates: (vertices, 2). faces: (triangles, 3).
    """
    used = coordinates[faces]
    low, high = -COORDINATE_TOLERANCE, 1 + COORDINATE_TOLERANCE
    if not (used.min() >= low and used.max() <= high):
        return (
            f"is a mesh with texture coordinates from {used.min():.3g} to {used.max():.3g}: its "
            "image is from 0 to 1"
        )
    a, b, c = used[:, 0], used[:, 1], used[:, 2]
    areas = _cross(b - a, c - a)
    used = used[np.abs(areas) > 1e-12]
    if not len(used):
        return "is a mesh whose texture coordinates are all on a line"
    step = max(1, len(used) // max(1, min(MAX_PLACES, MAX_COMPARISONS // len(used))))
    middles = used[::step].mean(axis=1)
    if (_triangles_over(middles, used) > 1).any():
        return "is a mesh of which several places have the same texture coordinates"
    return ""


def _triangles_over(points: Doubles, triangles: Doubles) -> Indices:
    """Return the number of triangles, (t, 3, 2), that each point, (p, 2), lies in."""
    count = np.zeros(len(points), int)
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    for k, point in enumerate(points):
        sides = [_cross(y - x, point - x) for x, y in ((a, b), (b, c), (c, a))]
        count[k] = (np.all(np.array(sides) > 0, axis=0) | np.all(np.array(sides) < 0, axis=0)).sum()
    return count


def _cross(a: Doubles, b: Doubles) -> Doubles:
    """Return the cross products of vectors in a plane, (n, 2) each."""
    return np.asarray(a[:, 0] * b[..., 1] - a[:, 1] * b[..., 0])
