"""The role of each layer: a light, the whole picture, or neither. Names propose; sums decide."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from lightpaint.basis.lightgroups.beauty_comparison import (
    LayerSum,
    find_beauty,
    find_beauty_of_lights,
    layers_needed,
    unrelated_layer,
)
from lightpaint.basis.lightgroups.layer_choice import (
    ONE_FILE_PER_LIGHT,
    LayerChoice,
    choose_files,
    choose_layers,
)
from lightpaint.basis.lightgroups.naming_conventions import OTHER_VERSION, is_known
from lightpaint.basis.lightgroups.render_layers import RenderLayer
from lightpaint.display_text import some_names

#: Largest light by which groups exceed a picture that they add up to, as a share of its light:
#: what denoising takes from their noise.
MAX_SUM_EXCESS = 0.25


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
