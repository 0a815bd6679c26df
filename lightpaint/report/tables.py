"""The tables of the report: lights, fit, renders, verification. Each returns HTML.

Names of lights, targets and scenes come from other people's files and are escaped here.
"""

import importlib.metadata
import platform
from html import escape
from typing import Any

import numpy as np

from lightpaint.arrays import RGB
from lightpaint.basis.basis import Basis, BasisLight
from lightpaint.colour.color import luminance, rgb_to_hex
from lightpaint.colour.display import to_8_bit
from lightpaint.colour.photometry import Photometry
from lightpaint.images.estimate import Estimate
from lightpaint.lighting.analysis.uncertainty import Uncertainty
from lightpaint.lighting.lighting import LightSetting
from lightpaint.lighting.loss import PaintingLoss
from lightpaint.lighting.solution import Solution
from lightpaint.relit.verify import LIMIT, Verification
from lightpaint.report.figures import data_uri, thumbnail
from lightpaint.report.sentences import relative_errors, spoken_error
from lightpaint.report.verdict import (
    codes_missed,
    energy_shares,
    linear_residual,
    relative_residual,
)
from lightpaint.target.target import Target
from lightpaint.version import __version__


def lights_table(basis: Basis, solution: Solution, uncertainty: Uncertainty | None = None) -> str:
    """One row per light, in document order."""
    errors = None if uncertainty is None else relative_errors(uncertainty)
    shares = energy_shares(basis, solution.lighting)
    settings = {light.name: light for light in solution.lighting.lights}
    unreached = solution.certificate.unreached
    rows = []
    for k, (light, image) in enumerate(zip(basis.lights, basis.images, strict=True)):
        share = shares[k]
        picture, stops = thumbnail(image, basis.emitters_seen)
        name, setting = escape(light.name), settings[light.name]
        error = "" if errors is None else spoken_error(setting, float(errors[k]))
        error = f"<small>{error}</small>" if error else ""
        what = f"What {name} lights alone, shown at {stops:+.1f} stops"
        rows.append(
            f'<tr><td class="thumb"><img src="{data_uri(to_8_bit(picture), largest_png=0)}" '
            f'width="{picture.shape[1]}" height="{picture.shape[0]}" alt="{what}" '
            f'title="{what}"></td>'
            f'<th scope="row">{name}<small>{escape(light.plugin)}'
            f"{' · ' + escape(light.form) if light.form else ''}</small></th>"
            f"{_emission_cells(light, setting, solution.lighting.photometry(setting))}"
            f"<td>{change(light, setting, unreached)}{error}{_asked(setting)}</td>"
            f'<td class="share"><span>{100 * share:.1f} %</span><div class="bar" '
            f'aria-hidden="true"><i style="width: {100 * share:.2f}%"></i></div></td></tr>'
        )
    return "".join(rows)


def amounts_heading(solution: Solution) -> str:
    """What stands in the column of fluxes: lumen where the scene has a scale, else no unit."""
    if solution.lighting.cd_per_unit is None:
        return "flux<br>(relative)"
    return "output"


def _emission_cells(light: BasisLight, setting: LightSetting, seen: Photometry) -> str:
    """Colour, emission before and after, their unit, and what an eye makes of it."""
    if light.is_fixed:
        return '<td></td><td class="rgb"></td><td class="rgb"></td><td class="unit"></td><td></td>'
    return (
        f'<td class="colour">{_swatch(setting.emission, seen)}</td>'
        f'<td class="rgb">{_rgb(light.emission)}</td>'
        f'<td class="rgb">{_rgb(setting.emission)}</td>'
        f'<td class="unit">{escape(light.parameter)}<small>{escape(light.unit)}</small></td>'
        f'<td class="rgb">{_amounts(seen)}</td>'
    )


