"""Emitters as Mitsuba has them, and lights as people adjust them: one emitter, or several.

`choose_lights` turns the one into the other. Everything is in document order; what is not
adjusted comes last, as one light that is fixed.
"""

import difflib
import itertools
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from lightpaint.arrays import RGB
from lightpaint.colour.photometry import point_flux
from lightpaint.errors import SceneError
from lightpaint.scene.emitters import AS_AUTHORED, MULTIPLE, PLUGINS, EmissionKind, Scaling

#: Name of the fixed light, with underscores added should another have it.
REST = "rest"

#: What emission scales in a light that is a multiple of what the scene has.
WHOLE_EMISSION = "emission"


@dataclass(frozen=True)
class Emitter:
    """One emitter of a scene.

    kind: how it is scaled; None where lightpaint cannot.
    emission: present linear RGB emission in the unit of `kind`; 1 for what is a multiple.
    file, offset: where its element's `<` stands: index into Scene.files, byte offset.
    obstacle: why it cannot be solved for, in words behind its name; "" if it can.
    unit_flux: watts per channel at an emission of 1; None where there is no such number.
    """

    name: str
    plugin: str
    kind: EmissionKind | None
    emission: RGB
    form: str
    sampling_weight: float
    node: int
    file: int
    offset: int
    obstacle: str = ""
    unit_flux: float | None = None

    @property
    def by_chance(self) -> bool:
        """Whether only rays that happen to hit it may find it: it is never sampled.

        Meshes painted by an attribute: Mitsuba's sampling of these and the probability that it
        states for it do not agree, so that a render would depend on the sampling weights, and
        with them on which other lights are on.
        """
        return self.plugin == "area" and self.kind is not None and self.kind.is_scalar


def point_emitter(name: str, node: int, position: tuple[float, float, float]) -> Emitter:
    """A point light of intensity 1 that stands in no file."""
    parameter, unit = PLUGINS["point"]
    x, y, z = position
    return Emitter(
        name=name,
        plugin="point",
        kind=EmissionKind(Scaling.COLOUR, parameter, unit),
        emission=AS_AUTHORED,
        form=f"at ({x:.2f}, {y:.2f}, {z:.2f})",
        sampling_weight=1.0,
        node=node,
        file=0,
        offset=-1,
        unit_flux=point_flux(),
    )


def free_names(stem: str, count: int, taken: Collection[str]) -> list[str]:
    """`stem_1`, `stem_2` … without those that are taken."""
    numbered = (f"{stem}_{k}" for k in itertools.count(1))
    return list(itertools.islice((name for name in numbered if name not in taken), count))


@dataclass(frozen=True)
class Light:
    """What a person adjusts: one emitter, or several tied together under one weight.

    parameter, unit: what one unit of weight is. With the unit MULTIPLE the weight multiplies
    what each member has in the scene; with any other it is the emission of each.
    emission: present RGB emission in `unit`.
    is_scalar: whether it has one weight for all channels instead of three.
    is_fixed: whether it is all that stays as it is, with weight 1.
    """

    name: str
    members: tuple[Emitter, ...]
    parameter: str
    unit: str
    emission: RGB
    is_scalar: bool = False
    is_fixed: bool = False

    @property
    def member_names(self) -> tuple[str, ...]:
        """Names of its emitters."""
        return tuple(member.name for member in self.members)

    @property
    def plugin(self) -> str:
        """Mitsuba's name of the emitter plugin; `area + point` where members differ."""
        return " + ".join(dict.fromkeys(member.plugin for member in self.members))

    @property
    def form(self) -> str:
        """Place and size in words; for several emitters, which."""
        if len(self.members) == 1:
            return self.members[0].form
        return f"{len(self.members)} emitters: {', '.join(self.member_names)}"

    @property
    def unit_flux(self) -> RGB | None:
        """Watts per channel at an emission of 1, of all members together.

        None where one of them has no flux that is known.
        """
        total = [0.0, 0.0, 0.0]
        for member in self.members:
            if member.unit_flux is None:
                return None
            for k, emission in enumerate(self.emission_of(member, (1.0, 1.0, 1.0))):
                total[k] += emission * member.unit_flux
        return total[0], total[1], total[2]

    def emission_of(self, member: Emitter, emission: RGB) -> RGB:
        """What `member` emits, in its own unit, where this light has `emission`."""
        if self.unit != MULTIPLE:
            return emission
        r, g, b = (w * own for w, own in zip(emission, member.emission, strict=True))
        return r, g, b


