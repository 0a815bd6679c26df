"""Places of lights: moves them to where a first solve wants them, before the solve that counts, and
suggests afterwards to turn a spot that misses the painting from where it hangs.

A texel that is much brighter than its neighbours may stand for a smaller source, whose shadows are
sharper. It gets finer texels in its place, whose pictures are rendered together with the pictures
of the texels around it, and everything is solved again; what gains nothing is left as it was.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis import Basis, LightImage, light_images
from lightpaint.basis.cache import Render
from lightpaint.basis.render import render_basis
from lightpaint.colour import luminance
from lightpaint.display_text import some_names
from lightpaint.errors import SceneError
from lightpaint.images import Estimate, block_mean
from lightpaint.lighting import Constraints, Problem, Solution, solution_of
from lightpaint.pipeline.job.job_checks import sky_for_sun, wanted_sun
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.solve_job import Job
from lightpaint.pipeline.job.sources import content
from lightpaint.pipeline.job_bases import obtain, problem_of, view_listener, without_noise
from lightpaint.pipeline.look import all_changes, spoken_change
from lightpaint.placement import (
    Freedom,
    Move,
    MoveSuggestion,
    Placement,
    PlacementRecord,
    free_light,
    on_small_film,
    place,
    place_rigged,
    rigged_lights,
)
from lightpaint.progress import Listener
from lightpaint.scene import Scene, with_layout
from lightpaint.scene.lights.texels import CHILDREN, MAX_LEVEL, RATIO, Node
from lightpaint.sentences import Hint, Sentence

#: Largest turn that is tried, in degrees, and the margin that the suggested option adds to it.
TURN, MARGIN = 45.0, 10.0

#: Number of spots, of those that help most when all may turn, that a search turns alone.
TURNED_ALONE = 3

#: Maximum number of pixels of the preview, camera samples of all of them, and most of one.
PIXELS, SAMPLES, MAX_SPP = 2**14, 2**19, 512

#: Relative error below which nothing is suggested.
NOTHING_MISSED = 0.01

#: Share of the error that splitting a texel must remove, and how much more for each unknown that it
#: adds, relative to the number of pixels.
LEAST_GAIN, NOISE_FIT = 0.05, 3
#: How many texels are tried in vain before the search ends.
MAX_VAIN = 2


def place_lights(
    job: Job, bases: list[Basis], listen: Listener
) -> tuple[Job, list[Basis], Placement | None]:
    """Move lights to where the paintings want them; return the job, its bases and the placement.

    That is None where nothing may move. bases: of the views of `job`, or of these with the lights
    where they were found before; the list is emptied to save memory. Only the planes of lights that
    moved or are new are rendered.
    """
    if not job.all_rigging and job.placement is None:
        return job, bases, None
    scenes = [view.scene for view in job.views if view.scene is not None]
    if job.placement is None:
        placement = find_places([job], bases, listen)
        rigging = job.all_rigging
        changes = ["moved"] * bool(rigging.lights) + ["added"] * bool(rigging.new)
        say_changes(placement, listen, requested=" or ".join(changes))
    else:
        placement = content(job.placement).hung_in(scenes)
    if placement.is_empty:
        return job, bases, placement
    added_names = {light.name for light in placement.additions}
    constraints = rigged_lights(job.all_rigging, scenes[0]).constraints
    new_light_constraints = tuple(x for x in constraints.lights if x[0] in added_names)
    films = [on_film_of(scene, basis) for scene, basis in zip(placement.scenes, bases, strict=True)]
    job_with_moves = job.with_moved_lights(films, Constraints(new_light_constraints))
    unmoved_bases = list(bases)
    bases.clear()
    moved_bases = [
        moved_basis(scene, basis, job.settings, view_listener(job, view, listen))
        for scene, basis, view in zip(films, unmoved_bases, job_with_moves.views, strict=True)
    ]
    return job_with_moves, moved_bases, placement


def find_places(jobs: Sequence[Job], bases: Sequence[Basis], listen: Listener) -> Placement:
    """Return the places that all paintings of `jobs` together want, in the views of `bases`.

    The jobs share one scene and its rigging; each has its own light levels.
    """
    solutions, scenes = [], dict[int, Scene]()
    for job in jobs:
        views = [view.scene for view in job.views if view.scene is not None]
        places = range(len(bases)) if len(jobs) == 1 else [_place_of(x, bases) for x in views]
        scenes |= zip(places, views, strict=True)
        solution = solution_of(problem_of(job, [bases[k] for k in places]))
        solutions.append(without_noise(job, solution))
    films = [scenes[k] for k in range(len(bases))]
    return place_rigged(
        films,
        bases,
        solutions[0] if len(jobs) == 1 else solutions,
        rigged_lights(jobs[0].all_rigging, films[0]),
        seed=jobs[0].settings.seed,
        progress=lambda label, done, total, unit="": listen(label, done, total, "steps"),
    )


def say_changes(
    placement: Placement | PlacementRecord, listen: Listener, *, requested: str = "moved"
) -> None:
    """Tell the user which lights were moved and added, and for which looks they hang so.

    requested: what lights may be, `moved`, `added`, or `moved or added`.
    """
    changes = all_changes(placement)
    prefix = f"{some_names(placement.looks)}: " if placement.looks else ""
    for change in changes:
        listen.say(f"{prefix}{spoken_change(change)}")
    if not changes:
        text = f"no light is {requested}: no change reliably removes a hundredth of the error"
        if isinstance(placement, Placement) and len(placement.scenes) == 1:
            text += "; paint a second view for lights that this one hardly shows"
        listen.say(f"{prefix}{text}")


def _place_of(scene: Scene, bases: Sequence[Basis]) -> int:
    """Return the index of the basis with a scene's sensor and film."""
    films_of_bases = [(basis.origin.sensor, basis.size) for basis in bases]
    return films_of_bases.index((scene.sensor_names[scene.sensor], scene.size))


