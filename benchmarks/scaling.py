"""How processor time and memory of each stage grow with lights and pixels.

    python benchmarks/scaling.py [--lights 12,64,256,1000,4000]
        [--sizes 640x360,1920x1080,3840x2160] [--spp 8] [--against PATH_OF_OLD_VENV] [--folder F]
        [--results FILE [--join]]

Draws halls (hall.py) of so many lights on so many pixels, in blocks of pixels where a basis could
not hold them all. Each stage of each hall runs in a process of its own, which prints its processor
seconds, without imports and without reading what it needs, and the largest resident memory of
that process. `command` is `lightpaint solve --literal --no-verify` as a whole. Prints a table, and
the exponents p and q of seconds ~ lights^p · pixels^q with their standard errors.

With `--against`, the version of another environment does the same on the same files, one stage
after the other, and ratios, old to new, are printed beside. Then weights must agree within their
error bars, and certificates as far as they say that answers converged. The last column says where
they are equal to the last bit. The exit code is 1 if they do not agree. A folder that is given
keeps the halls and bases, where the next call finds them.

A file of results keeps what was measured, and no stage in it is run again: so a table can be made
in pieces, `--lights 12 --results table.jsonl`, then `--lights 64 --results table.jsonl`. With
`--join`, nothing is run, and table and exponents come from the file, as far as it goes.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from hall import write_hall

#: Values that a basis is allowed to have here: half of what its file can count.
MAX_VALUES = 2**31

#: Least seconds of a stage that counts in the exponents: below, most of it is overhead.
MIN_FIT_S = 0.2

#: Bytes of a GB, as in docs/benchmarks.md, and of what the system counts memory in.
GB, MEMORY_UNIT = 1e9, 1 if sys.platform == "darwin" else 1024

#: Difference of weights that counts as equal, in standard errors, and least of these, as a share.
MAX_ERRORS, LEAST_ERROR = 1.0, 1e-6


@dataclass(frozen=True)
class Hall:
    """A hall of some lights. size: width and height of the film. block: side of its blocks."""

    lights: int
    size: tuple[int, int]
    block: int

    @classmethod
    def fitting(cls, lights: int, size: tuple[int, int]) -> "Hall":
        """Return the hall on the smallest blocks with which its basis can be held."""
        block = 1
        while 3 * lights * size[0] * size[1] / block**2 > MAX_VALUES:
            block += 1
        return cls(lights, size, block)

    @property
    def pixels(self) -> int:
        """Number of pixels of its basis."""
        return (self.size[0] // self.block) * (self.size[1] // self.block)

    @property
    def name(self) -> str:
        """Name of its files."""
        return f"{self.lights}-{self.size[0]}x{self.size[1]}"

    @property
    def text(self) -> str:
        """Lights and pixels, for the table."""
        blocks = f" in blocks of {self.block}" * (self.block > 1)
        return f"{self.lights} | {self.size[0]}x{self.size[1]}{blocks}"


class Measure:
    """The processor seconds of the part of a process that counts."""

    seconds = 0.0

    @contextmanager
    def counted(self) -> Iterator[None]:
        """Count the processor seconds within."""
        begin_s = time.process_time()
        yield
        self.seconds += time.process_time() - begin_s


def render(hall: Hall, folder: Path, spp: int, measure: Measure) -> dict[str, Any]:
    """Render the basis, and write it."""
    import lightpaint as lp

    width, height = hall.size
    path = write_hall(folder, hall.lights, width=width, height=height)
    scene = lp.load_scene(path)
    if hall.block > 1:
        scene = scene.reduced(f"1/{hall.block}")
    with measure.counted():
        basis = lp.render_basis(scene, spp=spp)
    lp.write_basis(folder / f"{hall.name}.basis.exr", basis)
    return {}


def paint(hall: Hall, folder: Path, spp: int, measure: Measure) -> dict[str, Any]:
    """Paint what other emissions of the lights make: twice, half, none and all of theirs."""
    import lightpaint as lp
    from lightpaint.images.formats.exr import write_rgb

    basis = lp.read_basis(folder / f"{hall.name}.basis.exr")
    factors = np.resize([2.0, 0.5, 0.0, 1.0], len(basis.names))
    write_rgb(folder / f"{hall.name}.exr", basis.mix(basis.current_weights * factors[:, None]))
    return {}


def read(hall: Hall, folder: Path, spp: int, measure: Measure) -> dict[str, Any]:
    """Read the basis."""
    import lightpaint as lp

    with measure.counted():
        lp.read_basis(folder / f"{hall.name}.basis.exr")
    return {}


def solve(hall: Hall, folder: Path, spp: int, measure: Measure) -> dict[str, Any]:
    """Solve; return the weights, and what the certificate says."""
    with measure.counted():
        solution = _solution(hall, folder, measure)
    certificate = solution.certificate
    return {
        "weights": solution.weights.tolist(),
        "bits": solution.weights.tobytes().hex(),
        "converged": bool(certificate.converged),
        "kkt_residual": float(max(certificate.kkt_residual)),
    }


def analyse(hall: Hall, folder: Path, spp: int, measure: Measure) -> dict[str, Any]:
    """Analyse the answer; return the standard errors of its weights."""
    import lightpaint as lp

    solution = _solution(hall, folder, Measure())
    with measure.counted():
        [analysis] = lp.analyse(solution)
    known = analysis.uncertainty
    return {"errors": None if known is None else known.standard_error.tolist()}


def command(hall: Hall, folder: Path, spp: int, measure: Measure) -> dict[str, Any]:
    """Run the whole command, with its report."""
    from lightpaint.cli import main

    basis, painting = folder / f"{hall.name}.basis.exr", folder / f"{hall.name}.exr"
    options = ["--literal", "--no-verify", "-q", "-o", str(folder / "answer"), "--force"]
    with measure.counted():
        code = main(["solve", str(basis), str(painting), *options])
    return {"code": code}


def _solution(hall: Hall, folder: Path, measure: Measure) -> Any:
    """Read and solve; the time of reading is taken off `measure`."""
    import lightpaint as lp

    begin_s = time.process_time()
    basis = lp.read_basis(folder / f"{hall.name}.basis.exr")
    target = lp.read_target(folder / f"{hall.name}.exr")
    measure.seconds -= time.process_time() - begin_s
    return lp.solve(basis, target, literal=True)


#: Stages in their order. Those of preparation are not measured.
STAGES: dict[str, Callable[[Hall, Path, int, Measure], dict[str, Any]]] = {
    x.__name__: x for x in (render, paint, read, solve, analyse, command)
}
UNMEASURED = ("paint",)


@dataclass(frozen=True)
class Result:
    """The result of a stage. answer: what it returned; failure: its last line, if it failed."""

    seconds: float
    memory: float
    answer: dict[str, Any]
    failure: str = ""


def run_stage(old_python: str | None, stage: str, hall: Hall, folder: Path, spp: int) -> Result:
    """Run a stage in a process of its own. old_python: of an old version; None for this one."""
    arguments = [stage, str(hall.lights), *map(str, hall.size), str(hall.block), str(spp)]
    environment = dict(os.environ)
    if old_python is not None:
        environment.pop("PYTHONPATH", None)  # by which this version may be found
    completed = subprocess.run(
        [old_python or sys.executable, __file__, "--stage", *arguments, "--folder", str(folder)],
        env={**environment, "LIGHTPAINT_CACHE": str(folder / "cache")},
        capture_output=True,
        text=True,
        check=False,
    )
    if completed.returncode != 0:
        return Result(np.nan, np.nan, {}, (completed.stderr.strip().splitlines() or ["killed"])[-1])
    report = json.loads(completed.stdout.splitlines()[-1])
    return Result(report["seconds"], report["memory"], report["answer"])


@dataclass
class Bench:
    """The runs of stages, and what is known of them.

    folder: of halls and bases. old_python: of an old version, None without one. file: of results,
    None without one. is_joined: whether nothing is run. known: results by the names of runs.
    """

    folder: Path
    spp: int
    old_python: str | None
    file: Path | None
    is_joined: bool
    known: dict[str, Result] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.file is not None and self.file.is_file():
            for line in self.file.read_text("utf-8").splitlines():
                row = json.loads(line)
                run = row.pop("run")
                self.known[run] = Result(**row)

    def result(self, stage: str, hall: Hall, *, is_old: bool = False) -> Result | None:
        """Return the result of a stage, which is run if it has to be; None if it is not to be."""
        run = self._run_of(stage, hall, is_old=is_old)
        if run not in self.known and not (self.is_joined or self._is_made(stage, hall)):
            python = self.old_python if is_old else None
            result = self.known[run] = run_stage(python, stage, hall, self.folder, self.spp)
            if self.file is not None and not result.failure:
                with self.file.open("a", encoding="utf-8") as lines:
                    lines.write(json.dumps({"run": run, **asdict(result)}) + "\n")
        return self.known.get(run)

    def _run_of(self, stage: str, hall: Hall, *, is_old: bool) -> str:
        version = "old" if is_old else "new"
        return f"{version} {stage} {hall.name} {hall.block} {self.spp}"

    def _is_made(self, stage: str, hall: Hall) -> bool:
        """Return whether the folder has what a stage of this version makes."""
        made = {"render": f"{hall.name}.basis.exr", "paint": f"{hall.name}.exr"}.get(stage)
        has_run = self._run_of(stage, hall, is_old=True) in self.known
        return made is not None and not has_run and (self.folder / made).is_file()


def run_here(words: list[str], folder: Path) -> None:
    """Run a stage in this process, and print what it took."""
    import lightpaint as lp

    for name in ("load_scene", "render_basis", "read_basis", "read_target", "solve", "analyse"):
        getattr(lp, name)  # imports what it needs
    stage, *numbers = words
    lights, width, height, block, spp = map(int, numbers)
    measure = Measure()
    answer = STAGES[stage](Hall(lights, (width, height), block), folder, spp, measure)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * MEMORY_UNIT
    print(json.dumps({"seconds": measure.seconds, "memory": memory, "answer": answer}))


def exponents(rows: list[tuple[Hall, float]]) -> str:
    """Return the exponents of lights and of pixels, as far as the rows determine them."""
    counted = [(hall, seconds) for hall, seconds in rows if seconds >= MIN_FIT_S]
    columns = [
        np.log([float(hall.lights) for hall, _ in counted]),
        np.log([float(hall.pixels) for hall, _ in counted]),
    ]
    varied = [k for k, column in enumerate(columns) if len(set(column)) > 1]
    terms = np.stack([np.ones(len(counted)), *(columns[k] for k in varied)], axis=1)
    if not varied or len(counted) <= terms.shape[1]:
        return "too few stages of more than a moment"
    logs = np.log([seconds for _, seconds in counted])
    values, *_ = np.linalg.lstsq(terms, logs, rcond=None)
    variance = np.square(logs - terms @ values).sum() / (len(logs) - terms.shape[1])
    errors = np.sqrt(np.diag(np.linalg.inv(terms.T @ terms)) * variance)
    names = ("lights", "pixels")
    return ", ".join(
        f"{names[k]}^{values[i]:.2f} ± {errors[i]:.2f}" for i, k in enumerate(varied, 1)
    )


def agreement(old: dict[str, Result], new: dict[str, Result]) -> tuple[str, bool]:
    """Return how the answers of two versions compare, and whether they agree."""
    before, after = old["solve"].answer, new["solve"].answer
    if not before or not after:
        return "no answer", True
    certified = after["converged"] >= before["converged"]
    if before["bits"] == after["bits"]:
        return "equal bits", certified
    errors = new["analyse"].answer.get("errors")
    known = np.zeros_like(after["weights"]) if errors is None else np.array(errors, float)
    change = np.abs(np.subtract(before["weights"], after["weights"]))
    least = LEAST_ERROR * np.max(after["weights"])
    # An error that is not known, or has no end, allows any difference.
    ratio = float(np.max(change / np.maximum(np.nan_to_num(known, nan=np.inf), least)))
    return f"within {ratio:.1e} standard errors", certified and ratio <= MAX_ERRORS


def table_row(hall: Hall, stage: str, new: Result, old: Result | None) -> str:
    """Return a row of the table."""
    if new.failure:
        return f"| {hall.text} | {stage} | {new.failure} |"
    row = f"| {hall.text} | {stage} | {new.seconds:.2f} | {new.memory / GB:.2f} |"
    if old is not None and not old.failure:
        row += f" {old.seconds / new.seconds:.2f} | {old.memory / new.memory:.2f} |"
    return row


def measure_hall(hall: Hall, bench: Bench) -> tuple[dict[str, Result], dict[str, Result]]:
    """Print the rows of a hall. Return the results of its stages, of this and of an old version."""
    new, old = dict[str, Result](), dict[str, Result]()
    for stage in STAGES:
        is_measured = stage not in UNMEASURED
        before = None
        if bench.old_python is not None and is_measured:
            before = bench.result(stage, hall, is_old=True)
        result = bench.result(stage, hall)
        if before is not None:
            old[stage] = before
        if result is None:
            continue
        new[stage] = result
        if is_measured:
            print(table_row(hall, stage, result, before), flush=True)
        if result.failure:
            break
    return new, old


def compare(halls: list[Hall], bench: Bench) -> int:
    """Print table, exponents and agreement. Return the exit code."""
    has_old = bench.old_python is not None
    print("| lights | pixels | stage | CPU s | GB |" + " old/new CPU | GB |" * has_old)
    print("|---|---|---|---|---|" + "---|---|" * has_old)
    seconds: dict[str, list[tuple[Hall, float]]] = {name: [] for name in STAGES}
    texts, agree = [], True
    for hall in halls:
        new, old = measure_hall(hall, bench)
        for stage, result in new.items():
            seconds[stage].append((hall, result.seconds))
        if {"solve", "analyse"} <= old.keys() & new.keys():
            text, is_equal = agreement(old, new)
            agree &= is_equal
            texts.append(f"{hall.text.replace(' | ', ' lights, ')}: {text}")
    print()
    for stage, rows in seconds.items():
        if stage not in UNMEASURED:
            print(f"{stage}: {exponents(rows)}")
    print(*texts, sep="\n")
    return 0 if agree else 1


def _numbers(text: str) -> list[int]:
    return [int(word) for word in text.split(",")]


def _sizes(text: str) -> list[tuple[int, int]]:
    pairs = [word.split("x") for word in text.split(",")]
    return [(int(width), int(height)) for width, height in pairs]


def main() -> int:
    """Run the benchmark, or one stage of it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--lights", type=_numbers, default=[12, 64, 256, 1000, 4000])
    sizes = [(640, 360), (1920, 1080), (3840, 2160)]
    parser.add_argument("--sizes", type=_sizes, default=sizes)
    parser.add_argument("--spp", type=int, default=8)
    parser.add_argument("--against", type=Path, metavar="PATH_OF_OLD_VENV")
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--results", type=Path, metavar="FILE")
    parser.add_argument("--join", action="store_true")
    parser.add_argument("--stage", nargs=6, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.stage is not None:
        run_here(options.stage, options.folder)
        return 0
    halls = [Hall.fitting(lights, size) for size in options.sizes for lights in options.lights]
    old_python = None if options.against is None else str(options.against / "bin" / "python")
    with tempfile.TemporaryDirectory() as temporary:
        folder = (options.folder or Path(temporary)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        bench = Bench(folder, options.spp, old_python, options.results, options.join)
        return compare(halls, bench)


if __name__ == "__main__":
    sys.exit(main())
