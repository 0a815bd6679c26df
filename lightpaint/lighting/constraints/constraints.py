"""What may be asked of lights, in the terms of people who light: locked, limited, dimmed.

The same keys and values stand in a lights file, in options of the command line and in
`Constraints.of`. They are checked here, when they are born; `reduction.py` makes of them
the unknowns of the solve. docs/formats.md lists them.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from lightpaint.arrays import RGB
from lightpaint.colour.color import hex_to_rgb, kelvin_to_rgb, luminance
from lightpaint.errors import ColorError, ConstraintError
from lightpaint.screen import shortly

#: What may be asked of one light.
LIGHT_KEYS = ("lock", "off", "limits", "color", "kelvin", "duv", "primaries")

#: Of these a light can have one: each says which colours it has.
COLOURS = ("color", "kelvin", "primaries")


@dataclass(frozen=True)
class Level:
    """How bright: a luminance, an RGB emission, or a share of the present luminance."""

    amount: float | RGB
    is_share: bool = False

    def __str__(self) -> str:
        if isinstance(self.amount, tuple):
            return " ".join(f"{v:g}" for v in self.amount)
        return f"{100 * self.amount:g}%" if self.is_share else f"{self.amount:g}"


@dataclass(frozen=True)
class Lock:
    """Not to be solved for. color: of luminance 1; what is None is as it is at present."""

    level: Level | None = None
    color: RGB | None = None


@dataclass(frozen=True)
class LightConstraint:
    """What is asked of one light.

    lock: to stay at this. off: to be black. least, most: limits of its emission.
    primaries: the colours it can mix, each of luminance 1: one for a fixed colour, the two
    ends of a range of white, the LEDs of a fixture; None if any colour will do.
    label: all this in few words. where: what errors call it.
    """

    lock: Lock | None = None
    off: bool = False
    least: Level | None = None
    most: Level | None = None
    primaries: tuple[RGB, ...] | None = None
    label: str = ""
    where: str = ""

    @classmethod
    def of(cls, asked: Mapping[str, Any], *, where: str = "constraint") -> "LightConstraint":
        """From keys and values as they stand in a lights file.

        Raises ConstraintError for values that mean nothing, and for keys that contradict
        each other.
        """
        _check_keys(asked, LIGHT_KEYS, where)
        asked = {key: value for key, value in asked.items() if value is not False}
        _check_contradictions(asked, where)
        lock = _lock(asked["lock"], f"{where}.lock") if "lock" in asked else None
        if "off" in asked and asked["off"] is not True:
            raise ConstraintError(f"{where}.off is {asked['off']!r}: expected true or false")
        least, most = (
            _limits(asked["limits"], f"{where}.limits") if "limits" in asked else (None,) * 2
        )
        primaries = _primaries(asked, where)
        if lock is not None and primaries is not None:
            if lock.level is None or lock.color is not None or isinstance(lock.level.amount, tuple):
                raise ConstraintError(
                    f"{where} has a lock that holds its colour and {_first(asked, COLOURS)!r} that "
                    "sets one: lock it at a number or at a percentage, or leave one out"
                )
            if len(primaries) > 1:
                raise ConstraintError(
                    f"{where} has both lock and {_first(asked, COLOURS)!r}, which leaves the mix "
                    "of its colours open: lock it at a colour"
                )
            lock, primaries = Lock(lock.level, primaries[0]), None
        label = ", ".join(_described(key, asked[key]) for key in LIGHT_KEYS if key in asked)
        return cls(lock, "off" in asked, least, most, primaries, label, where)


@dataclass(frozen=True)
class Tie:
    """Lights on one dimmer: names or patterns. color: of all of them; None for their own."""

    lights: tuple[str, ...]
    color: RGB | None = None
    where: str = "tie"

    def __post_init__(self) -> None:
        if not self.lights or not all(isinstance(x, str) and x for x in self.lights):
            raise ConstraintError(f"{self.where}: expected names of at least two lights")


@dataclass(frozen=True)
class Constraints:
    """What is asked of the lights, besides to come close to the painting.

    Attributes:
        lights: Name or pattern, what is asked of it, and what errors call it. What stands later
            replaces what it contradicts; `of` puts patterns before names.
        ties: Lights on one dimmer.
        prefer_current: Strength of the pull towards the present lighting. At 1 a light that changes
            costs as much as if the whole picture it makes, painted or not, were missed.
        sparse: How many lights may be on at most.

    Examples:
        >>> asked = lp.Constraints.of({"panel": {"lock": True}})
        >>> lighting = lp.solve(basis, target, constraints=asked).lighting
        >>> np.round(lighting.emission["panel"], 3).tolist()
        [4.0, 3.0, 2.0]
    """

    lights: tuple[tuple[str, Mapping[str, Any], str], ...] = ()
    ties: tuple[Tie, ...] = ()
    prefer_current: float = 0.0
    sparse: int | None = None

    __repr__ = shortly

    def __bool__(self) -> bool:
        return bool(self.lights or self.ties or self.prefer_current or self.sparse is not None)

    @classmethod
    def of(
        cls,
        light: Mapping[str, Mapping[str, Any]] | None = None,
        *,
        tie: Sequence[Any] = (),
        prefer_current: float = 0.0,
        sparse: int | None = None,
        where: str = "",
    ) -> "Constraints":
        """From what a lights file says.

        light: name or pattern → keys and values (`{"key": {"color": "3200K"}}`).
        tie: lists of names, or tables with `lights` and `color`; one list of names is one tie.
        where: what errors call the source.

        Raises ConstraintError, naming the light, the key and what is expected.
        """
        lead = f"{where}: " if where else ""
        if not isinstance(light, Mapping | None):
            raise ConstraintError(f"{lead}light is {light!r}: expected tables [light.NAME]")
        lights = []
        for name, asked in (light or {}).items():
            # Looked at now, so that no mistake waits for the light to be met.
            LightConstraint.of(asked, where=f"{lead}light.{name}")
            lights.append((name, dict(asked), f"{lead}light.{name}"))
        lights.sort(key=lambda entry: not is_pattern(entry[0]))
        return cls(
            tuple(lights),
            _ties(tie, f"{lead}tie"),
            _strength(prefer_current, f"{lead}prefer"),
            _count(sparse, f"{lead}sparse"),
        )

    def and_then(self, others: "Constraints") -> "Constraints":
        """These and `others`, which replace what they contradict, ties of the same lights too.

        What both say is said once: `a.and_then(a.and_then(b)) == a.and_then(b)`.
        """
        tied = [set(tie.lights) for tie in others.ties]
        return Constraints(
            tuple(x for x in self.lights if x not in others.lights) + others.lights,
            tuple(x for x in self.ties if set(x.lights) not in tied) + others.ties,
            others.prefer_current or self.prefer_current,
            self.sparse if others.sparse is None else others.sparse,
        )


def is_pattern(name: str) -> bool:
    """Whether `name` can stand for several lights."""
    return any(c in name for c in "*?[")


def overlaid(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Keys of `below` that `above` does not contradict, and all of `above`."""
    gone = set(above)
    for key, value in above.items():
        gone |= set(_CONTRADICTS.get(key, ())) if value is not False else set()
    if gone & {"color", "kelvin"}:
        gone.add("duv")
    return {**{k: v for k, v in below.items() if k not in gone}, **above}


