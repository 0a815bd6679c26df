"""Gauss-Newton steps of several lights' poses, their weights eliminated."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from lightpaint.arrays import Doubles, as_position
from lightpaint.placement.freedom import FreeLight
from lightpaint.placement.lights_to_place import Arrangement, Movable, all_sites, by_column
from lightpaint.placement.paths.panel_lights import PanelSite
from lightpaint.placement.paths.view_paths import ViewPaths
from lightpaint.placement.placement_fit import Fitted, PlacementFit, Slopes, with_columns
from lightpaint.scene.properties.site import Site

#: Largest step of a number, relative to its finite difference.
MAX_STEP = 6.0

#: Ridge of the first step, relative to the diagonal; its growth after a trial that failed, and
#: shrinkage after one that helped; its minimum; and the trials of a step.
RIDGE, RIDGE_GROWTH, RIDGE_SHRINK, LEAST_RIDGE, TRIALS = 1e-2, 6.0, 4.0, 1e-5, 5

#: Length of the first finite differences, relative to the spread of visible points; the least
#: length relative to that; and the factors after a step that helped, and after one without
#: progress.
FIRST_STEP, LAST_SHARE, SHORTER, MUCH_SHORTER = 0.04, 0.15, 0.6, 0.4

#: Ratios of distances that panels and spots are tried at, and how many times in a row.
RATIOS, MOST_SLIDES = (1.25, 1.08, 1.025), 8

#: Steps of a fit along other paths, and the largest of them, relative to the first differences.
REFIT_STEPS, REFIT_STEP = 8, 3.0

#: Decrease, as a share of the error, below which a step counts as no progress.
MIN_PROGRESS = 1e-4


class PoseSteps:
    """Steps of arrangements.

    Attributes:
        watch: Receives each trial arrangement.

    Args:
        fit: The goal, and the columns of lights that stay.
        spread: Median distance of visible points from their middle.
        permits: Whether movables may have these poses together.
    """

    def __init__(
        self,
        fit: PlacementFit,
        spread: float,
        permits: Callable[[Sequence[Movable], Sequence[Site]], bool],
    ) -> None:
        self._fit, self._permits = fit, permits
        self.watch: Callable[[Arrangement], None] = lambda _: None
        self.is_enough: Callable[[], bool] = lambda: False
        self._spread = spread
        self.first_step = FIRST_STEP * spread
        self._unit = spread / 3

    def with_fit(self, fit: PlacementFit) -> "PoseSteps":
        """Return the same steps for a fit on another film."""
        steps = PoseSteps(fit, self._spread, self._permits)
        steps.watch, steps.is_enough = self.watch, self.is_enough
        return steps

    def fitted(self, movables: Sequence[Movable], sites: Sequence[Site], at: ViewPaths) -> Fitted:
        """Return the best lighting with these poses."""
        columns = at.columns(all_sites(movables, sites))
        return self._fit.fitted(self._fit.replaced(by_column(movables, columns)))

    def refitted(self, arrangement: Arrangement, at: ViewPaths) -> Arrangement:
        """Return an arrangement along other paths."""
        refit = arrangement
        return Arrangement(
            refit.movables, refit.sites, self.fitted(refit.movables, refit.sites, at)
        )

    def descend(
        self,
        arrangement: Arrangement,
        at: ViewPaths,
        steps: int,
        *,
        moving: Sequence[int] | None = None,
        first_share: float = 1.0,
        progress: Callable[[], None] = lambda: None,
    ) -> Arrangement:
        """Return the arrangement after a limited number of steps; see `step`.

        first_share: size of the first differences, relative to `first_step`.
        """
        step, last, ridge = first_share * self.first_step, LAST_SHARE * self.first_step, RIDGE
        for _ in range(steps):
            if self.is_enough():
                break
            before = arrangement.missed
            arrangement, ridge = self.step(arrangement, at, step, ridge, moving=moving)
            self.watch(arrangement)
            progress()
            share = 1 - arrangement.missed / max(before, 1e-300)
            if share < MIN_PROGRESS and step <= last:
                break
            if share < MIN_PROGRESS:
                ridge = RIDGE
            step = max((MUCH_SHORTER if share < MIN_PROGRESS else SHORTER) * step, last)
        return arrangement

    def slid(self, arrangement: Arrangement, at: ViewPaths) -> Arrangement:
        """Return the arrangement after lights slid along lines that they look alike on, if better.

        A panel keeps its size in the picture on a line of sight, and a spot its circle of light on
        its axis. Either tells everything about the pose but the distance, and leaves Gauss-Newton
        steps no way to another one, where it fits only with the side or cone that belongs to it.
        """
        for k, movable in enumerate(arrangement.movables):
            light, site = movable.light, arrangement.sites[k]
            if not light.freedom.slides or self.is_enough():
                continue
            if isinstance(site, PanelSite):
                for eye in at.eyes:
                    arrangement = self._slid(arrangement, k, eye, at)
            elif light.freedom.cone is not None and (circle := at.lit_place(site)) is not None:
                arrangement = self._slid(arrangement, k, circle, at)
        return arrangement

    def _slid(self, arrangement: Arrangement, k: int, fixed: Doubles, at: ViewPaths) -> Arrangement:
        """Return the arrangement with light `k` at the best distance from a fixed place."""
        for factor in (factor for ratio in RATIOS for factor in (ratio, 1 / ratio)):
            for _ in range(MOST_SLIDES):
                trial = self._at_distance(arrangement, k, fixed, factor, at)
                if trial is None or trial.missed >= arrangement.missed:
                    break
                arrangement = trial
        return arrangement

    def _at_distance(
        self, arrangement: Arrangement, k: int, fixed: Doubles, factor: float, at: ViewPaths
    ) -> Arrangement | None:
        """Return the arrangement with light `k` at `factor` times its distance from a place.

        Its panel or circle of light looks as large as before from there. None if it may not hang
        there, or not be so.
        """
        movables, site = arrangement.movables, arrangement.sites[k]
        place = fixed + factor * (np.array(site.position, dtype=float) - fixed)
        slid = _scaled(replace(site, position=as_position(place)), factor)
        permitted = movables[k].light.permitted(slid)
        asked, given = ([*(its.position or ()), *_size(its)] for its in (slid, permitted))
        sites = [*arrangement.sites[:k], permitted, *arrangement.sites[k + 1 :]]
        if not np.allclose(asked, given, rtol=1e-9, atol=1e-9) or not self._permits(
            movables, sites
        ):
            return None
        return arrangement.with_site(k, permitted, self._moved(arrangement, sites, [k], at))

    def step(
        self,
        arrangement: Arrangement,
        at: ViewPaths,
        step: float,
        ridge: float = RIDGE,
        *,
        moving: Sequence[int] | None = None,
    ) -> tuple[Arrangement, float]:
        """Return an arrangement with a smaller error, or itself, and the ridge of the next step.

        step: length of the differences. moving: movables that move; None for all.
        """
        scales = self._all_scales(arrangement, moving)
        if not any(len(scale) for scale in scales.values()):
            return arrangement, ridge
        slopes = self._slopes(arrangement, at, scales, step)
        matrix, gradient = self._fit.newton(arrangement.fitted, slopes)
        movables = arrangement.movables
        for _ in range(TRIALS):
            change = np.linalg.solve(matrix + ridge * np.diag(_diagonal(matrix)), gradient)
            change = np.clip(change, -MAX_STEP * step, MAX_STEP * step)
            sites = self._stepped(arrangement, arrangement.sites, change, scales)
            if self._permits(movables, sites):
                fitted = self._moved(arrangement, sites, [*scales], at)
                if fitted.missed < arrangement.missed * (1 - 1e-7):
                    ridge = max(ridge / RIDGE_SHRINK, LEAST_RIDGE)
                    return Arrangement(movables, tuple(sites), fitted), ridge
            ridge *= RIDGE_GROWTH
        return arrangement, ridge

    def _moved(
        self, arrangement: Arrangement, sites: Sequence[Site], moving: Sequence[int], at: ViewPaths
    ) -> Fitted:
        """Return the best lighting with other poses of the `moving`."""
        movables = [arrangement.movables[k] for k in moving]
        columns = at.columns(all_sites(movables, [sites[k] for k in moving]))
        changed = by_column(movables, columns)
        return self._fit.fitted(with_columns(arrangement.fitted.columns, changed))

    def refit(self, arrangement: Arrangement, at: ViewPaths, other: ViewPaths) -> Sequence[Site]:
        """Return the poses that fit best along `other` paths, near those that do along `at`.

        Slopes are along the first paths, so that their noise is independent of the residual's: then
        the gradient needs no correction, and they serve all steps.
        """
        step = LAST_SHARE * self.first_step
        scales = self._all_scales(arrangement, None)
        sites: Sequence[Site] = arrangement.sites
        if not any(len(scale) for scale in scales.values()):
            return sites
        slopes = self._slopes(arrangement, at, scales, step)
        for _ in range(REFIT_STEPS):
            there = self.fitted(arrangement.movables, sites, other)
            matrix, gradient = self._fit.newton(arrangement.fitted, slopes, there)
            change = np.linalg.solve(matrix + LEAST_RIDGE * np.diag(_diagonal(matrix)), gradient)
            largest = REFIT_STEP * self.first_step
            stepped = self._stepped(arrangement, sites, np.clip(change, -largest, largest), scales)
            if not self._permits(arrangement.movables, stepped):
                break
            sites = stepped
        return sites

    def scatter_by_paintings(
        self, arrangement: Arrangement, at: ViewPaths
    ) -> tuple[list[tuple[list[Site], list[Site]]], Doubles]:
        """Return poses on both sides, by one standard deviation along each axis of the scatter of
        poses by the noise of paintings; and standard deviations of the weights that follow, (n, c).
        """
        scales = self._all_scales(arrangement, None)
        if not any(len(scale) for scale in scales.values()):
            return [], np.zeros(arrangement.fitted.weights.shape)
        slopes = self._slopes(arrangement, at, scales, LAST_SHARE * self.first_step)
        scatter = self._fit.scatter_by_paintings(arrangement.fitted, slopes)
        variances, axes = np.linalg.eigh(scatter.covariance)
        largest = REFIT_STEP * self.first_step
        ends = []
        for axis in (axes * np.sqrt(np.maximum(variances, 0))).T:
            change = np.clip(axis, -largest, largest)
            above, below = (
                self._stepped(arrangement, arrangement.sites, sign * change, scales)
                for sign in (1, -1)
            )
            ends.append((above, below))
        return ends, scatter.levels

    def _stepped(
        self,
        arrangement: Arrangement,
        sites: Sequence[Site],
        change: Doubles,
        scales: Mapping[int, Doubles],
    ) -> list[Site]:
        """Return other poses. change: of all numbers, in the order of `scales`."""
        stepped, start = list(sites), 0
        for k, scale in scales.items():
            own = change[start : start + len(scale)]
            stepped[k] = arrangement.movables[k].light.stepped(stepped[k], own * scale)
            start += len(scale)
        return stepped

    def _slopes(
        self, arrangement: Arrangement, at: ViewPaths, scales: Mapping[int, Doubles], step: float
    ) -> Slopes:
        """Return slopes of columns by all numbers of poses, in the order of `scales`."""
        ahead: list[Site] = []
        owners: list[int] = []
        places: list[int] = []
        widths: list[float] = []
        numbers = [(k, j) for k, scale in scales.items() for j in range(len(scale))]
        for q, (k, j) in enumerate(numbers):
            movable, site = arrangement.movables[k], arrangement.sites[k]
            change = np.zeros(len(scales[k]))
            change[j] = step * scales[k][j]
            new_site, width = movable.light.stepped(site, change), step
            if new_site == site:
                # At a bound, use the opposite difference.
                new_site, width = movable.light.stepped(site, -change), -step
            ahead += movable.sites(new_site)
            owners += movable.columns
            places += [q] * len(movable.columns)
            widths += [width] * len(movable.columns)
        slopes = at.columns(ahead)
        slopes -= arrangement.fitted.columns[owners][:, :, : slopes.shape[2]]
        slopes /= np.array(widths, np.float32)[:, None, None]
        return Slopes(slopes, owners, places)

    def _all_scales(
        self, arrangement: Arrangement, moving: Sequence[int] | None
    ) -> dict[int, Doubles]:
        """Return the scales of each movable that moves; all of them for None."""
        every = range(len(arrangement.movables)) if moving is None else moving
        return {k: self._scales(arrangement.movables[k].light, arrangement.sites[k]) for k in every}

    def _scales(self, light: FreeLight, site: Site) -> Doubles:
        """Return the amounts of a pose's numbers that are equivalent to sliding by one unit."""
        place, turn, cone = light.dimensions(site)
        return np.array([1.0] * place + [1 / self._unit] * (turn + cone))


def _diagonal(matrix: Doubles) -> Doubles:
    """Return the diagonal, without zeros."""
    return np.asarray(np.diag(matrix) + 1e-9 * np.trace(matrix) + 1e-300)


def _scaled(site: Site, factor: float) -> Site:
    """Return a panel of `factor` times its side, or a spot of as wide a circle from so far."""
    if isinstance(site, PanelSite):
        return replace(site, side=factor * site.side)
    cutoff, beam = (
        math.degrees(math.atan(math.tan(math.radians(angle or 0.0)) / factor))
        for angle in (site.cutoff, site.beam)
    )
    return replace(site, cutoff=cutoff, beam=beam)


def _size(site: Site) -> list[float]:
    """Return the side of a panel, or the cone of a spot."""
    return [site.side] if isinstance(site, PanelSite) else [site.cutoff or 0.0]
