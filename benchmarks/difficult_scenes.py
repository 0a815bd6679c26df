"""Do answers hold in scenes with what other people's scenes have?

    python benchmarks/difficult_scenes.py [--scenes glass screen ...] [--seeds 6] [--spp 32]
    python benchmarks/difficult_scenes.py --quick

Small scenes, each with one difficulty: a bulb in glass, four of them, and a lamp in a mirror, which
paths find by chance; a screen, a textured area light in view; a hall with 48 lamps; a dome, an
environment map; a sun with its sky; fog, for which each light is rendered by itself; masked and
textured surfaces; spots with a profile of rings, as photometric files have. Paintings of each are
solved as linear light: three that a mix of its lights makes exactly, in turns, and one with a
pattern of squares that no mix makes. Printed are, over bases of that many samples with other seeds:

- `held`: how often 95 % intervals hold the weights that a basis of 64 times the samples gives, over
  channels of lights that are on, and `told`, the same without lights of which an answer says that
  they cannot be told;
- `met`, `unmet`: the share of answers whose headline calls the painting that can be met close, and
  the other one not; `wrong`: the number of headlines that do not call what can be met close, and
  do not say either that too few samples tell, of how many;
- `render / prediction`: the mean light of plain Mitsuba renders of the relit scene, with samples
  that nothing else has, over the light of the prediction, with its standard error.

--quick tries two scenes with two seeds, to see that everything runs.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from coverage import HARD_LAMPS, ROOM
from hall import write_hall
from rows import add_csv, write_rows

import lightpaint as lp
from lightpaint.basis.cache.cached_render import obtain_basis
from lightpaint.images.formats.exr import write_rgb
from lightpaint.scene.runtime.variant import use_variant

#: How many times the samples of a basis its truth has, and a plain render.
TRUTH, RENDER = 64, 16

#: Stops by which lights differ at most in the painting that they make exactly.
REACHED_STOPS = 2

#: Stops by which the squares of the painting that no mix makes are brighter and darker, and their
#: number along the width.
SQUARE_STOPS, SQUARES = 1.5, 8

#: The beginning of a headline for a painting that is met.
CLOSE = "Close: "

#: Words of a headline that finds no fault with the lights, but with the samples.
FEW_SAMPLES = "too few samples tell"

#: Paintings of each scene that its lights make exactly.
REACHABLE = 3

SCREEN = """<shape type="rectangle" id="screen"><transform name="to_world">
        <scale x="0.5" y="0.3"/><translate x="0.7" y="1.1" z="-0.98"/></transform>
        <emitter type="area"><texture type="bitmap" name="radiance">
        <string name="filename" value="screen.exr"/><boolean name="raw" value="true"/></texture>
        </emitter></shape>"""

MASKS = """<shape type="rectangle"><transform name="to_world"><scale value="0.5"/>
        <translate x="-0.2" y="0.8" z="0.3"/></transform><bsdf type="mask">
        <texture type="bitmap" name="opacity"><string name="filename" value="leaves.exr"/>
        <boolean name="raw" value="true"/></texture><bsdf type="twosided"><bsdf type="diffuse">
        <rgb name="reflectance" value="0.2 0.5 0.15"/></bsdf></bsdf></bsdf></shape>
    <shape type="sphere"><point name="center" x="0.8" y="0.35" z="0.2"/>
        <float name="radius" value="0.35"/><bsdf type="principled">
        <texture type="bitmap" name="base_color"><string name="filename" value="screen.exr"/>
        <boolean name="raw" value="true"/></texture><float name="roughness" value="0.2"/>
        <float name="metallic" value="0.7"/></bsdf></shape>"""

FOG = """<shape type="cube"><transform name="to_world"><scale x="1.9" y="1" z="1.4"/>
        <translate y="1" z="0.45"/></transform><bsdf type="null"/>
        <medium type="homogeneous" name="interior"><rgb name="sigma_t" value="0.3 0.3 0.3"/>
        <rgb name="albedo" value="0.8 0.8 0.8"/></medium></shape>"""

PROFILED_SPOT = """<emitter type="spot" id="profile_{k}"><transform name="to_world">
        <lookat origin="{x} 1.8 0.9" target="{x} 0.6 -0.6" up="0 1 0"/></transform>
        <rgb name="intensity" value="6 5 4"/><float name="cutoff_angle" value="35"/>
        <texture type="bitmap" name="texture"><string name="filename" value="rings.exr"/>
        <boolean name="raw" value="true"/></texture></emitter>"""

BULB_IN_GLASS = """<shape type="sphere" id="bulb_{k}"><point name="center" x="{x}" y="{y}" z="{z}"/>
        <float name="radius" value="0.03"/>
        <emitter type="area"><rgb name="radiance" value="60 45 30"/></emitter></shape>
    <shape type="sphere"><point name="center" x="{x}" y="{y}" z="{z}"/>
        <float name="radius" value="0.12"/><bsdf type="dielectric"/></shape>"""

#: Where four bulbs hang that are seen.
BULB_PLACES = ((1.2, 1.2, -0.6), (-1.3, 1.0, -0.7), (0.3, 1.7, -0.8), (0.7, 1.5, 0.6))

OUTDOORS = """<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="6"/></integrator>
    <sensor type="perspective" id="camera"><float name="fov" value="50"/>
        <transform name="to_world"><lookat origin="0 1.2 4" target="0 0.6 0" up="0 1 0"/>
        </transform><film type="hdrfilm"><integer name="width" value="80"/>
        <integer name="height" value="45"/><rfilter type="box"/></film></sensor>
    <shape type="rectangle"><transform name="to_world"><scale value="6"/>
        <rotate x="1" angle="-90"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.4 0.4 0.35"/></bsdf></shape>
    <shape type="sphere"><point name="center" x="-0.7" y="0.5" z="0"/>
        <float name="radius" value="0.5"/><bsdf type="roughconductor">
        <float name="alpha" value="0.2"/></bsdf></shape>
    <shape type="sphere"><point name="center" x="0.7" y="0.5" z="0.3"/>
        <float name="radius" value="0.5"/><bsdf type="roughplastic">
        <rgb name="diffuse_reflectance" value="0.6 0.2 0.1"/></bsdf></shape>
    <emitter type="spot" id="beam"><transform name="to_world">
        <lookat origin="1.5 2.5 2" target="0.3 0 0" up="0 1 0"/></transform>
        <rgb name="intensity" value="8 7 5"/><float name="cutoff_angle" value="25"/></emitter>
    {lamp}
