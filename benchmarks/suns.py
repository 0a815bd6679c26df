"""Measure how well a small sun in a known sky is found by finer texels.

    python benchmarks/suns.py [--radii 0.5 1.5] [--counts 0 24 48 72] [--spp 128]
        [--pictures FOLDER]

The ball of image_lights.py, glossy, with a post and a bar beside it, 240 x 180 pixels, below a dusk
with a sun of a radius in degrees. From an overcast sky of 16x8 texels, each row has the number of
texels that may be added (`--sun`), and

- texels: those that there are then.
- missed: the share of the target's energy that the prediction misses, and its mean ΔE, both where
  no sky is in view; check: the same share for a plain render, and whether the verification agrees.
- angle: between the true sun and the mean direction of the light within 30 degrees of the brightest
  pixel of the found map, above the map's median.
"""

import argparse
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from image_lights import CHECK_SPP, MATERIALS, SCENE, TARGET_SPP, directions, missed, skies

import lightpaint as lp
from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.lights import light_images
from lightpaint.colour.color import luminance
from lightpaint.colour.primaries import encode_display, to_8_bit
from lightpaint.images.formats.exr import write_rgb
from lightpaint.images.formats.png import png_bytes
from lightpaint.scene.lights.texels.image_domains import Sky, solid_angles
from lightpaint.scene.scene_render import Stream, render

POSTS = """<shape type="cube"><transform name="to_world"><scale x="0.05" y="0.7" z="0.05"/>
    <translate x="1.3" y="0.7" z="0.6"/></transform><bsdf type="diffuse"/></shape>
    <shape type="cube"><transform name="to_world"><scale x="0.5" y="0.04" z="0.04"/>
    <translate x="-1.4" y="0.6" z="0.9"/></transform><bsdf type="diffuse"/></shape>
    <emitter"""
#: Direction of the sun, its irradiance, and the columns and rows of the known map.
SUN, IRRADIANCE, MAP = np.array([0.62, 0.55, 0.35]), 1.2, (2160, 1081)


def sunny(radius: float) -> Floats:
    """Return a dusk with a sun of a radius in degrees."""
    d = directions(*MAP)
    up = d[..., 1:2]
    dusk = np.where(up > 0, np.array([0.15, 0.25, 0.5]) * (0.4 + 0.6 * up), [0.1, 0.09, 0.08])
    disk = (d @ SUN / np.linalg.norm(SUN) > np.cos(np.radians(radius))).astype(float)
    angle = (disk * solid_angles(MAP)).sum()
    sun = disk[..., None] * np.array([1.0, 0.8, 0.55]) * IRRADIANCE / angle
    return (dusk + sun).astype(np.float32)


def write_scene(folder: Path, sky: str) -> Path:
    """Write the scene under a sky."""
    text = SCENE.replace('"96"', '"240"').replace('"72"', '"180"').replace("<emitter", POSTS)
    path = folder / f"{sky}.xml"
    path.write_text(text.format(material=MATERIALS["glossy"], sky=sky))
    return path


def angle_to_sun(image: Doubles) -> float:
    """Return the angle in degrees between the found and the true sun. image: the found map."""
    rows, columns = image.shape[:2]
    d, bright = directions(columns, rows), luminance(image)
    brightest = d.reshape(-1, 3)[int(bright.argmax())]
    near = d @ brightest > np.cos(np.radians(30))
    light = near * np.maximum(bright - np.median(bright), 0) * solid_angles((columns, rows))
    found = (d * light[..., None]).sum(axis=(0, 1))
    cosine = found @ SUN / np.linalg.norm(found) / np.linalg.norm(SUN)
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def rows_of(folder: Path, radius: float, counts: list[int], spp: int) -> Iterator[str]:
    """Yield the rows of a sun, and write pictures and maps into the folder."""
    write_rgb(folder / "sunny.exr", sunny(radius))
    write_rgb(folder / "overcast.exr", skies()["overcast"])
    lit = lp.load_scene(write_scene(folder, "sunny"))
    target = render(lit, spp=TARGET_SPP, seed=5, stream=Stream.TEMPLATE).image
    write_picture(folder / "target.png", target)
    scene = lp.load_scene(write_scene(folder, "overcast"), split={"sky": (16, 8)})
    for count in counts:
        begin_s = time.process_time()
        look = lp.paint_with_light(
            scene,
            lp.Target.of(target),
            folder / f"sun-{radius}-{count}",
            sun=count,
            spp=spp,
            colors="free",
            space="linear",
            report=False,
            use_cache=False,
        )
        spent_s, counted = time.process_time() - begin_s, ~look.basis.emitters_seen
        share, difference = missed(look.predicted.image, target, counted)
        check = render(look.relit, spp=CHECK_SPP, seed=9, stream=Stream.VERIFICATION).image
        checked = missed(check, target, counted)[0]
        [image] = light_images(look.basis.lights)
        found = image.radiances(look.solution.weights)
        write_picture(folder / f"{count}.png", check)
        write_picture(folder / f"{count}-map.png", Sky().interpolated(found, (480, 240)))
        agrees = "agrees" if look.verification.agrees else "DISAGREES"
        yield (
            f"| {radius}° | {count} | {len(look.basis.lights)} | {share:.4f} | {difference:.1f} | "
            f"{angle_to_sun(found):.1f}° | {checked:.4f}, {agrees} | {spent_s:.0f} s |"
        )


def write_picture(path: Path, image: Floats | Doubles) -> None:
    """Write a picture for people."""
    stops = float(np.log2(0.45 / np.median(luminance(image))))
    path.write_bytes(png_bytes(to_8_bit(encode_display(2.0**stops * image.astype(np.float32)))))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--radii", nargs="+", type=float, default=[0.5, 1.5])
    parser.add_argument("--counts", nargs="+", type=int, default=[0, 24, 48, 72])
    parser.add_argument("--spp", type=int, default=128)
    parser.add_argument("--pictures", type=Path, help="folder for pictures, instead of none")
    options = parser.parse_args()
    print("| radius | sun | texels | missed | ΔE | angle | check | processor |")
    print("|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as name:
        folder = options.pictures or Path(name)
        folder.mkdir(parents=True, exist_ok=True)
        for radius in options.radii:
            for row in rows_of(folder, radius, options.counts, options.spp):
                print(row, flush=True)


if __name__ == "__main__":
    main()
