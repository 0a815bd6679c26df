"""The search for better poses of lights: by blocks first, then all together.

Descent alone cannot turn a beam that misses its target, since there is no slope. So each free light
in turn is tried at places, directions and cones over its whole freedom, ranked by direct light and
compared by all light. Then Gauss-Newton steps move all lights at once, with their weights
eliminated. All comparisons use the same frozen paths, so their noise cancels.

Rules besides the freedom of each light keep lights in free space, apart, and out of view.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats, Indices, as_position
from lightpaint.placement.freedom import FreeLight
from lightpaint.placement.lights_to_place import Arrangement, Movable, all_sites, by_column
from lightpaint.placement.paths.panel_lights import PanelSite
from lightpaint.placement.paths.vertex_light import away_from
from lightpaint.placement.paths.view_paths import SearchPaths, ViewPaths
from lightpaint.placement.placement_fit import Fitted, PlacementFit, Ranking, with_columns
from lightpaint.placement.search.pose_steps import PoseSteps
from lightpaint.scene.properties.site import Site
from lightpaint.threads import one_thread

#: Number of trial places of a light: if all lights are on lines, otherwise, and for new lights and
#: new panels, which have many directions and sides.
PLACES_ON_LINES, PLACES, PLACES_OF_NEW, PLACES_OF_PANELS = 24, 64, 176, 112

#: Number of further trial places of a panel, where the camera may see it, and their largest
#: distance, relative to the spread of visible points.
PLACES_IN_VIEW, REACH = 64, 4.0

#: Number of best places around which more are tried, and the number of these.
BESIDE, AROUND = 10, 10

#: Largest number of rounds over all lights, and the share by which a round has to lower the error
#: for another one.
TURNS, WORTH_A_TURN = 2, 0.15

#: Number of candidates for which all light is computed; number of those that are refined, far apart
#: in place or direction; and the steps of the refinement.
COMPARED, REFINED, SHORT_STEPS = 40, 5, 4

#: Least distance between refined candidates, relative to the spread of visible points, and in
#: degrees.
NEAREST, NARROWEST = 0.15, 25.0

#: Least decrease of the error for which a trial is kept.
KEPT_GAIN = 0.005

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


class PoseSearch:
    """A search for the poses of lights.

    Args:
        fit: The goal, and the columns of all lights.
        paths: To search along.
        rules: Restrictions of poses besides the freedom of each light.
        seed: Of the trial places.
    """

    def __init__(
        self, fit: PlacementFit, paths: SearchPaths, rules: "PoseRules", *, seed: int
    ) -> None:
        self.fit, self.paths, self.rules = fit, paths, rules
        self.spread = paths.space.spread or 1.0
        self.steps = PoseSteps(fit, self.spread, rules.permit)
        self._rng = np.random.default_rng(seed)

    def is_enough(self) -> bool:
        """Return whether the search is to end with the best so far."""
        return self.steps.is_enough()

    def by_blocks(self, start: Arrangement, progress: Callable[[], None]) -> Arrangement:
        """Return an arrangement after trying each light over its whole freedom."""
        best = start
        for _ in range(TURNS):
            before = best.missed
            for k in range(len(best.movables)):
                if self.is_enough():
                    return best
                best = self.tried(best, k)
                progress()
            if best.missed > (1 - WORTH_A_TURN) * before:
                break
        return best

    def tried(self, start: Arrangement, k: int) -> Arrangement:
        """Return the arrangement with the best pose of movable `k`, and the others unchanged."""
        movable = start.movables[k]
        black = dict.fromkeys(movable.columns, 0 * start.fitted.columns[0])
        others = self.fit.fitted(with_columns(start.fitted.columns, black))
        best = start
        for site, fitted in self.candidates(start.without(k, others), [movable]).get(0, []):
            if self.is_enough():
                break
            moved = self.steps.descend(
                start.with_site(k, site, fitted), self.paths.compare, SHORT_STEPS, moving=[k]
            )
            best = min(best, moved, key=lambda trial: trial.missed)
        return best if best.missed < (1 - KEPT_GAIN) * start.missed else start

    def candidates(
        self, others: Arrangement, movables: Sequence[Movable]
    ) -> dict[int, list[tuple[Site, Fitted]]]:
        """Return the most promising poses of each light that is not in `others`, the best first.

        The keys are indices into `movables`. Each pose has its fit: the best lighting with the
        light there. Of all lights together only a few poses are compared.
        """
        ranking = self.fit.ranking(others.fitted)
        direct = PoseCandidates(self.paths.rank, ranking)
        poses: list[tuple[float, Site, int]] = []
        for j, movable in enumerate(movables):
            places = self._places(others, movable)
            if isinstance(movable.light.site, PanelSite) and movable.light.freedom.slides:
                seen = self._places_in_view(others, movable, ranking)
                places = np.concatenate([places, seen])
            ranked = best_poses(direct.gains(movable.light, places), COMPARED)
            if len(places) > 1:
                nearby = self._places_beside(others, movable, places, ranked)
                nearer = best_poses(direct.gains(movable.light, nearby), COMPARED // 2)
                # Some from each ranking, since direct light overrates places close to a hit.
                ranked = [*ranked[: COMPARED - len(nearer)], *nearer]
            poses += [(gain, site, j) for gain, site in ranked]
        poses = sorted(poses, key=lambda pose: -pose[0])[:COMPARED]
        trials: list[tuple[float, Site, int, Fitted]] = []
        for _, site, j in poses:
            if self.is_enough():
                break
            fitted = self._fitted_with(others, movables[j], site)
            trials.append((fitted.missed, site, j, fitted))
        chosen: list[tuple[float, Site, int, Fitted]] = []
        for trial in sorted(trials, key=lambda trial: trial[0]):
            if all(self._differ(trial[1], other) for _, other, _, _ in chosen):
                chosen.append(trial)
        fits: dict[int, list[tuple[Site, Fitted]]] = {}
        for _, site, j, fitted in chosen[:REFINED]:
            fits.setdefault(j, []).append((site, fitted))
        return fits

    def _fitted_with(self, others: Arrangement, movable: Movable, site: Site) -> Fitted:
        columns = self.paths.compare.columns(all_sites([movable], [site]))
        return self.fit.fitted(with_columns(others.fitted.columns, by_column([movable], columns)))

    def _places(self, others: Arrangement, movable: Movable) -> Floats:
        """Return trial places of a light: free ones, and its current one."""
        light = movable.light
        if light.site.position is None or not light.freedom.slides:
            return light.some_places(1, self._rng)
        count = PLACES_ON_LINES if light.freedom.all_rails else PLACES
        if movable.group is not None:
            count = PLACES_OF_PANELS if isinstance(light.site, PanelSite) else PLACES_OF_NEW
        places = light.some_places(count, self._rng)
        is_permitted = self._is_permitted(others, movable, places)
        if movable.group is None:
            is_permitted[0] = True
        return places[is_permitted]

    def _places_in_view(self, others: Arrangement, movable: Movable, ranking: Ranking) -> Floats:
        """Return places of a panel before pixels that are too dark without it."""
        lacking = np.square(np.maximum(ranking.residual, 0)).sum(axis=1)
        assert movable.light.places is not None
        found = []
        for lines in self.paths.rank.sight_lines():
            odds = lacking[lines.pixels].astype(float)
            if not odds.sum() > 0:
                continue
            chosen = self._rng.choice(len(odds), PLACES_IN_VIEW, p=odds / odds.sum())
            length = np.minimum(lines.lengths[chosen], REACH * self.spread)
            length *= self._rng.uniform(0.05, 0.95, len(chosen))
            found += [
                movable.light.places.nearest(place)
                for place in lines.origins[0][chosen]
                + length[:, None] * lines.directions[0][chosen]
            ]
        places = np.array(found, dtype=float).reshape(-1, 3)
        return places[self._is_permitted(others, movable, places)] if len(places) else places

    def _places_beside(
        self,
        others: Arrangement,
        movable: Movable,
        places: Floats,
        ranked: Sequence[tuple[float, Site]],
    ) -> Floats:
        """Return more places around the best ones, nearer than their neighbours."""
        assert movable.light.places is not None
        best: list[Floats] = []
        for _, site in ranked:
            place = np.array(site.position, dtype=float)
            if all(np.abs(place - other).max() > 0 for other in best) and len(best) < BESIDE:
                best.append(place)
        neighbours = []
        for place in best:
            away = np.linalg.norm(places - place, axis=1)
            radius = float(np.min(away[away > 0], initial=self.spread))
            off = self._rng.normal(size=(AROUND, 3))
            off *= radius * self._rng.random((AROUND, 1)) / np.linalg.norm(off, axis=1)[:, None]
            neighbours += [movable.light.places.nearest(place + x) for x in off]
        candidates = np.array(neighbours, dtype=float).reshape(-1, 3)
        return candidates[self._is_permitted(others, movable, candidates)]

    def _is_permitted(self, others: Arrangement, movable: Movable, places: Floats) -> Bools:
        is_usable = self.rules.usable(movable, places)
        return is_usable & self.rules.keep_apart(others.movables, others.sites, movable, places)

    def _differ(self, first: Site, second: Site) -> bool:
        first_place, second_place = (
            (first.position or (0.0, 0.0, 0.0)),
            (second.position or (0.0, 0.0, 0.0)),
        )
        if math.dist(first_place, second_place) > NEAREST * self.spread:
            return True
        if first.direction is None or second.direction is None:
            return False
        cosine = float(np.dot(first.direction, second.direction))
        return cosine < math.cos(math.radians(NARROWEST))


class PoseRules:
    """Rules about where lights may hang. paths: the loops of the search."""

    def __init__(self, paths: SearchPaths) -> None:
        self._paths = paths

    def permit(self, movables: Sequence[Movable], sites: Sequence[Site]) -> bool:
        """Return whether new lights are clear of surfaces, apart, and out of view if required."""
        for k, (movable, site) in enumerate(zip(movables, sites, strict=True)):
            group = movable.group
            if group is None or site.position is None:
                continue
            place = np.array([site.position])
            if movable.light.freedom.surfaces is None and not self._paths.clear(place).all():
                return False
            others = range(len(movables))
            rest = [j for j in others if j != k]
            if (
                group.apart
                and not self.keep_apart(
                    [movables[j] for j in rest], [sites[j] for j in rest], movable, place
                ).all()
            ):
                return False
            if _is_kept_out_of_view(movable) and self._in_view(site, place).any():
                return False
        return True

    def usable(self, movable: Movable, places: Floats) -> Bools:
        """Return which places, (k,), are free, see the picture, and are out of view if required."""
        clear = movable.light.freedom.clear
        # Lights on a surface keep the requested distance from it.
        is_usable = self._paths.usable(places, None if clear is None else 0.9 * clear)
        if _is_kept_out_of_view(movable):
            is_usable &= ~self._in_view(movable.light.site, places)
        return is_usable

    def _in_view(self, site: Site, places: Floats) -> Bools:
        """Return at which places, (k,), a light is seen; of a panel, what surrounds its centre."""
        around = np.zeros((1, 3))
        if isinstance(site, PanelSite):
            around = np.vstack([around, site.side / 2 * np.eye(3), -site.side / 2 * np.eye(3)])
        seen = self._paths.in_view((places[:, None] + around).reshape(-1, 3))
        return np.asarray(seen.reshape(len(places), -1).any(axis=1))

    def keep_apart(
        self,
        movables: Sequence[Movable],
        sites: Sequence[Site],
        movable: Movable,
        places: Floats,
    ) -> Bools:
        """Return which places, (k,), are far enough from the other new lights of its group."""
        is_apart = np.ones(len(places), dtype=bool)
        if movable.group is None or not movable.group.apart:
            return is_apart
        for other, site in zip(movables, sites, strict=True):
            if other.group == movable.group and site.position is not None:
                away = np.linalg.norm(places - np.array(site.position), axis=1)
                is_apart &= away >= movable.group.apart
        return is_apart


def _is_kept_out_of_view(movable: Movable) -> bool:
    group, is_panel = movable.group, isinstance(movable.light.site, PanelSite)
    return group is not None and group.is_kept_out_of_view(is_panel=is_panel)


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
