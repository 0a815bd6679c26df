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
)
from lightpaint.display_text import some_names
from lightpaint.errors import BasisError

#: Name for files that no convention matches, in place of a renderer.
ONE_FILE_PER_LIGHT = "one file per light"


@dataclass(frozen=True)
class LayerChoice:
    """The roles of layers.

    lights: light name → layer name. optional: the same for layers that may or may not be part of
    the sum. whole: the same for a group whose name says that it contains all others, which the sum
    then confirms or not. beauty: name of its layer; None if no layer has a known name for it.
    """

    renderer: str
    lights: Mapping[str, str]
    optional: Mapping[str, str] = field(default_factory=dict)
    whole: Mapping[str, str] = field(default_factory=dict)
    beauty: str | None = None
    view: str = ""
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
        if any(not OTHER_VERSION.fullmatch(m[0]) for m in matches):
            fitting.append((convention, matches))
    if len(fitting) == 1:
        return _by_convention(layers, *fitting[0], file_name)
    if fitting:
        counts = [f"{len(matches)} as of {convention.renderer}" for convention, matches in fitting]
        raise BasisError(
            f"{file_name} names its layers in several ways ({some_names(counts)}): say which are "
            f"the lights, like pattern={_example_pattern(layers)!r}; {_layer_list(layers)}"
        )
    raise BasisError(
        f"{file_name} has no layers named like the light groups of a known renderer: say which "
        f"they are, like pattern={_example_pattern(layers)!r}; {_layer_list(layers)}"
    )


def choose_files(layers: Iterable[str]) -> LayerChoice:
    """Choose among files with a single layer each: all except the beauty are lights."""
    names = list(layers)
    beauty = beauty_name(names)
    return LayerChoice(ONE_FILE_PER_LIGHT, {n: n for n in names if n != beauty}, beauty=beauty)


def short_names(stems: Sequence[str]) -> dict[str, str]:
    """Return names without their common start and end, cut at a separator: `shot_key_v1` →
    `key`.
    """
    if len(stems) < 2:
        return {stem: stem for stem in stems}
    head = _shared_head(stems)
    head = head[: max((head.rfind(joint) + 1 for joint in SEPARATORS), default=0)]
    trimmed_names = [stem[len(head) :] for stem in stems]
    tail = _shared_head([name[::-1] for name in trimmed_names])[::-1]
    starts = [k for joint in SEPARATORS if (k := tail.find(joint)) >= 0]
    tail = tail[min(starts) :] if starts else ""
    trimmed_names = [name.removesuffix(tail) for name in trimmed_names]
    return dict(zip(stems, trimmed_names if all(trimmed_names) else stems, strict=True))


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
    other_versions = [m[0] for m in matches if OTHER_VERSION.fullmatch(m[0])]
    matches = [m for m in matches if m[0] not in other_versions]
    if other_versions:
        remarks.append(
            f"{some_names(other_versions)}: taken for another version of a layer, and left out"
        )
    views = list(dict.fromkeys(m.groupdict().get("view") or "" for m in matches))
    view = views[0]
    if len(views) > 1:
        remarks.append(
            f"of the view layers {some_names(views)} the first is taken: "
            f"pattern='{views[1]}{convention.joint}Combined_{NAME_FIELD}' takes {views[1]}"
        )
    matches = [m for m in matches if (m.groupdict().get("view") or "") == view]
    _check_not_stereo([m[0] for m in matches], file_name)
    lights = _unique_lights(_light_names(convention, matches), file_name)
    # Decided by name alone, since a single group cannot be compared with others.
    whole = {n: x for n, x in lights.items() if n == convention.whole and len(lights) > 1}
    lights = {name: layer for name, layer in lights.items() if name not in whole}
    rest = [name for name in layers if name not in [*lights.values(), *whole.values()]]
    optional = [name for name in rest if name.casefold() in convention.optional]
    first = convention.beauty.replace("{view}", f"{view}{convention.joint}" if view else "")
    return LayerChoice(
        convention.renderer,
        lights,
        {name: name for name in optional if name not in lights},
        whole,
        beauty_name((name for name in rest if name not in optional), first=first),
        view,
        tuple(remarks),
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
            f"pattern={pattern!r} must have {NAME_FIELD} once, where the name of the light stands, "
            "like 'Light_{name}'"
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
        raise BasisError(f"pattern={pattern!r} fits no layer of {file_name}: {_layer_list(layers)}")
    # A pattern as broad as {name} also matches the beauty.
    names = [layer for layer in layers if layer not in [matched for _, matched in matches]]
    first = {
        (
            prefix.rstrip(SEPARATORS) + suffix
        ).casefold(),  # View.Combined.left of View.Combined_key.left
        (prefix + suffix).strip(SEPARATORS).casefold(),
    } - {""}
    beauty = next((name for name in names if name.casefold() in first), beauty_name(names))
    if beauty is None:
        beauty = beauty_name(layer for _, layer in matches)
    matches = [(name, layer) for name, layer in matches if layer != beauty]
    return LayerChoice(f"pattern {pattern}", _unique_lights(matches, file_name), beauty=beauty)


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
            f"like pattern='{head}_{NAME_FIELD}.left'"
        )


def _unique_lights(pairs: Sequence[tuple[str, str]], file_name: str) -> dict[str, str]:
    lights: dict[str, str] = {}
    for name, layer in pairs:
        if name in lights:
            raise BasisError(
                f"{file_name} has the light {name!r} twice, in {lights[name]} and in {layer}: "
                "say which are meant with pattern=..."
            )
        lights[name] = layer
    return lights


def _example_pattern(layers: Iterable[str]) -> str:
    """Return a pattern that matches several of the layers if there is one, else a generic
    example.
    """
    names = [name for name in layers if beauty_name([name]) is None]
    head_counts: dict[str, int] = {}
    for name in names:
        for k in (name.find(joint) for joint in SEPARATORS):
            if 0 < k < len(name) - 1:
                head_counts[name[: k + 1]] = head_counts.get(name[: k + 1], 0) + 1
    best_head = max(head_counts, key=lambda head: head_counts[head], default=None)
    return (
        f"{best_head}{NAME_FIELD}"
        if best_head and head_counts[best_head] > 1
        else f"Light_{NAME_FIELD}"
    )


def _layer_list(layers: Iterable[str]) -> str:
    return f"its RGB layers are {some_names(name or 'R, G, B' for name in layers) or 'none'}"
