"""Light distributions of our own making, and files of them as makers of luminaires write them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.arrays import Doubles

#: Candela by plane and angle from the nadir, both in degrees.
Distribution = Callable[[Doubles, Doubles], Doubles]


def cosine(plane: Doubles, gamma: Doubles) -> Doubles:
    """A lamp of 1000 cd that is equally bright from all sides of its flat opening."""
    return 1000 * np.maximum(np.cos(np.radians(gamma)), 0) + 0 * plane


def batwing(plane: Doubles, gamma: Doubles) -> Doubles:
    """A lamp that is brightest at 40 degrees, the same in all planes, and dark from 90 on."""
    g = np.radians(gamma)
    return np.where(gamma < 90, (400 + 900 * np.sin(2 * g) ** 2) * np.cos(g), 0) + 0 * plane


def trough(plane: Doubles, gamma: Doubles) -> Doubles:
    """A long lamp: wide along C0, narrow along C90, and equal in all four quadrants."""
    wide = 1.2 + 0.6 * np.cos(2 * np.radians(plane))
    return 800 * np.maximum(np.cos(np.radians(gamma)), 0) ** (2 / wide)


def street(plane: Doubles, gamma: Doubles) -> Doubles:
    """A lamp without any symmetry, brightest towards C65, with some light upwards."""
    aside = 0.7 * np.cos(np.radians(plane - 65)) + 0.2 * np.cos(2 * np.radians(plane - 20))
    towards = 1 + np.sin(np.radians(gamma)) * aside
    return 500 * towards * (0.05 + np.maximum(np.cos(np.radians(0.8 * gamma)), 0) ** 2)


def table_of(light: Distribution, planes: Sequence[float], gammas: Sequence[float]) -> Doubles:
    """The candela (c, g) of a distribution at some planes and angles."""
    return light(np.array(planes, float)[:, None], np.array(gammas, float)[None, :])


def ies_text(
    light: Distribution,
    planes: Sequence[float] = (0.0,),
    gammas: Iterable[float] = np.arange(0, 90.1, 2.5),
    *,
    edition: str = "IESNA:LM-63-2002",
    tilt: str = "TILT=NONE",
    lamps: str = "1 -1",
    multiplier: float = 1.0,
    unit: int = 2,
    sizes: Sequence[float] = (0, 0, 0),
    factors: Sequence[float] = (1, 1),
    watts: float = 25,
    kind: int = 1,
) -> str:
    """A file in LM-63. The candela in it are those of `light` before all factors."""
    angles = list(gammas)
    head = [
        edition,
        "[TEST] made by a test",
        "[LUMINAIRE] A lamp",
        tilt,
        f"{lamps} {multiplier:g} {len(angles)} {len(planes)} {kind} {unit} {_row(sizes)}",
        f"{_row(factors)} {watts:g}",
    ]
    rows = [angles, planes, *table_of(light, planes, angles)]
    return "\r\n".join([*filter(None, head), *map(_row, rows)]) + "\r\n"


#: Planes that a EULUMDAT file lists by the number of its symmetry, of steps of 15 degrees.
LISTED: Mapping[int, Sequence[float]] = {
    0: np.arange(0, 360, 15).tolist(),
    1: [0.0],
    2: np.arange(0, 181, 15).tolist(),
    3: [*np.arange(270, 360, 15).tolist(), *np.arange(0, 91, 15).tolist()],
    4: np.arange(0, 91, 15).tolist(),
}


def ldt_text(light: Distribution, symmetry: int, *, flux: float = 2000, **lines: Any) -> str:
    """A EULUMDAT file. lines: others than usual ones, `line_24="2"`."""
    gammas = np.arange(0, 180.1, 5)
    planes = np.arange(0, 360, 15)
    table = 1000 / flux * table_of(light, LISTED[symmetry], gammas.tolist())
    head = {
        **dict.fromkeys(range(1, 43), "0"),
        **{1: "Möller Leuchten", 2: "1", 3: f"{symmetry}", 4: f"{len(planes)}", 5: "15"},
        **{6: f"{len(gammas)}", 7: "5", 9: "Größe 3", 13: "620", 14: "300", 16: "600", 17: "250"},
        **{22: "100", 23: "0", 24: "1", 26: "1", 27: "2", 28: "LED", 29: f"{flux:g}", 32: "18,5"},
        **{int(key.removeprefix("line_")): value for key, value in lines.items()},
    }
    values = [*planes, *gammas, *table.ravel()]
    return "\r\n".join([*(head[k] for k in range(1, 43)), *(f"{x:.9g}" for x in values)]) + "\r\n"


def write_web(path: Path, text: str) -> Path:
    """Write the text of a web in the encoding of such files."""
    path.write_bytes(text.encode("latin-1"))
    return path


def _row(values: Iterable[float]) -> str:
    return " ".join(f"{x:.10g}" for x in values)
