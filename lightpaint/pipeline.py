"""The corridor: load → basis → target → solve → relight → verify, in that order."""

import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from lightpaint.basis.basis import Basis
from lightpaint.basis.file import read_basis
from lightpaint.basis.lightgroups.read import LightGroups
from lightpaint.basis.render.obtain import check_same_view, obtain_basis
from lightpaint.basis.render.render import basis_lights, render_basis
from lightpaint.colour.display import choose_exposure
from lightpaint.colour.view import View
from lightpaint.errors import LightpaintError, SceneError, TargetError
from lightpaint.files import check_writable, restoring
from lightpaint.images.estimate import write_estimate
from lightpaint.images.png import write_png
from lightpaint.lighting.analysis.analyse import Analysis, analyse, with_bounds
from lightpaint.lighting.analysis.uncertainty import correct_noise
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.file import read_constraints
from lightpaint.lighting.constraints.reduction import reduce_to
from lightpaint.lighting.lighting import Lighting, combine, write_lighting
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solve import solution_of
from lightpaint.placement.suggest import Suggestion, check_suggestible, suggest_lights
from lightpaint.progress import Progress, labelled, silent
from lightpaint.relit.export.exports import EXPORTS, write_exports
from lightpaint.relit.relight import check_relightable, relight
from lightpaint.relit.rounds import refine_by_rendering
from lightpaint.relit.verify import verify
from lightpaint.results import (
    ALWAYS,
    RESULTS,
    VIEW_RESULTS,
    Look,
    earlier_results,
    show_look,
    write_predicted,
)
from lightpaint.scene.quality import Preset, on_film, samples
from lightpaint.scene.render import Stream, render
from lightpaint.scene.scene import Scene, load_scene
from lightpaint.scene.surfaces import render_surfaces
from lightpaint.settings import Settings
from lightpaint.target.read import read_target
from lightpaint.target.target import Target
from lightpaint.target.template import Template, write_look, write_template

#: Rendering of what each light does alone, to recognise it by.
THUMBNAIL = Preset(32, 2**14)

#: Samples per pixel of a verification that has a large film for a small basis, at least.
FEWEST = 4


def paint_with_light(
    scene: str | Path | Scene | None,
    target: str | Path | Target,
    folder: str | Path,
    *,
    basis: str | Path | Basis | LightGroups | None = None,
    mask: str | Path | None = None,
    sensor: int | str | None = None,
    parameters: Mapping[str, object] | None = None,
    lights: Iterable[str] | None = None,
    groups: Mapping[str, Iterable[str]] | None = None,
    progress: Progress = silent,
    **settings: Any,
) -> Look:
    """Find the lighting of `scene` that comes closest to a painting, and prove it.

    scene: Mitsuba XML, or None to solve from `basis` alone, without a renderer.
    folder: receives lighting.json, predicted.exr, comparison.png and report.html and, with
    a scene, relit.xml and verified.exr.
    basis: one made before of the same scene; taken from the cache or rendered if not given. Of
    light groups that another renderer made, `folder` receives the answer for other programs, too.
    sensor, parameters, lights, groups: as `load_scene` takes them, where `scene` is a path.
    settings: any of `Settings`, by name, like spp=64.

    Raises LightpaintError; all that a user gives is checked before anything is rendered.
    """
    asked = Settings(**settings)
    if asked.suggest and scene is None:
        raise LightpaintError(
            "suggesting lights renders them in the scene: give it, and not only its basis"
        )
    if asked.refine and scene is None:
        raise LightpaintError("refining renders the scene: give it, and not only its basis")
    if scene is None and basis is None:
        raise LightpaintError("give a scene, a basis, or both")
    if isinstance(scene, str | Path):
        scene = load_scene(
            scene, sensor=sensor, parameters=parameters, lights=lights, groups=groups
        )
    layers = basis if isinstance(basis, LightGroups) else None
    if isinstance(basis, LightGroups):
        basis = basis.basis
    if isinstance(basis, str | Path):
        basis = read_basis(Path(basis))
    if scene is not None and basis is not None:
        check_same_view(scene, basis)
    if not isinstance(target, Target):
        target = read_target(target, mask=mask, view=asked.view)
    view = PaintedView(scene, target, Path(folder), basis, layers)
    [look] = _paint([view], Path(folder), asked, progress)
    return look


