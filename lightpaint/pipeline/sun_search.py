"""Finds suns: splits the texels of a sky again where the paintings gain most by it.

A texel that is much brighter than its neighbours may stand for a smaller source, whose shadows are
sharper. It gets finer texels in its place, whose pictures are rendered together with those of the
texels around it, and everything is solved again; what gains nothing is left as it was.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Doubles
from lightpaint.basis.basis import Basis
from lightpaint.basis.light_images import LightImage, light_images
from lightpaint.colour import luminance
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solve import solution_of
from lightpaint.pipeline.job.job import Job
from lightpaint.pipeline.job.job_checks import sky_for_sun, wanted_sun
from lightpaint.pipeline.job_bases import problem_of, view_listener, without_noise
from lightpaint.pipeline.placed_lights import moved_basis, on_film_of
from lightpaint.progress import Listener
from lightpaint.scene.lights.texels.texel_layout import CHILDREN, MAX_LEVEL, RATIO, Node
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_reader import with_layout
from lightpaint.sentences import Hint, Sentence

#: Share of the error that splitting a texel must remove, and how much more for each unknown that it
#: adds, relative to the number of pixels.
LEAST_GAIN, NOISE_FIT = 0.05, 3
#: How many texels are tried in vain before the search ends.
MAX_VAIN = 2


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