_CONTRADICTS = {
    "lock": ("off", "limits", *COLOURS),
    "off": ("lock", "limits", *COLOURS),
    "limits": ("lock", "off"),
    **{key: ("lock", "off", *(x for x in COLOURS if x != key)) for key in COLOURS},
}


def _check_keys(asked: Any, known: Iterable[str], where: str) -> None:
    if not isinstance(asked, Mapping):
        raise ConstraintError(f"{where} is {asked!r}: expected keys like lock = true")
    if unknown := [key for key in asked if key not in known]:
        raise ConstraintError(f"{where} has the key {unknown[0]!r}: known are {', '.join(known)}")


def _check_contradictions(asked: Mapping[str, Any], where: str) -> None:
    for first in LIGHT_KEYS:
        for second in _CONTRADICTS.get(first, ()):
            # A fixed colour and a level to lock it at go together.
            if (
                first in asked
                and second in asked
                and not ("lock" in (first, second) and {first, second} & set(COLOURS))
            ):
                raise ConstraintError(
                    f"{where} has both {first!r} and {second!r}, which contradict each other: "
                    "leave one out"
                )
    if "duv" in asked and not (
        "kelvin" in asked or str(asked.get("color", "")).upper().endswith("K")
    ):
        raise ConstraintError(f"{where} has 'duv' without a 'kelvin' that it is the distance from")


