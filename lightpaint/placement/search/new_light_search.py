"""The search for new lights, and its time: the best place for one more, then all moved together.

This is the sliding Frank-Wolfe method (Denoyelle et al. 2019): the search is over places only, and
the convex solve gives the weights. Each new light is judged on paths that it was not fitted to,
since some of many candidates seem to help by noise alone.

Before it starts, its time is estimated from what it will do: nearly all goes into light along
frozen paths for trial poses, about as many of them for each light and round, each over all pixels
of the small film.
"""

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.placement.lights_to_place import Arrangement, Movable
from lightpaint.placement.look_goals import PIXELS
from lightpaint.placement.search.judgement import NOTHING, PlacementJudge
from lightpaint.placement.search.pose_search import SHORT_STEPS, TURNS, PoseSearch
from lightpaint.scene.properties.site import Site

#: Number of searches at most, each with other trial places, and the share of the error before them
#: up to which no further one is made.
STARTS, ENOUGH = 2, 0.2

#: Least decrease of the error for which a new light moves once all are added, and how often one of
#: them is tried at most.
WORTH_AGAIN, MOST_TRIALS = 0.02, 3

#: Steps of all lights together, after each addition, and their first differences, relative to the
#: usual ones, once lights slid.
STEPS, SLID_SHARE = 8, 0.5

#: Number of places that are judged for one light, and the gain of the one before, relative to the
#: least that is worth it, from which the next is judged at all.
JUDGED, UNSURE = 3, 0.3

#: Weight, relative to the largest, below which a light is off.
OFF = 1e-6

#: Largest increase of the error for which two nearby lights are merged.
MERGED_RISE = 0.03

#: Distance of lights that may be merged, relative to the spread of visible points.
MERGED_DISTANCE = 0.5


class NewLightSearch:
    """A search for lights to add.

    Args:
        search: Of poses.
        slots: New lights that may be added; the slots of one group are alike.
        judge: Judges the gain of each.
    """

    def __init__(self, search: PoseSearch, slots: Sequence[Movable], judge: PlacementJudge) -> None:
        self._search, self._slots, self._judge = search, slots, judge
        self._free: list[Movable] = []
        self._fit, self._steps, self._paths = search.fit, search.steps, search.paths

    def run(self, start: Arrangement, progress: Callable[[], None]) -> Arrangement:
        """Return an arrangement with the worthwhile new lights.

        A single search sometimes ends where no step leads on, and what looks as good on the small
        film may be far worse on the larger one. So another search has other trial places, and the
        paths of the judgement tell which is better.
        """
        found: list[Arrangement] = []
        for _ in range(STARTS):
            found.append(self._grown(start, progress))
            if self._search.is_enough() or found[-1].missed <= max(
                ENOUGH * start.missed, NOTHING * self._fit.norm2
            ):
                break
        return min(found, key=self._judge.missed) if len(found) > 1 else found[0]

    def _grown(self, start: Arrangement, progress: Callable[[], None]) -> Arrangement:
        """Return an arrangement with the worthwhile new lights of one search."""
        arrangement, self._free = start, list(self._slots)
        while self._free and arrangement.missed > NOTHING * self._fit.norm2:
            if self._search.is_enough():
                break
            more = self._worthwhile(arrangement, self._with_one_more(arrangement))
            progress()
            if more is None:
                break
            added = more.movables[-1]
            self._free = [slot for slot in self._free if slot.columns != added.columns]
            arrangement = self._without_off(more)
        return self._merged(self._tried_again(arrangement))

    def _worthwhile(
        self, before: Arrangement, candidates: Sequence[Arrangement]
    ) -> Arrangement | None:
        """Return the first candidate that is worth it, after steps of all lights; None without any.

        If the best one seems to help but is lost in noise, the next may not be.
        """
        for more in candidates:
            # Until the others make room for it, a light may seem to gain next to nothing.
            together = self._together(more)
            worth = self._judge.worth(before, together)
            if worth >= 1:
                return together
            if worth < UNSURE:
                break
        return None

    def _together(self, arrangement: Arrangement) -> Arrangement:
        """Return the arrangement after steps of all lights together."""
        at = self._paths.compare
        moved = self._steps.descend(arrangement, at, STEPS, first_share=1.0)
        slid = self._steps.slid(moved, at)
        if slid.missed > (1 - WORTH_AGAIN) * moved.missed:
            return slid
        return self._steps.descend(slid, at, STEPS, first_share=SLID_SHARE)

    def _tried_again(self, arrangement: Arrangement) -> Arrangement:
        """Return the arrangement after trying new lights elsewhere, those that do least first.

        Where lights were taken for others, the last one often does what is left to do from a wrong
        place, while the others have moved on to their own. The one that does most stays.
        """
        place = 0
        for _ in range(MOST_TRIALS):
            order = self._least_first(arrangement)
            if (
                self._search.is_enough()
                or place >= len(order) - 1
                or arrangement.missed <= NOTHING * self._fit.norm2
            ):
                break
            better = self._search.tried(arrangement, order[place])
            place += 1
            if better.missed < (1 - WORTH_AGAIN) * arrangement.missed:
                arrangement, place = self._together(better), 0
        return arrangement

    def _least_first(self, arrangement: Arrangement) -> list[int]:
        """Return the new lights in the order of what is missed without each."""
        new = [k for k, movable in enumerate(arrangement.movables) if movable.group is not None]
        without = {k: self._fit.fitted(self._blackened(arrangement, k)).missed for k in new}
        return sorted(new, key=lambda k: without[k])

    def _with_one_more(self, arrangement: Arrangement) -> list[Arrangement]:
        """Return the arrangement with one light added and the others unchanged, the best first."""
        kinds: list[Movable] = []
        for slot in self._free:
            if all(slot.group is not kind.group for kind in kinds):
                kinds.append(slot)
        added: list[Arrangement] = []
        for j, candidates in self._search.candidates(arrangement, kinds).items():
            for site, fitted in candidates:
                more = arrangement.with_movable(kinds[j], site, fitted)
                last = len(more.movables) - 1
                added.append(
                    self._steps.descend(more, self._paths.compare, SHORT_STEPS, moving=[last])
                )
        return sorted(added, key=lambda more: more.missed)[:JUDGED]

    def _without_off(self, arrangement: Arrangement) -> Arrangement:
        """Return the arrangement without new lights that are off, whose slots are free again."""
        weights = arrangement.fitted.weights
        for k in reversed(range(len(arrangement.movables))):
            movable = arrangement.movables[k]
            light_weights = weights[list(movable.columns)]
            if movable.group is not None and light_weights.max() <= OFF * weights.max():
                self._free.insert(0, movable)
                arrangement = arrangement.without(
                    k, self._fit.fitted(self._blackened(arrangement, k))
                )
        return arrangement

    def _blackened(self, arrangement: Arrangement, k: int) -> Floats:
        columns = arrangement.fitted.columns.copy()
        columns[list(arrangement.movables[k].columns)] = 0
        return columns

    def _merged(self, arrangement: Arrangement) -> Arrangement:
        """Return the arrangement with nearby lights of one group merged."""
        while (pair := self._nearest_pair(arrangement)) is not None:
            first, second = pair
            merged = self._one_for_two(arrangement, first, second)
            if merged.missed > (1 + MERGED_RISE) * arrangement.missed + NOTHING * self._fit.norm2:
                break
            self._free.insert(0, arrangement.movables[second])
            arrangement = merged
        return arrangement

    def _one_for_two(self, arrangement: Arrangement, first: int, second: int) -> Arrangement:
        level = arrangement.fitted.weights.mean(axis=1)
        a, b = (
            max(float(level[arrangement.movables[k].columns[0]]), 1e-300) for k in (first, second)
        )
        site = _between(arrangement.sites[first], arrangement.sites[second], b / (a + b))
        movable = arrangement.movables[first]
        sites = list(arrangement.sites)
        sites[first] = movable.light.permitted(site)
        movables = [m for k, m in enumerate(arrangement.movables) if k != second]
        del sites[second]
        fitted = self._steps.fitted(movables, sites, self._paths.compare)
        joined = Arrangement(tuple(movables), tuple(sites), fitted)
        return self._together(joined)

    def _nearest_pair(self, arrangement: Arrangement) -> tuple[int, int] | None:
        """Return the nearest two new lights of one group that may be merged, or None."""
        best, nearest = None, MERGED_DISTANCE * self._search.spread
        for k, movable in enumerate(arrangement.movables):
            for j in range(k):
                if movable.group is None or movable.group is not arrangement.movables[j].group:
                    continue
                places = [np.array(arrangement.sites[i].position, dtype=float) for i in (k, j)]
                away = float(np.linalg.norm(places[0] - places[1]))
                if away < nearest:
                    best, nearest = (j, k), away
        return best


