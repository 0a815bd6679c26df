"""How often do 95 % intervals of lights hold what many samples come to?

    python benchmarks/coverage.py [--scenes cornell stage ...] [--seeds 200] [--spp 16]

The scenes that come along, each with a painting of its own, on small films, and two rooms in which
a lamp is little but stray bright pixels: a bulb in a glass ball, and a small lamp that lights the
room by way of a mirror. Paintings are fitted as linear light. The samples of one render are cut
into as many bases as there are seeds; all of them together are the truth, and for the two rooms
ten times as many. Printed is how often the intervals hold the truth, over lights, channels and
seeds: of channels that are on in truth, of those that are at a bound there, whose intervals have
one side and hold it nearly always, of the channel that is on and held least, and of those that are
on and told; the share of lights that "cannot be told"; and the median over channels that are on and
told of the stated scatter over the scatter of the seeds. Without the noise correction and with it.
"""

import argparse
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

import lightpaint as lp
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.render.basis_render import train_tracer
from lightpaint.basis.render.rendered_basis import basis_of_sums
from lightpaint.scene import render_first_hits
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.runtime.variant import use_variant
from lightpaint.target.painted_target import Target

ROOT = Path(__file__).parent.parent

#: Film and painting of each scene that comes along.
SHIPPED = {
    "cornell": ("1/4", "cornell/warm.exr"),
    "stage": ("1/10", "stage/sunset.exr"),
    "gallery": ("1/8", "gallery/evening.exr"),
}

#: A lamp that paths find by chance alone, in the room below.
HARD_LAMPS = {
    "glass": """<shape type="sphere" id="hard"><point name="center" x="0.5" y="0.9" z="0"/>
        <float name="radius" value="0.05"/>
        <emitter type="area"><rgb name="radiance" value="20 20 20"/></emitter></shape>
    <shape type="sphere"><point name="center" x="0.5" y="0.9" z="0"/>
        <float name="radius" value="0.12"/><bsdf type="dielectric"/></shape>""",
    "mirror": """<shape type="sphere" id="hard"><point name="center" x="0.5" y="1.3" z="0"/>
        <float name="radius" value="0.03"/>
        <emitter type="area"><rgb name="radiance" value="60 60 60"/></emitter></shape>
    <shape type="disk"><transform name="to_world"><scale value="0.25"/><rotate x="1" angle="90"/>
        <translate x="0.5" y="1.22" z="0"/></transform><bsdf type="twosided"><bsdf type="diffuse">
        <rgb name="reflectance" value="0.02"/></bsdf></bsdf></shape>
    <shape type="rectangle"><transform name="to_world"><scale value="0.3"/>
        <rotate x="1" angle="90"/><translate x="0.5" y="1.7" z="0"/></transform>
        <bsdf type="conductor"/></shape>""",
}

ROOM = """<scene version="3.0.0">
    <integrator type="path"><integer name="max_depth" value="6"/></integrator>
    <sensor type="perspective" id="camera"><float name="fov" value="55"/>
        <transform name="to_world"><lookat origin="0 1 3.4" target="0 0.9 0" up="0 1 0"/>
        </transform><film type="hdrfilm"><integer name="width" value="80"/>
        <integer name="height" value="45"/></film></sensor>
    <shape type="rectangle"><transform name="to_world"><scale value="2"/>
        <rotate x="1" angle="-90"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.6 0.5 0.4"/></bsdf></shape>
    <shape type="rectangle"><transform name="to_world"><scale value="2"/>
        <translate y="1" z="-1"/></transform>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.5 0.6 0.7"/></bsdf></shape>
    <shape type="rectangle" id="panel"><transform name="to_world"><scale value="0.3"/>
        <rotate x="1" angle="90"/><translate x="-0.6" y="1.9"/></transform>
        <emitter type="area"><rgb name="radiance" value="4 3 2"/></emitter></shape>
    <emitter type="spot" id="beam"><transform name="to_world">
        <lookat origin="-0.8 1.8 1.5" target="-0.3 0 0" up="0 1 0"/></transform>
        <rgb name="intensity" value="2 2 2"/><float name="cutoff_angle" value="30"/></emitter>
    <emitter type="point" id="bulb"><point name="position" x="0.9" y="0.4" z="0.6"/>
        <rgb name="intensity" value="0.3 0.3 0.3"/></emitter>
    {lamp}
</scene>
"""


