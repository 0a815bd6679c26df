"""Makes the pictures of docs/tutorials/a-blender-shot.md, and its paintings.

    python docs/images/tutorials/blender_shot.py

Needs Blender. It renders three frames of a shot with light groups, paints over one and then over
two of them with the brush of targets/brush.py, solves, sets the lamps in Blender and renders again.
The paintings are written beside the tutorial. It prints what each command says. Two cores take
about six minutes.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
from PIL import Image
from steps import FILES, keep, lightpaint, row, work_folder

from brush import Canvas, Everywhere, Stroke  # isort: skip
from clean import Floats  # isort: skip

import lightpaint as lp
from lightpaint.images.denoiser import denoised
from lightpaint.images.formats.exr import read_parts

FRAMES = (1, 12, 24)
BLENDER = ("blender", "--background")
ROOM = ("--factory-startup", "--python", str(FILES / "room.py"), "--", "480", "64")
SAVE = "import bpy; bpy.ops.wm.save_mainfile()"

#: Glazes: multiplied with what is there.
LATE, NIGHT, LAMP = (1.0, 0.8, 0.55), (0.45, 0.62, 1.0), (1.0, 0.66, 0.34)


def blender(folder: Path, *words: str) -> None:
    """Run Blender in a folder."""
    print("$", *BLENDER, *words, flush=True)
    own = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    own["PWD"] = str(folder)  # by which it finds files
    run = subprocess.run(
        [*BLENDER, *words], cwd=folder, env=own, check=False, capture_output=True, text=True
    )
    print(run.stdout[-1500:] + run.stderr[-500:], run.returncode, flush=True)


def shown(light: Floats) -> Image.Image:
    """Return a picture without grain, as a display shows it."""
    display = np.clip(lp.ViewTransform().encode(denoised(light)), 0, 1)
    return Image.fromarray(np.rint(255 * display).astype(np.uint8))


def frames(folder: Path, name: str) -> Image.Image:
    """Return frames of a file's layer of the whole picture, beside each other."""
    return row(*(shown(read_parts(folder / f"{name}.{x:04d}.exr")[0].rgb()) for x in FRAMES))


def looks(folder: Path) -> Image.Image:
    """Return the frames as Blender has rendered them."""
    groups = (lp.read_light_groups(folder / f"shot.{x:04d}.exr").basis for x in FRAMES)
    return row(*(shown(basis.current_look) for basis in groups))


def canvas(folder: Path, frame: int) -> Canvas:
    """Write the template of a frame, and return a canvas over it."""
    lightpaint(folder, "template", f"shot.{frame:04d}.exr", "-o", f"template-{frame}")
    return Canvas.read_template(folder / f"template-{frame}" / "template.exr")


def paint_night(folder: Path, frame: int, path: Path) -> None:
    """Night, and the glow of the lamp on the wall behind the box."""
    over = canvas(folder, frame)
    over.glaze(Everywhere(), NIGHT, stops=-2.2)
    over.glaze(Stroke([(0.55, 0.42), (0.6, 0.5)], size=0.42), LAMP, stops=3)
    over.write_png(path)


def paint_late(folder: Path, frame: int, path: Path) -> None:
    """Late sun."""
    over = canvas(folder, frame)
    over.glaze(Everywhere(), LATE, stops=0.3)
    over.write_png(path)


def main() -> None:
    """Do the job once."""
    with work_folder("shot-work") as folder:
        blender(folder, *ROOM, *map(str, FRAMES))
        keep(looks(folder), "blender-1-shot")
        painting = folder / "template-12" / "night.0012.png"
        paint_night(folder, 12, painting)
        lights = sorted((folder / "template-12" / "lights").glob("*.png"))
        print([path.name for path in lights])
        small = [Image.open(path).convert("RGB").resize((420, 236)) for path in lights]
        keep(row(*small[:3]), "blender-2-lights")
        keep(Image.open(painting), "blender-3-painting")
        solve = ("solve", "shot.####.exr")
        lightpaint(folder, *solve, "template-12/night.0012.png", "--frames", "all", "-o", "one")
        print(sorted(path.name for path in (folder / "one").iterdir()))
        keep(frames(folder / "one", "relit"), "blender-4-one")
        (folder / "fall").mkdir()
        paint_late(folder, 1, folder / "fall" / "fall.0001.png")
        paint_night(folder, 24, folder / "fall" / "fall.0024.png")
        ends = (Image.open(folder / "fall" / f"fall.{x:04d}.png") for x in (1, 24))
        keep(row(*ends), "blender-5-two-paintings")
        animate = ("fall/fall.####.png", "--animate", "--frames", "all", "-o", "keyed")
        lightpaint(folder, *solve, *animate)
        print(sorted(path.name for path in (folder / "keyed").iterdir()))
        keep(frames(folder / "keyed", "relit"), "blender-6-keyed")
        for path in (painting, *(folder / "fall").glob("*.png")):
            shutil.copy(path, FILES / path.name)
            print(path.name, path.stat().st_size)
        set_lights = ("--python", "keyed/set_lights.py", "--python-expr", SAVE)
        blender(folder, "room.blend", *set_lights)
        blender(folder, "room.blend", "--render-output", "//again.####.exr", "--render-frame", "12")
        again = shown(lp.read_light_groups(folder / "again.0012.exr").basis.current_look)
        predicted = shown(read_parts(folder / "keyed" / "relit.0012.exr")[0].rgb())
        keep(row(predicted, again), "blender-7-again")


if __name__ == "__main__":
    main()
