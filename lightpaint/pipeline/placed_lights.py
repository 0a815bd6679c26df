"""Places of lights: found with a first solve, before the solve that counts."""

from collections.abc import Sequence
from dataclasses import replace

from lightpaint.basis.basis import Basis
from lightpaint.images.estimate import Estimate
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.solve import solution_of
from lightpaint.pipeline.job.job import Job
from lightpaint.pipeline.job_bases import obtain, view_listener
from lightpaint.pipeline.needed_samples import problem_of, without_noise
from lightpaint.pipeline.results.results import all_changes, spoken_change
from lightpaint.placement.place import place
from lightpaint.placement.placement import Placement
from lightpaint.placement.rigging.rigged_lights import rigged_lights
from lightpaint.progress import Listener
from lightpaint.scene.scene import Scene


def place_lights(
    job: Job, bases: list[Basis], listen: Listener
) -> tuple[Job, list[Basis], Placement | None]:
    """Return a job whose lights are where its paintings want them, its bases, and the placement.

    That is None where nothing may move. bases: of the views of `job`; the list is emptied to save
    memory. Only the planes of lights that moved or are new are rendered.
    """
    if not job.all_rigging:
        return job, bases, None
    scenes = [view.scene for view in job.views if view.scene is not None]
    rigged = rigged_lights(job.all_rigging, scenes[0])
    placement = place(
        scenes,
        bases,
        without_noise(job, solution_of(problem_of(job, bases))),
        rigged.freedoms,
        new=rigged.new,
        pairs=rigged.pairs,
        constraints=rigged.constraints,
        seed=job.settings.seed,
        progress=lambda label, done, total, unit="": listen(label, done, total, "steps"),
    )
    for change in all_changes(placement):
        listen.say(spoken_change(change))
    if placement.scene is scenes[0]:
        listen.say("no light is moved: no change is surely worth a hundredth of what is missed")
        return job, bases, placement
    added = {light.name for light in placement.additions}
    asked = tuple(x for x in rigged.constraints.lights if x[0] in added)
    films = [on_film_of(scene, basis) for scene, basis in zip(placement.scenes, bases, strict=True)]
    moved = job.with_moved_lights(films, Constraints(asked))
    before = list(bases)
    bases.clear()
    return moved, _bases_of(moved, before, listen), placement


def on_film_of(scene: Scene, basis: Basis) -> Scene:
    """Return `scene` on the film of `basis`."""
    return scene.reduced(f"{basis.size[1]}x{basis.size[0]}")


def _bases_of(job: Job, before: Sequence[Basis], listen: Listener) -> list[Basis]:
    """Return the bases of a job whose lights have moved, with as many samples as before."""
    made = []
    for view, basis in zip(job.views, before, strict=True):
        assert view.scene is not None
        seed = basis.origin.seed
        settings = replace(job.settings, time_s=None, quality=None, resolution=None, seed=seed)
        if settings.error is None:
            settings = replace(settings, spp=max(2, round(basis.origin.mean_spp)))
        found = obtain(view.scene, settings, view_listener(job, view, listen), before=basis)
        # What was painted over, and holds what was not painted, is the scene before the move.
        look = basis.present_look, basis.present_noise
        made.append(replace(found, former=Estimate(*look)))
    return made
