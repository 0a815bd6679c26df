"""Types for argparse: from the text of an option to its value."""

import argparse
import math
from collections.abc import Callable
from typing import Any

from lightpaint.validation import BRIGHTEST, parse_number, parse_whole_number


def key_value(text: str) -> tuple[str, str]:
    """Parse a parameter of the scene, `key=value`."""
    key, equals, value = text.partition("=")
    if not key or not equals:
        raise argparse.ArgumentTypeError(f"{text!r} is not key=value")
    return key, value


def sensor_target(text: str) -> tuple[str, str]:
    """Parse a painting with its sensor, `SENSOR=TARGET`."""
    sensor, _, target = text.partition("=")
    if not sensor or not target:
        raise argparse.ArgumentTypeError(f"{text!r} is not SENSOR=TARGET")
    return sensor, target


def names_of(text: str) -> list[str]:
    """Parse names with commas, `a,b,c`."""
    names = [name.strip() for name in text.split(",")]
    if not all(names):
        raise argparse.ArgumentTypeError(f"{text!r} is not a list of names, a,b,c")
    return names


def group(text: str) -> tuple[str, list[str]]:
    """Parse a group and its members, `name=a,b,c`."""
    name, equals, members = text.partition("=")
    if not name.strip() or not equals:
        raise argparse.ArgumentTypeError(f"{text!r} is not name=a,b,c")
    return name.strip(), names_of(members)


def image_size(text: str) -> tuple[str, str]:
    """Parse a light and the size of its image, `NAME=16x8`; `none` for no images."""
    if text.strip() == "none":
        return "", ""
    name, equals, size = text.rpartition("=")
    if not name.strip() or not equals or not size.strip():
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=COLUMNSxROWS, such as sky=16x8")
    return name.strip(), size.strip()


def signed_number(text: str) -> float:
    """Parse any finite number."""
    try:
        value = parse_number(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text!r} is not a number")
    return value


def light_value(text: str) -> tuple[str, Any]:
    """Parse a value for a light, `NAME=VALUE`."""
    name, equals, value = text.rpartition("=")
    if not name.strip() or not equals or not value.strip():
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=VALUE")
    return name.strip(), _value(value)


def light_number(text: str) -> tuple[str, float]:
    """Parse a number for a light, `NAME=85`."""
    name, value = light_value(text)
    try:
        return name, parse_number(value)
    except (AttributeError, TypeError, ValueError):
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=NUMBER") from None


def _value(text: str) -> Any:
    """Return three numbers with commas as a list; anything else as text."""
    parts = text.strip().split(",")
    try:
        return [parse_number(part) for part in parts] if len(parts) > 1 else text.strip()
    except ValueError:
        return text.strip()


def lock(text: str) -> tuple[str, Any]:
    """Parse a light to keep as it is, `NAME_FIELD`, or at a level, `NAME=LEVEL`."""
    return light_value(text) if "=" in text else (text.strip(), True)


def limits(text: str) -> tuple[str, dict[str, Any]]:
    """Parse levels to stay between, `NAME=MIN:MAX`."""
    if "=" not in text:
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=MIN:MAX")
    name, value = light_value(text)
    min_text, colon, max_text = str(text.rpartition("=")[2]).partition(":")
    if not colon:
        raise argparse.ArgumentTypeError(f"{value!r} is not MIN:MAX; one of them may be left out")
    return name, {k: _value(v) for k, v in (("min", min_text), ("max", max_text)) if v.strip()}


def kelvin(text: str) -> tuple[str, list[float], float | None]:
    """Parse name, temperatures, and Duv if given."""
    try:
        main, comma, option = text.partition(",")
        key, _, duv = option.partition("=")
        name, value = light_value(main)
        ends = [parse_number(end.strip().upper().removesuffix("K")) for end in value.split(":")]
        if comma and key.strip() != "duv":
            raise ValueError(key)
        return name, ends, parse_number(duv) if comma else None
    except (ValueError, AttributeError):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not NAME=2700:6500 or NAME=3200, with or without ,duv=0.003 after it"
        ) from None


class Kelvin(argparse.Action):
    """An action that stores temperatures in `kelvin` and distances from the locus in `duv`."""

    def __call__(
        self, _parser: Any, options: argparse.Namespace, parsed_value: Any, *_: Any
    ) -> None:
        name, ends, duv = parsed_value
        options.kelvin = [*options.kelvin, (name, ends)]
        # The last option of a light counts, even if it has no duv.
        options.duv = [entry for entry in options.duv if entry[0] != name]
        options.duv += [] if duv is None else [(name, duv)]