def paint_views_with_light(
    scenes: Sequence[Scene],
    targets: Sequence[Target],
    folder: str | Path,
    *,
    bases: list[Basis] | None = None,
    progress: Progress = silent,
    **settings: Any,
) -> list[Look]:
    """Find the one lighting that comes closest to paintings of several views of a scene.

    scenes: the same scene, loaded through another sensor each; targets: what each is to show.
    folder: receives lighting.json and relit.xml, and for each sensor a folder of that name with
    predicted.exr, verified.exr, comparison.png and report.html.
    bases: of these views, if made before; the list is emptied, so that no pixel is held twice.
    settings: as of `paint_with_light`.
    """
    names = check_each_once(scenes)
    asked = Settings(**settings)
    if asked.suggest and len(scenes) > 1:
        raise LightpaintError("lights are suggested for one view only: leave out the others")
    made = [None] * len(scenes) if bases is None else list(bases)
    if bases is not None:
        bases.clear()
    views = [
        PaintedView(scene, target, Path(folder) / name, made.pop(0))
        for scene, target, name in zip(scenes, targets, names, strict=True)
    ]
    return _paint(views, Path(folder), asked, progress)


def check_each_once(scenes: Sequence[Scene]) -> list[str]:
    """The sensor of each. Raises SceneError for one that is there twice or names no folder."""
    names = [scene.sensor_names[scene.sensor] for scene in scenes]
    if len(set(names)) < len(names):
        raise SceneError(f"a view is painted twice: {', '.join(names)}; give each sensor once")
    for name in names:
        if Path(name).name != name or name in ("..", ""):
            raise SceneError(f"the sensor id {name!r} cannot name a folder: choose another id")
    return names


@dataclass(frozen=True)
class PaintedView:
    """What is seen through one sensor: its painting, and where its results go.

    scene: None where there is only a basis; basis: None where it is still to be rendered.
    groups: where the basis is of light groups from elsewhere.
    """

    scene: Scene | None
    target: Target
    folder: Path
    basis: Basis | None = None
    groups: LightGroups | None = None


def _paint(
    views: list[PaintedView], folder: Path, settings: Settings, progress: Progress
) -> list[Look]:
    """One lighting for all views, into `folder`; pictures into the folders of the views."""
    scene = views[0].scene
    constraints = all_constraints(scene, settings.constraints)
    if scene is not None:
        reduce_to(constraints, basis_lights(scene))  # names what cannot be had before it renders
        if settings.suggest:
            check_suggestible(scene)
    for place in (folder, *(view.folder for view in views)):
        check_writable(place)
    written = _to_be_written(views, folder)
    views[:] = _fitted(views, settings)
    reports = {view.folder: _progress_of(view, len(views), progress) for view in views}
    views[:] = [_with_basis(x, settings, len(views), reports[x.folder]) for x in views]
    problem = Problem.of(
        [_basis(view) for view in views],
        [view.target for view in views],
        constraints=constraints,
        unpainted=settings.unpainted,
        method=settings.method,
        view=_fitted_in(views, settings),
    )
    # In place: the caller's list is the last to hold the bases as they were.
    views[:] = [replace(v, basis=b) for v, b in zip(views, problem.views.bases, strict=True)]
    solution = _improved(solution_of(problem), views, settings, progress)
    analyses = analyse(solution)
    solution = with_bounds(solution, analyses)
    with restoring(folder, written):
        write_lighting(folder / "lighting.json", solution.lighting)
        if (groups := views[0].groups) is not None:
            write_exports(folder, groups, solution.lighting)
        relit = None if scene is None else relight(scene, solution.lighting, folder / "relit.xml")
        return [
            _finished(view, its, relit, settings, reports[view.folder])
            for view, its in zip(views, analyses, strict=True)
        ]


