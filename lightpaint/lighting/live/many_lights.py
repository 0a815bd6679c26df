"""Rounds of the answer under the brush for many lights, each of which moves some of them, while the
others keep their weights.

The sums of n lights take n² products for each pixel, and their solve n³: no frame of a display has
the time for a thousand. So a round moves the lights whose gradients have changed most since they
were last moved, and the others keep their weights. Each round lowers the loss or keeps it, and the
rounds of a stroke come to the answer of all lights: block coordinate descent (Bertsekas 2016,
Nonlinear Programming, 3.7), with the blocks chosen greedily.

Requirements, like the illuminance of a desk, couple the lights. A round keeps what the lights that
it does not move leave of them, so no round breaks one.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from lightpaint.arrays import Doubles, Floats, Indices
from lightpaint.lighting.loss.painting_loss import PaintedPixels
from lightpaint.lighting.loss.reweighting import interpolate, search_step
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.lighting.unknowns.some_lights import SomeLights
from lightpaint.threads import one_thread, parallel_map

#: Number of lights beyond which a round moves some of them. The sums of fewer fit into a frame.
MANY_LIGHTS = 160

#: Number of lights that a round moves.
MOVED_LIGHTS = 32

#: Values of the films, lights times pixels, beyond which films of many lights have fewer pixels:
#: each round reads them thrice.
MAX_FILM_VALUES = 2**22

#: Pixels whose squares are summed for the curvature of each light: one run of several.
CURVATURE_RUN, CURVATURE_STEP = 16, 8

#: Rounds whose pictures are found from one another, until all lights are added up again: round-off
#: grows.
ROUNDS_PER_SUM = 64

#: Solves equations of the lights of a reduction from weights (m, 3); returns the reduction with
#: which to go on, and the weights.
Solve = Callable[[NormalEquations, Reduction, Doubles], tuple[Reduction, Doubles]]


def equations_about(
    squares: NormalEquations, weights: Doubles, gradient: Doubles
) -> NormalEquations:
    """Return equations with the same squares whose half gradient (n, 3) at `weights`, (n, 3), is
    given; their objective is known but for a constant.
    """
    b = squares.b + (squares.gradient(weights) - gradient).T
    return replace(squares, b=b, target_norm2=np.zeros(3))


class ManyLights:
    """The order in which many lights are moved. count: n."""

    def __init__(self, count: int) -> None:
        # Half the gradient of the loss when each light was last moved: nothing is gained by a light
        # as long as its gradient stays the same, at a bound or not.
        self._settled = np.zeros((count, 3))
        self._has_moved = np.zeros(count, bool)
        # A picture reads all rows, and the gradient of the pull all its squares: what the starts
        # of the last round had is kept, and the picture that it came to.
        self._rows: Floats | None = None
        self._pictures: dict[bytes, Doubles] = {}
        self._rounds = 0  # since a picture was the sum of all lights
        self._pull: NormalEquations | None = None
        self._pull_gradients: dict[bytes, Doubles] = {}
        self._squares: tuple[Floats, Floats] | None = None  # of some pixels of some rows

    def order(self, weights: Doubles, gradient: Doubles, curvature: Doubles) -> Indices:
        """Return the lights, those first that promise the largest decrease of the loss.

        All arrays are (n, 3).
        """
        change = gradient - self._settled
        # A light that is off cannot become darker.
        is_stuck = ~self._has_moved[:, None] & (weights <= 0) & (gradient > 0)
        gains = np.where(is_stuck, 0, np.square(change) / np.maximum(curvature, 1e-300))
        return np.argsort(-gains.sum(axis=1), kind="stable")

    def settle(self, lights: Indices, gradient: Doubles) -> None:
        """Note that the weights of some lights have changed. gradient: the one of the objective by
        these weights, after the change, (m, 3).
        """
        self._settled[lights], self._has_moved[lights] = gradient, True

    @one_thread()
    def improve(
        self,
        rows: Floats,
        pixels: PaintedPixels,
        starts: Sequence[Doubles],
        reduction: Reduction,
        solve: Solve,
        pull: NormalEquations | None,
        project: Callable[[Reduction, Doubles], Doubles],
    ) -> tuple[Reduction, Doubles]:
        """Improve weights (n, 3) by a round of reweighting for some lights, from the best start.

        rows: (3, n, p) float32, the light of each pixel. project: moves weights of the lights of a
        reduction onto its constraints. The other arguments are as in `Films.improve`. Returns
        the reduction with which to go on, and the weights, whose loss is the loss of the best
        start, or less.
        """
        start, picture, value, pull_gradient = self._best_start(rows, pixels, starts, pull)
        image, weight = pixels.squares(picture, from_clipping=False)
        missed, weights_f32 = (weight * (picture - image)).astype(np.float32), _f32(weight)
        gradient = _per_channel(lambda c: rows[c] @ missed[c]).T + pull_gradient
        curvature = self._curvature(rows, weights_f32)
        if pull is not None:
            curvature += np.einsum("cii->ic", pull.M)
        order = self.order(start, gradient, curvature)
        some = SomeLights.of(reduction, order.tolist(), MOVED_LIGHTS)
        if not some.places:
            return reduction, start
        lights, own = some.lights, rows[:, some.lights]
        M = _per_channel(lambda c: (own[c] * weights_f32[c]) @ own[c].T)
        squares = NormalEquations(M, np.zeros((3, len(lights))), np.zeros(3))
        part_of_pull = None if pull is None else some.part_of(pull)
        if part_of_pull is not None:
            squares = squares + part_of_pull
        equations = equations_about(squares, start[lights], gradient[lights])
        part, best = solve(equations, some.reduction_beside(start), start[lights])
        gradient_at_best = equations.gradient(best)
        self.settle(lights, gradient_at_best)
        pictures: dict[bytes, Doubles] = {}

        def step_of(share: float) -> Doubles:
            step = start.copy()
            step[lights] = project(part, interpolate(start[lights], best, share))
            return step

        def loss(step: Doubles) -> float:  # beyond the pull on the start
            change = (step - start)[lights]
            lit = picture + np.matmul(_f32(change).T[:, None], own)[:, 0]
            pictures[step.tobytes()] = lit
            total = float(pixels.objective(lit).sum())
            if part_of_pull is None:
                return total
            about = equations_about(part_of_pull, np.zeros_like(change), pull_gradient[lights])
            return total + float((change * (about.gradient(change) - about.b.T)).sum())

        # Of a quadratic, the mean of the gradients at both ends.
        fall = (start[lights] - best) * (gradient[lights] + gradient_at_best)
        nearest = search_step(start, value, step_of, loss, promised=float(fall.sum()))
        if nearest is not start:
            self._keep_picture(key := nearest.tobytes(), pictures[key])
        return some.put_back(part), nearest

    def _keep_picture(self, key: bytes, picture: Doubles) -> None:
        """Keep the picture (3, p) that a round came to, unless many rounds have added to its
        round-off. key: the bytes of its weights.
        """
        self._rounds += 1
        if self._rounds < ROUNDS_PER_SUM:
            self._pictures[key] = picture
        else:
            self._rounds = 0

    def _best_start(
        self,
        rows: Floats,
        pixels: PaintedPixels,
        starts: Sequence[Doubles],
        pull: NormalEquations | None,
    ) -> tuple[Doubles, Doubles, float, Doubles]:
        """Return the start (n, 3) with the least loss, its picture (3, p), the loss of that picture
        without the pull, and half the gradient of the pull there, (n, 3).
        """
        if self._rows is not rows:
            self._rows, self._pictures = rows, {}
        if self._pull is not pull:
            self._pull, self._pull_gradients = pull, {}
        keyed = {start.tobytes(): start for start in starts}
        self._pictures = {
            key: self._pictures[key] if key in self._pictures else _picture(rows, start)
            for key, start in keyed.items()
        }
        self._pull_gradients = {
            key: self._pull_gradients[key] if key in self._pull_gradients else pull.gradient(start)
            for key, start in keyed.items()
            if pull is not None
        }
        found = []
        for key, start in keyed.items():
            picture, gradient, pulled = self._pictures[key], np.zeros_like(start), 0.0
            value = float(pixels.objective(picture).sum())
            if pull is not None:
                gradient = self._pull_gradients[key]
                # wᵀMw − 2 bᵀw, of which the gradient Mw − b has the first half.
                pulled = float((start * (gradient - pull.b.T)).sum())
            found.append((value + pulled, start, picture, value, gradient))
        _, start, picture, value, gradient = min(found, key=lambda x: x[0])
        return start, picture, value, gradient

    def _curvature(self, rows: Floats, weight: Floats) -> Doubles:
        """Return Σ weight Φ² of each light over some of the pixels, for all of them, (n, 3)."""
        channels, n, p = rows.shape
        runs = p // CURVATURE_RUN
        step = CURVATURE_STEP if runs >= CURVATURE_STEP else 1
        size = runs * CURVATURE_RUN if step > 1 else p

        def some(values: Floats) -> Floats:
            if step == 1:
                return values
            return values[..., :size].reshape(*values.shape[:-1], runs, -1)[..., ::step, :]

        if self._squares is None or self._squares[0] is not rows:
            self._squares = rows, np.square(some(rows)).reshape(channels, n, -1)
        of_some = some(weight).reshape(channels, -1)
        sums = np.matmul(self._squares[1], of_some[..., None])[..., 0]
        return np.asarray(step * sums.T, np.float64)


def _picture(rows: Floats, weights: Doubles) -> Doubles:
    """Return the picture of these weights, (3, p)."""
    w = _f32(weights)
    return _per_channel(lambda c: w[:, c] @ rows[c])


def _per_channel(of_channel: Callable[[int], Floats]) -> Doubles:
    """Return what is computed for each channel, (3, …), in float64."""
    return np.stack(parallel_map(of_channel, range(3))).astype(np.float64)


def _f32(values: Doubles) -> Floats:
    return np.asarray(values, np.float32)
