"""The keys of a manifest, and the values that each takes.

The library's arguments are spelled as keys in errors: `find_template = false` for `find=False`.
"""

import difflib
import json
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from math import ceil
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from lightpaint import validation
from lightpaint.arrays import RGB
from lightpaint.colour import kelvin_to_rgb, luminance, photometry
from lightpaint.errors import BatchError, LightpaintError
from lightpaint.files import one_line
from lightpaint.lighting import DEFAULT_HOLD, Constraints, Lighting, LightSetting
from lightpaint.pipeline import Settings
from lightpaint.relit import FORMS
from lightpaint.scene import check_resolution
from lightpaint.sentences import Datum, Hint, Sentence
from lightpaint.target import Paint

#: Variations that are solved.
SOLVED_WORDS = ("fewer lights", "white only", "held harder")

#: Variations that shift an answer, and their mireds; positive is warmer.
SHIFTED_WORDS = {"warmer": 60.0, "cooler": -60.0}

VARIATIONS = (*SHIFTED_WORDS, *SOLVED_WORDS)

#: Share of the lights that `fewer lights` leaves on, and the factor on hold of `held harder`.
FEWER, HARDER = 0.5, 4.0

#: Limits of a shifted colour temperature, in kelvin: below the lower, lamps have no blue.
WARMEST, COOLEST = 2000.0, 15000.0

#: Colour temperature that is assumed for a colour without one, in kelvin.
NEUTRAL = 6504.0

#: Steps of a look; `lights` is the lighting and nothing else.
Step = Literal["solve", "predict", "verify", "report", "render", "export", "lights"]

#: Steps of a given lighting.
LIGHTING_STEPS: tuple[Step, ...] = ("predict", "render", "export")

#: Values of `share`.
Share = Literal["places"]

#: Scale in which a sequence has even steps: stops of brightness, or perceived colour.
Space = Literal["log", "oklab"]

#: Maximum number of frames of one sequence.
MAX_FRAMES = 10_000

#: Keys of arguments that a manifest calls by another name.
OTHER_NAMES = {"find": "find_template", "transform": "view"}

#: Keys whose values the command line has by other names.
COMMAND_NAMES = {"target": "painting", "targets": "paintings"}


def parse_variations(names: Iterable[str]) -> tuple[str, ...]:
    """Return variations by their words, each once; hyphens may stand for spaces.

    Raises BatchError for an unknown word.
    """
    words = dict.fromkeys(word.replace("-", " ") for word in names)
    if unknown_words := [word for word in words if word not in VARIATIONS]:
        known_names = ", ".join(word.replace(" ", "-") for word in VARIATIONS)
        raise BatchError(f"there is no variation {unknown_words[0]!r}: known are {known_names}")
    return tuple(words)


def vary(
    word: str, settings: Settings, constraints: Constraints, lights: int
) -> tuple[Settings, Constraints]:
    """Return the settings and constraints of a variation. lights: number of adjusted lights."""
    if word == "fewer lights":
        limit = max(1, ceil(FEWER * lights))
        sparse = limit if constraints.sparse is None else min(limit, constraints.sparse)
        return settings, replace(constraints, sparse=sparse)
    if word == "white only":
        return replace(settings, colors="white"), constraints
    hold = HARDER * (DEFAULT_HOLD if not settings.hold else settings.hold)
    return replace(settings, hold=hold, unpainted=0.0), constraints


def shift(lighting: Lighting, mireds: float, dimmer_lights: Collection[str] = ()) -> Lighting:
    """Return a lighting with every light warmer by `mireds`, at its luminance.

    dimmer_lights: names of lights with a dimmer but no colour; they do not change.
    """
    lights = tuple(
        light if light.name in dimmer_lights else _shift_light(light, mireds)
        for light in lighting.lights
    )
    return replace(lighting, lights=lights, certificate=None)


