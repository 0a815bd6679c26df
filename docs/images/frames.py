"""Makes the picture of a shot with lights that change, which docs/light-groups.md shows.

    LIGHTPAINT_BPY=PYTHON python docs/images/frames.py

Needs Blender, or its module bpy in that Python. It renders five frames of a shot with light groups,
paints the first and the last as dusk falls, and solves as the document says. Two cores take about
five minutes.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

import lightpaint as lp
from lightpaint.arrays import Floats
from lightpaint.cli import main as lightpaint
from lightpaint.images.denoiser import denoised
from lightpaint.images.formats.exr import read_parts

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent.parent / "tests"))

from blender import blender_command, in_blender  # noqa: E402

FRAMES = (1, 6, 12, 18, 24)
WIDTH, SAMPLES, GAP = 320, 48, 6
VIEW = lp.ViewTransform()


def seen(light: Floats) -> Floats:
    """Return a picture without grain, as a display shows it, (h, w, 3)."""
    return VIEW.encode(denoised(light))


def painted(look: Floats, frame: int) -> Floats:
    """Return the painting of a frame: late sun in the first, and a lamp at night in the last."""
    if frame == FRAMES[0]:
        return look * np.array([1.25, 1.05, 0.8])
    height, width = look.shape[:2]
    y, x = np.mgrid[:height, :width] / width
    glow = np.exp(-(((x - 0.55) / 0.17) ** 2) - ((y - 0.27) / 0.17) ** 2)[..., None]
    return look * (np.array([0.08, 0.12, 0.24]) + 1.6 * glow * np.array([1, 0.62, 0.25]))


def main() -> None:
    """Render, paint, solve, and draw three rows of frames."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        in_blender(
            blender_command(),
            HERE / "frames_shot.py",
            folder,
            WIDTH,
            SAMPLES,
            *FRAMES,
            variables={},
        )
        os.chdir(folder)
        shot = lp.find_frames("shot.####.exr")
        looks = {x: lp.read_light_groups(shot.path(x)).basis.current_look for x in FRAMES}
        paintings = {x: seen(painted(denoised(looks[x]), x)) for x in (FRAMES[0], FRAMES[-1])}
        for frame, picture in paintings.items():
            as_bytes(picture).save(f"dusk.{frame:04d}.png")
        words = ["solve", "shot.####.exr", "dusk.####.png", "--animate", "--frames", "all"]
        assert lightpaint([*words, "--colors", "free"]) == 0
        dusk = [seen(read_parts(Path(f"dusk/relit.{x:04d}.exr"))[0].rgb()) for x in FRAMES]
    empty = np.full_like(dusk[0], 1.0)
    rows = [
        [seen(looks[x]) for x in FRAMES],
        [paintings.get(x, empty) for x in FRAMES],
        dusk,
    ]
    as_bytes(sheet(rows)).save(HERE / "frames.jpg", quality=88)


def sheet(rows: list[list[Floats]]) -> Floats:
    """Return pictures in rows, with white gaps."""

    def joined(pictures: list[Floats], axis: int) -> Floats:
        shape = list(pictures[0].shape)
        shape[axis] = GAP
        gap = np.ones(shape)
        parts = [part for picture in pictures for part in (picture, gap)]
        return np.concatenate(parts[:-1], axis=axis)

    return joined([joined(row, 1) for row in rows], 0)


def as_bytes(display: Floats) -> Image.Image:
    """Return display values from 0 to 1 as a picture."""
    return Image.fromarray((np.clip(display, 0, 1) * 255 + 0.5).astype(np.uint8))


if __name__ == "__main__":
    main()
