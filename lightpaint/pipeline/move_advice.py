"""Suggestions to turn an existing spot, for lights that miss the painting from where they hang."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from lightpaint.arrays import Floats
from lightpaint.basis.render.basis_render import render_basis
from lightpaint.errors import SceneError
from lightpaint.images.estimate import Estimate
from lightpaint.images.pixel_blocks import block_mean
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solve import solution_of
from lightpaint.pipeline.job.job import Job
from lightpaint.pipeline.needed_samples import problem_of, without_noise
from lightpaint.placement.freedom import Freedom
from lightpaint.placement.lights_to_place import free_light
from lightpaint.placement.look_goals import on_small_film
from lightpaint.placement.place import place
from lightpaint.placement.placement import Move
from lightpaint.placement.suggestion import MoveSuggestion
from lightpaint.progress import Listener
from lightpaint.scene.scene import Scene

#: Largest turn that is tried, in degrees, and the margin that the suggested option adds to it.
TURN, MARGIN = 45.0, 10.0

#: Number of spots, of those that help most when all may turn, that a search turns alone.
TURNED_ALONE = 3

#: Maximum number of pixels of the preview, camera samples of all of them, and most of one.
PIXELS, SAMPLES, MAX_SPP = 2**14, 2**19, 512

#: Relative error below which nothing is suggested.
NOTHING_MISSED = 0.01


def suggest_move(job: Job, solution: Solution, listen: Listener) -> MoveSuggestion | None:
    """Return the turn of one spot that helps most in all views; None if none surely does.

    A search of all spots together tells which are promising, but their gains count besides the
    turns of the others. So each of the best is turned alone, in the search that the suggested
    option starts, whose turn and gain the suggestion states. Its pictures are of the first view.
    """
    scenes = [view.scene for view in job.views if view.scene is not None]
    freedoms = _turns(scenes[0])
    norm2 = float(solution.norm2.sum())
    if not freedoms or sum(solution.certificate.objective) <= NOTHING_MISSED**2 * norm2:
        return None
    bases = solution.problem.views.bases
    if job.settings.refine:  # The search for places is before the refinement.
        solution = without_noise(job, solution_of(problem_of(job, bases)))

    def moves(freedoms: Mapping[str, Freedom]) -> tuple[Move, ...]:
        return place(
            scenes,
            bases,
            solution,
            freedoms,
            seed=job.settings.seed,
            progress=lambda label, done, total, unit="": listen(label, done, total, "steps"),
        ).moves

    found: list[tuple[Move, int]] = []
    try:
        for candidate in moves(freedoms)[:TURNED_ALONE]:
            aim = 5 * math.ceil((candidate.turn + MARGIN) / 5)
            found += [(move, aim) for move in moves({candidate.name: Freedom(aim=aim)})]
    except SceneError:
        return None  # in fog, say: suggestions of new lights tell why
    if not found:
        return None
    best, aim = max(found, key=lambda move_and_aim: move_and_aim[0].gain_share)
    moved_scenes = [scene.moved({best.name: best.pose}) for scene in scenes]
    picture_without, picture_with = _pictures(job, solution, moved_scenes)
    return MoveSuggestion(best.name, best.turn, best.gain_share, aim, picture_without, picture_with)


def _turns(scene: Scene) -> dict[str, Freedom]:
    """Return spots of `scene` that may be turned."""
    freedoms = {}
    for light in scene.lights:
        if light.plugin != "spot":
            continue
        try:
            free_light(scene, light.name, Freedom(aim=TURN))
        except SceneError:
            continue
        freedoms[light.name] = Freedom(aim=TURN)
    return freedoms


def _pictures(job: Job, solution: Solution, moved_scenes: Sequence[Scene]) -> tuple[Floats, Floats]:
    """Return the first view as solved, and after the move, on a small film."""
    bases, targets, before = [], [], []
    for view, scene, basis in zip(
        job.views, moved_scenes, solution.problem.views.bases, strict=True
    ):
        small_scene = on_small_film(scene, basis, PIXELS // len(moved_scenes))
        height, width = small_scene.size
        factor = basis.size[0] // height
        look = block_mean(basis.current_look, factor), block_mean(basis.current_noise, factor)
        spp = min(MAX_SPP, SAMPLES // (len(moved_scenes) * height * width))
        small_basis = render_basis(small_scene, spp=spp, seed=job.settings.seed)
        bases.append(replace(small_basis, former=Estimate(*look)))
        targets.append(view.target.cropped(factor * height, factor * width).reduced(factor))
        picture = block_mean(basis.predict(solution.weights).image, factor)
        before.append(picture[:height, :width])
    problem = Problem.of(bases, targets, constraints=job.all_constraints, fit=job.fit)
    solution_with_turn = solution_of(problem)
    first = solution_with_turn.problem.views.bases[0]
    return before[0], first.mix(solution_with_turn.weights)
