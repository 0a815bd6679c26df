"""The corridor: load → basis → target → solve → relight → verify, in that order."""

import json
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from lightpaint.basis import cache
from lightpaint.basis.basis import Basis, read_basis
from lightpaint.basis.render import basis_lights, is_of, render_basis
from lightpaint.errors import BasisError, ImageError, LightpaintError, OutputError, SceneError
from lightpaint.files import check_writable, restoring, write_text
from lightpaint.images.blocks import whole_factor
from lightpaint.images.display import choose_exposure, write_png
from lightpaint.images.estimate import Estimate, read_estimate_with_attributes, write_estimate
from lightpaint.progress import Progress, silent
from lightpaint.relight.comparison import write_comparison
from lightpaint.relight.refine import refine_by_rendering
from lightpaint.relight.relight import check_relightable, relight
from lightpaint.relight.report import report_page
from lightpaint.relight.verify import Verification, verify
from lightpaint.scene.quality import Quality, with_quality
from lightpaint.scene.render import Stream, render
from lightpaint.scene.scene import Scene, load_scene
from lightpaint.solve.constraints import Constraints
from lightpaint.solve.constraints_file import read_constraints
from lightpaint.solve.diagnosis import Diagnosis, diagnose
from lightpaint.solve.indistinguishable import Ambiguity, ambiguities
from lightpaint.solve.lighting import Lighting, combine, write_lighting
from lightpaint.solve.reduction import reduce_to
from lightpaint.solve.solve import Solution, solve, solve_views
from lightpaint.solve.uncertainty import Uncertainty, correct_noise, error_bars, with_error_bars
from lightpaint.target.target import Target, read_target
from lightpaint.target.template import write_template

#: Header attribute of predicted.exr: how to see the relit scene as the basis saw it.
VIEW_KEY = "lightpaint.view"

#: Samples per pixel of a verification that has a large film for a small basis, at least.
FEWEST = 4

#: What every solve writes.
ALWAYS = ("lighting.json", "predicted.exr", "comparison.png", "report.html")

#: What each view has where there are several.
VIEW_RESULTS = ("predicted.exr", "verified.exr", "comparison.png", "report.html")

#: What a solve and a relight write, and the next solve replaces.
RESULTS = (
    "lighting.json",
    "predicted.exr",
    "verified.exr",
    "comparison.png",
    "report.html",
    "relit.xml",
    "relit.png",
    "relit.exr",
    "relit.*.exr",
)


@dataclass(frozen=True)
class Look:
    """One painting and its answer.

    relit and verification are None where there was only a saved basis and no scene.
    uncertainty: how sure the lights are; diagnosis: why the painting is not met; ambiguities:
    lights that it cannot tell apart. None of these for several views.
    """

    target: Target
    basis: Basis
    solution: Solution
    predicted: Estimate
    relit: Scene | None
    verification: Verification | None
    uncertainty: Uncertainty | None
    diagnosis: Diagnosis | None
    ambiguities: tuple[Ambiguity, ...] = ()

    @property
    def lighting(self) -> Lighting:
        """The lighting that comes closest to the target."""
        return self.solution.lighting


