"""How noisy the planes of a basis are for the time that they take, beside Radiance's rcontrib.

    pip install pyradiance
    python benchmarks/rcontrib.py [--lights 16 64 256] [--spp N] [--rays N] [--repeats K]
        [--options "-ad 1 -lw .2" …]

A diffuse room with as many square lamps as asked for, of 160x90 pixels and five bounces, described
to both programs. Both make the picture of each lamp alone, in one run. Figures are the variance of
a plane over its mean squared, from the difference of two halves of the samples (geometric mean over
lamps), times seconds of the processor: for lightpaint of training, samples and writing the file,
with kernels compiled and without loading; for rcontrib of its process, without its octree.
So the last column says how many times longer rcontrib takes for equal noise, if more samples cost
either in proportion. rcontrib samples its sources itself; of the given sets of options that with
the least figure counts.
"""

import argparse
import os
import subprocess
import tempfile
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO, NamedTuple

import numpy as np
import numpy.typing as npt

from lightpaint import load_scene, render_basis, write_basis
from lightpaint.scene.mitsuba_scene import Scene

#: Half the sides of the room in metres; reflectance of floor, ceiling and walls, two of which
#: differ.
X, Y, Z = 4.0, 2.0, 6.0
SURFACES = {
    "floor": (0.4, 0.35, 0.3),
    "ceiling": (0.8, 0.8, 0.8),
    "left": (0.7, 0.4, 0.3),
    "right": (0.3, 0.5, 0.7),
    "ends": (0.6, 0.6, 0.6),
}
#: Blocks that stand in the room: centres and half sides.
BLOCKS = (((-1.5, -1.2, 1.0), (0.5, 0.8, 0.5)), ((1.6, -1.4, 2.5), (0.7, 0.6, 0.4)))

WIDTH, HEIGHT, FIELD = 160, 90, 70.0
#: Half the side of a lamp over the distance to the next one, and metres from the ceiling.
LAMP_SHARE, GAP = 0.15, 0.001

#: Options of rcontrib: number of rays at a bounce, the weight below which roulette decides, and how
#: sources are divided.
OPTIONS = (
    "-ad 1 -as 0 -lw .2 -dj 1 -ds .2",
    "-ad 1 -as 0 -lw .05 -dj 1 -ds .2",
    "-ad 1 -as 0 -lw .2 -dj 1 -ds 0",
    "-ad 4 -as 0 -lw .05 -dj 1 -ds .2",
)
#: Number of bounces before the last one, which samples lamps alone.
BOUNCES = 4

Planes = npt.NDArray[np.float32]
Quad = npt.NDArray[np.float64]


class Run(NamedTuple):
    """Seconds of the processor, relative variance of each plane, and the mean of each, (n,)."""

    seconds: float
    variances: npt.NDArray[np.float64]
    means: npt.NDArray[np.float64]

    @property
    def figure(self) -> float:
        """Variance times seconds: the geometric mean over lamps."""
        measured = self.variances[self.variances > 0]
        return float(np.exp(np.log(measured).mean())) * self.seconds