def _lock(value: Any, where: str) -> Lock:
    if value is True:
        return Lock()
    expected = "expected true, a level like 2.5 or 40%, three numbers, or a colour and a level"
    if isinstance(value, str):
        words = value.split()
        if len(words) not in (1, 2):
            raise ConstraintError(f"{where} is {value!r}: {expected}, like '3200K 40%'")
        colors = [word for word in words if word.startswith("#") or word.upper().endswith("K")]
        levels = [word for word in words if word not in colors]
        if len(colors) > 1 or len(levels) > 1:
            raise ConstraintError(f"{where} is {value!r}: {expected}, like '3200K 40%'")
        level = level_of(levels[0], where, expected) if levels else None
        return Lock(level, color_of(colors[0], where) if colors else None)
    return Lock(level_of(value, where, expected))


def level_of(value: Any, where: str, expected: str = "") -> Level:
    """A level from `2.5`, `"40%"` or `[r, g, b]`."""
    expected = expected or "expected a luminance like 2.5, a share like 40%, or three numbers >= 0"
    if isinstance(value, str):
        text = value.strip()
        try:
            number = float(text.removesuffix("%"))
        except ValueError:
            number = -1.0
        if not 0 <= number < math.inf:
            raise ConstraintError(f"{where} is {value!r}: {expected}")
        return Level(number / 100, is_share=True) if text.endswith("%") else Level(number)
    if _is_number(value) and 0 <= value < math.inf:
        return Level(float(value))
    if _is_rgb(value):
        r, g, b = (float(v) for v in value)
        return Level((r, g, b))
    raise ConstraintError(f"{where} is {value!r}: {expected}")


def _limits(value: Any, where: str) -> tuple[Level | None, Level | None]:
    _check_keys(value, ("min", "max"), where)
    if not value:
        raise ConstraintError(f"{where} is empty: expected min, max or both")
    least, most = (
        level_of(value[key], f"{where}.{key}") if key in value else None for key in ("min", "max")
    )
    if least and most and least.is_share == most.is_share:
        low, high = np.array(least.amount), np.array(most.amount)
        if low.ndim == high.ndim and (low > high).any():
            raise ConstraintError(f"{where} has a min of {least} above its max of {most}")
    return least, most


def _primaries(asked: Mapping[str, Any], where: str) -> tuple[RGB, ...] | None:
    if "color" in asked:
        return (color_of(asked["color"], f"{where}.color", duv=_duv(asked, where)),)
    if "kelvin" in asked:
        return _white(asked["kelvin"], _duv(asked, where), f"{where}.kelvin")
    if "primaries" not in asked:
        return None
    given = asked["primaries"]
    if not isinstance(given, Sequence) or isinstance(given, str) or not given:
        raise ConstraintError(
            f'{where}.primaries is {given!r}: expected a list of colours, ["#ff0000", "3000K"]'
        )
    return tuple(color_of(color, f"{where}.primaries") for color in given)


def _white(value: Any, duv: float, where: str) -> tuple[RGB, ...]:
    """One colour for one temperature, and for a range the colours at its ends."""
    ends = [value] if _is_number(value) else value
    is_range = isinstance(ends, Sequence) and not isinstance(ends, str) and len(ends) in (1, 2)
    if not is_range or not all(map(_is_number, ends)) or sorted(ends) != list(ends):
        raise ConstraintError(
            f"{where} is {value!r}: expected a temperature, 3200, or a range from low to high, "
            "[2700, 6500]"
        )
    return tuple(_kelvin(float(kelvin), duv, where) for kelvin in dict.fromkeys(ends))


