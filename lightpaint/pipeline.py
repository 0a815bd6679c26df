"""The corridor: obtain bases → solve → improve → analyse → relight → predict, verify, report."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, overload

from lightpaint.basis import cache
from lightpaint.basis.basis import Basis
from lightpaint.basis.lightgroups.read import LightGroups
from lightpaint.basis.render.obtain import check_same_view, obtain_basis
from lightpaint.colour.transform import TransformChoice
from lightpaint.errors import SceneError, TargetError
from lightpaint.files import restoring
from lightpaint.images.estimate import write_estimate
from lightpaint.job import Job, PaintedView, check_needed
from lightpaint.lighting.analysis.analyse import Analysis, analyse, with_bounds
from lightpaint.lighting.analysis.uncertainty import correct_noise
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.lighting import combine, write_lighting
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solve import solution_of
from lightpaint.placement.suggest import suggest_lights
from lightpaint.progress import Listener, Progress, labelled, listener, silent
from lightpaint.relit.export.exports import write_exports
from lightpaint.relit.relight import relight
from lightpaint.relit.rounds import refine_by_rendering
from lightpaint.relit.verify import verify
from lightpaint.results import Look, write_predicted, write_report
from lightpaint.scene.quality import samples
from lightpaint.scene.scene import Scene, load_scene
from lightpaint.settings import Settings
from lightpaint.sources import BasisFile, Painting, SceneFile
from lightpaint.target.target import Target

#: Samples per pixel of a verification that has a large film for a small basis, at least.
FEWEST = 4

AnyScene = str | Path | Scene
AnyTarget = str | Path | Target


def run(job: Job, progress: Progress = silent, *, bases: list[Basis] | None = None) -> list[Look]:
    """Do `job`: find its lighting, prove it, and write results to its folder.

    Args:
        job: What is asked.
        progress: Hears how far the work has come and, if it is a `Listener`, remarks.
        bases: Of the views on their films, where an earlier run has obtained them; the list is
            emptied, so that no pixel is held twice.

    Returns:
        A look for each view.

    Examples:
        >>> from pathlib import Path
        >>> job = lp.Job((), (lp.Painting("painting.exr"),), Path("evening"), basis)
        >>> [look] = lp.run(job)
        >>> np.round(look.lighting.emission["panel"], 3).tolist()
        [2.0, 1.5, 1.0]
    """
    listen, settings = listener(progress), job.settings
    for remark in job.remarks:
        listen.say(remark)
    problem = Problem.of(
        _obtained(job, bases, listen),
        [view.target for view in job.views],
        constraints=job.asked,
        unpainted=settings.unpainted,
        method=settings.method,
        transform=job.display,
    )
    solution = _improved(job, solution_of(problem), listen)
    analyses = analyse(solution)
    with restoring(job.folder, job.files):
        lighting = with_bounds(solution, analyses).lighting
        write_lighting(job.folder / "lighting.json", lighting)
        if job.groups is not None:
            write_exports(job.folder, job.groups, lighting)
        relit = None
        if (scene := job.views[0].scene) is not None:
            relit = relight(scene, lighting, job.folder / "relit.xml")
        return [
            _finished(job, view, analysis, relit, _hearing(job, view, listen))
            for view, analysis in zip(job.views, analyses, strict=True)
        ]


@overload
def paint_with_light(
    scene: AnyScene | None, target: AnyTarget, folder: str | Path, **how: Any
) -> Look: ...


@overload
def paint_with_light(
    scene: Sequence[AnyScene], target: Sequence[AnyTarget], folder: str | Path, **how: Any
) -> list[Look]: ...


def paint_with_light(
    scene: AnyScene | Sequence[AnyScene] | None,
    target: AnyTarget | Sequence[AnyTarget],
    folder: str | Path,
    *,
    basis: str | Path | Basis | LightGroups | list[Basis] | None = None,
    constraints: Constraints | None = None,
    mask: str | Path | None = None,
    sensor: int | str | None = None,
    parameters: Mapping[str, object] | None = None,
    lights: Iterable[str] | None = None,
    groups: Mapping[str, Iterable[str]] | None = None,
    progress: Progress = silent,
    **settings: Any,
) -> Look | list[Look]:
    """Find the lighting of `scene` that comes closest to a painting, and prove it.

    Args:
        scene: Mitsuba XML, or None to solve from `basis` alone, without a renderer. For several
            views a list: the same scene, loaded through another sensor each; `target` is then a
            list of what each is to show, and a list comes back.
        target: Painting, as a file or read; for several views a list.
        folder: Receives lighting.json, predicted.exr, comparison.png and report.html and, with a
            scene, relit.xml and verified.exr; of a list, the pictures lie in a folder for each
            sensor.
        basis: One made before of the same scene; taken from the cache or rendered if not given. Of
            light groups that another renderer made, `folder` receives the answer for other
            programs, too. For several views a list, which is emptied, so that no pixel is held
            twice.
        constraints: What is asked of the lights; it goes before what the scene's lights file asks.
        mask: As `read_target` takes it, where `target` is a path.
        sensor: Index or id, where `scene` is a path.
        parameters: Values of `$name` parameters, where `scene` is a path.
        lights: Names or patterns of those to adjust, where `scene` is a path.
        groups: Emitters that are one light, by its name, where `scene` is a path.
        progress: Hears how far the work has come and, if it is a `Listener`, remarks.
        **settings: Any of `Settings`, by name, like spp=64.

    Returns:
        The look; of a list of views, a list.

    Raises:
        LightpaintError: For what cannot be; all that a user gives is checked before anything is
            rendered.

    Examples:
        >>> look = lp.paint_with_light("room.xml", "painting.exr", "evening", spp=4)
        >>> look
        Look(of painting: The lighting meets ... % of the painting ...)
        >>> look.verification.agrees
        True
    """
    how = {
        "sensor": sensor,
        "parameters": {key: str(value) for key, value in (parameters or {}).items()},
        "lights": None if lights is None else tuple(lights),
        "groups": {name: tuple(members) for name, members in (groups or {}).items()},
    }
    bases = basis if isinstance(basis, list) else None
    if bases is not None:
        scene = [_on_film_of(x, its) for x, its in zip(_listed(scene), bases, strict=True)]
        # They are on the films of their bases already.
        basis, settings = None, settings | {"resolution": "1/1"}
    job = _job(
        (scene, {key: value for key, value in how.items() if value not in (None, {})}),
        (target, mask),
        Path(folder),
        basis,
        Constraints() if constraints is None else constraints,
        Settings(**settings),
    )
    looks = run(job, progress, bases=bases)
    return looks if job.by_sensor else looks[0]


def _job(
    scene: tuple[Any, Mapping[str, Any]],
    target: tuple[Any, str | Path | None],
    folder: Path,
    basis: Any,
    constraints: Constraints,
    settings: Settings,
) -> Job:
    """What the arguments of `paint_with_light` ask for. scene, target: and how to read them."""
    (scenes, how), (targets, mask) = scene, target
    by_sensor = isinstance(scenes, list | tuple)
    painted: dict[str, Any] = {
        "mask": mask and str(mask),
        "transform": TransformChoice.of(settings.transform),
    }
    scenes = [SceneFile(str(x), **how) if _is_path(x) else x for x in _listed(scenes)]
    targets = [Painting(str(x), **painted) if _is_path(x) else x for x in _listed(targets)]
    if how and not scenes:
        check_needed(how, basis)
    if how and not any(isinstance(x, SceneFile) for x in scenes):
        named = ", ".join(f"{name}=..." for name in how)
        raise SceneError(f"{named} cannot change a scene that is already loaded: give its path")
    if mask is not None and not any(isinstance(x, Painting) for x in targets):
        raise TargetError("mask=... cannot change a target that is already read: give its path")
    basis = BasisFile(str(basis)) if _is_path(basis) else basis
    return Job(tuple(scenes), tuple(targets), folder, basis, constraints, settings, by_sensor)


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


def obtain(scene: Scene, settings: Settings, progress: Progress, *, views: int = 1) -> Basis:
    """The basis of `scene` on its film, kept or rendered. views: that share the time there is."""
    listen = listener(progress)
    is_rendered = False

    def report(label: str, done: int, total: int, unit: str = "passes") -> None:
        nonlocal is_rendered
        is_rendered = True
        listen(label, done, total, unit)

    basis = obtain_basis(
        scene,
        spp=samples(settings.quality, spp=settings.spp, time_s=settings.time_s),
        time_s=None if settings.time_s is None else settings.time_s / views,
        seed=settings.seed,
        use_cache=settings.use_cache,
        progress=report,
    )
    if settings.use_cache and not cache.is_kept(basis):
        listen.say(
            f"the basis could not be kept in {cache.folder()}, so the next run renders it again: "
            "is the disk full, or the folder not yours?"
        )
    if not is_rendered:
        listen.say(
            f"basis of {basis.origin.spp} samples per pixel kept from an earlier run "
            "(use_cache=False renders it anew)"
        )
    return basis


def _obtained(job: Job, bases: list[Basis] | None, listen: Listener) -> list[Basis]:
    """The basis of each view: handed in, given with the job, kept, or rendered."""
    if bases is None:
        made = [_basis_of(job, view, listen) for view in job.views]
    else:
        made = list(bases)
        bases.clear()
    # What the scene's lights file asks by now, whenever they were made.
    return [
        basis if view.scene is None else basis.asking(view.scene.asked)
        for basis, view in zip(made, job.views, strict=True)
    ]


def _basis_of(job: Job, view: PaintedView, listen: Listener) -> Basis:
    if view.basis is not None:
        return view.basis
    assert view.scene is not None
    return obtain(view.scene, job.settings, _hearing(job, view, listen), views=len(job.views))


def _hearing(job: Job, view: PaintedView, listen: Listener) -> Listener:
    """`listen`, told of which view, where there are several."""
    return listen if len(job.views) == 1 else labelled(listen, view.folder.name)


def _improved(job: Job, solution: Solution, listen: Listener) -> Solution:
    """What can be done against noise is done."""
    settings = job.settings
    if settings.noise_correction:
        solution = correct_noise(solution)
    pairs = zip((view.scene for view in job.views), solution.problem.views.bases, strict=True)
    scenes = [(scene, basis) for scene, basis in pairs if scene is not None]
    solution = refine_by_rendering(
        scenes, solution, rounds=settings.refine, seed=settings.seed, progress=listen
    )
    lighting = replace(solution.lighting, cd_per_unit=settings.cd_per_unit)
    return replace(solution, lighting=lighting)


def _finished(
    job: Job, view: PaintedView, analysis: Analysis, relit: Scene | None, listen: Listener
) -> Look:
    """A view predicted, verified and shown in its folder."""
    settings, scene, solution = job.settings, view.scene, analysis.solution
    basis = solution.basis
    view.folder.mkdir(exist_ok=True)
    predicted = combine(basis, solution.lighting)
    spp = settings.spp or (basis.origin.spp if scene is None else scene.spp)
    verification, suggestions = None, None
    if relit is not None and scene is not None:
        if relit.sensor != scene.sensor:
            relit = load_scene(relit.path, sensor=scene.sensor, use_lights_file=False)
        if settings.checks_as_basis:
            pixels, checked = (size[0] * size[1] for size in (basis.size, relit.size))
            spp = max(FEWEST, basis.origin.spp * pixels // checked)
    write_predicted(view.folder / "predicted.exr", predicted, sensor=basis.origin.sensor, spp=spp)
    if relit is not None:
        verification = verify(predicted, relit, spp=spp, seed=settings.seed, progress=listen)
        write_estimate(view.folder / "verified.exr", verification.verified, {})
    if settings.suggest and scene is not None:
        suggestions = suggest_lights(
            scene, basis, solution, count=settings.suggest, seed=settings.seed, progress=listen
        )
    look = Look(
        target=view.target,
        basis=basis,
        solution=solution,
        predicted=predicted,
        relit=relit,
        verification=verification,
        analysis=analysis,
        suggestions=suggestions,
    )
    write_report(look, view.folder, command=settings.command)
    return look
