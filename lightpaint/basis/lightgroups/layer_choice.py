"""Chooses by name which layers of a file are light groups, and which is the whole picture.

A layer is identified by its own name, such as `ViewLayer.Combined_key`. A pattern may also match
the name of its part or file.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from lightpaint.basis.lightgroups.naming_conventions import (
    CONVENTIONS,
    NAME_FIELD,
    OTHER_VERSION,
    SEPARATORS,
    Convention,
    beauty_name,
    is_beauty,
)
from lightpaint.display_text import some_names
from lightpaint.errors import BasisError
from lightpaint.sentences import Hint, Sentence

#: Name for files that no convention matches, in place of a renderer.
ONE_FILE_PER_LIGHT = "one file per light"


@dataclass(frozen=True)
class LayerChoice:
    """The roles of layers.

    lights: light name → layer name. optional: the same for layers that may or may not be part of
    the sum. whole: the same for a group whose name says that it contains all others, which the sum
    then confirms or not. versions: the same for groups whose name says that they show another layer
    differently, likewise. beauty: name of its layer; None if no layer has a known name for it.
    has_pattern: whether the lights are those of a pattern, which may match the whole picture.
    """

    renderer: str
    lights: Mapping[str, str]
    optional: Mapping[str, str] = field(default_factory=dict)
    whole: Mapping[str, str] = field(default_factory=dict)
    versions: Mapping[str, str] = field(default_factory=dict)
    beauty: str | None = None
    view: str = ""
    has_pattern: bool = False
    remarks: tuple[str, ...] = ()


def choose_layers(
    layers: Mapping[str, Sequence[str]], *, pattern: str | None = None, file_name: str
) -> LayerChoice:
    """Identify the lights and the beauty among the layers.

    layers: layer name → other names that a pattern may match.
    pattern: for example `Light_{name}`, replaces the known conventions. file_name: for messages.
    Raises BasisError, listing the layers, if no convention or more than one fits.
    """
    if pattern is not None:
        return _by_pattern(layers, pattern, file_name)
    fitting = []
    for convention in CONVENTIONS:
        matches = [m for name in layers if (m := convention.layer.fullmatch(name))]
        if any(not _is_version(m, layers) for m in matches):
            fitting.append((convention, matches))
    if len(fitting) == 1:
        return _by_convention(layers, *fitting[0], file_name)
    if fitting:
        counts = [f"{len(matches)} as of {convention.renderer}" for convention, matches in fitting]
        raise BasisError(
            f"{file_name} names its layers in several ways ({some_names(counts)}): say which are "
            "the lights, like ",
            Hint("pattern", _example_pattern(layers)),
            f"; {_layer_list(layers)}",
        )
    raise BasisError(
        f"{file_name} has no layers named like the light groups of a known renderer: say which "
        "they are, like ",
        Hint("pattern", _example_pattern(layers)),
        f"; {_layer_list(layers)}",
    )


def choose_files(layers: Iterable[str]) -> LayerChoice:
    """Choose among files with a single layer each: all except the beauty are lights."""
    names = list(layers)
    beauty = beauty_name(names)
    return LayerChoice(ONE_FILE_PER_LIGHT, {n: n for n in names if n != beauty}, beauty=beauty)


def short_names(stems: Sequence[str]) -> dict[str, str]:
    """Return names without their common start and end, cut at a separator or before a number:
    `shot_key_v1` → `key`, `key0001` → `key`.
    """
    if len(stems) < 2:
        return {stem: stem for stem in stems}
    head = _shared_head(stems)
    head = head[: max((head.rfind(joint) + 1 for joint in SEPARATORS), default=0)]
    trimmed_names = [stem[len(head) :] for stem in stems]
    tail = _shared_head([name[::-1] for name in trimmed_names])[::-1]
    starts = [k for joint in SEPARATORS if (k := tail.find(joint)) >= 0]
    if not starts:
        number = re.search(r"\d*$", tail)
        starts = (
            [number.start()] if number and not _is_part_of_number(trimmed_names, number) else []
        )
    tail = tail[min(starts) :] if starts else ""
    trimmed_names = [name.removesuffix(tail) for name in trimmed_names]
    return dict(zip(stems, trimmed_names if all(trimmed_names) else stems, strict=True))


def _is_part_of_number(names: Sequence[str], end: re.Match[str]) -> bool:
    """Return True if a digit stands before the end that all names share in one of them."""
    length = len(end[0])
    return any(name[: len(name) - length][-1:].isdigit() for name in names)


def _shared_head(names: Sequence[str]) -> str:
    """Return the common start of all names."""
    low, high = min(names), max(names)
    common_length = next(
        (k for k, (a, b) in enumerate(zip(low, high, strict=False)) if a != b), len(low)
    )
    return low[:common_length]


def _by_convention(
    layers: Mapping[str, Sequence[str]],
    convention: Convention,
    matches: list[re.Match[str]],
    file_name: str,
) -> LayerChoice:
    remarks = []
    views = list(dict.fromkeys(_view(m) for m in matches))
    view = views[0]
    if len(views) > 1:
        other = next(m for m in matches if _view(m) == views[1])
        pattern = f"{other[0][: other.start('name')]}{NAME_FIELD}{other[0][other.end('name') :]}"
        remarks.append(
            Sentence(
                f"of the view layers {some_names(views)} the first is taken: ",
                Hint("pattern", pattern),
                f" takes {views[1]}",
            )
        )
    matches = [m for m in matches if _view(m) == view]
    _check_not_stereo([m[0] for m in matches], file_name)
    groups = _unique_lights(_light_names(convention, matches), file_name)
    version_layers = {m[0] for m in matches if _is_version(m, layers)}
    # Decided by name alone, since a single group cannot be compared with others.
    whole = {n: x for n, x in groups.items() if n == convention.whole and len(groups) > 1}
    versions = {n: x for n, x in groups.items() if x in version_layers and n not in whole}
    lights = {n: x for n, x in groups.items() if n not in whole and n not in versions}
    rest = [name for name in layers if name not in groups.values()]
    optional = [name for name in rest if name.casefold() in convention.optional]
    first = f"{view}{convention.joint}{convention.beauty}" if view else convention.beauty
    return LayerChoice(
        convention.renderer,
        lights,
        optional={name: name for name in optional if name not in lights},
        whole=whole,
        versions=versions,
        beauty=beauty_name((x for x in rest if x not in optional), first=first, view=view),
        view=view,
        remarks=tuple(remarks),
    )


def _view(match: re.Match[str]) -> str:
    """Return the view layer in a layer's name; "" without one."""
    return match.groupdict().get("view") or ""


