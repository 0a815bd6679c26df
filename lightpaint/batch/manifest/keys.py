"""What a manifest may say: its keys, and what is expected of each."""

import difflib
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, get_args

from lightpaint.batch.manifest.variations import VARIATIONS
from lightpaint.errors import LightpaintError
from lightpaint.files import one_line
from lightpaint.pipeline.settings import Settings
from lightpaint.relit.export_forms import FORMS
from lightpaint.scene.film import MAX_SPP, check_resolution
from lightpaint.target.target_reader import Paint
from lightpaint.validation import BRIGHTEST, MAX_LISTED, SWITCH, Check, a, one_of, whole

#: What can be wanted of a look; `lights` is the lighting and nothing else.
Step = Literal["solve", "predict", "verify", "report", "render", "export", "lights"]

#: What can be wanted of a lighting that is there already.
GIVEN: tuple[Step, ...] = ("predict", "render", "export")

#: What a sequence is even in: stops of brightness, or lightness; colours as people see them.
Space = Literal["log", "oklab"]

#: Frames of one sequence, at most.
MOST_FRAMES = 10_000


def _texts(value: Any) -> bool:
    if not (isinstance(value, list) and 0 < len(value) <= MAX_LISTED):
        return False
    return all(isinstance(x, str) and x for x in value)


def _table_of(fits: Callable[[Any], bool]) -> Callable[[Any], bool]:
    return lambda value: isinstance(value, dict) and bool(value) and all(map(fits, value.values()))


def _is_plain(value: Any) -> bool:
    return isinstance(value, str | int | float)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < BRIGHTEST


def _some_of(words: Iterable[str]) -> Check:
    known = tuple(words)

    def fits(value: Any) -> bool:
        return _texts(value) and set(value) <= set(known) and len(set(value)) == len(value)

    return fits, f"a list of some of {', '.join(map(repr, known))}, each once"


TEXT: Check = (lambda value: isinstance(value, str) and value != "", "a text")
TEXTS: Check = (_texts, f'a list of texts, ["a", "b"], {MAX_LISTED} at most')
TABLE: Check = a(dict, "a table")

#: How a scene is loaded, or what is there in its place.
SOURCE: dict[str, Check] = {
    "scene": TEXT,
    "basis": TEXT,
    "light_groups": TEXT,
    "pattern": TEXT,
    "sensor": (
        lambda v: isinstance(v, str | int) and not isinstance(v, bool) and v != "",
        "the id of a sensor, or its index",
    ),
    "sensors": TEXTS,
    "parameters": (_table_of(_is_plain), "a table of texts and numbers"),
    "variant": TEXT,
    "lights": TEXTS,
    "groups": (_table_of(_texts), "a table of lists of names"),
    "lights_file": TEXT,
    "use_lights_file": SWITCH,
    "group_alike": SWITCH,
    "integrator": TEXT,
}

#: How a painting is read.
PAINTED: dict[str, Check] = {
    "mask": TEXT,
    "layer": TEXT,
    "template": TEXT,
    "find_template": SWITCH,
    "view": TEXT,
    "exposure": (_is_number, "a number of stops"),
    "paint": one_of(Paint),
}

#: What is asked, and what is wanted.
ASKED: dict[str, Check] = {
    "constraints": (
        lambda v: isinstance(v, dict) or (isinstance(v, str) and v != ""),
        "a table, or the path of a lights file",
    ),
    "settings": TABLE,
    "want": _some_of(get_args(Step)),
    "render": TABLE,
    "export": TABLE,
    "variations": _some_of(VARIATIONS),
}

#: Of which a look has exactly one.
SUBJECTS: dict[str, Check] = {
    "painting": TEXT,
    "paintings": TEXTS,
    "views": (_table_of(lambda v: isinstance(v, str) and v != ""), "a table, SENSOR = PAINTING"),
    "lighting": TEXT,
    "lightings": TEXTS,
}

