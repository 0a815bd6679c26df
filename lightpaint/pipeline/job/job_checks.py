"""Checks of a job's inputs that need no renderer: their number, their kinds, their sensors; and
remarks for the user before a job runs, in plain text.
"""

from collections.abc import Mapping, Sequence
from math import prod
from pathlib import Path
from typing import Any

from lightpaint.basis import Basis, LightGroups, render, with_equal_lights
from lightpaint.display_text import some_names
from lightpaint.errors import BasisError, ConstraintError, LightpaintError, SceneError, TargetError
from lightpaint.images import (
    MISSING_REMARK,
    Size,
    left_over,
    oidn_is_installed,
    picture_size,
    whole_factor,
)
from lightpaint.lighting import Constraints, check_same_lights
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import BasisFile, GroupsFile, Painting, SceneFile, content
from lightpaint.placement import Rigging, check_rigging, rigged_lights, rigging_of
from lightpaint.scene import Scene
from lightpaint.scene.lights.texels import CHILDREN, DOMAINS, Sky, mirrored_pairs, node_name
from lightpaint.scene.quality_presets import PRESETS, on_film
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.sentences import Hint, Sentence, Word
from lightpaint.target import Target, check_fits

#: Emitters that shine from all directions.
SKY_PLUGINS = [plugin for plugin, domain in DOMAINS.items() if isinstance(domain, Sky)]

#: Pixels above which a painting is compared with the film of a scene before it is decoded.
LARGE_PAINTING = 2**22

#: Bytes of memory above which a basis gets a remark.
MUCH_MEMORY = 2e9


def check_sizes(targets: Sequence[Any], sources: Sequence[Any], settings: Settings) -> None:
    """Raise SizeError for a painting of another size than its basis, before any is decoded.

    targets, sources: as given; scenes if there are no bases. To read a scene takes longer than to
    decode most paintings, so these are asked for their film only by large ones.
    """
    for target, source in zip(targets, sources, strict=False):
        if settings.resize or not isinstance(target, Painting):
            continue
        if (size := picture_size(target.path)) is None:
            continue
        if isinstance(source, Scene | SceneFile):
            needed = _film_below(size, source, settings) if prod(size) > LARGE_PAINTING else None
        else:
            needed = _size_of(source)
        if needed is not None:
            check_fits(Path(target.path), size, needed)


def _film_below(size: Size, scene: Scene | SceneFile, settings: Settings) -> Size | None:
    """Return the (height, width) of a film with fewer pixels than a painting; else None, since a
    scene is reduced to smaller paintings.
    """
    film = on_film(content(scene), settings.quality, settings.resolution).size
    return film if prod(film) < prod(size) else None


def _size_of(basis: Any) -> Size | None:
    """Return the (height, width) of a basis, of a file of one from its head; None of a folder."""
    if isinstance(basis, LightGroups):
        return basis.basis.size
    if isinstance(basis, Basis):
        return basis.size
    if isinstance(basis, BasisFile | GroupsFile) and Path(basis.path).is_file():
        return picture_size(basis.path)
    return None


def check_inputs(
    scenes: Sequence[Any],
    targets: Sequence[Any],
    bases: Sequence[Any],
    constraints: object,
    settings: Settings,
) -> None:
    """Raise unless every view has a painting, and there is a scene or a basis."""
    if not isinstance(constraints, Constraints):
        raise ConstraintError(
            f"the constraints are a {type(constraints).__name__}: pass Constraints.of(...)"
        )
    if not scenes and not bases:
        raise LightpaintError("give a scene, a basis, or both")
    if not targets:
        raise TargetError("no painting to solve for: give a target")
    if (
        bases
        and max(len(scenes), len(targets), len(bases)) > 1
        and (scenes or len(bases) != len(targets))
    ):
        raise BasisError(
            "a basis has only one view: give the scene to solve for several, or a basis for each"
        )
    if scenes and len(targets) != len(scenes):
        raise TargetError(
            f"{len(targets)} targets for {len(scenes)} views: give one for each; "
            "several paintings of one view need a job each"
        )


