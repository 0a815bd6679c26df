"""Measure how well known skies come back from pictures of a ball that they light.

    python benchmarks/image_lights.py [--sizes 8x4 16x8 32x16] [--spp 256] [--time-only] [--rivals]

A ball on a checkered plane, 96 x 72 pixels, diffuse, glossy or a mirror. It is lit by an overcast
sky; the target is a long render under another sky, known as a map of 128 x 64 pixels. For each size
of the image that is solved for, and for the sky as one light, it prints

- missed: the share of the target's energy that the prediction misses, and its mean ΔE, both where
  no sky is in view.
- map: the error of the solved image against the known map in the same texels, relative to that, and
  their correlation, weighted by solid angle where the picture shows the sky.
- check: the same share for a plain render of the written image, and whether it agrees.

With --rivals, Adam through Mitsuba's differentiable renderer has the same texels, from the overcast
sky, for as much of the processor as basis and solve take together, and for four times as much: the
better of two step sizes, judged like the check, by a plain render.

Before that it prints the processor's time of a basis relative to an ordinary render: of as many
samples, and for the same noise, where the noise of the whole picture is the sum's of all planes.
"""

import argparse
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from image_light_rivals import adam

import lightpaint as lp
from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.lights import LightImage, light_images
from lightpaint.colour.color import delta_e, luminance
from lightpaint.images.formats.exr import write_rgb
from lightpaint.scene.lights.texels.texel import parse_size
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.scene_render import Stream, render

MATERIALS = {
    "diffuse": '<bsdf type="diffuse"><rgb name="reflectance" value="0.5 0.45 0.4"/></bsdf>',
    "glossy": """<bsdf type="roughplastic"><rgb name="diffuse_reflectance" value="0.5 0.45 0.4"/>
        <float name="alpha" value="0.1"/></bsdf>""",
    "mirror": '<bsdf type="conductor"/>',
}
SCENE = """<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="6"/></integrator>
    <sensor type="perspective" id="camera"><float name="fov" value="40"/>
        <transform name="to_world"><lookat origin="0, 1.6, 4.5" target="0, 0.7, 0" up="0, 1, 0"/>
        </transform>
        <film type="hdrfilm"><integer name="width" value="96"/>
        <integer name="height" value="72"/></film></sensor>
    <shape type="rectangle"><transform name="to_world"><scale value="6"/>
        <rotate x="1" angle="-90"/></transform>
        <bsdf type="diffuse"><texture type="checkerboard" name="reflectance">
        <rgb name="color0" value="0.2"/><rgb name="color1" value="0.6"/>
        <transform name="to_uv"><scale x="8" y="8"/></transform></texture></bsdf></shape>
    <shape type="sphere"><point name="center" x="0" y="0.8" z="0"/>
        <float name="radius" value="0.8"/>{material}</shape>
    <emitter type="envmap" id="sky"><string name="filename" value="{sky}.exr"/></emitter>
</scene>
"""
#: Samples per pixel of targets and of checks.
TARGET_SPP, CHECK_SPP = 1024, 512
#: Steps of Adam, in radiance, and how often it has the time of basis and solve.
STEP_SIZES, TIMES = (0.03, 0.1), (1, 4)


def directions(width: int, height: int) -> Doubles:
    """Return the direction of each pixel of a map, (height, width, 3)."""
    polar = np.pi * np.arange(height)[:, None] / (height - 1)
    azimuth = 2 * np.pi * (np.arange(width) + 0.5) / width
    parts = np.broadcast_arrays(
        np.sin(polar) * np.sin(azimuth), np.cos(polar), -np.sin(polar) * np.cos(azimuth)
    )
    return np.stack(parts, axis=-1)


def lobe(d: Doubles, axis: list[float], sharpness: float, color: list[float]) -> Doubles:
    """Return light around an axis, (h, w, 3). d: directions."""
    unit = np.array(axis) / np.linalg.norm(axis)
    return np.exp(sharpness * (d @ unit - 1))[..., None] * np.array(color)


