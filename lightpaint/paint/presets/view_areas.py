"""Areas of a view that a preset is about: its shadows, its lit parts, an object, the rest."""

from functools import cached_property

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageFilter

from lightpaint.arrays import Bools, Floats
from lightpaint.basis import Basis
from lightpaint.colour import luminance
from lightpaint.images import Features, Objects

Mask = npt.NDArray[np.float32]

#: Stops from the median illumination over which a pixel becomes part of the shadows, or of the lit
#: parts.
RANGE_STOPS = 2.0

#: Pixels of the longer side of the picture in which illumination is separated from surfaces: what
#: is smaller is a surface's pattern.
SMOOTH_SIDE = 48

#: Least albedo that illumination is divided by; darker surfaces tell nothing.
MIN_ALBEDO = 0.05

#: Least share of the picture that an object in it covers which a preset is about, and the largest,
#: above which it is a wall or a floor.
OBJECT_SHARES = (0.003, 0.12)

#: Least share of an object that is left without its outermost pixels: others are lines or twigs.
SOLID_SHARE = 0.12

#: Heights in a picture, 0 at its top and 1 at its bottom, between which its upper part ends and its
#: lower part begins.
BAND_ENDS = (0.2, 0.45), (0.55, 0.8)


class ViewAreas:
    """Soft masks (h, w) of areas in one view, 0 to 1.

    Args:
        look: (h, w, 3) linear, the current look.
        emitters_seen: (h, w), pixels in which an emitter is seen; they belong to no area.
        features: Of the surfaces, if known.
        objects: That are seen, if known.
        chosen: Name of the object that the preset is about; None to take the most central one.
    """

    def __init__(
        self,
        look: Floats,
        emitters_seen: Bools,
        features: Features | None = None,
        objects: Objects | None = None,
        chosen: str | None = None,
    ) -> None:
        self._look, self._emitters_seen = look, emitters_seen
        self._features, self._objects, self._chosen = features, objects, chosen

    @classmethod
    def of_view(
        cls, basis: Basis, look: Floats, factor: int = 1, chosen: str | None = None
    ) -> "ViewAreas":
        """Return the areas of a view, reduced.

        look: (h, w, 3) linear, already reduced. factor: side of the blocks of pixels that one pixel
        of it stands for.
        """
        features, objects = basis.features, basis.objects
        sample = tuple(slice(0, factor * side, factor) for side in look.shape[:2])
        return cls(
            look,
            basis.emitters_seen[sample],
            None if features is None else features.reduced(factor),
            None if objects is None else Objects(objects.index[sample], objects.names),
            chosen,
        )

    @property
    def whole(self) -> Mask:
        """All of the picture."""
        return self._usable(np.ones(self._look.shape[:2], np.float32))

    @property
    def shadows(self) -> Mask:
        """The darker half, more of it the darker it is."""
        return self._usable(np.clip(-self._level / RANGE_STOPS, 0, 1))

    @property
    def lit(self) -> Mask:
        """The brighter half of the picture, (h, w): from 0 at its middle brightness to 1."""
        return self._usable(np.clip(self._level / RANGE_STOPS, 0, 1))

    @property
    def subject(self) -> Mask:
        """The chosen object; the middle of the picture where there are no objects."""
        name = self.subject_name
        if self._objects is None or name is None:
            return self._usable(self._middle)
        return self._usable(np.asarray(self._objects.mask(name), np.float32))

    @cached_property
    def exhibit_names(self) -> tuple[str, ...]:
        """Names of objects that stand free in the picture, neither walls, floors nor details."""
        if self._objects is None:
            return ()
        names = dict.fromkeys(self._objects.names)
        return tuple(name for name in names if self._is_exhibit(self._objects.mask(name)))

    def mask_of(self, name: str) -> Mask:
        """Return the mask of an object."""
        assert self._objects is not None
        return self._usable(np.asarray(self._objects.mask(name), np.float32))

    def distance_of(self, name: str) -> float:
        """Return the mean distance of an object from the middle, in sides of the picture."""
        rows, columns = np.nonzero(self.mask_of(name))
        if not rows.size:
            return 1.0
        height, width = self._look.shape[:2]
        across = (columns + 0.5) / width - 0.5
        return float(np.hypot((rows + 0.5) / height - 0.5, across).mean())

    def _is_exhibit(self, mask: Bools) -> bool:
        low, high = OBJECT_SHARES
        if not low <= mask.mean() <= high:
            return False
        if mask[0].any() or mask[-1].any() or mask[:, 0].any() or mask[:, -1].any():
            return False
        picture = Image.fromarray(mask.astype(np.uint8) * 255)
        core = np.asarray(picture.filter(ImageFilter.MinFilter(3))) > 0
        return bool(core.sum() >= SOLID_SHARE * mask.sum())

    @property
    def bands(self) -> tuple[Mask, Mask, Mask]:
        """The upper part of the picture, its middle, and its lower part."""
        upper, middle, lower = soft_bands(self._look.shape[:2])
        return self._usable(upper), self._usable(middle), self._usable(lower)

    def around(self, x: float, y: float, radius: float) -> Mask:
        """Return a soft spot. x, y: its place, 0 to 1. radius: in longer sides of the picture."""
        return self._usable(soft_spot(self._look.shape[:2], x, y, radius))

    @cached_property
    def subject_name(self) -> str | None:
        """Name of the chosen object, or of the most central exhibit; None without one."""
        if self._objects is None:
            return None
        if self._chosen is not None:
            return self._chosen if self._chosen in self._objects.names else None
        return min(self.exhibit_names, key=self.distance_of, default=None)

    @cached_property
    def _level(self) -> Mask:
        """Illumination in stops from its median, without the surfaces' patterns."""
        light = np.asarray(luminance(self._look), np.float32)
        if self._features is not None:
            albedo = np.asarray(luminance(self._features.albedo), np.float32)
            light = np.asarray(light / np.maximum(albedo, MIN_ALBEDO), np.float32)
        known = ~self._emitters_seen & (light > 0)
        if not known.any():
            return np.zeros_like(light)
        median = np.median(light[known])
        stops = np.log2(np.where(known, light, median) / median)
        return _smoothed(np.clip(stops, -8, 8).astype(np.float32))

    @property
    def _middle(self) -> Mask:
        height, width = self._look.shape[:2]
        y, x = np.mgrid[:height, :width]
        distance = np.hypot((y + 0.5) / height - 0.55, (x + 0.5) / width - 0.5)
        return np.asarray(np.clip(1.5 - 4 * distance, 0, 1), np.float32)

    def _usable(self, mask: npt.NDArray[np.floating]) -> Mask:
        """Return a mask without pixels in which an emitter is seen."""
        return np.where(self._emitters_seen, np.float32(0), mask.astype(np.float32))


