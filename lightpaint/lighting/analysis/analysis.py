"""All that is asked of an answer, once: how sure it is, why it is not closer, and at what cost."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

from lightpaint.keywords import keywords
from lightpaint.lighting.analysis.ambiguity import Ambiguity, ambiguities
from lightpaint.lighting.analysis.appearance.appearance import Seen, what_is_seen
from lightpaint.lighting.analysis.appearance.color_choices import (
    Choices,
    best_of_each,
    color_choices,
)
from lightpaint.lighting.analysis.constraint_cost import without_constraints
from lightpaint.lighting.analysis.diagnosis import Diagnosis, diagnose
from lightpaint.lighting.analysis.noise.uncertainty import Uncertainty, error_bars, with_error_bars
from lightpaint.lighting.solution import Solution
from lightpaint.screen import shortly
from lightpaint.threads import side_by_side


@keywords()
@dataclass(frozen=True)
class Analysis:
    """What is known of an answer, or of the answer to one of several views.

    Attributes:
        solution: With its errors and with what holds its lights in its certificate.
        uncertainty: How sure the lights are, None where nothing is known of the noise.
        diagnosis: Why the painting is not met.
        seen: How far the answer looks from what was painted.
        ambiguities: Lights that it cannot tell apart, where nothing is asked of them.
        unconstrained: The best without what is asked, None where nothing is, or of one view of
            several.
        color_choices: What each choice of `colors` comes to; none where no light could have another
            colour.

    Examples:
        >>> [analysis] = lp.analyse(lp.solve(basis, target))
        >>> analysis.diagnosis.missed < 0.01
        True
    """

    solution: Solution
    uncertainty: Uncertainty | None
    diagnosis: Diagnosis
    seen: Seen
    ambiguities: tuple[Ambiguity, ...]
    unconstrained: Solution | None
    color_choices: Choices = ()

    __repr__ = shortly


@keywords()
def analyse(solution: Solution) -> tuple[Analysis, ...]:
    """An analysis for each view.

    Args:
        solution: Of one view or of several.

    Examples:
        >>> solution = lp.solve(basis, target)
        >>> [analysis] = lp.analyse(solution)
        >>> analysis.uncertainty.standard_error.shape
        (2, 3)
    """
    views = solution.views
    asked: list[Callable[[], Any]] = [partial(_looked_at, view) for view in views]
    asked += [partial(error_bars, solution), partial(best_of_each, solution)]
    asked += [partial(_alike, solution)]
    asked += [partial(without_constraints, view) for view in views]
    # None of them needs another, and each leaves a processor idle now and then.
    answers = iter(side_by_side(lambda ask: ask(), asked))
    looked_at: list[tuple[Seen, Diagnosis]] = [next(answers) for _ in views]
    seen = [its for its, _ in looked_at]
    diagnoses = [diagnosis for _, diagnosis in looked_at]
    uncertainty, best, alike = next(answers), next(answers), next(answers)
    solution = with_error_bars(solution, uncertainty)
    choices = color_choices(solution, [its.delta_e for its in seen], best)
    found = []
    for view, its, diagnosis, colors in zip(solution.views, seen, diagnoses, choices, strict=True):
        told = view.told(bounds=diagnosis.bounds, **_numbers(its))
        free = next(answers)
        found.append(Analysis(told, uncertainty, diagnosis, its, alike, free, colors))
    return tuple(found)


def _alike(solution: Solution) -> tuple[Ambiguity, ...]:
    return () if solution.problem.asks else ambiguities(solution)


def with_findings(solution: Solution, analyses: tuple[Analysis, ...]) -> Solution:
    """The answer to all views with what was found of it, for lighting.json."""
    first = analyses[0]
    seen = first.seen if len(analyses) == 1 else what_is_seen(solution)
    told = with_error_bars(solution, first.uncertainty)
    return told.told(bounds=first.diagnosis.bounds, **_numbers(seen))


def _looked_at(view: Solution) -> tuple[Seen, Diagnosis]:
    """How far one view looks from its painting, and why it misses it."""
    diagnosis = diagnose(view)
    return what_is_seen(view, diagnosis=diagnosis), diagnosis


def _numbers(seen: Seen) -> dict[str, float]:
    """As a certificate has them."""
    return {"delta_e": seen.delta_e, "delta_e_noise": seen.noise, "delta_e_asked": seen.asked}
