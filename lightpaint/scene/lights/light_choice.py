"""Chooses which emitters are grouped and which lights are adjusted, by names and patterns.

Lights are in document order; the emitters that are not adjusted come last, as one fixed light.

Many similar unnamed emitters become one light, unless the user separates them. A street of three
hundred lamps without ids would otherwise be three hundred unknowns with meaningless names such as
`area_217`, and take three hundred planes of the basis.
"""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from itertools import count, pairwise

from lightpaint.display_text import some_names, with_similar_name
from lightpaint.errors import SceneError
from lightpaint.scene.lights.emitters import Emitter
from lightpaint.scene.lights.light import Light, check_adjustable, keep, tie
from lightpaint.scene.lights.texels.texel import image_of
from lightpaint.scene.properties.emission import Scaling
from lightpaint.validation import MAX_LISTED, MAX_NAME

#: Name of the fixed light; underscores are added if another light has that name.
REST = "rest"

#: Maximum number of similar emitters that stay separate, since they can be inspected one by one.
MAX_SEPARATE = 24

#: Maximum ratio of two sizes that count as equal: float32 rotations change them slightly.
SIZE_TOLERANCE = 1.001


def choose_lights(
    emitters: Sequence[Emitter],
    *,
    scene: str,
    lights: Iterable[str] | None = None,
    groups: Mapping[str, Iterable[str]] | None = None,
    group_alike: bool = True,
    named: Iterable[str] = (),
) -> tuple[Light, ...]:
    """Return the lights of a scene: emitters grouped by `groups`, of which `lights` are adjusted.

    lights: names or patterns (`window_*`) of lights and groups; None for all.
    groups: name → names or patterns of its emitters. scene: its name in errors. group_alike:
    whether many similar unnamed emitters become one light (`alike_groups`), except those that
    `lights` or `named`, also names or patterns, select individually.
    Emitters that are not chosen, or cannot be scaled, form one fixed light. Raises SceneError for
    names that do not exist, clash or are used twice, and if there is nothing left to adjust.
    """
    group_of = _members_of_groups(emitters, groups or {}, scene)
    similar: dict[str, tuple[Emitter, ...]] = {}
    if group_alike:
        patterns = [*([] if lights is None else _as_list(lights, "lights")), *named]
        similar = _similar_lights(emitters, group_of, {*(groups or {})}, patterns)
        group_of |= {member.name: name for name, members_ in similar.items() for member in members_}
    by_light: dict[str, list[Emitter]] = {}
    for emitter in emitters:
        if not emitter.obstacle:
            by_light.setdefault(group_of.get(emitter.name, emitter.name), []).append(emitter)
    if lights is not None:
        chosen_names = _chosen(_as_list(lights, "lights"), by_light, group_of, emitters, scene)
        by_light = {name: members for name, members in by_light.items() if name in chosen_names}
    if not by_light:
        items = some_names((f"{e.name!r} {e.obstacle}" for e in emitters), "; ")
        raise SceneError(f"{scene} has no light that can be solved for: {items}")
    grouped_emitters = [
        replace(tie(name, members), is_found=name in similar) for name, members in by_light.items()
    ]
    return _with_rest(grouped_emitters, emitters)


def _similar_lights(
    emitters: Sequence[Emitter],
    group_of: Mapping[str, str],
    groups: Collection[str],
    patterns: Iterable[str],
) -> dict[str, tuple[Emitter, ...]]:
    """Return lights of many similar emitters, excluding those in groups or selected
    individually.
    """
    ungrouped_emitters = [emitter for emitter in emitters if emitter.name not in group_of]
    similar = alike_groups(ungrouped_emitters, {*groups, *(emitter.name for emitter in emitters)})
    grouped_names = {member.name for members in similar.values() for member in members}
    lights = {*groups, *similar, *(emitter.name for emitter in ungrouped_emitters)} - grouped_names
    separated: set[str] = set()
    for pattern in patterns:
        if pattern in grouped_names:
            separated.add(pattern)
        elif not any(fnmatchcase(name, pattern) for name in lights):
            separated |= {name for name in grouped_names if fnmatchcase(name, pattern)}
    return remove_separated(similar, separated)


def alike_groups(
    emitters: Sequence[Emitter], taken: Collection[str]
) -> dict[str, tuple[Emitter, ...]]:
    """Return light name → its emitters, for more than MAX_SEPARATE similar, unnamed emitters.

    Similar emitters have the same plugin and emission, and belong to the same material, file or
    parent, or have the same size if that has no name. taken: names that lights must not have.
    """
    by_kind: dict[object, list[Emitter]] = {}
    for emitter in emitters:
        if not emitter.has_name and _is_lamp(emitter):
            key = (emitter.plugin, emitter.kind, emitter.emission, emitter.belongs_to)
            by_kind.setdefault(key, []).append(emitter)
    groups: dict[str, tuple[Emitter, ...]] = {}
    for similar in by_kind.values():
        for members in _of_one_size(similar) if not similar[0].belongs_to else [similar]:
            if len(members) > MAX_SEPARATE:
                stem = members[0].belongs_to or f"{members[0].plugin}_lights"
                groups[_free_name(stem, {*taken, *groups})] = tuple(members)
    return groups


