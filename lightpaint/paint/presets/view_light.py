"""The light of a view by lamp: the role of each, and the share of some of them in each pixel."""

from weakref import WeakKeyDictionary

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.basis.basis import Basis
from lightpaint.basis.denoised_mixes import denoise_mix
from lightpaint.colour.color import luminance
from lightpaint.images.object_map import Objects
from lightpaint.images.pixel_blocks import block_mean, fitting_factor
from lightpaint.paint.layers.canvas import Canvas
from lightpaint.paint.presets.lamp_roles import LampRoles
from lightpaint.paint.presets.view_areas import MIN_ALBEDO, Mask, ViewAreas
from lightpaint.scene.lights.texels.texel import coarse_name, image_of, images_of, texel_place

#: Approximate pixels of the longer side of the pictures in which the roles of lamps are found.
ROLES_SIDE = 160

#: Light above this quantile is cut off: it is the inside of a shade, or a stray pixel.
BRIGHTEST = 0.998

#: Most that a lamp's aim at an object counts against its distance from the middle.
MAX_ACCENT = 12.0

#: Parts of the image of a light, across and down, each of which is one lamp.
BLOCKS = (8, 4)

#: Roles that were found, by canvas, for its basis and a chosen object.
_known: WeakKeyDictionary[Canvas, tuple[Basis, str | None, LampRoles, str | None]]
_known = WeakKeyDictionary()


def find_roles(canvas: Canvas, chosen: str | None = None) -> tuple[LampRoles, str | None]:
    """Return what the lamps do for a view, and the name of its subject; None without objects.

    chosen: name of the object that it is about; None to take the most central one, where one at
    which a lamp is aimed counts as nearer.
    """
    basis = canvas.basis
    if (known := _known.get(canvas)) and known[0] is basis and known[1] == chosen:
        return known[2], known[3]
    roles, subject = _roles_of(basis, chosen)
    _known[canvas] = basis, chosen, roles, subject
    return roles, subject


def light_share(basis: Basis, lamps: Bools, factor: int = 1) -> Mask:
    """Return the share (h, w) of the light of each pixel that comes from some lamps.

    lamps: (n,). factor: side of the blocks of pixels that are averaged to one.
    """
    theirs, others = (
        np.maximum(luminance(denoise_mix(basis, weights, factor=factor)), 0)
        for weights in (_only(basis, lamps), _only(basis, ~lamps))
    )
    total = theirs + others
    share = np.where(total > 0, theirs / np.where(total > 0, total, 1), 0)
    return np.asarray(share, np.float32)


def _only(basis: Basis, lamps: Bools) -> Doubles:
    return np.asarray(basis.current_weights * lamps[:, None])


def _roles_of(basis: Basis, chosen: str | None) -> tuple[LampRoles, str | None]:
    factor = fitting_factor(basis.size, round(max(basis.size) / ROLES_SIDE))
    features, objects = basis.features, basis.objects
    height, width = (side // factor for side in basis.size)
    sample = slice(0, factor * height, factor), slice(0, factor * width, factor)
    lamp_of, firsts = _lamps_of(basis)
    light = _light_of_lamps(basis, lamp_of, factor)
    known = ~basis.emitters_seen[sample]
    normal = None
    if features is not None:
        small = features.reduced(factor)
        normal = small.normal
        known = known & normal.any(axis=-1)
        light = np.asarray(light / np.maximum(luminance(small.albedo), MIN_ALBEDO), np.float32)
    light = np.where(known, light, 0).astype(np.float32)
    highest = np.quantile(light.reshape(len(light), -1), BRIGHTEST, axis=1)
    light = np.minimum(light, highest[:, None, None]).astype(np.float32)
    seen = ~known
    areas = ViewAreas(
        light.sum(axis=0)[..., None] * np.ones(3, np.float32),
        seen,
        objects=None if objects is None else Objects(objects.index[sample], objects.names),
        chosen=chosen,
    )
    roles = LampRoles(
        light,
        tuple(basis.lights[k].plugin for k in firsts),
        areas.subject,
        [areas.mask_of(name) for name in areas.exhibit_names],
        normal,
        _camera_right(basis, sample),
        np.bincount(lamp_of, _seen_amounts(basis)).astype(np.float64),
        lamp_of,
        np.array([bool(image_of(basis.names[k])) for k in firsts], bool),
    )
    name = chosen
    if chosen is None and objects is not None:
        name = max(areas.exhibit_names, key=lambda x: _importance(x, areas, roles), default=None)
        roles = roles.about(areas.mask_of(name) if name else areas.subject)
    return roles, name


def _lamps_of(basis: Basis) -> tuple[Indices, list[int]]:
    """Return the lamp of each light, (l,), and the first light of each lamp.

    Texels of an image are one lamp in each of `BLOCKS` parts of it.
    """
    sizes = images_of(basis.names)
    keys: dict[tuple[object, ...], int] = {}
    firsts: list[int] = []
    lamp_of: list[int] = []
    for k, name in enumerate(basis.names):
        image = image_of(name)
        key: tuple[object, ...] = (name,)
        if image in sizes:
            place = zip(texel_place(coarse_name(name)), BLOCKS, sizes[image], strict=True)
            key = (image, *(at * blocks // size for at, blocks, size in place))
        if key not in keys:
            keys[key] = len(firsts)
            firsts.append(k)
        lamp_of.append(keys[key])
    return np.array(lamp_of, np.intp), firsts


def _light_of_lamps(basis: Basis, lamp_of: Indices, factor: int) -> Floats:
    """Return the present light of each lamp, (n, h, w) luminance, reduced."""
    height, width = (side // factor for side in basis.size)
    light = np.zeros((lamp_of.max() + 1, height, width), np.float32)
    for k, lamp in enumerate(lamp_of):
        light[lamp] += _light_of(basis, k, factor)
    return light


def _light_of(basis: Basis, k: int, factor: int) -> Floats:
    light = block_mean(basis.planes.plane(k) * np.float32(1), factor)
    return np.asarray(np.maximum(luminance(light * basis.current_weights[k]), 0), np.float32)


def _importance(name: str, areas: ViewAreas, roles: LampRoles) -> float:
    """Return how likely an object is the subject: near the middle, round, and lamps are aimed at
    it.
    """
    mask = areas.mask_of(name)
    accent = float(np.max(np.where(roles.hard, roles.ratios(mask), 1), initial=1))
    return (
        (1 - areas.distance_of(name))
        * float(np.sqrt(min(accent, MAX_ACCENT)))
        * (1.5 - roles.flatness(mask))
    )


def _camera_right(basis: Basis, sample: tuple[slice, slice]) -> Doubles | None:
    """Return the direction of the camera's right in the scene, (3,); None if it is unknown."""
    features = basis.features
    if features is None or features.position is None:
        return None
    step = np.diff(features.position[sample].astype(np.float64), axis=1)
    length = np.linalg.norm(step, axis=-1)
    usable = np.isfinite(length) & (length > 0)
    if not usable.any():
        return None
    right = np.median(step[usable] / length[usable][:, None], axis=0)
    norm = float(np.linalg.norm(right))
    return right / norm if norm else None


def _seen_amounts(basis: Basis) -> Doubles:
    """Return the light of each lamp in pixels in which an emitter is seen, (n,)."""
    seen = basis.emitters_seen
    if not seen.any():
        return np.zeros(len(basis.lights))
    return np.array(
        [
            float(np.mean(luminance(basis.planes.plane(k)[seen] * basis.current_weights[k])))
            for k in range(len(basis.lights))
        ]
    )