def main() -> None:
    """Print a row for each number of lamps."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lights", type=int, nargs="+", default=[16, 64, 256])
    parser.add_argument("--spp", type=int, default=64, help="samples per pixel of lightpaint")
    parser.add_argument("--rays", type=int, default=8, help="rays per pixel of rcontrib")
    parser.add_argument("--repeats", type=int, default=1)
    parser.add_argument("--options", nargs="+", default=OPTIONS, help="sets for rcontrib")
    options = parser.parse_args()
    if options.rays < 2 or options.rays % 2:
        parser.error(f"--rays {options.rays}: pixels have two halves, so give an even number")
    print(
        f"{'lamps':>6s}{'lightpaint, s':>15s}{'rcontrib, s':>13s}{'means apart':>13s}"
        f"{'rcontrib / lightpaint':>23s}  best options"
    )
    for lamps in options.lights:
        with tempfile.TemporaryDirectory() as folder:
            compare(Path(folder), lamps, options)


def compare(folder: Path, lamps: int, options: argparse.Namespace) -> None:
    """Print the row of one number of lamps."""
    scene, octree = write_mitsuba(folder, lamps), write_radiance(folder, lamps)
    one_pass(scene, 2, 0, folder)  # compiles kernels
    ours, of_options = [], {text: list[Run]() for text in options.options}
    for repeat in range(options.repeats):
        ours.append(one_pass(scene, options.spp, repeat + 1, folder))
        for text, runs in of_options.items():
            runs.append(rcontrib(octree, lamps, options.rays, text))
    best, theirs = min(of_options.items(), key=lambda x: np.mean([run.figure for run in x[1]]))
    apart = np.mean([run.means.sum() for run in theirs]) / np.mean([r.means.sum() for r in ours])
    ratio = np.mean([run.figure for run in theirs]) / np.mean([run.figure for run in ours])
    seconds = [np.mean([run.seconds for run in runs]) for runs in (ours, theirs)]
    print(
        f"{lamps:6d}{seconds[0]:15.1f}{seconds[1]:13.1f}{100 * (apart - 1):11.2f} %{ratio:22.1f}x"
        f"  {best}",
        flush=True,
    )


def one_pass(scene: Scene, spp: int, seed: int, folder: Path) -> Run:
    """Measure the basis as lightpaint renders and writes it."""
    begin_s = time.process_time()
    basis = render_basis(scene, spp=spp, seed=seed)
    write_basis(folder / "room.basis.exr", basis)
    seconds = time.process_time() - begin_s
    sums, squares = np.zeros((2, len(scene.lights)))
    for k, (plane, noise) in enumerate(zip(basis.planes, basis.noise, strict=True)):
        sums[k] = plane.mean(dtype=np.float64)
        squares[k] = np.square(noise, dtype=np.float64).mean()
    return Run(seconds, squares / sums**2, sums)


def rcontrib(octree: Path, lamps: int, rays: int, options: str) -> Run:
    """Measure the contributions of all lamps, from two halves of the rays of each pixel."""
    tools = radiance_tools()
    environment = os.environ | {"RAYPATH": str(tools.parent / "lib")}
    size = ["-x", str(WIDTH), "-y", str(HEIGHT)]
    view = ["-vp", "0", "0", "-5.8", "-vd", "0", "0", "1", "-vu", "0", "1", "0"]
    view += ["-vh", str(FIELD), "-vv", str(vertical_field()), "-pj", "1"]
    vwrays = [str(tools / "vwrays"), "-ff", "-c", str(rays), *size, *view]
    command = [str(tools / "rcontrib"), "-n", "1", "-V+", "-fff", "-h", "-c", str(rays // 2)]
    command += ["-ab", str(BOUNCES), *options.split(), "-M", str(octree.with_suffix(".lamps"))]
    pipe = subprocess.PIPE
    with (
        subprocess.Popen(vwrays, stdout=pipe, env=environment) as of_view,
        subprocess.Popen(
            [*command, str(octree)], stdin=of_view.stdout, stdout=pipe, env=environment
        ) as contributions,
    ):
        assert contributions.stdout is not None
        sums, squares = np.zeros((2, lamps))
        for row in records(contributions.stdout, lamps):
            a, b = row[0::2].astype(np.float64), row[1::2].astype(np.float64)
            sums += ((a + b) / 2).sum(axis=(0, 2))
            squares += np.square((a - b) / 2).sum(axis=(0, 2))
        _, status, usage = os.wait4(contributions.pid, 0)
        contributions.returncode = os.waitstatus_to_exitcode(status)
    if contributions.returncode != 0:
        raise SystemExit(f"rcontrib ended with {contributions.returncode}")
    numbers = WIDTH * HEIGHT * 3
    means = sums / numbers
    return Run(usage.ru_utime + usage.ru_stime, squares / numbers / means**2, means)


def records(stream: IO[bytes], lamps: int) -> Iterator[Planes]:
    """Yield the two records of each pixel of a row of the picture, (2 w, n, 3)."""
    for _ in range(HEIGHT):
        data = stream.read(4 * 2 * WIDTH * lamps * 3)
        if len(data) != 4 * 2 * WIDTH * lamps * 3:
            raise SystemExit("rcontrib returned too few records")
        yield np.frombuffer(data, np.float32).reshape(2 * WIDTH, lamps, 3)


def radiance_tools() -> Path:
    """Return the folder of Radiance's programs."""
    try:
        import pyradiance
    except ImportError:
        raise SystemExit("this comparison needs Radiance: pip install pyradiance") from None
    return Path(str(pyradiance.__file__)).parent / "bin"


def vertical_field() -> float:
    """Return the vertical field of view in degrees, for square pixels."""
    return float(2 * np.degrees(np.arctan(np.tan(np.radians(FIELD / 2)) * HEIGHT / WIDTH)))


