"""Refines the answer with renders of the solved scene."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

from lightpaint.basis.basis import Basis
from lightpaint.images.estimate import Estimate
from lightpaint.lighting.analysis.noise.refinement import refine
from lightpaint.lighting.joined_views import joint_estimate
from lightpaint.lighting.solution import Solution
from lightpaint.progress import Progress, silent
from lightpaint.relit.relight import relight
from lightpaint.scene.scene import Scene
from lightpaint.scene.scene_render import Stream, pass_seed, render, view_seed


def refine_by_rendering(
    views: Sequence[tuple[Scene, Basis]],
    solution: Solution,
    *,
    rounds: int,
    seed: int = 0,
    progress: Progress = silent,
) -> Solution:
    """Render the scene under the solution's lighting and take a Newton step, `rounds` times.

    views: scene and basis of each view in the solution; each render has the film and the samples of
    that basis. Every round uses random numbers that neither the other rounds, the basis nor a
    verification uses.
    """
    for k in range(rounds):
        mixed_bases = []
        for scene, basis in views:
            its_seed = pass_seed(view_seed(seed, scene.sensor), Stream.REFINEMENT, k)
            label = f"refinement {k + 1}"
            mixed_bases.append(_mixed(scene, basis, solution, its_seed, label, progress))
        solution = refine(solution, joint_estimate(mixed_bases))
    return solution


def _mixed(
    scene: Scene,
    basis: Basis,
    solution: Solution,
    seed: int,
    label: str,
    progress: Progress,
) -> Estimate:
    """Render one view of the solved scene at the size and the samples of its basis."""
    height, width = basis.size
    with tempfile.TemporaryDirectory(prefix="lightpaint-") as folder:
        relit = relight(scene, solution.lighting, Path(folder) / "relit.xml")
        return render(
            relit.reduced(f"{width}x{height}"),
            spp=max(2, basis.origin.spp),
            seed=seed,
            stream=Stream.REFINEMENT,
            label=label,
            progress=progress,
        )
