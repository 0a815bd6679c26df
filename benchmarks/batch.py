"""How many looks a second come from one basis, by one process and by two.

    python benchmarks/batch.py [--looks 20] [--lights 12] [--size 640x360]

makes a basis of random images, and that many paintings of it; nothing is rendered. The second
number of each is of looks with a report.
"""

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np

from lightpaint.basis.basis import Basis, BasisLight, Origin
from lightpaint.basis.file import write_basis
from lightpaint.batch.how import How
from lightpaint.batch.plan import plan
from lightpaint.batch.run import run_batch
from lightpaint.images.exr import write_rgb


def write_looks(folder: Path, *, looks: int, lights: int, size: tuple[int, int]) -> None:
    """A basis and paintings, with noise as of some samples."""
    rng = np.random.default_rng(0)
    shape = (lights, size[1], size[0], 3)
    images = rng.random(shape, dtype=np.float32)
    noise = rng.normal(0, 0.02, shape).astype(np.float32)
    named = tuple(
        BasisLight(f"lamp {k}", "area", "radiance", "W/(m² sr)", (1.0, 1.0, 1.0), "1 m²")
        for k in range(lights)
    )
    origin = Origin("scene.xml", "0f" * 8, "camera", 0, "synthetic", (32, 32), (1, 1))
    seen = np.zeros((size[1], size[0]), bool)
    write_basis(folder / "b.basis.exr", Basis(named, images, noise, seen, origin))
    for k, weights in enumerate(rng.random((looks, lights)).astype(np.float32)):
        write_rgb(folder / f"p{k:04}.exr", np.tensordot(weights, images, 1))


def seconds(folder: Path, want: str, workers: int) -> tuple[float, float]:
    """To check all looks, and to do them; and once more where all are done."""
    text = f'[[look]]\nbasis = "b.basis.exr"\npaintings = ["p*.exr"]\nwant = [{want}]\n'
    (folder / "looks.toml").write_text(text, encoding="utf-8")
    place = folder / f"out-{workers}-{len(want)}"
    begun = time.perf_counter()
    planned = plan(folder / "looks.toml", place)
    checked = time.perf_counter()
    outcome = run_batch(planned, How(workers))
    assert not outcome.failed, outcome.failed
    return checked - begun, time.perf_counter() - checked


def _main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--looks", type=int, default=20)
    parser.add_argument("--lights", type=int, default=12)
    parser.add_argument("--size", default="640x360")
    given = parser.parse_args()
    width, height = map(int, given.size.split("x"))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_looks(folder, looks=given.looks, lights=given.lights, size=(width, height))
        for want in ('"solve", "predict"', '"solve", "predict", "report"'):
            for workers in (1, 2):
                checked, done = seconds(folder, want, workers)
                print(
                    f"{given.looks} looks, want {want}, {workers} workers: checked in "
                    f"{checked:.1f} s, done in {done:.1f} s, {done / given.looks:.2f} s each"
                )
        again = seconds(folder, '"solve", "predict"', 1)
        print(f"where all is done: {again[0]:.1f} s and {again[1]:.1f} s")


if __name__ == "__main__":
    _main()
