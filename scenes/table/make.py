"""Make the meshes, textures and the sky of the table: tea on a terrace, under an even sky.

    python scenes/table/make.py

needs numpy and OpenEXR, takes a second, and writes the same bytes every time. What things are made
of and how they are lit is in `scene.xml`, by hand. Lengths are in metres, y up; the table stands
at x = z = 0, the garden lies at -z, and left is the camera's.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import OpenEXR
from numpy.typing import NDArray

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))  # shapes.py lives one folder up

from shapes import (  # noqa: E402
    Floats,
    Mesh,
    ball,
    curve,
    join,
    lathe,
    rounded_box,
    sheet,
    tube,
    write_ply,
    write_png,
)

#: Height of the table's top, and its radius.
TOP, RADIUS = 0.74, 0.66
#: Where things stand on it: x and z.
POT, BOWL, CANDLE = (-0.13, -0.10), (0.27, -0.15), (-0.43, -0.20)
CUPS = {(0.15, 0.22): 35.0, (-0.32, 0.19): 160.0}


def on_table(mesh: Mesh, at: tuple[float, float], turn: float = 0.0) -> Mesh:
    """The mesh on the table's top."""
    return mesh.placed((at[0], TOP, at[1]), turn=turn)


def pipe(knots: list[tuple[float, float]], radii: tuple[float, float], sides: int = 12) -> Mesh:
    """A bent pipe in the plane z = 0, from one radius to another."""
    path = curve([(x, y, 0.0) for x, y in knots], 25)
    return tube(path, np.linspace(*radii, 25), sides=sides)


# --- The terrace ---------------------------------------------------------------------------


def terrace() -> Mesh:
    """Paving; u and v are metres over the 2 m that one tile of the texture covers."""
    x, z = np.meshgrid(np.linspace(-7, 7, 3), np.linspace(6, -2.7, 3))
    return sheet(np.stack([x, 0 * x, z], axis=-1), uv=np.stack([x, z], axis=-1) / 2)


def garden() -> Mesh:
    """A lawn below the terrace, out to where the haze is."""
    angle = np.linspace(0, 2 * np.pi, 49)
    far = np.array([0.0, 60.0])[::-1, None]
    points = np.stack([far * np.sin(angle), -1.1 + 0 * far * angle, far * np.cos(angle)], axis=-1)
    mesh = sheet(points)
    return Mesh(mesh.points, np.broadcast_to([0.0, 1.0, 0.0], mesh.points.shape), mesh.faces)


def balustrade() -> Mesh:
    """A stone rail on turned posts, along the edge of the terrace."""
    outline = [(0.0, 0.60), (0.06, 0.60), (0.06, 0.56), (0.032, 0.54), (0.036, 0.46), (0.075, 0.27),
               (0.082, 0.20), (0.05, 0.12), (0.04, 0.09), (0.065, 0.06), (0.065, 0.0)]  # fmt: skip
    post = lathe(outline, rings=25, turns=10)
    posts = [post.placed((x, 0.12, -2.35)) for x in np.arange(-2.34, 2.4, 0.26)]
    foot = rounded_box((6.0, 0.12, 0.24), radius=0.015).placed((0, 0, -2.35))
    rail = rounded_box((6.0, 0.09, 0.26), radius=0.02).placed((0, 0.72, -2.35))
    return join([*posts, foot, rail])


def table() -> Mesh:
    """A round top with a rounded edge on a turned foot; u and v are the top's own square."""
    edge = [(0.0, TOP), (0.3, TOP), (0.6, TOP), (RADIUS - 0.015, TOP), (RADIUS, TOP - 0.012),
            (RADIUS - 0.012, TOP - 0.03), (0.3, TOP - 0.034), (0.06, TOP - 0.05), (0.045, 0.5),
            (0.06, 0.25), (0.05, 0.12), (0.26, 0.05), (0.28, 0.0)]  # fmt: skip
    mesh = lathe(edge, rings=65, turns=80)
    # The smoothed outline is flat where it should be, and no less.
    points = mesh.points.copy()
    points[:, 1] = np.minimum(points[:, 1], TOP)
    uv = 0.5 + points[:, [0, 2]] / (2 * RADIUS + 0.04)
    return Mesh(points, mesh.normals, mesh.faces, uv)


