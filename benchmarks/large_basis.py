"""How much memory a large basis takes: written, solved, predicted and reported.

    python benchmarks/large_basis.py [--size 3840x2160] [--lights 100] [--noise 0.02] [--folder F]

A basis of made-up lights is written plane by plane, none of which is kept, and a picture that other
emissions of them make as a painting. Then `lightpaint solve` answers it from the file, report and
all, in a process of its own, whose largest resident memory and time are printed, with how often it
walked over all planes. The answer is exported, and a hall of as many lights on as many pixels is
drawn light by light and relit with it. With `--noise 1` single pixels say little, and blocks of
them are fitted. A folder that is given keeps the files, where the next call finds the basis.
"""

import argparse
import ast
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from hall import write_hall

import lightpaint as lp
from lightpaint.basis.file.file_planes import RowPlanes
from lightpaint.basis.light_basis import Basis, Origin
from lightpaint.basis.lights import BasisLight, Lights
from lightpaint.images.denoiser import Features
from lightpaint.images.formats.png import png_bytes

#: Values of noise that are drawn; each plane begins at another of them.
DRAWN = 2**22 + 3

#: Plugin, parameter and unit of four lights of a hall, whose lighting the answer can be.
AREA = "area", "radiance", "W/(m² sr)"
HALL_KINDS = (("spot", "intensity", "W/sr"), AREA, ("point", "intensity", "W/sr"), AREA)

#: Formats of other programs that a lighting is exported to.
FORMATS = "csv,json,mitsuba,usd,blender"

#: Bytes of a GB, in which memory is told here, as in docs/benchmarks.md.
GB = 1e9


class MadePlanes(RowPlanes):
    """Pools of light that are made when they are asked for.

    noise: standard deviation beside the light, of images, or of their half differences.
    """

    def __init__(
        self, count: int, size: tuple[int, int], *, noise: float, is_noise: bool = False
    ) -> None:
        self._count, self._size, self._noise, self._is_noise = count, size, noise, is_noise
        rng = np.random.default_rng(1)
        self._centres = rng.uniform(0, 1, (count, 2))
        self._widths, self._tints = rng.uniform(0.05, 0.3, count), rng.uniform(0.3, 1, (count, 3))

    @property
    def count(self) -> int:
        """n."""
        return self._count

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self._size

    @cached_property
    def _drawn(self) -> Any:
        return np.random.default_rng(2).standard_normal(DRAWN, np.float32)

    def plane(self, i: int) -> Any:
        """That of light i, (h, w, 3)."""
        return self._rows(i, 0, self._size[0])

    def rows(self, top: int, bottom: int) -> Any:
        """Some rows of all, (n, bottom - top, w, 3)."""
        return np.stack([self._rows(i, top, bottom) for i in range(self._count)])

    def _rows(self, i: int, top: int, bottom: int) -> Any:
        height, width = self._size
        (y, x), width_of = self._centres[i], self._widths[i]
        down = np.exp(-(((np.arange(top, bottom) / height - y) / width_of) ** 2))
        along = np.exp(-(((np.arange(width) - x * width) / height / width_of) ** 2))
        shade = down.astype(np.float32)[:, None] * along.astype(np.float32) + np.float32(0.01)
        light = shade[..., None] * self._tints[i].astype(np.float32)
        # Another beginning for each light and kind, and the same value for a pixel in any strip.
        begin = (7919 * (2 * i + self._is_noise) + 3 * width * top) % DRAWN
        drawn = np.resize(np.concatenate([self._drawn[begin:], self._drawn[:begin]]), light.size)
        grain = drawn.reshape(light.shape) * np.float32(self._noise)
        return light * grain if self._is_noise else light * (1 + grain)


def made_basis(count: int, size: tuple[int, int], noise: float) -> Basis:
    """A basis whose planes are made when they are asked for."""
    rng = np.random.default_rng(3)
    lights = [
        BasisLight(f"light_{k}", *HALL_KINDS[k % 4], tuple(rng.uniform(0, 0.1, 3)))
        for k in range(count)
    ]
    y, x = np.mgrid[: size[0], : size[1]]
    flat = np.stack([x / size[1], y / size[0], 0 * x + 0.5], axis=-1).astype(np.float32)
    return Basis(
        lights=Lights(tuple(lights)),
        planes=MadePlanes(count, size, noise=noise),
        noise=MadePlanes(count, size, noise=noise, is_noise=True),
        emitters_seen=np.zeros(size, dtype=bool),
        origin=Origin("made.xml", "0" * 32, "sensor", 0, "made up", (32, 32), (1, 1)),
        features=Features(0.2 + 0.6 * flat, flat / np.linalg.norm(flat, axis=-1)[..., None]),
    )


