"""The scatter of an answer by noise in what its painting is read to ask for.

A sketch is read before it is fitted: the ratio of painting and current look shows its wishes, whose
contrasts count, and how clearly it asks each light for another colour. The look is noisy, so two
bases of one scene may find other wishes in one painting: where a place asks for about as much as it
takes to be a wish, two become one, or one more is found. The noise of M does not show that.

So the painting is read again and again with noise added, the half difference of each block of
pixels with either sign (a wild bootstrap, Wu 1986), and the last linear problem is solved with what
each reading asks for (docs/method.md, "How sure").
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.lighting.analysis.noise.dominant_pixels import t_ratios
from lightpaint.lighting.analysis.noise.weight_directions import solve_for
from lightpaint.lighting.loss.expected_lights import NoisyBlocks, Wash
from lightpaint.lighting.problem import Problem, are_sketches, terms_of_wash
from lightpaint.lighting.solution import Solution
from lightpaint.progress import with_progress

#: Readings of a painting, and of one for many lights, whose solves take long.
READINGS, FEW_READINGS = 8, 3

#: Fewest lights that count as many.
MANY_LIGHTS = 64

#: Amount of noise that is added, relative to that of the basis. A threshold answers less to noise
#: that comes on top of other noise (docs/benchmarks.md has how often intervals hold).
AMOUNT = 1.2

#: Seed of the signs of the noise that is added.
SEED = 1


@dataclass(frozen=True)
class ReadingNoise:
    """The noise in the reading of a painting.

    scatter: (n, 3), standard deviation of the weights by it. widening: ratio of an interval to that
    of a standard deviation which is known.
    """

    scatter: Doubles
    widening: float

    @classmethod
    def of(cls, solution: Solution) -> Self:
        """Read the painting of an answer several times; a literal one has no such noise."""
        problem = solution.problem
        if not problem.fit.reads_wishes(is_sketch=are_sketches(problem.views)):
            return cls(np.zeros_like(solution.weights), 1.0)
        count = READINGS if len(solution.weights) < MANY_LIGHTS else FEW_READINGS
        as_read = solve_for(solution, problem.solved)
        changes = []
        for wash in _disturbed_washes(problem, count):
            terms = terms_of_wash(wash, problem.views, problem.fit, problem.reference)
            disturbed = replace(problem, **vars(terms))
            moved = solve_for(replace(solution, problem=disturbed), problem.solved)
            changes.append(moved - as_read)
        return cls(np.sqrt(np.square(changes).mean(axis=0)), float(t_ratios(np.array(count))))


def _disturbed_washes(problem: Problem, count: int) -> Iterator[Wash]:
    """Yield washes of the views of a problem, each with other noise."""
    rng, views = np.random.default_rng(SEED), problem.views
    blocks = [NoisyBlocks.of(*view) for view in zip(views.bases, views.targets, strict=True)]
    for _ in with_progress(range(count), "readings"):
        yield Wash.joined([view.disturbed(rng, AMOUNT) for view in blocks])
