"""A room whose lamps have three LEDs each, of known spectra, and a painting of it."""

from pathlib import Path

import numpy as np
from renderer import LIGHTS, write_room

from lightpaint.basis.render.basis_render import render_basis
from lightpaint.basis.render.rendered_basis import basis_lights
from lightpaint.colour.spectrum import EYE, Observer
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.lighting.unknowns.reduction import lamps_by_name
from lightpaint.scene.scene_reader import load_scene

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


def paint_spectral_room(path: Path, observer: Observer = EYE) -> Path:
    """Write the picture of DRIVES, as the observer sees it."""
    scene = load_scene(path)
    lamps = lamps_by_name(constraints_of(scene.requests), basis_lights(scene))
    basis = render_basis(scene.with_lamps(lamps, observer), spp=256, seed=3)
    weights = np.ones((len(basis.lights), 3))
    for lamp, drives in DRIVES.items():
        for (name, level), drive in zip(LEVELS.items(), drives, strict=True):
            weights[basis.names.index(f"{lamp}/{name}")] = level * drive
    picture = path.with_name("painting.exr")
    write_rgb(picture, basis.mix(weights).astype(np.float32))
    return picture