def color_of(value: Any, where: str, *, duv: float = 0.0) -> RGB:
    """A colour of luminance 1 from `"#ffaa66"`, `"3200K"` or `[r, g, b]`."""
    try:
        if isinstance(value, str) and value.strip().startswith("#"):
            rgb = hex_to_rgb(value)
        elif isinstance(value, str) and value.strip().upper().endswith("K"):
            return _kelvin(float(value.strip()[:-1]), duv, where)
        elif _is_rgb(value):
            rgb = np.array(value, dtype=np.float64)
        else:
            raise ColorError(f"{value!r} is no colour")
    except (ColorError, ValueError):
        raise ConstraintError(
            f"{where} is {value!r}: expected a colour like #ffaa66, 3200K or three numbers >= 0"
        ) from None
    if not rgb.any():
        raise ConstraintError(f"{where} is {value!r}, black, which is no colour of light: say off")
    return _rgb(rgb / luminance(rgb))


def _kelvin(kelvin: float, duv: float, where: str) -> RGB:
    try:
        return _rgb(kelvin_to_rgb(kelvin, duv))
    except ColorError as error:
        raise ConstraintError(f"{where}: {error}") from None


def _duv(asked: Mapping[str, Any], where: str) -> float:
    duv = asked.get("duv", 0.0)
    if not (_is_number(duv) and math.isfinite(duv)):
        raise ConstraintError(f"{where}.duv is {duv!r}: expected a number like 0.003")
    return float(duv)


def _ties(given: Any, where: str) -> tuple[Tie, ...]:
    expected = f'{where} is {given!r}: expected lists of names, [["a", "b"]], or tables [[tie]]'
    if isinstance(given, str | Mapping) or not isinstance(given, Sequence):
        raise ConstraintError(expected)
    if given and all(isinstance(name, str) for name in given):
        given = [given]  # one tie
    ties = []
    for entry in given:
        if isinstance(entry, Mapping):
            _check_keys(entry, ("lights", "color"), where)
            names = entry.get("lights")
            color = color_of(entry["color"], f"{where}.color") if "color" in entry else None
        else:
            names, color = entry, None
        if isinstance(names, str) or not isinstance(names, Sequence):
            raise ConstraintError(expected)
        ties.append(Tie(tuple(names), color, where))
    return tuple(ties)


def _strength(value: Any, where: str) -> float:
    if isinstance(value, Mapping):
        _check_keys(value, ("current",), where)
        value, where = value.get("current", 0.0), f"{where}.current"
    if not (_is_number(value) and 0 <= value < math.inf):
        raise ConstraintError(f"{where} is {value!r}: expected a strength >= 0, like 0.1")
    return float(value)


def _count(value: Any, where: str) -> int | None:
    if value is not None and not (type(value) is int and value > 0):
        raise ConstraintError(f"{where} is {value!r}: expected a whole number of lights > 0")
    return value


def _described(key: str, value: Any) -> str:
    """A key and its value in few words, for tables."""
    if value is True:
        return key
    if key == "limits":
        return f"limits {_text(value.get('min', 0))} to {_text(value.get('max', '∞'))}"
    if key == "kelvin" and isinstance(value, Sequence):
        return f"{_text(value[0])} to {_text(value[-1])} K"
    return f"{_text(value)} K" if key == "kelvin" else f"{key} {_text(value)}"


def _text(value: Any) -> str:
    if isinstance(value, Sequence) and not isinstance(value, str):
        return " ".join(map(_text, value))
    return f"{value:g}" if _is_number(value) else str(value)


def _first(asked: Mapping[str, Any], keys: Iterable[str]) -> str:
    return next(key for key in keys if key in asked)


def _is_number(value: Any) -> bool:
    # bool is an int to Python, and no number to people.
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_rgb(value: Any) -> bool:
    return (
        isinstance(value, Sequence)
        and not isinstance(value, str)
        and len(value) == 3
        and all(_is_number(v) and 0 <= v < math.inf for v in value)
    )


def _rgb(values: Any) -> RGB:
    r, g, b = (float(v) for v in values)
    return r, g, b
