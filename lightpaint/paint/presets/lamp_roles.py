"""Roles of lamps in a picture: hard or soft light, from which side, on which object; and the share
of the light in each pixel that comes from some of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.basis import Basis, denoise_mix
from lightpaint.colour import luminance
from lightpaint.images import Objects, block_mean, fitting_factor
from lightpaint.paint.layers.canvas import Canvas
from lightpaint.paint.presets.view_areas import MIN_ALBEDO, Mask, ViewAreas
from lightpaint.scene.lights.texels import coarse_name, image_of, images_of, texel_place

#: Kinds of emitters that always are hard light, always soft light, and light of the sky or the sun.
HARD_KINDS = frozenset({"spot", "point", "directional", "projector", "directionalarea", "ies"})
SOFT_KINDS = frozenset({"constant"})
DAYLIGHT_KINDS = frozenset({"constant", "directional", "envmap", "sunsky", "sky", "sun"})

#: Stops by which the brightest tenth of a hard light stands above its middle; and the share of it
#: that falls on the brightest tenth of the picture.
HARD_STOPS, HARD_SHARE = 2.2, 0.6

#: Length of the mean normal of lit surfaces from which on they are one wall, and the largest part
#: of it that may point up or down; a wash on a wall lights at least this share of the picture.
WALL_NORMAL, WALL_TILT, WALL_SHARE = 0.85, 0.35, 0.08

#: Difference in height of washes, in heights of the picture, from which on the lower ones are the
#: light of a horizon.
HORIZON = 0.06

#: Least share of the light of the picture of a lamp that counts.
LEAST_AMOUNT = 0.005

#: How much more a lamp lights an object than it lights the picture, to be an accent on it.
ACCENT = 2.0

#: Share of the picture from which on a lamp is not an accent on an exhibit among others.
ACCENT_SHARE = 0.16

#: Share of the highest such ratio from which on a lamp is an accent on the same object.
NEARLY = 0.6

#: Cosine between the pictures of lamps that shine alike.
ALIKE = 0.75

#: Least share of the picture over which the light of a part of a sky is taken to spread, since its
#: brightest spots are reflections; and the light of a lamp in view, whose brightest spots surround
#: it.
IMAGE_COVERAGE, SEEN_COVERAGE = 0.35, 0.1

#: Place, -1 to 1, of a part of a sky for each unit by which it lights from a side.
FROM_SIDE = 3.0

#: Pools of light in a dark picture: share of it that they light together, and their number.
POOLS_SHARE, MAX_POOLS = 0.25, 3

#: Approximate pixels of the longer side of the pictures in which the roles of lamps are found.
ROLES_SIDE = 160

#: Light above this quantile is cut off: it is the inside of a shade, or a stray pixel.
BRIGHTEST = 0.998

#: Most that a lamp's aim at an object counts against its distance from the middle.
MAX_ACCENT = 12.0

#: Parts of the image of a light, across and down, each of which is one lamp.
BLOCKS = (8, 4)

#: Roles that were found, by canvas, for its basis and a chosen object.
_known: WeakKeyDictionary[Canvas, tuple[Basis, str | None, "LampRoles", str | None]]
_known = WeakKeyDictionary()


@dataclass(frozen=True)
class LampRoles:
    """The part that each of n lamps plays in one picture, all at their current levels.

    A part of the image of a light, such as a sky's, is one lamp, of many lights.

    light: (n, h, w) luminance that arrives at surfaces, 0 where none is known. kinds: plugins of
    the emitters. subject, exhibits: masks (h, w) of the objects that a preset may be about. normal:
    (h, w, 3) of the surfaces; None if unknown. right: (3,), direction of the camera's right; None
    if unknown. seen: (n,) light in pixels in which an emitter is seen; None if unknown. lamp_of:
    (l,), the lamp of each light; None if each is its own. is_image: (n,) lamps that are parts of
    images; None for none.
    """

    light: Floats
    kinds: Sequence[str]
    subject: Mask
    exhibits: Sequence[Mask]
    normal: Floats | None = None
    right: Doubles | None = None
    seen: Doubles | None = None
    lamp_of: Indices | None = None
    is_image: Bools | None = None

    def lights(self, lamps: Bools) -> Bools:
        """Return the lights (l,) of some lamps (n,)."""
        return lamps if self.lamp_of is None else np.asarray(lamps[self.lamp_of])

    def lamps(self, lights: Bools) -> Bools:
        """Return the lamps (n,) all of whose lights (l,) are among some."""
        if self.lamp_of is None:
            return lights
        missing = np.bincount(self.lamp_of[~lights], minlength=len(self.light))
        return np.asarray(missing == 0)

    def about(self, subject: Mask) -> "LampRoles":
        """Return the roles for another subject."""
        return replace(self, subject=subject)

    def ratios(self, mask: Mask) -> Doubles:
        """Return how much more each lamp lights a mask (h, w) than the picture, (n,)."""
        weight = max(float(mask.sum(dtype=np.float64)), 1e-30)
        there = np.array([float((x * mask).sum(dtype=np.float64)) / weight for x in self.light])
        means = self.light.mean(axis=(1, 2), dtype=np.float64)
        return np.asarray(np.where(self.amounts > 0, there / np.maximum(means, 1e-30), 0))

    def flatness(self, mask: Mask) -> float:
        """Return the length of an object's mean lit normal: 1 if it is flat, 0 for a sphere."""
        return float(np.linalg.norm(self._lit_normal(mask)))

    @cached_property
    def amounts(self) -> Doubles:
        """(n,) share of the light of the picture."""
        sums = self.light.reshape(len(self.light), -1).sum(axis=1, dtype=np.float64)
        return np.asarray(sums / max(float(sums.sum()), 1e-30))

    @cached_property
    def coverage(self) -> Doubles:
        """(n,) share of the picture that a lamp lights: 1 for even light."""
        return np.array([_coverage(x) for x in self.light])

    @cached_property
    def counts(self) -> Bools:
        """(n,) lamps that are on and matter."""
        return self.amounts >= LEAST_AMOUNT

    @cached_property
    def is_soft(self) -> Bools:
        """(n,) lamps of even light: skies, coves, panels, washes of a wall."""
        flags = []
        for k, kind in enumerate(self.kinds):
            flat = self.light[k].ravel()
            top = np.sort(flat)[-max(1, flat.size // 10) :]
            middle, high = np.quantile(flat, (0.5, 0.9))
            stops = np.log2(max(high, 1e-30) / max(middle, 1e-30))
            is_even = stops < HARD_STOPS and top.sum() < HARD_SHARE * flat.sum()
            is_soft = kind in SOFT_KINDS or (kind not in HARD_KINDS and is_even)
            flags.append(is_soft or bool(self.is_wash[k]) or self._from_below(k))
        return np.array(flags, bool)

    @cached_property
    def is_on_wall(self) -> Bools:
        """(n,) lamps that light one wall and nothing else, as the lamps of a backdrop."""
        return np.array([self._is_on_wall(x) for x in self.light], bool)

    @cached_property
    def is_wash(self) -> Bools:
        """(n,) lamps that light one wall widely, as the lamps of a cyclorama."""
        return self.is_on_wall & (self.coverage >= WALL_SHARE)

    @cached_property
    def horizon(self) -> Bools:
        """(n,) washes of the lower part of a backdrop, where there are others of its upper part."""
        rows = np.linspace(0, 1, self.light.shape[1])
        down = self.light.sum(axis=2, dtype=np.float64)
        heights = down @ rows / np.maximum(down.sum(axis=1), 1e-30)
        if not self.is_wash.any() or np.ptp(heights[self.is_wash]) < HORIZON:
            return np.zeros(len(self.light), bool)
        middle = 0.5 * (heights[self.is_wash].min() + heights[self.is_wash].max())
        return np.asarray(self.is_wash & (heights > middle))

    @property
    def disc(self) -> Bools:
        """(n,) lamps that light one small spot of a wall, as a moon on a backdrop."""
        return self.is_on_wall & ~self.is_wash & self.counts

    @cached_property
    def is_daylight(self) -> Bools:
        """(n,) lamps that stand for the sky or the sun."""
        kinds = np.array([kind in DAYLIGHT_KINDS for kind in self.kinds], bool)
        return kinds | self.is_wash | (self.is_soft & (self.coverage > 0.3))

    @cached_property
    def even_daylight(self) -> Bools:
        """(n,) lamps with the even light of a clouded sky; without one, all with even light."""
        daylight = self.is_soft & self.is_daylight & self.counts
        return daylight if (daylight & ~self.is_wash).any() else self.is_soft

    @property
    def hard(self) -> Bools:
        """(n,) lamps of hard light."""
        return ~self.is_soft & (self.amounts > 0)

    @cached_property
    def sun(self) -> Bools:
        """(n,) the lamps that shine as a low sun or the moon would: hard, wide, from one side."""
        hard = self.hard & self.counts
        directional = hard & np.array([kind in ("directional", "sun") for kind in self.kinds])
        candidates = directional if directional.any() else hard if hard.any() else self.amounts > 0
        score = np.sqrt(self.amounts * self.coverage) * (0.05 + np.abs(self.sides))
        if self.is_image is not None and not directional.any() and self.is_image.any():
            # In a sky a low sun may stand anywhere, and from the side it shows best.
            candidates = self.is_image & self.counts
            score = np.sqrt(self.amounts * self.coverage) * self.sides**2
        return self._with_alike(int(np.argmax(np.where(candidates, score, -1))))

    @cached_property
    def _pools(self) -> list[int]:
        """The lamps of the smallest pools of light, a few of them."""
        found: list[int] = []
        covered = 0.0
        candidates = self.counts & self.hard
        for k in np.argsort(np.where(candidates, self.coverage, 9)):
            covered += self.coverage[k]
            if found and (not candidates[k] or covered > POOLS_SHARE or len(found) == MAX_POOLS):
                break
            found.append(int(k))
        return found

    def pool(self, number: int, *, is_on_wall: bool = True) -> Bools:
        """Select, (n,), the lamp with the smallest pool of light, or with the next ones.

        number: from 0; beyond the last pool no lamp is selected. is_on_wall: whether spots on a
        wall count.
        """
        found = [k for k in self._pools if is_on_wall or not self.is_on_wall[k]]
        return np.isin(np.arange(len(self.light)), found[number : number + 1])

    @property
    def edge(self) -> Bools:
        """(n,) light from a side of a sky, where lamps make at most one pool of light."""
        if self.is_image is None or len(self._pools) > 1:
            return np.zeros(len(self.light), bool)
        return self.sun & self.is_image

    @cached_property
    def candle(self) -> Bools:
        """(n,) a lamp that is seen in the picture; without one, those on the subject."""
        return self.in_view if self.in_view.any() else self.on_subject

    @cached_property
    def in_view(self) -> Bools:
        """(n,) the lamp of hard light that is seen in the picture; none if none is."""
        if self.seen is None:
            return np.zeros(len(self.light), bool)
        score = np.where(self.hard, self.seen, 0)
        return np.asarray((np.arange(len(score)) == np.argmax(score)) & (score > 0), bool)

    @cached_property
    def on_subject(self) -> Bools:
        """(n,) the lamps that light the subject more than the picture; at least one."""
        found = self._accents(self.subject)
        return found if found.any() else self._nearest(self.subject)

    @cached_property
    def on_exhibits(self) -> Bools:
        """(n,) the lamps that light an exhibit more than the picture; at least one."""
        found = np.zeros(len(self.light), bool)
        for mask in self.exhibits:
            found |= self._accents(mask) & (self.coverage < ACCENT_SHARE)
        return found if found.any() else self.on_subject

    @cached_property
    def key(self) -> Bools:
        """(n,) the lamp on the subject that lights it most."""
        light = np.where(self.on_subject, self.ratios(self.subject) * self.amounts, -1)
        return np.asarray(np.arange(len(light)) == np.argmax(light), bool)

    @cached_property
    def fill(self) -> Bools:
        """(n,) the lamp that lights the subject most from the other side than the key."""
        light = self.ratios(self.subject) * self.amounts
        sides = np.array([self._side(x * self.subject) for x in self.light])
        across = np.abs(sides - float(sides[self.key][0]))
        score = np.where(self.key | self.is_on_wall, 0, across * np.sqrt(light))
        return np.asarray((np.arange(len(light)) == np.argmax(score)) & (score > 0), bool)

    @cached_property
    def sides(self) -> Doubles:
        """(n,) how far from the left, below 0, or the right, above, a lamp lights, -1 to 1."""
        return np.array([self._side(x) for x in self.light])

    @cached_property
    def middles(self) -> Doubles:
        """(n,) where the light of a lamp falls: -1 at the left of the picture, 1 at its right."""
        x = np.linspace(-1, 1, self.light.shape[2])
        columns = self.light.sum(axis=1, dtype=np.float64)
        return np.asarray(columns @ x / np.maximum(columns.sum(axis=1), 1e-30))

    @property
    def places(self) -> Doubles:
        """(n,) side of the picture to which a lamp belongs: -1 is its left, 1 its right. That on
        which its light falls, or from which a part of a sky shines.
        """
        if self.is_image is None:
            return self.middles
        return np.where(self.is_image, FROM_SIDE * self.sides, self.middles)

    def level(self, lamps: Bools) -> float:
        """Return the light of lamps where they shine, relative to the light of the brighter
        half."""
        light = self.light[lamps].sum(axis=0)
        covered = _coverage(light)
        if covered and self.is_image is not None and self.is_image[lamps].all():
            covered = max(covered, IMAGE_COVERAGE)
        elif covered and not (lamps & ~self.in_view).any():
            covered = max(covered, SEEN_COVERAGE)
        return float(light.mean()) / covered / self._bright if covered and self._bright else 0.0

    @cached_property
    def _bright(self) -> float:
        """Mean light of the brighter half of the picture."""
        total = self.light.sum(axis=0, dtype=np.float64)
        total = np.sort(total[total > 0])
        return float(total[len(total) // 2 :].mean()) if total.size else 0.0

    def _accents(self, mask: Mask) -> Bools:
        """Return the lamps that are aimed at a mask: nearly the highest ratio; none by chance."""
        ratio = self.ratios(mask)
        there = ratio * self.amounts
        usable = self.hard & (there > 0.03 * there.sum())
        if (usable & ~self.is_daylight).any():
            usable &= ~self.is_daylight
        highest = float(np.max(np.where(usable, ratio, 0), initial=0))
        return np.asarray(usable & (ratio >= max(ACCENT, NEARLY * highest)), bool)

    def _nearest(self, mask: Mask) -> Bools:
        """Return the lamp that lights a mask most, compared with the picture."""
        ratio = self.ratios(mask)
        return np.asarray(np.arange(len(ratio)) == np.argmax(ratio * np.sqrt(self.amounts)), bool)

    def _with_alike(self, k: int) -> Bools:
        flat = self.light.reshape(len(self.light), -1)
        lengths = np.sqrt((flat * flat).sum(axis=1, dtype=np.float64))
        cosine = (flat @ flat[k]) / np.maximum(lengths * lengths[k], 1e-30)
        return np.asarray(cosine >= ALIKE, bool)

    def _side(self, light: Floats) -> float:
        total = float(light.sum(dtype=np.float64))
        if not total:
            return 0.0
        if self.normal is None or self.right is None:
            x = np.linspace(-1, 1, light.shape[1], dtype=np.float32)
            return 0.5 * float((light * x).sum(dtype=np.float64)) / total
        return float(self._lit_normal(light) @ self.right)

    def _lit_normal(self, light: Floats) -> Doubles:
        total = max(float(light.sum(dtype=np.float64)), 1e-30)
        if self.normal is None:
            return np.zeros(3)
        return np.asarray(np.einsum("yx,yxc->c", light, self.normal, dtype=np.float64) / total)

    def _is_on_wall(self, light: Floats) -> bool:
        normal = self._lit_normal(light)
        return bool(np.linalg.norm(normal) > WALL_NORMAL and abs(normal[1]) < WALL_TILT)

    def _from_below(self, k: int) -> bool:
        return bool(self._lit_normal(self.light[k])[1] < -0.1)


def _coverage(light: npt.NDArray[np.floating]) -> float:
    """Return the share of the picture that light covers: 1 for even light, 0 without any."""
    total, square = light.sum(dtype=np.float64), (light * light).sum(dtype=np.float64)
    return float(total * total / (square * light.size)) if square else 0.0


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
