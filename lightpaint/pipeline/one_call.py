"""The one call that does everything: it makes a job from its arguments and runs it."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, overload

from lightpaint.basis import Basis, LightGroups
from lightpaint.basis.cache import check_same_view
from lightpaint.colour import TransformChoice
from lightpaint.errors import SceneError, TargetError
from lightpaint.keywords import keywords
from lightpaint.lighting import Constraints
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.solve_job import Job
from lightpaint.pipeline.job.sources import BasisFile, Painting, SceneFile, check_needed
from lightpaint.pipeline.job_run import run
from lightpaint.pipeline.results.look import Look
from lightpaint.placement import Rigging
from lightpaint.progress import Progress, silent
from lightpaint.scene import Scene
from lightpaint.sentences import Hint, Sentence
from lightpaint.target import Target

AnyScene = str | Path | Scene
AnyTarget = str | Path | Target


@overload
def paint_with_light(
    scene: AnyScene | None, target: AnyTarget, folder: str | Path, **options: Any
) -> Look: ...


@overload
def paint_with_light(
    scene: Sequence[AnyScene], target: Sequence[AnyTarget], folder: str | Path, **options: Any
) -> list[Look]: ...


@keywords(Settings)
def paint_with_light(
    scene: AnyScene | Sequence[AnyScene] | None,
    target: AnyTarget | Sequence[AnyTarget],
    folder: str | Path,
    *,
    basis: str | Path | Basis | LightGroups | list[Basis] | None = None,
    constraints: Constraints | None = None,
    rigging: Rigging | None = None,
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
    """Find the lighting of `scene` that comes closest to a painting, and verify it.

    Args:
        scene: Mitsuba XML, or None to solve from `basis` alone. For several views a list: the same
            scene, loaded once for each sensor.
        target: Painting, a file or what `read_target` returned; for several views a list.
        folder: Receives the results; with several views, each sensor has a folder of its own in it.
        basis: An existing basis, or another renderer's light groups; taken from the cache or
            rendered if not given. For several views a list, which is emptied to save memory.
        constraints: Constraints on the lights; they override the constraints of the scene's lights
            file.
        rigging: Lights that may move, and lights to add; it overrides the rigging of the scene's
            lights file.
        mask: Picture of the importance of pixels, if `target` is a path. The next two are also
            as in `read_target`.
        layer: Layer of an EXR.
        find: Whether to look for a template beside the painting.
        sensor: Index or id, if `scene` is a path. The next four are also those of `load_scene`.
        parameters: Values of `$name` parameters.
        lights: Names or patterns of the lights to adjust.
        groups: Emitters that form one light, by its name.
        integrator: Integrator to use instead of the scene's own, like `path`.
        progress: Receives progress and, if it is a `Listener`, remarks.
        **settings: Any field of `Settings`, like spp=64.

    Returns:
        The look; for a list of views, a list of looks.

    Raises:
        LightpaintError: For invalid arguments, before anything is rendered.

    Examples:
        >>> look = lp.paint_with_light("room.xml", "painting.exr", "evening", spp=4)
        >>> look
        Look(of painting: Close: it looks as painted. Mean ΔE ...)
        >>> look.verification.agrees
        True
    """
    options = {
        "sensor": sensor,
        "parameters": {key: str(value) for key, value in (parameters or {}).items()},
        "lights": None if lights is None else tuple(lights),
        "groups": {name: tuple(members) for name, members in (groups or {}).items()},
        "integrator": integrator,
    }
    bases = basis if isinstance(basis, list) else None
    if bases is not None:
        scenes = _as_list(scene)
        if len(scenes) != len(bases):
            raise SceneError(f"{len(scenes)} scenes for {len(bases)} bases: give one for each")
        scene = [_with_film_of(*pair) for pair in zip(scenes, bases, strict=True)]
        # These scenes have the films of their bases already.
        basis, settings = None, settings | {"resolution": "1/1"}
    read = {"mask": mask and str(mask), "layer": layer, "find": find}
    requests = Constraints() if constraints is None else constraints, rigging or Rigging()
    job = _job(
        (scene, options), (target, read), Path(folder), basis, requests, Settings(**settings)
    )
    looks = run(job, progress, bases=bases)
    return looks if job.by_sensor else looks[0]


def _job(
    scene: tuple[Any, Mapping[str, Any]],
    target: tuple[Any, Mapping[str, Any]],
    folder: Path,
    basis: Any,
    requests: tuple[Constraints, Rigging],
    settings: Settings,
) -> Job:
    """Return the job that the arguments of `paint_with_light` describe.

    scene, target: sources, with the options for reading them.
    """
    constraints, rigging = requests
    (scenes, scene_options), (targets, target_options) = scene, target
    scene_options = {
        name: value for name, value in scene_options.items() if value not in (None, {})
    }
    by_sensor = isinstance(scenes, list | tuple)
    painting_options = {**target_options, "transform": TransformChoice.of(settings.transform)}
    unused_options = [name for name, value in target_options.items() if value not in (None, True)]
    scenes = [SceneFile(str(x), **scene_options) if _is_path(x) else x for x in _as_list(scenes)]
    targets = [
        Painting(str(x), **painting_options) if _is_path(x) else x for x in _as_list(targets)
    ]
    for each in scenes:
        if not isinstance(each, Scene | SceneFile):
            raise SceneError(
                f"the scene is of type {type(each).__name__}: expected the path of Mitsuba XML, a "
                "loaded Scene, or None with a basis"
            )
    if scene_options and not scenes:
        check_needed(scene_options, basis)
    if scene_options and not any(isinstance(x, SceneFile) for x in scenes):
        names = Sentence.joined(map(Hint, scene_options))
        raise SceneError(names, " cannot change a scene that is already loaded: give its path")
    if unused_options and not any(isinstance(x, Painting) for x in targets):
        names = Sentence.joined(map(Hint, unused_options))
        raise TargetError(names, " cannot change a target that is already read: give its path")
    basis = BasisFile(str(basis)) if _is_path(basis) else basis
    options: dict[str, Any] = {"by_sensor": by_sensor, "rigging": rigging}
    return Job(tuple(scenes), tuple(targets), folder, basis, constraints, settings, **options)


def _as_list(value: Any) -> list[Any]:
    """Return none, one or several things as a list."""
    if value is None:
        return []
    return list(value) if isinstance(value, list | tuple) else [value]


def _is_path(value: Any) -> bool:
    return isinstance(value, str | Path)


def _with_film_of(scene: Any, basis: Basis) -> Scene:
    """Return `scene` with the sensor and the film of `basis`."""
    if not isinstance(scene, Scene):
        raise SceneError("a list of bases needs scenes that are loaded: use load_scene")
    check_same_view(scene, basis)
    return scene.reduced(f"{basis.size[1]}x{basis.size[0]}")