def skies() -> dict[str, Floats]:
    """Return the maps by name: the current one, `overcast`, and known ones."""
    d = directions(128, 64)
    up = d[..., 1:2]
    overcast = np.where(up > 0, 0.4 + 0.3 * up, 0.15) * np.ones(3)
    dusk = np.where(up > 0, np.array([0.15, 0.25, 0.5]) * (0.4 + 0.6 * up), [0.1, 0.09, 0.08])
    sunset = dusk + lobe(d, [1, 0.35, 0.6], 40, [30, 14, 5])
    sunset += lobe(d, [-1, 0.2, 0.3], 8, [0.9, 0.4, 0.6])
    azimuth, elevation = np.arctan2(d[..., 0], -d[..., 2]), np.arcsin(np.clip(d[..., 1], -1, 1))

    def panel(at: tuple[float, float], size: tuple[float, float], color: list[float]) -> Doubles:
        beside = np.abs((azimuth - at[0] + np.pi) % (2 * np.pi) - np.pi) < size[0]
        inside = beside & (np.abs(elevation - at[1]) < size[1])
        return inside[..., None] * np.array(color)

    studio = 0.03 + panel((1.0, 0.6), (0.5, 0.35), [9, 8, 7])
    studio = studio + panel((-1.7, 0.5), (0.25, 0.5), [2.5, 3.5, 6])
    maps = {"overcast": overcast, "sunset": sunset, "studio": studio}
    return {name: image.astype(np.float32) for name, image in maps.items()}


def scene_file(folder: Path, material: str, sky: str) -> Path:
    """Write the scene of a material under a sky."""
    path = folder / f"{material}_{sky}.xml"
    path.write_text(SCENE.format(material=MATERIALS[material], sky=sky))
    return path


def missed(image: Floats, target: Floats, counted: np.ndarray) -> tuple[float, float]:
    """Return the share of the energy that an image misses, and its mean ΔE."""
    difference = (image - target)[counted]
    share = float((difference**2).sum() / (target[counted] ** 2).sum())
    exposure = 0.5 / float(luminance(target[counted]).mean())
    shown, wanted = (exposure * x[counted] for x in (image, target))
    return share, float(delta_e(shown, wanted).mean())


def map_error(
    image: LightImage, basis: Basis, solved: Doubles, known: Doubles
) -> tuple[float, float]:
    """Return relative error and correlation of two maps, (rows, columns, 3), where seen."""
    angles = image.domain.shares(image.size)
    seen = np.sqrt(basis.power[image.lights].sum(axis=1)).reshape(angles.shape) / angles
    weight = (angles * np.minimum(seen / np.median(seen), 1))[..., None] * np.ones(3)
    error = np.sqrt((weight * (solved - known) ** 2).sum() / (weight * known**2).sum())
    a, b = (x - (weight * x).sum() / weight.sum() for x in (solved, known))
    spread = (weight * a**2).sum() * (weight * b**2).sum()
    return float(error), float((weight * a * b).sum() / np.sqrt(spread))


def rival_row(
    folder: Path, material: str, sky: str, label: str, basis: Basis, target: Floats, budget_s: float
) -> str:
    """Return the row of Adam for an image. budget_s: of the processor, for each step size."""
    maps, size = skies(), parse_size(label, "size")
    counted, rows = ~basis.emitters_seen, []
    [image] = light_images(basis.lights)
    overcast = image.domain.coarse(maps["overcast"], size)
    write_rgb(folder / "start.exr", overcast.astype(np.float32))
    start = scene_file(folder, material, "start")
    for step_size in STEP_SIZES:
        found, steps = adam(
            start, target, counted, size=size, budget_s=budget_s, step_size=step_size
        )
        write_rgb(folder / "adam.exr", found.astype(np.float32))
        relit = lp.load_scene(scene_file(folder, material, "adam"))
        check = render(relit, spp=CHECK_SPP, seed=9, stream=Stream.VERIFICATION).image
        share, difference = missed(check, target, counted)
        known = image.domain.coarse(maps[sky], size)
        error, likeness = map_error(image, basis, found, known)
        rows.append(
            (
                share,
                f"| {material} | {sky} | {label}, Adam, {steps} steps in {budget_s:.1f} s | "
                f"{share:.4f} | {difference:.1f} | {error:.2f} | {likeness:.2f} | "
                f"{share:.4f} |",
            )
        )
    return min(rows)[1]