DEFAULTS: dict[str, Check] = {**SOURCE, **PAINTED, **ASKED}
LOOK: dict[str, Check] = {"name": TEXT, **SUBJECTS, **DEFAULTS}
SEQUENCE: dict[str, Check] = {
    "name": TEXT,
    "through": (_texts, "a list of names of looks"),
    "sensors": TEXTS,
    "frames": whole(2, MOST_FRAMES),
    "space": one_of(Space),
    "want": _some_of(GIVEN),
    "render": TABLE,
    "export": TABLE,
}

#: Of `Settings`, what does not stand elsewhere in a manifest or on the command line.
SETTINGS = tuple(
    name
    for name in Settings.expected
    if name not in ("transform", "command", "force", "verify", "report", "use_cache")
)


@dataclass(frozen=True)
class Final:
    """A final render. spp: samples per pixel, the scene's by default. resolution: of the film."""

    spp: int | None = None
    resolution: str | None = None
    seed: int = 0


FINAL: dict[str, Check] = {"spp": whole(2, MAX_SPP), "resolution": TEXT, "seed": whole(0)}


@dataclass(frozen=True)
class Handover:
    """What other programs get. to: forms, as of `lightpaint export`. stage: of USD, by its path."""

    to: tuple[str, ...] = ("csv", "json")
    stage: str = ""


HANDOVER: dict[str, Check] = {"to": _some_of(FORMS), "stage": TEXT}


@dataclass
class Mistakes:
    """What is wrong, a line each, as it is found."""

    source: str
    found: list[str] = field(default_factory=list)

    def add(self, where: str, said: str) -> None:
        """One more. where: the look and the key; "" for the manifest as a whole."""
        line = one_line(f"{self.source}: {where}{': ' if where else ''}{said}", limit=1000)
        if line not in self.found:
            self.found.append(line)

    def keys(self, given: Mapping[str, Any], known: Mapping[str, Check], where: str) -> set[str]:
        """The keys of `given` that are as expected; what is wrong with the others is added."""
        right = set()
        for key, value in given.items():
            if key not in known:
                near = near_key(key, known)
                hint = f": did you mean {near!r}?" if near else f"; known are {', '.join(known)}"
                self.add(where, f"unknown key {key!r}{hint}")
                continue
            fits, words = known[key]
            if fits(value):
                right.add(key)
            else:
                self.add(where, f"{key} is {one_line(repr(value), limit=120)}: expected {words}")
        return right

    def unclear(
        self, given: Mapping[str, Any], known: Mapping[str, Check], right: Collection[str]
    ) -> frozenset[str]:
        """Return the keys that were meant where `given` is wrong. right: as of `keys`."""
        wrong = [key for key in given if key not in right]
        return frozenset(key if key in known else near_key(key, known) for key in wrong) - {""}

    def settings(self, given: Mapping[str, Any], where: str) -> dict[str, Any]:
        """Those of a table that mean something, by name."""
        known = {name: Settings.expected[name] for name in SETTINGS}
        right = self.keys(given, known, f"{where}, settings")
        said = {name: value for name, value in given.items() if name in right}
        try:
            Settings(**said)
        except LightpaintError as error:
            self.add(f"{where}, settings", str(error))
            return {}
        return said

    def final(self, given: Mapping[str, Any], where: str) -> Final:
        """The final render that a table asks for."""
        right = self.keys(given, FINAL, f"{where}, render")
        said = {name: value for name, value in given.items() if name in right}
        try:
            if "resolution" in said:
                check_resolution(said["resolution"])
        except LightpaintError as error:
            self.add(f"{where}, render", str(error))
            return Final()
        return Final(**said)

    def handover(self, given: Mapping[str, Any], where: str, base: Path) -> Handover:
        """What a table asks for other programs. base: what its paths are relative to."""
        right = self.keys(given, HANDOVER, f"{where}, export")
        said = {name: value for name, value in given.items() if name in right}
        made = Handover(tuple(said.get("to", Handover.to)), said.get("stage", ""))
        if made.stage and "usd" not in made.to:
            self.add(f"{where}, export", "stage is of the form 'usd': add that, or leave it out")
        return replace(made, stage=str(base / made.stage) if made.stage else "")


def near_key(key: str, known: Iterable[str]) -> str:
    """Return the key that may have been meant by a misspelt one; "" where none is near."""
    return next(iter(difflib.get_close_matches(key, list(known), 1)), "")
