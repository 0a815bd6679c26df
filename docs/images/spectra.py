"""Makes the picture of two mixes of one white in docs/spectra.md.

    python docs/images/spectra.py [--spp 256]

A room with a red dress and some colours, lit by a lamp of red, green, blue and amber LEDs, and a
painting of it at 3200 K. lightpaint solves that twice: as it is, which takes the mix of the least
power, and with `rf = 80`. A grey card looks the same under both. Below each stands its Rf, and the
power that the answer names.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from lightpaint import Basis, Constraints, Lighting, Target, load_scene, render_basis, solve
from lightpaint.colour.color import kelvin_to_rgb
from lightpaint.colour.primaries import encode_display, to_8_bit
from lightpaint.lighting.analysis.rendered_colors import renderings_of

HERE = Path(__file__).resolve().parent
WIDTH, HEIGHT, FOOT = 320, 200, 22

#: Brightness of the picture.
EXPOSURE = 75.0

#: Peaks and widths of LEDs in nanometres, and lumens per watt.
LEDS = {"red": (632, 8, 70), "green": (523, 14, 110), "blue": (455, 10, 22), "amber": (595, 8, 60)}

#: Lumens of each LED at full.
LUMENS = 4000.0

#: Candela of the white that is painted.
CANDELA = 150.0

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
    """Solve for the two mixes, and write the picture."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--spp", type=int, default=256)
    spp = parser.parse_args().spp
    with tempfile.TemporaryDirectory() as folder:
        write_dress(Path(folder) / "dress.ply")
        (Path(folder) / "room.xml").write_text(ROOM)
        scene = load_scene(Path(folder) / "room.xml")
        seen_in_rgb = render_basis(scene, spp=spp)
        answers = [answer(seen_in_rgb, **wish) for wish in ({}, {"rf": 80})]
        lamp = answers[0]["lamp"].lamp
        assert lamp is not None
        seen = render_basis(scene.with_lamps({"lamp": lamp}), spp=spp)
    shown = [panel(seen, found) for found in answers]
    Image.fromarray(np.hstack(shown)).save(HERE / "spectra.webp", quality=90)


def answer(basis: Basis, **wish: float) -> Lighting:
    """Return the answer to a painting in 3200 K, for a lamp of LEDs of which `wish` is asked."""
    white = CANDELA * np.asarray(kelvin_to_rgb(3200.0), np.float32)
    image = basis.mix(white[None])
    painting = Target("3200 K", image, np.ones(basis.size, np.float32), everything=True)
    lights = {"lamp": {"emitters": emitters(), **wish}}
    constraints = Constraints.of(lights, cd_per_unit=1)
    return solve(basis, painting, constraints=constraints, literal=True).lighting


def emitters() -> list[dict[str, object]]:
    """Return the emitters of the lamp as a lights file has them."""
    waves = np.arange(380, 781, 5.0)
    return [
        {
            "name": name,
            "spectrum": [[nm, float(np.exp(-0.5 * ((nm - peak) / width) ** 2))] for nm in waves],
            "lm": LUMENS,
            "watts": LUMENS / efficacy,
        }
        for name, (peak, width, efficacy) in LEDS.items()
    ]


def panel(basis: Basis, lighting: Lighting) -> np.ndarray:
    """Return the room under an answer, (h, w, 3) 8 bits, with its Rf and power below."""
    found, light = renderings_of(lighting)["lamp"], lighting["lamp"]
    # As a camera shows it that is balanced for that white.
    white = EXPOSURE / CANDELA / np.asarray(kelvin_to_rgb(3200.0), np.float32)
    shown = basis.mix(lighting.weights_for(basis)) * white
    page = Image.new("RGB", (WIDTH, HEIGHT + FOOT), "white")
    page.paste(Image.fromarray(to_8_bit(encode_display(shown))), (0, 0))
    assert found.color is not None
    names = " + ".join(name for name, drive in light.drives.items() if drive > 1e-3)
    kelvin = round(found.color.kelvin, -1)
    text = f"{names}: {kelvin:.0f} K, Rf {found.color.rf:.0f}, {found.watts:.0f} W"
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
