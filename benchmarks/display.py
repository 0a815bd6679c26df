"""How long a fit of what a display shows takes, beside rounds over all pixels alone.

    python benchmarks/display.py BASIS PAINTING [--views srgb agx filmic] [--repeats N]
                                 [--csv FILE]

The solve, in seconds of the processor: from a sample of the pixels and exact in the end, and by
rounds over all of them alone, one after the other in one process; how far apart both end, beside
the brightest light's picture, and by what part of the loss. The command is a process of its own,
from its start to its end, with error bars, report and pictures: the least of its runs, in seconds
of the processor and on the clock, and how many times as many of the processor as with `--literal`,
whose solve is one of squares.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from rows import add_csv, write_rows

import lightpaint as lp
from lightpaint.lighting.loss import reweighting
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solver import loss_with_pull


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("basis")
    parser.add_argument("painting")
    parser.add_argument("--views", nargs="+", default=["srgb", "filmic", "agx"])
    parser.add_argument("--repeats", type=int, default=3)
    add_csv(parser)
    options = parser.parse_args()
    rows: list[dict[str, str]] = []
    basis, target = lp.read_basis(options.basis), lp.read_target(options.painting)
    stops = target.transform.stops if target.transform is not None else 0.0
    height, width = basis.size
    print(
        f"{len(basis.names)} lights, {width}x{height}; seconds of the processor, and on the clock"
    )
    header = ("view", "sampled", "rounds", "all", "rounds", "ratio", "apart", "loss", "command", "")
    print("{:8s} {:>8s} {:>7s} {:>8s} {:>7s} {:>7s} {:>8s} {:>8s} {:>13s} {:s}".format(*header))
    literal = command(options.basis, options.painting, "--literal", repeats=options.repeats)
    print(f"{'literal':8s} {'':50s} {literal[0]:6.2f} {literal[1]:6.2f}", flush=True)
    for name in options.views:
        view = lp.ViewTransform(name, stops)
        sampled, all_pixels = [], []
        for _ in range(options.repeats):
            sampled.append(timed(basis, target, view, sample=reweighting.MIN_SAMPLE))
            all_pixels.append(timed(basis, target, view, sample=10**12))
        (a, solution), (b, expected) = (
            min(each, key=lambda x: x[0]) for each in (sampled, all_pixels)
        )
        size = np.sqrt(basis.power)
        difference = np.abs(size * (solution.weights - expected.weights)).max()
        loss = loss_with_pull(solution) / loss_with_pull(expected) - 1
        view_options = ("--view", view.name, "--exposure", str(view.stops))
        cpu_s, clock = command(
            options.basis, options.painting, *view_options, repeats=options.repeats
        )
        rounds = [x.certificate.rounds for x in (solution, expected)]
        print(
            f"{name:8s} {a:8.2f} {rounds[0]:7d} {b:8.2f} {rounds[1]:7d} {b / a:6.1f}x "
            f"{difference / (size * expected.weights).max():8.0e} {loss:+8.0e} "
            f"{cpu_s:6.2f} {clock:6.2f} {cpu_s / literal[0]:5.2f}x",
            flush=True,
        )
        row = {
            "film": f"{width}x{height}",
            "samples per pixel": str(basis.origin.spp),
            "view": name,
            "sampled, s": f"{a:.2f}",
            "all pixels, s": f"{b:.2f}",
            "weights apart": f"{difference / (size * expected.weights).max():.0e}",
            "command, s": f"{cpu_s:.2f}",
            "ratio to a literal solve": f"{cpu_s / literal[0]:.2f}",
        }
        rows.append(row)
        write_rows(options.csv, rows)


def timed(basis: lp.Basis, target: lp.Target, view: Any, *, sample: int) -> tuple[float, Solution]:
    """Seconds of the processor, and the solution."""
    usual, reweighting.MIN_SAMPLE = reweighting.MIN_SAMPLE, sample
    try:
        start = time.process_time()
        solution = lp.solve(basis, target, transform=view)
        return time.process_time() - start, solution
    finally:
        reweighting.MIN_SAMPLE = usual


def command(basis: str, painting: str, *options: str, repeats: int) -> tuple[float, float]:
    """Seconds of the processor and on the clock of the whole command, the least of its runs."""
    took = []
    for _ in range(repeats):
        with tempfile.TemporaryDirectory() as folder:
            words = ["solve", basis, painting, *options, "-o", str(Path(folder) / "out")]
            before, start = os.times(), time.perf_counter()
            run = [sys.executable, "-m", "lightpaint", *words]
            subprocess.run(run, check=True, capture_output=True)
            clock, after = time.perf_counter() - start, os.times()
        cpu_s = after.children_user + after.children_system
        took.append((cpu_s - before.children_user - before.children_system, clock))
    used_s, clock_s = zip(*took, strict=True)
    return min(used_s), min(clock_s)


if __name__ == "__main__":
    main()
