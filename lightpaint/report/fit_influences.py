"""Options and defaults that influence an answer besides the painting: in words, and as data."""

from typing import Any

from lightpaint.lighting.solution import Solution


def fit_clauses(solution: Solution) -> tuple[str, ...]:
    """Return clauses on the options of the fit; none for a literal fit."""
    certificate, fit = solution.certificate, solution.problem.fit
    has_unpainted = any(not x.is_whole for x in solution.problem.views.targets)
    clauses = []
    if certificate.display:
        clauses.append(f"fitted as the eye sees it ({certificate.display})")
    if has_unpainted and fit.unpainted:
        clauses.append(f"each unpainted pixel counts {fit.unpainted:g} times a painted one")
    elif has_unpainted and fit.hold:
        clauses.append(f"unpainted parts are held ({fit.hold:g} times the weight of the paint)")
    if fit.colors == "gentle":
        clauses.append("lights are pulled to their own colour (gentle)")
    elif fit.colors == "white":
        clauses.append("lights are white")
    elif fit.colors == "own":
        clauses.append("lights keep their own colour (own)")
    if certificate.noise_removed:
        clauses.append("noise is corrected")
    return tuple(clauses)


def fit_sentence(solution: Solution, *, instead: str = "") -> str:
    """Return a sentence on the options of the fit. instead: a clause on how to switch them off."""
    if not (clauses := fit_clauses(solution)):
        return "The painting is fitted literally: linear light, nothing held, any colour."
    text = "; ".join([*clauses, *([instead] if instead else [])])
    return f"{text[0].upper()}{text[1:]}."


def fit_options(solution: Solution) -> dict[str, Any]:
    """Return the options of the fit as data, resolved by the painting."""
    fit, certificate = solution.problem.fit, solution.certificate
    return {
        "space": solution.space,
        "display": certificate.display or None,
        "hold": fit.hold,
        "unpainted": fit.unpainted,
        "colors": fit.colors,
        "literal": fit.literal,
        "noise_correction": certificate.noise_removed > 0,
    }