def _between(first: Site, second: Site, share: float) -> Site:
    """Return the pose between two. share: weight of the other."""

    def mixed(a: tuple[float, ...], b: tuple[float, ...]) -> tuple[float, float, float]:
        x, y, z = ((1 - share) * p + share * q for p, q in zip(a, b, strict=True))
        return x, y, z

    assert first.position is not None
    assert second.position is not None
    site = replace(first, position=mixed(first.position, second.position))
    if first.direction is None or second.direction is None:
        return site
    way = np.array(mixed(first.direction, second.direction))
    length = float(np.linalg.norm(way))
    if length < 1e-6:
        return site
    x, y, z = (way / length).tolist()
    return replace(site, direction=(x, y, z))


#: Seconds at the usual pace, the pace of two idle processors, on a film of PIXELS: for one light
#: and round; for a new light and start; for the last steps and the judgement of one light.
LIGHT_S, NEW_LIGHT_S, END_S = 3.5, 12.0, 4.0

#: Seconds to trace the paths and compile kernels.
BEGIN_S = 8.0


@dataclass(frozen=True)
class SearchSize:
    """The work of a search.

    lights: number of those that may move. new: number of those that may be added. pixels: of the
    small films of all views together.
    """

    lights: int
    new: int
    pixels: int

    @classmethod
    def of(cls, lights: int, new: int, pixels: int) -> "SearchSize":
        """Return the size of a search on pictures of so many pixels together."""
        return cls(lights, new, min(pixels, PIXELS))

    def seconds(self, pace: float = 1.0) -> tuple[float, float]:
        """Return about the least and the most seconds that a search takes that is not stopped.

        pace: how much longer than usual it takes here. A second round over all lights follows only
        if the first one helped.
        """
        return pace * self._usual_seconds(1, 1), pace * self._usual_seconds(TURNS, STARTS)

    def _usual_seconds(self, rounds: int, starts: int) -> float:
        """Return the seconds of a search of so many rounds and starts at the usual pace."""
        blocks = rounds * self.lights * LIGHT_S + starts * self.new * NEW_LIGHT_S
        end = (self.lights + self.new) * END_S
        return BEGIN_S + self.pixels / PIXELS * (blocks + end)

    def pace_of(self, seconds: float) -> float:
        """Return the pace of a finished search that took so long, after an unknown round."""
        low, high = self.seconds()
        return seconds / math.sqrt(low * high)


def usual_pace() -> float:
    """Return the pace to expect from how busy this machine is: 1 for an idle one."""
    try:
        load = os.getloadavg()[0]
    except OSError:  # a system that does not count it
        return 1.0
    return max(1.0, load / (os.cpu_count() or 1))
