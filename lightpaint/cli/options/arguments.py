"""What stands behind an option, from text to values; argparse calls these as types."""

import argparse
from typing import Any

from lightpaint.validation import BRIGHTEST


def key_value(text: str) -> tuple[str, str]:
    """A parameter of the scene, `key=value`."""
    key, equals, value = text.partition("=")
    if not key or not equals:
        raise argparse.ArgumentTypeError(f"{text!r} is not key=value")
    return key, value


def sensor_target(text: str) -> tuple[str, str]:
    """A painting with its sensor, `SENSOR=TARGET`."""
    sensor, _, target = text.partition("=")
    if not sensor or not target:
        raise argparse.ArgumentTypeError(f"{text!r} is not SENSOR=TARGET")
    return sensor, target


def names_of(text: str) -> list[str]:
    """Names with commas, `a,b,c`."""
    names = [name.strip() for name in text.split(",")]
    if not all(names):
        raise argparse.ArgumentTypeError(f"{text!r} is not a list of names, a,b,c")
    return names


def group(text: str) -> tuple[str, list[str]]:
    """A group and its members, `name=a,b,c`."""
    name, equals, members = text.partition("=")
    if not name.strip() or not equals:
        raise argparse.ArgumentTypeError(f"{text!r} is not name=a,b,c")
    return name.strip(), names_of(members)


def named(text: str) -> tuple[str, Any]:
    """What is asked of a light, `NAME=VALUE`."""
    name, equals, value = text.rpartition("=")
    if not name.strip() or not equals or not value.strip():
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=VALUE")
    return name.strip(), _value(value)


def _value(text: str) -> Any:
    """Three numbers with commas; anything else as it is."""
    parts = text.strip().split(",")
    try:
        return [float(part) for part in parts] if len(parts) > 1 else text.strip()
    except ValueError:
        return text.strip()


def lock(text: str) -> tuple[str, Any]:
    """A light to be left as it is, `NAME`, or at a level, `NAME=LEVEL`."""
    return named(text) if "=" in text else (text.strip(), True)


def limits(text: str) -> tuple[str, dict[str, Any]]:
    """Levels to stay between, `NAME=MIN:MAX`."""
    if "=" not in text:
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=MIN:MAX")
    name, value = named(text)
    least, colon, most = str(text.rpartition("=")[2]).partition(":")
    if not colon:
        raise argparse.ArgumentTypeError(f"{value!r} is not MIN:MAX; one of them may be left out")
    return name, {k: _value(v) for k, v in (("min", least), ("max", most)) if v.strip()}


def kelvin(text: str) -> tuple[str, list[float], float | None]:
    """Name, temperatures, and Duv if that was given."""
    try:
        told, comma, away = text.partition(",")
        key, _, duv = away.partition("=")
        name, value = named(told)
        ends = [float(end.strip().upper().removesuffix("K")) for end in value.split(":")]
        if comma and key.strip() != "duv":
            raise ValueError(key)
        return name, ends, float(duv) if comma else None
    except (ValueError, AttributeError):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not NAME=2700:6500 or NAME=3200, with or without ,duv=0.003 after it"
        ) from None


class Kelvin(argparse.Action):
    """Puts temperatures to `kelvin` and what they are away from Planck's locus to `duv`."""

    def __call__(self, _parser: Any, options: argparse.Namespace, given: Any, *_: Any) -> None:
        name, ends, duv = given
        options.kelvin = [*options.kelvin, (name, ends)]
        # What is said last of a light holds: also that it is on the locus.
        options.duv = [entry for entry in options.duv if entry[0] != name]
        options.duv += [] if duv is None else [(name, duv)]


def primaries(text: str) -> tuple[str, list[str]]:
    """Colours to mix, `NAME=COLOR,...`."""
    name, _ = named(text)
    return name, names_of(text.rpartition("=")[2])


class at_least:  # noqa: N801 (used as a function)
    """An integer no smaller than a bound, and maybe no larger than another."""

    def __init__(self, bound: int, *, most: int | None = None) -> None:
        self.bound, self.most = bound, most

    def __call__(self, text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = self.bound - 1
        if value < self.bound:
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number >= {self.bound}")
        if self.most is not None and value > self.most:
            raise argparse.ArgumentTypeError(f"{text!r} is too much: at most {self.most}")
        return value


class number:  # noqa: N801 (used as a function)
    """A number > 0, or >= 0, of no more than can be computed with, or than `most`.

    about: what it is a number of, with a space before.
    """

    def __init__(
        self, about: str = "", *, may_be_zero: bool = False, most: float = BRIGHTEST
    ) -> None:
        self.about, self.may_be_zero, self.most = about, may_be_zero, most

    def __call__(self, text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = -1.0
        if not (0 < value <= self.most or (self.may_be_zero and value == 0)):
            bound = ">= 0" if self.may_be_zero else "> 0"
            if value > self.most:
                bound = f"<= {self.most:g}"
            raise argparse.ArgumentTypeError(f"{text!r} is not a number{self.about} {bound}")
        return value