def runner() -> Mesh:
    """A linen runner across the table, not quite flat, that hangs over its edge at both ends."""
    along, across = np.linspace(-0.82, 0.82, 125), np.linspace(0.2, -0.2, 31)[:, None]
    over = np.maximum(np.abs(along) - (RADIUS - 0.01), 0)
    x = np.sign(along) * np.minimum(np.abs(along), RADIUS - 0.01 + 0.25 * over)
    wrinkle = 0.0012 * np.sin(23 * along + 9 * across) * np.sin(17 * across + 5 * along)
    wrinkle = wrinkle + 0.001 * np.exp(-(((np.abs(along) - 0.33) / 0.006) ** 2))  # its folds
    y = TOP + 0.003 + wrinkle - 0.97 * over
    z = -0.02 + across + 0.006 * np.sin(7 * along) + 0 * along
    points = np.stack([x + 0 * across, y, z], axis=-1)
    return sheet(points)


# --- What stands on the table ---------------------------------------------------------------


def teapot() -> Mesh:
    """A pot with its lid and knob, a spout and a handle."""
    body = [(0.0, 0.222), (0.012, 0.220), (0.017, 0.208), (0.010, 0.196), (0.012, 0.188),
            (0.040, 0.178), (0.056, 0.168), (0.058, 0.164), (0.060, 0.158), (0.062, 0.152),
            (0.090, 0.130), (0.108, 0.095), (0.104, 0.060), (0.080, 0.026), (0.058, 0.016),
            (0.066, 0.004), (0.068, 0.0)]  # fmt: skip
    spout = pipe([(0.085, 0.055), (0.130, 0.068), (0.158, 0.105), (0.172, 0.145), (0.198, 0.172)],
                 (0.027, 0.011), 16)  # fmt: skip
    handle = pipe([(-0.082, 0.138), (-0.118, 0.158), (-0.160, 0.138), (-0.166, 0.090),
                   (-0.140, 0.055), (-0.098, 0.050)], (0.0085, 0.0075))  # fmt: skip
    return on_table(join([lathe(body, rings=97, turns=64), spout, handle]), POT, turn=28)


def cups() -> tuple[Mesh, Mesh]:
    """Cups on saucers, and the tea in them."""
    bowl = [(0.0, 0.008), (0.020, 0.009), (0.034, 0.026), (0.041, 0.060), (0.0425, 0.0635),
            (0.0440, 0.060), (0.038, 0.026), (0.026, 0.008), (0.024, 0.0)]  # fmt: skip
    plate = [(0.0, 0.005), (0.028, 0.005), (0.050, 0.009), (0.076, 0.018), (0.078, 0.0185),
             (0.076, 0.015), (0.048, 0.004), (0.044, 0.0)]  # fmt: skip
    ear = pipe([(0.038, 0.052), (0.056, 0.058), (0.067, 0.046), (0.060, 0.026), (0.036, 0.020)],
               (0.0040, 0.0036), 8)  # fmt: skip
    cup = join([lathe(bowl, rings=49, turns=40), ear]).placed((0, 0.005, 0))
    china = join([cup, lathe(plate, rings=41, turns=48)])
    tea = lathe([(0.0, 0.054), (0.02, 0.054), (0.0385, 0.054)], rings=7, turns=40)
    return (
        join([on_table(china, at, turn) for at, turn in CUPS.items()]),
        join([on_table(tea, at) for at in CUPS]),
    )


