"""Problems under wishes for illuminance: a painting with them, which is convex; and linear programs
over the lights, for the least power that meets all wishes, or how far they go.

Of thousands of points few limit the answer. So a linear program begins without the rows of points,
and those that its answer misses are added until none is missed (Kelley's cutting planes). HiGHS
solves each program, through SciPy.
"""

from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.errors import LightpaintError
from lightpaint.lighting.algebra.quadratic import cap_rows
from lightpaint.lighting.algebra.required_sums import RequiredSums
from lightpaint.lighting.constraints.constraint_table import Requirements
from lightpaint.lighting.light_wishes import WishedLight
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.unknowns.reduced_problem import solve_reduced
from lightpaint.lighting.unknowns.reduction import Reduction
from lightpaint.progress import cancellation_check

#: What is given up of a wish is more than its least share by this part of it, so that round-off
#: leaves room for an answer.
ROOM = 1e-8

#: Rows of points that are added at a time, largest miss of a row relative to its size, and most
#: rounds.
ADDED_ROWS, CLOSE, MAX_ROUNDS = 40, 1e-9, 200

#: Weight of the power where as much as possible of all wishes is sought, or of the picture: of the
#: brightest answer, or the largest loss. That loss is counted up to this many times the loss of a
#: black picture.
SECOND, MOST_LOSS = 1e-6, 1e4

#: Share of the least power that may be spent on lamps that share the light evenly.
EVEN = 0.01

#: A share of a wish below this is round-off.
LEAST_SHARE = 1e-7


@dataclass(frozen=True)
class RequiredProblem:
    """A problem whose answer meets wishes.

    problem: with the wishes as requirements. wished: the wishes. shares: (w,), what had to be given
    up of each, 0 of those that are met.
    """

    problem: Problem
    wished: WishedLight
    shares: Doubles


def with_wishes(problem: Problem, wished: WishedLight) -> RequiredProblem:
    """Return the problem under wishes; where these contradict the limits of lamps or each other,
    under as much of them as possible.

    It starts from the answer to its squares.
    """
    if wished.is_empty:
        return RequiredProblem(problem, wished, np.zeros(0))
    strict = _required(problem, wished.requirements)
    equations = strict.with_pull(strict.solved)
    nothing, middle = np.zeros(len(wished.wishes)), problem.reduction.at_middle_colors()
    priced = wished.requirements.with_shares(
        nothing, _share_sizes(wished), _price(equations, strict.reduction)
    )
    # What tinted light would add to a wish is nothing to rely on: a painting chooses the colours.
    reduction = middle.with_requirements(priced)
    found = solve_reduced(equations, reduction, problem.start, max_updates=0)
    assert found.shares is not None
    if not found.converged:
        return _within_reach_of_lamps(problem, wished)
    shares = np.where(found.shares < LEAST_SHARE, 0.0, found.shares)
    if not shares.any():
        return RequiredProblem(replace(strict, start=found.weights), wished, shares)
    if middle is problem.reduction:
        within = replace(priced, shares=found.shares)
    else:  # tints could reach more
        within = priced.lowered(wished.slack_of(shares))
    required = replace(_required(problem, within), start=found.weights)
    return RequiredProblem(required, wished, shares)


def _within_reach_of_lamps(problem: Problem, wished: WishedLight) -> RequiredProblem:
    """Return the problem under as much of the wishes as a linear program finds possible."""
    requirements, shares = requirements_within_reach(wished, problem.reduction)
    return RequiredProblem(_required(problem, requirements), wished, shares)


def _price(equations: NormalEquations, reduction: Reduction) -> float:
    """Return the price of a whole wish: a share of `SECOND` then counts as much as the largest
    loss, where a picture is black or all lamps are at full, as far as that is bounded.
    """
    black = float(equations.target_norm2.sum())
    _, high = reduction.weight_ranges
    at_full = float(equations.objective(np.where(np.isfinite(high), high, 0.0)).sum())
    return (min(max(black, at_full), MOST_LOSS * black) or at_full or 1.0) / SECOND


def _share_sizes(wished: WishedLight) -> Doubles:
    """Return by how much giving up all of a wish lowers each row, (m, w)."""
    sizes = np.zeros((len(wished.requirements), len(wished.wishes)))
    for k, wish in enumerate(wished.wishes):
        sizes[wish.rows, k] = 0.0 if wish.is_hard else wish.size
    return sizes


def _required(problem: Problem, requirements: Requirements) -> Problem:
    return replace(
        problem,
        constraints=replace(problem.constraints, requirements=requirements),
        reduction=problem.reduction.with_requirements(requirements),
        full=problem.full.with_requirements(requirements),
    )


def requirements_within_reach(
    wished: WishedLight, reduction: Reduction
) -> tuple[Requirements, Doubles]:
    """Return the requirements, as much of them as lights can reach, and the share of each wish that
    had to be given up, (w,). reduction: of the lights, without requirements.
    """
    own = reduction.at_middle_colors()
    shares = shares_given_up(wished, own.with_requirements(wished.requirements))
    return _lowered(wished, shares), shares


def _lowered(wished: WishedLight, shares: Doubles) -> Requirements:
    """Return the requirements without shares of the wishes, (w,), and a hair more."""
    if not shares.any():
        return wished.requirements
    return wished.requirements.lowered(wished.slack_of(shares) * (1 + ROOM))


def without_wishes(problem: Problem) -> Problem:
    """Return the problem without requirements."""
    return replace(
        problem,
        constraints=replace(problem.constraints, requirements=None),
        reduction=replace(problem.reduction, requirements=None),
        full=replace(problem.full, requirements=None),
    )


