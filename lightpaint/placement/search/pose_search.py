"""The search for better poses of lights: by blocks first, then all together.

Descent alone cannot turn a beam that misses its target, since there is no slope. So each free light
in turn is tried at places, directions and cones over its whole freedom, ranked by direct light and
compared by all light. Then Gauss-Newton steps move all lights at once, with their weights
eliminated. All comparisons use the same frozen paths, so their noise cancels.

Rules besides the freedom of each light keep lights in free space, apart, and out of view.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np

from lightpaint.arrays import Bools, Floats
from lightpaint.placement.lights_to_place import Arrangement, Movable, all_sites, by_column
from lightpaint.placement.paths.panel_lights import PanelSite
from lightpaint.placement.paths.view_paths import SearchPaths
from lightpaint.placement.placement_fit import Fitted, PlacementFit, Ranking, with_columns
from lightpaint.placement.search.pose_candidates import PoseCandidates, best_poses
from lightpaint.placement.search.pose_steps import PoseSteps
from lightpaint.scene.properties.pose import Site

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
        """Return the most promising poses of lights that are not in `others`, the best first.

        By the place of each in `movables`, a few of them all together, with the best lighting.
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
    """Rules about where lights may hang. paths: those of the search."""

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