def paint_with_light(
    scene: str | Path | Scene | None,
    target: str | Path | Target,
    folder: str | Path,
    *,
    basis: str | Path | Basis | None = None,
    mask: str | Path | None = None,
    constraints: Constraints | None = None,
    unpainted: float = 0.0,
    noise_correction: bool = False,
    refine: int = 0,
    spp: int | None = None,
    time_s: float | None = None,
    quality: Quality | None = None,
    seed: int = 0,
    sensor: int | str | None = None,
    resolution: str | None = None,
    parameters: Mapping[str, object] | None = None,
    lights: Iterable[str] | None = None,
    groups: Mapping[str, Iterable[str]] | None = None,
    resize: bool = False,
    cd_per_unit: float | None = None,
    use_cache: bool = True,
    command: str = "",
    progress: Progress = silent,
) -> Look:
    """Find the lighting of `scene` that comes closest to a painting, and prove it.

    scene: Mitsuba XML, or None to solve from `basis` alone, without a renderer.
    folder: receives lighting.json, predicted.exr, comparison.png and report.html and, with
    a scene, relit.xml and verified.exr.
    basis: one made before of the same scene; taken from the cache or rendered if not given.
    constraints: what is asked of the lights; it goes before what the scene's lights file asks.
    unpainted: weight of unpainted pixels against the current look.
    noise_correction: whether half of the noise's power is taken out of the equations.
    refine: how often to render the scene as solved, with as many samples as the basis, and
    improve the answer by what that shows; needs a scene.
    sensor, parameters, lights, groups: as `load_scene` takes them, where `scene` is a path.
    resolution: `1/4` or `320x180`: part of the film that the basis is rendered on. The
    verification has the whole film.
    spp, seed: of the basis and, with other random numbers, of the verification.
    time_s: instead of spp, seconds in which the basis is rendered.
    quality: preset of spp and resolution, where these are not given. With a time or a preset
    the verification has about as many samples as the basis, whatever the resolution.

    cd_per_unit: cd/m² that a radiance of 1 stands for, for luminous quantities in the results.

    Raises LightpaintError; all that a user gives is checked before anything is rendered.
    """
    folder = Path(folder)
    if isinstance(scene, str | Path):
        scene = load_scene(
            scene, sensor=sensor, parameters=parameters, lights=lights, groups=groups
        )
    asked = spp
    if scene is not None and basis is None:
        scene, spp = with_quality(scene, quality, spp=spp, time_s=time_s, resolution=resolution)
    if refine and scene is None:
        raise LightpaintError("refining renders the scene: give it, and not only its basis")
    if isinstance(basis, str | Path):
        basis = read_basis(Path(basis))
    if scene is not None and basis is not None:
        check_same_view(scene, basis)
    if not isinstance(target, Target):
        target = read_target(target, mask=mask)
    size = basis.size if basis is not None else scene.size if scene is not None else target.size
    target = target.fitted_to(size, resize=resize)
    check_writable(folder)
    written = earlier_results(folder) + [folder / name for name in ALWAYS]
    if scene is not None:
        written += [folder / "verified.exr", *check_relightable(scene, folder / "relit.xml")]

    constraints = all_constraints(scene, constraints)
    if scene is not None:
        reduce_to(constraints, basis_lights(scene))  # names what cannot be had before it renders

    if basis is None:
        if scene is None:
            raise LightpaintError("give a scene, a basis, or both")
        basis = obtain_basis(
            scene, spp=spp, time_s=time_s, seed=seed, use_cache=use_cache, progress=progress
        )
    solution = solve(basis, target, constraints=constraints, unpainted=unpainted)
    if noise_correction:
        solution = correct_noise(basis, solution)
    if scene is not None:
        solution = refine_by_rendering(
            scene, basis, solution, rounds=refine, seed=seed, progress=progress
        )
    uncertainty = error_bars(basis, solution)
    solution = with_error_bars(solution, uncertainty)
    diagnosis = diagnose(basis, target, solution)
    alike = () if constraints else ambiguities(basis, solution)
    solution = replace(solution, lighting=replace(solution.lighting, cd_per_unit=cd_per_unit))
    predicted = combine(basis, solution.lighting)
    as_basis = spp or basis.origin.spp if asked is None and (time_s or quality) else None
    relit, verification = None, None
    with restoring(folder, written):
        write_lighting(folder / "lighting.json", solution.lighting)
        checked_spp = asked or (scene.spp if scene is not None else basis.origin.spp)
        if scene is not None:
            relit = relight(scene, solution.lighting, folder / "relit.xml")
            if as_basis is not None:
                checked_spp = max(FEWEST, as_basis * predicted.size[1] ** 2 // relit.size[1] ** 2)
        view = {"sensor": basis.origin.sensor, "spp": checked_spp}
        write_estimate(folder / "predicted.exr", predicted, {VIEW_KEY: json.dumps(view)})
        if relit is not None:
            verification = verify(predicted, relit, spp=checked_spp, seed=seed, progress=progress)
            write_estimate(folder / "verified.exr", verification.verified, {})
        proof = (relit, verification, uncertainty, diagnosis, alike)
        look = Look(target, basis, solution, predicted, *proof)
        show_look(look, folder, command=command)
    return look


def paint_views_with_light(
    scenes: Sequence[Scene],
    targets: Sequence[Target],
    folder: str | Path,
    *,
    bases: Sequence[Basis] | None = None,
    constraints: Constraints | None = None,
    unpainted: float = 0.0,
    spp: int | None = None,
    seed: int = 0,
    resize: bool = False,
    cd_per_unit: float | None = None,
    use_cache: bool = True,
    command: str = "",
    progress: Progress = silent,
) -> list[Look]:
    """Find the one lighting that comes closest to paintings of several views of a scene.

    scenes: the same scene, loaded through another sensor each; targets: what each is to show.
    folder: receives lighting.json and relit.xml, and for each sensor a folder of that name with
    predicted.exr, verified.exr, comparison.png and report.html.
    bases: of these views, if made before. Other arguments as of `paint_with_light`.
    """
    folder = Path(folder)
    names = [scene.sensor_names[scene.sensor] for scene in scenes]
    if len(set(names)) < len(names):
        raise SceneError(f"a view is painted twice: {', '.join(names)}; give each sensor once")
    for name in names:
        if Path(name).name != name or name in ("..", ""):
            raise SceneError(f"the sensor id {name!r} cannot name a folder: choose another id")
    constraints = all_constraints(scenes[0], constraints)
    reduce_to(constraints, basis_lights(scenes[0]))
    check_writable(folder)
    written = [*earlier_results(folder), folder / "lighting.json"]
    written += check_relightable(scenes[0], folder / "relit.xml")
    for name in names:
        here = [file for pattern in RESULTS for file in (folder / name).glob(pattern)]
        written += [*here, *(folder / name / file for file in VIEW_RESULTS)]
    sizes = [scene.size for scene in scenes] if bases is None else [b.size for b in bases]
    fitted = [t.fitted_to(size, resize=resize) for t, size in zip(targets, sizes, strict=True)]
    if bases is None:
        bases = [
            obtain_basis(scene, spp=spp, seed=seed, use_cache=use_cache, progress=progress)
            for scene in scenes
        ]
    solutions = solve_views(
        list(zip(bases, fitted, strict=True)), constraints=constraints, unpainted=unpainted
    )
    lighting = replace(solutions[0].lighting, cd_per_unit=cd_per_unit)
    looks = []
    with restoring(folder, written):
        write_lighting(folder / "lighting.json", lighting)
        for scene, name, basis, target, solution in zip(
            scenes, names, bases, fitted, solutions, strict=True
        ):
            (folder / name).mkdir(exist_ok=True)
            predicted = combine(basis, lighting)
            checked_spp = scene.spp if spp is None else spp
            view = {"sensor": name, "spp": checked_spp}
            path = folder / name / "predicted.exr"
            write_estimate(path, predicted, {VIEW_KEY: json.dumps(view)})
            relit = relight(scene, lighting, folder / "relit.xml")
            verification = verify(predicted, relit, spp=checked_spp, seed=seed, progress=progress)
            write_estimate(folder / name / "verified.exr", verification.verified, {})
            solved = replace(solution, lighting=lighting)
            look = Look(target, basis, solved, predicted, relit, verification, None, None)
            show_look(look, folder / name, command=command)
            looks.append(look)
    return looks


def result_folders(folder: Path) -> list[Path]:
    """`folder` itself, or where it holds several views the folders of these."""
    if (folder / "predicted.exr").is_file() or not (folder / "relit.xml").is_file():
        return [folder]
    return sorted(file.parent for file in folder.glob("*/predicted.exr")) or [folder]


def all_constraints(scene: Scene | None, given: Constraints | None) -> Constraints:
    """What the lights file of `scene` asks, if it has one, and then `given`."""
    asked = given or Constraints()
    if scene is None or scene.lights_file is None:
        return asked
    return read_constraints(scene.lights_file).and_then(asked)


def earlier_results(folder: Path) -> list[Path]:
    """What an earlier solve left in `folder`: results of two never stand together."""
    if not (folder / "lighting.json").is_file():
        return []  # somebody else's files, whatever they are called
    return [file for pattern in RESULTS for file in folder.glob(pattern)]


def check_same_view(scene: Scene, basis: Basis) -> None:
    """Raise BasisError unless `basis` was made of `scene` as it is, through its sensor."""
    origin, sensor = basis.origin, scene.sensor_names[scene.sensor]
    mine = {light.name: light.member_names for light in scene.lights}
    its = {light.name: light.members for light in basis.lights}
    if mine != its:
        raise BasisError(
            f"the basis has the lights {', '.join(its)}, and {scene.path} was loaded with "
            f"{', '.join(mine)}: load it with the same lights and groups"
        )
    if (origin.scene_identity, origin.sensor) != (scene.identity, sensor):
        what = "another state of the scene" if origin.sensor == sensor else "another sensor"
        raise BasisError(
            f"the basis shows {what}: it was made of {origin.scene} through {origin.sensor}, not "
            f"of {scene.path} as it is through {sensor}; make it again"
        )
    if whole_factor(scene.size, basis.size) is None:
        raise BasisError(
            f"the basis is {basis.size[1]}x{basis.size[0]} but {scene.path} renders "
            f"{scene.size[1]}x{scene.size[0]}, which is no whole multiple: make it again"
        )


def obtain_basis(
    scene: Scene,
    *,
    spp: int | None = None,
    time_s: float | None = None,
    seed: int = 0,
    use_cache: bool = True,
    progress: Progress = silent,
) -> Basis:
    """The basis of `scene`: what an earlier run kept, with the samples that are missing.

    time_s: instead of spp, seconds of rendering to add to what was kept.
    use_cache: False neither looks for one nor keeps it.
    """
    if not use_cache:
        return render_basis(scene, spp=spp, time_s=time_s, seed=seed, progress=progress)
    start = cache.find(scene.identity, scene.sensor_names[scene.sensor], seed, scene.size)
    if start is not None and not is_of(scene, start, seed):
        start = None
    if start is not None:
        # One kept by an earlier version may know less of the same lights.
        start = replace(start, lights=basis_lights(scene))
    basis = render_basis(
        scene,
        spp=spp,
        time_s=time_s,
        seed=seed,
        start=start,
        keep=cache.keep,
        progress=progress,
    )
    if start is None or (basis is not start and basis.origin.spp >= start.origin.spp):
        cache.keep(basis)
    return basis


def show_look(look: Look, folder: Path, *, command: str) -> None:
    """Write the pictures people look at: comparison.png and report.html."""
    verified = look.verification.verified.image if look.verification else None
    write_comparison(
        folder / "comparison.png",
        basis=look.basis,
        target=look.target,
        solution=look.solution,
        predicted=look.predicted.image,
        verified=verified,
    )
    page = report_page(
        basis=look.basis,
        target=look.target,
        solution=look.solution,
        predicted=look.predicted,
        verification=look.verification,
        command=command,
        uncertainty=look.uncertainty,
        diagnosis=look.diagnosis,
    )
    write_text(folder / "report.html", page)


def render_template(
    scene: Scene,
    path: Path,
    *,
    spp: int | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> Path:
    """Render the current look of `scene` to an EXR, to be painted over.

    Returns the path of the display-encoded PNG beside it.
    """
    look = render(
        scene, spp=spp, seed=seed, stream=Stream.TEMPLATE, label="template", progress=progress
    )
    return write_template(path, look.image)


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


def verify_result(
    folder: str | Path,
    *,
    spp: int | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> Verification:
    """Render the relit.xml of a result folder anew and compare it with its predicted.exr.

    spp: samples per pixel (those that predicted.exr was solved with by default).
    Raises OutputError if `folder` holds no such result, ImageError if predicted.exr is damaged.
    """
    folder = Path(folder)
    relit_xml = folder / "relit.xml"
    if not relit_xml.is_file() and (folder.parent / "relit.xml").is_file():
        relit_xml = folder.parent / "relit.xml"  # one of several views
    missing = [file.name for file in (folder / "predicted.exr", relit_xml) if not file.is_file()]
    if missing:
        raise OutputError(
            f"{folder} is no result folder with a relit scene: it has no "
            f"{' and no '.join(missing)}; give one that lightpaint solve made from a scene"
        )
    path = folder / "predicted.exr"
    predicted, attributes = read_estimate_with_attributes(path)
    sensor, solved_spp = _read_view(path, attributes.get(VIEW_KEY, "{}"))
    relit = load_scene(relit_xml, sensor=sensor, use_lights_file=False)
    return verify(
        predicted,
        relit,
        spp=solved_spp if spp is None else spp,
        seed=seed,
        stream=Stream.SECOND_VERIFICATION,
        progress=progress,
    )


def _read_view(path: Path, text: str) -> tuple[str | None, int | None]:
    """Sensor and samples per pixel that `path` notes under VIEW_KEY; None for what it lacks."""
    try:
        view = json.loads(text)
        if not isinstance(view, dict):
            raise TypeError(f"{view!r} is not an object")
        sensor, spp = view.get("sensor"), view.get("spp")
        if not (sensor is None or isinstance(sensor, str)):
            raise TypeError(f"sensor is a name, not {sensor!r}")
        # A type and no isinstance: true would pass for the number 1.
        if not (spp is None or (type(spp) is int and spp > 0)):
            raise TypeError(f"spp is a whole number > 0, not {spp!r}")
    except (TypeError, ValueError, RecursionError) as error:
        raise ImageError(
            f"{path} is damaged in its attribute {VIEW_KEY}: {error}; solve again"
        ) from None
    return sensor, spp


def command_line(arguments: list[str]) -> str:
    """The shell command with these arguments, quoted so that it can be pasted."""
    return shlex.join(["lightpaint", *arguments])
