"""Radiance 6, which pyradiance brings: light of a luminaire at points of an empty space."""

import subprocess
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


def _programs() -> Path:
    return Path(pytest.importorskip("pyradiance").__file__).parent / "bin"


def _run(command: list[object], folder: Path, given: str = "") -> bytes:
    texts = [str(part) for part in command]
    library = {"RAYPATH": f".:{Path(texts[0]).parent.parent / 'lib'}"}
    return subprocess.run(
        texts, cwd=folder, input=given.encode(), capture_output=True, check=True, env=library
    ).stdout