def check_painting_is_no_light(basis: Any, target: Target | Painting) -> None:
    """Raise BasisError if a folder of light groups includes the painting as a light."""
    groups = content(basis)
    if not isinstance(groups, LightGroups) or not groups.path.is_dir():
        return
    files = {layer.file.resolve() for layer in groups.layers}
    if isinstance(target, Painting) and Path(target.path).resolve() in files:
        raise BasisError(
            f"the painting {target.path} is among the lights of {groups.path}: pass it to "
            "read_light_groups in leave_out, or move it elsewhere"
        )


def checked_scale(planes: str | Path, cd_per_unit: float | None) -> float:
    """Return cd/m² of a radiance of 1. Raises LightpaintError if nothing says it for planes."""
    if cd_per_unit is None:
        raise LightpaintError(
            f"{planes} asks for lux, and nothing says how many cd/m² a radiance of 1 is: pass ",
            Hint("cd_per_unit", 1),
            ", or cd_per_unit in the lights file",
        )
    return cd_per_unit


def check_places(placement: object, scenes: Sequence[object]) -> None:
    """Raise LightpaintError if lights are to hang elsewhere in a scene that is not given."""
    if placement is not None and not scenes:
        raise LightpaintError(
            "lights can only hang elsewhere in their scene: give the scene, or leave ",
            Hint("placement"),
            " out",
        )


def with_same_lights(bases: Sequence[Basis | LightGroups]) -> list[Basis | LightGroups]:
    """Return the bases of all views with the same lights.

    Light groups that lack no part of the picture get a black `rest` if others do. Raises BasisError
    if lights differ, and for light groups beside another basis.
    """
    groups = [basis for basis in bases if isinstance(basis, LightGroups)]
    saved = [basis for basis in bases if isinstance(basis, Basis)]
    if groups and saved:
        raise BasisError(
            f"{groups[0].path} has light groups and another view has a saved basis: give one kind"
        )
    for basis in saved[1:]:
        check_same_lights(saved[0], basis)
    return [*(with_equal_lights(groups) if groups else []), *saved]


def check_animation(settings: Settings, constraints: Constraints, views: int) -> None:
    """Raise unless lights can change over the frames of a shot. views: its painted frames."""
    if not settings.animate:
        return
    if views < 2:
        raise TargetError(
            Hint("animate", True),
            " needs paintings of two frames of a shot, like 'shot.####.exr': there is "
            f"{views or 'none'}",
        )
    if settings.planes is not None:
        raise LightpaintError(
            "wishes for planes are met by one lighting, not by lights that change: leave ",
            Hint("planes"),
            " or ",
            Hint("animate", True),
            " out",
        )
    if constraints.sparse is not None:
        raise ConstraintError(
            "sparse chooses the lights of one lighting, not of every frame apart: leave it or ",
            Hint("animate", True),
            " out",
        )


def rigging_for(rigging: Rigging, scenes: Sequence[Scene], settings: Settings) -> Rigging:
    """Return the rigging of the scene.

    Raises for unknown names and for lights that cannot move, before rendering.
    """
    if not scenes:
        if rigging:
            raise LightpaintError("lights can only move in their scene: give the scene")
        return Rigging()
    all_rigging = rigging_of(scenes[0].requests).and_then(rigging)
    check_rigging(all_rigging, scenes[0])
    if not settings.move_lights:
        return Rigging()
    if all_rigging:
        rigged_lights(all_rigging, scenes[0])
    return all_rigging


def wanted_sun(settings: Settings, scenes: Sequence[Scene]) -> int:
    """Return how many finer texels a sky may get for a sun: as set, or as the lights file says."""
    if settings.sun is not None or not scenes:
        return settings.sun or 0
    return max(scenes[0].requests.sun.values(), default=0)


def sky_for_sun(scene: Scene, count: int) -> str:
    """Return the name of the sky of a scene that is split into texels.

    count: how many it may get more. Raises SceneError if it cannot have finer ones.
    """
    names = {x.texel.image: x.texel for x in scene.emitters if x.texel}
    skies = [name for name, texel in names.items() if isinstance(texel.domain, Sky)]
    if not skies:
        raise SceneError(
            Hint("sun", count),
            f" finds a sun in a sky that is split into texels, and {scene.path} has none: ",
            _advice_without_sky(scene),
        )
    [image] = skies
    if count < CHILDREN - 1:
        raise SceneError(
            Hint("sun", count),
            f": a texel that is split again becomes {CHILDREN}, expected at least "
            f"{CHILDREN - 1} more",
        )
    layout = names[image].layout
    pairs = mirrored_pairs(image, layout) if image in scene.symmetric else {}
    light_of = {name: tuple(pair) for pair in pairs.values() for name in pair}
    adjusted = {x.member_names for x in scene.lights if not x.is_fixed}
    texels = [node_name(image, node) for node in layout.nodes]
    if not all(light_of.get(name, (name,)) in adjusted for name in texels):
        raise SceneError(
            Hint("sun", count),
            f": each texel of {image} must be a light of its own, and some are in a "
            "group or not adjusted",
        )
    return image


