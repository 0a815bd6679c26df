"""How long an answer takes: lightpaint against Mitsuba's own Adam on the same target.

    python benchmarks/solve.py [SCENE TARGET SECOND_TARGET] [--spp N] [--limit S] [-D key=value]

First look: nothing is there yet; lightpaint renders its basis and solves. Second look: the
same scene, a new painting; the basis is there. Adam optimises the same emissions against
the same weighted squares through Mitsuba's `prb` integrator, starting from the current look,
and is given the best of several step sizes. Both are judged by one reference: the objective
under a basis of many more samples that neither has seen. Adam's time is the time of the step at
which it first reaches lightpaint's objective. Kernels are compiled before any clock starts.
"""

import argparse
import time
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint import Basis, Target, load_scene, read_target, render_basis, solve
from lightpaint.lighting.loss.painting import target_squares
from lightpaint.lighting.problem import Problem
from lightpaint.scene.mitsuba_scene import Scene

ROOT = Path(__file__).parent.parent
CORNELL = ROOT / "scenes" / "cornell" / "scene.xml"
WARM = ROOT / "targets" / "cornell" / "warm.exr"
COOL = ROOT / "targets" / "cornell" / "cool.exr"
STEP_SIZES = (0.02, 0.05, 0.1)
ADAM_SPP = 8
Doubles = npt.NDArray[np.float64]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("files", nargs="*", default=[CORNELL, WARM, COOL])
    parser.add_argument("--spp", type=int, default=128)
    parser.add_argument("-D", dest="parameters", action="append", default=[], metavar="key=value")
    parser.add_argument("--reference-spp", type=int, default=4096)
    parser.add_argument("--limit", type=float, default=60, help="seconds for each run of Adam")
    options = parser.parse_args()
    scene_path, *target_paths = options.files
    scene = load_scene(scene_path, parameters=dict(p.split("=", 1) for p in options.parameters))
    targets = [read_target(path).fitted_to(scene.size, resize=True) for path in target_paths]

    render_basis(scene, spp=2)  # compiles
    reference = render_basis(scene, spp=options.reference_spp, seed=99)
    start = time.perf_counter()
    basis = render_basis(scene, spp=options.spp)
    basis_s = time.perf_counter() - start
    print(
        f"{scene_path}: {len(scene.lights)} lights, basis of {options.spp} spp: {basis_s:.2f} s\n"
    )
    print("objective: of the reference, relative to the squared norm of the target")
    header = ("target", "look", "lightpaint s", "objective", "Adam s", "objective", "ratio")
    print("{:10s} {:7s} {:>12s} {:>10s} {:>9s} {:>10s} {:>9s}".format(*header))
    for number, target in enumerate(targets):
        judge = Judge(reference, target)
        solve_s, weights = timed_solve(basis, target)
        own_loss = judge(weights)
        ours_s = solve_s + (basis_s if number == 0 else 0)
        adam_s, adam_loss = adam(scene, basis, target, judge, goal=own_loss, limit_s=options.limit)
        bound = "" if adam_loss <= own_loss else ">"
        look = "first" if number == 0 else "next"
        time_s, ratio = f"{bound}{adam_s:.2f}", f"{bound}{adam_s / ours_s:.0f}x"
        print(
            f"{target.name:10s} {look:7s} {ours_s:12.4f} {own_loss:10.5f} "
            f"{time_s:>9s} {adam_loss:10.5f} {ratio:>9s}",
            flush=True,
        )


class Judge:
    """The objective of a set of weights under a basis that nobody solved with."""

    def __init__(self, reference: Basis, target: Target) -> None:
        self.equations = Problem.of(reference, target).equations

    def __call__(self, weights: Doubles) -> float:
        """Over all channels, relative to ‖Ψ‖²."""
        return float(self.equations.objective(weights).sum() / self.equations.target_norm2.sum())


def timed_solve(basis: Basis, target: Target) -> tuple[float, Doubles]:
    """(seconds, weights): the median of nine runs, normal equations included."""
    seconds = []
    for _ in range(9):
        start = time.perf_counter()
        solution = solve(basis, target)
        seconds.append(time.perf_counter() - start)
    return float(np.median(seconds)), solution.lighting.weights_for(basis)


def adam(
    scene: Scene, basis: Basis, target: Target, judge: Judge, *, goal: float, limit_s: float
) -> tuple[float, float]:
    """(seconds, objective) at the first step that reaches `goal`, or at the best before the
    limit, of the best step size."""
    results = [
        descend(scene, basis, target, judge, goal=goal, limit_s=limit_s, step_size=size)
        for size in STEP_SIZES
    ]
    successes = [r for r in results if r[1] <= goal]
    return min(successes) if successes else (limit_s, min(objective for _, objective in results))


def descend(
    scene: Scene,
    basis: Basis,
    target: Target,
    judge: Judge,
    *,
    goal: float,
    limit_s: float,
    step_size: float,
) -> tuple[float, float]:
    """One run of Adam over emissions relative to the current ones, clipped at 0."""
    import drjit as dr
    import mitsuba as mi

    squares = target_squares(basis, target)
    loaded = scene.load()
    parameters = mi.traverse(loaded)
    keys = {light.name: key_of(parameters, loaded, light.name) for light in scene.lights}
    current = {x.name: mi.Color3f(*(max(v, 1e-3) for v in x.emission)) for x in scene.lights}
    integrator = mi.load_dict({"type": "prb", "max_depth": scene.integrator.max_depth})
    psi, weight = mi.TensorXf(squares.image), mi.TensorXf(squares.weight + 0 * squares.image)
    optimizer = mi.ad.Adam(lr=step_size)
    for name in keys:
        optimizer[name] = mi.Color3f(1)

    spent_s, best, step = 0.0, (limit_s, np.inf), 0
    while spent_s < limit_s:
        start = time.perf_counter()
        for name, key in keys.items():
            optimizer[name] = dr.maximum(optimizer[name], 0)
            parameters[key] = optimizer[name] * current[name]
        parameters.update()
        rendered = mi.render(
            loaded,
            parameters,
            integrator=integrator,
            spp=ADAM_SPP,
            seed=step,
            sensor=scene.camera(loaded),
        )
        dr.backward(dr.sum(weight * dr.square(rendered - psi), axis=None))
        optimizer.step()
        weights = np.stack(
            [np.array(dr.maximum(optimizer[n], 0) * current[n]).ravel() for n in basis.names]
        )
        step += 1
        if step > 1:  # the first step compiled
            spent_s += time.perf_counter() - start
        objective = judge(weights.astype(np.float64))
        if objective < best[1]:
            best = (spent_s, objective)
        if objective <= goal:
            break
    return best


def key_of(parameters: Any, loaded: Any, name: str) -> str:
    """The key by which `mi.traverse` of the scene knows the emission of a light."""
    import mitsuba as mi

    emitter = next(e for e in loaded.emitters() if e.id() == name)
    shape = emitter.get_shape()
    prefix = f"{shape.id()}.emitter" if shape is not None else name
    keys: list[str] = [
        f"{prefix}.{key}"
        for key in mi.traverse(emitter).keys()  # noqa: SIM118 (not a dict)
        if key.endswith(("radiance.value", "intensity.value", "irradiance.value"))
    ]
    return keys[0]


if __name__ == "__main__":
    main()