def _fitted_in(views: list[PaintedView], settings: Settings) -> View | None:
    """The one view through which all paintings are compared, None for linear light."""
    if settings.space == "linear":
        return None
    if settings.view is not None:
        return settings.view
    seen = {view.target.view for view in views if view.target.view is not None}
    if len(seen) > 1:
        told = " and ".join(sorted(f"{x.name} at {x.stops:+g} stops" for x in seen))
        raise TargetError(
            f"the paintings were seen through {told}: say with --view and --exposure which of them "
            "is to be fitted"
        )
    return next(iter(seen), None) or View("srgb", choose_exposure(views[0].target.image))


def _to_be_written(views: list[PaintedView], folder: Path) -> list[Path]:
    """All files that are about to be replaced. Raises what keeps the scene from being relit."""
    written = [*earlier_results(folder), folder / "lighting.json"]
    for view in views:
        if view.folder == folder:
            written += [folder / name for name in ALWAYS]
            written += [folder / name for name in EXPORTS if view.groups is not None]
        else:
            written += [file for pattern in RESULTS for file in view.folder.glob(pattern)]
            written += [view.folder / name for name in VIEW_RESULTS]
    if (scene := views[0].scene) is not None:
        written += [folder / "verified.exr", *check_relightable(scene, folder / "relit.xml")]
    return written


def _fitted(views: list[PaintedView], settings: Settings) -> list[PaintedView]:
    """The views on the films that are to be rendered, with targets of their sizes."""
    fitted = []
    for view in views:
        scene, size = view.scene, view.target.size
        if view.basis is not None:
            size = view.basis.size
        elif scene is not None:
            scene = on_film(scene, settings.quality, settings.resolution)
            size = scene.size
        target = view.target.fitted_to(size, resize=settings.resize)
        if view.groups is not None:
            target = target.without(view.groups.holes)
        fitted.append(replace(view, scene=scene, target=target))
    return fitted


def _with_basis(
    view: PaintedView, settings: Settings, count: int, progress: Progress
) -> PaintedView:
    """`view` with its basis, one of `count` that share the time there is."""
    if view.basis is not None or view.scene is None:
        return view
    basis = obtain_basis(
        view.scene,
        spp=samples(settings.quality, spp=settings.spp, time_s=settings.time_s),
        time_s=None if settings.time_s is None else settings.time_s / count,
        seed=settings.seed,
        use_cache=settings.use_cache,
        progress=progress,
    )
    return replace(view, basis=basis)


def _improved(
    solution: Solution, views: list[PaintedView], settings: Settings, progress: Progress
) -> Solution:
    """What can be done against noise is done."""
    if settings.noise_correction:
        solution = correct_noise(solution)
    scenes = [(view.scene, _basis(view)) for view in views if view.scene is not None]
    solution = refine_by_rendering(
        scenes, solution, rounds=settings.refine, seed=settings.seed, progress=progress
    )
    lighting = replace(solution.lighting, cd_per_unit=settings.cd_per_unit)
    return replace(solution, lighting=lighting)