def spoon() -> Mesh:
    """A spoon in front of the cup, face up."""
    handle = curve(
        [(-0.02, 0.012, 0), (-0.05, 0.017, 0), (-0.09, 0.011, 0), (-0.125, 0.006, 0)], 19
    )
    stem = tube(handle, np.linspace(0.0022, 0.0042, 19), sides=8)
    bowl = lathe([(0.0, 0.001), (0.012, 0.003), (0.0185, 0.008), (0.0195, 0.0085), (0.019, 0.006),
                  (0.011, 0.0), (0.0, -0.001)], rings=33, turns=32)  # fmt: skip
    long = np.array([1.45, 1.0, 1.0])
    normals = bowl.normals / long
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    bowl = Mesh(bowl.points * long, normals, bowl.faces).placed((0, 0.005, 0))
    return on_table(join([stem, bowl]), (0.02, 0.30), turn=-24)


def bowl() -> Mesh:
    """A glazed bowl."""
    outline = [(0.0, 0.014), (0.050, 0.020), (0.098, 0.050), (0.128, 0.086), (0.1315, 0.089),
               (0.1340, 0.086), (0.106, 0.042), (0.060, 0.012), (0.056, 0.0)]  # fmt: skip
    return on_table(lathe(outline, rings=57, turns=56), BOWL)


def oranges() -> Mesh:
    """Oranges in the bowl, and one that rolled out of it."""
    x, z = BOWL
    heap = [(x + 0.047 * np.cos(a), 0.042, z + 0.047 * np.sin(a)) for a in (0.5, 2.6, 4.7)]
    places = [*heap, (x + 0.002, 0.098, z + 0.004), (0.42, 0.0, 0.075)]
    return join(
        [ball(0.043, rings=25, turns=36).placed((at[0], TOP + at[1], at[2])) for at in places]
    )


def candlestick() -> Mesh:
    """A brass stick (the candle is a mesh of its own, the flame is in scene.xml)."""
    outline = [(0.0, 0.160), (0.013, 0.160), (0.017, 0.156), (0.014, 0.142), (0.008, 0.128),
               (0.010, 0.080), (0.020, 0.062), (0.011, 0.044), (0.018, 0.022), (0.054, 0.010),
               (0.058, 0.0)]  # fmt: skip
    return on_table(lathe(outline, rings=65, turns=40), CANDLE)


def candle() -> Mesh:
    """A candle in the stick."""
    outline = [(0.0, 0.262), (0.0105, 0.261), (0.011, 0.256), (0.0115, 0.20), (0.012, 0.150)]
    return on_table(lathe(outline, rings=25, turns=24), CANDLE)


# --- Textures and the sky -------------------------------------------------------------------


def encode(linear: Floats) -> NDArray[np.uint8]:
    """Linear light as 8 bits of sRGB."""
    linear = np.clip(linear, 0, 1)
    shown = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.asarray(np.rint(255 * shown), np.uint8)


def paving(size: int = 384, slabs: int = 4) -> NDArray[np.uint8]:
    """2 m of stone slabs, each with its own tone; it tiles both ways."""
    rng = np.random.default_rng(5)
    place = np.arange(size) / size * slabs
    row = place.astype(int)
    column = (place[None, :] + 0.5 * (row[:, None] % 2)) % slabs
    tone = rng.normal(0, 0.10, (slabs, slabs))[row[:, None], column.astype(int)]
    hue = rng.normal(0, 0.03, (slabs, slabs))[row[:, None], column.astype(int)]
    wave = np.fft.rfft2(rng.normal(0, 1, (size, size)))
    far = np.hypot(np.fft.fftfreq(size)[:, None], np.fft.rfftfreq(size)) * size
    mottle = np.fft.irfft2(wave / (1 + (far / 6) ** 1.5), (size, size))
    light = np.exp2(tone + 0.10 * mottle / mottle.std())
    joint = np.minimum(*(np.abs(x - np.round(x)) for x in (place[:, None] + 0 * column, column)))
    light *= 0.55 + 0.45 * np.clip(joint * size / slabs / 2.5, 0, 1)
    color = np.array([0.34, 0.31, 0.27]) * (1 + hue[..., None] * np.array([1.0, 0.0, -1.0]))
    return encode(light[..., None] * color)


