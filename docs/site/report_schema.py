"""The JSON schema of report.json, of the dataclasses whose fields it copies and of their sums.

report_json.py leaves fields without a value out, so that few are required.
"""

from typing import Any, get_type_hints

from dataclass_schemas import Schema, list_of, schema_of, value_schema

from lightpaint.basis.light_basis import Origin
from lightpaint.lighting.analysis.appearance.color_choices import ColorChoice
from lightpaint.lighting.analysis.appearance.delivery import Delivery
from lightpaint.lighting.analysis.appearance.display_difference import UnpaintedChange
from lightpaint.lighting.analysis.appearance.limiting_reasons import Reason
from lightpaint.lighting.analysis.diagnosis import Place
from lightpaint.lighting.analysis.rendered_colors import SurfaceColor
from lightpaint.lighting.fit import Fit
from lightpaint.placement.suggestion import MoveSuggestion, Suggestion
from lightpaint.report.report_json import FORMAT

_TEXT: Schema = {"type": "string"}
_TEXTS: Schema = {"type": "array", "items": _TEXT}
_COUNT: Schema = {"type": "integer", "minimum": 0}
_NUMBER: Schema = {"type": "number"}
_AMOUNT: Schema = {"type": "number", "minimum": 0}
_YES: Schema = {"type": "boolean"}
_PAIR, _TRIPLE = list_of([_NUMBER] * 2), list_of([_NUMBER] * 3)


def report_schema() -> Schema:
    """Return the schema of report.json."""
    size, region = list_of([_COUNT] * 2), list_of([_COUNT] * 2)
    elsewhere = _record(**_fields(UnpaintedChange, "delta_e", "worst", "object"), region=region)
    hints = get_type_hints(Fit)
    parts: dict[str, Schema] = {
        "basis": _record(
            **_fields(Origin, "scene", "sensor", "method", "lightpaint", "seed"),
            **_all(_NUMBER, "spp", "extra_spp"),
            size=size,
            **_all(_COUNT, "adjusted", "emitters_seen"),
        ),
        "painting": _record(
            **_all(_AMOUNT, "share", "importance_mean", "importance_max"), not_finite=_COUNT
        ),
        "view": _record(
            name=_TEXT,
            **_all(_NUMBER, "stops", "brighter_than_white", "residual_limit"),
            residual_pixels=_COUNT,
        ),
        "seen": _record(
            **_all(_AMOUNT, "delta_e", "noise", "asked", "share_met"),
            region=region,
            object=_TEXT,
            **_all(_TEXTS, "held", "held_by_views", "compensating"),
            reasons=_list(_reason(elsewhere)),
            elsewhere=elsewhere,
            lit_delta_e=_AMOUNT,
            wishes=_list(_wish()),
        ),
        "meant": _record(
            **{name: value_schema(hints[name]) for name in ("space", "hold", "colors")},
            display=_TEXT,
            unpainted=_AMOUNT,
            **_all(_YES, "literal", "noise_correction"),
        ),
        "colors": _by_name(_record(**_fields(ColorChoice, "delta_e", "light", "before", "color"))),
        "fit": _fit(),
        "lights": _by_name(_light()),
        "rendering": _by_name(_rendering()),
        "surfaces": _list(_record(**_fields(SurfaceColor, "name", "daylight", "seen", "delta_e"))),
        "missed": _missed(region),
        "uncertainty": _record(excess=_NUMBER, most_uncertain=_TEXT, halving_spp=_NUMBER),
        "verification": _verification(size),
        "suggestions": _list(_suggestion()),
        "turn": _record(**_fields(MoveSuggestion, "name", "turn", "gain_share", "aim")),
        "placement": _placement(),
    }
    required = ["basis", "painting", "view", "seen", "meant", "fit", "lights"]
    head = {"format": {"const": FORMAT}, **_all(_TEXT, "lightpaint", "target", "command")}
    return {**_record(**head, **parts), "required": [*head, *required]}


