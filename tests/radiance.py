"""Radiance 6, which pyradiance brings: luminaires in empty space, and in rooms."""

import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from lightpaint.arrays import Doubles

#: Lumens per watt by which Radiance divides, and weights of its channels in photometric sums.
EFFICACY, WEIGHTS = 179.0, (0.265, 0.670, 0.065)


def illuminance(
    web: Path, points: Doubles, normals: Doubles, place: tuple[float, float, float], *, turn: float
) -> Doubles:
    """The lux (n,) of a luminaire that hangs at `place`, turned by degrees about its axis.

    web: an IES file. points, normals: (n, 3).
    """
    programs = _programs()
    folder = web.parent / f"radiance {web.stem} {turn:g}"
    folder.mkdir()
    _run([programs / "ies2rad", "-dm", "-o", "lamp", web], folder)
    hung = ["-rz", f"{turn:.9g}", "-t", *(f"{x:.9g}" for x in place)]
    (folder / "scene.rad").write_bytes(_run([programs / "xform", *hung, "lamp.rad"], folder))
    (folder / "scene.oct").write_bytes(_run([programs / "oconv", "scene.rad"], folder))
    rows = "\n".join(" ".join(f"{x:.9g}" for x in row) for row in np.hstack([points, normals]))
    direct = ["-I", "-h", "-ab", "0", "-dj", "0", "-ds", "0"]
    found = _run([programs / "rtrace", *direct, "scene.oct"], folder, rows)
    return EFFICACY * np.array(found.split(), float).reshape(-1, 3) @ WEIGHTS


@dataclass(frozen=True)
class Hung:
    """A luminaire: its IES file, its place, degrees about its axis, and its drive."""

    web: Path
    place: tuple[float, float, float]
    turn: float
    drive: float


def illuminance_in_room(
    folder: Path,
    size: tuple[float, float, float],
    reflectances: tuple[float, float, float],
    lamps: Sequence[Hung],
    points: Doubles,
    normals: Doubles,
    *,
    bounces: int,
    rays: int,
) -> Doubles:
    """The lux (n,) of luminaires in a room from (0, 0, 0) to `size` with diffuse walls.

    reflectances: of floor, walls and ceiling. bounces: reflections that are followed, with so many
    rays at the first.
    """
    programs = _programs()
    folder.mkdir()
    parts = [_room(size, reflectances).encode()]
    for k, lamp in enumerate(lamps):
        scaled = ["-m", f"{lamp.drive:.9g}"]
        _run([programs / "ies2rad", "-dm", *scaled, "-o", f"lamp{k}", lamp.web], folder)
        hung = ["-rz", f"{lamp.turn:.9g}", "-t", *(f"{x:.9g}" for x in lamp.place)]
        parts.append(_run([programs / "xform", *hung, f"lamp{k}.rad"], folder))
    (folder / "scene.rad").write_bytes(b"\n".join(parts))
    (folder / "scene.oct").write_bytes(_run([programs / "oconv", "scene.rad"], folder))
    rows = "\n".join(" ".join(f"{x:.9g}" for x in row) for row in np.hstack([points, normals]))
    options = ["-I", "-h", "-ab", bounces, "-ad", rays, "-aa", "0", "-lw", "1e-6", "-lr", "0"]
    found = _run([programs / "rtrace", *options, "-dj", "0", "-ds", "0", "scene.oct"], folder, rows)
    return EFFICACY * np.array(found.split(), float).reshape(-1, 3) @ WEIGHTS


def _room(size: tuple[float, float, float], reflectances: tuple[float, float, float]) -> str:
    """Polygons of a room."""
    x, y, z = size
    names = ("floor", "wall", "ceiling")
    materials = [
        f"void plastic {name} 0 0 5 {value} {value} {value} 0 0"
        for name, value in zip(names, reflectances, strict=True)
    ]
    corners = {
        "floor floor": [(0, 0, 0), (x, 0, 0), (x, y, 0), (0, y, 0)],
        "ceiling ceiling": [(0, 0, z), (0, y, z), (x, y, z), (x, 0, z)],
        "wall south": [(0, 0, 0), (0, 0, z), (x, 0, z), (x, 0, 0)],
        "wall north": [(0, y, 0), (x, y, 0), (x, y, z), (0, y, z)],
        "wall west": [(0, 0, 0), (0, y, 0), (0, y, z), (0, 0, z)],
        "wall east": [(x, 0, 0), (x, 0, z), (x, y, z), (x, y, 0)],
    }
    polygons = [
        f"{name.split()[0]} polygon {name.split()[1]} 0 0 12 "
        + " ".join(f"{value:g}" for corner in places for value in corner)
        for name, places in corners.items()
    ]
    return "\n".join([*materials, *polygons])


