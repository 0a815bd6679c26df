"""report.html: one self-contained page about one result.

The page's frame is report.html.in; what is filled in comes from report_pictures.py and
report_tables.py. Pictures are data: URIs; nothing is loaded from anywhere, and the page's own
content policy forbids it.
"""

from collections.abc import Sequence
from html import escape
from importlib import resources
from string import Template

from lightpaint.basis.basis import Basis
from lightpaint.images.display import encode_display
from lightpaint.images.estimate import Estimate
from lightpaint.images.exr import Floats
from lightpaint.relight.pictures import exposure_of, spoken_stops, target_picture
from lightpaint.relight.report_constraints import constraints_section
from lightpaint.relight.report_diagnosis import missed_section, sure_section
from lightpaint.relight.report_pictures import Picture, maps, wipe
from lightpaint.relight.report_suggestion import suggestion_section
from lightpaint.relight.report_tables import (
    amounts_heading,
    fit_table,
    lights_table,
    render_table,
    verification_table,
    versions,
)
from lightpaint.relight.suggestion import Suggestion
from lightpaint.relight.verdict import verdict
from lightpaint.relight.verify import Verification
from lightpaint.solve.diagnosis import Diagnosis
from lightpaint.solve.lighting import Lighting, combine
from lightpaint.solve.solve import Solution
from lightpaint.solve.uncertainty import Uncertainty
from lightpaint.target.target import Target


def report_page(
    *,
    basis: Basis,
    target: Target,
    solution: Solution,
    predicted: Estimate,
    verification: Verification | None,
    command: str,
    uncertainty: Uncertainty | None = None,
    diagnosis: Diagnosis | None = None,
    suggestions: Sequence[Suggestion] | None = None,
) -> str:
    """The page as HTML text.

    verification: None where nothing was rendered to check the prediction.
    command: the shell command that made the result.
    uncertainty, diagnosis, suggestions: without them the page has no section on what they tell.

    Raises SizeError if target and basis differ in size.
    """
    target = target.fitted_to(basis.size, resize=False)
    current = combine(basis, Lighting.present(basis)).image
    verified = None if verification is None else verification.verified.image
    stops = exposure_of(predicted.image, verified)
    looks = _looks(target, solution, current, predicted.image, verified, stops=stops)
    template = resources.files("lightpaint.relight").joinpath("report.html.in")
    return Template(template.read_text(encoding="utf-8")).substitute(
        title=escape(f"{target.name} · {basis.origin.scene}"),
        target=escape(target.name),
        scene=escape(f"{basis.origin.scene}, sensor {basis.origin.sensor}"),
        verdict=escape(verdict(solution, predicted, verification)),
        banner=_banner(verification),
        wipe=wipe(looks),
        exposure=_exposure(stops, predicted.image),
        maps=maps(solution, predicted.image, current, verification=verification, stops=stops),
        missed=missed_section(solution, diagnosis, current, stops=stops)
        + constraints_section(basis, solution, stops=stops),
        suggestions=suggestion_section(
            suggestions, stops=stops, cd_per_unit=solution.lighting.cd_per_unit
        ),
        sure=sure_section(basis, solution, uncertainty),
        lights=lights_table(basis, solution, uncertainty),
        amounts=amounts_heading(solution),
        fit=fit_table(solution),
        verification=verification_table(verification),
        render=render_table(basis, target, solution, predicted, verification),
        command=escape(command or "(made from Python, without a command line)"),
        versions=escape(versions(basis)),
    )


def _looks(
    target: Target,
    solution: Solution,
    current: Floats,
    predicted: Floats,
    verified: Floats | None,
    *,
    stops: float,
) -> list[Picture]:
    """What can be put side by side under the wipe, in the order of its lists."""
    looks = [
        Picture("current look", "The scene as it is.", encode_display(current, stops=stops)),
        Picture(
            "target",
            "The painting. Unpainted pixels are grey, dim and hatched.",
            target_picture(target, solution, current, stops=stops),
        ),
        Picture(
            "predicted",
            "The solved lighting, as the sum of the basis images.",
            encode_display(predicted, stops=stops),
        ),
    ]
    if verified is not None:
        shown = encode_display(verified, stops=stops)
        looks.append(Picture("verified", "An independent render of the relit scene.", shown))
    return looks


def _banner(verification: Verification | None) -> str:
    """What must be known before looking: loud where the render contradicts the prediction."""
    if verification is None:
        return (
            '<p class="note">Not verified: solved from a saved basis, without a render of the '
            "relit scene to compare with.</p>"
        )
    if verification.agrees:
        return ""
    return (
        '<div class="warning" role="alert"><strong>⚠ Warning: do not trust the prediction.</strong>'
        "<p>The independent render of the relit scene differs from it by more than the noise of "
        "both explains. See the map of the verification below for where; check that basis and "
        "scene belong together, and render both with more samples.</p></div>"
    )


def _exposure(stops: float, predicted: Floats) -> str:
    """How linear light became these pictures, and what of it they cannot show."""
    text = f"All at {spoken_stops(stops)}" if stops else "All at the scene's own exposure"
    clipped = float((predicted.max(axis=-1) * 2.0**stops > 1).mean())
    text += ", sRGB."
    if clipped > 0:
        text += f" {max(100 * clipped, 0.1):.1f} % of the prediction is brighter than white."
    return text
