"""A room whose lamps have three LEDs each, of known spectra."""

from pathlib import Path

import numpy as np
from renderer import LIGHTS, write_room

LEVELS = {"red": 4.0, "green": 8.0, "blue": 1.5}
PEAKS = {"red": (630, 12), "green": (525, 16), "blue": (455, 12)}
DRIVES = {"panel": (0.5, 0.2, 0.7), "bulb": (0.1, 0.3, 0.0)}


def write_spectral_room(folder: Path) -> Path:
    """Write room.xml with a lamp for each of DRIVES, its lights file, and a sky that stays."""
    path = write_room(folder, lights="".join(LIGHTS[x] for x in ("panel", "bulb", "sky")))
    waves = np.arange(380, 781, 5.0)
    for name, (peak, width) in PEAKS.items():
        table = np.stack([waves, np.exp(-0.5 * ((waves - peak) / width) ** 2)], axis=1)
        np.savetxt(folder / f"{name}.csv", table, delimiter=",")
    emitters = ", ".join(
        f'{{name = "{x}", spectrum = "{x}.csv", Y = {y}}}' for x, y in LEVELS.items()
    )
    tables = "".join(f"[light.{lamp}]\nemitters = [{emitters}]\n" for lamp in DRIVES)
    (folder / "room.lights.toml").write_text('lights = ["panel", "bulb"]\n' + tables)
    return path
