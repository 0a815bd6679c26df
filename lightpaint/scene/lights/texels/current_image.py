"""The image that a light shows now, in texels."""

import numpy as np

from lightpaint.arrays import RGB, Doubles, Floats, Indices
from lightpaint.errors import SceneError
from lightpaint.scene.lights.texels.image_domain import GridSize, ImageDomain
from lightpaint.scene.properties.emission import (
    EmissionKind,
    Scaling,
    child_named,
    read_emitted_image,
)
from lightpaint.scene.scene_tree import ParsedScene

#: Longest side of the image that is averaged, in pixels.
MAX_SIDE = 8192


def current_image(
    node: int,
    kind: EmissionKind,
    emission: RGB,
    domain: ImageDomain,
    size: GridSize,
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
    image: Floats, size: GridSize, to_uv: Doubles, *, filter_type: str, wrap_mode: str
) -> Doubles:
    """Return what a bitmap shows on texture coordinates from 0 to 1, (h, w, 3).

    image: its pixels. size: least columns and rows of the result. to_uv: (4, 4), from these
    coordinates to those of the bitmap. filter_type, wrap_mode: as Mitsuba names them.
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
