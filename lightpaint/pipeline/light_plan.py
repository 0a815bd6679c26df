"""A plan: settings of the lamps that meet the wishes for planes with the least power."""

from dataclasses import dataclass
from pathlib import Path

from lightpaint.basis.render import basis_lights
from lightpaint.keywords import keywords
from lightpaint.lighting import (
    Constraints,
    Lighting,
    PlanesAnswer,
    Reduction,
    check_powers,
    least_watts,
    planes_answer,
    reduce_to,
)
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.results.result_folder import ResultFolder, answer_files, files_of_planes
from lightpaint.pipeline.wished_planes import (
    MeasuredPlanes,
    constraints_and_scale,
    measure_planes,
    with_glare,
)
from lightpaint.progress import Progress, listener, silent
from lightpaint.scene import Scene

#: The file of a plan's numbers.
PLAN = "plan.json"


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
    """Return the plan for measured planes. reduction: of the lights, without requirements."""
    wished = planes.wished_of(reduction)
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
