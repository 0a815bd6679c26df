"""The looks that a search for places works on: their views, small films, and goals on these."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from typing import Any

import numpy as np

from lightpaint import lighting
from lightpaint.arrays import Floats
from lightpaint.basis import Basis, BasisLight
from lightpaint.errors import SceneError
from lightpaint.images import block_mean, whole_factor
from lightpaint.scene import Scene, reduction_to

#: Number of pixels of the small films, on which all places are compared, and of the larger films
#: for the last steps; of all views together, if possible.
PIXELS, FINE_PIXELS = 2**12, 2**14


def check_views(
    scenes: Scene | Sequence[Scene], bases: Basis | Sequence[Basis]
) -> list[tuple[Scene, Basis]]:
    """Return the checked views. Raises SceneError unless they are of one scene."""
    all_scenes = [scenes] if isinstance(scenes, Scene) else list(scenes)
    all_bases = [bases] if isinstance(bases, Basis) else list(bases)
    if not all_scenes or len(all_scenes) != len(all_bases):
        raise SceneError(
            f"{len(all_scenes)} scenes and {len(all_bases)} bases: give one of each for every view"
        )
    first = all_scenes[0]
    for other in all_scenes[1:]:
        if (other.path, other.parameters) != (first.path, first.parameters):
            raise SceneError(
                f"{first.path} and {other.path} are two scenes: views differ in the sensor alone"
            )
    return list(zip(all_scenes, all_bases, strict=True))


def check_looks(
    solution: lighting.Solution | Sequence[lighting.Solution], bases: Sequence[Basis]
) -> list[tuple[lighting.Solution, list[int]]]:
    """Return each solution, and the places of its views among `bases`.

    Raises SceneError for a look of another view, and without any look.
    """
    if isinstance(solution, lighting.Solution):
        return [(solution, list(range(len(bases))))]
    known = [(basis.origin.sensor, basis.size) for basis in bases]
    looks = []
    for its in solution:
        views = [(basis.origin.sensor, basis.size) for basis in its.problem.views.bases]
        if missing := [sensor for sensor, size in views if (sensor, size) not in known]:
            raise SceneError(
                f"a look is through the sensor {missing[0]!r}, but no basis of its size is: give "
                "the bases of all views"
            )
        looks.append((its, [known.index(view) for view in views]))
    if not looks:
        raise SceneError("no look to place lights for: give a solution")
    return looks


def films_of(views: Sequence[tuple[Scene, Basis]]) -> tuple[list[Scene], list[Scene]]:
    """Return the scene of each view on a small film, and on a larger one for the last steps.

    Raises SceneError if a basis is of another film than its scene.
    """
    large = [on_small_film(scene, basis, FINE_PIXELS // len(views)) for scene, basis in views]
    return [_reduced_film(scene, PIXELS // len(views)) for scene in large], large


def on_small_film(scene: Scene, basis: Basis, pixels: int) -> Scene:
    """Return `scene` on a film whose pixels are blocks of pixels of `basis`, `pixels` or fewer.

    Raises SceneError if the basis is of another film.
    """
    (height, width), (mine_h, mine_w) = scene.size, basis.size
    if whole_factor(scene.size, basis.size) is None:
        raise SceneError(
            f"the basis is {mine_w}x{mine_h}, whose pixels are not blocks of pixels of the film "
            f"of {scene.path}, {width}x{height}: make it again"
        )
    return _reduced_film(scene.reduced(f"{mine_w}x{mine_h}"), pixels)


def _reduced_film(scene: Scene, pixels: int) -> Scene:
    """Return `scene` on a film of at most `pixels`, if possible without incomplete blocks."""
    return scene.reduced(f"1/{reduction_to(scene.film, pixels)}")


@dataclass(frozen=True)
class LookGoal:
    """The goal of one look.

    goal: (p, 3); importance: (p, 3), >= 0. reduction: of its unknowns by constraints. pull: penalty
    on weights, beside the picture. noise: (p, 3), half differences of the goal as far as it is the
    current look, whose noise is the basis's own.
    """

    goal: Floats
    importance: Floats
    reduction: lighting.Reduction
    pull: lighting.NormalEquations | None
    noise: Floats

    @property
    def norm2(self) -> float:
        """‖Ψ‖²."""
        return float((self.importance.astype(np.float64) * np.square(self.goal)).sum())

    def scaled(self, factor: float) -> "LookGoal":
        """Return the goal with its loss multiplied by a factor."""
        pull = None if self.pull is None else self.pull.scaled(factor)
        return replace(self, importance=self.importance * factor, pull=pull)


def goal_of(
    solution: lighting.Solution,
    views: Sequence[int],
    sizes: Sequence[tuple[int, int]],
    new: Sequence[BasisLight],
    constraints: lighting.Constraints | None,
) -> LookGoal:
    """Return the goal of a look on the pixels of all views, with importance only in its own views.

    views: the place of each of the look's views among all. sizes: of the small films. new,
    constraints: see `fit_of`.
    """
    images: list[Floats] = [np.zeros((height * width, 3)) for height, width in sizes]
    weights: list[Floats] = [np.zeros_like(plane) for plane in images]
    noises: list[Floats] = [np.zeros_like(plane) for plane in images]
    for k, view in enumerate(views):
        problem = solution.problem.view_problem(k)
        reduced = reduced_goal(problem, problem.basis.size[0] // sizes[view][0])
        for listed, image in zip((images, weights, noises), reduced, strict=True):
            whole = np.broadcast_to(image, (*image.shape[:-1], 3))
            listed[view] = whole.reshape(-1, 3)
    all_constraints = solution.problem.constraints.and_then(
        lighting.Constraints() if constraints is None else constraints
    )
    return LookGoal(
        np.concatenate(images),
        np.concatenate(weights),
        _with_new_lights(solution.problem.local_reduction, new, all_constraints),
        pull_with_more(solution, len(new)),
        np.concatenate(noises),
    )


def balanced(goals: Sequence[LookGoal]) -> list[LookGoal]:
    """Return goals with equal weight: scaled to the mean ‖Ψ‖² of all."""
    norms = [look.norm2 for look in goals]
    mean = sum(norms) / len(norms)
    return [
        look if len(goals) == 1 or norm2 == 0 else look.scaled(mean / norm2)
        for look, norm2 in zip(goals, norms, strict=True)
    ]


def _with_new_lights(
    reduction: lighting.Reduction, new: Sequence[BasisLight], constraints: lighting.Constraints
) -> lighting.Reduction:
    """Return `reduction` with the unknowns of new lights after its own."""
    if not new:
        return reduction
    entries = [
        (pattern, table if pattern in (light.name for light in new) else _absolute(table), where)
        for pattern, table, where in constraints.lights
        if any(fnmatchcase(light.name, pattern) or light.name == pattern for light in new)
    ]
    more = lighting.reduce_to(lighting.Constraints(tuple(entries)), new)
    first = len(reduction.fixed_weights)
    knobs = [
        replace(
            knob,
            lights=tuple(k + first for k in knob.lights),
            unknowns=tuple(
                replace(x, columns=tuple((k + first, rgb) for k, rgb in x.columns))
                for x in knob.unknowns
            ),
        )
        for knob in more.knobs
    ]
    return replace(
        reduction,
        fixed_weights=np.vstack([reduction.fixed_weights, more.fixed_weights]),
        labels=(*reduction.labels, *more.labels),
        knobs=(*reduction.knobs, *knobs),
    )


def _absolute(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the constraints of a pattern that hold for a light that is not there yet.

    A lock, or a limit that is a share, refers to its present emission, which is black.
    """
    constraint = lighting.LightConstraint.of(table)
    relative = {"lock"}
    if any(level is not None and level.is_share for level in (constraint.least, constraint.most)):
        relative.add("limits")
    return {key: value for key, value in table.items() if key not in relative}


def pull_with_more(solution: lighting.Solution, count: int) -> lighting.NormalEquations | None:
    """Return the pull of the lights to their current emission, and none of `count` more."""
    if (pull := solution.problem.pull) is None:
        return None
    coupling = pull.coupling
    return lighting.NormalEquations(
        np.pad(pull.M, ((0, 0), (0, count), (0, count))),
        np.pad(pull.b, ((0, 0), (0, count))),
        pull.target_norm2,
        None if coupling is None else np.pad(coupling, ((0, count), (0, 0), (0, 0))),
    )


def reduced_goal(problem: lighting.Problem, factor: int) -> tuple[Floats, Floats, Floats]:
    """Return the goal of a view, its importance and its noise on a film of blocks of pixels.

    Goals and noise are means weighted with importance; importance is the importance of whole
    blocks.
    """
    squares = problem.squares
    importance = squares.weight.astype(np.float64)
    weight = block_mean(importance, factor)
    total = np.where(weight > 0, weight, 1)
    goal = block_mean(squares.image * importance, factor) / total
    noise = np.zeros_like(goal)
    if squares.share.any():
        shared = squares.share * problem.basis.current_noise
        noise = block_mean(shared * importance, factor) / total
    return goal, weight * factor**2, noise
