"""How many looks a second come from one basis, and what workers of a cluster add.

    python benchmarks/batch.py [--looks 20] [--lights 12] [--size 640x360] [--spp 64]

First looks: from a basis of random images, of which nothing is rendered, by one process, two, and
two workers of a cluster; then errands that are nothing; then a basis: of the gallery, in parts, by
this process alone and by one and two workers of a cluster, one thread each. Seconds are on the
clock and, in brackets, of the processor: of the busiest process, which is what the clock would show
were nothing else at work.
"""

import argparse
import contextlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.basis.file.basis_file import write_basis
from lightpaint.basis.light_basis import Basis, Origin
from lightpaint.basis.lights import BasisLight
from lightpaint.batch.dask_engine import Cluster
from lightpaint.batch.distributed_work import PartwiseRender
from lightpaint.batch.engine import Engine, InProcess
from lightpaint.batch.plan.planner import plan_batch
from lightpaint.batch.run import run_batch
from lightpaint.batch.run_options import RunOptions
from lightpaint.batch.work.work_items import SceneFilm, Task
from lightpaint.batch.work.worker_storage import WorkerCache
from lightpaint.images.formats.exr import write_rgb
from lightpaint.pipeline.job.sources import SceneFile
from lightpaint.progress import silent
from lightpaint.scene.runtime.kernel_threads import limit_threads

GALLERY = Path(__file__).parent.parent / "scenes" / "gallery" / "scene.xml"

#: Samples per pixel of the run before those that count, in which kernels are compiled.
WARM = 4


@dataclass
class Took:
    """Seconds on the clock; of the processor, of the busiest process and of all together."""

    clock_s: float
    busiest_s: float
    all_s: float

    def __str__(self) -> str:
        return f"{self.clock_s:7.1f} ({self.busiest_s:.1f})"


@contextlib.contextmanager
def cluster(workers: int, folder: Path) -> Iterator[str]:
    """The address of a scheduler with so many workers of one thread each."""
    file = folder / f"scheduler-{workers}.json"
    dask = [sys.executable, "-m", "dask"]
    options = ["--no-dashboard", "--scheduler-file", str(file)]
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    quiet["env"] = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    many = ["--nworkers", str(workers), "--nthreads", "1", "--local-directory", str(folder)]
    with contextlib.ExitStack() as stack:
        for command in (
            [*dask, "scheduler", "--host", "127.0.0.1", "--port", "0", *options],
            [*dask, "worker", *many, *options],
        ):
            process = stack.enter_context(subprocess.Popen(command, **quiet))
            stack.callback(process.terminate)
            while not file.exists() or not file.stat().st_size:
                time.sleep(0.1)
        from distributed import Client

        with Client(scheduler_file=str(file), set_as_default=False) as client:
            client.wait_for_workers(workers)
            address = client.scheduler.address
        yield str(address)


def took(work: Callable[[], object], address: str | None = None) -> Took:
    """What `work` takes here and, at `address`, workers."""
    before, here_s, start_s = _workers_s(address), time.process_time(), time.perf_counter()
    work()
    clock_s = time.perf_counter() - start_s
    cpu_s = [time.process_time() - here_s]
    cpu_s += [total_s - before.get(worker, 0.0) for worker, total_s in _workers_s(address).items()]
    return Took(clock_s, max(cpu_s), sum(cpu_s))


def _workers_s(address: str | None) -> dict[str, float]:
    """Seconds of the processor that each worker has had."""
    if address is None:
        return {}
    from distributed import Client

    with Client(address, set_as_default=False) as client:
        cpu_s: dict[str, float] = client.run(time.process_time)
        return cpu_s


def _peak_mb(address: str) -> float:
    """What the largest worker has had."""
    from distributed import Client

    with Client(address, set_as_default=False) as client:
        return max(client.run(_own_peak_kb).values()) / 1024


def _own_peak_kb() -> int:
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def items(folder: Path, count: int) -> None:
    """What the engine itself takes for errands that are nothing."""
    job = '{"folder": "", "settings": {"force": false}}'
    some = [Task(f"nothing {k}", "answer", job) for k in range(count)]
    with cluster(2, folder) as address, Cluster(address, silent) as engine:
        duration = took(lambda: list(engine.run(some)))
    print(f"{count} errands that are nothing: {1000 * duration.all_s / count:.1f} ms each, here")


