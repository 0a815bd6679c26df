"""Lux of luminaires, one by one, beside Radiance's rtrace.

    pip install pyradiance
    python benchmarks/rtrace.py [--luminaires 4 12 24 48] [--points N] [--spp N] [--repeats K]
        [--options "-aa 0 -ad 64 -lr -5 -lw 1e-2" …]

The room of rcontrib.py with as many luminaires as asked for, points with an IES file each, and
points of measurement on a plane 0.8 m over the floor. lightpaint measures the lux of each luminaire
at each point in one pass. Radiance has one `rtrace -I` for each luminaire, whose octree has that
luminaire alone. Both follow five bounces.

The error of a run is the root mean square over points of the difference to the mean of measurements
with many samples, relative to the mean that the luminaire gives; then over luminaires. Times are
seconds of the processor: for lightpaint of loading, training and samples, with kernels compiled;
for rtrace of its processes alone. The last column is the ratio of error squared times seconds: how
many times longer rtrace takes for an equal error, if more rays make its error smaller as they do
with -aa 0. Of the given sets of options that with the least product counts.
"""

import argparse
import os
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from rcontrib import SURFACES, X, Y, Z, radiance_tools, walls, write_walls

from lightpaint import load_scene
from lightpaint.photometry.illuminance import MeasuringPlane
from lightpaint.photometry.measure import measure_illuminance
from lightpaint.photometry.planes_file import read_planes
from lightpaint.scene.mitsuba_scene import Scene

#: Reflections that both programs follow.
BOUNCES = 5
#: Metres from the ceiling to a luminaire, and from the floor to the points.
HUNG, HEIGHT = 0.3, 0.8
#: Samples per point of the measurements whose mean all others are compared with, and their number.
SURE_SPP, SURE_RUNS = 2**16, 4

#: Options of rtrace: roulette or none, many rays or few, and interpolation between ambient values.
OPTIONS = (
    "-aa 0 -ad 16 -lr -5 -lw 1e-2",
    "-aa 0 -ad 64 -lr -5 -lw 1e-2",
    "-aa 0 -ad 256 -lr -5 -lw 5e-2",
    "-aa 0 -ad 256 -lr -5 -lw 1e-2",
    "-aa 0 -ad 32 -lr 0 -lw 1e-2",
    "-aa .2 -ad 256 -as 64 -ar 32 -lr -5 -lw 1e-2",
)

#: Lumens per watt of Radiance, and its weights of red, green and blue.
EFFICACY, WEIGHTS = 179.0, (0.265, 0.670, 0.065)

Lux = npt.NDArray[np.float64]


class Run(NamedTuple):
    """Seconds of the processor, and the lux of each luminaire at each point, (n, p)."""

    seconds: float
    lux: Lux

    def error(self, sure: Lux) -> float:
        """Root mean square of errors relative to the mean of each luminaire."""
        relative = (self.lux - sure) / sure.mean(axis=1, keepdims=True)
        return float(np.sqrt(np.square(relative).mean()))

    def product(self, sure: Lux) -> float:
        """Error squared times seconds."""
        return self.error(sure) ** 2 * self.seconds