</scene>
"""

DOME = """<emitter type="envmap" id="dome"><string name="filename" value="dome.exr"/></emitter>"""

SKY = """<emitter type="sunsky" id="sky"><vector name="sun_direction" value="0.4 0.5 0.6"/>
        <transform name="to_world"><rotate x="1" angle="-90"/></transform>
        <float name="sun_scale" value="0.02"/><float name="sky_scale" value="0.02"/></emitter>"""


def room(lamp: str, integrator: str = "path") -> Callable[[Path], str]:
    """Return a function that makes the text of the room of `coverage.py` with `lamp`."""
    text = ROOM.replace('<integrator type="path">', f'<integrator type="{integrator}">')
    boxed = text.replace("</film>", '<rfilter type="box"/></film>')
    return lambda _folder: boxed.format(lamp=lamp)


def hall(folder: Path) -> str:
    """Return the text of a hall with 48 lamps."""
    text = write_hall(folder, 48, width=48, height=27).read_text(encoding="utf-8")
    return text.replace("</film>", '<rfilter type="box"/></film>')


#: The text of each scene, made beside its pictures in a folder.
SCENES: dict[str, Callable[[Path], str]] = {
    "glass": room(HARD_LAMPS["glass"]),
    "bulbs": room(
        "".join(BULB_IN_GLASS.format(k=k, x=x, y=y, z=z) for k, (x, y, z) in enumerate(BULB_PLACES))
    ),
    "mirror": room(HARD_LAMPS["mirror"]),
    "screen": room(SCREEN),
    "48 lamps": hall,
    "dome": lambda _folder: OUTDOORS.format(lamp=DOME),
    "sun and sky": lambda _folder: OUTDOORS.format(lamp=SKY),
    "fog": room(FOG, integrator="volpath"),
    "masks": room(MASKS),
    "profiles": room("".join(PROFILED_SPOT.format(k=k, x=x) for k, x in enumerate((-0.8, 0.5)))),
}


def main() -> None:
    """Print a line for each scene."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", nargs="+", default=list(SCENES), choices=SCENES)
    parser.add_argument("--seeds", type=int, default=6, metavar="N")
    parser.add_argument("--spp", type=int, default=32)
    parser.add_argument("--quick", action="store_true", help="two scenes, two seeds, 4 samples")
    add_csv(parser)
    options = parser.parse_args()
    if options.quick:
        options.scenes, options.seeds, options.spp = ["glass", "screen"], 2, 4
    wrong = of = 0
    rows: list[dict[str, object]] = []
    print(heading())
    with tempfile.TemporaryDirectory() as folder:
        write_pictures(Path(folder))
        for name in options.scenes:
            began_s = time.process_time()
            found = measure(name, Path(folder), seeds=options.seeds, spp=options.spp)
            print(f"{line(name, found)}{time.process_time() - began_s:8.0f}", flush=True)
            wrong, of = wrong + found.wrong, of + found.ratios.size
            rows.append(row(name, found))
            write_rows(options.csv, rows)
    print(f"wrong headlines of what can be met: {wrong} of {of}")