def move(text: str) -> tuple[str, Any]:
    """Parse where a light may go, `NAME=METRES` or `NAME=@RAIL`."""
    name, value = light_value(text)
    if isinstance(value, str) and value.startswith("@") and value[1:].strip():
        return name, {"on": value[1:].strip()}
    return name, _number_of(text, value, "NAME=1.0, in units of the scene, or NAME=@RAIL")


def aim(text: str) -> tuple[str, Any]:
    """Parse how far a light may turn, `NAME=DEGREES` or `NAME=any`."""
    name, value = light_value(text)
    return name, True if value == "any" else _number_of(text, value, "NAME=30 or NAME=any")


def cone(text: str) -> tuple[str, list[float]]:
    """Parse how wide a spot may open, `NAME=LEAST:MOST`."""
    name, value = light_value(text)
    return name, _angles(text, value, "NAME=10:45, in degrees")


def beam(text: str) -> tuple[str, list[float] | bool]:
    """Parse how wide the beam of a spot may be, `NAME=LEAST:MOST` or `NAME=any`."""
    name, value = light_value(text)
    expected = "NAME=5:20, in degrees, or NAME=any"
    return name, True if value == "any" else _angles(text, value, expected)


def _angles(text: str, value: Any, expected: str) -> list[float]:
    """Return the ends of `LEAST:MOST`; of one number, both are that."""
    least, colon, most = str(value).partition(":")
    return [_number_of(text, end, expected) for end in ((least, most) if colon else (least,) * 2)]


def new_light(text: str) -> dict[str, Any]:
    """Parse lights to add, `KIND[:COUNT][@WHERE]`."""
    kind_and_count, separator, place = text.partition("@")
    kind, colon, count = kind_and_count.partition(":")
    if (
        not kind.strip()
        or (separator and not place.strip())
        or (colon and not (count.isascii() and count.strip().isdecimal()))
    ):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not KIND, KIND:2 or KIND:2@WHERE, like spot:2@ceiling"
        )
    from lightpaint.placement import LIGHT_KINDS

    table: dict[str, Any] = {"kind" if kind in LIGHT_KINDS else "like": kind.strip()}
    table |= {"count": parse_whole_number(count)} if colon else {}
    return table | ({"on": names_of(place)} if separator else {})


def _number_of(text: str, value: Any, expected: str) -> float:
    try:
        return parse_number(value)
    except (TypeError, ValueError):
        raise argparse.ArgumentTypeError(f"{text!r} is not {expected}") from None


def primaries(text: str) -> tuple[str, list[str]]:
    """Parse colours to mix, `NAME=COLOR,...`."""
    name, _ = light_value(text)
    return name, names_of(text.rpartition("=")[2])


class at_least:  # noqa: N801 (used as a function)
    """A type for integers with a lower bound, and maybe an upper one."""

    def __init__(self, bound: int, *, maximum: int | None = None) -> None:
        self.bound, self.maximum = bound, maximum

    def __call__(self, text: str) -> int:
        try:
            value = parse_whole_number(text)
        except ValueError:
            value = self.bound - 1
        if value < self.bound:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number >= {self.bound}")
        if self.maximum is not None and value > self.maximum:
            raise argparse.ArgumentTypeError(
                f"{text!r} is too large: expected at most {self.maximum}"
            )
        return value


def parsed_by(parse: Callable[[str], Any]) -> Callable[[str], Any]:
    """Return a type that parses text with a function whose ValueError says what is wrong."""

    def parsed(text: str) -> Any:
        try:
            return parse(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(str(error)) from None

    return parsed


class number:  # noqa: N801 (used as a function)
    """A type for numbers > 0, or >= 0, up to `maximum`.

    quantity: the quantity, with a space before.
    """

    def __init__(
        self, quantity: str = "", *, may_be_zero: bool = False, maximum: float = BRIGHTEST
    ) -> None:
        self.quantity, self.may_be_zero, self.maximum = quantity, may_be_zero, maximum

    def __call__(self, text: str) -> float:
        try:
            value = parse_number(text)
        except ValueError:
            value = -1.0
        if not (0 < value <= self.maximum or (self.may_be_zero and value == 0)):
            bound = ">= 0" if self.may_be_zero else "> 0"
            if value > self.maximum:
                bound = f"<= {self.maximum:g}"
            raise argparse.ArgumentTypeError(f"{text!r} is not a number{self.quantity} {bound}")
        return value