def tie(name: str, members: Sequence[Emitter]) -> Light:
    """The light `name` made of emitters that share one weight.

    If all have one colour, in the same unit and of the same value, that colour is the
    unknown; so it is if all are black. Otherwise the unknown is a factor: what they are in
    proportion to each other, they stay. Raises SceneError if that is nothing, because all
    are black and differ in kind.
    """
    kinds = {member.kind for member in members}
    first = members[0]
    is_colour = len(kinds) == 1 and first.kind is not None and _is_colour(first)
    if is_colour and len({member.emission for member in members}) == 1:
        assert first.kind is not None
        return Light(name, tuple(members), first.kind.parameter, first.kind.unit, first.emission)
    if not any(any(member.emission) for member in members):
        listed = ", ".join(f"{m.name} ({m.plugin})" for m in members)
        raise SceneError(
            f"group {name!r} has only black lights of different kinds, {listed}, so nothing "
            "says how bright they are to each other: give one of them a colour"
        )
    parameters = {member.kind.parameter for member in members if member.kind is not None}
    return Light(
        name,
        tuple(members),
        parameters.pop() if len(parameters) == 1 else WHOLE_EMISSION,
        MULTIPLE,
        AS_AUTHORED,
        is_scalar=any(kind is not None and kind.is_scalar for kind in kinds),
    )


def _is_colour(emitter: Emitter) -> bool:
    return emitter.kind is not None and emitter.kind.scaling is Scaling.COLOUR


def keep(name: str, emitters: Sequence[Emitter]) -> Light:
    """The fixed light `name` of all `emitters` that stay as they are."""
    return Light(name, tuple(emitters), WHOLE_EMISSION, MULTIPLE, AS_AUTHORED, is_fixed=True)


def choose_lights(
    emitters: Sequence[Emitter],
    *,
    scene: str,
    lights: Iterable[str] | None = None,
    groups: Mapping[str, Iterable[str]] | None = None,
) -> tuple[Light, ...]:
    """The lights of a scene: its emitters, tied by `groups`, of which `lights` are adjusted.

    lights: names or patterns (`window_*`) of lights and groups; None for all.
    groups: name → names or patterns of its emitters. scene: what errors call the scene.

    What is not chosen, and what cannot be scaled, is kept together in one fixed light.
    Raises SceneError for names that are not there, that clash or that are taken twice, and
    if nothing is left to adjust.
    """
    group_of = _members_of_groups(emitters, groups or {}, scene)
    by_light: dict[str, list[Emitter]] = {}
    for emitter in emitters:
        if not emitter.obstacle:
            by_light.setdefault(group_of.get(emitter.name, emitter.name), []).append(emitter)
    if lights is not None:
        chosen = _chosen(_listed(lights, "lights"), by_light, group_of, emitters, scene)
        by_light = {name: members for name, members in by_light.items() if name in chosen}
    if not by_light:
        listed = "; ".join(f"{e.name!r} {e.obstacle}" for e in emitters)
        raise SceneError(f"{scene} has no light that can be solved for: {listed}")
    return _with_rest([tie(name, members) for name, members in by_light.items()], emitters)