def _shift_light(light: LightSetting, mireds: float) -> LightSetting:
    if light.is_fixed or not any(light.emission) or not all(light.reached):
        return light
    kelvin = photometry(light.emission, unit=light.unit).kelvin or NEUTRAL
    ends = [
        kelvin_to_rgb(min(max(x, WARMEST), COOLEST))
        for x in (kelvin, 1e6 / max(1e6 / kelvin + mireds, 1e6 / COOLEST))
    ]
    ratio = np.array(ends[1]) / np.maximum(ends[0], 1e-6)
    return with_emission(light, np.array(light.emission) * ratio, keeps_luminance=True)


def with_emission(
    light: LightSetting, emission: object, *, keeps_luminance: bool = False
) -> LightSetting:
    """Return `light` at another emission, without claims on its accuracy."""
    values = np.asarray(emission, dtype=np.float64)
    if keeps_luminance and (current := float(luminance(values))) > 0:
        values = values * float(luminance(np.array(light.emission))) / current
    rgb: RGB = (float(values[0]), float(values[1]), float(values[2]))
    return light.with_emission(rgb)


def _texts(value: Any) -> bool:
    if not (isinstance(value, list) and 0 < len(value) <= validation.MAX_LISTED):
        return False
    return all(isinstance(x, str) and x for x in value)