def walls() -> Iterator[tuple[str, Quad]]:
    """Yield surface and corners of each wall and each side of a block, (4, 3), which turn
    anticlockwise for whom they face.
    """
    faces = {
        "floor": [(-X, -Y, -Z), (-X, -Y, Z), (X, -Y, Z), (X, -Y, -Z)],
        "ceiling": [(-X, Y, -Z), (X, Y, -Z), (X, Y, Z), (-X, Y, Z)],
        "left": [(-X, -Y, -Z), (-X, Y, -Z), (-X, Y, Z), (-X, -Y, Z)],
        "right": [(X, -Y, -Z), (X, -Y, Z), (X, Y, Z), (X, Y, -Z)],
    }
    for name, corners in faces.items():
        yield name, np.array(corners)
    for z, turn in ((Z, 1), (-Z, -1)):
        corners = [(-X, -Y, z), (-X, Y, z), (X, Y, z), (X, -Y, z)]
        yield "ends", np.array(corners[::turn])
    for centre, half in BLOCKS:
        for axis in range(3):
            for side in (-1, 1):
                first, second = [a for a in range(3) if a != axis]
                block = np.array([centre] * 4)
                block[:, axis] += side * half[axis]
                block[:, first] += np.array([-1, 1, 1, -1]) * half[first]
                block[:, second] += np.array([-1, -1, 1, 1]) * half[second]
                yield "ends", block[:: side * (-1 if axis == 1 else 1)]


def lamps_of(count: int) -> Iterator[Quad]:
    """Yield the corners of each lamp, (4, 3), which face down from below the ceiling."""
    columns = max(1, round((count * X / Z) ** 0.5))
    rows = -(-count // columns)
    distance = min(2 * X / columns, 2 * Z / rows)
    half = LAMP_SHARE * distance
    for k in range(count):
        row, column = divmod(k, columns)
        x = -X + 2 * X * (column + 0.5) / columns
        z = -Z + 2 * Z * (row + 0.5) / rows
        sides = np.array([(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)]) * half
        yield sides + np.array((x, Y - GAP, z))


def write_radiance(folder: Path, count: int) -> Path:
    """Write the room for Radiance, and return its octree, beside a list of the lamps."""
    lines = []
    for name, colour in SURFACES.items():
        lines.append(f"void plastic {name} 0 0 5 {_numbers(colour)} 0 0")
    for k, (name, corners) in enumerate(walls()):
        lines.append(f"{name} polygon wall_{k} 0 0 12 {_numbers(corners)}")
    for k, corners in enumerate(lamps_of(count)):
        lines.append(f"void light lamp_{k} 0 0 3 1 1 1")
        lines.append(f"lamp_{k} polygon square_{k} 0 0 12 {_numbers(corners)}")
    room, octree = folder / "room.rad", folder / "room.oct"
    room.write_text("\n".join(lines) + "\n", encoding="ascii")
    names = "\n".join(f"lamp_{k}" for k in range(count))
    octree.with_suffix(".lamps").write_text(names + "\n", encoding="ascii")
    with octree.open("wb") as file:
        subprocess.run([str(radiance_tools() / "oconv"), str(room)], stdout=file, check=True)
    return octree


def write_mitsuba(folder: Path, count: int) -> Scene:
    """Write the room for Mitsuba, and load it."""
    lamps = [
        _rectangle(corners, (0, 0, 0), f'<emitter type="area" id="lamp_{k}"/>')
        for k, corners in enumerate(lamps_of(count))
    ]
    scene = load_scene(write_walls(folder, lamps, BOUNCES + 2))
    assert len(scene.lights) == count
    return scene


def write_walls(folder: Path, lamps: Sequence[str], max_depth: int) -> Path:
    """Write the room with lamps, as XML, for Mitsuba, and return its path."""
    shapes = [_rectangle(corners, SURFACES[name], "") for name, corners in walls()] + [*lamps]
    path = folder / "room.xml"
    newline = "\n"
    path.write_text(
        f"""<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="{max_depth}"/></integrator>
    <sensor type="perspective"><float name="fov" value="{FIELD}"/>
        <transform name="to_world"><lookat origin="0, 0, -5.8" target="0, 0, 0" up="0, 1, 0"/>
        </transform>
        <film type="hdrfilm"><integer name="width" value="{WIDTH}"/>
        <integer name="height" value="{HEIGHT}"/></film></sensor>
    {newline.join(shapes)}
</scene>
""",
        encoding="utf-8",
    )
    return path


def _rectangle(corners: Quad, colour: tuple[float, ...], emitter: str) -> str:
    """Return a shape that faces where its corners turn anticlockwise."""
    centre = corners.mean(axis=0)
    along, up = (corners[1] - corners[0]) / 2, (corners[3] - corners[0]) / 2
    normal = np.cross(along, up)
    matrix = np.stack([along, up, normal / np.linalg.norm(normal), centre], axis=1)
    values = _numbers(np.vstack([matrix, (0, 0, 0, 1)]))
    return (
        f'<shape type="rectangle"><transform name="to_world"><matrix value="{values}"/></transform>'
        f'<bsdf type="diffuse"><rgb name="reflectance" value="{_numbers(colour)}"/></bsdf>'
        f"{emitter}</shape>"
    )


def _numbers(values: npt.ArrayLike) -> str:
    return " ".join(f"{value:.9g}" for value in np.ravel(values))


if __name__ == "__main__":
    main()
