"""The judgement of which moves and new lights are worth it, with error bars of their places.

Weights are fitted along some paths and judged along others, which no pose was fitted to. Places are
fitted again along each set of other paths, and their spread is the error bar; an error bar from the
derivatives alone would be too optimistic.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.placement.movable import Arrangement, all_sites, by_column
from lightpaint.placement.paths.view_paths import SearchPaths, ViewPaths
from lightpaint.placement.placement_fit import PlacementFit
from lightpaint.placement.search.pose_steps import PoseSteps
from lightpaint.scene.properties.pose import Site

#: Least gain of a move or a new light, as a share of the error, and in standard errors.
WORTH, SURE = 0.01, 3.0

#: Number of pixels whose noise one light, tried at many places, can explain by chance; and the
#: share of pixels whose error is pure noise if nothing else is missed.
BY_CHANCE, USUAL_SHARE = 24, 0.9

#: Share of ‖Ψ‖² that is negligible.
NOTHING = 1e-4

#: Ratio of Student's t with two degrees of freedom to a normal deviate, at one standard error: the
#: factor by which a spread of three fits may be too small.
FEW_FITS = 1.3213

#: Steps of a fit along other paths, and their initial differences, relative to those of a search.
REFIT_STEPS, REFIT_SHARE = 5, 0.5


@dataclass(frozen=True)
class Found:
    """A judged arrangement.

    arrangement: with its moves and new lights; lights not worth moving are back in place. gains:
    the share of the error that each movable removes, besides the others; 0 without a move. before,
    after: error as a share of ‖Ψ‖², on paths that no pose was fitted to.
    """

    arrangement: Arrangement
    gains: tuple[float, ...]
    before: float
    after: float


@dataclass(frozen=True)
class Growth:
    """The best lighting with some of the new lights, and all moves.

    missed: error as a share of ‖Ψ‖², on paths that no pose was fitted to. picture: (p, 3) linear,
    of the first look, all views.
    """

    missed: float
    picture: Floats


@dataclass(frozen=True)
class PoseError:
    """Standard errors of a pose: of its place, in units of the scene, and of its direction.

    Degrees; None for a light without a direction, or one that does not change.
    """

    place: float | None
    turn: float | None


class PlacementJudge:
    """A judge of arrangements."""

    def __init__(self, fit: PlacementFit, steps: PoseSteps, paths: SearchPaths) -> None:
        self._fit, self._steps, self._paths = fit, steps, paths

    def refined(
        self, best: Arrangement, steps: int, *, progress: Callable[[], None]
    ) -> Arrangement:
        """Return the arrangement after the last steps, on the film of the judgement."""
        at = self._paths.refine
        start = self._steps.refitted(best, at)
        return self._steps.descend(start, at, steps, first_share=REFIT_SHARE, progress=progress)

    def judged(self, start: Arrangement, best: Arrangement) -> Found:
        """Return the worthwhile changes of `best`, whose first movables are those of `start`."""
        movables, count_before = best.movables, len(start.movables)
        alternatives = [
            self._changes(start, best, at) for at in (self._paths.refine, self._paths.judge)
        ]

        def missed(changed: Bools) -> Doubles:
            """Return the error with some of the changes, (2, p).

            The rows are for the paths that weights are fitted on, and for the others.
            """
            columns = []
            for old, new in alternatives:
                changed_columns = self._fit.columns.copy()
                for k, movable in enumerate(movables):
                    for column in movable.columns:
                        changed_columns[column] = new[column] if changed[k] else old.get(column, 0)
                columns.append(changed_columns)
            weights = self._fit.fitted(columns[0]).weights
            return np.stack(
                [self._fit.missed_map(changed_columns, weights) for changed_columns in columns]
            )

        def is_worth(lost: Doubles) -> bool:
            """Return whether an error that a change removes, (2, p), is surely worth it."""
            return float(lost[1].sum()) >= max(WORTH * total, SURE * standard_error(lost))

        moved = [k >= count_before or x != start.sites[k] for k, x in enumerate(best.sites)]
        changed = np.array(moved, dtype=bool)
        before = missed(np.zeros(len(movables), dtype=bool))
        total, gains = float(before[1].sum()), np.zeros(len(movables))
        after = missed(changed)
        while changed.any():
            lost = {}
            for k in np.flatnonzero(changed):
                without = changed.copy()
                without[k] = False
                lost[int(k)] = missed(without) - after
                gains[k] = float(lost[int(k)][1].sum())
            least = min(lost, key=lambda k: gains[k])
            if is_worth(lost[least]):
                break
            changed[least], gains[least] = False, 0.0
            after = missed(changed)
        norm2 = self._fit.norm2 or 1.0
        # Where the estimate of the noise is too large, less than nothing is missed.
        rest = max(float(after[1].sum()), 0.0)
        error = rest + max(total - float(after[1].sum()), 0.0)
        reported = (np.arange(len(movables)) < count_before) | changed
        return Found(
            self._with_changes(start, best, changed),
            tuple((gains[reported] / max(error, 1e-300)).tolist()),
            error / norm2,
            rest / norm2,
        )

    def is_worth(self, before: Arrangement, after: Arrangement) -> bool:
        """Return whether the last light has enough gain on paths that nothing was fitted to."""
        if after.missed >= before.missed:
            return False
        maps = []
        for its in (before, after):
            fitted, judged = (
                self._steps.fitted(its.movables, its.sites, at)
                for at in (self._paths.refine, self._paths.judge)
            )
            maps.append(
                [
                    self._fit.missed_map(columns, fitted.weights)
                    for columns in (fitted.columns, judged.columns)
                ]
            )
        gain = np.array(maps[0]) - np.array(maps[1])
        least = max(
            WORTH * float(maps[0][1].sum()),
            SURE * standard_error(gain),
            NOTHING * self._fit.norm2,
        )
        # Noise of painting and basis is the same for all paths. It is independent between pixels,
        # and a search fits some of it by chance.
        usual = np.sort(maps[0][1])[: max(1, round(USUAL_SHARE * len(maps[0][1])))]
        least = max(least, BY_CHANCE * float(usual.mean()))
        return float(gain[1].sum() - gain[1].max()) >= least

    def errors(self, best: Arrangement) -> list[PoseError]:
        """Return the spread of each pose between fits along independent paths."""
        fits = [best.sites]
        for at in (self._paths.judge, self._paths.spread):
            start = self._steps.refitted(best, at)
            refit = self._steps.descend(start, at, REFIT_STEPS, first_share=REFIT_SHARE)
            fits.append(refit.sites)
        return [
            _error([sites[k] for sites in fits], best.movables[k].light.freedom.slides)
            for k in range(len(best.movables))
        ]

    def growth(self, best: Arrangement, order: Sequence[int]) -> list[Growth]:
        """Return the best lighting with none of the new lights, with the first, and so on.

        order: of these movables.
        """
        paths = (self._paths.refine, self._paths.judge)
        columns = [
            by_column(best.movables, at.columns(all_sites(best.movables, best.sites)))
            for at in paths
        ]
        stages = []
        for count in range(len(order) + 1):
            left_out = {c for k in order[count:] for c in best.movables[k].columns}
            fitted, judged = (
                self._fit.replaced({c: x * (c not in left_out) for c, x in stage_columns.items()})
                for stage_columns in columns
            )
            weights = self._fit.fitted(fitted).weights
            missed = float(self._fit.missed_map(judged, weights).sum())
            picture = self._fit.picture(fitted, weights)[:, :3].astype(np.float32)
            stages.append(Growth(missed / (self._fit.norm2 or 1.0), picture))
        return stages

    def _changes(
        self, start: Arrangement, best: Arrangement, at: ViewPaths
    ) -> tuple[dict[int, Floats], dict[int, Floats]]:
        """Return columns before and after, by their indices."""
        changes = []
        for arrangement in (start, best):
            columns = at.columns(all_sites(arrangement.movables, arrangement.sites))
            changes.append(dict(by_column(arrangement.movables, columns)))
        return changes[0], changes[1]

    def _with_changes(self, start: Arrangement, best: Arrangement, changed: Bools) -> Arrangement:
        """Return `best` without unchanged lights."""
        movables, sites = [], []
        for k, (movable, site) in enumerate(zip(best.movables, best.sites, strict=True)):
            if changed[k]:
                movables.append(movable)
                sites.append(site)
            elif k < len(start.movables):
                movables.append(movable)
                sites.append(start.sites[k])
        fitted = self._steps.fitted(movables, sites, self._paths.refine)
        return Arrangement(tuple(movables), tuple(sites), fitted)


def _error(sites: Sequence[Site], slides: bool) -> PoseError:
    """Return the spread of the poses of one light in several fits."""
    place = turn = None
    if slides and sites[0].position is not None:
        places = np.array([site.position for site in sites], dtype=float)
        squares = np.square(places - places.mean(axis=0)).sum() / (len(sites) - 1)
        place = FEW_FITS * math.sqrt(float(squares))
    if sites[0].direction is not None:
        axes = np.array([site.direction for site in sites], dtype=float)
        mean = axes.mean(axis=0) / max(float(np.linalg.norm(axes.mean(axis=0))), 1e-12)
        angles = np.arccos(np.clip(axes @ mean, -1, 1))
        squares = np.square(angles).sum() / (len(sites) - 1)
        turn = FEW_FITS * math.degrees(math.sqrt(float(squares)))
    return PoseError(place, turn)


def standard_error(differences: Doubles) -> float:
    """Return the standard error of a sum over pixels, (2, p), from two sets of paths.

    They share the signal, and have independent noise at each pixel.
    """
    return float(np.sqrt(np.square(differences[0] - differences[1]).sum() / 2))