def _is_version(match: re.Match[str], layers: Iterable[str]) -> bool:
    """Return True if the name of a group says that it shows another layer, which there is, or the
    whole picture differently.
    """
    version = OTHER_VERSION.fullmatch(match[0])
    return version is not None and (
        version["base"] in layers or match["name"] == version["version"]
    )


def _light_names(convention: Convention, matches: list[re.Match[str]]) -> list[tuple[str, str]]:
    """Return pairs of light and layer names, with prefixes if these differ."""
    prefixes = [m.groupdict().get("prefix") or "" for m in matches]
    has_several_prefixes = len(set(prefixes)) > 1
    return [
        (
            f"{prefix}_" * bool(has_several_prefixes and prefix)
            + convention.light.replace(NAME_FIELD, m["name"]),
            m[0],
        )
        for prefix, m in zip(prefixes, matches, strict=True)
    ]


def _by_pattern(layers: Mapping[str, Sequence[str]], pattern: str, file_name: str) -> LayerChoice:
    if pattern.count(NAME_FIELD) != 1:
        raise BasisError(
            Hint("pattern", pattern),
            f" must have {NAME_FIELD} once, where the name of the light stands, like "
            "'Light_{name}'",
        )
    prefix, suffix = pattern.split(NAME_FIELD)
    name_pattern = re.compile(f"{re.escape(prefix)}(.+){re.escape(suffix)}", re.DOTALL)
    matches = []
    for layer, other_names in layers.items():
        match = next(
            (m for name in (layer, *other_names) if (m := name_pattern.fullmatch(name))), None
        )
        if match:
            matches.append((match[1], layer))
    if not matches:
        listing = _layer_list(layers)
        raise BasisError(Hint("pattern", pattern), f" fits no layer of {file_name}: {listing}")
    view = prefix.rpartition(".")[0]
    names = [layer for layer in layers if layer not in [matched for _, matched in matches]]
    first = {
        (
            prefix.rstrip(SEPARATORS) + suffix
        ).casefold(),  # View.Combined.left of View.Combined_key.left
        (prefix + suffix).strip(SEPARATORS).casefold(),
    } - {""}
    beauty = next((x for x in names if x.casefold() in first), beauty_name(names, view=view))
    lights = _unique_lights(matches, file_name)
    # A pattern as broad as {name} also matches the beauty.
    likely = beauty_name(lights.values(), view=view) if len(lights) > 1 else None
    whole = {name: layer for name, layer in lights.items() if layer == likely}
    return LayerChoice(
        f"pattern {pattern}",
        {name: layer for name, layer in lights.items() if name not in whole},
        whole=whole,
        beauty=beauty,
        has_pattern=True,
    )