@dataclass(frozen=True)
class Findings:
    """The findings in one scene over all seeds.

    held, told: shares of channels. met, unmet: shares of right headlines; wrong: number of wrong
    ones of what can be met. ratios: (seeds,), the light of a plain render over the predicted light.
    """

    held: float
    told: float
    met: float
    wrong: int
    unmet: float
    ratios: np.ndarray

    @property
    def ratio(self) -> tuple[float, float]:
        """The mean of the ratios and its standard error."""
        scatter = float(self.ratios.std(ddof=1) / np.sqrt(self.ratios.size))
        return float(self.ratios.mean()), scatter


def heading() -> str:
    """Return the heads of the columns of `line`."""
    columns = f"{'held':>8s}{'told':>8s}{'met':>6s}{'wrong':>10s}{'unmet':>7s}"
    return f"{'':14s}{columns}{'render / prediction':>22s}{'CPU s':>8s}"


def line(name: str, found: Findings) -> str:
    """Return the line of a scene."""
    mean, error = found.ratio
    shares = f"{found.held:8.3f}{found.told:8.3f}"
    wrong = f"{found.wrong} of {found.ratios.size}"
    headlines = f"{found.met:6.2f}{wrong:>10s}{found.unmet:7.2f}"
    return f"{name:14s}{shares}{headlines}{mean:13.4f} ± {error:.4f}"


def row(name: str, found: Findings) -> dict[str, object]:
    """Return the row of a scene for a CSV file, with the columns of `line`."""
    mean, error = found.ratio
    return {
        "scene": name,
        "held": f"{found.held:.3f}",
        "told": f"{found.told:.3f}",
        "met": f"{found.met:.2f}",
        "wrong": found.wrong,
        "seeds": found.ratios.size,
        "unmet": f"{found.unmet:.2f}",
        "render / prediction": f"{mean:.4f}",
        "standard error": f"{error:.4f}",
    }


def measure(name: str, folder: Path, *, seeds: int, spp: int) -> Findings:
    """Render, solve and judge one scene. folder: has the pictures of `write_pictures`."""
    use_variant()
    path = folder / f"{name}.xml"
    path.write_text(SCENES[name](folder), encoding="utf-8")
    scene = lp.load_scene(path)
    truth = obtain_basis(scene, spp=TRUTH * spp, seed=10_000, use_cache=False)
    paintings = [*(reachable(truth, k) for k in range(REACHABLE)), unreachable(truth)]
    best = [best_answer(truth, painting).weights for painting in paintings]
    held, told, right, ratios = [], [], [], []
    for seed in range(seeds):
        basis = obtain_basis(scene, spp=spp, seed=seed, use_cache=False)
        chosen = seed % REACHABLE, REACHABLE
        answers = [best_answer(basis, paintings[k]) for k in chosen]
        for answer, k in zip(answers, chosen, strict=True):
            weights = best[k]
            bars = lp.error_bars(answer)
            assert bars is not None
            low, high = bars.interval
            is_held, is_on = (low <= weights + 1e-9) & (weights <= high + 1e-9), weights > 0
            held.append(is_held[is_on])
            told.append(is_held[is_on & ~bars.untold[:, None]])
        of_met, of_unmet = map(headline, answers)
        is_close = of_met.startswith(CLOSE)
        is_wrong = not is_close and FEW_SAMPLES not in of_met
        right.append([is_close, is_wrong, not of_unmet.startswith(CLOSE)])
        ratios.append(render_over_prediction(scene, basis, answers[1], folder, spp=RENDER * spp))
    met, wrong, unmet = np.array(right, float).mean(axis=0).tolist()
    all_told = np.concatenate(told)
    share_told = float(all_told.mean()) if all_told.size else np.nan
    return Findings(
        float(np.concatenate(held).mean()),
        share_told,
        met,
        round(wrong * seeds),
        unmet,
        np.array(ratios),
    )