def walnut(size: int = 512, boards: int = 9) -> NDArray[np.uint8]:
    """The boards of the table's top."""
    rng = np.random.default_rng(8)
    across = np.arange(size) / size * boards
    board = across.astype(int)
    along = np.arange(size)[:, None] / size
    light = rng.normal(0, 0.16, boards)[board] + 0 * along
    bend = sum(rng.normal(0, 0.08 / n, boards)[board] * np.sin(2 * np.pi * n * along + n * board)
               for n in (1, 2, 3))  # fmt: skip
    for lines in (2.3, 5.1, 9.7, 17.3):
        phase = rng.uniform(0, 6, boards)[board]
        light = light + 0.10 * np.sin(2 * np.pi * lines * (across - board + bend) + phase)
    joint = np.abs(across - np.round(across)) * size / boards
    light = np.exp2(light) * (0.5 + 0.5 * np.clip(joint / 1.5, 0, 1))
    return encode(light[..., None] * np.array([0.155, 0.078, 0.042]))


def sky(width: int = 128, height: int = 64) -> Floats:
    """A thin overcast at noon, in the pixels of an environment map: brightest overhead."""
    polar = np.pi * np.arange(height)[:, None] / (height - 1)
    azimuth = 2 * np.pi * (np.arange(width) + 0.5) / width
    x, y, z = np.broadcast_arrays(
        np.sin(polar) * np.sin(azimuth), np.cos(polar), -np.sin(polar) * np.cos(azimuth)
    )
    cloud = sum(np.sin(n * (2.1 * x + 1.3 * z + 0.7 * y) + n * n) / n for n in (2, 3, 5, 7))
    above = (0.55 + 0.45 * np.clip(y, 0, 1)) * np.exp2(0.14 * cloud)
    blue = np.array([0.93, 0.985, 1.07])
    haze = np.clip(0.5 + y / 0.06, 0, 1)[..., None]
    return haze * above[..., None] * blue + (1 - haze) * np.array([0.16, 0.17, 0.14])


def write_exr(path: Path, image: Floats) -> None:
    """Write linear light as half floats, rounded to 8 significant bits, which makes small files."""
    mantissa, exponent = np.frexp(image)
    halves = np.ldexp(np.rint(mantissa * 256) / 256, exponent).astype(np.float16)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGB": np.ascontiguousarray(halves)}).write(str(path))


def main() -> None:
    """Write meshes, textures and the sky beside this file, and say how big each is."""
    for folder in ("meshes", "textures"):
        (HERE / folder).mkdir(exist_ok=True)
    china, tea = cups()
    meshes = {
        **{"terrace": terrace(), "garden": garden(), "balustrade": balustrade(), "table": table()},
        **{"runner": runner(), "teapot": teapot(), "china": china, "tea": tea, "spoon": spoon()},
        **{"bowl": bowl(), "oranges": oranges(), "candlestick": candlestick(), "candle": candle()},
    }
    written = []
    for name, mesh in meshes.items():
        written.append(HERE / "meshes" / f"{name}.ply")
        write_ply(written[-1], mesh)
    for name, image in {"paving": paving(), "walnut": walnut()}.items():
        written.append(HERE / "textures" / f"{name}.png")
        write_png(written[-1], image)
    written.append(HERE / "sky.exr")
    write_exr(written[-1], sky())
    for path in written:
        print(f"{path.name:18}{path.stat().st_size:8} bytes")
    print(f"{'together':18}{sum(path.stat().st_size for path in written):8} bytes")


if __name__ == "__main__":
    main()
