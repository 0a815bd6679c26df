"""Scenes of a job that is solved with the spectra of lamps' emitters."""

from pathlib import Path

from lightpaint.basis.render.integrators import check_renders_spectra
from lightpaint.basis.render.render_origin import basis_lights
from lightpaint.colour import EYE, Observer, read_observer
from lightpaint.errors import LightpaintError, SceneError
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.unknowns.lamp_parts import WholeLamps
from lightpaint.lighting.unknowns.reduction import lamps_by_name
from lightpaint.pipeline.job.settings import Settings
from lightpaint.scene.lights.lamp_lights import part_name
from lightpaint.scene.scene import Scene
from lightpaint.sentences import Hint


def observer_of(path: str | None) -> Observer:
    """Return the camera of a table, or the eye without one. Raises ColorError."""
    return EYE if path is None else read_observer(Path(path))


def spectral_scene(scene: Scene, constraints: Constraints, observer: Observer = EYE) -> Scene:
    """Return a scene with a light for each emitter of its lamps, as the observer sees it.

    One that has them already, which looks of a batch share, has to have those of `constraints`.
    Raises SceneError if a light that is adjusted has no emitters with spectra, or the scene cannot
    be rendered with them.
    """
    if scene.is_spectral:
        _check_same_emitters(scene, constraints)
        return scene
    check_renders_spectra(scene)
    return scene.with_lamps(lamps_by_name(constraints, basis_lights(scene)), observer)


def _check_same_emitters(scene: Scene, constraints: Constraints) -> None:
    """Raise SceneError if constraints give lamps other spectra than those of a spectral scene."""
    lights = WholeLamps.of(basis_lights(scene)).lights
    lamps = lamps_by_name(constraints, lights)
    expected = {
        part_name(name, x.name): x.spectrum for name, lamp in lamps.items() for x in lamp.emitters
    }
    rendered = {x.name: x.spectrum for x in scene.lights if not x.is_fixed}
    if changed := sorted(k for k in rendered if rendered[k] != expected.get(k)):
        raise SceneError(
            f"the emitters of a lamp, like {changed[0]!r}, are those of the lights file, which "
            "looks with spectra share: give them there, and not for one look"
        )


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