def _table_of(is_valid: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda value: (
        isinstance(value, dict) and bool(value) and all(map(is_valid, value.values()))
    )


def _is_plain(value: Any) -> bool:
    return isinstance(value, str | int | float)


def _is_number(value: Any) -> bool:
    return (
        isinstance(value, int | float)
        and not isinstance(value, bool)
        and abs(value) < validation.BRIGHTEST
    )


def _some_of(words: Iterable[str], *, or_none: bool = False) -> validation.Check:
    """Return the check of a list of some words. or_none: whether it may be empty."""
    allowed_words = tuple(words)

    def is_valid(value: Any) -> bool:
        if or_none and value == []:
            return True
        return _texts(value) and set(value) <= set(allowed_words) and len(set(value)) == len(value)

    expectation = f"a list of some of {', '.join(map(repr, allowed_words))}, each once"
    items = {"enum": [*allowed_words]}
    least = 0 if or_none else 1
    schema = {"type": "array", "items": items, "minItems": least, "uniqueItems": True}
    return validation.Check(is_valid, expectation, schema)


def _texts_by_name(about: str) -> validation.Check:
    """Return the check of a table of texts. about: the table."""
    schema = {"type": "object", "additionalProperties": _TEXT_SCHEMA, "minProperties": 1}
    return validation.Check(_table_of(_is_text), about, schema)


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and value != ""


_TEXT_SCHEMA = {"type": "string", "minLength": 1}


_TEXTS_SCHEMA = {
    "type": "array",
    "items": _TEXT_SCHEMA,
    "minItems": 1,
    "maxItems": validation.MAX_LISTED,
}


TEXT = validation.Check(_is_text, "a text", _TEXT_SCHEMA)


TEXTS = validation.Check(
    _texts, f'a list of texts, ["a", "b"], {validation.MAX_LISTED} at most', _TEXTS_SCHEMA
)


TABLE = validation.a(dict, "a table")


#: Keys for loading a scene or its replacement.
SOURCE_KEYS: dict[str, validation.Check] = {
    "scene": TEXT,
    "basis": TEXT,
    "light_groups": TEXT,
    "pattern": TEXT,
    "sensor": validation.Check(
        lambda v: isinstance(v, str | int) and not isinstance(v, bool) and v != "",
        "the id of a sensor, or its index",
        {"anyOf": [_TEXT_SCHEMA, {"type": "integer"}]},
    ),
    "sensors": TEXTS,
    "parameters": validation.Check(
        _table_of(_is_plain),
        "a table of texts and numbers",
        {
            "type": "object",
            "additionalProperties": {"type": ["string", "number", "boolean"]},
            "minProperties": 1,
        },
    ),
    "variant": TEXT,
    "lights": TEXTS,
    "groups": validation.Check(
        _table_of(_texts),
        "a table of lists of names",
        {"type": "object", "additionalProperties": _TEXTS_SCHEMA, "minProperties": 1},
    ),
    "lights_file": TEXT,
    "use_lights_file": validation.SWITCH,
    "group_alike": validation.SWITCH,
    "integrator": TEXT,
    "split": _texts_by_name('a table of sizes, { sky = "16x8" }'),
    "symmetric": TEXTS,
    "map_size": TEXT,
}


#: Keys for reading a painting.
PAINTING_KEYS: dict[str, validation.Check] = {
    "mask": TEXT,
    "layer": TEXT,
    "template": TEXT,
    "find_template": validation.SWITCH,
    "view": TEXT,
    "exposure": validation.Check(_is_number, "a number of stops", {"type": "number"}),
    "paint": validation.one_of(Paint),
}


#: Keys for constraints, settings and steps.
REQUEST_KEYS: dict[str, validation.Check] = {
    "constraints": validation.Check(
        lambda v: isinstance(v, dict) or _is_text(v), "a table, or the path of a lights file"
    ),
    "settings": TABLE,
    "want": _some_of(get_args(Step)),
    "render": TABLE,
    "export": TABLE,
    "variations": _some_of(VARIATIONS, or_none=True),
    "share": validation.Check(
        lambda v: v in get_args(Share), '"places"', {"enum": [*get_args(Share)]}
    ),
}


#: Keys of which a look has exactly one.
SUBJECT_KEYS: dict[str, validation.Check] = {
    "painting": TEXT,
    "paintings": TEXTS,
    "views": _texts_by_name("a table, SENSOR = PAINTING"),
    "lighting": TEXT,
    "lightings": TEXTS,
}


DEFAULT_KEYS: dict[str, validation.Check] = {**SOURCE_KEYS, **PAINTING_KEYS, **REQUEST_KEYS}


LOOK_KEYS: dict[str, validation.Check] = {"name": TEXT, **SUBJECT_KEYS, **DEFAULT_KEYS}


SEQUENCE_KEYS: dict[str, validation.Check] = {
    "name": TEXT,
    "through": validation.Check(_texts, "a list of names of looks", _TEXTS_SCHEMA),
    "sensors": TEXTS,
    "frames": validation.whole(2, MAX_FRAMES),
    "space": validation.one_of(Space),
    "want": _some_of(LIGHTING_STEPS),
    "render": TABLE,
    "export": TABLE,
}


#: Fields of `Settings` that have no other place in a manifest or on the command line, with their
#: checks.
SETTINGS = {
    name: check
    for name, check in validation.checks_of(Settings).items()
    if name not in ("transform", "command", "force", "verify", "report", "use_cache")
}


@dataclass(frozen=True)
class Final:
    """Options of a final render.
    spp: samples per pixel, by default the scene's. resolution: of the film.
    """

    spp: int | None = None
    resolution: str | None = None
    seed: int = 0


FINAL_KEYS: dict[str, validation.Check] = {
    "spp": validation.whole(2, validation.MAX_SPP),
    "resolution": TEXT,
    "seed": validation.whole(0),
}


@dataclass(frozen=True)
class Handover:
    """Exports for other programs. to: forms of `lightpaint export`. stage: path of a USD stage."""

    to: tuple[str, ...] = ("csv", "json")
    stage: str = ""


#: Forms that looks of a manifest have: none that is of a show.
HANDOVER_FORMS = [name for name, form in FORMS.items() if not form.needs_rig]

HANDOVER_KEYS: dict[str, validation.Check] = {"to": _some_of(HANDOVER_FORMS), "stage": TEXT}


@dataclass
class Mistakes:
    """Errors in a manifest, one line each, in the order they are found."""

    source: str
    lines: list[str] = field(default_factory=list)

    def add(self, label: str, text: str) -> None:
        """Add an error. label: the look and the key; "" for the manifest as a whole."""
        prefix = f"{self.source}: {label}{': ' if label else ''}"
        line = one_line(Sentence(prefix, text).spelled(as_key), limit=1000)
        if line not in self.lines:
            self.lines.append(line)

    def check_keys(
        self, table: Mapping[str, Any], keys: Mapping[str, validation.Check], label: str
    ) -> set[str]:
        """Return the keys of `table` with valid values, and add errors in the others."""
        valid = set()
        for key, value in table.items():
            if key not in keys:
                self.add(label, f"unknown key {key!r}{_hint_of(key, keys)}")
                continue
            if keys[key].is_valid(value):
                valid.add(key)
            else:
                expected, found = keys[key].expectation, one_line(repr(value), limit=120)
                self.add(label, f"{key} is {found}: expected {expected}")
        return valid

    def unclear_keys(
        self, table: Mapping[str, Any], keys: Mapping[str, validation.Check], valid: Collection[str]
    ) -> frozenset[str]:
        """Return the known keys that misspelt or invalid ones stand for. valid: of `check_keys`."""
        invalid_keys = [key for key in table if key not in valid]
        return frozenset(key if key in keys else near_key(key, keys) for key in invalid_keys) - {""}

    def settings(self, table: Mapping[str, Any], label: str) -> dict[str, Any]:
        """Return the valid settings of a table, by name."""
        valid = self.check_keys(table, SETTINGS, f"{label}, settings")
        values = {name: value for name, value in table.items() if name in valid}
        try:
            Settings(**values)
        except LightpaintError as error:
            self.add(f"{label}, settings", error.sentence)
            return {}
        return values

    def final(self, table: Mapping[str, Any], label: str) -> Final:
        """Return the final render of a table."""
        valid = self.check_keys(table, FINAL_KEYS, f"{label}, render")
        values = {name: value for name, value in table.items() if name in valid}
        try:
            if "resolution" in values:
                check_resolution(values["resolution"])
        except LightpaintError as error:
            self.add(f"{label}, render", error.sentence)
            return Final()
        return Final(**values)

    def handover(self, table: Mapping[str, Any], label: str, base: Path) -> Handover:
        """Return the exports of a table. base: folder that its paths are relative to."""
        valid = self.check_keys(table, HANDOVER_KEYS, f"{label}, export")
        values = {name: value for name, value in table.items() if name in valid}
        request = Handover(tuple(values.get("to", Handover.to)), values.get("stage", ""))
        if request.stage and "usd" not in request.to:
            self.add(f"{label}, export", "stage is of the form 'usd': add that, or leave it out")
        return replace(request, stage=str(base / request.stage) if request.stage else "")


def _hint_of(key: str, keys: Iterable[str]) -> str:
    """Return what an unknown key of a table may mean, or else all that are known."""
    names = list(keys)
    belongs = f"settings.{key}" if key in SETTINGS and "settings" in names else ""
    suggestion = belongs or near_key(key, names)
    return f": did you mean {suggestion!r}?" if suggestion else f"; known are {', '.join(names)}"


def near_key(key: str, keys: Iterable[str]) -> str:
    """Return the known key that a misspelt one probably stands for; "" where none is near."""
    meant = COMMAND_NAMES.get(key, key)
    return next(iter(difflib.get_close_matches(meant, list(keys), 1)), "")


def as_key(datum: Datum) -> str | None:
    """Return an argument as a key of a manifest, in TOML; None for what has no key there."""
    if not isinstance(datum, Hint):
        return None
    if (datum.name, datum.value) == ("verify", False):
        return 'want without "verify"'
    name = OTHER_NAMES.get(datum.name, datum.name)
    if name not in SETTINGS and name not in DEFAULT_KEYS:
        return None
    is_simple = isinstance(datum.value, bool | int | str)
    if datum.value is not ... and not is_simple:
        return None
    value = json.dumps(datum.value, ensure_ascii=False) if is_simple else "..."
    return f"{'settings.' if name in SETTINGS else ''}{name} = {value}"