def on_film_of(scene: Scene, basis: Basis) -> Scene:
    """Return `scene` on the film of `basis`."""
    return scene.reduced(f"{basis.size[1]}x{basis.size[0]}")


def moved_basis(
    scene: Scene,
    before: Basis,
    settings: Settings,
    listen: Listener,
    *,
    render: Render = render_basis,
    names_cache: bool = True,
) -> Basis:
    """Return the basis of a scene whose lights have moved, with as many samples as `before`.

    before: basis of the scene before the move; if it is of `scene` itself, it is returned.
    names_cache: as of `obtain`.
    """
    if before.origin.scene_identity == scene.identity:
        return before
    settings = replace(
        settings, time_s=None, quality=None, resolution=None, seed=before.origin.seed
    )
    if settings.error is None:
        settings = replace(settings, spp=max(2, round(before.origin.mean_spp)))
    basis = obtain(scene, settings, listen, before=before, render=render, names_cache=names_cache)
    # The look that was painted over, and that unpainted parts keep, is from before the move.
    return replace(basis, former=Estimate(before.current_look, before.current_noise))


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


def find_suns(job: Job, bases: list[Basis], listen: Listener) -> tuple[Job, list[Basis]]:
    """Return the job with a sky of finer texels where that pays off, and its bases.

    bases: of the views of `job`. The sky gets at most as many texels more as were asked for.
    """
    scenes = [view.scene for view in job.views if view.scene is not None]
    if not (count := wanted_sun(job.settings, scenes)):
        return job, bases
    image = sky_for_sun(scenes[0], count)
    best, passed = _Candidate.of(job, bases), set[Node]()
    started, first = best, best.missed
    while len(passed) < MAX_VAIN and count >= CHILDREN - 1:
        node = _brightest(best, image, passed)
        if node is None:
            break
        finer = _split(best, image, node, listen)
        added = len(finer.solution.basis.lights) - len(best.solution.basis.lights)
        # More unknowns fit some of the noise of any picture.
        least_gain = LEAST_GAIN + NOISE_FIT * added / finer.solution.importance.size
        if finer.missed > (1 - least_gain) * best.missed:
            passed |= _with_mirror_image(best, image, node)
            continue
        best, count = finer, count - added
        listen.note(f"a finer texel of {image} leaves {best.missed / first:.3g} of the error")
    listen.say(_text(best, started, image))
    return best.job, best.bases