def main() -> None:
    """Print a line for each scene, without the noise correction and with it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    kinds = (*SHIPPED, *HARD_LAMPS)
    parser.add_argument("--scenes", nargs="+", default=list(kinds), choices=kinds)
    parser.add_argument("--seeds", type=int, default=200, metavar="N")
    parser.add_argument("--spp", type=int, default=16)
    options = parser.parse_args()
    use_variant()
    columns = ("on", "at bound", "least", "told", "untold", "scatter", "CPU s")
    print(f"{'':24s}" + "".join(f"{name:>10s}" for name in columns))
    with tempfile.TemporaryDirectory() as folder:
        for kind in options.scenes:
            measure(kind, Path(folder), seeds=options.seeds, spp=options.spp)


def measure(kind: str, folder: Path, *, seeds: int, spp: int) -> None:
    """Render, solve and print two lines."""
    began_s = time.process_time()
    scene, factor = make_scene(kind, folder)
    *bases, truth = rendered_bases(scene, seeds, spp, factor)
    target = make_target(kind, truth)
    best = lp.correct_noise(lp.solve(truth, target, literal=True, resize=True)).weights
    intervals: list[list[np.ndarray]] = [[], []]
    untold: list[list[np.ndarray]] = [[], []]
    solved: list[list[np.ndarray]] = [[], []]
    stated: list[list[np.ndarray]] = [[], []]
    for basis in bases:
        solution = lp.solve(basis, target, literal=True, resize=True)
        for k, answer in enumerate((solution, lp.correct_noise(solution))):
            bars = lp.error_bars(answer)
            assert bars is not None
            low, high = bars.interval
            intervals[k].append((low <= best + 1e-9) & (best <= high + 1e-9))
            untold[k].append(bars.untold)
            solved[k].append(bars.weights)
            stated[k].append(bars.scatter)
    cpu_s = time.process_time() - began_s
    for k, name in enumerate((kind, f"{kind}, corrected")):
        hits, is_on, unknown = np.array(intervals[k]), best > 0, np.array(untold[k])
        numbers = (
            hits[:, is_on].mean(),
            hits[:, ~is_on].mean() if not is_on.all() else np.nan,
            hits[:, is_on].mean(axis=0).min(),
            hits[is_on & ~unknown[..., None]].mean(),
            unknown.mean(),
            scatter_ratio(np.array(solved[k]), np.array(stated[k]), unknown),
        )
        print(f"{name:24s}" + "".join(f"{x:10.3f}" for x in numbers) + f"{cpu_s:10.0f}", flush=True)


def scatter_ratio(solved: np.ndarray, stated: np.ndarray, untold: np.ndarray) -> float:
    """Return the median over channels of the stated scatter over the scatter of the weights.

    solved, stated: (seeds, n, 3); of a channel the median over seeds is stated. untold: (seeds, n).
    Channels count that are on in all seeds, within half their level, of lights that are told in
    four fifths of them.
    """
    scatter = solved.std(axis=0, ddof=1)
    is_sure = (solved > 0).all(axis=0) & (scatter > 0) & (scatter < solved.mean(axis=0) / 2)
    is_sure &= (untold.mean(axis=0) <= 0.2)[:, None]
    return float(np.median(np.median(stated, axis=0)[is_sure] / scatter[is_sure]))


def make_scene(kind: str, folder: Path) -> tuple[Scene, int]:
    """Return a scene on a small film, and how many times the seeds' samples its truth needs."""
    if kind in SHIPPED:
        return lp.load_scene(ROOT / "scenes" / kind / "scene.xml").reduced(SHIPPED[kind][0]), 1
    path = folder / f"{kind}.xml"
    path.write_text(ROOM.format(lamp=HARD_LAMPS[kind]), encoding="utf-8")
    return lp.load_scene(path), 10


def make_target(kind: str, truth: Basis) -> Target:
    """Return the painting of a shipped scene, or something that no mix of the lights is."""
    if kind in SHIPPED:
        return lp.read_target(ROOT / "targets" / SHIPPED[kind][1])
    height, width = truth.size
    y, x = np.mgrid[:height, :width, :1][:2]
    image = truth.current_look * (0.6 + 0.4 * (x > width / 2)) * np.array([1, 0.7, 0.3])
    image = (image + 0.1 * truth.current_look.mean() * y / height).astype(np.float32)
    return Target("painted", image, np.ones(truth.size, np.float32), everything=True)


def rendered_bases(scene: Scene, seeds: int, spp: int, factor: int) -> Iterator[Basis]:
    """Yield a basis of `spp` samples per pixel for each seed, and one of all samples.

    Each is a stretch of the pixels' sequences: as evenly spread as the first, and scrambled alike.
    All have the surfaces in view, as every rendered basis has. factor: of the samples that the last
    one has.
    """
    from lightpaint.basis.render.tracer.one_pass import Tracer

    tracer, rows, half_spp = Tracer(scene, 0), range(scene.size[0]), spp // 2
    table = train_tracer(tracer, lambda: None)
    features, objects = render_first_hits(scene, seed=0)
    total: list[np.ndarray] = []
    emitter_mask = np.zeros(scene.size, bool)
    for seed in range(seeds):
        sums = []
        for half in range(2):
            planes = tracer.planes(rows)
            tracer.add(planes, half, rows, seed * half_spp, half_spp)
            sums.append(planes.sums())
            emitter_mask |= planes.seen() > 0
        total = total or [np.zeros(x.shape) for x in sums]
        for all_of_them, part in zip(total, sums, strict=True):
            all_of_them += part
        basis = basis_of_sums(scene, 0, sums, emitter_mask, half_spp, table, start=None)
        yield replace(basis, features=features, objects=objects)
    for half in range(2):
        planes = tracer.planes(rows)
        tracer.add(planes, half, rows, seeds * half_spp, (factor - 1) * seeds * half_spp)
        total[half] += planes.sums()
    tracer.close()
    sums = [x.astype(np.float32) for x in total]
    half_spp *= factor * seeds
    basis = basis_of_sums(scene, 0, sums, emitter_mask, half_spp, table, start=None)
    yield replace(basis, features=features, objects=objects)


if __name__ == "__main__":
    main()
