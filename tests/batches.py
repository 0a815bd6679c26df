"""A small batch from a saved basis, so that nothing is rendered; and one to be killed.

    python tests/batches.py --kills 40 --seed 1

kills real processes at random moments over one batch, which is begun again each time.
"""

import argparse
import multiprocessing
import random
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.basis.file.basis_file import write_basis
from lightpaint.basis.light_basis import Basis, Origin
from lightpaint.basis.lights import BasisLight
from lightpaint.images.formats.exr import write_rgb


class SilentListener:
    """A listener of a batch that hears nothing."""

    def __call__(self, *_: Any) -> None: ...

    def say(self, text: str) -> None: ...

    note = say

    def at_work(self, worker: str, what: str | None) -> None: ...


#: Looks of every kind that needs no renderer.
LOOKS = """
[defaults]
basis = "b.basis.exr"
want = ["solve", "predict"]

[[look]]
paintings = ["p[01].exr"]
variations = ["warmer", "white only"]

[[look]]
name = "third"
painting = "p2.exr"

[[sequence]]
name = "dusk"
through = ["p0", "third"]
frames = 3
"""

NAMES = [
    *("p0", "p1", "p0-warmer", "p1-warmer", "p0-white-only", "p1-white-only", "third"),
    *("dusk-0", "dusk-1", "dusk-2"),
]


def small_basis(seed: int = 0) -> Basis:
    """Three lights in random images."""
    rng = np.random.default_rng(seed)
    images = rng.random((3, 8, 12, 3), dtype=np.float32)
    lights = tuple(
        BasisLight(f"lamp {k}", "area", "radiance", "W/(m² sr)", (1.0, 0.9, 0.8), "1 m²")
        for k in range(3)
    )
    origin = Origin("scene.xml", "0f" * 8, "camera", 0, "synthetic", (32, 32), (1, 1))
    return Basis(lights, images, 0 * images, np.zeros((8, 12), bool), origin)


def write_batch(folder: Path, looks: str = LOOKS) -> Path:
    """Write a basis, three paintings of it and a manifest; returns that."""
    basis = small_basis()
    write_basis(folder / "b.basis.exr", basis)
    for k, weights in enumerate(np.random.default_rng(1).random((3, 3))):
        image = np.einsum("nhwc,n->hwc", basis.images, weights).astype(np.float32)
        write_rgb(folder / f"p{k}.exr", image)
    (folder / "looks.toml").write_text(looks, encoding="utf-8")
    return folder / "looks.toml"


def contents(folder: Path) -> dict[str, bytes]:
    """All files in a folder, by their paths from there; hidden ones, too."""
    files = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in files}


def run_whole_batch(manifest: str, folder: str, workers: int = 1) -> None:
    """Do what is left of a batch, as a process of its own may."""
    from lightpaint.batch.plan.planner import plan_batch
    from lightpaint.batch.run import run_batch
    from lightpaint.batch.run_options import RunOptions

    run_batch(plan_batch(manifest, folder), RunOptions(workers))


def process_context() -> Any:
    """Processes that begin with all modules loaded, and none of this one's threads."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(
        ["lightpaint.batch.plan.planner", "lightpaint.batch.run", "batches"]
    )
    return context


def kill_batch(manifest: Path, folder: Path, after_s: float, workers: int = 1) -> int:
    """Begin a batch, kill it so much later, and return its exit code: 0 where it was done."""
    process = process_context().Process(
        target=run_whole_batch, args=(str(manifest), str(folder), workers)
    )
    process.start()
    process.join(after_s)
    process.kill()
    process.join()
    return int(process.exitcode)


def _main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--kills", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    options, wrong_count = parser.parse_args(), 0
    chance = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as folder_name:
        manifest, end, kills, batches = (
            write_batch(Path(folder_name)),
            Path(folder_name) / "end",
            0,
            0,
        )
        begun_s = time.monotonic()
        run_whole_batch(str(manifest), str(end))
        run_s, expected = time.monotonic() - begun_s, contents(end)
        while kills < options.kills:
            folder, batches = Path(folder_name) / f"{batches}", batches + 1
            while kill_batch(manifest, folder, chance.uniform(0, run_s)):
                kills += 1
            wrong_count += contents(folder) != expected
    print(f"{kills} kills over {batches} batches; {wrong_count} ended otherwise than undisturbed")
    return int(wrong_count > 0)


if __name__ == "__main__":
    sys.exit(_main())
