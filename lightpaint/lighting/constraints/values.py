"""Values of constraints, as people write them: levels, colours, temperatures."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast, get_args

import numpy as np

from lightpaint import colour, validation
from lightpaint.arrays import RGB, as_rgb
from lightpaint.display_text import known_keys, some_names
from lightpaint.errors import ColorError, ConstraintError
from lightpaint.files import one_line
from lightpaint.sentences import SourceKey


@dataclass(frozen=True)
class Level:
    """A brightness: a luminance, an RGB emission, or a share of the current luminance."""

    amount: float | RGB
    is_share: bool = False

    def __str__(self) -> str:
        if isinstance(self.amount, tuple):
            return " ".join(f"{v:g}" for v in self.amount)
        return f"{100 * self.amount:g}%" if self.is_share else f"{self.amount:g}"


@dataclass(frozen=True)
class Lock:
    """An emission that is not solved for. color: of luminance 1. None keeps the current value."""

    level: Level | None = None
    color: RGB | None = None


def check_keys(table: Any, known: Iterable[str], where: SourceKey) -> None:
    """Raise ConstraintError unless it is a table of keys that are `known`."""
    if not isinstance(table, Mapping):
        raise ConstraintError(where, f" is {table!r}: expected keys like lock = true")
    if unknown := [key for key in table if key not in known]:
        key = unknown[0]
        raise ConstraintError(
            where, f" has the key {one_line(repr(key))}: {known_keys(str(key), known)}"
        )


def check_lengths(table: Mapping[str, Any], where: SourceKey) -> None:
    """Raise ConstraintError for a value that is longer than any valid one."""
    for key, value in table.items():
        texts = [*value] if isinstance(value, list | tuple) else [value]
        if key not in ("primaries", "emitters", "wheel"):  # which have limits of their own
            texts.append(value)
        if isinstance(value, Mapping):
            texts = [x for pair in value.items() for x in pair]
        for text in texts:
            if isinstance(text, str | list | tuple | Mapping) and len(text) > validation.MAX_NAME:
                raise ConstraintError(
                    where / key,
                    f" has a value of {len(text)} characters or numbers: at most "
                    f"{validation.MAX_NAME} are read",
                )


def parse_lock(value: Any, where: SourceKey) -> Lock:
    """Return the lock that `true`, a level, or a colour and a level ask for."""
    if value is True:
        return Lock()
    expected = "expected true, a level like 2.5 or 40%, three numbers, or a colour and a level"
    if isinstance(value, str):
        words = value.split()
        if len(words) not in (1, 2):
            raise ConstraintError(where, f" is {value!r}: {expected}, like '3200K 40%'")
        colors = [word for word in words if word.startswith("#") or word.upper().endswith("K")]
        levels = [word for word in words if word not in colors]
        if len(colors) > 1 or len(levels) > 1:
            raise ConstraintError(where, f" is {value!r}: {expected}, like '3200K 40%'")
        level = parse_level(levels[0], where, expected) if levels else None
        return Lock(level, parse_color(colors[0], where) if colors else None)
    return Lock(parse_level(value, where, expected))


def parse_level(value: Any, where: SourceKey, expected: str = "") -> Level:
    """Parse a level: `2.5`, `"40%"` or `[r, g, b]`."""
    expected = expected or "expected a luminance like 2.5, a share like 40%, or three numbers >= 0"
    if isinstance(value, str):
        text = value.strip()
        try:
            number = validation.parse_number(text.removesuffix("%"))
        except ValueError:
            number = -1.0
        if not validation.is_amount(number):
            raise ConstraintError(
                where, f" is {value!r}: {expected}, of at most {validation.BRIGHTEST:g}"
            )
        return Level(number / 100, is_share=True) if text.endswith("%") else Level(number)
    if validation.is_number(value) and validation.is_amount(value):
        return Level(float(value))
    if is_emission(value):
        return Level(as_rgb(value))
    raise ConstraintError(where, f" is {value!r}: {expected}, of at most {validation.BRIGHTEST:g}")


def parse_limits(value: Any, where: SourceKey) -> tuple[Level | None, Level | None]:
    """Parse least and most from a table of `min`, `max` or both."""
    check_keys(value, ("min", "max"), where)
    if not value:
        raise ConstraintError(where, " is empty: expected min, max or both")
    least, most = (
        parse_level(value[key], where / key) if key in value else None for key in ("min", "max")
    )
    if least and most and least.is_share == most.is_share:
        low, high = np.array(least.amount), np.array(most.amount)
        if low.ndim == high.ndim and (low > high).any():
            raise ConstraintError(where, f" has a min of {least} above its max of {most}")
    return least, most


def parse_primaries(table: Mapping[str, Any], where: SourceKey) -> tuple[RGB, ...] | None:
    """Return the colours that a light can mix, each of luminance 1; None if any colour will do."""
    if "color" in table:
        return (parse_color(table["color"], where / "color", duv=_parse_duv(table, where)),)
    if "kelvin" in table:
        ends = _parse_kelvins(table["kelvin"], where / "kelvin")
        return tuple(_parse_kelvin(x, _parse_duv(table, where), where / "kelvin") for x in ends)
    if "primaries" not in table:
        return None
    listed = table["primaries"]
    if not isinstance(listed, Sequence) or isinstance(listed, str) or not listed:
        raise ConstraintError(
            where / "primaries",
            f' is {one_line(repr(listed))}: expected a list of colours, ["#ff0000", "3000K"]',
        )
    if len(listed) > validation.MAX_PRIMARIES:
        raise ConstraintError(
            where / "primaries",
            f" lists {len(listed)} colours: at most {validation.MAX_PRIMARIES} can be mixed",
        )
    return tuple(parse_color(color, where / "primaries") for color in listed)


def parse_whites(table: Mapping[str, Any], where: SourceKey) -> colour.WhiteRange | None:
    """Return the range of white that a light keeps to; None without one."""
    ends = _parse_kelvins(table["kelvin"], where / "kelvin") if "kelvin" in table else []
    return colour.white_range(*ends, _parse_duv(table, where)) if len(ends) == 2 else None


def _parse_kelvins(value: Any, where: SourceKey) -> list[float]:
    """Return one temperature, or both ends of a range."""
    ends = [value] if validation.is_number(value) else value
    is_pair = isinstance(ends, Sequence) and not isinstance(ends, str) and len(ends) in (1, 2)
    is_range = is_pair and all(map(validation.is_number, ends))
    if is_range and sorted(ends) != list(ends):
        raise ConstraintError(
            where, f" runs from {ends[0]:g} to {ends[1]:g} K: give the lower temperature first"
        )
    if not is_range:
        raise ConstraintError(
            where,
            f" is {value!r}: expected a temperature, 3200, or a range from low to high, "
            "[2700, 6500]",
        )
    return [float(kelvin) for kelvin in dict.fromkeys(ends)]


def parse_color(value: Any, where: SourceKey, *, duv: float = 0.0) -> RGB:
    """Parse a colour: `"#ffaa66"`, `"3200K"` or `[r, g, b]`; return it at luminance 1."""
    try:
        if isinstance(value, str) and value.strip().startswith("#"):
            rgb = colour.hex_to_rgb(value)
        elif isinstance(value, str) and value.strip().upper().endswith("K"):
            return _parse_kelvin(validation.parse_number(value.strip()[:-1]), duv, where)
        elif is_emission(value):
            rgb = np.array(value, dtype=np.float64)
        else:
            raise ColorError(f"{value!r} is not a colour")
    except (ColorError, ValueError):
        raise ConstraintError(
            where, f" is {value!r}: expected a colour like #ffaa66, 3200K or three numbers >= 0"
        ) from None
    if not rgb.any():
        raise ConstraintError(
            where, f" is {value!r}, black, which is not a colour of light: use off"
        )
    return as_rgb(rgb / colour.luminance(rgb))


def _parse_kelvin(kelvin: float, duv: float, where: SourceKey) -> RGB:
    try:
        return as_rgb(colour.kelvin_to_rgb(kelvin, duv))
    except ColorError as error:
        raise ConstraintError(where, ": ", error) from None


def _parse_duv(table: Mapping[str, Any], where: SourceKey) -> float:
    duv = table.get("duv", 0.0)
    if not (validation.is_number(duv) and validation.is_amount(abs(duv))):
        raise ConstraintError(where / "duv", f" is {duv!r}: expected a number like 0.003")
    return float(duv)


def parse_strength(value: Any, where: SourceKey) -> float:
    """Return the strength of a pull."""
    if not (validation.is_number(value) and validation.is_amount(value)):
        raise ConstraintError(where, f" is {value!r}: expected a strength >= 0, like 0.1")
    return float(value)


def parse_start(start: Any, where: SourceKey) -> dict[str, RGB]:
    """Return emissions, three numbers, by name of light. Raises ConstraintError."""
    if not isinstance(start, Mapping):
        raise ConstraintError(where, f" is {start!r}: expected emissions by name of light")
    for name, emission in start.items():
        if not is_emission(emission):
            raise ConstraintError(
                where / str(name), f" is {emission!r}: expected an emission of three numbers >= 0"
            )
    return {str(name): as_rgb(emission) for name, emission in start.items()}


def parse_count(value: Any, where: SourceKey) -> int | None:
    """Return the largest number of lights; None for any number."""
    if value is not None and not (type(value) is int and value > 0):
        raise ConstraintError(where, f" is {value!r}: expected a whole number of lights > 0")
    return value


def parse_scale(value: Any, where: SourceKey) -> float | None:
    """Return cd/m² of a radiance of 1, if given."""
    if value is not None and not (
        validation.is_number(value) and 0 < value <= validation.BRIGHTEST
    ):
        raise ConstraintError(
            where, f" is {value!r}: expected candelas of an intensity of 1 in the scene, like 1000"
        )
    return None if value is None else float(value)


def parse_preference(value: Any, where: SourceKey) -> colour.Preference | None:
    """Return the preference among mixes of emitters, if there is one."""
    known = get_args(colour.Preference)
    if value is not None and value not in known:
        raise ConstraintError(
            where, f" is {one_line(repr(value))}: expected one of {', '.join(known)}"
        )
    return cast("colour.Preference | None", value)


def parse_power_share(table: Mapping[str, Any], where: SourceKey) -> float | None:
    """Return the largest power of a lamp's emitters, relative to the power of all at full."""
    value = table.get("power_share")
    if value is not None and not (validation.is_number(value) and 0 < value <= 1):
        raise ConstraintError(
            where / "power_share", f" is {value!r}: expected a share of full power like 0.6"
        )
    return None if value is None else float(value)