def write_files(folder: Path, count: int, size: tuple[int, int], noise: float) -> None:
    """Write basis and painting into a folder."""
    basis = made_basis(count, size, noise)
    lp.write_basis(folder / "made.basis.exr", basis)
    weights = basis.current_weights * np.random.default_rng(4).uniform(0, 2, (count, 3))
    painting = np.clip(basis.mix(weights), 0, 1)
    encoded = lp.ViewTransform("srgb").encode(painting)
    (folder / "painting.png").write_bytes(png_bytes((255 * encoded + 0.5).astype(np.uint8), {}))


def measured(command: list[str], lights: int) -> Iterator[str]:
    """Run a command, and yield what it took."""
    code = f"""
import collections, os, resource, runpy, sys, time
from lightpaint.images.formats.exr_rows import RowFile
sys.argv = {command!r}
sys.path.insert(0, os.path.dirname(sys.argv[0]))
rows, spent_s, plain = collections.Counter(), collections.Counter(), RowFile.read_rows
def read_rows(self, part, top, bottom, names, into):
    began_s = time.thread_time()
    plain(self, part, top, bottom, names, into)
    kind = "noise" if names[0].startswith("half") else "images"
    rows[kind] += (bottom - top) / part.size[0]
    spent_s[kind] += time.thread_time() - began_s
RowFile.read_rows = read_rows
try:
    runpy.run_path(sys.argv[0], run_name="__main__")
finally:
    used = resource.getrusage(resource.RUSAGE_SELF)
    cpu_s = used.ru_utime + used.ru_stime
    told = [(kind, rows[kind], spent_s[kind]) for kind in rows]
    print("measured", repr((used.ru_maxrss, cpu_s, told)), file=sys.stderr)
"""
    completed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    if completed.returncode:
        raise SystemExit(completed.stderr)
    peak, cpu_s, lines = ast.literal_eval(completed.stderr.rsplit("measured", 1)[1].strip())
    # Linux counts in units of 1024 bytes, macOS in bytes.
    unit = 1 if sys.platform == "darwin" else 1024
    yield f"{peak * unit / GB:.2f} GB at most, {cpu_s:.0f} s of the processor"
    for kind, planes, spent_s in lines:
        walks = planes / lights
        yield f"{walks:.1f} walks over all {kind}, {spent_s / walks:.1f} s of reading each"


def main() -> None:
    """Print memory and time of each step."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", default="3840x2160", metavar="WxH")
    parser.add_argument("--lights", type=int, default=100)
    parser.add_argument("--noise", type=float, default=0.02, help="beside the light of a pixel")
    parser.add_argument("--folder", type=Path, help="for the files; one that is deleted by default")
    parser.add_argument("--write", action="store_true", help=argparse.SUPPRESS)
    options, solve_options = parser.parse_known_args()
    if options.write:
        write_files(options.folder, options.lights, made_size(options), options.noise)
        return
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.folder or Path(temporary)
        run(folder, options, solve_options)


def made_size(options: argparse.Namespace) -> tuple[int, int]:
    """(height, width) in pixels."""
    width, height = map(int, options.size.split("x"))
    return height, width


def run(folder: Path, options: argparse.Namespace, solve_options: list[str]) -> None:
    """Write, and solve with more options of `lightpaint solve`."""
    own = [str(Path(__file__).resolve()), "--write", "--folder", str(folder)]
    own += ["--size", options.size, "--lights", str(options.lights), "--noise", str(options.noise)]
    print(f"{options.lights} lights, {options.size}, noise {options.noise}", flush=True)
    basis = folder / "made.basis.exr"
    if not basis.exists():
        for line in measured(own, options.lights):
            size = basis.stat().st_size / GB
            print(f"    written: {line}, a file of {size:.2f} GB", flush=True)
    lightpaint = str(Path(sys.executable).parent / "lightpaint")
    results = ["-o", str(folder / "results"), "--force"]
    solve = [
        lightpaint,
        "solve",
        str(basis),
        str(folder / "painting.png"),
        *results,
        *solve_options,
    ]
    for line in measured(solve, options.lights):
        print(f"    solved, predicted and reported: {line}", flush=True)
    print(f"    results: {', '.join(sorted(x.name for x in (folder / 'results').iterdir()))}")
    height, width = made_size(options)
    scene = str(write_hall(folder, options.lights, width=width, height=height))
    lighting = str(folder / "results" / "lighting.json")
    for label, command in {
        "exported": ["export", lighting, "--to", FORMATS, "--scene", scene, "-o", "exports"],
        "drawn as lights.png": ["lights", scene, "-o", "lights.png"],
        "relit, 4 samples per pixel": ["relight", scene, lighting, "--spp", "4", "-o", "relit"],
    }.items():
        command[-1] = str(folder / command[-1])
        for line in measured([lightpaint, *command, "--force"], options.lights):
            print(f"    {label}: {line}", flush=True)


if __name__ == "__main__":
    main()