@dataclass(frozen=True)
class _Candidate:
    """A sky with the answer to the job. missed: the loss of the answer."""

    job: Job
    bases: list[Basis]
    solution: Solution
    missed: float

    @classmethod
    def of(cls, job: Job, bases: list[Basis]) -> "_Candidate":
        """Return the answer with these bases of the views of a job."""
        solution = without_noise(job, solution_of(problem_of(job, bases)))
        missed = float(solution.problem.objective(solution.weights).sum())
        return cls(job, bases, solution, missed)

    def image(self, name: str) -> LightImage:
        """Return the sky."""
        return next(x for x in light_images(self.solution.basis.lights) if x.name == name)


def _split(one: _Candidate, image: str, node: Node, listen: Listener) -> _Candidate:
    """Return the answer with a texel split again, in a symmetric sky with its mirror image."""
    layout = one.image(image).layout.split_again(*_with_mirror_image(one, image, node))
    scenes: list[Scene] = []
    for view, basis in zip(one.job.views, one.bases, strict=True):
        assert view.scene is not None
        scenes.append(on_film_of(with_layout(view.scene, image, layout), basis))
    job = one.job.with_scenes(scenes)
    bases = [
        _finer_basis(scene, basis, job, view_listener(job, view, listen))
        for scene, basis, view in zip(scenes, one.bases, job.views, strict=True)
    ]
    return _Candidate.of(job, bases)


def _with_mirror_image(one: _Candidate, image: str, node: Node) -> set[Node]:
    """Return the texels that are one light with `node`, itself among them."""
    layout, index = one.image(image).layout, one.image(image).index
    same = np.flatnonzero(index == index[layout.number_of[node]])
    return {layout.nodes[k] for k in same.tolist()}


def _finer_basis(scene: Scene, before: Basis, job: Job, listen: Listener) -> Basis:
    """Return the basis of a scene with finer texels, of which others are taken from `before`."""
    basis = moved_basis(scene, before, job.settings, listen)
    return basis if before.former is None else replace(basis, former=before.former)


def _brightest(one: _Candidate, image: str, passed: set[Node]) -> Node | None:
    """Return the texel that does most beyond what it would as bright as its neighbours.

    passed: texels that are left as they are. None if there is no other.
    """
    its_image = one.image(image)
    layout, weights = its_image.layout, one.solution.weights
    excess = _excess(its_image, weights)
    power = luminance(one.solution.basis.power[its_image.index])
    strengths = excess * np.sqrt(power)
    for k in np.argsort(-strengths, kind="stable").tolist():
        node = layout.nodes[k]
        if strengths[k] <= 0:
            break
        if node[0] < MAX_LEVEL and node not in passed:
            return node
    return None


def _excess(image: LightImage, weights: Doubles) -> Doubles:
    """Return how much brighter each texel is than the image around it, (nodes,)."""
    layout = image.layout
    bright = luminance(image.radiances(weights))
    rows, columns = bright.shape
    excess = np.zeros(len(layout.nodes))
    for k, (level, column, row) in enumerate(layout.nodes):
        step = RATIO ** (layout.level - level)
        x, y = step * column + (step - 1) // 2, step * row
        around = [bright[y, (x - step) % columns], bright[y, (x + step) % columns]]
        around += [bright[z, x] for z in (y - step, y + step) if 0 <= z < rows]
        excess[k] = max(0.0, bright[y, x] - float(np.mean(around)))
    return excess


def _text(best: _Candidate, started: _Candidate, image: str) -> Sentence:
    """Return what was found, for the user."""
    nodes: Sequence[Node] = best.image(image).layout.nodes
    finer = [node for node in nodes if node[0]]
    if not finer:
        return Sentence(
            f"no sun: finer texels of {image} remove less than a twentieth of the error"
        )
    part = ("third", "ninth", "27th")[max(x[0] for x in finer) - 1]
    layout = best.image(image).layout
    return Sentence(
        f"{len(finer)} finer texels of {image}, down to a {part} of the width, leave "
        f"{100 * best.missed / started.missed:.0f} % of the error; to paint with them or solve "
        "again: ",
        Hint("split", {image: layout.text}),
    )
