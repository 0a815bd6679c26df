"""Constraints on lights, in the terms of lighting artists: locked, limited, dimmed; and sums of
light and of power that a lighting has to reach.

A lights file, the options of the command line and `Constraints.of` share keys and values. This
module checks them once; `reduction.py` derives the unknowns of the solve from them.
docs/formats.md lists them.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from lightpaint.arrays import RGB, Doubles
from lightpaint.colour import Preference, SlotFilter, WhiteRange
from lightpaint.display_text import brief, some_of
from lightpaint.errors import ConstraintError
from lightpaint.keywords import keywords
from lightpaint.lighting.constraints import emitter_values, values
from lightpaint.sentences import Sentence, SourceKey
from lightpaint.validation import MAX_LISTED

#: Keys of the constraints on one light, the first of which describe the lamp that it is.
LAMP_KEYS = ("emitters", "power_share", "wheel")
LIGHT_KEYS = ("lock", "off", "limits", "color", "kelvin", "duv", "primaries", "rf", *LAMP_KEYS)

#: Keys that determine the colours of a light, which can have one of them.
COLOR_KEYS = ("color", "kelvin", "primaries")


@dataclass(frozen=True)
class Requirements:
    """Sums that have to reach given values: Σ rows·w + watts P ≥ least, P the power of all lamps.

    rows: (m, n, 3), the part of each weight. watts: (m,), -1 for a limit of the power, 0 for sums
    of light. least: (m,). shares: (j,), of what they ask for that may
    be given up, as many as at the start; None if nothing may. share_sizes: (m, j), by how much
    giving up all of a share lowers the sums. share_price: of a whole one, in the unit of half the
    objective.
    """

    rows: Doubles
    watts: Doubles
    least: Doubles
    shares: Doubles | None = None
    share_sizes: Doubles | None = None
    share_price: float = 0.0

    def __len__(self) -> int:
        return len(self.least)

    def with_shares(self, shares: Doubles, sizes: Doubles, price: float) -> "Requirements":
        """Return requirements of which shares may be given up."""
        return replace(self, shares=shares, share_sizes=sizes, share_price=price)

    def lowered(self, slack: Doubles) -> "Requirements":
        """Return requirements that ask for less. slack: (m,)."""
        return replace(self, least=self.least - slack)


@dataclass(frozen=True)
class LightConstraint:
    """A constraint on one light.

    lock: the emission at which it stays. off: whether it is black. least, most: limits of its
    emission.
    primaries: the colours it can mix, each of luminance 1: one for a fixed colour, the two
    ends of a range of white, the LEDs of a fixture; None if any colour will do.
    whites: the range of white that it keeps to, if there is one.
    emitters: the emitters that mix its light, of which each dims between bounds. power_share: their
    largest power together, relative to the power of all at full. wheel: whether they are slots of a
    colour wheel, one of which shines at a time; or the name of the slot at which it stays.
    least_rf: the fidelity index Rf that their mix needs. slots: of a colour wheel in front of
    emitters that mix, the first of which it has unless another is chosen.
    label: all this in few words. where: the name of the source in errors.
    """

    lock: values.Lock | None = None
    off: bool = False
    least: values.Level | None = None
    most: values.Level | None = None
    primaries: tuple[RGB, ...] | None = None
    whites: WhiteRange | None = None
    emitters: tuple[emitter_values.EmitterRequest, ...] = ()
    power_share: float | None = None
    wheel: bool | str = False
    least_rf: float | None = None
    slots: tuple[SlotFilter, ...] = ()
    label: str = ""
    where: SourceKey = field(default_factory=SourceKey)

    @property
    def is_fixed(self) -> bool:
        """True if it leaves nothing to solve for."""
        return self.off or self.lock is not None

    @property
    def has_open_color(self) -> bool:
        """True if nothing says which colours the light can have."""
        return not (self.is_fixed or self.primaries is not None or self.emitters)

    @classmethod
    def of(cls, table: Mapping[str, Any], *, where: str = "constraint") -> "LightConstraint":
        """Make a constraint from keys and values as in a lights file.

        Raises ConstraintError for invalid values and for keys that contradict each other.
        """
        key = SourceKey.of(where)
        values.check_keys(table, LIGHT_KEYS, key)
        values.check_lengths(table, key)
        table = {key: value for key, value in table.items() if value is not False}
        _check_contradictions(table, key)
        lock = values.parse_lock(table["lock"], key / "lock") if "lock" in table else None
        if "off" in table and table["off"] is not True:
            raise ConstraintError(key / "off", f" is {table['off']!r}: expected true or false")
        least, most = (
            values.parse_limits(table["limits"], key / "limits")
            if "limits" in table
            else (None,) * 2
        )
        primaries = values.parse_primaries(table, key)
        whites = values.parse_whites(table, key)
        emitters = emitter_values.parse_emitters(table, key)
        share, least_rf = values.parse_power_share(table, key), values.parse_rf(table, key)
        _check_emitters(table, key, primaries)
        if lock is not None and primaries is not None:
            if lock.level is None or lock.color is not None or isinstance(lock.level.amount, tuple):
                raise ConstraintError(
                    key,
                    " has a lock that holds its colour and "
                    f"{_first_key(table, COLOR_KEYS)!r} that "
                    "sets one: lock it at a number or at a percentage, or leave one out",
                )
            if len(primaries) > 1:
                raise ConstraintError(
                    key,
                    f" has both lock and {_first_key(table, COLOR_KEYS)!r}, which leaves "
                    f"the mix "
                    "of its colours open: lock it at a colour",
                )
            lock, primaries = values.Lock(lock.level, primaries[0]), None
        wheel = values.parse_wheel(table, key, [x.name for x in emitters])
        is_off, label = "off" in table, _label(table)
        lamp = emitters, share, wheel, least_rf, emitter_values.parse_slots(table, key)
        return cls(lock, is_off, least, most, primaries, whites, *lamp, label, key)


def _check_emitters(
    table: Mapping[str, Any], where: SourceKey, primaries: tuple[RGB, ...] | None
) -> None:
    """Refuse what a lamp of emitters cannot have besides them."""
    if "emitters" not in table:
        if "power_share" in table:
            raise ConstraintError(where, " has power_share without the emitters that share it")
        if "wheel" in table:
            raise ConstraintError(where, " has wheel without emitters, which are its slots")
        return
    mixing = {"power_share": "power_share" in table, "kelvin": len(primaries or ()) > 1}
    if "wheel" in table and not emitter_values.has_slots(table) and any(mixing.values()):
        key = next(key for key, is_there in mixing.items() if is_there)
        raise ConstraintError(
            where, f" has wheel and {key}, and a wheel shows one slot at a time: leave {key} out"
        )
    if "kelvin" in table and "limits" in table and len(primaries or ()) > 1:
        raise ConstraintError(
            where,
            " has emitters, a range of kelvin and limits: leave limits out, or lower the largest "
            "drives with max",
        )
    if "primaries" in table and len(primaries or ()) > 1:
        raise ConstraintError(
            where,
            f" has emitters and {_first_key(table, COLOR_KEYS)!r}, and its emitters already say "
            "which colours it can mix: give one colour, or leave it out",
        )


def _label(table: Mapping[str, Any]) -> str:
    return ", ".join(
        values.describe_constraint(key, table[key]) for key in LIGHT_KEYS if key in table
    )


@dataclass(frozen=True)
class Tie:
    """Lights on one dimmer: names or patterns. color: of all of them; None for their own."""

    lights: tuple[str, ...]
    color: RGB | None = None
    where: SourceKey = field(default_factory=lambda: SourceKey("", "tie"))

    def __post_init__(self) -> None:
        if not self.lights or not all(isinstance(x, str) and x for x in self.lights):
            raise ConstraintError(self.where, ": expected names of at least two lights")


@keywords()
@dataclass(frozen=True)
class Constraints:
    """Constraints on the lights of a solution.

    Attributes:
        lights: Name or pattern, its keys and values, and the name of their source in errors. Later
            entries replace contradictory ones; `of` puts patterns before names.
        ties: Lights on one dimmer.
        prefer_current: Strength of the pull towards the current lighting. At 1 a change of a light
            costs as much as its effect on the whole picture, painted or not.
        sparse: Maximum number of lights that may be on.
        start: Emissions by name of light, set by hand: the lighting to start from, in place of the
            scene's. Unpainted parts are held to its look, and lamps to its colours.
        near: Strength of a pull to the lighting to start from, relative to the paint. At 1 a change
            of a light costs as much as its effect on a picture painted all over would count.
        cd_per_unit: cd/m² of a radiance of 1, for emitters in candelas or lumens.
        prefer_emitters: Among mixes of a lamp's emitters that look the same, the one with the least
            "watts", with the most light from "white" emitters, of the "fewest" emitters, or with
            the highest "rf", the fidelity of colours by TM-30.
        requirements: Sums of light and power that the answer has to reach, in memory only.

    Examples:
        >>> constraints = lp.Constraints.of({"panel": {"lock": True}})
        >>> lighting = lp.solve(basis, target, constraints=constraints).lighting
        >>> np.round(lighting.emission["panel"], 3).tolist()
        [4.0, 3.0, 2.0]
        >>> lp.Constraints.of({"panel": {"lock": True}, "bulb": {"color": "3200K"}}, sparse=2)
        Constraints(panel lock; bulb color 3200K; sparse 2)
    """

    lights: tuple[tuple[str, Mapping[str, Any], SourceKey], ...] = ()
    ties: tuple[Tie, ...] = ()
    prefer_current: float = 0.0
    sparse: int | None = None
    start: Mapping[str, RGB] = field(default_factory=dict)
    near: float = 0.0
    cd_per_unit: float | None = None
    prefer_emitters: Preference | None = None
    requirements: Requirements | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        if not isinstance(self.lights, tuple) or not isinstance(self.ties, tuple):
            wrong = self.lights if not isinstance(self.lights, tuple) else self.ties
            name = "lights" if wrong is self.lights else "ties"
            raise ConstraintError(
                f"{name} is {wrong!r}: expected entries as Constraints.of makes them of tables"
            )

    def __repr__(self) -> str:
        parts = [f"{name} {_label(table)}" for name, table, _ in self.lights]
        parts += [f"tie {' + '.join(tie.lights)}" for tie in self.ties]
        parts += [f"prefer_current {self.prefer_current:g}"] if self.prefer_current else []
        parts += [] if self.sparse is None else [f"sparse {self.sparse}"]
        parts += [f"start {' + '.join(self.start)}"] if self.start else []
        parts += [f"near {self.near:g}"] if self.near else []
        parts += [f"cd_per_unit {self.cd_per_unit:g}"] if self.cd_per_unit else []
        parts += [f"prefer_emitters {self.prefer_emitters}"] if self.prefer_emitters else []
        parts += [] if self.requirements is None else [f"{len(self.requirements)} requirements"]
        return f"Constraints({some_of(parts, '; ', room=600)})"

    def __bool__(self) -> bool:
        is_any_set = bool(self.prefer_current or self.start or self.near or self.requirements)
        return is_any_set or bool(self.lights or self.ties or self.sparse is not None)

    @classmethod
    def of(
        cls,
        light: Mapping[str, Mapping[str, Any]] | None = None,
        *,
        tie: Sequence[Any] = (),
        prefer_current: float = 0.0,
        sparse: int | None = None,
        start: Mapping[str, Any] | None = None,
        near: float = 0.0,
        cd_per_unit: float | None = None,
        prefer_emitters: Preference | None = None,
        where: str = "",
    ) -> "Constraints":
        """Make constraints from the tables of a lights file.

        light: name or pattern → keys and values (`{"key": {"color": "3200K"}}`).
        tie: lists of names, or tables with `lights` and `color`; one list of names is one tie.
        start: emissions by name of light, (r, g, b), set by hand.
        where: the name of the source in errors.

        Raises ConstraintError, naming the light, the key and what is expected.
        """
        source = SourceKey(where)
        if not isinstance(light, Mapping | None):
            raise ConstraintError(source / "light", f" is {light!r}: expected tables [light.NAME]")
        if light is not None and len(light) > MAX_LISTED:
            raise ConstraintError(
                source / "light", f" has {len(light)} names: at most {MAX_LISTED} are read"
            )
        lights = []
        for name, table in (light or {}).items():
            # Checked now, so that a mistake is reported even if the scene has no such light.
            key = source / "light" / str(name)
            LightConstraint.of(table, where=key)
            lights.append((name, dict(table), key))
        lights.sort(key=lambda entry: not is_pattern(entry[0]))
        return cls(
            tuple(lights),
            _parse_ties(tie, source / "tie"),
            values.parse_strength(prefer_current, source / "prefer_current"),
            values.parse_count(sparse, source / "sparse"),
            values.parse_start({} if start is None else start, source / "start"),
            values.parse_strength(near, source / "near"),
            values.parse_scale(cd_per_unit, source / "cd_per_unit"),
            values.parse_preference(prefer_emitters, source / "prefer_emitters"),
        )

    def and_then(self, others: "Constraints") -> "Constraints":
        """Return these constraints with `others`, which replace contradictory ones.

        Ties in `others` replace ties of the same lights.

        A constraint in both occurs once: `a.and_then(a.and_then(b)) == a.and_then(b)`.
        """
        tied = [set(tie.lights) for tie in others.ties]
        return Constraints(
            tuple(x for x in self.lights if x not in others.lights) + others.lights,
            tuple(x for x in self.ties if set(x.lights) not in tied) + others.ties,
            others.prefer_current or self.prefer_current,
            self.sparse if others.sparse is None else others.sparse,
            {**self.start, **others.start},
            others.near or self.near,
            others.cd_per_unit or self.cd_per_unit,
            others.prefer_emitters or self.prefer_emitters,
            others.requirements or self.requirements,
        )


def is_pattern(name: str) -> bool:
    """Return whether `name` can stand for several lights."""
    return any(c in name for c in "*?[")


def merge_tables(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of `below` that `above` does not contradict, and all of `above`."""
    removed = set(above)
    for key, value in above.items():
        removed |= set(_CONTRADICTS.get(key, ())) if value is not False else set()
    if removed & {"color", "kelvin"}:
        removed.add("duv")
    return {**{k: v for k, v in below.items() if k not in removed}, **above}


