"""How often do 95 % intervals of lights hold in display space?

    python benchmarks/display_coverage.py [--rooms gallery mirror glass] [--seeds 200] [--spp 64]
    python benchmarks/display_coverage.py --answers default [--gallery 1/2] [--film 40x24]

The gallery on a small film, a room with a wall that is a mirror and a room with a ball and a pane
of glass, six lamps in each. The painting is the light of other lamps by all samples, half of it
brighter and warmer, with a glow that no lamp makes, as a display shows it in 8 bits. It is fitted
in display values: literally, or as `solve` does by default, which reads wishes in it and keeps
lamps to their colours as far as it can. The samples of one render are cut into as many bases as
there are seeds, and all of them together are the truth. Printed is, without the noise correction
and with it, how often the intervals hold the truth, over lights, channels and seeds: of channels
that these samples determine, which is where half the median interval is less than the weight; of
the one of them that is held least; and the RMS error of these weights, relative to each.
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
from coverage import rendered_bases
from rows import add_csv, write_rows

import lightpaint as lp
from lightpaint.basis.light_basis import Basis
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.target.painted_target import Target

ROOT = Path(__file__).parent.parent

#: What differs between both rooms: the left wall, and what stands in the room.
ROOMS = {
    "mirror": """<shape type="rectangle"><transform name="to_world"><scale value="3"/>
        <rotate y="1" angle="90"/><translate x="-2" y="1" z="1"/></transform>
        <bsdf type="conductor"/></shape>""",
    "glass": """<shape type="rectangle"><transform name="to_world"><scale value="3"/>
        <rotate y="1" angle="90"/><translate x="-2" y="1" z="1"/></transform><bsdf type="diffuse">
        <rgb name="reflectance" value="0.3 0.5 0.3"/></bsdf></shape>
    <shape type="sphere"><point name="center" x="-0.2" y="0.6" z="0.3"/>
        <float name="radius" value="0.45"/><bsdf type="dielectric"/></shape>
    <shape type="rectangle"><transform name="to_world"><scale x="0.7" y="0.9"/>
        <rotate y="1" angle="-20"/><translate x="1.0" y="0.9" z="0.5"/></transform>
        <bsdf type="thindielectric"/></shape>""",
}

#: The material of the box in each.
BOXES = {
    "mirror": '<bsdf type="roughconductor"><float name="alpha" value="0.15"/></bsdf>',
    "glass": '<bsdf type="diffuse"><rgb name="reflectance" value="0.2 0.3 0.6"/></bsdf>',
}

SCENE = """<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="6"/></integrator>
    <sensor type="perspective" id="camera"><float name="fov" value="60"/>
        <transform name="to_world"><lookat origin="0 1.1 3.6" target="0 0.95 0" up="0 1 0"/>
        </transform><film type="hdrfilm"><integer name="width" value="{width}"/>
        <integer name="height" value="{height}"/></film></sensor>
    <shape type="rectangle"><transform name="to_world"><scale value="3"/>
        <rotate x="1" angle="-90"/><translate z="1"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.55 0.45 0.35"/></bsdf></shape>
    <shape type="rectangle"><transform name="to_world"><scale value="3"/>
        <rotate x="1" angle="90"/><translate y="2.4" z="1"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.7 0.7 0.7"/></bsdf></shape>
    <shape type="rectangle"><transform name="to_world"><scale value="3"/>
        <translate y="1" z="-1.6"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.5 0.55 0.6"/></bsdf></shape>
    <shape type="rectangle"><transform name="to_world"><scale value="3"/>
        <rotate y="1" angle="-90"/><translate x="2" y="1" z="1"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.6 0.3 0.25"/></bsdf></shape>
    <shape type="sphere"><point name="center" x="-0.7" y="0.35" z="-0.3"/>
        <float name="radius" value="0.35"/>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.6 0.6 0.2"/></bsdf></shape>
    <shape type="cube"><transform name="to_world"><scale x="0.3" y="0.5" z="0.3"/>
        <rotate y="1" angle="25"/><translate x="0.7" y="0.5" z="-0.6"/></transform>
        {box}</shape>
    <shape type="rectangle" id="panel"><transform name="to_world"><scale x="0.35" y="0.2"/>
        <rotate x="1" angle="90"/><translate x="-0.7" y="2.35" z="-0.3"/></transform>
        <emitter type="area"><rgb name="radiance" value="5 4.5 4"/></emitter></shape>
    <emitter type="spot" id="beam"><transform name="to_world">
        <lookat origin="1.2 2.3 1.2" target="0.6 0.4 -0.6" up="0 0 1"/></transform>
        <rgb name="intensity" value="3 2.8 2.4"/><float name="cutoff_angle" value="28"/></emitter>
    <emitter type="point" id="bulb"><point name="position" x="1.5" y="0.5" z="0.4"/>
        <rgb name="intensity" value="0.35 0.28 0.2"/></emitter>
    <shape type="sphere" id="globe"><point name="center" x="-1.3" y="1.5" z="-1.1"/>
        <float name="radius" value="0.09"/>
        <emitter type="area"><rgb name="radiance" value="7 6 4"/></emitter></shape>
    <shape type="rectangle" id="strip"><transform name="to_world"><scale x="1.2" y="0.03"/>
        <rotate x="1" angle="-90"/><translate y="0.05" z="-1.5"/></transform>
        <emitter type="area"><rgb name="radiance" value="6 6 8"/></emitter></shape>
    <emitter type="spot" id="wash"><transform name="to_world">
        <lookat origin="-0.5 2.3 0.6" target="-0.3 1.2 -1.6" up="0 1 0.1"/></transform>
        <rgb name="intensity" value="2 2 2.2"/><float name="cutoff_angle" value="40"/></emitter>
    {room}
