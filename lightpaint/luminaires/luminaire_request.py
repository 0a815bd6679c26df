"""Luminaires of a lights file: their photometric files, and how they hang and dim."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from lightpaint.errors import SceneError
from lightpaint.files import one_line
from lightpaint.luminaires.web import PhotometricWeb
from lightpaint.luminaires.web_file import read_web
from lightpaint.validation import BRIGHTEST, is_number

#: Key of a light in `[light.NAME]` for its photometric file, and keys that go with it.
PHOTOMETRY = "photometry"
AMOUNTS, ANGLES = ("lumens", "factor", "watts"), ("turn", "tilt")
LUMINAIRE_KEYS = (PHOTOMETRY, *AMOUNTS, *ANGLES)

#: Parameters of a luminaire's emitter that are numbers.
NUMBER_KEYS = ("lumens", "factor", "cd_per_unit", "turn", "tilt")


@dataclass(frozen=True)
class LuminaireRequest:
    """A luminaire of a lights file.

    path: of its photometric file. lumens: its flux at full, instead of the file's. factor: for
    maintenance and other losses. input_watts: its power at full, instead of the file's. turn, tilt:
    degrees, as in `turned`. has_absolute_emitters: whether emitters in candela or lumens say how
    bright it is, so that the file gives directions alone.
    """

    path: Path
    lumens: float | None = None
    factor: float = 1.0
    input_watts: float | None = None
    turn: float = 0.0
    tilt: float = 0.0
    has_absolute_emitters: bool = False

    @classmethod
    def of(cls, table: Mapping[str, Any], where: str, folder: Path) -> "LuminaireRequest":
        """Return the luminaire in the table of a light. folder: of the lights file.

        Raises SceneError, which begins with `where`, for invalid values.
        """
        name = table[PHOTOMETRY]
        if not isinstance(name, str) or not name:
            raise SceneError(
                f"{where}.{PHOTOMETRY} is {one_line(repr(name))}: expected the name of an IES or "
                "EULUMDAT file"
            )
        for key in (*AMOUNTS, *ANGLES):
            value = table.get(key, 1)
            if key in ANGLES and not (is_number(value) and abs(value) <= 360):
                expected = "degrees, such as 30"
            elif key in AMOUNTS and not (is_number(value) and 0 < value <= BRIGHTEST):
                expected = "a number above 0"
            else:
                continue
            raise SceneError(f"{where}.{key} is {one_line(repr(value))}: expected {expected}")
        return cls(
            folder / name,
            table.get("lumens"),
            float(table.get("factor", 1.0)),
            table.get("watts"),
            float(table.get("turn", 0.0)),
            float(table.get("tilt", 0.0)),
            _are_absolute(table.get("emitters")),
        )

    @cached_property
    def web(self) -> PhotometricWeb:
        """Its photometric web. Raises SceneError if the file cannot be read."""
        return read_web(self.path)

    @property
    def watts(self) -> float | None:
        """Its input power at full; None if neither says it."""
        return self.web.watts if self.input_watts is None else self.input_watts

    def tilted(self, degrees: float) -> "LuminaireRequest":
        """Return this luminaire with the loss that its file states for hanging tilted.

        degrees: from its nadir to downwards. What emitters say of themselves is kept.
        """
        factor = 1.0 if self.has_absolute_emitters else self.web.factor_at(degrees)
        return replace(self, factor=self.factor * factor)

    def scale(self, cd_per_unit: float) -> float:
        """Return the factor of the candela of its file in a scene."""
        own = 1.0 if self.lumens is None else self.lumens / self.web.flux
        return own * self.factor / cd_per_unit

    def parameters(self, cd_per_unit: float) -> dict[str, float]:
        """Return the numbers of its emitter that differ from their defaults."""
        numbers = {
            "factor": self.factor,
            "cd_per_unit": cd_per_unit,
            "turn": self.turn,
            "tilt": self.tilt,
        }
        defaults = {"factor": 1.0, "cd_per_unit": 1.0, "turn": 0.0, "tilt": 0.0}
        changed = {key: x for key, x in numbers.items() if x != defaults[key]}
        return changed if self.lumens is None else {"lumens": float(self.lumens), **changed}


def _are_absolute(emitters: Any) -> bool:
    """Return whether all emitters of a table are in candela or lumens."""
    is_list = isinstance(emitters, list) and len(emitters) > 0
    return is_list and all(isinstance(x, Mapping) and {"cd", "lm"} & x.keys() for x in emitters)


def luminaires_in(tables: Any, source: str) -> dict[str, LuminaireRequest]:
    """Return the luminaires among the tables `[light.NAME]` of the lights file `source`.

    Raises SceneError for invalid values, and for keys that need a photometric file.
    """
    luminaires = {}
    for name, table in tables.items() if isinstance(tables, Mapping) else ():
        if not isinstance(table, Mapping):
            continue
        where = f"{source}: light.{one_line(str(name))}"
        if PHOTOMETRY in table:
            luminaires[name] = LuminaireRequest.of(table, where, Path(source).parent)
        elif missing := [key for key in LUMINAIRE_KEYS if key in table]:
            raise SceneError(f"{where} has {missing[0]} without {PHOTOMETRY}, which it belongs to")
    return luminaires