def _rendering() -> Schema:
    names = ("kelvin", "duv", "ra", "r9", "rf", "rg", "best_rf", "lm_per_w")
    names += ("wanted_rf", "watts", "plain_rf", "plain_watts", "held_mix_change")
    return _record(**_all(_NUMBER, *names))


def _wish() -> Schema:
    changes = ("brightness", "color", "asked_brightness", "asked_color")
    return _record(
        **_fields(Delivery, "name", "kind", "group", "delta_e"), **_all(_NUMBER, *changes)
    )


def _reason(elsewhere: Schema) -> Schema:
    weaker_hold = {"weaker_hold_elsewhere": elsewhere, **_all(_NUMBER, "weaker_hold")}
    return _record(
        **_fields(Reason, "kind", "names", "share", "is_joint"),
        **_all(_NUMBER, "delta_e_without", "weaker_hold_share", "weaker_hold_delta_e"),
        **weaker_hold,
    )


def _fit() -> Schema:
    errors = ("missed", "noise", "missed_without_constraints", "noise_removed", "refined")
    return _record(
        **_all(_NUMBER, *errors, "missed_in_linear_light", "codes_missed"),
        norm2=_TRIPLE,
        **_all(_COUNT, "off", "at_least", "at_least_and_brighter"),
    )


def _light() -> Schema:
    return _record(
        **_all(_NUMBER, "share", "share_before", "luminance", "times", "stops", "relative_error"),
        emission_before=_TRIPLE,
        # The upper end of an interval may be infinite, which JSON does not have.
        **_all(list_of([{"type": ["number", "null"]}] * 2), "interval", "relative_interval"),
        untold=_TEXT,
    )


def _missed(region: Schema) -> Schema:
    shares = ("out_of_reach", "forbidden", "given_up", "noise", "painting_noise", "not_counted")
    bound = _record(lights=_TEXTS, share=_NUMBER, multiplier=_TRIPLE)
    place = {**_fields(Place, "share", "box", "painted", "reached"), "region": region}
    return _record(
        **_all(_NUMBER, "energy", *shares, "map_limit"),
        bounds=_list(bound),
        bounds_left_out=_COUNT,
        place=_record(**place),
    )


def _verification(size: Schema) -> Schema:
    errors = ("rmse", "noise_rmse", "z_pattern", "z_rms", "delta_e_mean", "delta_e_95")
    return _record(
        agrees=_YES,
        **_all(_NUMBER, "standard_errors", "limit", "spp", *errors),
        size=size,
        z_mean=_TRIPLE,
        z_lights=_by_name(_NUMBER),
        power=_record(error=_NUMBER, lights=_by_name(_NUMBER)),
    )


def _suggestion() -> Schema:
    names = ("name", "position", "emission", "gain_share", "missed_share", "seen_at", "xml")
    photometry = {"type": "object"}
    return _record(**_fields(Suggestion, *names), photometry=photometry, together=_NUMBER)


def _placement() -> Schema:
    names = ("gain_share", "distance", "turn", "cutoff", "beam", "place_error", "turn_error")
    change = _record(name=_TEXT, text=_TEXT, **_all(_NUMBER, *names), is_hardly_visible=_YES)
    ends = _all(_NUMBER, "missed_before", "missed_after")
    return _record(**ends, looks=_TEXTS, changes=_list(change))


def _fields(kind: Any, *names: str) -> dict[str, Schema]:
    """Return the schemas of some fields of a dataclass."""
    properties: dict[str, Schema] = schema_of(kind)["properties"]
    return {name: properties[name] for name in names}


def _all(schema: Schema, *names: str) -> dict[str, Schema]:
    return dict.fromkeys(names, schema)


def _record(**properties: Schema) -> Schema:
    return {"type": "object", "properties": properties, "additionalProperties": False}


def _by_name(values: Schema) -> Schema:
    return {"type": "object", "additionalProperties": values}


def _list(items: Schema) -> Schema:
    return {"type": "array", "items": items}
