"""The convex solve inside a search for places: the best lighting for some columns.

The search is over places only: for each choice of places, the usual solve gives the best weights
under the constraints. So a search has few unknowns, and no bad starts in weights.

Columns are the images of all lights at unit emission, (n, q, 3). A new panel is a thing in the
room: it hides what is behind it, whichever side the camera sees. So if there are panels, columns
have a fourth channel, the share of each pixel that their panel hides; it is 0 for other lights.

Noise of columns adds to the error, more at some places than at others, and would draw lights to
places with clean columns. So columns come with half the differences of two independent halves,
whose squares are the variance of the columns, and the loss subtracts this noise.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from lightpaint import lighting
from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.basis import Basis, BasisLight, Planes
from lightpaint.images import block_mean
from lightpaint.placement.look_goals import LookGoal, balanced, goal_of

#: Share of a column that others cannot replace, below which it counts as none.
LEAST_OWN = 1e-3

#: Noise of a pixel, as a share of ‖Ψ‖², above which the pixel tells nothing.
NOISY = 1e-3

#: Ridge of a matrix that is inverted for errors, relative to its diagonal.
ERROR_RIDGE = 1e-6

#: Largest share of a pixel's noise that a fit may take, for the noise of its residual.
MAX_LEVERAGE = 0.8


@dataclass(frozen=True)
class Fitted:
    """The best weights for some columns. weights: (n, c). missed: the loss, and the pull."""

    columns: Floats
    weights: Doubles
    missed: float


@dataclass(frozen=True)
class Slopes:
    """Derivatives of columns by numbers of poses.

    values: (s, p or 2 p, 3 or 4), shaped like columns. owners: the index of each one's column.
    numbers: the index of its number, which several columns may share.
    """

    values: Floats
    owners: Sequence[int]
    numbers: Sequence[int]


@dataclass(frozen=True)
class Ranking:
    """A measure of candidates for a light's place.

    It has the residual without that light, and the columns of other lights that may compensate for
    it.

    root: (p, c), square root of importance; residual: (p, c), weighted with it. others, inverses:
    for each channel the weighted columns (k, p), and the inverse of their inner products.
    """

    root: Floats
    residual: Floats
    others: Sequence[Floats]
    inverses: Sequence[Floats]

    def gain(self, c: int, reached: Floats, cross: Floats, power: Floats) -> Floats:
        """Return the gain in a channel, (k,).

        reached, power: (k,), inner products of candidates with the residual and themselves; cross:
        (k, others), with the columns of others.
        """
        alone = power - np.einsum("ki,ki->k", cross @ self.inverses[c], cross)
        # If others can replace it almost completely, its gain is lost in noise.
        is_own = alone > LEAST_OWN * power
        squares = np.square(np.maximum(reached, 0))
        gain: Floats = np.divide(squares, alone, out=np.zeros_like(power), where=is_own)
        return gain

    def at(self, pixels: Indices) -> "Ranking":
        """Return the ranking for candidates with columns at some pixels only, (v,)."""
        return replace(
            self,
            root=self.root[pixels],
            residual=self.residual[pixels],
            others=[other_columns[:, pixels] for other_columns in self.others],
        )


@dataclass(frozen=True)
class PaintingScatter:
    """The scatter of poses by the noise of paintings.

    covariance: (q, q), of the numbers of poses. levels: (n, c), standard deviations of the weights
    that follow the poses.
    """

    covariance: Doubles
    levels: Doubles


class PlacementFit:
    """Goals on a small film, and the columns of all lights at their current places.

    The loss is Σ D (r² − n²), where r is the residual and n its half difference: the loss of the
    goal, as far as it is the current look, less the mix of the half differences of the columns.

    Looks that share places have separate weights, so they act as further channels: 3 for each look,
    which share the columns. So a search does not deal with looks. A look counts by its relative
    error, whether it is bright or dark.

    columns: (n, 2 p, 3) at unit emission, images and then half differences, or images alone,
    (n, p, 3); with panels among them (…, 4). goals: of each look. sizes: of the film of each view,
    for the noise of paintings; it is unknown without them.
    """

    def __init__(
        self, columns: Floats, goals: Sequence[LookGoal], sizes: Sequence[tuple[int, int]] = ()
    ) -> None:
        self.columns, self._looks, self._sizes = columns, balanced(goals), tuple(sizes)
        importance = np.concatenate([look.importance for look in self._looks], axis=1)
        self._root = np.sqrt(importance.astype(np.float64))
        self._goal = np.concatenate([look.goal for look in self._looks], axis=1) * self._root
        self._goal_noise = np.concatenate([look.noise for look in self._looks], axis=1) * self._root
        self.norm2 = float(np.square(self._goal).sum())

    @property
    def channels(self) -> range:
        """All channels of all looks; channel c is of the columns' channel c % 3."""
        return range(self._root.shape[1])

    @property
    def pixels(self) -> int:
        """The number p of pixels."""
        return len(self._root)

    def without_pixels(self, left_out: Bools) -> "PlacementFit":
        """Return the fit without some pixels, (p,), of which lights may do what they like."""
        fit = copy(self)
        seen = ~left_out[:, None]
        fit._root, fit._goal = self._root * seen, self._goal * seen
        fit._goal_noise = self._goal_noise * seen[: len(self._goal_noise)]
        return fit

    def of_half(self, sign: int) -> "PlacementFit":
        """Return the fit to columns of one half of the basis's samples, 1 or -1.

        Noise of a half has √2 times the deviation of the noise of both.
        """
        fit, p = copy(self), self.pixels
        half = self.columns[:, p:, :3]
        if half.size:
            fit.columns = self.columns.copy()
            fit.columns[:, :p, :3] += sign * half
            fit.columns[:, p:, :3] *= math.sqrt(2)
        if len(self._goal_noise):
            fit._goal = self._goal + sign * self._goal_noise
            fit._goal_noise = math.sqrt(2) * self._goal_noise
        return fit

    def replaced(self, changed: Mapping[int, Floats]) -> Floats:
        """Return the columns, with the columns of some lights replaced by (q, 3)."""
        return with_columns(self.columns, changed)

    def fitted(self, columns: Floats) -> Fitted:
        """Return the best weights for `columns`, under the constraints of each look."""
        all_weights, missed = [], 0.0
        seen = seen_columns(columns)
        for k, look in enumerate(self._looks):
            equations, reduction = self._equations(seen, k), look.reduction
            x = np.zeros(len(reduction.unknowns))
            for problem in lighting.reduced_problems(equations, reduction):
                x[problem.unknowns] = lighting.minimise(
                    problem.M,
                    problem.b,
                    lower=problem.lower,
                    upper=problem.upper,
                    caps=problem.caps,
                ).x
            weights = reduction.weights(x)
            all_weights.append(weights)
            # As `NormalEquations.objective`, but the loss may be negative by noise.
            missed += equations.target_norm2.sum()
            missed += float((weights.T * (equations.gradient(weights).T - equations.b)).sum())
        return Fitted(columns, np.concatenate(all_weights, axis=1), missed)

    def picture(self, columns: Floats, weights: Doubles) -> Doubles:
        """Return Σ w_i Φ_i in all channels, (p, c)."""
        return self._mixed(columns[:, : self.pixels], weights)

    def _noise(self, columns: Floats, weights: Doubles) -> Doubles:
        """Return the half difference of the residual, (p, c); without any, (0, c)."""
        mixed = self._mixed(columns[:, self.pixels :], weights)
        return np.asarray(self._goal_noise[: len(mixed)] - mixed * self._root[: len(mixed)])

    def _mixed(self, columns: Floats, weights: Doubles) -> Doubles:
        looks = [weights[:, 3 * k : 3 * k + 3] for k in range(len(self._looks))]
        seen = seen_columns(columns)
        return np.concatenate([np.einsum("npc,nc->pc", seen, look) for look in looks], axis=1)

    def missed_map(self, columns: Floats, weights: Doubles) -> Doubles:
        """Return the loss of each pixel, (p,), with weights that were found on other paths."""
        missed = np.square(self._residual(columns, weights)).sum(axis=1)
        noise = np.square(self._noise(columns, weights)).sum(axis=1)
        return np.asarray(missed - noise if len(noise) else missed)

    def noisy_pixels(self, fitted: Fitted) -> Bools:
        """Return which pixels, (p,), have so much noise that they hide what all others tell.

        Where a light is close to an edge that is seen in few pixels, these are bright, and their
        few paths meet the light by chance.
        """
        noise = np.square(self._noise(fitted.columns, fitted.weights)).sum(axis=1)
        return np.asarray(np.resize(noise > NOISY * self.norm2, self.pixels))

    def ranking(self, fitted: Fitted) -> "Ranking":
        """Return the ranking of candidates for the place of a light that is not in `fitted`."""
        others, inverses, columns = [], [], seen_columns(fitted.columns)
        for c in self.channels:
            free = self._free(fitted.weights, c)
            weighted = (columns[free, : self.pixels, c % 3] * self._root[:, c]).astype(np.float32)
            power = (weighted @ weighted.T).astype(np.float64)
            others.append(weighted)
            inverses.append(np.linalg.pinv(power, rcond=1e-8, hermitian=True).astype(np.float32))
        residual = self._residual(fitted.columns, fitted.weights)
        return Ranking(self._root.astype(np.float32), residual.astype(np.float32), others, inverses)

    def newton(
        self, fitted: Fitted, slopes: Slopes, there: Fitted | None = None
    ) -> tuple[Doubles, Doubles]:
        """Return Gauss-Newton matrix (q, q) and gradient (q,), the weights eliminated.

        slopes: at the same poses. there: the lighting along other paths, whose gradient it is.
        """
        if there is None:
            residual = self._residual(fitted.columns, fitted.weights)
            # Half differences act like pixels that count negatively.
            residual = np.concatenate([residual, -self._noise(fitted.columns, fitted.weights)])
        else:
            residual = self._residual(there.columns, there.weights)
            residual = np.resize(residual, (fitted.columns.shape[1], residual.shape[1]))
            residual[self.pixels :] = 0
        p, count = self.pixels, max(slopes.numbers) + 1
        matrix, gradient = np.zeros((count, count)), np.zeros(count)
        columns = seen_columns(fitted.columns)
        for c in self.channels:
            jacobian = self._jacobian(fitted, slopes, c)
            _, active = self._active(columns, fitted.weights, c)
            gradient += jacobian @ residual[:, c]
            jacobian = jacobian[:, :p]
            matrix += jacobian @ jacobian.T
            if len(active):
                reached, active = active @ residual[:, c], active[:, :p]
                cross = jacobian @ active.T
                inverse = np.linalg.pinv(active @ active.T, rcond=1e-9, hermitian=True)
                matrix -= cross @ inverse @ cross.T
                gradient -= cross @ (inverse @ reached)
        return matrix, gradient

    def scatter_by_paintings(self, fitted: Fitted, slopes: Slopes) -> PaintingScatter:
        """Return the scatter of poses and weights by the noise of paintings.

        The noise τ moves the poses by H⁻¹ Σ s τ, with the Gauss-Newton matrix H and the slopes s of
        the picture, less what weights make up for.
        """
        matrix, _ = self.newton(fitted, slopes)
        ridge = np.diag(matrix) + ERROR_RIDGE * np.trace(matrix) + 1e-300
        inverse = np.linalg.inv(matrix + ERROR_RIDGE * np.diag(ridge))
        covariance, responses = np.zeros(matrix.shape), []
        for k in range(len(self._looks)):
            its = range(3 * k, 3 * k + 3)
            parts = [self._slopes_beside_weights(fitted, slopes, c) for c in its]
            rows = np.stack([part.rows for part in parts], axis=1)  # (q, 3, p)
            taken = np.mean([part.leverage for part in parts], axis=0)
            taken += np.einsum("qcp,qr,rcp->p", rows, inverse, rows, optimize=True)
            # The residual of a pixel lacks what the fit took of its noise (MacKinnon and White
            # 1985, HC3).
            rows /= 1 - np.minimum(taken, MAX_LEVERAGE)
            covariance += self._covariance_by_painting(fitted, rows, its)
            responses += [part.response for part in parts]
        covariance = inverse @ covariance @ inverse
        variances = [np.einsum("iq,qr,ir->i", x, covariance, x) for x in responses]
        return PaintingScatter(covariance, np.sqrt(np.maximum(variances, 0)).T)

    def _covariance_by_painting(self, fitted: Fitted, rows: Doubles, its: range) -> Doubles:
        """Return the covariance of sums over the noise of a painting, (q, q).

        rows: (q, 3, p), their factors. its: the channels of the look.
        """
        residual = self._residual(fitted.columns, fitted.weights)[:, its]
        noise = self._noise(fitted.columns, fitted.weights)[:, its]
        noise, counted = np.resize(noise, residual.shape), np.any(self._root[:, its], axis=1)
        covariance, end = np.zeros((len(rows), len(rows))), 0
        for size in self._sizes:
            view, end = slice(end, end + math.prod(size)), end + math.prod(size)
            covariance += lighting.covariance_of_sums(
                residual[view].T.reshape(3, *size),
                noise[view].T.reshape(3, *size),
                rows[..., view].reshape(len(rows), 3, *size),
                counted[view].reshape(size),
            )
        return covariance

    def _slopes_beside_weights(self, fitted: Fitted, slopes: Slopes, c: int) -> "_FreeSlopes":
        """Return the slopes of the picture in a channel with the weights that follow."""
        p = self.pixels
        jacobian = self._jacobian(fitted, slopes, c)[:, :p]
        free, active = self._active(seen_columns(fitted.columns)[:, :p], fitted.weights, c)
        inverse = np.linalg.pinv(active @ active.T, rcond=1e-9, hermitian=True)
        response = np.zeros((len(free), len(jacobian)))
        response[free] = -inverse @ (active @ jacobian.T)
        leverage = np.einsum("ip,ij,jp->p", active, inverse, active, optimize=True)
        return _FreeSlopes(jacobian + response[free].T @ active, response, leverage)

    def _jacobian(self, fitted: Fitted, slopes: Slopes, c: int) -> Doubles:
        """Return weighted slopes of the picture in a channel by numbers of poses, (count, q)."""
        own = picture_slopes(fitted.columns, fitted.weights, slopes.values, slopes.owners, c)
        root = np.resize(self._root[:, c], own.shape[1])
        jacobian = np.zeros((max(slopes.numbers) + 1, own.shape[1]))
        for number, row in zip(slopes.numbers, root * own, strict=True):
            jacobian[number] += row
        return jacobian

    def _active(self, columns: Floats, weights: Doubles, c: int) -> tuple[Bools, Doubles]:
        """Return which lights shine in a channel and may change, (n,), and their weighted columns,
        (free lights, q). columns: (n, q, 3), as seen.
        """
        free, root = self._free(weights, c), np.resize(self._root[:, c], columns.shape[1])
        return free, np.asarray(columns[free, :, c % 3] * root, np.float64)

    def _free(self, weights: Doubles, c: int) -> Bools:
        """Return which lights shine in a channel and may change, (n,)."""
        free = weights[:, c] > 0
        fixed = self._looks[c // 3].reduction.fixed_weights
        free[[k for k, knob in enumerate(fixed) if knob.any()]] = False
        return np.asarray(free)

    def _residual(self, columns: Floats, weights: Doubles) -> Doubles:
        return np.asarray(self._goal - self.picture(columns, weights) * self._root)

    def _equations(self, columns: Floats, k: int) -> lighting.NormalEquations:
        """Return the equations of look k."""
        root, goal = (matrix[:, 3 * k : 3 * k + 3] for matrix in (self._root, self._goal))
        weighed, pull = columns[:, : self.pixels] * root, self._looks[k].pull
        b = np.einsum("ipc,pc->ci", weighed, goal)
        equations = lighting.NormalEquations(_products(weighed), b, np.square(goal).sum(axis=0))
        if (noise := columns[:, self.pixels :]).size:
            weighed, goal = noise * root, self._goal_noise[:, 3 * k : 3 * k + 3]
            equations = lighting.NormalEquations(
                lighting.denoised_matrix(equations, _products(weighed)),
                b - np.einsum("ipc,pc->ci", weighed, goal),
                equations.target_norm2 - np.square(goal).sum(axis=0),
            )
        return equations if pull is None else equations + pull


@dataclass(frozen=True)
class _FreeSlopes:
    """Slopes of the picture in a channel by numbers of poses, with the weights that follow.

    rows: (q, p), weighted. response: (n, q), slopes of the weights. leverage: (p,), the share of
    the noise of each pixel that weights take.
    """

    rows: Doubles
    response: Doubles
    leverage: Doubles


def _products(images: Floats | Doubles) -> Doubles:
    """Return inner products of images (n, p, 3) in each channel, (3, n, n)."""
    return np.asarray(np.einsum("ipc,jpc->cij", images, images, optimize=True))


def fit_of(
    bases: Sequence[Basis],
    looks: Sequence[tuple[lighting.Solution, Sequence[int]]],
    sizes: Sequence[tuple[int, int]],
    new: Sequence[BasisLight] = (),
    constraints: lighting.Constraints | None = None,
    *,
    with_panels: bool = False,
    with_noise: bool = True,
) -> PlacementFit:
    """Return the fit of the last linear problem of each look on small films, one of each view.

    looks: solutions, and for each of their views its place among `bases`. new: lights whose
    columns, behind the lights of the basis, are black as yet. constraints: on these alone, besides
    the constraints of the solutions that are for all lights. with_panels: whether panels move or
    are new, whose columns also say what they hide. with_noise: whether columns have half
    differences.
    """
    current = np.concatenate(
        [
            on_film
            for part in ("planes", "noise")[: 1 + with_noise]
            for on_film in _on_films([getattr(basis, part) for basis in bases], sizes)
        ],
        axis=1,
    )
    if with_panels:
        current = np.pad(current, ((0, 0), (0, 0), (0, 1)))
    black = np.zeros((len(new), *current.shape[1:]), np.float32)
    goals = [goal_of(solution, views, sizes, new, constraints) for solution, views in looks]
    return PlacementFit(np.concatenate([current, black]), goals, sizes)


def _on_films(planes: Sequence[Planes], sizes: Sequence[tuple[int, int]]) -> Iterator[Floats]:
    """Yield the planes of each view on a small film, (n, p, 3)."""
    for view_planes, size in zip(planes, sizes, strict=True):
        small = np.stack(
            [block_mean(plane, view_planes.size[0] // size[0]) for plane in view_planes]
        )
        yield small.reshape(len(small), -1, 3)


def with_columns(columns: Floats, changed: Mapping[int, Floats]) -> Floats:
    """Return columns, some of them replaced: by (q, 4), or by (q, 3), which hide nothing."""
    replaced = columns.copy()
    for k, column in changed.items():
        replaced[k, :, 3:] = 0
        replaced[k, :, : column.shape[1]] = column
    return replaced


def seen_columns(columns: Floats) -> Floats:
    """Return columns (n, q, 3) without what panels among them hide of the others."""
    if columns.shape[2] == 3:
        return columns
    return np.asarray(columns[:, :, :3] * _shown_shares(columns)[:, :, None])


def picture_slopes(
    columns: Floats, weights: Doubles, slopes: Floats, owners: Sequence[int], c: int
) -> Doubles:
    """Return slopes of the picture in channel c, (s, q), by slopes of columns.

    A panel that moves changes its own light, and hides other parts of what is behind it. weights:
    (n, c); slopes: (s, q, 3 or 4); owners: of each slope, the index of its column.
    """
    owned = np.array(owners)
    rows = slopes[:, :, c % 3] * weights[owned, c][:, None]
    if columns.shape[2] == 3:
        return np.asarray(rows)
    rows *= _shown_shares(columns)[owned]
    if slopes.shape[2] > 3:
        for k in {*owners}:
            others = with_columns(columns, {k: np.zeros(columns.shape[1:], np.float32)})
            behind = weights[:, c] @ seen_columns(others)[:, :, c % 3]
            rows[owned == k] -= slopes[owned == k, :, 3] * behind
    return np.asarray(rows)


def _shown_shares(columns: Floats) -> Floats:
    """Return the share of each pixel of a column that the panels of others leave, (n, q)."""
    shown = np.ones(columns.shape[:2], np.float32)
    for k in np.flatnonzero(columns[:, :, 3].any(axis=1)):
        rest = 1 - columns[k, :, 3]
        shown[:k] *= rest
        shown[k + 1 :] *= rest
    return shown