def _programs() -> Path:
    return Path(pytest.importorskip("pyradiance").__file__).parent / "bin"


def _run(command: list[object], folder: Path, given: str = "") -> bytes:
    texts = [str(part) for part in command]
    library = {"RAYPATH": f".:{Path(texts[0]).parent.parent / 'lib'}"}
    return subprocess.run(
        texts, cwd=folder, input=given.encode(), capture_output=True, check=True, env=library
    ).stdout


def illuminance_of_panel(
    folder: Path, side: float, height: float, radiance: float, points: Doubles
) -> Doubles:
    """The lux (n,), as Radiance's programs count them, of a panel of that radiance in W/(m² sr).

    It hangs in the middle of nothing, at (0, 0, height), and faces down; points look up.
    """
    programs = _programs()
    folder.mkdir()
    half, level = side / 2, " ".join([f"{radiance:.9g}"] * 3)
    corners = [f"{i * half} {j * half} {height}" for i, j in ((-1, -1), (-1, 1), (1, 1), (1, -1))]
    text = f"void light lit 0 0 3 {level}\nlit polygon panel 0 0 12 {' '.join(corners)}\n"
    (folder / "scene.rad").write_text(text, encoding="ascii")
    (folder / "scene.oct").write_bytes(_run([programs / "oconv", "scene.rad"], folder))
    rows = "\n".join(" ".join(f"{x:.9g}" for x in (*point, 0, 0, 1)) for point in points)
    direct = ["-I", "-h", "-ab", "0", "-dj", "0", "-ds", "0.05"]
    found = _run([programs / "rtrace", *direct, "scene.oct"], folder, rows)
    return EFFICACY * np.array(found.split(), float).reshape(-1, 3) @ WEIGHTS


def unified_glare_rating(
    folder: Path,
    size: tuple[float, float, float],
    reflectances: tuple[float, float, float],
    panels: Sequence[tuple[tuple[float, float, float], float, float]],
    eye: tuple[float, float, float],
    ahead: tuple[float, float, float],
    *,
    pixels: int,
    threshold: float,
) -> float:
    """The UGR that evalglare finds in a picture of 180 degrees, in a room as above.

    panels: of each its middle, its side in metres, and its luminance in cd/m²; they face down.
    threshold: luminance in cd/m² between walls and panels.
    """
    programs = _programs()
    folder.mkdir()
    parts = [_room(size, reflectances)]
    for k, ((x, y, z), side, luminance) in enumerate(panels):
        signs = ((-1, -1), (-1, 1), (1, 1), (1, -1))
        corners = [f"{x + i * side / 2:g} {y + j * side / 2:g} {z:g}" for i, j in signs]
        level = " ".join([f"{luminance / EFFICACY:.9g}"] * 3)
        parts.append(f"void light lit{k} 0 0 3 {level}")
        parts.append(f"lit{k} polygon panel{k} 0 0 12 {' '.join(corners)}")
    (folder / "scene.rad").write_text("\n".join(parts) + "\n", encoding="ascii")
    (folder / "scene.oct").write_bytes(_run([programs / "oconv", "scene.rad"], folder))
    view = ["-vta", "-vp", *eye, "-vd", *ahead, "-vu", 0, 0, 1, "-vh", 180, "-vv", 180]
    rays = ["-ps", 1, "-ab", 5, "-ad", 256, "-as", 64, "-aa", 0.2, "-ar", 16, "-ds", 0.2]
    size_options = ["-x", pixels, "-y", pixels]
    picture = _run([programs / "rpict", *view, *size_options, *rays, "scene.oct"], folder)
    (folder / "view.hdr").write_bytes(picture)
    found = _run([programs / "evalglare", "-b", threshold, "-d", "view.hdr"], folder).decode()
    names, values = found.strip().splitlines()[-1].split(": ")
    return float(values.split()[names.split(",").index("ugr")])
