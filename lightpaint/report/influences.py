"""What else than the painting decided an answer, asked for or by default: in words, and as data."""

from typing import Any

from lightpaint.lighting.solution import Solution


def how_it_was_meant(solution: Solution) -> tuple[str, ...]:
    """Clauses; none where the painting was taken at its word."""
    certificate, fit = solution.certificate, solution.problem.fit
    used = []
    if certificate.display:
        used.append(f"fitted as the eye sees it ({certificate.display})")
    if fit.unpainted:
        used.append(f"each pixel that you did not paint counts {fit.unpainted:g}")
    elif fit.hold:
        used.append(f"what you did not paint is held ({fit.hold:g})")
    if fit.colors == "gentle":
        used.append("lamps are drawn to their own colour (gentle)")
    elif fit.colors == "white":
        used.append("lamps are white")
    if certificate.noise_removed:
        used.append("noise is allowed for")
    return tuple(used)


def spoken_meaning(solution: Solution, *, instead: str = "") -> str:
    """One sentence. instead: what leaves all of it, after what was used."""
    if not (used := how_it_was_meant(solution)):
        return "The painting is taken at its word: linear light, nothing held, any colour."
    said = "; ".join([*used, *([instead] if instead else [])])
    return f"{said[0].upper()}{said[1:]}."


def meaning_of(solution: Solution) -> dict[str, Any]:
    """The same as data. What `Fit` says of them is what was asked, or follows from the painting."""
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
