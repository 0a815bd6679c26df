"""Checks of a job's inputs that need no renderer: their number, their kinds, their sensors."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from lightpaint.basis import Basis, LightGroups, with_equal_lights
from lightpaint.errors import (
    BasisError,
    ConstraintError,
    LightpaintError,
    SceneError,
    TargetError,
)
from lightpaint.lighting import Constraints, check_same_lights
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import Painting, content
from lightpaint.placement import Rigging, check_rigging, rigged_lights, rigging_of
from lightpaint.scene import Scene
from lightpaint.scene.lights.texels import CHILDREN, DOMAINS, Sky, mirrored_pairs, node_name
from lightpaint.sentences import Hint, Sentence
from lightpaint.target import Target

#: Emitters that shine from all directions.
SKY_PLUGINS = [plugin for plugin, domain in DOMAINS.items() if isinstance(domain, Sky)]


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
