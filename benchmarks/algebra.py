"""What the algebra costs: normal equations, solves and strokes, without a renderer.

    python benchmarks/algebra.py [--repeats N] [--csv FILE]

Five tables: forming M and b against a plain float64 BLAS product of the same shape; the solve,
M given, of one channel against scipy's nnls on the Cholesky factor of M, and of three; the solve
under constraints; a stroke of a 64-pixel brush, update and solve of three channels; and many looks
from one basis.
"""

import argparse
import time
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from rows import add_csv, write_rows
from scipy.optimize import nnls

from lightpaint.basis.light_basis import Basis, Origin
from lightpaint.basis.lights import BasisLight
from lightpaint.basis.planes import BLOCK_PIXELS, MemoryPlanes
from lightpaint.lighting.algebra.optimum import minimise
from lightpaint.lighting.constraints.constraint_table import Constraints
from lightpaint.lighting.fit import Fit, resolve_for_targets
from lightpaint.lighting.live.live_solver import LiveSolver
from lightpaint.lighting.live.live_view import LiveView
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.unknowns.reduced_problem import solve_reduced
from lightpaint.lighting.unknowns.reduction import reduce_to
from lightpaint.target.painted_target import Target
from lightpaint.threads import one_thread

HEIGHT, WIDTH, BRUSH = 360, 640, 64

#: Least times by the number of lights, then by column.
Rows = defaultdict[int, dict[str, str]]

#: What is asked of the lights, as `Constraints.of` takes it.
ASKED: dict[str, dict[str, Any]] = {
    "nothing": {},
    "a lock": {"light": {"light 0": {"lock": True}}},
    "a limit": {"light": {"light 1": {"limits": {"max": "40%"}}}},
    "limits on all": {"light": {"*": {"limits": {"max": "40%"}}}},
    "kelvin on all": {"light": {"*": {"kelvin": [2700, 6500]}}},
    "two ties": {"tie": [["light 1", "light 2"], ["light 4", "light 5"]]},
    "prefer": {"prefer_current": 0.01},
}


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=9)
    add_csv(parser)
    options = parser.parse_args()
    repeats, rows = options.repeats, Rows(dict)
    gram(repeats, rows)
    solves(repeats, rows)
    constrained(repeats, rows)
    strokes(4 * repeats, rows)
    write_rows(options.csv, [{"lights": n, **row} for n, row in sorted(rows.items())])
    looks()


def gram(repeats: int, rows: Rows) -> None:
    """M, b and ‖Ψ‖² of a whole picture, against products of the same blocks in float64."""
    print(f"normal equations, {WIDTH}x{HEIGHT}, three channels, ms (least of the runs)")
    print(f"{'lights':>8s}{'ours':>10s}{'product':>10s}{'ratio':>8s}")
    for n in (12, 64):
        images, target, importance = picture(n)
        plain = np.random.default_rng(0).random((n + 1, BLOCK_PIXELS))
        blocks = 3 * HEIGHT * WIDTH / BLOCK_PIXELS

        def product(plain: Any = plain, blocks: float = blocks) -> None:
            with one_thread():
                for _ in range(int(blocks)):
                    plain @ plain.T

        sums = partial(MemoryPlanes(images).sums, importance, target)
        ours_s = timed(sums, repeats)
        base = timed(product, repeats)
        rows[n][f"normal equations, {WIDTH}x{HEIGHT}, ms"] = least_ms(ours_s)
        print(
            f"{n:8d}{1e3 * min(ours_s):10.1f}{1e3 * min(base):10.1f}{min(base) / min(ours_s):8.2f}"
        )


def solves(repeats: int, rows: Rows) -> None:
    """M given, from all lights at 1."""
    print("\nsolve, M given, ms (least / median of the runs)")
    print(
        f"{'lights':>8s}{'one channel':>18s}{'nnls':>18s}{'off':>6s}{'KKT':>10s}"
        f"{'three channels':>18s}{'from another':>18s}"
    )
    for n in (12, 64, 256, 1000):
        rng = np.random.default_rng(n)
        A = rng.random((2 * n + 10, n)) ** 3
        y = A @ (rng.random((n, 3)) * (rng.random((n, 3)) < 0.6)) + 0.3 * rng.normal(
            size=(len(A), 3)
        )
        M, b = A.T @ A, np.ascontiguousarray((A.T @ y).T)
        other = np.ascontiguousarray((A.T @ (y * rng.normal(1, 0.02, y.shape))).T)
        all_M = np.stack([M, M, M])

        def by_scipy(M: Any = M, b: Any = b[0]) -> None:
            L = np.linalg.cholesky(M)
            nnls(L.T, np.linalg.solve(L, b), maxiter=100 * len(b))

        one = partial(minimise, M, b[0], start=np.ones(n))
        free_reduction = reduce_to(Constraints(), lights(n))
        three = partial(
            solve_reduced, NormalEquations(all_M, b, np.ones(3)), free_reduction, np.ones((n, 3))
        )
        second = partial(
            solve_reduced,
            NormalEquations(all_M, other, np.ones(3)),
            free_reduction,
            three().weights,
        )
        optimum, scipy_s = one(), timed(by_scipy, min(repeats, 3))
        three_s, second_s = timed(three, repeats), timed(second, repeats)
        print(
            f"{n:8d}{pair(timed(one, repeats)):>18s}{pair(scipy_s):>18s}"
            f"{np.count_nonzero(optimum.x == 0):6d}{optimum.kkt_residual:10.0e}"
            f"{pair(three_s):>18s}{pair(second_s):>18s}"
        )
        rows[n]["solve, ms"] = least_ms(three_s)
        rows[n]["from another answer, ms"] = least_ms(second_s)
        rows[n]["nnls, ms"] = least_ms(scipy_s)


