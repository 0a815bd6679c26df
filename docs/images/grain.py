"""Makes the crops of pictures without grain that docs/benchmarks.md shows.

    python docs/images/grain.py --before CHECKOUT [--long LONG.npz] [--to grain.webp]

shows planes of few samples as people see them, of this version and of an earlier one, and of many
samples, denoised as a whole: the edge of a shadow, a highlight on bronze and a dim light in
scenes/gallery on half the film, and the caustic of a glass ball. LONG.npz has planes of the gallery
with many samples, as benchmarks/noise.py keeps them; else they are rendered, which takes minutes.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from lightpaint import Scene, load_scene, render_basis
from lightpaint.images.denoiser import denoised
from lightpaint.scene.surfaces import render_features

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
SAMPLES = (2, 8, 32)
LONG_SPP, LONG_CAUSTIC_SPP = 768, 1024

#: Pixels of a crop, and screen pixels of each.
WIDTH, HEIGHT, SCALE = 64, 48, 3
GAP, HEAD, SIDE = 6, 22, 118


class Crop(NamedTuple):
    """A crop: its title, its light, where it is, and the percentile of its light that is white."""

    title: str
    light: str
    left: int
    top: int
    white: float = 99.0


GALLERY = (
    Crop("shadow", "spot_knot", 122, 120),
    Crop("highlight", "spot_knot", 164, 74, 97),
    Crop("dim light", "annex_lamp", 64, 86),
)
CAUSTIC = Crop("caustic", "lamp", 6, 24, 99.5)

GLASS = """<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="8"/></integrator>
    <sensor type="perspective"><float name="fov" value="42"/>
        <transform name="to_world"><lookat origin="0, 1.1, 4" target="0, .9, 0" up="0, 1, 0"/>
        </transform>
        <film type="hdrfilm"><integer name="width" value="96"/><integer name="height" value="72"/>
            <rfilter type="box"/></film></sensor>
    <bsdf type="diffuse" id="plaster"><rgb name="reflectance" value=".7 .68 .63"/></bsdf>
    <shape type="rectangle"><transform name="to_world"><scale value="4"/><rotate x="1" angle="-90"/>
        </transform><ref id="plaster"/></shape>
    <shape type="rectangle"><transform name="to_world"><scale value="4"/>
        <translate z="-1.2"/></transform><ref id="plaster"/></shape>
    <shape type="sphere"><point name="center" x="0" y=".9" z="0"/><float name="radius" value=".55"/>
        <bsdf type="dielectric"/></shape>
    <shape type="sphere" id="lamp"><point name="center" x="1.1" y="2.4" z="2.2"/>
        <float name="radius" value=".3"/><emitter type="area"/></shape>
</scene>"""


def main() -> None:
    """Make the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--before", type=Path, metavar="CHECKOUT")
    parser.add_argument("--long", type=Path, metavar="LONG.npz")
    parser.add_argument("--to", type=Path, default=HERE / "grain.webp")
    parser.add_argument("--measure", type=Path, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.measure:
        np.savez(options.measure, **crops_of_few_samples())
        return
    with tempfile.TemporaryDirectory() as folder:
        shown = {"now": crops_of(ROOT, Path(folder))}
        if options.before:
            shown = {"before": crops_of(options.before, Path(folder)), **shown}
    sheet(shown, crops_of_many_samples(options.long)).save(options.to, quality=90, method=6)


def scenes() -> list[tuple[Scene, tuple[Crop, ...]]]:
    """Load both scenes, with their crops."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "glass.xml"
        path.write_text(GLASS, encoding="utf-8")
        glass = load_scene(path)
    gallery = load_scene(ROOT / "scenes" / "gallery" / "scene.xml").reduced("1/2")
    return [(gallery, GALLERY), (glass, (CAUSTIC,))]


def cut(plane: np.ndarray, crop: Crop) -> np.ndarray:
    """Return the crop of a plane, as many pixels as there are."""
    return plane[crop.top : crop.top + HEIGHT, crop.left : crop.left + WIDTH].astype(np.float32)


def crops_of_few_samples() -> dict[str, np.ndarray]:
    """Return denoised crops by title and samples, in the version that is imported."""
    try:
        from lightpaint.basis.cache.denoised_planes import denoise_to_halves
    except ImportError:  # as earlier versions call it
        from lightpaint.basis.cache.denoised_planes import denoise_to_halves
    made = {}
    for scene, crops in scenes():
        for spp in SAMPLES:
            basis = render_basis(scene, spp=spp, seed=3)
            for crop in crops:
                halves, scale = denoise_to_halves(basis, basis.names.index(crop.light))
                made[f"{crop.title} {spp}"] = cut(halves, crop) * np.float32(scale)
    return made


def crops_of(checkout: Path, folder: Path) -> dict[str, np.ndarray]:
    """Return the crops of few samples of a version."""
    out = folder / "crops.npz"
    command = [sys.executable, str(Path(__file__).resolve()), "--measure", str(out)]
    subprocess.run(command, check=True, env={**os.environ, "PYTHONPATH": str(checkout)})
    with np.load(out) as made:
        return dict(made)


def crops_of_many_samples(long: Path | None) -> dict[str, np.ndarray]:
    """Return denoised crops by title. long: a file with planes of the gallery."""
    made = {}
    for scene, crops in scenes():
        is_kept = long is not None and crops is GALLERY
        if is_kept:
            with np.load(long) as kept:
                planes = kept["planes"]
        else:
            spp = LONG_SPP if crops is GALLERY else LONG_CAUSTIC_SPP
            planes = render_basis(scene, spp=spp, seed=90_000).images
        names, features = [light.name for light in scene.lights], render_features(scene)
        for crop in crops:
            plane = denoised(planes[names.index(crop.light)], features, quality="high")
            made[crop.title] = cut(plane, crop)
    return made


def sheet(shown: dict[str, dict[str, np.ndarray]], long: dict[str, np.ndarray]) -> Image.Image:
    """Return all crops on one sheet, a row for each."""
    crops = (*GALLERY, CAUSTIC)
    columns = [(spp, which) for spp in SAMPLES for which in shown]
    cell = WIDTH * SCALE, HEIGHT * SCALE
    # A wider gap parts the numbers of samples.
    lefts = [SIDE + k * (cell[0] + GAP) + k // len(shown) * GAP for k in range(len(columns) + 1)]
    size = lefts[-1] + cell[0], HEAD + len(crops) * (cell[1] + GAP) - GAP
    made = Image.new("RGB", size, "white")
    draw, font = ImageDraw.Draw(made), ImageFont.load_default(size=15)
    heads = [f"{spp} samples, {which}" for spp, which in columns] + [f"{LONG_SPP} samples or more"]
    for left, head in zip(lefts, heads, strict=True):
        draw.text((left, 1), head, "black", font)
    for row, crop in enumerate(crops):
        top = HEAD + row * (cell[1] + GAP)
        draw.text((0, top), crop.title, "black", font)
        white = np.percentile(long[crop.title].max(axis=-1), crop.white)
        pictures = [shown[which][f"{crop.title} {spp}"] for spp, which in columns]
        for left, light in zip(lefts, [*pictures, long[crop.title]], strict=True):
            display = np.clip(light / white, 0, 1) ** (1 / 2.2) * 255
            picture = Image.fromarray(np.round(display).astype(np.uint8))
            made.paste(picture.resize(cell, Image.Resampling.NEAREST), (left, top))
    return made


if __name__ == "__main__":
    main()
