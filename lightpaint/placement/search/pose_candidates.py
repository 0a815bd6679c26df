"""Poses over a light's whole freedom, ranked by their direct light.

A ranking needs inner products over visible points. So all directions and cones of a light at one
place share their shadow rays and one matrix product.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from lightpaint.arrays import Doubles, Floats, Indices
from lightpaint.placement.free_space import as_position
from lightpaint.placement.freedom import FreeLight
from lightpaint.placement.paths.panel_lights import PanelSite
from lightpaint.placement.paths.vertex_light import away_from
from lightpaint.placement.paths.view_paths import ViewPaths
from lightpaint.placement.placement_fit import Ranking
from lightpaint.scene.properties.pose import Site
from lightpaint.threads import one_thread

#: Degrees between trial directions, and number of trial cones.
APART, CONES = 20.0, 5

#: Number of trial sides of a panel that the camera sees, and of pixels that are enough to rank it.
SIDES, SEEN_PIXELS = 3, 256

#: Number of directions, from one place, in which all cones and sides are tried.
AIMS = 12

#: Number of lights whose contributions are computed at once.
AT_ONCE = 64

#: Every second first hit is used.
THINNING = 2


class PoseCandidates:
    """Candidate poses, ranked on some first hits. ranking: on all pixels, without that light."""

    def __init__(self, paths: ViewPaths, ranking: Ranking) -> None:
        self._paths = paths
        # Half of the first hits are enough to rank by.
        self._points = np.ascontiguousarray(paths.points[::THINNING])
        thinned = ranking.at(paths.indices()[::THINNING])
        self._ranking, self._root = thinned, thinned.root.astype(np.float32)
        # For each channel: residual and columns of others, weighted twice, (1 + others, v).
        self._weighed = [
            np.concatenate([thinned.residual[None, :, c], thinned.others[c]]).astype(np.float32)
            * self._root[:, c]
            for c in range(self._root.shape[1])
        ]
        self._whole = ranking

    def gains(
        self, light: FreeLight, places: Floats
    ) -> Iterator[tuple[Doubles, Callable[[int], Site]]]:
        """Yield the gains of poses at each place, (k,), and a function that makes the k-th pose."""
        directions, cones = light.directions(APART), light.cones(CONES).tolist()
        if light.site.position is None:
            yield from self._suns(light)
            return
        at_places = [replace(light.site, position=as_position(place)) for place in places]
        for place, at_place, added in zip(
            places, at_places, self._contributions(at_places), strict=True
        ):
            if light.site.direction is None:
                yield self._gains(added, None), partial(_aimed, at_place, None)
                continue
            cosine = directions.astype(np.float32) @ away_from(place, self._points).T
            if isinstance(at_place, PanelSite):
                yield from self._panels(light, at_place, directions, added, np.maximum(cosine, 0))
                continue
            yield from self._spots(at_place, cones, directions, added, cosine)

    def _spots(
        self,
        site: Site,
        cones: Sequence[tuple[float, float]],
        directions: Floats,
        added: Floats,
        cosine: Floats,
    ) -> Iterator[tuple[Doubles, Callable[[int], Site]]]:
        """Yield the gains of spots at one place: the first cone in all directions, and the others
        in the best ones. added, cosine: at first hits.
        """
        for cutoff, beam in cones:
            # Linear in the cosine instead of the angle, which ranks as well.
            edge, full = (math.cos(math.radians(angle)) for angle in (cutoff, beam))
            share = (cosine - np.float32(edge)) * np.float32(1 / max(full - edge, 1e-6))
            opened = replace(site, cutoff=cutoff, beam=beam)
            gains = self._gains(added, np.clip(share, 0, 1, out=share))
            yield gains, partial(_aimed, opened, directions)
            best = np.argsort(-gains)[:AIMS]
            directions, cosine = directions[best], cosine[best]

    def _panels(
        self,
        light: FreeLight,
        site: PanelSite,
        directions: Floats,
        added: Floats,
        cosine: Floats,
    ) -> Iterator[tuple[Doubles, Callable[[int], Site]]]:
        """Yield the gains of panels at one place; see `_spots`. added, cosine: at first hits."""
        sides = light.some_sides(SIDES)
        assert site.position is not None
        radius = replace(site, side=float(sides.max())).radius
        lines = [its.near(site.position, radius) for its in self._paths.sight_lines()]
        parts = [(its.some(SEEN_PIXELS), len(its.pixels)) for its in lines if len(its.pixels)]
        for side in sides if parts else sides[:1]:
            half_sides = replace(site, side=float(side)).half_sides_towards(directions)
            seen = [
                (
                    its.pixels,
                    its.covered(site.position, directions, half_sides),
                    count / len(its.pixels),
                )
                for its, count in parts
            ]
            # From afar, a panel acts as a point whose light falls off with the cosine.
            gains = self._gains(added * side**2, cosine, seen)
            yield gains, partial(_aimed, replace(site, side=float(side)), directions)
            best = np.argsort(-gains)[:AIMS]
            directions, cosine = directions[best], cosine[best]

    def _suns(self, light: FreeLight) -> Iterator[tuple[Doubles, Callable[[int], Site]]]:
        directions = light.directions(APART / 2)
        sites = [replace(light.site, direction=as_position(x)) for x in directions]
        for site, added in zip(sites, self._contributions(sites), strict=True):
            yield self._gains(added, None), partial(_aimed, site, None)

    def _contributions(self, sites: Sequence[Site]) -> Iterator[Floats]:
        """Yield the contributions of lights at first hits, (v, 3), without cones and sizes."""
        bare = [site if site.position is None else Site(site.position) for site in sites]
        for start in range(0, len(bare), AT_ONCE):
            for added in self._paths.contributions(bare[start : start + AT_ONCE]):
                yield added[::THINNING]

    def _gains(
        self,
        added: Floats,
        shares: Floats | None,
        seen: Sequence[tuple[Indices, Floats, float]] = (),
    ) -> Doubles:
        """Return gains of contributions at first hits, (v, 3), for shares of them, (k, v).

        seen: pixels, (r,), what panels add to them at unit radiance, (k, r), and for how many
        pixels each stands.
        """
        inner = [block * added[:, c % 3] for c, block in enumerate(self._weighed)]
        power = np.square(np.tile(added, (1, len(inner) // 3)) * self._root)
        if shares is None:
            products, squares = np.concatenate(inner).sum(axis=1)[None], power.sum(axis=0)[None]
        else:
            products = shares @ np.concatenate(inner).T
            squares = np.square(shares) @ power
        for pixels, filled, each in seen:
            # First hits are of some pixels only.
            filled *= math.sqrt(each / THINNING)
            products += math.sqrt(each / THINNING) * filled @ self._weighed_at(pixels).T
            squares += np.square(filled) @ np.square(self._whole.root[pixels])
        gains, start = np.zeros(len(products)), 0
        for c in range(len(inner)):
            block = products[:, start : start + len(inner[c])]
            start += len(inner[c])
            gains += self._ranking.gain(c, block[:, 0], block[:, 1:], squares[:, c])
        return gains

    def _weighed_at(self, pixels: Indices) -> Floats:
        """Return residuals and columns of others at pixels, weighted twice, as rows."""
        its = self._whole.at(pixels)
        return np.concatenate(
            [
                np.concatenate([its.residual[None, :, c], its.others[c]]) * its.root[:, c]
                for c in range(its.root.shape[1])
            ]
        )


def _aimed(site: Site, directions: Floats | None, k: int) -> Site:
    """Return a pose that points along the k-th direction."""
    return site if directions is None else replace(site, direction=as_position(directions[k]))


def best_poses(
    batches: Iterator[tuple[Doubles, Callable[[int], Site]]], count: int
) -> list[tuple[float, Site]]:
    """Return the `count` poses with the largest gains, the best first."""
    best: list[tuple[float, Callable[[int], Site], int]] = []
    # Each of many products is small: threads of BLAS would wait far longer than they work.
    with one_thread():
        for gains, make in batches:
            order = np.argsort(-gains)[:count]
            best += [(float(gains[k]), make, int(k)) for k in order if gains[k] > 0]
            if len(best) > 4 * count:
                best = sorted(best, key=lambda pose: -pose[0])[:count]
    ordered = sorted(best, key=lambda pose: -pose[0])[:count]
    return [(gain, make(k)) for gain, make, k in ordered]
