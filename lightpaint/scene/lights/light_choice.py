"""Which emitters go together and which are adjusted, by names and patterns.

Everything is in document order; what is not adjusted comes last, as one light that is fixed.
"""

import difflib
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase

from lightpaint.errors import SceneError
from lightpaint.scene.lights.emitters import Emitter
from lightpaint.scene.lights.light import Light, check_adjustable, keep, tie
from lightpaint.scene.lights.similar_emitters import alike_groups, without
from lightpaint.screen import some_names
from lightpaint.validation import MAX_LISTED, MAX_NAME

#: Name of the fixed light, with underscores added should another have it.
REST = "rest"


def choose_lights(
    emitters: Sequence[Emitter],
    *,
    scene: str,
    lights: Iterable[str] | None = None,
    groups: Mapping[str, Iterable[str]] | None = None,
    group_alike: bool = True,
    named: Iterable[str] = (),
) -> tuple[Light, ...]:
    """The lights of a scene: its emitters, tied by `groups`, of which `lights` are adjusted.

    lights: names or patterns (`window_*`) of lights and groups; None for all.
    groups: name → names or patterns of its emitters. scene: what errors call the scene.
    group_alike: whether many that are alike and without names are one light (`alike_groups`), but
    those that `lights` or `named`, names or patterns too, mean one by one.

    What is not chosen, and what cannot be scaled, is kept together in one fixed light.
    Raises SceneError for names that are not there, that clash or that are taken twice, and
    if nothing is left to adjust.
    """
    group_of = _members_of_groups(emitters, groups or {}, scene)
    found: dict[str, tuple[Emitter, ...]] = {}
    if group_alike:
        asked = [*([] if lights is None else _listed(lights, "lights")), *named]
        found = _found_alike(emitters, group_of, {*(groups or {})}, asked)
        group_of |= {member.name: name for name, its in found.items() for member in its}
    by_light: dict[str, list[Emitter]] = {}
    for emitter in emitters:
        if not emitter.obstacle:
            by_light.setdefault(group_of.get(emitter.name, emitter.name), []).append(emitter)
    if lights is not None:
        chosen = _chosen(_listed(lights, "lights"), by_light, group_of, emitters, scene)
        by_light = {name: members for name, members in by_light.items() if name in chosen}
    if not by_light:
        listed = some_names((f"{e.name!r} {e.obstacle}" for e in emitters), "; ")
        raise SceneError(f"{scene} has no light that can be solved for: {listed}")
    tied = [
        replace(tie(name, members), is_found=name in found) for name, members in by_light.items()
    ]
    return _with_rest(tied, emitters)


def _found_alike(
    emitters: Sequence[Emitter],
    group_of: Mapping[str, str],
    groups: Collection[str],
    asked: Iterable[str],
) -> dict[str, tuple[Emitter, ...]]:
    """Lights of many emitters that are alike, without those in groups and those asked for alone."""
    free = [emitter for emitter in emitters if emitter.name not in group_of]
    found = alike_groups(free, {*groups, *(emitter.name for emitter in emitters)})
    inside = {member.name for its in found.values() for member in its}
    lights = {*groups, *found, *(emitter.name for emitter in free)} - inside
    parted: set[str] = set()
    for pattern in asked:
        if pattern in inside:
            parted.add(pattern)
        elif not any(fnmatchcase(name, pattern) for name in lights):
            parted |= {name for name in inside if fnmatchcase(name, pattern)}
    return without(found, parted)


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
        if not 0 < len(group) <= MAX_NAME:
            raise SceneError(
                "a group needs a name, by which its members are given, of at most "
                f"{MAX_NAME} characters"
            )
        listed = _listed(patterns, f"group {group!r}")
        for pattern in listed:
            found = _matching(pattern, names, f"group {group!r}", scene)
            its = [e for e in emitters if e.name in found]
            if pattern not in names:
                # A pattern takes what can be taken; a name is meant.
                its = [e for e in its if not e.obstacle] or its
            check_adjustable(its)
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
            check_adjustable([emitter for emitter in emitters if emitter.name == pattern])
            if group := group_of.get(pattern):
                raise SceneError(
                    f"light {pattern!r} is part of the group {group!r}: choose that, or leave "
                    f"{pattern!r} out of it"
                )
        chosen |= _matching(pattern, [*by_light], "lights", scene)
    return chosen


def _matching(pattern: str, names: Sequence[str], where: str, scene: str) -> set[str]:
    """The name itself, else all that match it as a pattern. Raises SceneError if none does."""
    if pattern in names:
        return {pattern}
    found = {name for name in names if fnmatchcase(name, pattern)}
    if not found:
        close = difflib.get_close_matches(pattern, names, n=1)
        hint = f"did you mean {close[0]!r}? It" if close else "it"
        raise SceneError(
            f"{where}: {scene} has no light {pattern!r}; {hint} has {some_names(names)}"
        )
    return found


def _listed(names: Iterable[str], where: str) -> list[str]:
    """Checked to be a list that names something."""
    # A text is a list of its letters too, and never what was meant.
    listed = [names] if isinstance(names, str) else list(names)
    if len(listed) > MAX_LISTED:
        raise SceneError(f"{where} lists {len(listed)} names: at most {MAX_LISTED} are read")
    if not listed or not all(isinstance(name, str) and name for name in listed):
        raise SceneError(f"{where}: name at least one light, and each by its name")
    return listed
