"""Suggested lights: the search for new points anywhere, as lights to paste into the scene."""

from collections.abc import Sequence

from lightpaint.arrays import RGB, Position, as_rgb
from lightpaint.basis.basis import Basis
from lightpaint.basis.render.integrators import why_not_one_pass
from lightpaint.errors import NoPlaceError, SceneError
from lightpaint.keywords import keywords
from lightpaint.lighting.solution import Solution
from lightpaint.placement.free_space import as_position
from lightpaint.placement.new_lights import NewLights
from lightpaint.placement.place import place
from lightpaint.placement.placement import Placement
from lightpaint.placement.suggestion import Suggestion
from lightpaint.progress import Progress, silent
from lightpaint.scene.checks.tokens import tag
from lightpaint.scene.lights.light import free_names
from lightpaint.scene.scene import Scene

#: The default number of suggestions.
SUGGESTED = 3

#: Names of suggested lights begin like this.
NAME = "suggested"

#: RMS error below which the current lights reproduce the painting.
NOTHING_MISSED = 0.01


@keywords()
def suggest_lights(
    scenes: Scene | Sequence[Scene],
    bases: Basis | Sequence[Basis],
    solution: Solution,
    *,
    count: int = SUGGESTED,
    seed: int = 0,
    progress: Progress = silent,
) -> tuple[Suggestion, ...]:
    """Suggest point lights that would bring `solution` closest to its painting, the best first.

    This is `lp.place` with new points in all free space, while the lights of the scene stay.

    Args:
        scenes: The scene of `bases`, on the same film or a larger one; through the sensor of each
            view if there are several, which all count.
        bases: The basis of each view of the solution.
        solution: The solution to improve. Pictures of suggestions show its first view.
        count: Maximum number of suggestions; none if no light reliably removes 1 % of the error.
        seed: Of the paths and the trial places.
        progress: Receives progress.

    Raises:
        SceneError: For scenes with fog or another medium, or with an integrator or a variant whose
            paths cannot be traced.

    Examples:
        >>> lp.suggest_lights(lp.load_scene("room.xml"), basis, lp.solve(basis, target))
        ()
    """
    if count < 1:
        raise SceneError(f"{count} lights cannot be suggested: ask for one or more")
    scene = scenes if isinstance(scenes, Scene) else scenes[0]
    check_suggestible(scene)
    norm2 = float(solution.norm2.sum())
    if sum(solution.certificate.objective) <= NOTHING_MISSED**2 * norm2:
        return ()
    new = NewLights("point", count=count, name=NAME)
    try:
        placement = place(scenes, bases, solution, new=[new], seed=seed, progress=progress)
    except NoPlaceError:
        return ()
    names = free_names(NAME, len(placement.additions), [x.name for x in scene.emitters])
    # Gains refer to all that is missed, noise and what small films do not show included. Energies
    # are of the last linear problem, since the loss of a display fit has another scale.
    norm2 = float(solution.equations.target_norm2.sum())
    scale = placement.missed_before * norm2 / solution.energy
    return _suggestions(placement, names, scale)


def check_suggestible(scene: Scene) -> None:
    """Raise SceneError, before rendering, for a scene in which no lights can be suggested."""
    if reason := why_not_one_pass(scene):
        raise SceneError(
            f"suggesting lights needs paths of the integrator path, and {reason}: leave it out, or "
            "use that integrator and a variant like llvm_ad_rgb"
        )
    if scene.has_media:
        raise SceneError(f"{scene.path} has fog or the like: no lights can be suggested in it")


def _suggestions(
    placement: Placement, names: Sequence[str], scale: float
) -> tuple[Suggestion, ...]:
    """Return the new lights of a placement, renamed in the order of their gains.

    scale: the part of the error that the search saw, by which its shares are multiplied.
    """
    suggestions = []
    for name, light in zip(names, placement.additions, strict=True):
        emission = as_rgb(f"{v:.4g}" for v in light.emitter.emission)
        position = as_position(f"{v:.6g}" for v in light.site.position or ())
        assert light.without is not None
        assert light.with_it is not None
        suggestions.append(
            Suggestion(
                name=name,
                position=position,
                emission=emission,
                gain_share=scale * light.gain_share,
                missed_share=1 - scale * (1 - light.missed_share / placement.missed_before),
                xml=emitter_xml(name, position, emission),
                seen_at=light.seen_at,
                without=light.without,
                with_it=light.with_it,
            )
        )
    return tuple(suggestions)


def emitter_xml(name: str, position: Position, intensity: RGB) -> str:
    """Return a point light as an element for <scene>."""
    x, y, z = (f"{v:g}" for v in position)
    lines = [
        tag("point", name="position", x=x, y=y, z=z),
        tag("rgb", name="intensity", value=" ".join(f"{v:g}" for v in intensity)),
    ]
    inner = "".join(f"    {line}\n" for line in lines)
    return f'<emitter type="point" id="{name}">\n{inner}</emitter>'