def constrained(repeats: int, rows: Rows) -> None:
    """What it costs to ask something of the lights: three channels, M given, from the present."""
    print("\nsolve with something asked, M given, ms (least / median of the runs)")
    print(f"{'lights':>8s}" + "".join(f"{name:>18s}" for name in ASKED))
    for n in (12, 64):
        basis, target = scene(n)
        cells = []
        for name, constraints in ASKED.items():
            problem = Problem.of(basis, target, constraints=Constraints.of(**constraints))
            equations, start = problem.with_pull(problem.equations), problem.start
            solve = partial(solve_reduced, equations, problem.reduction, start)
            solve_s = timed(solve, 4 * repeats)
            cells.append(f"{pair(solve_s):>18s}")
            rows[n][f"{name}, ms"] = least_ms(solve_s)
        print(f"{n:8d}{''.join(cells)}")


def strokes(count: int, rows: Rows) -> None:
    """Print what a square of new colour, or of new importance, costs, and the next answer."""
    print(f"\nstroke of {BRUSH}x{BRUSH} pixels in {WIDTH}x{HEIGHT}, ms (least / median)")
    print(f"{'lights':>8s}{'painted':>12s}{'update':>16s}{'solve':>16s}{'together':>16s}")
    for n in (12, 64):
        basis, target = scene(n)
        image, importance = target.image.copy(), target.importance.copy()
        view = LiveView(basis, image, importance)
        live = LiveSolver(
            [view], fit=resolve_for_targets(Fit(), [target]), constraints=Constraints()
        )
        rng = np.random.default_rng(1)
        # The first answer builds the tiles.
        weights = live.answer(basis.current_weights)
        for kind in ("image", "importance"):
            updates, solves = [], []
            for _ in range(count):
                top, left = rng.integers(0, HEIGHT - BRUSH), rng.integers(0, WIDTH - BRUSH)
                region = slice(top, top + BRUSH), slice(left, left + BRUSH)
                start = time.perf_counter()
                if kind == "image":
                    image[region] = rng.random(3)
                else:
                    importance[region] = rng.random()
                view.update(region, with_importance=kind == "importance")
                middle = time.perf_counter()
                weights = live.answer(weights)
                updates.append(middle - start)
                solves.append(time.perf_counter() - middle)
            together = [sum(parts) for parts in zip(updates, solves, strict=True)]
            times = "".join(f"{pair(each):>16s}" for each in (updates, solves, together))
            print(f"{n:8d}{kind:>12s}{times}")
            rows[n][f"stroke of {kind}, {BRUSH}x{BRUSH}, ms"] = least_ms(together)


def looks() -> None:
    """Other targets under the same importance: M stays, b is new."""
    print("\nlooks a second from one basis, M given (three channels each)")
    for n in (12, 64):
        images, target, importance = picture(n)
        M, b, norm2 = MemoryPlanes(images).sums(importance, target)
        rng, free_reduction = np.random.default_rng(2), reduce_to(Constraints(), lights(n))
        weights, count = np.ones((n, 3)), 0
        start = time.perf_counter()
        while time.perf_counter() - start < 2:
            other = b * rng.uniform(0.5, 1.5, b.shape)
            weights = solve_reduced(
                NormalEquations(M, other, norm2), free_reduction, weights
            ).weights
            count += 1
        print(f"{n:8d}{count / (time.perf_counter() - start):10.0f}")


def lights(n: int) -> tuple[BasisLight, ...]:
    """Lights of some current emission."""
    current = 0.2 + np.random.default_rng(n).random((n, 3))
    return tuple(
        BasisLight(f"light {k}", "area", "radiance", "W/(m² sr)", tuple(map(float, rgb)))
        for k, rgb in enumerate(current)
    )


def scene(n: int) -> tuple[Basis, Target]:
    """A basis of random pictures, without noise, and something painted over all of it."""
    images, image, importance = picture(n)
    origin = Origin("random", "0f" * 8, "sensor", 0, "made up", (1, 1), (1, 1))
    emitter_mask = np.zeros((HEIGHT, WIDTH), bool)
    # Its noise is asked for by nothing here.
    basis = Basis(
        lights(n), images, np.broadcast_to(np.float32(0), images.shape), emitter_mask, origin
    )
    return basis, Target("random", image, importance, everything=False)


def picture(n: int) -> tuple[Any, Any, Any]:
    """Basis images, a target and an importance of 1."""
    rng = np.random.default_rng(n)
    images = rng.random((n, HEIGHT, WIDTH, 3), dtype=np.float32) ** 3
    target = rng.random((HEIGHT, WIDTH, 3), dtype=np.float32)
    return images, target, np.ones((HEIGHT, WIDTH), np.float32)


def timed(work: Callable[[], object], repeats: int) -> list[float]:
    """Seconds of each run, after one that is not counted."""
    work()
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return seconds


def least_ms(seconds: list[float]) -> str:
    """Least, in milliseconds."""
    return f"{1e3 * min(seconds):.2f}"


def pair(seconds: list[float]) -> str:
    """Least and median, in milliseconds."""
    return f"{1e3 * min(seconds):.2f} / {1e3 * float(np.median(seconds)):.2f}"


if __name__ == "__main__":
    main()