def change(light: BasisLight, setting: LightSetting, unreached: tuple[str, ...]) -> str:
    """In words or as a ratio of luminance, what happens to a light."""
    before = float(luminance(np.array(light.emission)))
    after = float(luminance(np.array(setting.emission)))
    if light.is_fixed:
        return "kept as it is"
    if light.name in unreached:
        return "unchanged: reaches nothing painted"
    if after == 0:
        return "off" if before > 0 else "stays off"
    if before == 0:
        return "was off, now on"
    stops = f"{np.log2(after / before):+.2f} stops".replace("-", "−")
    return f"×{after / before:.3g}<small>{stops}</small>"


def _asked(setting: LightSetting) -> str:
    """What was asked of a light, and whether that holds it."""
    holds = " (holds it)" if setting.is_active else ""
    return f"<small>{escape(setting.constraint)}{holds}</small>" if setting.constraint else ""


def fit_table(solution: Solution) -> str:
    """Objective with its standard error, optimality and sweeps, per channel and in all."""
    q = solution.certificate
    norm2 = np.where(solution.norm2 > 0, solution.norm2, 1)
    errors = None if q.objective_error is None else np.array(q.objective_error)
    each = [""] * 3 if errors is None else [f" ± {e:.1g}" for e in errors / norm2]
    columns = zip(
        ("red", "green", "blue"), q.relative_objective, each, q.kkt_residual, q.sweeps, strict=True
    )
    rows = [
        f'<tr><th scope="row">{name}</th><td>{objective:.3g}{error}</td>'
        f"<td>{np.sqrt(objective):.3g}</td><td>{kkt:.1e}</td><td>{sweeps}</td></tr>"
        for name, objective, error, kkt, sweeps in columns
    ]
    total = relative_residual(solution)
    # One path carries all channels, so that their errors go together.
    whole = "" if errors is None else f" ± {errors.sum() / norm2.sum():.1g}"
    rows.append(
        f'<tr class="total"><th scope="row">all</th><td>{total**2:.3g}{whole}</td>'
        f"<td>{total:.3g}</td>"
        f"<td>{max(q.kkt_residual):.1e}</td><td>{max(q.sweeps)}</td></tr>"
    )
    return "".join(rows)


def verification_table(verification: Verification | None) -> str:
    """How far prediction and render are apart, each number beside what is allowed."""
    if verification is None:
        return _facts([("Result", "not verified")])
    v = verification
    means = ", ".join(f"{value:+.2f}" for value in v.z_mean).replace("-", "−")
    return _facts(
        [
            ("Result", "agrees within noise" if v.agrees else "DISAGREES beyond noise"),
            ("RMSE of the pixels", f"{v.rmse:.3g}; noise alone gives {v.noise_rmse:.3g}"),
            ("z of the whole image", f"{means} (R, G, B); limit ±{LIMIT:g}"),
            ("z of the pattern", f"{v.z_pattern:+.2f}; limit {LIMIT:g}".replace("-", "−")),
            ("z of 8×8 blocks, RMS", f"{v.z_rms:.3f}; about 1 is noise"),
            ("ΔE2000", f"mean {v.delta_e_mean:.2f}; 95 % of pixels below {v.delta_e_95:.2f}"),
        ]
    )


def render_table(
    basis: Basis,
    target: Target,
    solution: Solution,
    predicted: Estimate,
    verification: Verification | None,
) -> str:
    """Where the basis comes from, and which pixels and lights took no part."""
    origin, q = basis.origin, solution.certificate
    height, width = basis.size
    stopped = f"no: stopped after {max(q.sweeps)} sweeps"
    seen = int(basis.emitters_seen.sum())
    adjusted = int((~basis.is_fixed).sum())
    facts = [
        ("Solve converged", "yes" if q.converged else stopped),
        ("Lights", f"{adjusted}, of them {_lights_off(solution) or 'none'} off"),
        ("Image", f"{width} × {height} pixels{_full_size(basis, verification)}"),
        ("Basis", f"{origin.method}, {_samples(basis)}"),
        ("Emitters seen directly", f"in {seen} pixels{_seen_note(target, seen)}"),
    ]
    facts += _fitted_facts(solution, predicted)
    for light in basis.lights:
        if light.is_fixed:
            facts.append(("Kept as they are", ", ".join(light.members)))
    if q.unreached:
        facts.append(("Reach nothing painted", f"{', '.join(q.unreached)} (kept as they are)"))
    if target.not_finite:
        facts.append(("NaN or Inf in the target", f"{target.not_finite} pixels, not counted"))
    return _facts(facts)