def _check_not_stereo(names: Sequence[str], file_name: str) -> None:
    """Raise BasisError for stereo files, with the same names once as `.left` and once as
    `.right`.
    """
    left, right = (
        {name.removesuffix(eye) for name in names if name.endswith(eye)}
        for eye in (".left", ".right")
    )
    if in_both := sorted(left & right):
        head = in_both[0].rpartition("_")[0]
        raise BasisError(
            f"{file_name} holds the views left and right, but a solve uses one view: say which, "
            "like ",
            Hint("pattern", f"{head}_{NAME_FIELD}.left"),
        )


def _unique_lights(pairs: Sequence[tuple[str, str]], file_name: str) -> dict[str, str]:
    lights: dict[str, str] = {}
    for name, layer in pairs:
        if name in lights:
            raise BasisError(
                f"{file_name} has the light {name!r} twice, in {lights[name]} and in {layer}: "
                "say which are meant with ",
                Hint("pattern"),
            )
        lights[name] = layer
    return lights


def _example_pattern(layers: Iterable[str]) -> str:
    """Return a pattern that matches several of the layers if there is one, else a generic
    example.

    It begins with what the most layers have in common, up to a separator. A head that the whole
    picture has too, such as the view layer, says little, so any other is better.
    """
    beauties = [name for name in layers if is_beauty(name)]
    names = [x for x in layers if x not in beauties and not OTHER_VERSION.fullmatch(x)]
    heads: dict[str, list[str]] = {}
    for name in names:
        for k, character in enumerate(name[:-1]):
            if k and character in SEPARATORS:
                heads.setdefault(name[: k + 1], []).append(name)
    shared = {head: of_head for head, of_head in heads.items() if len(of_head) > 1}
    if not shared:
        has_plain_names = bool(beauties) and len(names) > 1
        return NAME_FIELD if has_plain_names else f"Light_{NAME_FIELD}"

    def rank(head: str) -> tuple[bool, int, int]:
        return not any(x.startswith(head) for x in beauties), len(shared[head]), len(head)

    return f"{max(shared, key=rank)}{NAME_FIELD}"


def _layer_list(layers: Iterable[str]) -> str:
    return f"its RGB layers are {some_names(name or 'R, G, B' for name in layers) or 'none'}"
