"""A linear filter of smooth light, whose weights follow from surfaces and never from light.

Weights fall with distance in the picture, with the angle between normals, and with the distance
from each other's tangent plane; the filter averages light, the picture divided by albedo. As no
weight depends on the light, one filter serves all lights and both halves of their samples. Sums of
filtered pictures are filtered sums, and filtered half differences are the noise of filtered
pictures.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from lightpaint.arrays import Bools, Floats
from lightpaint.images.denoiser import DARKEST, Features
from lightpaint.images.pixel_blocks import block_mean, edge_padded, enlarged
from lightpaint.threads import parallel_map

#: Radius of the filter in pixels, which is two standard deviations.
RADIUS = 4

#: Distance from a tangent plane, in pixel widths, at which a weight is 1/e; and its increase per
#: pixel of distance, since surfaces bend.
NEAR_PLANE, BEND = 3.0, 0.25

#: Number of times that the cosine between two normals is squared.
SQUARINGS = 5

#: Number of rows in a band, whose weights and pictures fit into a processor's cache.
BAND_ROWS = 32

#: Number of pixels in a picture up to which the weights are kept, at 160 bytes per pixel.
KEPT_PIXELS = 2**19


class SurfaceFilter:
    """Means over neighbours on a surface, for any number of pictures of the same surfaces.

    features: surface features, with positions. radius: window radius in pixels.
    """

    def __init__(self, features: Features, radius: int = RADIUS) -> None:
        assert features.position is not None
        self.size, self.radius = features.size, radius
        self._albedo = _planar(np.maximum(features.albedo, DARKEST))
        self._normal, position = _planar(features.normal), _planar(features.position)
        self._position = position
        self._per_width = _pixels_per_length(position, np.asarray(self._normal.any(axis=0)))

    def __call__(self, image: Floats) -> Floats:
        """Return the filtered picture, (h, w, 3) float32."""
        filtered = np.empty((*self.size, 3), np.float32)

        def fill(band: "_Band") -> None:
            albedo = self._albedo[:, band.top : band.bottom]
            rows = slice(max(band.top - self.radius, 0), band.bottom + self.radius)
            light = _planar(image[rows]) / self._albedo[:, rows]
            mean = band.sums(self._framed(light, rows.start, band)) / band.total
            filtered[band.top : band.bottom] = np.moveaxis(mean * albedo, 0, -1)

        parallel_map(fill, self._weighed_bands if self.is_quick else self._bands())
        return filtered

    def enlarged(self, small: Floats, factor: int) -> Floats:
        """Return a picture of blocks of factor × factor pixels at the size of the filter, filtered,
        (h, w, 3) float32.

        small: (h // factor, w // factor, 3). What averages of neighbours on a surface make of a
        block is its light, so that the edges of surfaces and the grain of their albedo come back.
        """
        albedo = np.moveaxis(self._albedo, 0, -1)
        light = enlarged(small / block_mean(albedo, factor), factor)
        return self(edge_padded(light, self.size) * albedo)

    @property
    def is_quick(self) -> bool:
        """True if the weights are kept; otherwise each picture takes ten times as long."""
        return self.size[0] * self.size[1] <= KEPT_PIXELS

    @cached_property
    def _weighed_bands(self) -> "list[_Band]":
        return self._bands(weighed=True)

    def _bands(self, *, weighed: bool = False) -> "list[_Band]":
        tops = range(0, self.size[0], BAND_ROWS)
        bands = [_Band(self, top, min(top + BAND_ROWS, self.size[0])) for top in tops]
        if weighed:
            parallel_map(lambda band: band.weights, bands)
        return bands

    def _framed(self, planes: Floats, first: int, band: "_Band") -> Floats:
        """Return planes that start at row `first`, padded with zeros to all that `radius` reaches
        from a band.
        """
        r = self.radius
        above = first - (band.top - r)
        below = band.bottom - band.top + 2 * r - above - planes.shape[-2]
        return np.pad(planes, ((0, 0), (above, below), (r, r)))


@dataclass(frozen=True)
class _Band:
    """Weights of the pixels in some rows of a filter."""

    of: SurfaceFilter
    top: int
    bottom: int

    @property
    def _offsets(self) -> list[tuple[int, int]]:
        """Half of all neighbours; the other half is the same pairs seen from the other end."""
        r = self.of.radius
        return [(y, x) for y, x in product(range(r + 1), range(-r, r + 1)) if (y, x) > (0, 0)]

    @cached_property
    def weights(self) -> Floats:
        """Weights of the pairs that begin in these rows or up to `radius` above, (pairs, r + rows,
        ...).

        They are 0 for pairs with an end outside the picture.
        """
        of, r = self.of, self.of.radius
        rows = slice(max(self.top - r, 0), self.bottom + r)
        position, normal, per_width = (
            of._framed(x[:, rows], rows.start, self)
            for x in (of._position, of._normal, of._per_width[None])
        )
        height, width = r + self.bottom - self.top, of.size[1] + 2 * r
        weights = np.zeros((len(self._offsets), height, width), np.float32)
        for weight, (dy, dx) in zip(weights, self._offsets, strict=True):
            left, right = max(-dx, 0), width - max(dx, 0)
            part = np.s_[:, :height, left:right]
            other = np.s_[:, dy : dy + height, left + dx : right + dx]
            difference = position[other] - position[part]
            offset = np.abs((difference * normal[part]).sum(axis=0))
            offset += np.abs((difference * normal[other]).sum(axis=0))
            offset *= (per_width[part][0] + per_width[other][0]) / 2
            cosine = np.clip((normal[part] * normal[other]).sum(axis=0), 0, 1)
            for _ in range(SQUARINGS):
                cosine *= cosine
            distance = float(np.hypot(dy, dx))
            nearness = np.float32(1 / (NEAR_PLANE * (1 + BEND * distance)))
            weight[:, left:right] = cosine * np.exp(-offset * nearness)
            weight *= np.float32(np.exp(-2 * (distance / r) ** 2))
        return weights

    @cached_property
    def total(self) -> Floats:
        """Sum of the weights of each pixel, (rows, w), including its own weight 1."""
        size = (
            1,
            self.bottom - self.top + 2 * self.of.radius,
            self.of.size[1] + 2 * self.of.radius,
        )
        return np.asarray(self.sums(np.ones(size, np.float32))[0])

    def sums(self, light: Floats) -> Floats:
        """Return weighted sums over neighbours, (c, rows, w).

        light: (c, r + rows + r, r + w + r), where r is the radius.
        """
        r, rows, columns = self.of.radius, self.bottom - self.top, self.of.size[1]

        def shifted(planes: Floats, dy: int, dx: int) -> Floats:
            return planes[..., r + dy : r + dy + rows, r + dx : r + dx + columns]

        total = shifted(light, 0, 0).copy()
        weighed = np.empty_like(total)
        for weight, (dy, dx) in zip(self.weights, self._offsets, strict=True):
            # A pair contributes to both of its ends.
            for (y, x), (neighbour_y, neighbour_x) in (
                ((0, 0), (dy, dx)),
                ((-dy, -dx), (-dy, -dx)),
            ):
                np.multiply(
                    shifted(weight, y, x), shifted(light, neighbour_y, neighbour_x), out=weighed
                )
                total += weighed
        return total


def _planar(image: Floats) -> Floats:
    """Return (h, w, 3) as contiguous (3, h, w) float32."""
    return np.ascontiguousarray(np.moveaxis(image, -1, 0), np.float32)


def _pixels_per_length(position: Floats, is_seen: Bools) -> Floats:
    """Return the number of pixels per unit of length at each pixel, (h, w); 0 for the background.

    position: (3, h, w). is_seen: (h, w). The length of a pixel is the smallest distance to any of
    its four neighbours, minimised over the eight pixels around it, so that the nearer object
    decides at an edge.
    """
    length = np.full(is_seen.shape, np.inf, np.float32)
    for pixel, neighbour in ((np.s_[:-1, :], np.s_[1:, :]), (np.s_[:, :-1], np.s_[:, 1:])):
        difference = position[:, *pixel] - position[:, *neighbour]
        step = np.sqrt(np.square(difference).sum(axis=0))
        step[~(is_seen[pixel] & is_seen[neighbour])] = np.inf
        for end in (pixel, neighbour):
            np.minimum(length[end], step, out=length[end])
    height, width = is_seen.shape[0], is_seen.shape[1]
    framed = np.pad(length, 1, constant_values=np.inf)
    for dy, dx in product(range(3), repeat=2):
        np.minimum(length, framed[dy : dy + height, dx : dx + width], out=length)
    is_long = is_seen & (length > 0)
    return np.divide(1, length, out=np.zeros_like(length), where=is_long)
