"""Compare samples where a painting needs them with as many in all pixels.

    python benchmarks/top_up.py [--paintings evening morning] [--error 0.03] [--seeds 6]

For each seed the gallery, at a quarter of its size, is solved twice: by a pilot and further samples
where they are needed, until the largest error of a light is told to be as small as asked for, and
by as many samples in all pixels. Errors are errors of the lights against a long render, in
luminance summed over the picture: the mean over lights by their share of it, and the error of the
worst light over what it does or, if that is more, 5 % of the picture's light. Times are seconds of
the processor for render, solves and error bars, kernels compiled. `gain` is how many times less
squared mean error the samples where they are needed have at equal time; `bias` is the largest mean
error of a light over the seeds, in standard errors of that mean; `held`, how many of the intervals
hold.
"""

import argparse
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt
from rows import add_csv, write_rows

from lightpaint import (
    Basis,
    Job,
    Scene,
    Settings,
    Target,
    load_scene,
    read_basis,
    read_target,
    render_basis,
    write_basis,
)
from lightpaint.colour.color import LUMINANCE
from lightpaint.lighting.analysis.noise.uncertainty import error_bars
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solver import solution_of
from lightpaint.pipeline.job.settings import PILOT_SPP
from lightpaint.pipeline.job_bases import add_needed_samples, without_noise
from lightpaint.progress import listener, silent
from lightpaint.report.measures import LEAST_SHARE, picture_errors

REPOSITORY = Path(__file__).parent.parent

#: Seed of the long render, and size of the film.
LONG_SEED, REDUCTION = 90_000, 4

#: Characters of each column.
WIDTHS = {"spp": 8, "CPU s": 8, "mean": 11, "worst": 10, "bias": 8, "held": 8}


@dataclass
class Runs:
    """Answers of some seeds. errors: of each light, (n,), over its scale. told: their bounds."""

    mean: list[float] = field(default_factory=list)
    errors: list[npt.NDArray[np.float64]] = field(default_factory=list)
    told: list[npt.NDArray[np.float64]] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)
    spp: list[float] = field(default_factory=list)

    def row(self) -> dict[str, str]:
        """Return the figures of a line, by column."""
        errors, count = np.array(self.errors), len(self.errors)
        worst = np.sqrt(np.square(errors).mean(axis=0)).max()
        scatter = errors.std(axis=0, ddof=1) / np.sqrt(count)
        is_varying = scatter > 0  # not so for a light that is off each time
        bias = np.abs(errors.mean(axis=0)[is_varying] / scatter[is_varying]).max()
        coverage = (np.abs(errors) <= np.array(self.told)).mean()
        return {
            "spp": f"{np.mean(self.spp):.0f}",
            "CPU s": f"{np.mean(self.seconds):.1f}",
            "mean": f"{100 * np.mean(self.mean):.2f} %",
            "worst": f"{100 * worst:.1f} %",
            "bias": f"{bias:.1f}",
            "held": f"{coverage:.2f}",
        }

    @property
    def cost(self) -> float:
        """Squared mean error times seconds."""
        return float(np.mean(np.square(self.mean)) * np.mean(self.seconds))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--paintings", nargs="+", default=["evening", "morning"])
    parser.add_argument("--error", type=float, default=0.03)
    parser.add_argument("--seeds", type=int, default=6)
    parser.add_argument("--long-spp", type=int, default=1024)
    parser.add_argument("--keep", type=Path, metavar="FOLDER")
    add_csv(parser)
    options = parser.parse_args()
    rows: list[dict[str, str]] = []
    scene = load_scene(REPOSITORY / "scenes" / "gallery" / "scene.xml").reduced(f"1/{REDUCTION}")
    with tempfile.TemporaryDirectory() as folder:
        truth = long_render(scene, options.long_spp, options.keep or Path(folder))
        print(f"{'':34s}" + "".join(f"{name:>{width}s}" for name, width in WIDTHS.items()))
        for name in options.paintings:
            rows += compare(name, scene, truth, options, Path(folder))
            write_rows(options.csv, rows)


def long_render(scene: Scene, spp: int, keep: Path) -> Basis:
    """Return the basis that errors are measured against, kept for the next run."""
    path = keep / f"gallery_{REDUCTION}_{spp}.basis.exr"
    if not path.is_file():
        keep.mkdir(parents=True, exist_ok=True)
        write_basis(path, render_basis(scene, spp=spp, seed=LONG_SEED))
    return read_basis(path)


def compare(
    name: str, scene: Scene, truth: Basis, options: argparse.Namespace, folder: Path
) -> list[dict[str, str]]:
    """Measure one painting, and return a row for each way to spread samples."""
    target = painting(name)
    best = without_noise(_job(scene, target, options, 0, folder), _solution(truth, target))
    rest = error_bars(best)
    assert rest is not None
    largest_error = 100 * float(picture_errors(truth, rest).max())
    light = (truth.totals * best.weights) @ LUMINANCE
    scale = np.maximum(light, LEAST_SHARE * light.sum())
    uneven, everywhere = Runs(), Runs()
    for seed in range(1, options.seeds + 1):
        job = _job(scene, target, options, seed, folder)

        def top_up(job: Job = job, seed: int = seed) -> Basis:
            pilot = render_basis(scene, spp=PILOT_SPP, seed=seed)
            return add_needed_samples(job, [pilot], listener(silent))[0]

        def spread(seed: int = seed) -> Basis:
            return render_basis(scene, spp=round(uneven.spp[-1]), seed=seed)

        for runs, make in ((uneven, top_up), (everywhere, spread)):
            begin_s = time.process_time()
            basis = make()
            solution = without_noise(job, _solution(basis, target))
            bars = error_bars(solution)
            runs.seconds.append(time.process_time() - begin_s)
            assert bars is not None
            missed_light = ((solution.weights - best.weights) * truth.totals) @ LUMINANCE
            runs.mean.append(float(np.abs(missed_light).sum() / light.sum()))
            runs.errors.append(missed_light / scale)
            runs.told.append(picture_errors(basis, bars))
            runs.spp.append(basis.origin.mean_spp)
    goal = f"asked for {100 * options.error:g} %"
    print(f"{name}, {goal}; the long render knows each light to ± {largest_error:.1f} %")
    rows = []
    for samples, runs in (("where they are needed", uneven), ("in all pixels", everywhere)):
        row = runs.row()
        print(f"{'  ' + samples:34s}" + "".join(f"{row[x]:>{w}s}" for x, w in WIDTHS.items()))
        rows.append({"painting": name, "samples": samples, **row})
    print(f"  gain {everywhere.cost / uneven.cost:.1f}x", flush=True)
    return rows


def painting(name: str) -> Target:
    """Read a shipped painting at the size of the film."""
    folder = REPOSITORY / "targets" / "gallery"
    mask = folder / f"{name}.mask.exr"
    picture = read_target(folder / f"{name}.exr", mask=mask if mask.is_file() else None)
    return picture.reduced(REDUCTION)


def _job(scene: Scene, target: Target, options: argparse.Namespace, seed: int, to: Path) -> Job:
    settings = Settings(error=options.error, seed=seed, use_cache=False)
    return Job((scene,), (target,), to / "out", settings=settings)


def _solution(basis: Basis, target: Target) -> Solution:
    return solution_of(Problem.of(basis, target))


if __name__ == "__main__":
    main()
