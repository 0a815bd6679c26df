"""Makes the picture of two mixes of one white in docs/spectra.md.

    python docs/images/spectra.py [--spp 256]

A room with a red dress and some colours, lit by a lamp at 3200 K: mixed from red, green and blue
LEDs, and from these and a white one so that colours come out best (Rf of TM-30). A grey card looks
the same under both. Below each mix stands its Rf.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from lightpaint import Basis, load_scene, render_basis
from lightpaint.colour.color import kelvin_to_rgb
from lightpaint.colour.lamp import Lamp, LampEmitter
from lightpaint.colour.spectra.color_rendering import color_rendering
from lightpaint.colour.spectra.spectrum import rgb_of_powers, spectrum_of
from lightpaint.colour.srgb import encode_display, to_8_bit

HERE = Path(__file__).resolve().parent
WIDTH, HEIGHT, FOOT = 320, 200, 22

#: Brightness of the picture.
EXPOSURE = 30.0

#: LEDs, as Gaussians: peaks and widths in nanometres, and a share of full. The white one is a blue
#: LED with a phosphor.
LEDS = {
    "red": [(632, 8, 1.0)],
    "green": [(523, 14, 1.0)],
    "blue": [(455, 10, 1.0)],
    "white": [(450, 9, 0.5), (575, 55, 1.0)],
}

SPHERE = """<shape type="sphere"><point name="center" x="{x}" y="{y}" z="{r}"/>
    <float name="radius" value="{r}"/><bsdf type="diffuse"><rgb name="reflectance" value="{rgb}"/>
    </bsdf></shape>"""
WALL = """<shape type="rectangle"><transform name="to_world"><scale value="4"/>{turn}</transform>
    <bsdf type="diffuse"><rgb name="reflectance" value=".5 .5 .5"/></bsdf></shape>"""
ROOM = f"""<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="5"/></integrator>
    <sensor type="perspective"><float name="fov" value="38"/><transform name="to_world">
        <lookat origin="0 -6 1.7" target="0 0 .8" up="0 0 1"/></transform>
        <film type="hdrfilm"><integer name="width" value="{WIDTH}"/>
        <integer name="height" value="{HEIGHT}"/></film></sensor>
    {WALL.format(turn="")}
    {WALL.format(turn='<rotate x="1" angle="90"/><translate y="2"/>')}
    <shape type="ply" id="dress"><string name="filename" value="dress.ply"/><bsdf type="twosided">
        <bsdf type="diffuse"><rgb name="reflectance" value=".55 .03 .05"/></bsdf></bsdf></shape>
    {SPHERE.format(x=-0.2, y=0, r=0.22, rgb=".6 .38 .27").replace('z="0.22"', 'z="1.9"')}
    {SPHERE.format(x=1.2, y=-0.3, r=0.5, rgb=".06 .12 .45")}
    {SPHERE.format(x=-1.5, y=-0.2, r=0.45, rgb=".5 .42 .04")}
    <emitter type="point" id="lamp"><point name="position" x="-2" y="-4" z="4"/>
        <rgb name="intensity" value="1 1 1"/></emitter>
</scene>"""


def main() -> None:
    """Render the two mixes, and write the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--spp", type=int, default=256)
    spp = parser.parse_args().spp
    lamp = lamp_of_leds()
    with tempfile.TemporaryDirectory() as folder:
        write_dress(Path(folder) / "dress.ply")
        (Path(folder) / "room.xml").write_text(ROOM)
        scene = load_scene(Path(folder) / "room.xml").with_lamps({"lamp": lamp})
        basis = render_basis(scene, spp=spp)
    white = np.asarray(kelvin_to_rgb(3200.0))
    three = np.append(np.linalg.solve(lamp.columns[:3].T, white), 0)
    best = lamp.best_rendering(white)
    shown = [panel(basis, lamp, x) for x in (three, best)]
    Image.fromarray(np.hstack(shown)).save(HERE / "spectra.webp", quality=90)


def lamp_of_leds() -> Lamp:
    """Return a lamp of four LEDs, with more light of each than is needed."""
    waves = np.arange(380, 781.0)
    emitters = []
    for name, peaks in LEDS.items():
        power = sum(share * np.exp(-0.5 * ((waves - nm) / sd) ** 2) for nm, sd, share in peaks)
        spectrum = spectrum_of(waves, np.asarray(power))
        red, green, blue = (4 * rgb_of_powers(spectrum)).tolist()
        emitters.append(LampEmitter(name, (red, green, blue), spectrum=spectrum))
    return Lamp(tuple(emitters))


def panel(basis: Basis, lamp: Lamp, drives: np.ndarray) -> np.ndarray:
    """Return the room under a mix, (h, w, 3) 8 bits, with its Rf below."""
    weights = np.repeat((drives * lamp.levels)[:, None], 3, axis=1)
    # As a camera shows it that is balanced for that white.
    light = basis.mix(weights) * (EXPOSURE / np.asarray(kelvin_to_rgb(3200.0), np.float32))
    assert lamp.powers_at_full is not None
    found = color_rendering(drives @ lamp.powers_at_full)
    assert found is not None
    page = Image.new("RGB", (WIDTH, HEIGHT + FOOT), "white")
    page.paste(Image.fromarray(to_8_bit(encode_display(light))), (0, 0))
    names = " + ".join(x for x, d in zip(lamp.names, drives, strict=True) if d > 1e-3)
    text = f"{names}: {found.kelvin:.0f} K, Rf {found.rf:.0f}"
    ImageDraw.Draw(page).text((8, HEIGHT + 4), text, "black", ImageFont.load_default(12))
    return np.array(page)


def write_dress(path: Path) -> None:
    """Write a mesh like a dress on a stand: a profile turned around its axis, with folds."""
    around, up = np.meshgrid(np.linspace(0, 2 * np.pi, 145), np.linspace(0, 1, 60))
    radius = np.interp(up, [0, 0.55, 0.8, 0.93, 1], [0.62, 0.2, 0.26, 0.22, 0.08])
    radius = radius * (1 + 0.12 * np.clip(0.6 - up, 0, 1) * np.sin(12 * around))
    points = np.stack([radius * np.cos(around) - 0.2, radius * np.sin(around), 1.7 * up], axis=-1)
    rows, columns = up.shape
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    across = corner + columns + 1
    halves = [[corner, corner + 1, across], [corner, across, corner + columns]]
    faces = np.concatenate([np.stack(half, axis=1) for half in halves])
    head = [
        *("ply", "format ascii 1.0", f"element vertex {points.size // 3}"),
        *(f"property float {axis}" for axis in "xyz"),
        *(f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"),
    ]
    lines = [" ".join(f"{v:.5f}" for v in p) for p in points.reshape(-1, 3)]
    lines += ["3 " + " ".join(map(str, face)) for face in faces.tolist()]
    path.write_text("\n".join([*head, *lines]) + "\n")


if __name__ == "__main__":
    main()