_CONTRADICTS = {
    "lock": ("off", "limits", *COLOR_KEYS),
    "off": ("lock", "limits", *COLOR_KEYS),
    "limits": ("lock", "off"),
    **{key: ("lock", "off", *(x for x in COLOR_KEYS if x != key)) for key in COLOR_KEYS},
}


def _check_contradictions(table: Mapping[str, Any], where: SourceKey) -> None:
    for first in LIGHT_KEYS:
        for second in _CONTRADICTS.get(first, ()):
            # A fixed colour and a level to lock it at go together.
            if (
                first in table
                and second in table
                and not ("lock" in (first, second) and {first, second} & set(COLOR_KEYS))
            ):
                raise ConstraintError(
                    where,
                    f" has both {first!r} and {second!r}, which contradict each other: "
                    "leave one out",
                )
    if "duv" in table and not (
        "kelvin" in table or str(table.get("color", "")).upper().endswith("K")
    ):
        raise ConstraintError(where, " has 'duv' without a 'kelvin' that it is the distance from")


def _parse_ties(value: Any, where: SourceKey) -> tuple[Tie, ...]:
    expected = Sentence(
        where, f' is {brief(value)}: expected lists of names, [["a", "b"]], or tables [[tie]]'
    )
    if isinstance(value, str | Mapping) or not isinstance(value, Sequence):
        raise ConstraintError(expected)
    if value and all(isinstance(name, str) for name in value):
        value = [value]  # one tie
    if len(value) > MAX_LISTED:
        raise ConstraintError(where, f" lists {len(value)}: at most {MAX_LISTED} are read")
    ties = []
    for entry in value:
        if isinstance(entry, Mapping):
            values.check_keys(entry, ("lights", "color"), where)
            names = entry.get("lights")
            color = (
                values.parse_color(entry["color"], where / "color") if "color" in entry else None
            )
        else:
            names, color = entry, None
        if isinstance(names, str) or not isinstance(names, Sequence):
            raise ConstraintError(expected)
        ties.append(Tie(tuple(names), color, where))
    return tuple(ties)


def _first_key(table: Mapping[str, Any], keys: Iterable[str]) -> str:
    return next(key for key in keys if key in table)
