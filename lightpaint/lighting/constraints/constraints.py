"""What may be asked of lights, in the terms of people who light: locked, limited, dimmed.

The same keys and values stand in a lights file, in options of the command line and in
`Constraints.of`. They are checked here, when they are born; `reduction.py` makes of them
the unknowns of the solve. docs/formats.md lists them.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from lightpaint.arrays import RGB
from lightpaint.colour.white_range import WhiteRange
from lightpaint.errors import ConstraintError
from lightpaint.keywords import keywords
from lightpaint.lighting.constraints.values import (
    Level,
    Lock,
    check_keys,
    check_lengths,
    color_of,
    count_of,
    described,
    limits_of,
    lock_of,
    primaries_of,
    strength_of,
    whites_of,
)
from lightpaint.screen import some_of
from lightpaint.validation import MAX_LISTED

#: What may be asked of one light.
LIGHT_KEYS = ("lock", "off", "limits", "color", "kelvin", "duv", "primaries")

#: Of these a light can have one: each says which colours it has.
COLOURS = ("color", "kelvin", "primaries")


@dataclass(frozen=True)
class LightConstraint:
    """What is asked of one light.

    lock: to stay at this. off: to be black. least, most: limits of its emission.
    primaries: the colours it can mix, each of luminance 1: one for a fixed colour, the two
    ends of a range of white, the LEDs of a fixture; None if any colour will do.
    whites: the range of white that it keeps to, if it does.
    label: all this in few words. where: what errors call it.
    """

    lock: Lock | None = None
    off: bool = False
    least: Level | None = None
    most: Level | None = None
    primaries: tuple[RGB, ...] | None = None
    whites: WhiteRange | None = None
    label: str = ""
    where: str = ""

    @property
    def is_held(self) -> bool:
        """Whether it leaves nothing to solve for."""
        return self.off or self.lock is not None

    @classmethod
    def of(cls, asked: Mapping[str, Any], *, where: str = "constraint") -> "LightConstraint":
        """From keys and values as they stand in a lights file.

        Raises ConstraintError for values that mean nothing, and for keys that contradict
        each other.
        """
        check_keys(asked, LIGHT_KEYS, where)
        check_lengths(asked, where)
        asked = {key: value for key, value in asked.items() if value is not False}
        _check_contradictions(asked, where)
        lock = lock_of(asked["lock"], f"{where}.lock") if "lock" in asked else None
        if "off" in asked and asked["off"] is not True:
            raise ConstraintError(f"{where}.off is {asked['off']!r}: expected true or false")
        least, most = (
            limits_of(asked["limits"], f"{where}.limits") if "limits" in asked else (None,) * 2
        )
        primaries = primaries_of(asked, where)
        whites = whites_of(asked, where)
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
        return cls(lock, "off" in asked, least, most, primaries, whites, _label(asked), where)


def _label(asked: Mapping[str, Any]) -> str:
    return ", ".join(described(key, asked[key]) for key in LIGHT_KEYS if key in asked)


@dataclass(frozen=True)
class Tie:
    """Lights on one dimmer: names or patterns. color: of all of them; None for their own."""

    lights: tuple[str, ...]
    color: RGB | None = None
    where: str = "tie"

    def __post_init__(self) -> None:
        if not self.lights or not all(isinstance(x, str) and x for x in self.lights):
            raise ConstraintError(f"{self.where}: expected names of at least two lights")


@keywords()
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
        >>> lp.Constraints.of({"panel": {"lock": True}, "bulb": {"color": "3200K"}}, sparse=2)
        Constraints(panel lock; bulb color 3200K; sparse 2)
    """

    lights: tuple[tuple[str, Mapping[str, Any], str], ...] = ()
    ties: tuple[Tie, ...] = ()
    prefer_current: float = 0.0
    sparse: int | None = None

    def __repr__(self) -> str:
        told = [f"{name} {_label(asked)}" for name, asked, _ in self.lights]
        told += [f"tie {' + '.join(tie.lights)}" for tie in self.ties]
        told += [f"prefer_current {self.prefer_current:g}"] if self.prefer_current else []
        told += [] if self.sparse is None else [f"sparse {self.sparse}"]
        return f"Constraints({some_of(told, '; ', room=600)})"

    def __bool__(self) -> bool:
        return bool(self.lights or self.ties or self.prefer_current or self.sparse is not None)

    @classmethod
    @keywords()
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
        if light is not None and len(light) > MAX_LISTED:
            raise ConstraintError(
                f"{lead}light has {len(light)} names: at most {MAX_LISTED} are read"
            )
        lights = []
        for name, asked in (light or {}).items():
            # Looked at now, so that no mistake waits for the light to be met.
            LightConstraint.of(asked, where=f"{lead}light.{name}")
            lights.append((name, dict(asked), f"{lead}light.{name}"))
        lights.sort(key=lambda entry: not is_pattern(entry[0]))
        return cls(
            tuple(lights),
            _ties(tie, f"{lead}tie"),
            strength_of(prefer_current, f"{lead}prefer_current"),
            count_of(sparse, f"{lead}sparse"),
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


def _ties(given: Any, where: str) -> tuple[Tie, ...]:
    expected = f'{where} is {given!r}: expected lists of names, [["a", "b"]], or tables [[tie]]'
    if isinstance(given, str | Mapping) or not isinstance(given, Sequence):
        raise ConstraintError(expected)
    if given and all(isinstance(name, str) for name in given):
        given = [given]  # one tie
    if len(given) > MAX_LISTED:
        raise ConstraintError(f"{where} lists {len(given)}: at most {MAX_LISTED} are read")
    ties = []
    for entry in given:
        if isinstance(entry, Mapping):
            check_keys(entry, ("lights", "color"), where)
            names = entry.get("lights")
            color = color_of(entry["color"], f"{where}.color") if "color" in entry else None
        else:
            names, color = entry, None
        if isinstance(names, str) or not isinstance(names, Sequence):
            raise ConstraintError(expected)
        ties.append(Tie(tuple(names), color, where))
    return tuple(ties)


def _first(asked: Mapping[str, Any], keys: Iterable[str]) -> str:
    return next(key for key in keys if key in asked)