</scene>
"""


def main() -> None:
    """Print two lines for each room."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rooms", nargs="+", default=["gallery", *ROOMS])
    parser.add_argument("--answers", choices=("literal", "default"), default="literal")
    parser.add_argument("--gallery", default="1/8", metavar="1/N", help="resolution of the gallery")
    parser.add_argument("--film", default="64x36", metavar="WxH", help="of the other rooms")
    parser.add_argument("--seeds", type=int, default=200, metavar="N")
    parser.add_argument("--spp", type=int, default=64)
    add_csv(parser)
    options = parser.parse_args()
    use_variant()
    rows: list[dict[str, object]] = []
    print(f"{'':20s}{'held':>8s}{'least':>8s}{'RMS error':>11s}")
    with tempfile.TemporaryDirectory() as folder:
        for room in options.rooms:
            resolution = options.film if room in ROOMS else options.gallery
            scene = make_scene(room, Path(folder), resolution)
            is_literal = options.answers == "literal"
            rows += measure(
                room, scene, seeds=options.seeds, spp=options.spp, is_literal=is_literal
            )
            write_rows(options.csv, rows)


def measure(
    room: str, scene: Scene, *, seeds: int, spp: int, is_literal: bool
) -> list[dict[str, object]]:
    """Render, solve and print two lines. Returns a row for each."""
    rows: list[dict[str, object]] = []
    *bases, truth = rendered_bases(scene, seeds, spp, 1)
    target = painted(truth)
    best = answers(truth, target, is_literal)[1].weights
    for k, name in enumerate((room, f"{room}, corrected")):
        found, ends = [], []
        for basis in bases:
            answer = answers(basis, target, is_literal)[k]
            bars = lp.error_bars(answer)
            assert bars is not None
            found.append(answer.weights)
            ends.append(bars.interval)
        low, high = np.array(ends).transpose(1, 0, 2, 3)
        held = ((low <= best) & (best <= high)).mean(axis=0)
        is_told = (best > 0) & (np.median(high - low, axis=0) < 2 * best)
        # Of a channel that is mostly off, half the interval is cut off at zero.
        is_told &= np.median(low, axis=0) > 0
        error = ((np.array(found) / np.where(best > 0, best, 1) - 1)[:, is_told] ** 2).mean() ** 0.5
        mean, least = held[is_told].mean(), held[is_told].min()
        print(f"{name:20s}{mean:8.3f}{least:8.2f}{error:11.3f}")
        rows.append(
            {
                "room": f"{room}, {scene.size[1]}x{scene.size[0]}",
                "answers": "literal" if is_literal else "default",
                "noise correction": ("no", "yes")[k],
                "held": f"{mean:.3f}",
                "held least": f"{least:.2f}",
                "error of weights": f"{error:.3f}",
            }
        )
    return rows


def answers(basis: Basis, target: Target, is_literal: bool) -> tuple[lp.Solution, lp.Solution]:
    """Solve without the noise correction, and with it."""
    solution = lp.solve(basis, target, literal=is_literal, space="display")
    return solution, lp.correct_noise(solution)


def make_scene(room: str, folder: Path, resolution: str) -> Scene:
    """Return the scene of a room on a small film: `1/8` of the gallery's, `64x36` of others."""
    if room not in ROOMS:
        return lp.load_scene(ROOT / "scenes" / room / "scene.xml").reduced(resolution)
    path = folder / f"{room}.xml"
    width, height = resolution.split("x")
    text = SCENE.format(room=ROOMS[room], box=BOXES[room], width=width, height=height)
    path.write_text(text, encoding="utf-8")
    return lp.load_scene(path)


def painted(truth: Basis) -> Target:
    """Return the painting, in 8 bits."""
    rng, (height, width) = np.random.default_rng(5), truth.size
    levels = np.exp(rng.normal(0, 0.5, (len(truth.names), 1)))
    weights = truth.current_weights * levels * np.exp(rng.normal(0, 0.12, (len(levels), 3)))
    y, x = np.mgrid[:height, :width][..., None] / np.array([height, width])[:, None, None, None]
    image = truth.mix(weights) * (0.75 + 0.45 * (x > 0.5))
    image = image * np.array([1.12, 0.95, 0.8]) ** np.where(y > 0.5, 1, -0.5)
    image += 0.03 * np.exp(-((x - 0.3) ** 2 + (y - 0.4) ** 2) / 0.02)
    return in_eight_bits(image)


def in_eight_bits(image: np.ndarray) -> Target:
    """Return a picture of light, (h, w, 3), as a painting in a PNG that counts everywhere."""
    view = lp.ViewTransform("srgb")
    codes = np.round(255 * np.clip(view.encode(image), 0, 1))
    return Target(
        "painted",
        view.decode(codes / 255).astype(np.float32),
        np.ones(image.shape[:2], np.float32),
        everything=True,
        at_least=codes >= 255,
        transform=view,
        through_view=True,
    )


if __name__ == "__main__":
    main()
