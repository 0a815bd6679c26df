"""How long answers take, under the brush and exact ones, beside the times of an earlier version.

    python benchmarks/answers.py --before CHECKOUT [--scene gallery] [--resolution 640x360]
                                 [--spp 32] [--repeats 2]

Paintings over the look of a scene, in 8 bits: *moon* and *warm* change all of it, *blob* a soft
spot, *up* its right part. *Waves* of 0.8 to 3 stops ask for what no lamp can do. One basis serves
both versions, each in a process of its own, and they take turns with each painting.

Printed are seconds of the processor, the least of `--repeats`: of `solve`, and of one answer under
a brush that moves over the painting, in ms, the mean of a stroke without its first answer.
"""

import argparse
import inspect
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from rows import add_csv, write_rows

ROOT = Path(__file__).parent.parent

#: Heads of the columns.
HEAD = f"{'':12s}{'solve, s: before':>18s}{'now':>7s}{'brush, ms: before':>27s}{'now':>7s}"

#: Moves of the brush in a stroke, and its radius and strength.
MOVES, RADIUS, STRENGTH = 40, 0.06, 0.6


def main() -> None:
    """Print a row for each painting, and the sums."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--before", type=Path, required=True, metavar="CHECKOUT")
    parser.add_argument("--scene", default="gallery")
    parser.add_argument("--resolution", default="640x360")
    parser.add_argument("--spp", type=int, default=32)
    parser.add_argument("--repeats", type=int, default=2)
    parser.add_argument("--serve", metavar="BASIS", help=argparse.SUPPRESS)
    add_csv(parser)
    options = parser.parse_args()
    if options.serve:
        serve(options.serve)
        return
    import lightpaint as lp
    from lightpaint.basis.cache.cached_render import obtain_basis

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.basis.exr"
        scene = lp.load_scene(ROOT / "scenes" / options.scene / "scene.xml")
        lp.write_basis(path, obtain_basis(scene.reduced(options.resolution), spp=options.spp))
        versions = [Version(x, path) for x in (options.before.absolute(), ROOT)]
        print(HEAD)
        rows, table = [], []
        for name in versions[0].names:
            runs = [[x.measure(name) for x in versions] for _ in range(options.repeats)]
            rows.append(np.min(runs, axis=0))
            table.append(print_row(name, rows[-1]))
        table.append(print_row("all", np.sum(rows, axis=0)))
        write_rows(options.csv, [{"scene": options.scene, **row} for row in table])


def print_row(name: str, figures: np.ndarray) -> dict[str, str]:
    """Print the figures (2, 2) of both versions and their ratios, and return them by column."""
    (exact, live), (exact_now, live_now) = figures
    row = {
        "painting": name,
        "solve before, s": f"{exact:.2f}",
        "solve now, s": f"{exact_now:.2f}",
        "ratio": f"{exact_now / exact:.2f}",
        "brush before, ms": f"{live:.2f}",
        "brush now, ms": f"{live_now:.2f}",
        "ratio of the brush": f"{live_now / live:.2f}",
    }
    print("{:12s}{:>18s}{:>7s}{:>7s}{:>20s}{:>7s}{:>7s}".format(*row.values()), flush=True)
    return row


class Version:
    """A process of a checkout that measures paintings by name."""

    def __init__(self, checkout: Path, basis: Path) -> None:
        self._process = subprocess.Popen(
            [sys.executable, __file__, "--before", ".", "--serve", str(basis)],
            env={**os.environ, "PYTHONPATH": str(checkout)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.names: list[str] = self._reply()

    def measure(self, name: str) -> list[float]:
        """Return the seconds of a solve, and the ms of an answer under the brush."""
        assert self._process.stdin is not None
        print(name, file=self._process.stdin, flush=True)
        return list(self._reply())

    def _reply(self) -> Any:
        assert self._process.stdout is not None
        return json.loads(self._process.stdout.readline())


def serve(path: str) -> None:
    """Measure the paintings named on standard input, with the checkout that is imported."""
    import lightpaint as lp

    basis = lp.read_basis(path)
    painted = dict(paintings(basis))
    exact_s(basis, *painted["blob"])  # what the first solve alone has to load
    print(json.dumps(list(painted)), flush=True)
    for line in sys.stdin:
        image, importance = painted[line.strip()]
        print(
            json.dumps([exact_s(basis, image, importance), live_ms(basis, image, importance)]),
            flush=True,
        )


def paintings(basis: Any) -> Iterator[tuple[str, tuple[np.ndarray, np.ndarray]]]:
    """Yield names, and images (h, w, 3) with importances (h, w)."""
    look = np.asarray(basis.mix(basis.current_weights))
    height, width = basis.size
    y, x = np.mgrid[:height, :width] / width
    everywhere = np.ones((height, width))
    spot = np.exp(-((x - 0.35) ** 2 + (y - 0.3) ** 2) / 0.012)
    blue, orange = np.array([0.7, 0.95, 1.6]), np.array([1.6, 0.95, 0.5])
    changed = {
        "moon": (look * 0.29 * blue, everywhere),
        "warm": (look * 1.15 * orange, everywhere),
        "blob": (look * (1 + spot[..., None] * (2.8 * orange - 1)), spot * (spot > 0.02)),
        "up": (look * 2, np.clip((x - 0.55) / 0.1, 0, 1)),
    }
    for stops in (0.8, 1.6, 3):
        for waves in (6, 20):
            wave = np.sin(waves * (x + 0.6 * y))[..., None]
            changed[f"wave {stops:g}/{waves}"] = look * 2 ** (stops * wave), everywhere
    for name, (image, importance) in changed.items():
        yield name, (image.astype(np.float32), importance.astype(np.float32))


def view_of(basis: Any) -> Any:
    """Return the view that is painted through."""
    import lightpaint as lp
    from lightpaint.colour.display.exposure import choose_exposure

    look = np.asarray(basis.mix(basis.current_weights))
    return lp.ViewTransform("srgb", choose_exposure(look, basis.emitters_seen))


def exact_s(basis: Any, image: np.ndarray, importance: np.ndarray) -> float:
    """Return the seconds of a solve."""
    import lightpaint as lp

    transform = view_of(basis)
    codes = np.round(255 * transform.encode(image)) / 255
    target = lp.Target(
        "painting",
        transform.decode(codes).astype(np.float32),
        importance,
        everything=False,
        at_least=codes >= 1,
        transform=transform,
        through_view=True,
        over_look=True,
    )
    begin = time.process_time()
    lp.solve(basis, target)
    return time.process_time() - begin


def live_ms(basis: Any, image: np.ndarray, importance: np.ndarray) -> float:
    """Return the mean ms of the answers to a stroke that brings out the painting."""
    import lightpaint as lp
    from lightpaint.lighting.fit import resolve_fit
    from lightpaint.lighting.live.live_view import LiveView

    try:
        from lightpaint.lighting.live.live_solver import LiveSolver
    except ImportError:  # an earlier version
        from lightpaint.lighting.live.live import (  # type: ignore[import-not-found,no-redef]
            LiveSolver,
        )

    transform, (height, width) = view_of(basis), basis.size
    canvas = np.asarray(basis.mix(basis.current_weights), np.float32).copy()
    importances = np.zeros(basis.size, np.float32)
    view = LiveView(basis, canvas, importances)
    fit = resolve_fit(lp.Fit(), over_look=True, through_view=True, display=lambda: transform)
    options = {"is_sketch": True} if takes(LiveSolver.__init__, "is_sketch") else {}
    solver = LiveSolver([view], fit=fit, constraints=lp.Constraints(), **options)
    solver.prepare()
    going_on = {"while_painting": True} if takes(solver.answer, "while_painting") else {}
    y, x = np.mgrid[:height, :width] / width
    weights, times = basis.current_weights, []
    for k in range(MOVES):
        left, top = 0.15 + 0.7 * k / MOVES, 0.28 + 0.1 * np.sin(k / 6)
        brush = np.clip(1 - ((x - left) ** 2 + (y - top) ** 2) / RADIUS**2, 0, 1) * STRENGTH
        rows, columns = (np.flatnonzero(brush.any(axis=axis)) for axis in (1, 0))
        region = slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1)
        cover = brush[region].astype(np.float32)
        canvas[region] += (image[region] - canvas[region]) * cover[..., None]
        importances[region] = np.maximum(importances[region], cover * importance[region])
        begin = time.process_time()
        view.update(region)
        weights = solver.answer(weights, **going_on)
        times.append(1e3 * (time.process_time() - begin))
    return float(np.mean(times[1:]))


def takes(function: Any, name: str) -> bool:
    """Return whether a function has an argument, which an earlier version may lack."""
    return name in inspect.signature(function).parameters


if __name__ == "__main__":
    main()