def _finished(
    view: PaintedView,
    analysis: Analysis,
    relit: Scene | None,
    settings: Settings,
    progress: Progress,
) -> Look:
    """One view predicted, verified and shown in its folder."""
    basis, scene, solution = _basis(view), view.scene, analysis.solution
    view.folder.mkdir(exist_ok=True)
    predicted = combine(basis, solution.lighting)
    spp = settings.spp or (basis.origin.spp if scene is None else scene.spp)
    verification = None
    if relit is not None and scene is not None:
        if relit.sensor != scene.sensor:
            relit = load_scene(relit.path, sensor=scene.sensor, use_lights_file=False)
        if settings.checks_as_basis:
            pixels, checked = (size[0] * size[1] for size in (basis.size, relit.size))
            spp = max(FEWEST, basis.origin.spp * pixels // checked)
    write_predicted(view.folder / "predicted.exr", predicted, sensor=basis.origin.sensor, spp=spp)
    if relit is not None:
        verification = verify(predicted, relit, spp=spp, seed=settings.seed, progress=progress)
        write_estimate(view.folder / "verified.exr", verification.verified, {})
    look = Look(
        target=view.target,
        basis=basis,
        solution=solution,
        predicted=predicted,
        relit=relit,
        verification=verification,
        analysis=analysis,
        suggestions=_suggested(view, solution, settings, progress),
    )
    show_look(look, view.folder, command=settings.command)
    return look


def _suggested(
    view: PaintedView, solution: Solution, settings: Settings, progress: Progress
) -> tuple[Suggestion, ...] | None:
    if not settings.suggest or view.scene is None:
        return None
    return suggest_lights(
        view.scene,
        _basis(view),
        solution,
        count=settings.suggest,
        seed=settings.seed,
        progress=progress,
    )


def _progress_of(view: PaintedView, count: int, progress: Progress) -> Progress:
    return progress if count == 1 else labelled(progress, view.folder.name)


def _basis(view: PaintedView) -> Basis:
    assert view.basis is not None
    return view.basis


def all_constraints(scene: Scene | None, given: Constraints | None) -> Constraints:
    """What the lights file of `scene` asks, if it has one, and then `given`."""
    asked = given or Constraints()
    if scene is None or scene.lights_file is None:
        return asked
    return read_constraints(scene.lights_file).and_then(asked)


def render_template(
    scene: Scene,
    folder: Path,
    *,
    view: View | None = None,
    spp: int | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> list[Path]:
    """Render something to paint on into `folder`, and return its files (docs/targets.md).

    view: how the look becomes a picture; sRGB by default, at an exposure that shows something.
    """
    look = render(
        scene, spp=spp, seed=seed, stream=Stream.TEMPLATE, label="template", progress=progress
    ).image
    surfaces = render_surfaces(scene, seed=seed, progress=progress)
    small = scene.reduced(f"1/{THUMBNAIL.reduction(scene.film)}")
    lights = render_basis(small, spp=THUMBNAIL.spp, seed=seed, progress=progress)
    template = Template(
        look,
        view or View("srgb", choose_exposure(look)),
        scene=scene.path.name,
        content=scene.content,
        sensor=scene.sensor_names[scene.sensor],
        albedo=surfaces.albedo,
    )
    return write_template(
        folder,
        template,
        normals=surfaces.normal,
        depth=surfaces.depth,
        mattes=surfaces.coverage,
        lights=dict(zip(lights.names, lights.images, strict=True)),
    )


def render_look(
    scene: Scene,
    path: Path,
    *,
    view: View | None = None,
    spp: int | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> Path:
    """Only the look to paint on, as EXR at `path`; returns the PNG beside it."""
    look = render(
        scene, spp=spp, seed=seed, stream=Stream.TEMPLATE, label="template", progress=progress
    ).image
    return write_look(path, look, view or View("srgb", choose_exposure(look)))


def relight_look(
    scene: Scene,
    lighting: Lighting,
    folder: Path,
    *,
    spp: int | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> Scene:
    """Write relit.xml to `folder`, and its render as relit.exr and relit.png."""
    path = folder / "relit.xml"
    files = [*check_relightable(scene, path), folder / "relit.exr", folder / "relit.png"]
    with restoring(folder, files):
        relit = relight(scene, lighting, path)
        image = render(
            relit, spp=spp, seed=seed, stream=Stream.VERIFICATION, label="relit", progress=progress
        )
        write_estimate(folder / "relit.exr", image, {})
        write_png(folder / "relit.png", image.image, stops=choose_exposure(image.image))
    return relit


def command_line(arguments: list[str]) -> str:
    """The shell command with these arguments, quoted so that it can be pasted."""
    return shlex.join(["lightpaint", *arguments])
