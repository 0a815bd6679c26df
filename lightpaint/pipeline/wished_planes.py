"""Planes on which a job wishes for illuminance, measured before the solve and read after it; and
plans: settings of the lamps that meet such wishes with the least power.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis import BasisLight, Lights
from lightpaint.basis.render import basis_lights
from lightpaint.display_text import some_names
from lightpaint.errors import SceneError
from lightpaint.keywords import keywords
from lightpaint.lighting import (
    Constraints,
    Lighting,
    LitCase,
    PaintComparison,
    PlanesAnswer,
    Problem,
    Reduction,
    RequiredProblem,
    Scale,
    Solution,
    WishedLight,
    check_powers,
    constraints_of,
    least_watts,
    planes_answer,
    reduce_to,
    solution_of,
    unscaled_error,
    watts_allowed,
    wished_light,
    with_scale,
    with_wishes,
    without_wishes,
)
from lightpaint.photometry import Glare, Illuminance, PowerBudget
from lightpaint.photometry.measure import measure_glare, measure_illuminance
from lightpaint.photometry.planes_file import PlanesFile, read_planes
from lightpaint.pipeline.job.job_checks import checked_scale
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.solve_job import Job
from lightpaint.pipeline.result_folder import ResultFolder, answer_files, files_of_planes
from lightpaint.progress import Listener, Progress, listener, silent
from lightpaint.scene import Scene

#: Least cosine between the normal of a plane and the vertical at which it faces upwards.
FACING_UP = 0.7

#: The file of a plan's numbers.
PLAN = "plan.json"


@dataclass(frozen=True)
class MeasuredPlanes:
    """Planes of a file with the illuminance of each light on them.

    floor_m2: the area that power is divided by; 0 if there is none. glare: that the observers of
    the file see; None if it was not measured. unscaled: lights whose brightness is a guess, and
    which reach no plane.
    """

    file: PlanesFile
    illuminance: Illuminance
    floor_m2: float
    glare: Glare | None = None
    unscaled: tuple[BasisLight, ...] = ()

    def weights_by_case(self, weights: Doubles) -> Mapping[str, Doubles]:
        """Return the weights (n, 3) of each case; of the light of the scene as "" without cases."""
        lights = self.illuminance.lights
        cases = (LitCase.of(case, lights) for case in self.file.cases)
        return {case.name: case.applied_to(weights) for case in cases} or {"": weights}

    def wished_of(self, reduction: Reduction) -> WishedLight:
        """Return the wishes as requirements of the lights of `reduction`."""
        return wished_light(
            self.illuminance,
            self.file.power,
            reduction,
            floor_m2=self.floor_m2,
            cases=self.file.cases,
        )


def measure_planes(
    scene: Scene,
    path: str | Path,
    settings: Settings,
    scale: Scale,
    listen: Listener,
) -> MeasuredPlanes:
    """Measure the illuminance of each light on the planes of a file.

    Raises LightpaintError if nothing says what a radiance of 1 stands for, or it is a guess for a
    light that reaches a plane.
    """
    file, cd_per_unit = read_planes(path, scene), checked_scale(path, scale.cd_per_unit)
    for remark in file.remarks(scene):
        listen.say(remark)
    illuminance = measure_illuminance(
        scene,
        file.planes,
        error=settings.error or file.error,
        cd_per_unit=cd_per_unit,
        seed=settings.seed,
        use_cache=settings.use_cache,
        exact_spp=settings.exact_spp,
        progress=listen,
    )
    check_reached(illuminance, scale.unscaled)
    points = sum(len(plane) for plane in file.planes)
    listen.note(f"illuminance measured at {points} points of {len(file.planes)} planes")
    floor_m2 = _floor_area(file, scene)
    if settings.watts is not None:
        file = replace(file, power=PowerBudget(settings.watts))
    return MeasuredPlanes(file, illuminance, floor_m2, unscaled=scale.unscaled)


def with_glare(
    planes: MeasuredPlanes, scene: Scene, settings: Settings, listen: Listener
) -> MeasuredPlanes:
    """Return measured planes with the glare of each light for the observers of their file, unless
    they may see a light without a scale.
    """
    if not planes.file.observers:
        return planes
    if planes.unscaled:
        listen.say(no_glare_remark(planes.unscaled))
        return planes
    glare = measure_glare(
        scene,
        planes.file.observers,
        error=settings.error or planes.file.error,
        cd_per_unit=planes.illuminance.cd_per_unit,
        seed=settings.seed,
        use_cache=settings.use_cache,
        exact_spp=settings.exact_spp,
        progress=listen,
    )
    listen.note(f"glare measured for {some_names(glare.names)}")
    return replace(planes, glare=glare)


def check_reached(
    measured: Illuminance, unscaled: Sequence[BasisLight], weights: Doubles | None = None
) -> None:
    """Raise ConstraintError if a light without a scale reaches a plane.

    unscaled: lights whose brightness is a guess. weights: of the lights, (n, 3); by default any.
    """
    for light in unscaled:
        k = measured.lights.names.index(light.name)
        light_at = (
            measured.matrix[:, k] @ np.ones(3)
            if weights is None
            else (measured.matrix[:, k] @ weights[k])
        )
        for plane in measured.planes:
            if light_at[measured.points_of(plane.name)].any():
                raise unscaled_error(light, plane.name)


def no_glare_remark(unscaled: Sequence[BasisLight]) -> str:
    """Return why glare is not rated beside lights without a scale, which observers may see."""
    names = some_names(light.name for light in unscaled)
    return f"glare is not rated: {names} may be seen, and nothing says how bright that is in cd/m²"


def limited_power(watts: float, lights: Lights) -> MeasuredPlanes:
    """Return no planes, and a limit of the power of all lamps."""
    nothing = np.zeros((0, len(lights), 3))
    illuminance = Illuminance((), lights, nothing, nothing, 1.0)
    return MeasuredPlanes(PlanesFile(Path(), (), PowerBudget(watts)), illuminance, 0.0)


def constraints_and_scale(
    scene: Scene, constraints: Constraints, settings: Settings
) -> tuple[Constraints, Scale]:
    """Return all constraints on the lights of a scene, and the scale of these. `check_reached`
    allows lights without a scale where they reach no plane.
    """
    every = constraints_of(scene.requests).and_then(constraints)
    every = every.and_then(Constraints(cd_per_unit=settings.cd_per_unit))
    lights = basis_lights(scene)
    return with_scale(every, lights), Scale.of(every, lights)


def check_planes(
    scene: Scene,
    path: str | Path,
    constraints: Constraints,
    settings: Settings,
    *,
    read: Callable[[str | Path, Scene], PlanesFile] = read_planes,
) -> None:
    """Raise LightpaintError unless planes of a file can be measured in a scene, and its lamps have
    what wishes for their power need. Nothing is rendered.

    constraints: on the lights, beside the constraints of the lights file. read: reads the file.
    """
    every, _ = constraints_and_scale(scene, constraints, settings)
    checked_scale(path, every.cd_per_unit)
    file, lights = read(path, scene), basis_lights(scene)
    if watts_allowed(file.power, _floor_area(file, scene)) is not None:
        reduction = reduce_to(every, lights)
        check_powers(reduction, [light.name for light in lights], "a limit of power")


def planes_of_job(job: Job, lights: Lights, listen: Listener) -> MeasuredPlanes | None:
    """Return the planes that a job wishes for, measured, and its limit of power; None without
    either.
    """
    settings, scene = job.settings, job.views[0].scene
    if settings.planes is None or scene is None:
        return None if settings.watts is None else limited_power(settings.watts, lights)
    planes = measure_planes(scene, settings.planes, settings, job.scale, listen)
    return with_glare(planes, scene, settings, listen)


def require(
    problem: Problem, planes: MeasuredPlanes, settings: Settings, listen: Listener
) -> RequiredProblem:
    """Return the problem under the wishes for planes, unless settings ignore them, and say what is
    not within reach.
    """
    wished = planes.wished_of(problem.reduction)
    if settings.ignore_wishes:
        return RequiredProblem(without_wishes(problem), wished, np.zeros(0))
    required = with_wishes(problem, wished)
    if required.shares.any():
        listen.note("not all that planes ask for is within reach: as much of it as there can be")
    return required


def answer_on_planes(
    solution: Solution, planes: MeasuredPlanes, required: RequiredProblem
) -> PlanesAnswer:
    """Return what a solution gives on planes, and what their wishes cost the picture."""
    answer = planes_answer(
        required.wished,
        solution.problem.reduction,
        solution.weights,
        floor_m2=planes.floor_m2,
        glare=planes.glare,
        are_ignored=(
            solution.problem.reduction.requirements is None and not required.wished.is_empty
        ),
    )
    return _with_costs(answer, solution, planes)


def _with_costs(answer: PlanesAnswer, solution: Solution, planes: MeasuredPlanes) -> PlanesAnswer:
    """Return an answer with how much further it is from the painting than one without wishes, and
    than one whose power is not limited.
    """
    problem = solution.problem
    if problem.reduction.requirements is None:
        return answer
    free, look = without_wishes(problem), PaintComparison.of_problem(problem)
    rows = look.rows(problem.basis.planes)
    missed = partial(look.missed, rows)

    def cost_beside(other: Problem) -> float:
        other_weights = solution_of(other, start=solution.weights).weights
        return missed(solution.weights) - missed(other_weights)

    answer = replace(answer, cost_delta_e=cost_beside(free))
    is_alone = all(wish.kind == "power" for wish in answer.wished.wishes)
    if answer.binding_limit is None or is_alone:
        return answer
    unlimited = replace(planes, file=replace(planes.file, power=PowerBudget()))
    wished = with_wishes(free, unlimited.wished_of(free.reduction))
    return replace(answer, budget_delta_e=cost_beside(wished.problem))


def _floor_area(file: PlanesFile, scene: Scene) -> float:
    if file.power.area is not None:
        return file.power.area
    up = np.array(scene.up)
    areas = (x.area_m2 for x in file.planes if float((x.normals @ up).mean()) > FACING_UP)
    return max(areas, default=0.0)


@dataclass(frozen=True)
class LightPlan:
    """The settings of least power. lighting: of all lamps. planes: what it gives on the planes."""

    lighting: Lighting
    planes: PlanesAnswer


@keywords()
def plan_lighting(
    scene: Scene,
    planes: str | Path,
    *,
    constraints: Constraints | None = None,
    settings: Settings | None = None,
    progress: Progress = silent,
) -> LightPlan:
    """Find the settings of the lamps that meet the wishes for planes with the least power.

    Args:
        scene: From `load_scene`. Its lights file gives each lamp's emitters, with their power.
        planes: Path of a planes file.
        constraints: On lights; they override the constraints of the lights file.
        settings: Of these `error`, `seed`, `use_cache`, `cd_per_unit` and `watts` count.
        progress: Called with the progress of the work.

    Returns:
        The lighting, and what it gives on the planes. Wishes beyond all lamps are met as far as
        they can be.

    Raises:
        LightpaintError: If the power of a lamp is unknown, or nothing says what a radiance of 1 is.
        SceneError: For an invalid planes file.
    """
    settings, listen = settings or Settings(), listener(progress)
    every, scale = constraints_and_scale(scene, constraints or Constraints(), settings)
    lights = basis_lights(scene)
    reduction = reduce_to(every, lights)
    check_powers(reduction, [light.name for light in lights], "the least power")
    measured = measure_planes(scene, planes, settings, scale, listen)
    measured = with_glare(measured, scene, settings, listen)
    return plan_of(measured, reduction, scene_identity=scene.identity)


def plan_of(planes: MeasuredPlanes, reduction: Reduction, *, scene_identity: str = "") -> LightPlan:
    """Return the plan for measured planes. reduction: of the lights, without requirements.

    Raises SceneError if nothing is wished for but a limit of power.
    """
    wished = planes.wished_of(reduction)
    if all(wish.is_hard for wish in wished.wishes):
        raise SceneError(
            "the planes file wishes for no light: give a plane a mean, a uniformity or a preset"
        )
    required = reduction.with_requirements(wished.requirements)
    program = least_watts(wished, required)
    weights = required.weights(program.x)
    answer = planes_answer(
        wished,
        reduction,
        weights,
        floor_m2=planes.floor_m2,
        prices=wished.multipliers_of(program.multipliers),
        glare=planes.glare,
    )
    lighting = Lighting.of_weights(
        planes.illuminance.lights,
        weights,
        labels=[(label, False) for label in reduction.labels],
        lamps=reduction.lamps,
        target=planes.file.path.name,
        scene_identity=scene_identity,
        cd_per_unit=planes.illuminance.cd_per_unit,
    )
    return LightPlan(lighting, answer)


def plan_folder(scene: Scene, planes: Path, folder: Path, *, force: bool) -> ResultFolder:
    """Return the folder that a plan is written to."""
    files = [*answer_files(folder, scene=scene), folder / PLAN, *files_of_planes(folder, planes)]
    reads = (planes, *scene.read_files)
    return ResultFolder(folder, tuple(files), reads, (planes,), force=force)
