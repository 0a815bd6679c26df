"""Rendering the scene as solved, to improve the answer by what that shows."""

import tempfile
from pathlib import Path

from lightpaint.basis.basis import Basis
from lightpaint.progress import Progress, silent
from lightpaint.relight.relight import relight
from lightpaint.scene.render import Stream, pass_seed, render
from lightpaint.scene.scene import Scene
from lightpaint.solve.refine import refine
from lightpaint.solve.solve import Solution


def refine_by_rendering(
    scene: Scene,
    basis: Basis,
    solution: Solution,
    *,
    rounds: int,
    spp: int | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> Solution:
    """`rounds` times: render `scene` under the solution's lighting and take a Newton step.

    spp: samples per pixel of each render, on the film of the basis; as many as the basis has
    by default. Every round draws random numbers of its own, which neither the basis nor a
    verification uses.
    """
    height, width = basis.size
    for k in range(rounds):
        with tempfile.TemporaryDirectory(prefix="lightpaint-") as folder:
            relit = relight(scene, solution.lighting, Path(folder) / "relit.xml")
            mixed = render(
                relit.reduced(f"{width}x{height}"),
                spp=max(2, basis.origin.spp) if spp is None else spp,
                seed=pass_seed(seed, Stream.REFINEMENT, k),
                stream=Stream.REFINEMENT,
                label=f"refinement {k + 1}",
                progress=progress,
            )
        solution = refine(basis, solution, mixed)
    return solution