@dataclass(frozen=True)
class Program:
    """The solution of a linear program.

    x: (k,). shares: (w,), what is given up of each wish. multipliers: (m,), the rise of the cost
    with each required value. cost: of x.
    """

    x: Doubles
    shares: Doubles
    multipliers: Doubles
    cost: float


def least_watts(wished: WishedLight, reduction: Reduction) -> Program:
    """Return the unknowns that meet all wishes with the least power, up to a percent of it.

    A corner of all that meets the wishes has some lamps at full beside others that are off. With
    `EVEN` more than the least power lamps share the light as evenly as they can. Wishes that
    nothing meets are met as far as possible first.
    """
    shares = shares_given_up(wished, reduction)
    slack = wished.slack_of(shares)
    program = _solve(wished, reduction, reduction.watts, slack, shares)
    return replace(program, x=_evened(reduction, program, slack))


def _evened(reduction: Reduction, program: Program, slack: Doubles) -> Doubles:
    """Return unknowns, (k,), near the least power whose drives are as even as they can be."""
    (rows, least), watts = reduction.required, reduction.watts
    power = float(watts @ program.x)
    lower, upper = reduction.lower, reduction.upper
    if not power or not np.isfinite(upper).all():
        return program.x
    sizes = np.where(upper > 0, upper, 1.0)
    sums = RequiredSums(
        np.diag(1 / np.square(sizes)),
        np.vstack([rows, -watts]),
        np.append(least - slack, -(1 + EVEN) * power),
        lower=lower,
        upper=upper,
        caps=reduction.caps,
    )
    found = sums.minimise(np.zeros(len(watts)), program.x)
    return found.optimum.x if found.converged else program.x


def shares_given_up(wished: WishedLight, reduction: Reduction) -> Doubles:
    """Return the shares of all wishes, (w,), that have to be given up: those whose sum, with the
    largest once more, is least, so that no plane starves for a little more light on another. All
    are 0 if all wishes can be met.
    """
    watts = reduction.watts
    if not watts.any():
        watts = np.abs(reduction.required[0]).sum(axis=0)
    costs = SECOND * watts / max(float(watts.max(initial=0)), 1e-300)
    return _solve(wished, reduction, costs, None, None).shares


def _solve(
    wished: WishedLight,
    reduction: Reduction,
    cost: Doubles,
    slack: Doubles | None,
    shares: Doubles | None,
) -> Program:
    """Solve for x and, where no slack of the rows is given, for the shares of wishes."""
    rows, least = reduction.required
    if slack is not None:
        # What has to be given up is given up by a hair more than that.
        least = least - slack * (1 + CLOSE)
    given = np.zeros((len(rows), 0))
    if slack is None:  # the last column is of the largest share
        given = np.hstack([_share_sizes(wished), np.zeros((len(rows), 1))])
    count = len(reduction.unknowns)
    columns = np.hstack([rows, given])
    sizes = np.maximum(np.abs(columns).max(axis=1, initial=0), 1e-300)
    columns, least = columns / sizes[:, None], least / sizes
    costs = np.concatenate([cost, np.ones(given.shape[1])])
    bounds = np.column_stack(
        [
            np.concatenate([reduction.lower, np.zeros(given.shape[1])]),
            np.concatenate([reduction.upper, np.ones(given.shape[1])]),
        ]
    )
    used = [x.rows.start for x in wished.wishes if x.rows.stop - x.rows.start == 1]
    fixed_rows, fixed_least = cap_rows(reduction.caps, columns.shape[1])
    is_limit = np.isfinite(fixed_least)
    fixed_rows, fixed_least = fixed_rows[is_limit], fixed_least[is_limit]
    if slack is None:
        w = len(wished.wishes)
        largest = np.hstack([np.zeros((w, count)), -np.eye(w), np.ones((w, 1))])
        fixed_rows = np.vstack([fixed_rows, largest])
        fixed_least = np.append(fixed_least, np.zeros(len(largest)))
    check = cancellation_check()
    for _ in range(MAX_ROUNDS):
        check()
        x, duals = _linprog(
            costs,
            np.vstack([columns[used], fixed_rows]),
            np.concatenate([least[used], fixed_least]),
            bounds,
        )
        missed = least - columns @ x
        scale = np.maximum(np.abs(least), np.abs(columns) @ np.abs(x))
        beyond = np.flatnonzero(missed > CLOSE * scale)
        more = [k for k in beyond[np.argsort(-missed[beyond])] if k not in used][:ADDED_ROWS]
        if not more:
            break
        used += more
    multipliers = np.zeros(len(rows))
    multipliers[used] = duals[: len(used)] / sizes[used]
    found = x[count:-1] if shares is None else shares
    found = np.where(found < LEAST_SHARE, 0.0, found)
    return Program(x[:count], found, multipliers, float(costs @ x))


def _linprog(
    costs: Doubles, rows: Doubles, least: Doubles, bounds: Doubles
) -> tuple[Doubles, Doubles]:
    """Minimise costs · x with rows x >= least; return x and the multipliers of rows, >= 0."""
    from scipy.optimize import linprog

    found = linprog(costs, A_ub=-rows, b_ub=-least, bounds=bounds, method="highs")
    if not found.success:
        raise LightpaintError(
            "no setting of the lamps meets their own limits and the limit of power: allow more "
            "watts, or lower limits that keep lamps on"
        )
    return np.asarray(found.x), -np.asarray(found.ineqlin.marginals)