def soft_bands(size: tuple[int, ...]) -> tuple[Mask, Mask, Mask]:
    """Return soft weights (h, w) of the upper part of a picture, its middle, and its lower part."""
    height, width = size
    y = (np.arange(height, dtype=np.float32) + np.float32(0.5)) / height
    (first, second), (third, fourth) = BAND_ENDS
    upper = np.clip((second - y) / (second - first), 0, 1)
    lower = np.clip((y - third) / (fourth - third), 0, 1)
    rows = [x.astype(np.float32)[:, None] for x in (upper, 1 - upper - lower, lower)]
    first_band, second_band, third_band = (np.repeat(x, width, axis=1) for x in rows)
    return first_band, second_band, third_band


def soft_spot(size: tuple[int, ...], x: float, y: float, radius: float) -> Mask:
    """Return soft weights (h, w) around a place. x, y: 0 to 1. radius: in longer sides."""
    height, width = size
    scale = radius * max(size)
    down = (np.arange(height) + 0.5 - y * height) / scale
    across = (np.arange(width) + 0.5 - x * width) / scale
    return np.exp(-0.5 * (down[:, None] ** 2 + across[None] ** 2)).astype(np.float32)


def _smoothed(values: Mask) -> Mask:
    """Return values (h, w) without detail smaller than the detail of a small picture."""
    height, width = values.shape
    factor = min(1.0, SMOOTH_SIDE / max(height, width))
    small = max(1, round(width * factor)), max(1, round(height * factor))
    picture = Image.fromarray(values).resize(small, Image.Resampling.BOX)
    return np.asarray(picture.resize((width, height), Image.Resampling.BICUBIC), np.float32)
