"""How much processor time a basis of many lights takes at equal error of M and b.

    python benchmarks/basis_error.py --against CHECKOUT [--lights 1000] [--size 160x90] [--spp 8]
        [--seeds 3] [--reference 256]

Renders a hall (hall.py) with this version and with the one in another checkout, in turns, each
time in a process of its own with another seed, and once with many samples. M and b are the sums of
a painting in which lights have two, half, none and all of their light. Prints, of each version,
processor seconds, the largest resident memory and the errors of M and b, as root mean squares
relative to those of the reference; then the ratio of seconds times squared errors, new to old:
the time for equal errors, since variance falls with the number of samples.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from hall import write_hall
from scaling import GB, MEMORY_UNIT


@dataclass(frozen=True)
class Run:
    """A render: its processor seconds, memory in bytes, and sums, (3, n, n) and (3, n)."""

    seconds: float
    memory: float
    M: np.ndarray
    b: np.ndarray


def render_here(scene: Path, painting: Path, spp: int, seed: int, out: Path) -> None:
    """Render a basis and write its sums. The first to run makes the painting."""
    import lightpaint as lp

    loaded = lp.load_scene(scene)
    begin_s = time.process_time()
    basis = lp.render_basis(loaded, spp=spp, seed=seed)
    seconds = time.process_time() - begin_s
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * MEMORY_UNIT
    if not painting.exists():
        factors = np.resize([2.0, 0.5, 0.0, 1.0], len(basis.names))[:, None]
        np.save(painting, basis.mix(basis.current_weights * factors))
    M, b, _ = basis.planes.sums(np.ones((*basis.size, 1), np.float32), np.load(painting))
    np.savez(out, seconds=seconds, memory=memory, M=M, b=b)


def render(scene: Path, painting: Path, spp: int, seed: int, checkout: Path | None) -> Run:
    """Render in a process of its own, with the version in a checkout; None for this one."""
    out = scene.with_name("run.npz")
    environment = {**os.environ, "LIGHTPAINT_CACHE": str(scene.with_name("cache"))}
    if checkout is not None:
        environment["PYTHONPATH"] = str(checkout.resolve())
    words = [str(scene), str(painting), str(spp), str(seed), str(out)]
    subprocess.run([sys.executable, __file__, "--run", *words], env=environment, check=True)
    run = np.load(out)
    return Run(float(run["seconds"]), float(run["memory"]), run["M"], run["b"])


def errors(runs: list[Run], truth: Run) -> tuple[float, float]:
    """Return the errors of M and b, relative to those of the truth."""
    return tuple(
        float(np.sqrt(np.mean([np.square(getattr(run, name) - true).sum() for run in runs])))
        / float(np.linalg.norm(true))
        for name, true in (("M", truth.M), ("b", truth.b))
    )


def main() -> None:
    """Run the benchmark, or one render of it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--against", type=Path, metavar="CHECKOUT")
    parser.add_argument("--lights", type=int, default=1000)
    parser.add_argument("--size", default="160x90")
    parser.add_argument("--spp", type=int, default=8)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--reference", type=int, default=256)
    parser.add_argument("--run", nargs=5, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.run is not None:
        scene, painting, spp, seed, out = options.run
        render_here(Path(scene), Path(painting), int(spp), int(seed), Path(out))
        return
    width, height = map(int, options.size.split("x"))
    with tempfile.TemporaryDirectory() as folder:
        scene = write_hall(Path(folder), options.lights, width=width, height=height)
        painting = Path(folder) / "painting.npy"
        truth = render(scene, painting, options.reference, 10**6, None)
        versions: dict[str, Path | None] = {"new": None}
        if options.against is not None:
            versions = {"old": options.against, **versions}
        runs: dict[str, list[Run]] = {name: [] for name in versions}
        for seed in range(options.seeds):
            for name, checkout in versions.items():
                runs[name].append(render(scene, painting, options.spp, seed, checkout))
    print("| version | CPU s | GB | error of M | error of b |\n|---|---|---|---|---|")
    for name, its_runs in runs.items():
        seconds = np.mean([run.seconds for run in its_runs])
        memory = max(run.memory for run in its_runs) / GB
        of_M, of_b = errors(its_runs, truth)
        print(f"| {name} | {seconds:.1f} | {memory:.2f} | {of_M:.2%} | {of_b:.2%} |")
    if options.against is not None:
        (old, new), ratio = runs.values(), dict[str, float]()
        pairs = zip("Mb", errors(new, truth), errors(old, truth), strict=True)
        share = sum(run.seconds for run in new) / sum(run.seconds for run in old)
        ratio = {name: share * (mine / its) ** 2 for name, mine, its in pairs}
        print(f"seconds at equal error, new to old: {ratio['M']:.2f} for M, {ratio['b']:.2f} for b")


if __name__ == "__main__":
    main()