def _advice_without_sky(scene: Scene) -> Sentence:
    """Return what to do about a sun in a scene that has no sky in texels."""
    texel = next((x.texel for x in scene.emitters if x.texel), None)
    if texel is None:
        skies = (x.name for x in scene.emitters if x.plugin in SKY_PLUGINS)
        sky = next(skies, "")
        if sky:
            return Sentence("split its sky with ", Hint("split", {sky: ...}))
        return Sentence("leave ", Hint("sun"), " out")
    columns, rows = (2 * k for k in texel.layout.size)
    return Sentence(
        f"the texels of {texel.image} are not split again; split it more finely, such as "
        f"{columns}x{rows}, and leave ",
        Hint("sun"),
        " out",
    )


def remarks_of_scene(scene: Scene, *, is_rendered: bool = True) -> list[str]:
    """Return remarks on the lights of a scene and, if it is rendered, on how."""
    remarks: list[str] = []
    if scene.lights_file is not None:
        remarks.append(f"lights and groups as in {scene.lights_file}")
    remarks += [
        Sentence(
            f"{len(x.members)} similar lamps without names form one light, {x.name}: ",
            Hint("group_alike", False),
            " separates them, ",
            Hint("groups", {"name": ...}),
            " makes a light of some",
        )
        for x in scene.lights
        if x.is_found
    ]
    # Many hang in a room, and few kinds of them.
    remarks += dict.fromkeys(text for x in scene.luminaires for text in x.remarks())
    if scene.integrator_choice is not None:
        remarks.append(
            f"rendered with {scene.integrator_choice} instead of the scene's own integrator"
        )
    if scene.is_spectral and (camera := scene.observer).is_camera:
        remarks.append(
            f"seen by the camera {camera.name}, whose colours in daylight differ from the eye's by "
            f"a mean ΔE of {camera.color_error:.1f}"
        )
    if obstacles := [f"{x.name!r} {x.obstacle}" for x in scene.emitters if x.obstacle]:
        remarks.append(f"not adjusted: {some_names(obstacles, '; ')}")
    remarks += _remarks_on_shared_elements(scene)
    if scene.is_spectral and (metals := scene.rgb_metals):
        remarks.append(
            f"{some_names(metals)}: eta and k in RGB, which Mitsuba's spectral variants show too "
            "dark; give the metal by its name (material) or by spectra"
        )
    if is_rendered and (fog := render.remark_on_fog(scene)) is not None:
        remarks.append(fog)
    # Python code gets the same text as a warning.
    note = use_variant().note
    if not note and is_rendered:
        note = render.remark_on_separate_renders(scene) or ""
    return [*remarks, note] if note else remarks


def _remarks_on_shared_elements(scene: Scene) -> list[str]:
    """Return a remark for each file that is included more than once, on its lights."""
    names: dict[Path, dict[int, set[str]]] = {}
    for light in scene.lights:
        for member in light.members:
            if member.texel is None:
                in_file = names.setdefault(scene.files[member.file].resolve(), {})
                in_file.setdefault(member.offset, set()).add(light.name)
    return [
        f"{file.name} is included more than once: the lights "
        f"{'; '.join(some_names(sorted(x)) for x in shared)} are one element of it, and can only "
        "get the same emission: include two copies of it, or tie them into a group"
        for file, in_file in names.items()
        if (shared := [x for x in in_file.values() if len(x) > 1])
    ]