def best_answer(basis: lp.Basis, target: lp.Target) -> lp.Solution:
    """Return the answer to a painting of light, noise taken out."""
    return lp.correct_noise(lp.solve(basis, target, literal=True))


def reachable(truth: lp.Basis, k: int) -> lp.Target:
    """Paint what the lights make at other levels, each up to two stops brighter or darker.

    k: the number of the painting.
    """
    rng = np.random.default_rng(1 + k)
    stops = rng.uniform(-REACHED_STOPS, REACHED_STOPS, (len(truth.names), 1))
    return whole_painting("reachable", truth.mix(truth.current_weights * 2**stops))


def unreachable(truth: lp.Basis) -> lp.Target:
    """Paint squares over the look that are brighter and darker in turns."""
    height, width = truth.size
    side = width / SQUARES
    y, x = np.mgrid[:height, :width]
    sign = 1 - 2 * ((x // side + y // side) % 2)
    return whole_painting("squares", truth.current_look * 2 ** (SQUARE_STOPS * sign[..., None]))


def whole_painting(name: str, image: np.ndarray) -> lp.Target:
    """Return a painting of the whole picture in linear light, (h, w, 3)."""
    importance = np.ones(image.shape[:2], np.float32)
    return lp.Target(name, image.astype(np.float32), importance, everything=True)


def headline(answer: lp.Solution) -> str:
    """Return what is said of an answer without a render."""
    return lp.verdict(answer, lp.combine(answer.basis, answer.lighting), None)


def render_over_prediction(
    scene: lp.Scene, basis: lp.Basis, answer: lp.Solution, folder: Path, *, spp: int
) -> float:
    """Return the mean light of a render by Mitsuba alone over the light of the prediction."""
    import mitsuba as mi

    seed = basis.origin.seed
    relit = folder / "relit.xml"
    lp.relight(scene, answer.lighting, relit)
    image = np.array(mi.render(mi.load_file(str(relit)), spp=spp, seed=20_000 + seed))[..., :3]
    return float(image.mean(dtype=np.float64) / basis.mix(answer.weights).mean(dtype=np.float64))


def write_pictures(folder: Path) -> None:
    """Write the pictures that scenes refer to."""
    rng = np.random.default_rng(3)
    blocks = np.kron(rng.uniform(0.05, 1, (6, 10, 3)), np.ones((8, 8, 1)))
    write_rgb(folder / "screen.exr", (2 * blocks).clip(0, 1).astype(np.float32))
    y, x = np.mgrid[-1:1:64j, -1:1:64j]
    leaves = (np.sin(9 * x + 2 * y) * np.sin(8 * y - 3 * x) > -0.2).astype(np.float32)
    write_rgb(folder / "leaves.exr", np.repeat(leaves[..., None], 3, axis=-1))
    radius = np.hypot(x, y)
    rings = np.exp(-2 * radius**2) * (0.6 + 0.4 * np.cos(14 * radius)) * (radius < 1)
    write_rgb(folder / "rings.exr", np.repeat(rings[..., None], 3, axis=-1).astype(np.float32))
    height, angle = np.mgrid[1:-1:32j, 0 : 2 * np.pi : 64j]
    sky = (0.2 + 0.5 * np.maximum(height, 0))[..., None] * np.array([0.6, 0.8, 1.2])
    glow = np.exp(-30 * ((height - 0.5) ** 2 + (angle - 2) ** 2))[..., None]
    write_rgb(folder / "dome.exr", (sky + 20 * glow).astype(np.float32))


if __name__ == "__main__":
    main()
