"""A lighting and nothing else: what is left of a look whose sums are known."""

from dataclasses import replace

import numpy as np

from lightpaint.basis.basis import Basis
from lightpaint.job import Job
from lightpaint.lighting.file import write_lighting
from lightpaint.lighting.solve import solution_of
from lightpaint.lighting.sums import Sums, problem_of_sums, sums_of
from lightpaint.relit.relight import relight, settle


def answer_by_sums(job: Job, basis: Basis) -> None:
    """Solve with a basis that is at hand, of which nothing but sums is looked at."""
    [view] = job.views
    sums = sums_of(basis, view.target, slice(None), job.fit)
    pixel = np.zeros((len(basis.lights), 1, 1, 3), np.float32)
    about = replace(
        basis,
        images=pixel,
        half_differences=pixel,
        emitters_seen=np.zeros((1, 1), bool),
        learned=None,
        features=None,
        objects=None,
    )
    finish_by_sums(job, about if view.scene is None else about.asking(view.scene.asked), sums)


def finish_by_sums(job: Job, about: Basis, sums: Sums) -> None:
    """Solve, and write the lighting, and the scene that has it. about: as of `problem_of_sums`."""
    [view] = job.views
    problem = problem_of_sums(about, view.target.name, sums, constraints=job.asked, fit=job.fit)
    lighting = solution_of(problem).lighting
    lighting = replace(lighting, cd_per_unit=job.settings.cd_per_unit)
    with job.results.filled() as folder:
        write_lighting(folder / "lighting.json", lighting)
        if view.scene is not None:
            relight(view.scene, lighting, folder / "relit.xml")
            settle(view.scene, lighting, folder / "relit.xml", job.folder / "relit.xml")
