"""report.html: one self-contained page about one result.

templates/page.html is the frame of the page; the other modules here make its sections. Pictures are
data: URIs; the page loads nothing from anywhere, which its own content policy forbids.

Names of lights, targets and scenes come from other people's files; templates escape them.
"""

import platform
import shlex
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup

from lightpaint import lighting
from lightpaint.arrays import Floats
from lightpaint.basis import Basis
from lightpaint.colour import ViewTransform, to_8_bit
from lightpaint.display_text import some_of
from lightpaint.images import Estimate, covered, in_turns
from lightpaint.photometry import false_colours, plane_title
from lightpaint.relit.verification import ERROR, Verification, limit_of_tests
from lightpaint.report import answer_pictures, diagnosis_sentences, measures, planes_text
from lightpaint.report.basis_memo import ROWS_SHOWN, SPARE_ROWS, look_reduction
from lightpaint.report.page import limit_sections
from lightpaint.report.page.figures import PagePicture, data_uri, maps, wipe
from lightpaint.report.page.html import facts, html, name_list
from lightpaint.report.page.lights_table import (
    lights_table,
    rendering_section,
    thumbnails_of,
)
from lightpaint.report.page.mixer import mixer_assets, mixer_html, planes_for_page
from lightpaint.report.page.placement_section import placement_section, suggestion_section
from lightpaint.report.verdict_sentences import spoken_samples, verdict
from lightpaint.report.visible_emitters import answer_remarks, emitter_remarks
from lightpaint.target import Target
from lightpaint.version import __version__


def report_page(
    answer: measures.ReportedAnswer,
    *,
    looks: answer_pictures.CleanLooks | None = None,
    missed: answer_pictures.Residual | None = None,
) -> str:
    """Return the page as HTML text.

    looks: the pictures without their grain, which a switch then shows, reduced by `look_reduction`.
    missed: the result of
    `residual_of`.

    Raises SizeError if target and basis differ in size.
    """
    basis, solution, predicted = answer.basis, answer.solution, answer.predicted
    answer = replace(answer, target=answer.target.fitted_to(basis.size, resize=False))
    verification = answer.verification
    verified = None if verification is None else verification.verified.image
    factor = look_reduction(basis.size)
    raw = answer_pictures.CleanLooks.raw(basis, predicted.image, verified, factor=factor)
    looks = looks or raw
    transform = looks.encoder(
        answer_pictures.report_transform(answer.target, basis, predicted.image)
    )
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
            limit_sections.missed_section,
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
            limit_sections.constraints_section,
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
        colors=limit_sections.colors_section(answer.color_choices),
        exposure=_exposure(transform, predicted.image, looks.denoiser),
        wishes=wishes_section(answer.appearance),
        planes=planes_section(answer.planes),
        places=placement_section(answer.hung, shown_answer, basis.surfaces(factor)[0]),
        suggestions=suggestion_section(
            answer.suggestions,
            turn=answer.turn,
            shown_view=_first_view(solution),
            transform=transform,
            cd_per_unit=solution.lighting.cd_per_unit,
            is_clean=looks.is_clean,
        ),
        rendering=rendering_section(solution.lighting, answer.surfaces),
        sure=limit_sections.sure_section(basis, solution, answer.uncertainty),
        command=answer.command,
    )
    return str(page)


def _first_view(solution: lighting.Solution) -> str:
    """Return the sensor of the first of several views; "" if there is only one."""
    whole = solution.whole
    return "" if whole is None else whole.problem.views.bases[0].origin.sensor


def _texts(answer: measures.ReportedAnswer) -> dict[str, Any]:
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
        "meant": diagnosis_sentences.fit_sentence(solution),
        "verification": verification,
        "remarks": emitter_remarks(target, solution, predicted),
        "job_remarks": [*answer.job_remarks, *answer_remarks(solution)],
        "fit": fit_table(solution),
        "verification_facts": verification_table(verification),
        "render_facts": render_table(basis, target, solution, predicted, verification),
        "counts_paint": bool(target.content),
        "scene_to_paint": shlex.quote(_absolute_path(origin.scene)) if counts_all else "",
        "versions": versions(basis),
    }


def prepare_page(basis: Basis) -> None:
    """Make the parts of a page that depend on the basis alone; `report_page` then finds them."""
    if len(basis.lights) <= ROWS_SHOWN + SPARE_ROWS:
        planes_for_page(basis, is_clean=True)
        thumbnails_of(basis, is_clean=True)