def parse_wheel(table: Mapping[str, Any], where: SourceKey, slots: Sequence[str]) -> bool | str:
    """Return whether emitters are slots of a colour wheel, or the name of one at which it stays."""
    value = table.get("wheel", False)
    if isinstance(value, list | tuple):  # slots in front of emitters that mix
        return False
    if not (isinstance(value, bool) or value in slots):
        raise ConstraintError(
            where / "wheel",
            f" is {one_line(repr(value))}: expected true, or one of its slots, {some_names(slots)}",
        )
    return cast("bool | str", value)


def parse_rf(table: Mapping[str, Any], where: SourceKey) -> float | None:
    """Return the least fidelity index Rf of a lamp's mix."""
    value = table.get("rf")
    if value is not None and not (validation.is_number(value) and 0 < value <= 100):
        raise ConstraintError(
            where / "rf",
            f" is {one_line(repr(value))}: expected the least Rf of TM-30, above 0 and at most "
            "100, like 85",
        )
    return None if value is None else float(value)


def describe_constraint(key: str, value: Any) -> str:
    """Return a key and its value in few words, for tables."""
    if value is True:
        return key
    if key == "limits":
        return f"limits {_text(value.get('min', 0))} to {_text(value.get('max', '∞'))}"
    if key == "emitters":
        return " + ".join(str(emitter["name"]) for emitter in value)
    if key == "wheel" and not isinstance(value, str):
        return f"wheel of {len(value)} slots"
    if key == "wheel":
        return f"wheel at {value}"
    if key == "rf":
        return f"Rf ≥ {value:g}"
    if key == "power_share":
        return f"{100 * value:g}% of full power"
    if key == "kelvin" and isinstance(value, Sequence):
        return f"{_text(value[0])} to {_text(value[-1])} K"
    return f"{_text(value)} K" if key == "kelvin" else f"{key} {_text(value)}"


def _text(value: Any) -> str:
    if isinstance(value, Sequence) and not isinstance(value, str):
        return " ".join(map(_text, value))
    return f"{value:g}" if validation.is_number(value) else str(value)


def is_emission(value: Any) -> bool:
    """Return whether a value is three numbers >= 0, of an emission or a colour."""
    return (
        isinstance(value, Sequence)
        and not isinstance(value, str)
        and len(value) == 3
        and all(validation.is_number(v) and validation.is_amount(v) for v in value)
    )
