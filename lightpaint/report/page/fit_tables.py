"""The tables of the report besides that of lights: wishes, fit, renders, verification.

Names of lights, targets and scenes come from other people's files; templates escape them.
"""

import platform

import numpy as np
from markupsafe import Markup

from lightpaint.basis.basis import Basis
from lightpaint.display_text import some_of
from lightpaint.images import Estimate
from lightpaint.lighting.analysis.appearance.appearance import Appearance
from lightpaint.lighting.analysis.appearance.delivery import spoken_share
from lightpaint.lighting.answer.certificate import Software, version
from lightpaint.lighting.loss.painting import ignored_paint
from lightpaint.lighting.solution import Solution
from lightpaint.relit.verification import ERROR, Verification, limit_of_tests
from lightpaint.report.delivery_sentences import is_unnamed, wish_name
from lightpaint.report.diagnosis_sentences import partly_reached
from lightpaint.report.measures import (
    count_at_least_pixels,
    error_in_codes,
    linear_residual,
    noise_residual,
    relative_residual,
)
from lightpaint.report.page.html import facts, html, name_list
from lightpaint.target.target import Target
from lightpaint.version import __version__


def wishes_section(appearance: Appearance | None) -> Markup:
    """Return the section on how much of each wish came; "" if none asks for anything visible.

    The verdict says it of an only one without a name.
    """
    deliveries = () if appearance is None else appearance.deliveries
    entries = [entry for entry in deliveries if entry.least is not None]
    if not entries or (len(entries) == 1 and is_unnamed(entries[0])):
        return Markup("")
    return html("wishes", entries=entries, wish_name=wish_name, spoken_share=spoken_share)


def fit_table(solution: Solution) -> Markup:
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
    residual = relative_residual(solution)
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
    solution: Solution,
    predicted: Estimate,
    verification: Verification | None,
) -> Markup:
    """Return facts on the origin of the basis, and on pixels and lights that took no part."""
    origin, q = basis.origin, solution.certificate
    height, width = basis.size
    convergence_text = f"no: stopped after {max(q.sweeps)} sweeps"
    emitter_pixels = int(basis.emitters_seen.sum())
    ignored_pixels = int(
        ignored_paint(target, basis.emitters_seen, solution.problem.fit.emitters).sum()
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
    missed, noise = relative_residual(solution), noise_residual(solution, predicted)
    entries.append(("Missed (RMS)", f"{missed:.3g} of what was asked; noise adds {noise:.3g}"))
    entries += _display_facts(solution, predicted)
    for light in basis.lights:
        if light.is_fixed:
            entries.append(("Kept as they are", name_list(light.members)))
    if q.unreached:
        entries.append(("Reach nothing painted, so unchanged", name_list(q.unreached)))
    for channels in partly_reached(solution.lighting):
        entries.append(("Reach nothing painted in a channel", channels))
    if target.not_finite:
        entries.append(("NaN or Inf in the target", f"{target.not_finite} pixels, not counted"))
    return facts([(label, value) for label, value in entries if value])


def _display_facts(solution: Solution, predicted: Estimate) -> list[tuple[str, str]]:
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
                f"{error_in_codes(solution):.1f} of 255 codes, {relative_residual(solution):.3g} "
                f"of "
                "the painting (RMS)",
            ),
            (
                "Missed in linear light",
                f"{linear_residual(solution, predicted):.3g} of the painting (RMS)",
            ),
        ]
    if (at_least := count_at_least_pixels(solution, predicted.image)) is not None:
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
        if (installed := version(name))
    ]
    software = Software.installed()
    parts.append(f"{software.blas} {software.kernel}".strip())
    return " · ".join([*parts, f"Python {platform.python_version()}"])


def _lights_off(solution: Solution) -> int:
    return sum(not any(light.emission) for light in solution.lighting.lights)


def _seen_note(ignored_pixels: int) -> str:
    return f", of which {ignored_pixels} were painted and do not count" if ignored_pixels else ""