def _fitted_facts(solution: Solution, predicted: Estimate) -> list[tuple[str, str]]:
    """What was compared with the painting, where it was not plain light."""
    if solution.problem.is_linear or solution.reweighting is None:
        return []
    q, facts = solution.certificate, []
    if q.display:
        facts += [
            ("Fitted in display space", f"as {q.display} shows it"),
            (
                "Missed on the display",
                f"{codes_missed(solution):.1f} of 255 codes, {relative_residual(solution):.3g} of "
                "the painting (RMS)",
            ),
            (
                "Missed in linear light",
                f"{linear_residual(solution, predicted):.3g} of the painting (RMS)",
            ),
        ]
    loss = solution.problem.loss
    if isinstance(loss, PaintingLoss) and loss.at_least[solution.importance > 0].any():
        its = loss.at_least & (solution.importance > 0)[..., None]
        brighter = its & (predicted.image > loss.painted)
        facts.append(
            (
                "Painted as at least so bright",
                f"{its.any(axis=-1).sum()} pixels, {brighter.any(axis=-1).sum()} of which are "
                "brighter now",
            )
        )
    return [*facts, ("Linear problems solved", f"{q.rounds}, each certified")]


def _samples(basis: Basis) -> str:
    if not basis.knows_noise:
        return "which says nothing of its samples and noise"
    return f"{basis.origin.spp} samples per pixel, seed {basis.origin.seed}"


def _full_size(basis: Basis, verification: Verification | None) -> str:
    if verification is None or verification.verified.size == basis.size:
        return ""
    height, width = verification.verified.size
    return f", verified at {width} × {height}"


def versions(basis: Basis) -> str:
    """What made this: lightpaint and the libraries under it, as installed here."""
    parts = [f"lightpaint {__version__}"]
    if basis.origin.lightpaint != __version__:
        parts[0] += f" (basis by {basis.origin.lightpaint})"
    for name in ("mitsuba", "drjit", "numpy"):
        try:
            parts.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            continue  # a saved basis needs no renderer
    return " · ".join([*parts, f"Python {platform.python_version()}"])


def hex_color(emission: RGB) -> str | None:
    """Colour of a light as #rrggbb, its brightest channel at full; None if it is off."""
    return rgb_to_hex(np.array(emission)) if any(emission) else None


def _swatch(emission: RGB, seen: Photometry) -> str:
    """The colour of a light; of one whose own is not known, that of its factor."""
    color = seen.hex or hex_color(emission)
    if color is None or not any(emission):
        return '<span class="swatch none"></span><small>off</small>'
    kelvin = "" if seen.kelvin is None else f"{seen.kelvin:.0f} K"
    away = "" if seen.duv is None else f"Duv {seen.duv:+.3f}".replace("-", "−")
    return (
        f'<span class="swatch" style="background: {color}"></span><code>{color}</code>'
        f"{f'<small>{kelvin}</small><small>{away}</small>' if kelvin else ''}"
    )


def _amounts(seen: Photometry) -> str:
    """Luminous quantity and flux; without a scale, the flux in proportion."""
    if seen.luminous is not None or seen.flux_lm is not None:
        return "<br>".join(filter(None, seen.amounts))
    return "" if seen.flux_y is None else f"{seen.flux_y:.3g}"


def _rgb(emission: RGB) -> str:
    return "<br>".join(f"{v:.4g}" for v in emission) if any(emission) else "off"


def _lights_off(solution: Solution) -> int:
    return sum(not any(light.emission) for light in solution.lighting.lights)


def _seen_note(target: Target, seen: int) -> str:
    return ", which do not count" if seen and target.everything else ""


def _facts(facts: list[tuple[str, Any]]) -> str:
    return "".join(f"<dt>{escape(k)}</dt><dd>{escape(str(v))}</dd>" for k, v in facts)