def lights_of(
    emitters: Sequence[Emitter], members: Mapping[str, Sequence[str]], fixed: Collection[str]
) -> tuple[Light, ...]:
    """The lights `members` (name → names of its emitters), of which those in `fixed` are kept.

    Raises SceneError if an adjusted one holds an emitter that cannot be scaled.
    """
    by_name = {emitter.name: emitter for emitter in emitters}
    lights = []
    for name, names in members.items():
        its = sorted((by_name[n] for n in names), key=lambda emitter: emitter.node)
        if name not in fixed:
            _check_adjustable(its)
        lights.append(keep(name, its) if name in fixed else tie(name, its))
    return tuple(sorted(lights, key=lambda light: (light.is_fixed, light.members[0].node)))


def _with_rest(lights: Sequence[Light], emitters: Sequence[Emitter]) -> tuple[Light, ...]:
    adjusted = {member.name for light in lights for member in light.members}
    left = [emitter for emitter in emitters if emitter.name not in adjusted]
    if not left:
        return tuple(lights)
    name, taken = REST, {light.name for light in lights} | {e.name for e in emitters}
    while name in taken:
        name += "_"
    return (*lights, keep(name, left))


def _members_of_groups(
    emitters: Sequence[Emitter], groups: Mapping[str, Iterable[str]], scene: str
) -> dict[str, str]:
    """The group of each emitter that is in one."""
    names = [emitter.name for emitter in emitters]
    group_of: dict[str, str] = {}
    for group, patterns in groups.items():
        if not group:
            raise SceneError("a group needs a name: its members are given by it")
        listed = _listed(patterns, f"group {group!r}")
        for pattern in listed:
            found = _matching(pattern, names, f"group {group!r}", scene)
            its = [e for e in emitters if e.name in found]
            if pattern not in names:
                # A pattern takes what can be taken; a name is meant.
                its = [e for e in its if not e.obstacle] or its
            _check_adjustable(its)
            for name in (emitter.name for emitter in its):
                other = group_of.setdefault(name, group)
                if other != group:
                    raise SceneError(
                        f"light {name!r} is in two groups, {other!r} and {group!r}: "
                        "an emitter has one weight; leave one of the groups out, or give it other "
                        "members (groups of the lights file count too)"
                    )
    for group in groups:
        if group in names and group_of.get(group) is None:
            raise SceneError(
                f"group {group!r} has the name of a light that is not in a group: choose another"
            )
    return group_of


def _chosen(
    patterns: Sequence[str],
    by_light: Mapping[str, Sequence[Emitter]],
    group_of: Mapping[str, str],
    emitters: Sequence[Emitter],
    scene: str,
) -> set[str]:
    """Names of the lights that the patterns select."""
    chosen: set[str] = set()
    for pattern in patterns:
        if pattern not in by_light:
            _check_adjustable([emitter for emitter in emitters if emitter.name == pattern])
            if group := group_of.get(pattern):
                raise SceneError(
                    f"light {pattern!r} is part of the group {group!r}: choose that, or leave "
                    f"{pattern!r} out of it"
                )
        chosen |= _matching(pattern, [*by_light], "lights", scene)
    return chosen


def _check_adjustable(emitters: Iterable[Emitter]) -> None:
    for emitter in emitters:
        if emitter.obstacle:
            raise SceneError(
                f"light {emitter.name!r} {emitter.obstacle}, so it can only stay as it is"
            )


def _matching(pattern: str, names: Sequence[str], where: str, scene: str) -> set[str]:
    """The name itself, else all that match it as a pattern. Raises SceneError if none does."""
    if pattern in names:
        return {pattern}
    found = {name for name in names if fnmatchcase(name, pattern)}
    if not found:
        close = difflib.get_close_matches(pattern, names, n=1)
        hint = f"did you mean {close[0]!r}? It" if close else "it"
        raise SceneError(
            f"{where}: {scene} has no light {pattern!r}; {hint} has {', '.join(names)}"
        )
    return found


def _listed(names: Iterable[str], where: str) -> list[str]:
    """Checked to be a list that names something."""
    # A text is a list of its letters too, and never what was meant.
    listed = [names] if isinstance(names, str) else list(names)
    if not listed or not all(isinstance(name, str) and name for name in listed):
        raise SceneError(f"{where}: name at least one light, and each by its name")
    return listed
