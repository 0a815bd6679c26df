"""report.html: one self-contained page about one result.

templates/page.html is the frame of the page; the other modules here make its sections. Pictures are
data: URIs; the page loads nothing from anywhere, which its own content policy forbids.
"""

import shlex
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from markupsafe import Markup

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.colour import ViewTransform, to_8_bit
from lightpaint.images import covered, in_turns
from lightpaint.lighting.solution import Solution
from lightpaint.report.answer_pictures import (
    Residual,
    brighter_than_white,
    report_transform,
    target_picture,
)
from lightpaint.report.basis_memo import ROWS_SHOWN, SPARE_ROWS
from lightpaint.report.clean_pictures import CleanLooks
from lightpaint.report.diagnosis_sentences import fit_sentence
from lightpaint.report.page.constraint_section import colors_section, constraints_section
from lightpaint.report.page.diagnosis_section import missed_section, sure_section
from lightpaint.report.page.figures import PagePicture, maps, wipe
from lightpaint.report.page.fit_tables import (
    fit_table,
    render_table,
    verification_table,
    versions,
    wishes_section,
)
from lightpaint.report.page.html import html
from lightpaint.report.page.lights_table import MAX_THUMBNAILS, lights_table, thumbnails_of
from lightpaint.report.page.mixer import mixer_assets, mixer_html, planes_for_page
from lightpaint.report.page.placement_section import placement_section, suggestion_section
from lightpaint.report.page.planes_section import planes_section
from lightpaint.report.page.rendering_section import rendering_section
from lightpaint.report.reported_answer import ReportedAnswer
from lightpaint.report.verdict import spoken_samples, verdict
from lightpaint.report.visible_emitters import emitter_remarks


def report_page(
    answer: ReportedAnswer, *, looks: CleanLooks | None = None, missed: Residual | None = None
) -> str:
    """Return the page as HTML text.

    looks: the pictures without their grain, which a switch then shows. missed: the result of
    `residual_of`.

    Raises SizeError if target and basis differ in size.
    """
    basis, solution, predicted = answer.basis, answer.solution, answer.predicted
    answer = replace(answer, target=answer.target.fitted_to(basis.size, resize=False))
    verification = answer.verification
    verified = None if verification is None else verification.verified.image
    raw = CleanLooks.raw(basis, predicted.image, verified)
    looks = looks or raw
    transform = looks.encoder(report_transform(answer.target, basis, predicted.image))
    # Most of the time goes into pictures, which are independent of each other.
    makers: dict[str, Callable[[], Markup]] = {
        "mixer": partial(_mixer, answer, looks, transform=transform),
        "maps": partial(
            maps,
            solution,
            predicted.image,
            looks.current,
            verification=verification,
            transform=transform,
            missed=missed,
        ),
        "wipe": partial(_wipe, answer, looks, raw, transform=transform),
        "missed": partial(
            missed_section,
            solution,
            answer.diagnosis,
            looks.current,
            transform=transform,
            appearance=answer.appearance,
            can_place=answer.suggestions is None
            and answer.hung is None
            and basis.origin.scene.endswith(".xml"),
        ),
        "constraints": partial(
            constraints_section,
            basis,
            solution,
            answer.unconstrained,
            transform=transform,
            looks=looks,
        ),
        "lights": partial(
            lights_table, basis, solution, answer.uncertainty, is_clean=looks.is_clean
        ),
    }
    results = in_turns(lambda make: make(), tuple(makers.values()), basis.size)
    parts = dict(zip(makers, results, strict=True))
    shown_answer = to_8_bit(transform.encode(looks.predicted))
    page = html(
        "page",
        **parts,
        **_texts(answer),
        mixer_assets=mixer_assets(),
        colors=colors_section(answer.color_choices),
        exposure=_exposure(transform, predicted.image, looks.denoiser),
        wishes=wishes_section(answer.appearance),
        planes=planes_section(answer.planes),
        places=placement_section(answer.hung, shown_answer, basis.features),
        suggestions=suggestion_section(
            answer.suggestions,
            turn=answer.turn,
            shown_view=_first_view(solution),
            transform=transform,
            cd_per_unit=solution.lighting.cd_per_unit,
            is_clean=looks.is_clean,
        ),
        rendering=rendering_section(solution.lighting, answer.surfaces),
        sure=sure_section(basis, solution, answer.uncertainty),
        command=answer.command,
    )
    return str(page)