def remove_separated(
    groups: Mapping[str, Sequence[Emitter]], separated: Collection[str]
) -> dict[str, tuple[Emitter, ...]]:
    """Return the groups without the `separated` emitters; groups with a single emitter are
    dropped.
    """
    remaining_groups = {
        name: tuple(emitter for emitter in emitters if emitter.name not in separated)
        for name, emitters in groups.items()
    }
    return {name: members for name, members in remaining_groups.items() if len(members) > 1}


def _is_lamp(emitter: Emitter) -> bool:
    """Return True if colour and size describe the emitter completely."""
    is_colour = emitter.kind is not None and emitter.kind.scaling is Scaling.COLOUR
    return is_colour and not emitter.obstacle and emitter.unit_flux is not None


def _of_one_size(emitters: Sequence[Emitter]) -> Iterator[list[Emitter]]:
    """Yield groups of emitters with equal sizes, up to SIZE_TOLERANCE between neighbours."""
    by_size = sorted(emitters, key=lambda emitter: (emitter.unit_flux or 0.0, emitter.node))
    run = by_size[:1]
    for smaller, larger in pairwise(by_size):
        if (larger.unit_flux or 0.0) > SIZE_TOLERANCE * (smaller.unit_flux or 0.0):
            yield sorted(run, key=lambda emitter: emitter.node)
            run = []
        run.append(larger)
    yield sorted(run, key=lambda emitter: emitter.node)


def _free_name(stem: str, taken: Collection[str]) -> str:
    """Return `stem`, or `stem_2`, `stem_3`, … if it is taken."""
    names = (stem if k == 1 else f"{stem}_{k}" for k in count(1))
    return next(name for name in names if name not in taken)


def _with_rest(lights: Sequence[Light], emitters: Sequence[Emitter]) -> tuple[Light, ...]:
    adjusted_names = {member.name for light in lights for member in light.members}
    rest = [emitter for emitter in emitters if emitter.name not in adjusted_names]
    if not rest:
        return tuple(lights)
    name, used_names = REST, {light.name for light in lights} | {e.name for e in emitters}
    while name in used_names:
        name += "_"
    return (*lights, keep(name, rest))


def _members_of_groups(
    emitters: Sequence[Emitter], groups: Mapping[str, Iterable[str]], scene: str
) -> dict[str, str]:
    """Return the group of each emitter that belongs to one."""
    names = [emitter.name for emitter in emitters]
    group_of: dict[str, str] = {}
    for group, patterns in groups.items():
        if not 0 < len(group) <= MAX_NAME:
            raise SceneError(f"a group needs a name of at most {MAX_NAME} characters")
        items = _as_list(patterns, f"group {group!r}")
        for pattern in items:
            matches = _matching(pattern, names, f"group {group!r}", scene)
            members = [e for e in emitters if e.name in matches]
            if pattern not in names:
                # A pattern skips emitters that cannot be adjusted; a name does not.
                members = [e for e in members if not e.obstacle] or members
            check_adjustable(members)
            for name in (emitter.name for emitter in members):
                other_group = group_of.setdefault(name, group)
                if other_group != group:
                    raise SceneError(
                        f"light {name!r} is in two groups, {other_group!r} and {group!r}: "
                        "an emitter has one weight; remove one of the groups, or give it other "
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
    """Return the names of the lights that the patterns select."""
    chosen_names: set[str] = set()
    for pattern in patterns:
        if pattern not in by_light:
            check_adjustable([emitter for emitter in emitters if emitter.name == pattern])
            if group := group_of.get(pattern):
                raise SceneError(
                    f"light {pattern!r} is part of the group {group!r}: choose that, or leave "
                    f"{pattern!r} out of it"
                )
        chosen_names |= _matching(pattern, [*by_light], "lights", scene)
    return chosen_names


def _matching(pattern: str, names: Sequence[str], place: str, scene: str) -> set[str]:
    """Return the name itself, or else all names that match the pattern, and texels of the image of
    that name. Raises SceneError if none do.
    """
    if pattern in names:
        return {pattern}
    matches = {name for name in names if fnmatchcase(name, pattern) or image_of(name) == pattern}
    if not matches:
        hint = with_similar_name(f"it has {some_names(names)}", pattern, names)
        raise SceneError(f"{place}: {scene} has no light {pattern!r}; {hint}")
    return matches


def _as_list(names: Iterable[str], place: str) -> list[str]:
    """Return names as a list, checked to be non-empty."""
    # A string would otherwise become a list of its letters.
    items = [names] if isinstance(names, str) else list(names)
    if len(items) > MAX_LISTED:
        raise SceneError(f"{place} lists {len(items)} names: expected at most {MAX_LISTED}")
    if not items or not all(isinstance(name, str) and name for name in items):
        raise SceneError(f"{place}: expected a list of at least one name")
    return items