def main() -> None:
    """Print a row for each number of luminaires."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--luminaires", type=int, nargs="+", default=[4, 12, 24, 48])
    parser.add_argument("--points", type=int, default=60, help="about so many")
    parser.add_argument("--spp", type=int, default=2**14, help="samples per point of lightpaint")
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--options", nargs="+", default=OPTIONS, help="sets for rtrace")
    options = parser.parse_args()
    print(
        f"{'luminaires':>10s}{'lightpaint':>20s}{'rtrace':>20s}{'means apart':>13s}"
        f"{'rtrace / lightpaint':>21s}  best options"
    )
    for count in options.luminaires:
        with tempfile.TemporaryDirectory() as folder:
            compare(Path(folder), count, options)


def compare(folder: Path, count: int, options: argparse.Namespace) -> None:
    """Print the row of one number of luminaires."""
    (folder / "lamp.ies").write_text(ies_text(), encoding="ascii")
    scene = write_mitsuba(folder, count)
    [plane] = read_planes(write_plane(folder, options.points), scene).planes
    octrees = [write_radiance(folder, k, place) for k, place in enumerate(places(count))]
    one_pass(scene, plane, 2, 0)  # compiles kernels
    runs = [one_pass(scene, plane, SURE_SPP, 999 + k).lux for k in range(SURE_RUNS)]
    sure = np.mean(runs, axis=0)
    ours, of_options = [], {text: list[Run]() for text in options.options}
    for repeat in range(options.repeats):
        ours.append(one_pass(scene, plane, options.spp, repeat + 1))
        for text, runs in of_options.items():
            runs.append(rtrace(octrees, plane, text))

    def mean_product(runs: Sequence[Run]) -> float:
        return float(np.mean([run.product(sure) for run in runs]))

    best, theirs = min(of_options.items(), key=lambda x: mean_product(x[1]))
    shown = (
        f"{np.mean([run.error(sure) for run in runs]):.1%} in "
        f"{np.mean([run.seconds for run in runs]):.1f} s"
        for runs in (ours, theirs)
    )
    apart = np.mean([run.lux.mean() for run in theirs]) / sure.mean() - 1
    ratio = mean_product(theirs) / mean_product(ours)
    print(
        f"{count:10d}", *(f"{text:>19s}" for text in shown), f"{apart:12.2%}{ratio:20.1f}x  {best}"
    )
    for text, runs in of_options.items():
        print(f"{'':10s}{text}: {runs[0].error(sure):.1%} in {runs[0].seconds:.1f} s", flush=True)


def one_pass(scene: Scene, plane: MeasuringPlane, spp: int, seed: int) -> Run:
    """Measure the lux of all luminaires at once."""
    begin_s = time.process_time()
    found = measure_illuminance(scene, [plane], spp=spp, seed=seed, use_cache=False)
    seconds = time.process_time() - begin_s
    return Run(seconds, found.matrix.sum(axis=2).T)


def rtrace(octrees: Sequence[Path], plane: MeasuringPlane, options: str) -> Run:
    """Measure the lux of each luminaire by itself."""
    rows = np.hstack([plane.points, plane.normals])
    text = "\n".join(" ".join(f"{x:.9g}" for x in row) for row in rows).encode()
    command = [str(radiance_tools() / "rtrace"), "-n", "1", "-I", "-h", "-ab", str(BOUNCES)]
    command += ["-dj", "0", "-ds", "0", *options.split()]
    seconds, lux = 0.0, []
    for octree in octrees:
        with subprocess.Popen(
            [*command, str(octree)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            cwd=octree.parent,
            env=_environment(),
        ) as process:
            assert process.stdin is not None
            assert process.stdout is not None
            process.stdin.write(text)
            process.stdin.close()
            found = np.array(process.stdout.read().split(), float).reshape(-1, 3)
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode != 0:
            raise SystemExit(f"rtrace ended with {process.returncode}")
        seconds += usage.ru_utime + usage.ru_stime
        lux.append(EFFICACY * found @ WEIGHTS)
    return Run(seconds, np.array(lux))


def places(count: int) -> Iterator[tuple[float, float, float]]:
    """Yield the places of luminaires, in rows below the ceiling."""
    columns = max(1, round((count * X / Z) ** 0.5))
    rows = -(-count // columns)
    for k in range(count):
        row, column = divmod(k, columns)
        yield -X + 2 * X * (column + 0.5) / columns, Y - HUNG, -Z + 2 * Z * (row + 0.5) / rows


def ies_text() -> str:
    """Return an IES file of a lamp that is brightest at 40 degrees, and dark from 90 on."""
    angles = np.arange(0, 180.1, 2.5)
    gamma = np.radians(angles)
    candela = np.where(angles < 90, (400 + 900 * np.sin(2 * gamma) ** 2) * np.cos(gamma), 0)
    head = (
        f"IESNA:LM-63-2002\n[TEST] invented\nTILT=NONE\n1 -1 1 {len(angles)} 1 1 2 0 0 0\n1 1 30\n"
    )
    return (
        head + "\n".join(" ".join(f"{x:.6g}" for x in row) for row in (angles, [0], candela)) + "\n"
    )


def write_mitsuba(folder: Path, count: int) -> Scene:
    """Write the room with its luminaires for Mitsuba, and load it."""
    lamps = [
        f'<emitter type="ies" id="lamp_{k}"><string name="filename" value="lamp.ies"/><transform '
        f'name="to_world"><lookat origin="{x}, {y}, {z}" target="{x}, {y - 1}, {z}" up="0, 0, -1"/>'
        "</transform></emitter>"
        for k, (x, y, z) in enumerate(places(count))
    ]
    return load_scene(write_walls(folder, lamps, BOUNCES + 2), group_alike=False)


def write_plane(folder: Path, points: int) -> Path:
    """Write the planes file, and return its path."""
    height, inner = HEIGHT - Y, (X - 0.5, Z - 0.5)
    corners = [[-inner[0], height, -inner[1]], [inner[0], height, -inner[1]]]
    corners += [[inner[0], height, inner[1]]]
    grid = (4 * inner[0] * inner[1] / points) ** 0.5
    path = folder / "room.planes.toml"
    path.write_text(f"[plane.desk]\ncorners = {corners}\ngrid = {grid}\n", encoding="utf-8")
    return path


def write_radiance(folder: Path, number: int, place: tuple[float, float, float]) -> Path:
    """Write the room with one luminaire for Radiance, and return its octree."""
    tools, name = radiance_tools(), f"lamp_{number}"
    lines = [
        f"void plastic {name} 0 0 5 {' '.join(map(str, colour))} 0 0"
        for name, colour in SURFACES.items()
    ]
    for k, (surface, corners) in enumerate(walls()):
        text = " ".join(f"{x:.9g}" for x in corners.ravel())
        lines.append(f"{surface} polygon wall_{k} 0 0 12 {text}")
    hung = ["-rx", "-90", "-t", *(f"{x:.9g}" for x in place)]
    _run([tools / "ies2rad", "-dm", "-o", name, "lamp.ies"], folder)
    lamp = _run([tools / "xform", *hung, f"{name}.rad"], folder)
    (folder / f"room_{number}.rad").write_bytes("\n".join(lines).encode() + b"\n" + lamp)
    octree = folder / f"room_{number}.oct"
    octree.write_bytes(_run([tools / "oconv", f"room_{number}.rad"], folder))
    return octree


def _run(command: Sequence[object], folder: Path) -> bytes:
    texts = [str(x) for x in command]
    return subprocess.run(
        texts, cwd=folder, capture_output=True, check=True, env=_environment()
    ).stdout


def _environment() -> dict[str, str]:
    return os.environ | {"RAYPATH": f".:{radiance_tools().parent / 'lib'}"}


if __name__ == "__main__":
    main()