def write_looks(folder: Path, *, looks: int, lights: int, size: tuple[int, int]) -> None:
    """A basis and paintings, with noise as of some samples."""
    rng = np.random.default_rng(0)
    shape = (lights, size[1], size[0], 3)
    images = rng.random(shape, dtype=np.float32)
    noise = rng.normal(0, 0.02, shape).astype(np.float32)
    basis_lights = tuple(
        BasisLight(f"lamp {k}", "area", "radiance", "W/(m² sr)", (1.0, 1.0, 1.0), "1 m²")
        for k in range(lights)
    )
    origin = Origin("scene.xml", "0f" * 8, "camera", 0, "synthetic", (32, 32), (1, 1))
    emitter_mask = np.zeros((size[1], size[0]), bool)
    write_basis(folder / "b.basis.exr", Basis(basis_lights, images, noise, emitter_mask, origin))
    for k, weights in enumerate(rng.random((looks, lights)).astype(np.float32)):
        write_rgb(folder / f"p{k:04}.exr", np.tensordot(weights, images, 1))


def looks(folder: Path, count: int, steps: str, **options: Any) -> None:
    """Do all looks, of which none is done."""
    text = f'[[look]]\nbasis = "b.basis.exr"\npaintings = ["p*.exr"]\nwant = [{steps}]\n'
    (folder / "looks.toml").write_text(text, encoding="utf-8")
    with tempfile.TemporaryDirectory(dir=folder) as place:
        address = options.get("cluster")
        start_s = time.perf_counter()
        planned = plan_batch(folder / "looks.toml", Path(place) / "out")
        checked_s = time.perf_counter() - start_s

        if address:  # workers begin with the first
            assert not run_batch(planned.select("p000[01]"), RunOptions(**options)).failed
            planned, count = plan_batch(folder / "looks.toml", Path(place) / "out"), count - 2

        def work() -> None:
            assert not run_batch(planned, RunOptions(**options)).failed

        duration = took(work, address)
        name = "a cluster of two" if address else f"{options.get('workers', 1)} processes"
        print(
            f"{count} looks, want {steps}, {name}: checked in {checked_s:.1f} s, "
            f"done in {duration} s, {count / duration.clock_s:.1f} looks a second",
            flush=True,
        )


def basis(engine: Engine, spp: int, cache: Path) -> Basis:
    """That of the gallery, rendered by `engine`."""
    os.environ["LIGHTPAINT_CACHE"] = str(cache)
    file = SceneFile(str(GALLERY))
    scene = file.content
    film = SceneFilm(file, files=tuple(map(str, scene.read_files)))
    return PartwiseRender(engine, film)(scene, spp=spp, time_s=None, seed=0, progress=silent)


def _kept(results: list[Basis], by: Callable[[], Basis]) -> None:
    results.append(by())


def _tell(name: str, duration: Took) -> None:
    print(
        f"    {name:<14} {duration} s, {duration.all_s:.1f} s of the processor in all", flush=True
    )


def bases(folder: Path, spp: int) -> None:
    """The table of who renders it."""
    limit_threads(1)
    cache = WorkerCache()
    basis(InProcess(cache, silent), WARM, folder / "warm")
    results: list[Basis] = []
    by = partial(basis, InProcess(cache, silent), spp, folder / "alone")
    lock_folder = took(partial(_kept, results, by))
    (height, width), n = results[0].size, len(results[0].lights)
    print(f"basis of the gallery, {n} lights, {width}x{height}, {spp} samples per pixel:")
    durations = [("this process", lock_folder)]
    _tell(*durations[-1])
    for workers in (1, 2):
        with cluster(workers, folder) as address, Cluster(address, silent) as engine:
            basis(engine, WARM, folder / f"warm-{workers}")
            by = partial(basis, engine, spp, folder / f"by-{workers}")
            durations.append((f"{workers} workers", took(partial(_kept, results, by), address)))
            peak_mb = _peak_mb(address)
            _tell(*durations[-1])
    one, two = durations[1][1], durations[2][1]
    over = one.busiest_s / lock_folder.busiest_s - 1, one.clock_s / lock_folder.clock_s - 1
    print(f"    two workers take {two.busiest_s / one.busiest_s:.2f} of one, by the processor, ")
    print(f"    {two.clock_s / one.clock_s:.2f} on the clock; one takes {100 * over[0]:.1f} % more")
    print(f"    than this process, {100 * over[1]:.1f} % on the clock")
    print(f"    a worker has {peak_mb:.0f} MB at its peak")
    is_same = all(np.array_equal(results[0].images, other.images) for other in results[1:])
    print(f"    the same to the last bit: {'yes' if is_same else 'no'}")


def _main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--looks", type=int, default=20)
    parser.add_argument("--lights", type=int, default=12)
    parser.add_argument("--size", default="640x360")
    parser.add_argument("--spp", type=int, default=64)
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if options.looks:
            write_looks(folder, looks=options.looks, lights=options.lights, size=(width, height))
            for steps in ('"solve", "predict"', '"solve", "predict", "report"'):
                for workers in (1, 2):
                    looks(folder, options.looks, steps, workers=workers)
                with cluster(2, folder) as address:
                    looks(folder, options.looks, steps, cluster=address)
        if options.spp:
            items(folder, 500)
            bases(folder, options.spp)


if __name__ == "__main__":
    _main()
