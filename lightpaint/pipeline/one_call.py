"""The one call that does everything: it makes a job from its arguments and runs it."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, overload

from lightpaint.basis import Basis, LightGroups
from lightpaint.basis.cache import check_same_view
from lightpaint.colour import TransformChoice
from lightpaint.errors import LightpaintError, SceneError, TargetError
from lightpaint.keywords import keywords
from lightpaint.lighting import Constraints
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.solve_job import Job
from lightpaint.pipeline.job.sources import BasisFile, Painting, SceneFile, check_needed
from lightpaint.pipeline.job_run import run
from lightpaint.pipeline.look import Look
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
        scene = _on_films_of(bases, _as_list(scene))
        # These scenes have the films of their bases already.
        basis, settings = None, settings | {"resolution": "1/1"}
    checked = Settings(**settings)
    read = {"mask": mask and str(mask), "layer": layer, "find": find}
    scenes = _Inputs(scene, SceneFile, {k: v for k, v in options.items() if v not in (None, {})})
    targets = _Inputs(
        target, Painting, {**read, "transform": TransformChoice.of(checked.transform)}
    )
    _check_scenes(scenes, basis)
    unused = [name for name, value in read.items() if value not in (None, True)]
    targets.check_used(unused, TargetError, "a target that is already read")
    source: Any = BasisFile(str(basis)) if isinstance(basis, str | Path) else basis
    job = Job(
        scenes.contents,
        targets.contents,
        Path(folder),
        source,
        Constraints() if constraints is None else constraints,
        checked,
        by_sensor=isinstance(scene, list | tuple),
        rigging=rigging or Rigging(),
    )
    looks = run(job, progress, bases=bases)
    return looks if job.by_sensor else looks[0]


@dataclass(frozen=True)
class _Inputs:
    """Scenes or targets of a call: none, one or several, of which a path becomes a `file` that is
    read with `options`.
    """

    given: Any
    file: type[SceneFile] | type[Painting]
    options: Mapping[str, Any]

    @cached_property
    def contents(self) -> tuple[Any, ...]:
        """The scenes or targets of a job."""
        return tuple(
            self.file(str(x), **self.options) if isinstance(x, str | Path) else x
            for x in _as_list(self.given)
        )

    def check_used(
        self, options: Iterable[str], error: type[LightpaintError], content: str
    ) -> None:
        """Raise `error` for options, by name, if nothing is read with them but `content`."""
        names = [Hint(name) for name in options]
        if names and not any(isinstance(x, self.file) for x in self.contents):
            raise error(Sentence.joined(names), f" cannot change {content}: give its path")


def _check_scenes(scenes: _Inputs, basis: object) -> None:
    """Raise SceneError for other things than scenes, and for options that read none."""
    for each in scenes.contents:
        if not isinstance(each, Scene | SceneFile):
            raise SceneError(
                f"the scene is of type {type(each).__name__}: expected the path of Mitsuba XML, a "
                "loaded Scene, or None with a basis"
            )
    if not scenes.contents:
        check_needed(scenes.options, basis)
    scenes.check_used(scenes.options, SceneError, "a scene that is already loaded")


def _as_list(value: Any) -> list[Any]:
    """Return none, one or several things as a list."""
    if value is None:
        return []
    return list(value) if isinstance(value, list | tuple) else [value]


def _on_films_of(bases: Sequence[Basis], scenes: Sequence[Any]) -> list[Scene]:
    """Return scenes with the sensors and films of their bases."""
    if len(scenes) != len(bases):
        raise SceneError(f"{len(scenes)} scenes for {len(bases)} bases: give one for each")
    return [_with_film_of(*pair) for pair in zip(scenes, bases, strict=True)]


def _with_film_of(scene: Any, basis: Basis) -> Scene:
    """Return `scene` with the sensor and the film of `basis`."""
    if not isinstance(scene, Scene):
        raise SceneError("a list of bases needs scenes that are loaded: use load_scene")
    check_same_view(scene, basis)
    return scene.reduced(f"{basis.size[1]}x{basis.size[0]}")
