"""report.json: the numbers of a report, for programs (docs/formats.md).

It does not repeat lighting.json, which has the emissions. The page rounds; this file does not.
"""

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from lightpaint.basis import Basis
from lightpaint.colour import ViewTransform, luminance
from lightpaint.images import Estimate
from lightpaint.lighting import (
    Appearance,
    ColorChoice,
    Delivery,
    Diagnosis,
    Lighting,
    Reason,
    Solution,
    Uncertainty,
    UnpaintedChange,
    compare_appearance,
)
from lightpaint.placement.suggestion import MoveSuggestion, Suggestion
from lightpaint.relit.verification import ERROR, Verification
from lightpaint.report import measures
from lightpaint.report.answer_pictures import (
    Residual,
    brighter_than_white,
    report_transform,
    residual_of,
)
from lightpaint.report.diagnosis_sentences import UNTOLD_HERE, fit_options
from lightpaint.report.hung_light import placement_numbers
from lightpaint.report.page.lights_table import rendering_numbers
from lightpaint.report.page.limit_sections import maps_limit
from lightpaint.report.planes_text import planes_numbers
from lightpaint.target import Target
from lightpaint.version import __version__

FORMAT = "lightpaint-report 1"


def report_numbers(answer: measures.ReportedAnswer, *, missed: Residual | None = None) -> str:
    """Return the numbers of a report as JSON. missed: the result of `residual_of`."""
    basis, target, solution = answer.basis, answer.target, answer.solution
    predicted, verification = answer.predicted, answer.verification
    diagnosis, uncertainty = answer.diagnosis, answer.uncertainty
    transform = report_transform(target, basis, predicted.image)
    residual = missed or residual_of(solution, predicted.image, transform=transform)
    numbers = {
        "format": FORMAT,
        "lightpaint": __version__,
        "target": target.name,
        "command": answer.command,
        "basis": _basis(basis),
        "painting": _painting(target, solution),
        "view": {
            "name": transform.name,
            "stops": transform.stops,
            "brighter_than_white": brighter_than_white(predicted.image, transform),
            "residual_limit": residual.limit,
            "residual_pixels": 2 * residual.radius + 1,
        },
        "seen": _appearance(answer.appearance or compare_appearance(solution, predicted)),
        "meant": fit_options(solution),
        "colors": {choice.colors: _choice(choice) for choice in answer.color_choices} or None,
        "fit": _fit(solution, predicted, answer.unconstrained),
        "lights": _lights(basis, solution, uncertainty),
        "rendering": rendering_numbers(solution.lighting),
        "surfaces": [vars(x) for x in answer.surfaces] or None,
        "missed": None if diagnosis is None else _missed(solution, diagnosis, transform),
        "uncertainty": None if uncertainty is None else _uncertainty(basis, solution, uncertainty),
        "verification": None if verification is None else verification_numbers(verification),
        "suggestions": _suggestion_list(answer.suggestions, solution.lighting.cd_per_unit),
        "turn": None if answer.turn is None else _turn(answer.turn),
        "planes": None if answer.planes is None else planes_numbers(answer.planes),
        "placement": None if answer.hung is None else placement_numbers(answer.hung),
    }
    return json.dumps(finite(numbers), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _basis(basis: Basis) -> dict[str, Any]:
    origin, (height, width) = basis.origin, basis.size
    return {
        "scene": origin.scene,
        "sensor": origin.sensor,
        "method": origin.method,
        "lightpaint": origin.lightpaint,
        "spp": origin.spp if basis.knows_noise else None,
        "extra_spp": origin.extra_spp,
        "seed": origin.seed if basis.knows_noise else None,
        "size": [width, height],
        "adjusted": int((~basis.is_fixed).sum()),
        "emitters_seen": int(basis.emitters_seen.sum()),
    }


def _painting(target: Target, solution: Solution) -> dict[str, Any]:
    importance = solution.importance
    return {
        "share": target.painted_share,
        "importance_mean": float(importance.mean()),
        "importance_max": float(importance.max()),
        "not_finite": target.not_finite,
    }


def _appearance(appearance: Appearance) -> dict[str, Any]:
    """Return the mean CIEDE2000 over the paint, and the achieved share of the request."""
    place = appearance.place
    return {
        "delta_e": appearance.delta_e,
        "noise": appearance.noise,
        "asked": appearance.requested_change,
        "share_met": appearance.share_met,
        "region": None if place is None else place.region,
        "object": place.object or None if place else None,
        "held": appearance.limit_groups or None,
        "held_by_views": appearance.limiting_views or None,
        "reasons": [_reason(reason) for reason in appearance.reasons] or None,
        "elsewhere": _unpainted(appearance.unpainted_change),
        "compensating": appearance.compensating_lights or None,
        "lit_delta_e": appearance.lit_delta_e,
        "wishes": [_wish(delivery) for delivery in appearance.deliveries] or None,
    }


def _wish(delivery: Delivery) -> dict[str, Any]:
    """Return how much of a wish came; shares are absent if no visible change was asked."""
    names = ("name", "kind", "brightness", "color", "delta_e", "asked_brightness", "asked_color")
    numbers = {name: getattr(delivery, name) for name in names}
    return numbers | {"group": delivery.group or None}


def _reason(reason: Reason) -> dict[str, Any]:
    """Return a reason that keeps the lights from the paint, with its share of the error."""
    numbers: dict[str, Any] = {"kind": reason.kind, "names": reason.names or None}
    numbers |= {"share": reason.share, "is_joint": reason.is_joint or None}
    numbers |= {"delta_e_without": reason.delta_e and reason.delta_e[1]}
    if (loosening := reason.loosening) is not None:
        numbers |= {"weaker_hold": loosening.hold, "weaker_hold_share": loosening.share}
        numbers |= {"weaker_hold_delta_e": loosening.delta_e and loosening.delta_e[1]}
        numbers |= {"weaker_hold_elsewhere": _unpainted(loosening.unpainted_change)}
    return numbers


def _unpainted(unpainted_change: UnpaintedChange | None) -> dict[str, Any] | None:
    """Return the change of unpainted parts, in CIEDE2000."""
    if unpainted_change is None:
        return None
    place = (
        {"object": unpainted_change.object}
        if unpainted_change.object
        else {"region": unpainted_change.region}
    )
    return {"delta_e": unpainted_change.delta_e, "worst": unpainted_change.worst, **place}


def _choice(choice: ColorChoice) -> dict[str, Any]:
    """Return the answer of a choice of colours, and the light that it would change most."""
    numbers: dict[str, Any] = {"delta_e": choice.delta_e}
    if choice.light:
        numbers |= {"light": choice.light, "before": choice.before, "color": choice.color}
    return numbers


def _fit(solution: Solution, predicted: Estimate, free: Solution | None) -> dict[str, Any]:
    """Return RMS errors relative to the painting, and `norm2`, the scale of the objectives."""
    numbers = {
        "missed": measures.relative_residual(solution),
        "noise": measures.noise_residual(solution, predicted),
        "missed_without_constraints": None if free is None else measures.relative_residual(free),
        "off": sum(not any(light.emission) for light in solution.lighting.lights),
        "norm2": solution.norm2.tolist(),
        "noise_removed": solution.problem.noise_removed,
    }
    if solution.problem.refinement is not None:
        numbers["refined"] = solution.problem.refinement.share
    if not solution.problem.is_linear:
        numbers["missed_in_linear_light"] = measures.linear_residual(solution, predicted)
    if solution.certificate.display:
        numbers["codes_missed"] = measures.error_in_codes(solution)
    if (brighter := measures.count_at_least_pixels(solution, predicted.image)) is not None:
        numbers["at_least"], numbers["at_least_and_brighter"] = brighter
    return numbers


def _lights(
    basis: Basis, solution: Solution, uncertainty: Uncertainty | None
) -> Mapping[str, dict[str, Any]]:
    lighting = solution.lighting
    shares, current_shares = (
        measures.energy_shares(basis, x) for x in (lighting, Lighting.current(basis))
    )
    by_name: dict[str, dict[str, Any]] = {}
    for k, (light, setting) in enumerate(zip(basis.lights, lighting.lights, strict=True)):
        # Only channels that reach something painted; the others are undetermined.
        told_of = np.array(setting.reached) | light.is_fixed
        now, new = (float(luminance(told_of * np.array(x.emission))) for x in (light, setting))
        by_name[light.name] = {
            "share": float(shares[k]),
            "share_before": float(current_shares[k]),
            "emission_before": light.emission,
            "luminance": new,
            "times": new / now if now > 0 else None,
            "stops": math.log2(new / now) if now > 0 and new > 0 else None,
        }
    if uncertainty is not None:
        errors, (solved, *ends) = (
            measures.relative_errors(uncertainty),
            measures.brightness(uncertainty),
        )
        for k, numbers in enumerate(by_name.values()):
            numbers["interval"] = [float(end[k]) for end in ends]
            numbers["relative_error"] = float(errors[k])
            numbers["untold"] = UNTOLD_HERE if uncertainty.untold[k] else None
            if solved[k] > 0:
                numbers["relative_interval"] = [float(end[k] / solved[k]) - 1 for end in ends]
    return by_name


def _missed(solution: Solution, d: Diagnosis, transform: ViewTransform) -> dict[str, Any]:
    """Return the shares of the error's energy."""
    numbers: dict[str, Any] = {
        "energy": d.total,
        "out_of_reach": d.share(d.unreachable),
        "forbidden": d.share(d.forbidden),
        "given_up": d.share(d.compromise),
        "noise": d.share(d.noise),
        "painting_noise": d.share(d.painting_noise),
        "not_counted": d.share(d.ignored),
        "map_limit": maps_limit(solution, d, transform=transform),
        "bounds": [
            {"lights": x.lights, "share": d.gain_share(x), "multiplier": x.multiplier}
            for x in d.bounds
        ],
        "bounds_left_out": d.bounds_left_out,
    }
    if d.place is not None:
        names = ("region", "share", "box", "painted", "reached")
        numbers["place"] = {name: getattr(d.place, name) for name in names}
    return numbers


def _uncertainty(basis: Basis, solution: Solution, uncertainty: Uncertainty) -> dict[str, Any]:
    k = measures.most_uncertain(basis, solution, uncertainty)
    return {
        "excess": uncertainty.relative_excess,
        "most_uncertain": None if k is None else basis.names[k],
        "halving_spp": None if k is None else measures.halving_spp(basis, uncertainty, k),
    }


def verification_numbers(v: Verification) -> dict[str, Any]:
    """Return whether render and prediction agree, and how far they are apart."""
    height, width = v.verified.size
    return {
        "agrees": v.agrees,
        "standard_errors": v.difference,
        "limit": v.limit,
        "spp": v.spp,
        "size": [width, height],
        "rmse": v.rmse,
        "noise_rmse": v.noise_rmse,
        "z_mean": v.z_mean,
        "z_pattern": v.z_pattern,
        "z_rms": v.z_rms,
        "z_lights": dict(v.z_lights),
        "delta_e_mean": v.delta_e_mean,
        "delta_e_95": v.delta_e_95,
        "power": None if v.power is None else {"error": ERROR, "lights": dict(v.power)},
    }


def _turn(turn: MoveSuggestion) -> dict[str, Any]:
    return {name: getattr(turn, name) for name in ("name", "turn", "gain_share", "aim")}


def _suggestion_list(
    suggestions: Sequence[Suggestion] | None, cd_per_unit: float | None
) -> list[dict[str, Any]] | None:
    if suggestions is None:
        return None
    names = ("name", "position", "emission", "gain_share", "missed_share", "seen_at", "xml")
    return [
        {name: getattr(x, name) for name in names}
        | {"photometry": x.photometry(cd_per_unit).fields(), "together": 1 - x.missed_share}
        for x in suggestions
    ]


def finite(value: Any) -> Any:
    """Return the same without missing values, and without NumPy's numbers."""
    if isinstance(value, Mapping):
        parts = {key: finite(part) for key, part in value.items()}
        return {key: part for key, part in parts.items() if part is not None}
    if isinstance(value, list | tuple):
        return [finite(part) for part in value]
    if isinstance(value, np.generic):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
