"""The answer to a shot whose lights change: a lighting for each painted frame, and their curves."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from lightpaint.arrays import as_rgb
from lightpaint.basis.basis import Basis
from lightpaint.lighting.analysis.analysis import Analysis, analyse, with_findings
from lightpaint.lighting.animated_solve import solve_frames
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.answer.lighting_keys import LightingKey
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.pipeline.job.job import Job
from lightpaint.progress import Listener


def animated_answer(
    job: Job, bases: Sequence[Basis], listen: Listener
) -> tuple[Lighting, tuple[Analysis, ...]]:
    """Return the lighting with a key for each painted frame, and the analysis of each frame."""
    problems = [
        Problem.of(basis, view.target, constraints=job.all_constraints, fit=job.fit)
        for basis, view in zip(bases, job.views, strict=True)
    ]
    solutions = solve_frames(problems, job.painted_frames)
    del problems
    sweeps = max(max(solution.certificate.sweeps) for solution in solutions)
    listen.note(f"{len(solutions)} frames solved, each in at most {sweeps} sweeps")
    analyses = tuple(analyse(solution)[0] for solution in solutions)
    lighting = with_findings(solutions[0], analyses[:1]).lighting
    # What one painting does not tell of a light, its neighbours do.
    reached = np.any([solution.reached for solution in solutions], axis=0).tolist()
    lights = tuple(
        replace(light, reached=tuple(channels))
        for light, channels in zip(lighting.lights, reached, strict=True)
    )
    pairs = zip(job.painted_frames, solutions, strict=True)
    keys = tuple(_key(frame, solution) for frame, solution in pairs)
    return replace(lighting, lights=lights, animation=keys), analyses


def _key(frame: int, solution: Solution) -> LightingKey:
    """Return the lights of a solution as a key."""
    weights = tuple(as_rgb(rgb) for rgb in solution.weights)
    return LightingKey(frame, weights, solution.problem.name)
