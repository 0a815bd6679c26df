"""The role of each layer: a light, the whole picture, or neither. Names propose; sums decide.

A layer is identified by its own name, such as `ViewLayer.Combined_key`. A pattern may also match
the name of its part or file.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from lightpaint.basis.lightgroups.beauty_comparison import (
    LayerSum,
    find_beauty,
    find_beauty_of_lights,
    layers_needed,
    unrelated_layer,
)
from lightpaint.basis.lightgroups.naming_conventions import (
    CONVENTIONS,
    NAME_FIELD,
    OTHER_VERSION,
    SEPARATORS,
    Convention,
    beauty_name,
    is_beauty,
    is_known,
)
from lightpaint.basis.lightgroups.render_layers import RenderLayer
from lightpaint.display_text import some_names
from lightpaint.errors import BasisError
from lightpaint.sentences import Hint, Sentence

#: Name for files that no convention matches, in place of a renderer.
ONE_FILE_PER_LIGHT = "one file per light"

#: The view layer of layers whose names have none, for people.
UNNAMED_VIEW = "(unnamed)"

#: Largest light by which groups exceed a picture that they add up to, as a share of its light:
#: what denoising takes from their noise.
MAX_SUM_EXCESS = 0.25


@dataclass(frozen=True)
class LayerChoice:
    """The roles of layers.

    lights: light name → layer name. optional: the same for layers that may or may not be part of
    the sum. whole: the same for a group whose name says that it contains all others, which the sum
    then confirms or not. versions: the same for groups whose name says that they show another layer
    differently, likewise. beauty: name of its layer; None if no layer has a known name for it.
    has_pattern: whether the lights are matched by a pattern, which may match the whole picture.
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
        named = [x or UNNAMED_VIEW for x in views]
        remarks.append(
            Sentence(
                f"of the view layers {some_names(named)} the first is taken: ",
                Hint("pattern", pattern),
                f" takes {named[1]}",
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


@dataclass(frozen=True)
class Roles:
    """The lights by name, and the picture that they add up to; None if there is none.

    renderer: the one whose naming convention fits. view: the view layer, or "". noisy: the layer
    that is the sum of the lights where the picture is not, since it was denoised; else None.
    """

    renderer: str
    view: str
    lights: Mapping[str, RenderLayer]
    beauty: RenderLayer | None
    remarks: tuple[str, ...]
    noisy: RenderLayer | None = None


def roles_of(path: Path, read: Sequence[RenderLayer], pattern: str | None) -> Roles:
    """Identify the role of each layer in the file or folder at `path`.

    pattern: as in `choose_layers`. Raises BasisError if the names are ambiguous.
    """
    layers = {layer.name: layer for layer in read}
    choice = _choose_roles(path, layers, pattern)
    lights = {name: layers[layer] for name, layer in choice.lights.items()}
    beauty = layers[choice.beauty] if choice.beauty is not None else None
    if beauty is None:
        light_layers = {id(layer) for layer in lights.values()}
        others = [layer for layer in layers.values() if id(layer) not in light_layers]
        beauty = find_beauty_of_lights(others, list(lights.values()))
    remarks = list(choice.remarks)
    if choice.renderer == ONE_FILE_PER_LIGHT:
        beauty, remarks_on_files = _remove_non_lights(lights, beauty)
        remarks += remarks_on_files
    elif not choice.has_pattern:
        versions = {name: layers[layer] for name, layer in choice.versions.items()}
        remarks += _sort_out_versions(lights, versions, beauty)
    whole = {name: layers[layer] for name, layer in choice.whole.items()}
    beauty, left_out = _sort_out_sums(lights, whole, beauty, has_pattern=choice.has_pattern)
    remarks += [f"{x}: taken for the sum of all lights, and left out" for x in left_out]
    in_order = {n: x for layer in read for n, x in lights.items() if x is layer}
    for name, layer in choice.optional.items():
        # Renderers include these in the sum or not, depending on version and settings.
        if beauty is None or _improves_sum(layers[layer], list(in_order.values()), beauty):
            in_order[name] = layers[layer]
    noisy = _noisy(layers.values(), list(in_order.values()), beauty)
    return Roles(choice.renderer, choice.view, in_order, beauty, tuple(remarks), noisy)


def _noisy(
    layers: Iterable[RenderLayer], lights: Sequence[RenderLayer], beauty: RenderLayer | None
) -> RenderLayer | None:
    """Return the layer that is the sum of the lights if the whole picture is not, and is noisy by
    its name: Cycles denoises the picture, but no group.
    """
    others = [layer for layer in layers if "noisy" in layer.name.casefold()]
    if beauty is None or not others or not lights or LayerSum.of(lights).is_of(beauty):
        return None
    return find_beauty_of_lights(others, lights)


def _remove_non_lights(
    lights: dict[str, RenderLayer], beauty: RenderLayer | None
) -> tuple[RenderLayer | None, list[str]]:
    """Remove layers that are not lights; return the whole picture, and sentences on what was
    removed.

    One layer may be the picture itself under an unusual name. A layer that the others do not need
    to add up to the picture is not a light, whatever it shows.
    """
    if beauty is None and len(lights) > 2:
        beauty = find_beauty(list(lights.values()))
        _drop(lights, beauty)
    unrelated = unrelated_layer(list(lights.values()), beauty)
    if unrelated is None:
        return beauty, []
    stranger, whole = unrelated
    _drop(lights, stranger)
    _drop(lights, whole)
    reason = f"without it the others add up to {whole.file.name}"
    return whole, [f"left out of the lights: {stranger.file.name} ({reason})"]


def _sort_out_sums(
    lights: dict[str, RenderLayer],
    whole: Mapping[str, RenderLayer],
    beauty: RenderLayer | None,
    *,
    has_pattern: bool,
) -> tuple[RenderLayer | None, list[str]]:
    """Decide by the sum which layers are the whole picture; return it, and the names of layers
    that are left out.

    whole: groups named like the picture. has_pattern: a pattern that matches all lights may match
    the picture, under any name, and what it was before denoising.
    """
    sums = _remove_sums(lights) if has_pattern else []
    for name, layer in whole.items():
        others = list(lights.values())
        if beauty is None and _may_be_whole(layer, others):
            beauty = layer
        elif beauty is None or _is_light(layer, others, beauty):
            lights[name] = layer
        else:
            sums.append(layer)
    sums += _remove_sums(lights) if has_pattern else []
    beauty = beauty or next(iter(sums), None)
    return beauty, [layer.name for layer in sums if layer is not beauty]


def _remove_sums(lights: dict[str, RenderLayer]) -> list[RenderLayer]:
    """Remove layers that are the sum of the others, and return them."""
    removed = []
    while len(lights) > 2 and (found := find_beauty(list(lights.values()))) is not None:
        _drop(lights, found)
        removed.append(found)
    return removed


def _sort_out_versions(
    lights: dict[str, RenderLayer], versions: Mapping[str, RenderLayer], beauty: RenderLayer | None
) -> list[str]:
    """Decide by the sum which groups named like versions of others are lights; return a sentence
    on those that are left out.

    versions: groups that are versions of another layer by their names. Some of the lights have
    such names, too, but there is no other layer that they could show.
    """
    doubtful = {n: x for n, x in lights.items() if OTHER_VERSION.fullmatch(x.name)}
    doubtful.update(versions)
    if not doubtful:
        return []
    certain = [layer for name, layer in lights.items() if name not in doubtful]
    accepted = [name for name in doubtful if name not in versions]
    if beauty is not None and not (lights and LayerSum.of([*lights.values()]).is_of(beauty)):
        accepted = layers_needed(beauty, certain, doubtful) or [
            name for name in accepted if _improves_sum(doubtful[name], certain, beauty)
        ]
    for name, layer in doubtful.items():
        if name in accepted:
            lights[name] = layer
        else:
            lights.pop(name, None)
    left_out = [layer.name for name, layer in doubtful.items() if name not in accepted]
    if not left_out:
        return []
    return [f"{some_names(left_out)}: taken for another version of a layer, and left out"]


def _drop(lights: dict[str, RenderLayer], layer: RenderLayer | None) -> None:
    for name in [name for name, light_layer in lights.items() if light_layer is layer]:
        del lights[name]


def _may_be_whole(layer: RenderLayer, lights: Sequence[RenderLayer]) -> bool:
    """Return True unless the lights are clearly more than a layer named like the whole picture,
    which may be denoised and have light that is in no group.
    """
    return not lights or LayerSum.of(lights).exceeds(layer) <= MAX_SUM_EXCESS


def _is_light(layer: RenderLayer, lights: Sequence[RenderLayer], beauty: RenderLayer) -> bool:
    """Return True if a layer named like the whole picture is in fact one of the lights."""
    single_sum = LayerSum.of([layer])
    return LayerSum.of(lights).and_also(layer).lacks(beauty) < single_sum.lacks(beauty)


def _improves_sum(layer: RenderLayer, lights: Sequence[RenderLayer], beauty: RenderLayer) -> bool:
    """Return True if adding the layer brings the lights closer to the beauty, or if there are no
    lights.
    """
    if not lights:
        return True
    light_sum = LayerSum.of(lights)
    return light_sum.and_also(layer).lacks(beauty) < light_sum.lacks(beauty)


def _choose_roles(path: Path, layers: dict[str, RenderLayer], pattern: str | None) -> LayerChoice:
    by_file: dict[Path, int] = {}
    for layer in layers.values():
        by_file[layer.file] = by_file.get(layer.file, 0) + 1
    if pattern is None and len(by_file) == len(layers) > 1 and not any(map(is_known, layers)):
        return choose_files(layers)
    others = {name: layer.others for name, layer in layers.items()}
    return choose_layers(others, pattern=pattern, file_name=str(path))