def rows_of(
    folder: Path, material: str, sizes: list[str], spp: int, *, has_rivals: bool
) -> Iterator[str]:
    """Yield the table rows of one material."""
    maps = skies()
    plain = lp.load_scene(scene_file(folder, material, "overcast"))
    splits: dict[str, Scene] = {"one light": plain}
    splits |= {size: lp.load_scene(plain.path, split={"sky": size}) for size in sizes}
    bases, spent_s = {}, {}
    for label, scene in splits.items():
        lp.render_basis(scene, spp=2)  # compiles the kernels
        begin_s = time.process_time()
        bases[label] = lp.render_basis(scene, spp=spp)
        spent_s[label] = time.process_time() - begin_s
    for sky in ("sunset", "studio"):
        lit = lp.load_scene(scene_file(folder, material, sky))
        target = render(lit, spp=TARGET_SPP, seed=5, stream=Stream.TEMPLATE).image
        for label, scene in splits.items():
            basis, begin_s = bases[label], time.process_time()
            solution = lp.solve(basis, lp.Target.of(target), space="linear", colors="free")
            budget_s = spent_s[label] + time.process_time() - begin_s
            predicted, counted = lp.combine(basis, solution.lighting), ~basis.emitters_seen
            share, difference = missed(predicted.image, target, counted)
            relit = lp.relight(scene, solution.lighting, folder / "relit.xml")
            check = render(relit, spp=CHECK_SPP, seed=9, stream=Stream.VERIFICATION).image
            agrees = lp.verify(predicted, relit, spp=CHECK_SPP).agrees
            maps_text = "– | –"
            for image in light_images(basis.lights):
                known = image.domain.coarse(maps[sky], parse_size(label, "size"))
                solved = solution.weights[image.places]
                maps_text = "{:.2f} | {:.2f}".format(*map_error(image, basis, solved, known))
            checked = missed(check, target, counted)[0]
            yield (
                f"| {material} | {sky} | {label} | {share:.4f} | {difference:.1f} | {maps_text} | "
                f"{checked:.4f}, {'agrees' if agrees else 'DISAGREES'} |"
            )
            if has_rivals and scene.split:
                for times in TIMES:
                    yield rival_row(folder, material, sky, label, basis, target, times * budget_s)


def times_of(folder: Path, material: str, sizes: list[str], spp: int) -> Iterator[str]:
    """Yield rows of the processor's time of a basis, relative to an ordinary render.

    Once with as many samples, and once for the same noise of the whole picture.
    """
    path = scene_file(folder, material, "overcast")
    plain = lp.load_scene(path)
    import mitsuba as mi  # after lightpaint has chosen its variant

    loaded, pictures = plain.load(), []
    for k in range(3):  # the first compiles
        begin_s = time.process_time()
        pictures.append(np.array(mi.render(loaded, seed=k, spp=spp)))
        ordinary_s = time.process_time() - begin_s
    for label in ("one light", *sizes):
        scene = plain if label == "one light" else lp.load_scene(path, split={"sky": label})
        lp.render_basis(scene, spp=2)  # compiles the kernels
        begin_s = time.process_time()
        basis = lp.render_basis(scene, spp=spp, seed=1)
        ratio = (time.process_time() - begin_s) / ordinary_s
        lit = ~basis.emitters_seen
        whole, its_half_difference = (np.sum(list(x), axis=0) for x in (basis.planes, basis.noise))
        its_noise = noise_share(whole[lit], its_half_difference[lit])
        noise = noise_share(pictures[1][lit], (pictures[1] - pictures[2])[lit]) / 2
        yield f"| {material} | {label} | {ratio:.2f} | {ratio * its_noise / noise:.2f} |"


def noise_share(image: Floats, noise: Floats) -> float:
    """Return the energy of noise relative to the energy of an image."""
    return float((noise**2).sum() / (image**2).sum())


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", nargs="+", default=["8x4", "16x8", "32x16"])
    parser.add_argument("--materials", nargs="+", default=list(MATERIALS))
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--time-only", action="store_true")
    parser.add_argument("--rivals", action="store_true")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for sky, image in skies().items():
            write_rgb(folder / f"{sky}.exr", image)
        print("| ball | image | time of a basis | for the same noise |\n|---|---|---|---|")
        for material in options.materials:
            for row in times_of(folder, material, options.sizes, options.spp):
                print(row, flush=True)
        if options.time_only:
            return
        print("\n| ball | sky | image | missed | ΔE | map error | correlation | check |")
        print("|---|---|---|---|---|---|---|---|")
        for material in options.materials:
            for row in rows_of(
                folder, material, options.sizes, options.spp, has_rivals=options.rivals
            ):
                print(row, flush=True)


if __name__ == "__main__":
    main()