def remarks_on_spectra(scene: Scene, constraints: Constraints) -> list[Sentence]:
    """Return a remark on lamps with spectra in a scene that is rendered without them."""
    names = {
        name
        for name, table, _ in constraints.lights
        for emitter in table.get("emitters", ())
        if isinstance(emitter, Mapping) and "spectrum" in emitter
    }
    if scene.is_spectral or not names:
        return []
    verb = "has" if len(names) == 1 else "have"
    remark = Sentence(
        f"{some_names(sorted(names))} {verb} spectra, of which pictures in RGB show the colour "
        "alone: ",
        Hint("spectral", True),
        " renders with them",
    )
    return [remark]


def remarks_of_film(scene: Scene, settings: Settings) -> list[str]:
    """Return remarks on pixels that a reduced film leaves out, and on its size.

    scene: on the reduced film.
    """
    film, remarks = scene.film, []
    width, height = film.pixels
    if any(film.left_out):
        film_text = "x".join(map(str, film.crop_size))
        remarks.append(
            f"film of {film_text} reduced to {width}x{height} blocks of {film.block}x{film.block} "
            f"pixels: {_remainder_text(film.left_out)} left over and ignored"
        )
    max_pixels = None
    if settings.quality is not None and settings.resolution is None:
        max_pixels = PRESETS[settings.quality].pixels
    if max_pixels is not None and width * height > max_pixels:
        quality = Hint("quality", Word(settings.quality))
        remark = Sentence(
            "the film cannot be reduced as far as ",
            quality,
            f" asks: {width}x{height} pixels are rendered",
        )
        remarks.append(remark)
    return remarks


def _remainder_text(remainder: tuple[int, int]) -> str:
    """Return `3 columns of pixels at the right and 1 row at the bottom are`.

    remainder: their counts.
    """
    columns, rows = remainder
    parts = [f"{columns} column{'s' * (columns > 1)} of pixels at the right"] * bool(columns)
    parts += [f"{rows} row{'s' * (rows > 1)} at the bottom"] * bool(rows)
    return f"{' and '.join(parts)} {'is' if columns + rows == 1 else 'are'}"


def remarks_of_pictures() -> list[str]:
    """Return a remark if the better denoiser is not installed."""
    return [] if oidn_is_installed() else [MISSING_REMARK]


def remarks_of_memory(scene: Scene, spp: int | None) -> list[str]:
    """Return a remark if the basis of `scene` takes much memory.

    spp: samples per pixel; None for the scene's own.
    """
    most = render.memory_needed(scene, in_bands=render.renders_in_bands(scene))
    if most <= MUCH_MEMORY:
        return []
    expected = render.memory_expected(scene, scene.spp if spp is None else spp)
    text = f"at most {most / 1e9:.1f} GB of memory"
    if expected < most:
        text = f"about {expected / 1e9:.1f} GB of memory, {text.removesuffix(' of memory')}"
    return [f"{len(scene.lights)} lights of {scene.size[1]}x{scene.size[0]} pixels: {text}"]


def remarks_of_target(
    target: Target,
    size: Size,
    scene: Scene | None,
    fit: Settings,
    *,
    film: Size | None = None,
) -> list[str]:
    """Return remarks on how `target` was read.

    size: of the basis. fit: the resolved settings. film: size of the whole film, if the scene is
    rendered.
    """
    remarks = []
    if scene is not None and target.content not in ("", scene.content):
        remarks.append("the scene has changed since its template was made")
    (height, width), (mine_h, mine_w) = size, target.size
    is_asked_for = fit.resize or fit.resolution or fit.quality
    if size != target.size and not is_asked_for:
        remainder = left_over(target.size, whole_factor(target.size, size) or 1)
        remark = f"{mine_w}x{mine_h} pixels averaged to the basis's {width}x{height}"
        if any(remainder):
            remark += f": {_remainder_text((remainder[1], remainder[0]))} left over and ignored"
        remarks.append(remark)
    if film not in (None, size) and not is_asked_for:
        remarks.append(f"solved at {width}x{height} pixels, the size of its template")
    name = "srgb" if target.transform is None else target.transform.name
    if fit.space == "linear" and name not in ("srgb", "linear"):
        remark = Sentence(
            f"painted through {name}, whose highlights stand for very much light and dominate the "
            "fit: ",
            Hint("space", Word("display")),
            " fits what the eye sees",
        )
        remarks.append(remark)
    remarks += target.notes
    if target.not_finite:
        remarks.append(f"{target.not_finite} pixels hold NaN or Inf and are ignored")
    return [Sentence(f"{target.name}: ", remark) for remark in remarks]
