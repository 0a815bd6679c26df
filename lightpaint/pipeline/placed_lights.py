"""Places of lights: found with a first solve, before the solve that counts."""

from collections.abc import Sequence
from dataclasses import replace

from lightpaint.basis.basis import Basis
from lightpaint.images.estimate import Estimate
from lightpaint.lighting.solve import solution_of
from lightpaint.pipeline.job.job import Job
from lightpaint.pipeline.job_bases import obtain, view_listener
from lightpaint.pipeline.needed_samples import problem_of, without_noise
from lightpaint.pipeline.results.results import spoken_move
from lightpaint.placement.place import place
from lightpaint.placement.placement import Placement
from lightpaint.placement.rigging.rigged_lights import freedoms_of
from lightpaint.progress import Listener
from lightpaint.scene.scene import Scene


def place_lights(
    job: Job, bases: list[Basis], listen: Listener
) -> tuple[Job, list[Basis], Placement | None]:
    """Return a job whose lights are where its paintings want them, its bases, and the placement.

    That is None where nothing may move. bases: of the views of `job`; the list is emptied to save
    memory. Only the planes of lights that moved are rendered.
    """
    if not job.all_rigging:
        return job, bases, None
    [view], [basis] = job.views, bases
    assert view.scene is not None
    solution = without_noise(job, solution_of(problem_of(job, bases)))
    freedoms = freedoms_of(job.all_rigging, view.scene)
    placement = place(
        view.scene, basis, solution, freedoms, seed=job.settings.seed, progress=listen
    )
    del solution
    for move in placement.moves:
        listen.say(spoken_move(move))
    if not placement.moves:
        listen.say("no light is moved: no move is surely worth a hundredth of what is missed")
        return job, list(bases), placement
    scenes = [on_film_of(placement.scene, x) for x in bases]
    moved = job.with_moved_lights(scenes)
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
