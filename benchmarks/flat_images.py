"""Measure how smooth the images of walls and slides should be pulled to be, by known ones.

    python benchmarks/flat_images.py [--strengths 0 1e-5 1e-4 1e-3 1e-2] [--spp 64]

Two images of 64 x 36 pixels, a sunset and two panels, shine from the LED wall of the stage, among
its other lights, at 160 x 90 pixels, and from a projector onto the ball of image_lights.py, 96 x 72
pixels. Each is solved for in 16x9 texels, from an even image: the wall by its light alone, and with
what the camera sees of it. A row for each strength of the pull to a smooth image has geometric
means over both images of

- the share of the target's energy that the prediction misses, where it counts,
- the error of the solved image against the known one in the same texels, relative to that, where
  the picture shows them.

A star marks the strength that solves use.
"""

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from image_lights import MATERIALS, SCENE, TARGET_SPP, map_error

import lightpaint as lp
from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.lights import light_images
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.loss import weight_penalty
from lightpaint.scene.scene_render import Stream, render

STAGE = Path(__file__).parents[1] / "scenes" / "stage"
#: Columns and rows of texels, and of known images.
TEXELS, PIXELS = (16, 9), (64, 36)
WALL = """<scene version="3.0.0"><include filename="scene.xml"/>
    <shape type="rectangle" id="wall"><transform name="to_world"><scale x="4.8" y="2.7"/>
    <translate x="0" y="3.0" z="-6.0"/></transform>
    <bsdf type="diffuse"><rgb name="reflectance" value="0.03 0.03 0.03"/></bsdf>
    <emitter type="area">{image}</emitter></shape></scene>"""
PROJECTOR = """<emitter type="projector" id="slide"><transform name="to_world">
    <lookat origin="1, 2.5, 4" target="0, 0.5, 0" up="0, 1, 0"/></transform>
    <float name="fov" value="40"/>{image}</emitter></scene>"""
IMAGE = """<texture type="bitmap" name="{parameter}"><string name="filename" value="{file}"/>
    <boolean name="raw" value="true"/><string name="wrap_mode" value="clamp"/></texture>"""


def known_images() -> dict[str, Doubles]:
    """Return the images by name, (rows, columns, 3), the first row at the top."""
    columns, rows = PIXELS
    x, y = np.meshgrid((np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows)
    down = y[..., None]
    sunset = (1 - down) * np.array([0.15, 0.3, 0.8]) + down * np.array([1.2, 0.5, 0.2])
    distance = np.hypot((x - 0.7) * columns / rows, y - 0.65)[..., None]
    sunset = sunset + np.exp(-((distance / 0.12) ** 2)) * np.array([8.0, 5.0, 2.0])
    panels = np.full((rows, columns, 3), 0.05)
    panels[(abs(x - 0.25) < 0.12) & (abs(y - 0.4) < 0.25)] = 4.0, 3.4, 2.6
    panels[(abs(x - 0.75) < 0.08) & (abs(y - 0.55) < 0.3)] = 0.8, 1.6, 3.2
    return {"sunset": sunset, "panels": panels}


def write_scenes(folder: Path) -> None:
    """Write the scenes with each known image, and with an even one."""
    for part in ("scene.xml", "meshes", "textures"):
        (folder / part).symlink_to(STAGE / part)
    ball = SCENE[: SCENE.index("<emitter")].format(material=MATERIALS["diffuse"])
    even = np.full((PIXELS[1], PIXELS[0], 3), 0.5)
    for name, image in {"even": even, **known_images()}.items():
        # The first row of a rectangle's file is the lowest.
        write_rgb(folder / f"wall_{name}.exr", image[::-1].astype(np.float32))
        write_rgb(folder / f"slide_{name}.exr", 10 * image.astype(np.float32))
        wall = IMAGE.format(parameter="radiance", file=f"wall_{name}.exr")
        slide = IMAGE.format(parameter="irradiance", file=f"slide_{name}.exr")
        (folder / f"wall_{name}.xml").write_text(WALL.format(image=wall))
        (folder / f"slide_{name}.xml").write_text(ball + PROJECTOR.format(image=slide))


def measured(
    basis: Basis, known: Doubles, target: Floats, emitters: str, strength: float
) -> tuple[float, float]:
    """Return the missed share of the light of a known image, and the error of the solved one."""
    [image] = light_images(basis.lights)
    weight_penalty.SMOOTHNESS = strength / image.domain.smoothness
    solution = lp.solve(
        basis, lp.Target.of(target), space="linear", colors="free", emitters=emitters
    )
    counted = solution.importance > 0
    difference = (lp.combine(basis, solution.lighting).image - target)[counted]
    missed = float((difference**2).sum() / (target[counted] ** 2).sum())
    solved = solution.weights[image.places]
    return missed, map_error(image, basis, solved, image.domain.coarse(known, TEXELS))[0]


def rows_of(folder: Path, strengths: list[float], spp: int) -> Iterator[str]:
    """Yield the rows of the table."""
    used = {"wall": 0.0, "slide": 0.0}
    cases, errors = (("wall", "skip"), ("wall", "count"), ("slide", "skip")), {}
    for light in used:
        scene = lp.load_scene(folder / f"{light}_even.xml", split={light: TEXELS})
        scene = scene.reduced("160x90") if light == "wall" else scene
        basis = lp.render_basis(scene, spp=spp)
        [image] = light_images(basis.lights)
        used[light] = image.domain.smoothness * weight_penalty.SMOOTHNESS
        for name, known in known_images().items():
            lit = lp.load_scene(folder / f"{light}_{name}.xml")
            lit = lit.reduced("160x90") if light == "wall" else lit
            target = render(lit, spp=TARGET_SPP, seed=5, stream=Stream.TEMPLATE).image
            factor = 10 if light == "slide" else 1
            default = weight_penalty.SMOOTHNESS
            for case in (x for x in cases if x[0] == light):
                for strength in strengths:
                    error = measured(basis, factor * known, target, case[1], strength)
                    errors.setdefault((case, strength), []).append(error)
            weight_penalty.SMOOTHNESS = default
    for strength in strengths:
        cells = []
        for case in cases:
            missed, error = np.exp(np.log(errors[case, strength]).mean(axis=0))
            star = "*" if np.isclose(strength, used[case[0]]) else ""
            cells.append(f"{missed:.4f}, {error:.2f}{star}")
        yield (
            f"| {strength:.0e} | {' | '.join(cells)} |"
            if strength
            else (f"| none | {' | '.join(cells)} |")
        )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--strengths", nargs="+", type=float, default=[0, 1e-5, 1e-4, 1e-3, 1e-2])
    parser.add_argument("--spp", type=int, default=64)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        write_scenes(Path(name))
        print("| smooth | wall, light alone: picture, map | in view | slide |\n|---|---|---|---|")
        for row in rows_of(Path(name), options.strengths, options.spp):
            print(row, flush=True)


if __name__ == "__main__":
    main()