def _first_view(solution: Solution) -> str:
    """Return the sensor of the first of several views; "" if there is only one."""
    whole = solution.whole
    return "" if whole is None else whole.problem.views.bases[0].origin.sensor


def _texts(answer: ReportedAnswer) -> dict[str, Any]:
    """Return the parts of the page without a picture, by their names in it."""
    basis, target, solution = answer.basis, answer.target, answer.solution
    predicted, verification = answer.predicted, answer.verification
    origin = basis.origin
    counts_all = target.everything and not target.content and origin.scene.endswith(".xml")
    return {
        "title": f"{target.name} · {origin.scene}",
        "target": target.name,
        "scene": f"{origin.scene}, sensor {origin.sensor}",
        "verdict": verdict(solution, predicted, verification, appearance=answer.appearance),
        "meant": fit_sentence(solution),
        "verification": verification,
        "remarks": emitter_remarks(target, solution, predicted),
        "fit": fit_table(solution),
        "verification_facts": verification_table(verification),
        "render_facts": render_table(basis, target, solution, predicted, verification),
        "counts_paint": bool(target.content),
        "scene_to_paint": shlex.quote(_absolute_path(origin.scene)) if counts_all else "",
        "versions": versions(basis),
    }


def prepare_page(basis: Basis) -> None:
    """Make the parts of a page that depend on the basis alone; `report_page` then finds them."""
    has_few_rows = len(basis.lights) <= ROWS_SHOWN + SPARE_ROWS
    if has_few_rows:
        planes_for_page(basis, is_clean=True)
    if len(basis.lights) <= MAX_THUMBNAILS:
        thumbnails_of(basis, is_clean=has_few_rows)


def _wipe(
    answer: ReportedAnswer, looks: CleanLooks, raw: CleanLooks, *, transform: ViewTransform
) -> Markup:
    """Return the pictures to compare, in the order of the page's lists."""
    target, verification = answer.target, answer.verification

    def picture(name: str, alt: str, clean: Floats, raw: Floats) -> PagePicture:
        size = looks.predicted.shape[:2]
        pair = [to_8_bit(covered(transform.encode(x), size)) for x in (clean, raw)]
        return PagePicture(name, alt, pair[0], pair[1] if looks.is_clean else None)

    pictures = [
        picture("now", "The scene as it is.", looks.current, raw.current),
        PagePicture(
            "painting",
            f"What was painted. The rest is {'the current look' if target.over_look else 'grey'}.",
            target_picture(target, looks.current, transform=transform, finish=to_8_bit),
        ),
        picture(
            "answer",
            "The solved lighting, as the sum of the basis images.",
            looks.predicted,
            raw.predicted,
        ),
    ]
    if looks.verified is not None and raw.verified is not None:
        spp = None if verification is None else verification.spp
        caption = f"An independent render of the relit scene{spoken_samples(spp)}."
        pictures.append(picture("render", caption, looks.verified, raw.verified))
    return wipe(pictures)


def _mixer(answer: ReportedAnswer, looks: CleanLooks, *, transform: ViewTransform) -> Markup:
    """Return the mixer of the lights."""
    basis, scene = answer.basis, answer.basis.origin.scene
    return mixer_html(
        basis,
        answer.solution.lighting,
        target_picture(answer.target, looks.current, transform=transform),
        transform=transform,
        is_clean=looks.is_clean,
        scene=shlex.quote(_absolute_path(scene)) if scene.endswith(".xml") else None,
    )


def _absolute_path(path: str) -> str:
    """Return the absolute path of a file that exists, or its name otherwise."""
    return str(Path(path).absolute()) if Path(path).exists() else path


def _exposure(transform: ViewTransform, predicted: Floats, origin: str) -> str:
    """Describe the view transform of the pictures, and how much light exceeds it."""
    exposure_text = (
        f"exposure {transform.stops:+.1f} stops" if transform.stops else "the scene's own exposure"
    )
    clipped = brighter_than_white(predicted, transform)
    text = f"All at {exposure_text}, {'sRGB' if transform.name == 'srgb' else transform.name}."
    if clipped > 0:
        text += f" {max(100 * clipped, 0.1):.1f} % of the prediction is brighter than white."
    if origin:
        text += f" Denoised by {origin}; all numbers and maps are of the raw renders."
    return text
