"""Scenes of a job that is solved with the spectra of lamps' emitters."""

from collections.abc import Sequence

from lightpaint.basis.render.integrators import check_renders_spectra
from lightpaint.basis.render.render_origin import basis_lights
from lightpaint.errors import LightpaintError
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.unknowns.reduction import lamps_by_name
from lightpaint.pipeline.job.settings import Settings
from lightpaint.scene.scene import Scene
from lightpaint.sentences import Hint


def spectral_scenes(scenes: Sequence[Scene], constraints: Constraints) -> list[Scene]:
    """Return scenes with a light for each emitter of their lamps.

    Raises SceneError if a light that is adjusted has no emitters with spectra, or the scene cannot
    be rendered with them.
    """
    found = []
    for scene in scenes:
        if not scene.is_spectral:
            check_renders_spectra(scene)
            scene = scene.with_lamps(lamps_by_name(constraints, basis_lights(scene)))
        found.append(scene)
    return found


def check_spectral(settings: Settings, constraints: Constraints, *others: object) -> None:
    """Raise LightpaintError for what does not go with spectra. others: what moves or adds lights;
    false if there is nothing.
    """
    if not settings.spectral:
        return
    unusable = [name for name in ("suggest", "refine", "animate") if getattr(settings, name)]
    if settings.sun:
        unusable.append("sun")
    if unusable:
        raise LightpaintError(
            Hint("spectral", True), " does not go with ", Hint(unusable[0]), ": leave one out"
        )
    if constraints.start:
        raise LightpaintError(
            Hint("spectral", True), " starts from the scene as it is: leave ", Hint("start"), " out"
        )
    if any(others):
        raise LightpaintError(
            Hint("spectral", True),
            " keeps all lights in place: solve with ",
            Hint("move_lights", False),
        )
