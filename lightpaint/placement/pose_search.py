"""The search for better poses of lights: by blocks first, then all together.

A descent alone cannot turn a beam that misses what it should light: there is no slope. So each free
light in turn is tried at places, directions and cones all over its freedom, ranked by direct light
and compared by all light; then Gauss-Newton steps move all of them at once, their weights
eliminated. Every comparison is of the same frozen paths, so its noise cancels. Other paths, which
no pose was fitted to, judge at the end which moves are worth it.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.placement.free_space import as_position
from lightpaint.placement.freedom import FreeLight
from lightpaint.placement.frozen_paths import FrozenPaths, falloff
from lightpaint.placement.placement_fit import Fitted, PlacementFit
from lightpaint.scene.properties.pose import Site

#: Places that each light is tried at, degrees between its directions, and directions whose images
#: are made together.
PLACES, APART, DIRECTIONS_AT_ONCE = 16, 20.0, 8

#: Most turns of each light, and the share by which one has to lower what is missed for another.
TURNS, WORTH_A_TURN = 2, 0.15

#: Candidates that all light is computed for; those of them that are refined, far from each other
#: in place or direction; and the steps of that.
COMPARED, REFINED, SHORT_STEPS = 12, 3, 2

#: Closest two refined candidates, relative to the spread of visible points, and in degrees.
NEAREST, NARROWEST = 0.1, 20.0

#: Least fall of what is missed that a trial is kept for.
KEPT_GAIN = 0.005

#: Steps of all lights together, the length of the first differences, relative to the spread of
#: visible points, and the share of it that the last have.
STEPS, FIRST_STEP, LAST_SHARE = 10, 0.04, 0.15

#: Lengths of a step, in those of its differences, that no number exceeds at once.
TRUST = 6.0

#: Least gain of a move, as a share of what is missed, and in standard errors.
WORTH, SURE = 0.01, 3.0


@dataclass(frozen=True)
class Found:
    """Poses that were found, and what they give.

    sites: of the free lights, in their order; those that are not worth a move stay where they are.
    gains: share of what was missed that each of them gives, beside the others; 0 without a move.
    before, after: what is missed, as a share of ‖Ψ‖², on paths that no pose was fitted to.
    """

    sites: tuple[Site, ...]
    gains: tuple[float, ...]
    before: float
    after: float


@dataclass(frozen=True)
class SearchPaths:
    """Frozen paths of one small film.

    rank: few, for direct light; compare: for trials; refine: many, for the last steps; judge: as
    many, from other random numbers.
    """

    rank: FrozenPaths
    compare: FrozenPaths
    refine: FrozenPaths
    judge: FrozenPaths


class PoseSearch:
    """A search for the poses of `lights`.

    Args:
        fit: The goal, and the columns of all lights.
        lights: Those that are free, and index of each among the columns.
        paths: To search along.
        spread: Median distance of visible points from their middle.
        seed: Of the places that are tried.
    """

    def __init__(
        self,
        fit: PlacementFit,
        lights: Sequence[tuple[FreeLight, int]],
        paths: SearchPaths,
        *,
        spread: float,
        seed: int,
    ) -> None:
        self._fit, self._paths = fit, paths
        self._lights = [light for light, _ in lights]
        self._places = [k for _, k in lights]
        self._spread, self._first_step = spread, FIRST_STEP * spread
        self._unit = spread / 3
        self._rng = np.random.default_rng(seed)

    def run(self, progress: Callable[[int, int], None]) -> Found:
        """Search, and return what was found. progress: hears steps done, and all."""
        total = TURNS * len(self._lights) + STEPS
        sites = [light.site for light in self._lights]
        everyone = range(len(sites))
        compare, done = self._paths.compare, 0
        best = self._fitted(sites, compare)
        for _ in range(TURNS):
            before = best.missed
            for k in everyone:
                sites, best = self._tried(sites, best, k) or (sites, best)
                done += 1
                progress(done, total)
            if best.missed > (1 - WORTH_A_TURN) * before:
                break
        done, step = TURNS * len(sites), self._first_step
        best = self._fitted(sites, self._paths.refine)
        for _ in range(STEPS):
            sites, best, share = self._stepped(sites, best, step, everyone, self._paths.refine)
            done += 1
            progress(done, total)
            if share < 1e-4 and step <= LAST_SHARE * self._first_step:
                break
            step = max((0.4 if share < 1e-4 else 0.6) * step, LAST_SHARE * self._first_step)
        progress(total, total)
        return self._judged(sites)

    def _columns(self, sites: Sequence[Site], paths: FrozenPaths) -> Floats:
        made = paths.columns(sites)
        return made.reshape(len(made), -1, 3)

    def _fitted(self, sites: Sequence[Site], paths: FrozenPaths) -> Fitted:
        columns = self._columns(sites, paths)
        return self._fit.fitted(self._fit.replaced(dict(zip(self._places, columns, strict=True))))

    def _with(self, columns: Floats, k: int, column: Floats) -> Floats:
        """Return `columns` with that of free light `k` replaced."""
        made = columns.copy()
        made[self._places[k]] = column
        return made

    def _tried(self, sites: list[Site], best: Fitted, k: int) -> tuple[list[Site], Fitted] | None:
        """Return poses with a better one of light `k`, or None if the others alone do as well."""
        paths, trials = self._paths.compare, []
        candidates = self._best_by_direct_light(sites, k)
        for other, column in zip(candidates, self._columns(candidates, paths), strict=True):
            trials.append((other, self._fit.fitted(self._with(best.columns, k, column))))
        trials.sort(key=lambda trial: trial[1].missed)
        found = (sites, best)
        for site, fitted in self._far_apart(trials):
            moved = [*sites[:k], site, *sites[k + 1 :]]
            for _ in range(SHORT_STEPS):
                moved, fitted, _ = self._stepped(moved, fitted, self._first_step, [k], paths)
            if fitted.missed < found[1].missed:
                found = (moved, fitted)
        return found if found[1].missed < (1 - KEPT_GAIN) * best.missed else None

    def _best_by_direct_light(self, sites: Sequence[Site], k: int) -> list[Site]:
        """Return the poses of light `k` whose direct light promises most, COMPARED or fewer."""
        columns = self._fit.replaced(
            dict(zip(self._places, self._paths.rank.direct_images(sites), strict=True))
        )
        columns[self._places[k]] = 0
        ranking = self._fit.ranking(columns, self._fit.fitted(columns), self._places[k])
        candidates: list[tuple[float, Site]] = []
        for tried, images in self._candidates(self._lights[k], sites[k]):
            candidates += zip(ranking.gains(images).tolist(), tried, strict=True)
        candidates.sort(key=lambda candidate: -candidate[0])
        return [site for _, site in candidates[:COMPARED]]

    def _far_apart(self, trials: Sequence[tuple[Site, Fitted]]) -> list[tuple[Site, Fitted]]:
        """Return the first of `trials` that are not near one before, REFINED or fewer."""
        kept: list[tuple[Site, Fitted]] = []
        for site, fitted in trials:
            if all(self._differ(site, other) for other, _ in kept):
                kept.append((site, fitted))
        return kept[:REFINED]

    def _differ(self, one: Site, other: Site) -> bool:
        here, there = (one.position or (0.0, 0.0, 0.0)), (other.position or (0.0, 0.0, 0.0))
        if math.dist(here, there) > NEAREST * self._spread:
            return True
        if one.direction is None or other.direction is None:
            return False
        cosine = float(np.dot(one.direction, other.direction))
        return cosine < math.cos(math.radians(NARROWEST))

    def _candidates(self, light: FreeLight, now: Site) -> Iterator[tuple[list[Site], Floats]]:
        """Yield poses of a light with their direct images, (k, p, 3), in parts."""
        paths = self._paths.rank
        directions, cones = light.directions(APART), light.cones()
        if light.site.position is None:
            sites = [replace(now, direction=as_position(d)) for d in directions]
            yield sites, paths.direct_images(sites)
            return
        points = paths.points(paths.direct)
        for place in light.places(PLACES, self._rng):
            here = replace(now, position=as_position(place))
            added = paths.contributions(paths.direct, here)
            if light.site.cutoff is None:
                yield [here], paths.image_of(paths.direct, added[None])
                continue
            for start in range(0, len(directions), DIRECTIONS_AT_ONCE):
                its = directions[start : start + DIRECTIONS_AT_ONCE]
                shares = falloff(points, here, its, cones).reshape(-1, len(points))
                sites = [
                    replace(here, direction=as_position(d), cutoff=float(cutoff), beam=float(beam))
                    for d in its
                    for cutoff, beam in cones
                ]
                yield sites, paths.image_of(paths.direct, shares[..., None] * added)

    def _stepped(
        self,
        sites: list[Site],
        best: Fitted,
        step: float,
        moving: Sequence[int],
        paths: FrozenPaths,
    ) -> tuple[list[Site], Fitted, float]:
        """Return poses after one Gauss-Newton step of some lights, and the share that it gains."""
        scales = {k: _scales(self._lights[k], self._unit) for k in moving}
        numbers = [(k, j) for k, its in scales.items() for j in range(len(its))]
        if not numbers:
            return sites, best, 0.0
        tried_sites = []
        for k, j in numbers:
            for sign in (1, -1):
                one = np.zeros(len(scales[k]))
                one[j] = sign * step * scales[k][j]
                tried_sites.append(self._lights[k].stepped(sites[k], one))
        columns = self._columns(tried_sites, paths)
        slopes = (columns[0::2] - columns[1::2]) / (2 * step)
        owners = [self._places[k] for k, _ in numbers]
        matrix, gradient = self._fit.newton(best, slopes, owners)
        damping = 1e-2
        for _ in range(5):
            ridge = np.diag(matrix) + 1e-9 * np.trace(matrix) + 1e-300
            change = np.linalg.solve(matrix + damping * np.diag(ridge), gradient)
            change = change.clip(-TRUST * step, TRUST * step)
            moved = list(sites)
            for k, scale in scales.items():
                its_own = change[[q for q, (owner, _) in enumerate(numbers) if owner == k]]
                moved[k] = self._lights[k].stepped(sites[k], its_own * scale)
            its = self._fitted(moved, paths)
            if its.missed < best.missed * (1 - 1e-7):
                return moved, its, 1 - its.missed / best.missed
            damping *= 6
        return sites, best, 0.0

    def _judged(self, sites: Sequence[Site]) -> Found:
        """Return the moves that are worth it, on paths that none was fitted to."""
        now, sites = [light.site for light in self._lights], list(sites)
        fits, judged = zip(
            *(
                (self._columns(its, self._paths.refine), self._columns(its, self._paths.judge))
                for its in (now, sites)
            ),
            strict=True,
        )

        def missed(moved: Sequence[bool]) -> Doubles:
            """Return what is missed if these lights move and the others stay, (2, p).

            By the paths that the weights are fitted on, and by the others.
            """
            columns = [
                self._fit.replaced(
                    {
                        place: its[int(is_moved)][j]
                        for j, (place, is_moved) in enumerate(zip(self._places, moved, strict=True))
                    }
                )
                for its in (fits, judged)
            ]
            weights = self._fit.fitted(columns[0]).weights
            return np.stack([self._fit.missed_map(its, weights) for its in columns])

        moves = [site != old for site, old in zip(sites, now, strict=True)]
        before = missed([False] * len(moves))
        total = float(before[1].sum())
        gains = [0.0] * len(moves)
        while any(moves):
            after = missed(moves)
            lost = {
                k: missed([m and j != k for j, m in enumerate(moves)]) - after
                for k, is_moved in enumerate(moves)
                if is_moved
            }
            for k, its in lost.items():
                gains[k] = float(its[1].sum()) / total
            least = min(lost, key=lambda k: gains[k])
            if gains[least] >= max(WORTH, SURE * _standard_error(lost[least]) / total):
                break
            moves[least], gains[least] = False, 0.0
        norm2 = self._fit.norm2 or 1.0
        return Found(
            tuple(site if m else old for site, old, m in zip(sites, now, moves, strict=True)),
            tuple(gains),
            total / norm2,
            float(missed(moves)[1].sum()) / norm2,
        )


def _scales(light: FreeLight, unit: float) -> Doubles:
    """Return how much of each number of a pose counts like a scene unit of sliding.

    unit: the length that counts like AIM_UNIT and CONE_UNIT.
    """
    place, turn, cone = light.dimensions
    return np.array([1.0] * place + [1 / unit] * (turn + cone))


def _standard_error(differences: Doubles) -> float:
    """Return the standard error of a sum over pixels, (2, p): by how much two sets of paths differ.

    They share what is signal, and have independent noise at each pixel.
    """
    return float(np.sqrt(np.square(differences[0] - differences[1]).sum() / 2))
