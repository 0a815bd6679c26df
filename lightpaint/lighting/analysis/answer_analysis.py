"""The whole analysis of an answer, computed once: its errors, its reasons, their costs, and the
lights that the painting cannot tell apart.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from lightpaint.arrays import RGB, Bools, Doubles, Indices
from lightpaint.basis import FEW_LIGHTS, Basis, Planes, texel_lights
from lightpaint.display_text import short_repr
from lightpaint.images import in_turns
from lightpaint.keywords import keywords
from lightpaint.lighting.algebra.quadratic import UNREACHED_POWER
from lightpaint.lighting.algebra.symmetric_matrices import eigenvectors
from lightpaint.lighting.analysis.appearance.answer_appearance import (
    Appearance,
    compare_appearance,
    with_undetermined,
)
from lightpaint.lighting.analysis.appearance.color_choices import (
    Choices,
    best_by_colors,
    color_choices,
)
from lightpaint.lighting.analysis.diagnosis import Diagnosis, diagnose
from lightpaint.lighting.analysis.noise.uncertainty import Uncertainty, error_bars, with_error_bars
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.linear_problem import reduce_lights, whites_for
from lightpaint.lighting.problem import ViewsReading, around_of
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solver import solution_of
from lightpaint.progress import stage, with_progress

#: Two images are alike if their normalised inner product is above 1 − ALIKE, and several are
#: ambiguous if a mix of them cancels to less than that share.
ALIKE = 1e-6

#: The largest `alike` that noise justifies.
MAX_ALIKE = 0.01

#: Number of lights whose shares of noise tell about the others.
SHARE_LIGHTS = 32

#: Smallest share of a light in a mix that cancels for it to be a part of the mix.
MIN_PART = 0.05


@dataclass(frozen=True)
class Ambiguity:
    """Lights that can share their light among themselves in many equally good ways.

    names: the lights. is_mix: whether a mix in some channel cancels; otherwise all are alike in all
    channels.
    """

    names: tuple[str, ...]
    is_mix: bool

    @property
    def sentence(self) -> str:
        """The meaning and the remedy, as a sentence."""
        lights = " and ".join([", ".join(self.names[:-1]), self.names[-1]])
        effect = (
            f"mixes of {lights} light the painted part alike"
            if self.is_mix
            else f"{lights} light the painted part alike"
        )
        return (
            f"{effect}: only their sum is determined. A wider mask or another view "
            "would tell them apart; or tie them, or keep one as it is"
        )


def ambiguities(solution: Solution) -> tuple[Ambiguity, ...]:
    """Return the lights that the painting cannot tell apart, as far as its noise allows to see.

    Noise makes the images of two lights at one place differ by its share of their power.
    """
    basis = solution.basis
    # Neighbouring texels are alike by nature, and the expectation of their image decides.
    free = np.flatnonzero(~basis.is_fixed & ~texel_lights(basis.lights))
    shares = _noise_shares(basis, free[:: max(1, -(-free.size // SHARE_LIGHTS))])
    alike = max(ALIKE, 2 * float(np.median(shares))) if shares.size else ALIKE
    # Strong noise would make different images look alike.
    M = solution.equations.M[:, free][:, :, free]
    return indistinguishable(M, [basis.names[k] for k in free], alike=min(alike, MAX_ALIKE))


def _noise_shares(basis: Basis, lights: Indices) -> Doubles:
    """Return Σ h² / Σ Φ² of some lights, where they shine."""

    def powers(planes: Planes) -> Doubles:
        lit = (planes.lit_plane(int(k))[1] for k in lights)
        return np.array([np.square(values, dtype=np.float64).sum() for values in lit])

    noise, power = powers(basis.noise), powers(basis.planes)
    return np.asarray(noise[power > 0] / power[power > 0])


def indistinguishable(
    M: Doubles, names: Sequence[str], *, alike: float = ALIKE
) -> tuple[Ambiguity, ...]:
    """Return groups of lights that M cannot tell apart, under its importance.

    M: (3, n, n), inner products per channel, or (n, n). Lights that reach nothing are left out.
    Pairs of one shape of light come first, as groups; then other mixes that cancel.
    """
    channels = M[None] if M.ndim == 2 else M
    # Each channel is scaled on its own: another colour is another weight, not another light.
    power = np.einsum("cii->ci", channels)
    lit = power > UNREACHED_POWER * power.max(initial=0)
    scale = np.where(lit, 1 / np.sqrt(np.where(lit, power, 1)), 0)
    cosines = channels * scale[:, :, None] * scale[:, None, :]

    groups = _alike_groups(cosines, lit, alike)
    alike_lights = (
        Ambiguity(tuple(names[i] for i in group), is_mix=False)
        for group in groups
        if len(group) > 1
    )
    # One light stands for each group. Other mixes may cancel; one channel suffices.
    heads = [group[0] for group in groups]
    mixes = (tuple(names[i] for i in mix) for mix in _cancelling_mixes(cosines, lit, heads, alike))
    return *alike_lights, *(Ambiguity(mixed, is_mix=True) for mixed in mixes)


def _alike_groups(cosines: Doubles, lit: Bools, alike: float) -> list[list[int]]:
    """Return the lights that reach something, in groups with images like the image of the first."""
    # In the channel where two images differ most; images of other channels differ altogether.
    least = np.where(lit[:, :, None], cosines, np.inf).min(axis=0)
    is_alike = least > 1 - alike
    for channel in lit:
        is_alike &= channel[:, None] == channel
    groups: dict[int, list[int]] = {}
    for i in np.flatnonzero(lit.any(axis=0)).tolist():
        homes = np.fromiter(groups, np.intp, len(groups))
        alike_homes = homes[is_alike[homes, i]]
        groups.setdefault(int(alike_homes[0]) if alike_homes.size else i, []).append(i)
    return list(groups.values())


def _cancelling_mixes(
    cosines: Doubles, lit: Bools, heads: Sequence[int], alike: float
) -> list[tuple[int, ...]]:
    """Return the mixes of the lights `heads` that cancel in some channel, each once."""
    mixes: dict[tuple[int, ...], None] = {}
    for c in with_progress(range(len(cosines)), "channels"):
        lit_heads = np.array([head for head in heads if lit[c, head]], dtype=int)
        matrix = cosines[c][np.ix_(lit_heads, lit_heads)]
        if _is_above(matrix, alike):
            continue
        values, vectors = eigenvectors(matrix)
        for value, vector in zip(values, vectors.T, strict=True):
            if value <= alike:
                part = np.abs(vector) > MIN_PART * np.abs(vector).max()
                mixes[tuple(lit_heads[part].tolist())] = None
    return list(mixes)


def _is_above(matrix: Doubles, value: float) -> bool:
    """Return whether all eigenvalues are above a value, in a tenth of the time of computing
    them.
    """
    try:
        np.linalg.cholesky(matrix - value * np.eye(len(matrix)))
    except np.linalg.LinAlgError:
        return False
    return True


@keywords()
@dataclass(frozen=True)
class Analysis:
    """The analysis of an answer, or of the answer to one of several views.

    Attributes:
        solution: The solution, with its errors, and with active bounds in its certificate.
        uncertainty: The errors of the lights, None if the noise is unknown.
        diagnosis: The reasons why the painting is not met.
        appearance: The visible difference between answer and painting.
        ambiguities: Lights that the painting cannot tell apart, if there are no constraints.
        unconstrained: The best answer without constraints, None if there are none, and for one view
            of several.
        color_choices: The answer of each choice of `colors`; none if no light may change its
        colour.

    Examples:
        >>> [analysis] = lp.analyse(lp.solve(basis, target))
        >>> analysis.diagnosis.missed < 0.01
        True
    """

    solution: Solution
    uncertainty: Uncertainty | None
    diagnosis: Diagnosis
    appearance: Appearance
    ambiguities: tuple[Ambiguity, ...]
    unconstrained: Solution | None
    color_choices: Choices = ()

    __repr__ = short_repr


@keywords()
def analyse(
    solution: Solution,
    *,
    level_errors: Sequence[tuple[str, RGB]] = (),
    has_error_bars: bool = True,
) -> tuple[Analysis, ...]:
    """Analyse the answer to each view.

    Args:
        solution: Of one view or of several.
        level_errors: As of `error_bars`.
        has_error_bars: Whether to estimate the uncertainty, which of thousands of lights takes
            minutes.

    Examples:
        >>> solution = lp.solve(basis, target)
        >>> [analysis] = lp.analyse(solution)
        >>> analysis.uncertainty.standard_error.shape
        (2, 3)
    """
    views = solution.views
    jobs: list[tuple[str, Callable[[], Any]]] = [
        *(("comparison", partial(_appearance_and_diagnosis, view)) for view in views),
        (
            "error bars",
            partial(error_bars, solution, level_errors=level_errors)
            if has_error_bars
            else lambda: None,
        ),
        ("answers in other colours", partial(best_by_colors, solution)),
        ("similar lights", partial(_ambiguities, solution)),
        *(("answer without constraints", partial(without_constraints, x)) for x in views),
    ]
    # All of them ask for it.
    solution.basis.predict(solution.weights)
    answers = iter(_run_stages(jobs, solution))
    looked_at: list[tuple[Appearance, Diagnosis]] = [next(answers) for _ in views]
    appearances = [view_appearance for view_appearance, _ in looked_at]
    diagnoses = [diagnosis for _, diagnosis in looked_at]
    uncertainty, best, alike = next(answers), next(answers), next(answers)
    solution = with_error_bars(solution, uncertainty)
    if uncertainty is not None:
        appearances = [
            with_undetermined(x, view, uncertainty)
            for x, view in zip(appearances, views, strict=True)
        ]
    choices = color_choices(
        solution, [view_appearance.delta_e for view_appearance in appearances], best
    )
    analyses = []
    for view, view_appearance, diagnosis, colors in zip(
        solution.views, appearances, diagnoses, choices, strict=True
    ):
        colors = _with_measured_gain(colors, view_appearance)
        certified = view.with_certificate_fields(
            bounds=diagnosis.bounds, **_certificate_fields(view_appearance)
        )
        free = next(answers)
        analyses.append(
            Analysis(certified, uncertainty, diagnosis, view_appearance, alike, free, colors)
        )
    return tuple(analyses)


def _run_stages(jobs: Sequence[tuple[str, Callable[[], Any]]], solution: Solution) -> list[Any]:
    """Return the result of each job, with the label of its stage.

    The jobs are independent, and each leaves a processor idle now and then. Of many lights each has
    hundreds of megabytes of matrices, and sums that several processors share.
    """
    if len(solution.weights) > FEW_LIGHTS:
        return [_run_stage(*job) for job in jobs]
    return in_turns(lambda job: _run_stage(*job), jobs, solution.basis.size)


def _run_stage(label: str, work: Callable[[], Any]) -> Any:
    """Return the result of `work`, whose progress is reported under `label`."""
    with stage(label):
        return work()


def _ambiguities(solution: Solution) -> tuple[Ambiguity, ...]:
    return () if solution.problem.is_constrained else ambiguities(solution)


def with_findings(solution: Solution, analyses: tuple[Analysis, ...]) -> Solution:
    """Return the answer to all views with its analysis, for lighting.json."""
    first = analyses[0]
    appearance = first.appearance if len(analyses) == 1 else compare_appearance(solution)
    with_errors = with_error_bars(solution, first.uncertainty)
    return with_errors.with_certificate_fields(
        bounds=first.diagnosis.bounds, **_certificate_fields(appearance)
    )


def _appearance_and_diagnosis(view: Solution) -> tuple[Appearance, Diagnosis]:
    """Return the visible difference of a view from its painting, and the diagnosis."""
    diagnosis = diagnose(view)
    return compare_appearance(view, diagnosis=diagnosis), diagnosis


def _with_measured_gain(choices: Choices, view_appearance: Appearance) -> Choices:
    """Return the choices with the ΔE of `free` that its reason has, measured with all pixels."""
    measured = [x.delta_e[1] for x in view_appearance.reasons if x.kind == "colors" and x.delta_e]
    if not measured:
        return choices
    return tuple(
        replace(choice, delta_e=measured[0]) if choice.colors == "free" else choice
        for choice in choices
    )


def _certificate_fields(appearance: Appearance) -> dict[str, float]:
    """Return the differences as fields of a certificate."""
    return {
        "delta_e": appearance.delta_e,
        "delta_e_noise": appearance.noise,
        "delta_e_asked": appearance.requested_change,
    }


def without_constraints(solution: Solution) -> Solution | None:
    """Solve without constraints; return None if there are none.

    Also None for one of several views, whose lighting answers the others, too.
    """
    problem = solution.problem
    if not problem.constraints or solution.whole is not None:
        return None
    own = problem.basis.current_weights
    reading = ViewsReading(problem.views, problem.power, own, problem.fit, problem.constraints)
    gamuts = reading.gamuts(around_of(problem.expected))
    whites = whites_for(problem.expected, problem.fit)
    free = reduce_lights(Constraints(), problem.lights, problem.fit, gamuts, whites)
    anew = replace(
        problem,
        constraints=Constraints(),
        reduction=free,
        full=free,
        fit=replace(problem.fit, method="polished"),
    )
    return solution_of(anew, start=solution.weights)
