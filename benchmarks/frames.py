"""How much the tie between painted frames of a shot helps, and harms.

    LIGHTPAINT_BPY=PYTHON python benchmarks/frames.py [--shot FOLDER]

Renders a shot of 24 frames with light groups at 96 x 54 in Blender, kept in FOLDER if given. Known
weights change over it. Four inexact paintings of 2, 4 or 6 frames, of one half of the picture each,
are solved with ties of several strengths. Prints the RMS error of all frames in display values, and
the error of the change of weights per frame, relative to the light, both times 100: the numbers of
docs/method.md. Two cores take about two minutes.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter

import lightpaint as lp
from lightpaint.arrays import Doubles
from lightpaint.lighting.answer.lighting_keys import LightingKey, weights_at
from lightpaint.lighting.solver import solution_of, tie_frames

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from blender import blender_command, in_blender  # noqa: E402

SHOT = ROOT / "docs" / "images" / "frames_shot.py"
LAST, WIDTH, SAMPLES = 24, 96, 24
KEYS = ((1, 24), (1, 8, 16, 24), (1, 6, 11, 16, 20, 24))
TIES = (0, 1e-3, 1e-2, 1e-1)
SEEDS = 4

#: Standard deviation of the logarithm of a painting's error, and pixels over which it is alike.
PAINT_ERROR, ERROR_PIXELS = 0.15, 6

VIEW = lp.ViewTransform()


def true_weights(names: tuple[str, ...], frame: int) -> Doubles:
    """Return the weights (n, 3) at a frame: dusk falls, and a lamp comes up."""
    t = (frame - 1) / (LAST - 1)
    s = t * t * (3 - 2 * t)
    weights = {
        "key": np.ones(3) * (1 - 0.8 * s),
        "lamp": np.array([1, 0.8, 0.6]) * (0.5 + 2.5 * s),
        "rim": np.array([0.6, 0.7, 1]) * (0.3 + s),
        "fill": np.full(3, 0.4),
        "sky": np.array([0.6, 0.7, 1]) * (1 - 0.85 * s),
    }
    return np.array([weights[name] for name in names])


def painting(basis: lp.Basis, weights: Doubles, rng: np.random.Generator) -> lp.Target:
    """Return an inexact painting of half a picture."""
    light = basis.mix(weights)
    height, width, _ = light.shape
    error = gaussian_filter(rng.normal(size=light.shape), (ERROR_PIXELS, ERROR_PIXELS, 0))
    image = light * np.exp(error / error.std() * PAINT_ERROR)
    left = rng.integers(0, width // 2)
    importance = np.zeros((height, width), np.float32)
    importance[:, left : left + width // 2] = 1
    return lp.Target.of(image.astype(np.float32), importance, name="painting")


def errors(bases: dict[int, lp.Basis], keys: tuple[int, ...], seed: int) -> Doubles:
    """Return both errors for each tie, (ties, 2)."""
    rng = np.random.default_rng(seed)
    names = bases[1].names
    targets = {frame: painting(bases[frame], true_weights(names, frame), rng) for frame in keys}
    fit = lp.Fit(space="display", transform=VIEW)
    truth = np.array([true_weights(names, frame) for frame in bases])
    scale = np.sqrt(bases[LAST // 2].power)
    rows = []
    for tie in TIES:
        problems = [lp.Problem.of(bases[frame], targets[frame], fit=fit) for frame in keys]
        solutions = tie_frames([solution_of(x) for x in problems], keys, tie=tie)
        pairs = zip(keys, solutions, strict=True)
        found = [LightingKey(frame, tuple(map(tuple, x.weights))) for frame, x in pairs]
        weights = np.array([weights_at(found, frame) for frame in bases])
        squares = [
            np.square(VIEW.encode(basis.mix(w)) - VIEW.encode(basis.mix(t))).mean()
            for basis, w, t in zip(bases.values(), weights, truth, strict=True)
        ]
        change = (np.diff(weights, axis=0) - np.diff(truth, axis=0)) * scale
        light = np.square(truth * scale).sum(axis=(1, 2)).mean()
        flicker = np.sqrt(np.square(change).sum(axis=(1, 2)).mean() / light)
        rows.append((np.sqrt(squares).mean(), flicker))
    return np.array(rows)


def main() -> None:
    """Render the shot unless it is there, and print a table for each number of keys."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--shot", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = options.shot or Path(name)
        folder.mkdir(parents=True, exist_ok=True)
        if not (folder / f"shot.{LAST:04d}.exr").exists():
            frames = range(1, LAST + 1)
            in_blender(blender_command(), SHOT, folder, WIDTH, SAMPLES, *frames, variables={})
        shot = lp.find_frames(folder / "shot.####.exr")
        bases = {frame: lp.read_light_groups(shot.path(frame)).basis for frame in shot.frames}
    for keys in KEYS:
        mean = np.mean([errors(bases, keys, seed) for seed in range(SEEDS)], axis=0)
        for tie, (picture, flicker) in zip(TIES, 100 * mean, strict=True):
            print(f"{len(keys)} keys, tie {tie:g}: pictures {picture:.2f}, change {flicker:.2f}")


if __name__ == "__main__":
    main()