def _wipe(
    answer: measures.ReportedAnswer,
    looks: answer_pictures.CleanLooks,
    raw: answer_pictures.CleanLooks,
    *,
    transform: ViewTransform,
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
            answer_pictures.target_picture(
                target, looks.current, transform=transform, finish=to_8_bit
            ),
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


def _mixer(
    answer: measures.ReportedAnswer, looks: answer_pictures.CleanLooks, *, transform: ViewTransform
) -> Markup:
    """Return the mixer of the lights."""
    basis, scene = answer.basis, answer.basis.origin.scene
    return mixer_html(
        basis,
        answer.solution.lighting,
        answer_pictures.target_picture(answer.target, looks.current, transform=transform),
        transform=transform,
        is_clean=looks.is_clean,
        denoised_mixes=looks.others,
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
    clipped = answer_pictures.brighter_than_white(predicted, transform)
    text = f"All at {exposure_text}, {'sRGB' if transform.name == 'srgb' else transform.name}."
    if clipped > 0:
        text += f" {max(100 * clipped, 0.1):.1f} % of the prediction is brighter than white."
    if origin:
        text += f" Denoised by {origin}; all numbers and maps are of the raw renders."
    return text


def planes_section(answer: lighting.PlanesAnswer | None) -> Markup:
    """Return the table of planes, sentences about it, and false colours; nothing without planes."""
    if answer is None:
        return Markup("")
    return html(
        "planes",
        has_planes=bool(answer.readings),
        tables=[
            (headings, rows)
            for headings, rows in (
                (planes_text.HEADINGS, [*planes_text.plane_rows(answer)]),
                (
                    planes_text.GLARE_HEADINGS,
                    [*planes_text.glare_rows(planes_text.glare_by_title(answer))],
                ),
            )
            if rows
        ],
        sentences=planes_text.planes_sentences(answer),
        pictures=_pictures(answer),
    )


def _pictures(answer: lighting.PlanesAnswer) -> list[dict[str, Any]]:
    """Return false colours of the illuminance on each plane."""
    illuminance, pictures = answer.wished.illuminance, []
    for case, weights in answer.weights_by_case.items():
        values = illuminance.of(weights)
        for plane in illuminance.planes:
            title = plane_title(plane.name, case)
            pixels = false_colours(plane, values[illuminance.points_of(plane.name)], title)
            height, width = pixels.shape[:2]
            source = data_uri(pixels)
            pictures.append({"name": title, "width": width, "height": height, "source": source})
    return pictures


def wishes_section(appearance: lighting.Appearance | None) -> Markup:
    """Return the section on how much of each wish came; "" if none asks for anything visible.

    The verdict says it of an only one without a name.
    """
    deliveries = () if appearance is None else appearance.deliveries
    entries = [entry for entry in deliveries if entry.least is not None]
    if not entries or (len(entries) == 1 and diagnosis_sentences.is_unnamed(entries[0])):
        return Markup("")
    return html(
        "wishes",
        entries=entries,
        wish_name=diagnosis_sentences.wish_name,
        spoken_share=lighting.spoken_share,
    )


def fit_table(solution: lighting.Solution) -> Markup:
    """Return rows of the objective with its standard error, optimality and sweeps, per channel and
    in all.
    """
    q = solution.certificate
    norm2 = np.where(solution.norm2 > 0, solution.norm2, 1)
    errors = None if q.objective_error is None else np.array(q.objective_error)
    errors_text = [""] * 3 if errors is None else [f" ± {e:.1g}" for e in errors / norm2]
    columns = zip(
        ("red", "green", "blue"),
        q.relative_objective,
        errors_text,
        q.kkt_residual,
        q.sweeps,
        strict=True,
    )
    channels = [
        {
            "name": name,
            "objective": f"{objective:.3g}{error}",
            "rms": f"{np.sqrt(objective):.3g}",
            "kkt": f"{kkt:.1e}",
            "sweeps": sweeps,
        }
        for name, objective, error, kkt, sweeps in columns
    ]
    residual = measures.relative_residual(solution)
    # One path carries all channels, so that their errors go together.
    error = "" if errors is None else f" ± {errors.sum() / norm2.sum():.1g}"
    total = {
        "objective": f"{residual**2:.3g}{error}",
        "rms": f"{residual:.3g}",
        "kkt": f"{max(q.kkt_residual):.1e}",
        "sweeps": max(q.sweeps),
    }
    return html("fit", channels=channels, total=total)


def verification_table(verification: Verification | None) -> Markup:
    """Return the differences of prediction and render, each beside its limit."""
    if verification is None:
        return facts([("Result", "not verified")])
    v = verification
    means_text = ", ".join(f"{value:+.2f}" for value in v.z_mean).replace("-", "−")
    return facts(
        [
            ("Result", "agrees within noise" if v.agrees else "DISAGREES beyond noise"),
            ("RMSE of the pixels", f"{v.rmse:.3g}; noise alone gives {v.noise_rmse:.3g}"),
            ("z of the whole image", f"{means_text} (R, G, B); limit ±{v.limit:.3g}"),
            ("z of the pattern", f"{v.z_pattern:+.2f}; limit {v.limit:.3g}".replace("-", "−")),
            ("z of 8×8 blocks, RMS", f"{v.z_rms:.3f}; about 1 is noise"),
            ("ΔE2000", f"mean {v.delta_e_mean:.2f}; 95 % of pixels below {v.delta_e_95:.2f}"),
            *_light_tests(v),
        ]
    )


def _light_tests(v: Verification) -> list[tuple[str, str]]:
    """Return rows on the tests of each light: its largest z, and the chance of detecting an error
    in each, the smallest first.
    """
    if not v.power:
        return []
    in_order = sorted(v.power.items(), key=lambda entry: entry[1])
    powers = [f"{100 * power:.0f} % in {name}" for name, power in in_order]
    rows = [(f"Chance of seeing an error of {100 * ERROR:.0f} %", some_of(powers, room=400))]
    if v.z_lights:
        name, z = max(v.z_lights.items(), key=lambda entry: abs(entry[1]))
        limit = limit_of_tests(len(v.z_lights), once=v.limit)
        farthest_text = f"{z:+.2f} in {name}, the largest of {len(v.z_lights)}; limit ±{limit:.3g}"
        rows.insert(0, ("z of each light", farthest_text.replace("-", "−")))
    return rows


def render_table(
    basis: Basis,
    target: Target,
    solution: lighting.Solution,
    predicted: Estimate,
    verification: Verification | None,
) -> Markup:
    """Return facts on the origin of the basis, and on pixels and lights that took no part."""
    origin, q = basis.origin, solution.certificate
    height, width = basis.size
    convergence_text = f"no: stopped after {max(q.sweeps)} sweeps"
    emitter_pixels = int(basis.emitters_seen.sum())
    ignored_pixels = int(
        lighting.ignored_paint(target, basis.emitters_seen, solution.problem.fit.emitters).sum()
    )
    adjusted = int((~basis.is_fixed).sum())
    entries: list[tuple[str, str]] = [
        ("Solve converged", "yes" if q.converged else convergence_text),
        ("Lights", f"{adjusted}, of them {_lights_off(solution) or 'none'} off"),
        ("Image", f"{width} × {height} pixels{_full_size(basis, verification)}"),
        ("Basis", f"{origin.method}, {_samples(basis)}"),
        ("Integrator", f"{origin.integrator}, not the scene's own" if origin.integrator else ""),
        ("Observer", origin.observer),
        ("Emitters seen directly", f"in {emitter_pixels} pixels{_seen_note(ignored_pixels)}"),
    ]
    missed, noise = (
        measures.relative_residual(solution),
        measures.noise_residual(solution, predicted),
    )
    entries.append(("Missed (RMS)", f"{missed:.3g} of what was asked; noise adds {noise:.3g}"))
    entries += _display_facts(solution, predicted)
    for light in basis.lights:
        if light.is_fixed:
            entries.append(("Kept as they are", name_list(light.members)))
    if q.unreached:
        entries.append(("Reach nothing painted, so unchanged", name_list(q.unreached)))
    for channels in diagnosis_sentences.partly_reached(solution.lighting):
        entries.append(("Reach nothing painted in a channel", channels))
    if target.not_finite:
        entries.append(("NaN or Inf in the target", f"{target.not_finite} pixels, not counted"))
    return facts([(label, value) for label, value in entries if value])


def _display_facts(solution: lighting.Solution, predicted: Estimate) -> list[tuple[str, str]]:
    """Return facts on the comparison with the painting, if it was not in plain linear light."""
    if solution.problem.is_linear or solution.reweighting is None:
        return []
    q = solution.certificate
    entries: list[tuple[str, str]] = []
    if q.display:
        entries += [
            ("Fitted in display space", f"as {q.display} shows it"),
            (
                "Missed on the display",
                f"{measures.error_in_codes(solution):.1f} of 255 codes, "
                f"{measures.relative_residual(solution):.3g} of the painting (RMS)",
            ),
            (
                "Missed in linear light",
                f"{measures.linear_residual(solution, predicted):.3g} of the painting (RMS)",
            ),
        ]
    if (at_least := measures.count_at_least_pixels(solution, predicted.image)) is not None:
        pixels, brighter = at_least
        text = f"{pixels} pixels, {brighter} of which are brighter now"
        entries.append(("Painted as at least so bright", text))
    return [*entries, ("Linear problems solved", f"{q.rounds}, each certified")]


def _samples(basis: Basis) -> str:
    if not basis.knows_noise:
        return "which says nothing of its samples and noise"
    return f"{basis.origin.samples_text}, seed {basis.origin.seed}"


def _full_size(basis: Basis, verification: Verification | None) -> str:
    if verification is None or verification.verified.size == basis.size:
        return ""
    height, width = verification.verified.size
    return f", verified at {width} × {height}"


def versions(basis: Basis) -> str:
    """Return the versions of lightpaint and the libraries under it, as installed here."""
    parts = [f"lightpaint {__version__}"]
    if basis.origin.lightpaint != __version__:
        parts[0] += f" (basis by {basis.origin.lightpaint})"
    parts += [
        f"{name} {installed}"
        for name in ("mitsuba", "drjit", "numpy")
        if (installed := lighting.version(name))
    ]
    software = lighting.Software.installed()
    parts.append(f"{software.blas} {software.kernel}".strip())
    return " · ".join([*parts, f"Python {platform.python_version()}"])


def _lights_off(solution: lighting.Solution) -> int:
    return sum(not any(light.emission) for light in solution.lighting.lights)


def _seen_note(ignored_pixels: int) -> str:
    return f", of which {ignored_pixels} were painted and do not count" if ignored_pixels else ""
