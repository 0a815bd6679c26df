"""The judgement of which moves and new lights are worth it, with error bars of their places.

Weights are fitted along some paths and judged along others, which no pose was fitted to. Places are
fitted again along each set of other paths, to one half of the basis's samples, and their spread is
the error bar; an error bar from the derivatives alone would be too optimistic.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.placement.lights_to_place import Arrangement, all_sites, by_column
from lightpaint.placement.paths.view_paths import SearchPaths, ViewPaths
from lightpaint.placement.placement_fit import Fitted, PlacementFit
from lightpaint.placement.search.pose_steps import PoseSteps
from lightpaint.scene.properties.site import Site

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

#: Steps of a fit along other paths, and their initial differences, relative to the differences of a
#: search.
REFIT_STEPS, REFIT_SHARE = 3, 0.5


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


@dataclass(frozen=True)
class ArrangementError:
    """Errors of an arrangement.

    poses: of each movable. levels: (n, 3), standard deviations of the weights by errors of poses,
    relative to the weights; the root mean square of all looks.
    """

    poses: Sequence[PoseError]
    levels: Doubles


class _ErrorsOfChanges:
    """The error with some of the changes from `start` to `best`.

    paths: those that weights are fitted on, and the others.
    changed: (k,), which movables of `best` have moved or are new.
    """

    def __init__(
        self, fit: PlacementFit, start: Arrangement, best: Arrangement, paths: Sequence[ViewPaths]
    ) -> None:
        self._fit, self._movables = fit, best.movables
        self._columns = [
            [
                by_column(its.movables, at.columns(all_sites(its.movables, its.sites)))
                for at in paths
            ]
            for its in (start, best)
        ]
        old = len(start.movables)
        self.changed = np.array(
            [k >= old or site != start.sites[k] for k, site in enumerate(best.sites)], dtype=bool
        )

    def missed(self, changed: Bools) -> Doubles:
        """Return the error of pixels with some of the changes, along each of the paths, (2, p)."""
        columns = []
        for old, new in zip(*self._columns, strict=True):
            mixed = {
                column: new[column] if is_changed else old.get(column, 0 * new[column])
                for movable, is_changed in zip(self._movables, changed, strict=True)
                for column in movable.columns
            }
            columns.append(self._fit.replaced(mixed))
        weights = self._fit.fitted(columns[0]).weights
        return np.stack([self._fit.missed_map(its, weights) for its in columns])


class PlacementJudge:
    """A judge of arrangements."""

    def __init__(self, fit: PlacementFit, steps: PoseSteps, paths: SearchPaths) -> None:
        self._fit, self._steps, self._paths = fit, steps, paths

    @property
    def _both(self) -> tuple[ViewPaths, ViewPaths]:
        """The paths that weights are fitted on, and the others."""
        return self._paths.refine, self._paths.judge

    def without_noise(self, best: Arrangement) -> "PlacementJudge":
        """Return a judge with more paths in pixels that are nothing but noise for these lights.

        It leaves out those that still are. A loss from which noise is subtracted is right on
        average, but a search would look for the places where it is too small by chance.
        """
        noisy = self._noisy_pixels(best)
        if not noisy.any():
            return self
        paths = self._paths.with_more_hits(noisy)
        still_noisy = PlacementJudge(self._fit, self._steps, paths)._noisy_pixels(best)
        fit = self._fit.without_pixels(still_noisy)
        return PlacementJudge(fit, self._steps.with_fit(fit), paths)

    def _noisy_pixels(self, best: Arrangement) -> Bools:
        noisy = [self._fit.noisy_pixels(fitted) for fitted in self._along_both(best)]
        return np.asarray(np.any(noisy, axis=0))

    def _along_both(self, arrangement: Arrangement) -> list[Fitted]:
        its = arrangement
        return [self._steps.fitted(its.movables, its.sites, at) for at in self._both]

    def refined(
        self, best: Arrangement, steps: int, *, progress: Callable[[], None]
    ) -> Arrangement:
        """Return the arrangement after the last steps, on the film of the judgement."""
        at = self._paths.refine
        start = self._steps.refitted(best, at)
        best = self._steps.descend(start, at, steps, first_share=REFIT_SHARE, progress=progress)
        slid = self._steps.slid(best, at)
        if slid is best:
            return best
        return self._steps.descend(slid, at, REFIT_STEPS, first_share=REFIT_SHARE)

    def worthwhile(self, start: Arrangement, best: Arrangement) -> Found:
        """Return `best` with its worthwhile changes alone. Its first movables are the movables of
        `start`.

        The change with the least gain goes first, since others may take over what it did.
        """
        errors = _ErrorsOfChanges(self._fit, start, best, self._both)
        changed, gains = errors.changed.copy(), np.zeros(len(best.movables))
        before, after = errors.missed(np.zeros_like(changed)), errors.missed(changed)
        while changed.any():
            lost = {}
            for k in np.flatnonzero(changed):
                without = changed.copy()
                without[k] = False
                lost[int(k)] = errors.missed(without) - after
                gains[k] = float(lost[int(k)][1].sum())
            least = min(lost, key=lambda k: gains[k])
            if gains[least] >= self._least_gain(lost[least], after + lost[least]):
                break
            changed[least], gains[least] = False, 0.0
            after = errors.missed(changed)
        # Where the estimate of the noise is too large, less than nothing is missed.
        norm2, rest = self._fit.norm2 or 1.0, max(float(after[1].sum()), 0.0)
        error = rest + max(float((before - after)[1].sum()), 0.0)
        reported = (np.arange(len(changed)) < len(start.movables)) | changed
        shares = tuple((gains[reported] / max(error, 1e-300)).tolist())
        kept = self._with_changes(start, best, changed)
        return Found(kept, shares, error / norm2, rest / norm2)

    def _least_gain(self, lost: Doubles, without: Doubles) -> float:
        """Return the least error that a change has to remove to be worth it.

        lost: (2, p), the error that it removes; without: the same without it, with all other
        changes. Its share counts against that, and not against the error before all changes, or one
        bright light would make all others negligible.
        """
        missed = max(float(without[1].sum()), 0.0)
        return max(WORTH * missed, SURE * standard_error(lost), NOTHING * self._fit.norm2)

    def worth(self, before: Arrangement, after: Arrangement) -> float:
        """Return the gain of the last light on paths that nothing was fitted to, relative to the
        least that is worth it.
        """
        if after.missed >= before.missed:
            return 0.0
        judge, maps = self.without_noise(after), []
        for its in (before, after):
            fitted, judged = judge._along_both(its)
            weights = fitted.weights
            maps.append([judge._fit.missed_map(x.columns, weights) for x in (fitted, judged)])
        gain = np.array(maps[0]) - np.array(maps[1])
        least = self._least_gain(gain, np.array(maps[0]))
        # Noise of painting and basis is the same for all paths. It is independent between pixels,
        # and a search fits some of it by chance.
        usual = np.sort(maps[0][1])[: max(1, round(USUAL_SHARE * len(maps[0][1])))]
        least = max(least, BY_CHANCE * float(usual.mean()))
        return float(gain[1].sum() - gain[1].max()) / max(least, 1e-300)

    def missed(self, arrangement: Arrangement) -> float:
        """Return the error on paths that weights were not fitted to."""
        fitted, judged = self._along_both(arrangement)
        return float(self._fit.missed_map(judged.columns, fitted.weights).sum())

    def errors(self, best: Arrangement) -> ArrangementError:
        """Return the spread of poses between fits along independent paths.

        All fits share the basis, whose noise moves poses, too. So two fits more take one half of
        the basis's samples each. They differ from the first by d and -d, the effect of the half
        difference; the variance is d². All share the painting, too, whose noise moves poses by what
        derivatives say.
        """
        fits: list[Sequence[Site]] = [best.sites]
        for sign, other in ((1, self._paths.judge), (-1, self._paths.spread)):
            steps = self._steps.with_fit(self._fit.of_half(sign))
            fits.append(steps.refit(best, self._paths.refine, other))
        ends, by_paintings = self._steps.scatter_by_paintings(best, self._paths.refine)
        poses = [
            _error(
                [sites[k] for sites in fits],
                [(above[k], below[k]) for above, below in ends],
                best.movables[k].light.freedom.slides,
            )
            for k in range(len(best.movables))
        ]
        # The same paths and samples at all poses: what levels do by the poses alone.
        levels = [self._steps.fitted(best.movables, x, self._paths.refine).weights for x in fits]
        return ArrangementError(poses, _level_errors(np.array(levels), by_paintings))

    def growth(self, best: Arrangement, order: Sequence[int]) -> list[Growth]:
        """Return the best lighting with none of the new lights, with the first, and so on.

        order: of these movables.
        """
        columns = [
            by_column(best.movables, at.columns(all_sites(best.movables, best.sites)))
            for at in self._both
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


def _level_errors(weights: Doubles, by_paintings: Doubles) -> Doubles:
    """Return relative deviations of levels, (n, 3).

    weights: (fits, n, channels of all looks). by_paintings: (n, channels), independent deviations.
    """
    mean, spread = weights.mean(axis=0), FEW_FITS * weights.std(axis=0, ddof=1)
    deviation = np.hypot(spread, by_paintings)
    relative = np.divide(deviation, mean, out=np.zeros_like(mean), where=mean > 0)
    looks = relative.reshape(len(mean), -1, 3)
    return np.asarray(np.sqrt(np.square(looks).mean(axis=1)))


def _error(sites: Sequence[Site], ends: Sequence[tuple[Site, Site]], slides: bool) -> PoseError:
    """Return the spread of the poses of one light in several fits, and between the ends of its
    scatter by paintings.
    """
    place = turn = None
    if slides and sites[0].position is not None:
        places = np.array([site.position for site in sites], dtype=float)
        squares = np.square(places - places.mean(axis=0)).sum() / (len(sites) - 1)
        sides = np.array([[x.position for x in pair] for pair in ends], dtype=float)
        by_paintings = np.square(sides[:, 0] - sides[:, 1]).sum() / 4 if ends else 0.0
        place = math.sqrt(FEW_FITS**2 * float(squares) + float(by_paintings))
    if sites[0].direction is not None:
        axes = np.array([site.direction for site in sites], dtype=float)
        mean = axes.mean(axis=0) / max(float(np.linalg.norm(axes.mean(axis=0))), 1e-12)
        squares = np.square(_angles(axes, mean)).sum() / (len(sites) - 1)
        sides = np.array([[x.direction for x in pair] for pair in ends], dtype=float)
        by_paintings = np.square(_angles(*np.moveaxis(sides, 1, 0)) / 2).sum() if ends else 0.0
        turn = math.degrees(math.sqrt(FEW_FITS**2 * float(squares) + float(by_paintings)))
    return PoseError(place, turn)


def _angles(axes: Doubles, others: Doubles) -> Doubles:
    """Return the angles between directions, (k, 3), and others or another, (k,) radians."""
    return np.asarray(np.arccos(np.clip((axes * others).sum(axis=-1), -1, 1)))


def standard_error(differences: Doubles) -> float:
    """Return the standard error of a sum over pixels, (2, p), from two sets of paths.

    They share the signal, and have independent noise at each pixel.
    """
    return float(np.sqrt(np.square(differences[0] - differences[1]).sum() / 2))
