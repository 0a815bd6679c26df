"""All in one call: from arguments to a job, and its run."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, overload

from lightpaint.basis.basis import Basis
from lightpaint.basis.lightgroups.read import LightGroups
from lightpaint.basis.render.obtain import check_same_view
from lightpaint.colour.display.view_transform import TransformChoice
from lightpaint.errors import SceneError, TargetError
from lightpaint.keywords import keywords
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.pipeline.job import Job
from lightpaint.pipeline.pipeline import run
from lightpaint.pipeline.results import Look
from lightpaint.pipeline.settings import Settings
from lightpaint.pipeline.sources import BasisFile, Painting, SceneFile, check_needed
from lightpaint.progress import Progress, silent
from lightpaint.scene.scene import Scene
from lightpaint.target.target import Target

AnyScene = str | Path | Scene
AnyTarget = str | Path | Target


@overload
def paint_with_light(
    scene: AnyScene | None, target: AnyTarget, folder: str | Path, **how: Any
) -> Look: ...


@overload
def paint_with_light(
    scene: Sequence[AnyScene], target: Sequence[AnyTarget], folder: str | Path, **how: Any
) -> list[Look]: ...


@keywords(Settings)
def paint_with_light(
    scene: AnyScene | Sequence[AnyScene] | None,
    target: AnyTarget | Sequence[AnyTarget],
    folder: str | Path,
    *,
    basis: str | Path | Basis | LightGroups | list[Basis] | None = None,
    constraints: Constraints | None = None,
    mask: str | Path | None = None,
    layer: str | None = None,
    find: bool = True,
    sensor: int | str | None = None,
    parameters: Mapping[str, object] | None = None,
    lights: Iterable[str] | None = None,
    groups: Mapping[str, Iterable[str]] | None = None,
    integrator: str | None = None,
    progress: Progress = silent,
    **settings: Any,
) -> Look | list[Look]:
    """Find the lighting of `scene` that comes closest to a painting, and prove it.

    Args:
        scene: Mitsuba XML, or None to solve from `basis` alone. For several views a list: the same
            scene, loaded through another sensor each.
        target: Painting, as a file or read; for several views a list.
        folder: Receives the results; of several views, the pictures in a folder for each sensor.
        basis: One made before, or another renderer's light groups; kept or rendered if not given.
            For several views a list, which is emptied, so that no pixel is held twice.
        constraints: What is asked of the lights; it goes before what the scene's lights file asks.
        mask: As of `read_target`, as are the next two: picture of what counts, where `target` is a
            path.
        layer: Of an EXR.
        find: Whether a template is looked for beside the painting.
        sensor: As of `load_scene`, as are the next four: index or id, where `scene` is a path.
        parameters: Values of `$name` parameters.
        lights: Names or patterns of those to adjust.
        groups: Emitters that are one light, by its name.
        integrator: To render with instead of the scene's own, like `path`.
        progress: Hears how far the work has come and, if it is a `Listener`, remarks.
        **settings: Any of `Settings`, by name, like spp=64.

    Returns:
        The look; of a list, a list.

    Raises:
        LightpaintError: For what cannot be, before anything is rendered.

    Examples:
        >>> look = lp.paint_with_light("room.xml", "painting.exr", "evening", spp=4)
        >>> look
        Look(of painting: Close: it looks as painted. Mean ΔE ...)
        >>> look.verification.agrees
        True
    """
    how = {
        "sensor": sensor,
        "parameters": {key: str(value) for key, value in (parameters or {}).items()},
        "lights": None if lights is None else tuple(lights),
        "groups": {name: tuple(members) for name, members in (groups or {}).items()},
        "integrator": integrator,
    }
    bases = basis if isinstance(basis, list) else None
    if bases is not None:
        scene = [_on_film_of(x, its) for x, its in zip(_listed(scene), bases, strict=True)]
        # They are on the films of their bases already.
        basis, settings = None, settings | {"resolution": "1/1"}
    read = {"mask": mask and str(mask), "layer": layer, "find": find}
    job = _job((scene, how), (target, read), Path(folder), basis, constraints, Settings(**settings))
    looks = run(job, progress, bases=bases)
    return looks if job.by_sensor else looks[0]


def _job(
    scene: tuple[Any, Mapping[str, Any]],
    target: tuple[Any, Mapping[str, Any]],
    folder: Path,
    basis: Any,
    constraints: Constraints | None,
    settings: Settings,
) -> Job:
    """What the arguments of `paint_with_light` ask for. scene, target: and how to read them."""
    (scenes, how), (targets, read) = scene, target
    how = {name: value for name, value in how.items() if value not in (None, {})}
    by_sensor = isinstance(scenes, list | tuple)
    painted = {**read, "transform": TransformChoice.of(settings.transform)}
    changed = [name for name, value in read.items() if value not in (None, True)]
    scenes = [SceneFile(str(x), **how) if _is_path(x) else x for x in _listed(scenes)]
    targets = [Painting(str(x), **painted) if _is_path(x) else x for x in _listed(targets)]
    if how and not scenes:
        check_needed(how, basis)
    if how and not any(isinstance(x, SceneFile) for x in scenes):
        named = ", ".join(f"{name}=..." for name in how)
        raise SceneError(f"{named} cannot change a scene that is already loaded: give its path")
    if changed and not any(isinstance(x, Painting) for x in targets):
        named = ", ".join(f"{name}=..." for name in changed)
        raise TargetError(f"{named} cannot change a target that is already read: give its path")
    basis = BasisFile(str(basis)) if _is_path(basis) else basis
    asked = Constraints() if constraints is None else constraints
    return Job(tuple(scenes), tuple(targets), folder, basis, asked, settings, by_sensor)


def _listed(given: Any) -> list[Any]:
    """One or several or none, as several."""
    if given is None:
        return []
    return list(given) if isinstance(given, list | tuple) else [given]


def _is_path(given: Any) -> bool:
    return isinstance(given, str | Path)


def _on_film_of(scene: Any, basis: Basis) -> Scene:
    """`scene`, through the sensor and on the film that `basis` was made with."""
    if not isinstance(scene, Scene):
        raise SceneError("bases of several views go with scenes that are loaded: use load_scene")
    check_same_view(scene, basis)
    return scene.reduced(f"{basis.size[1]}x{basis.size[0]}")
