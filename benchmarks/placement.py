"""How well unknown lights are found: closed rooms by seed, `lp.place`, and rivals in the same run.

    python benchmarks/placement.py [--rooms 10] [--first 100] [--kinds point,spot,panel]
        [--rivals] [--behind] [--gallery] [--levels]

Each room is painted by a plain render with 1 to 3 lights that the search does not know (one, for
panels). Missed shares are Σ (Ψ − picture)² / Σ Ψ²: of the room as it is known, of the scene that
was found by an independent plain render, and between two plain renders of the truth, which is the
noise floor. The excess is Σ (F − T)(F′ − T′) / Σ Ψ² of two independent renders of each, of what was
found and of the truth: on average their squared difference without noise. What one render misses
above the floor is not: renders of a light close to a wall have much more noise than others.

A room is at the floor if the excess is below FOUND. It counts as found if each true light has a
found one within NEAR of it, too. Seconds are of the processor, all threads, and those that
somebody waits.
`--rivals` adds a choice among fixed random candidates, and Adam through Mitsuba's
differentiable path integrator from random starts; both are told how many lights there are.
`--levels` compares the errors of a moved light's place and of all levels with what is stated.
"""

import argparse
import math
import resource
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from closed_rooms import ClosedRoom, point
from coverage import ROOM
from placement_rivals import CANDIDATES, STARTS, adam, chosen_candidates
from scipy.optimize import nnls

import lightpaint as lp
from lightpaint.arrays import Floats
from lightpaint.images.pixel_blocks import block_mean
from lightpaint.scene.mitsuba_scene import Scene

ROOT = Path(__file__).parent.parent

#: Share of ‖Ψ‖² above the noise floor, and metres that each light is off, up to which a room counts
#: as found.
FOUND, NEAR = 0.005, 0.15

#: What kinds of lights rooms have, in turn.
KINDS = ("point", "spot", "panel")

#: Cones of the gallery's spots where these and their beams are free, in degrees; just below its
#: ceiling, which goes on in the annex; and samples of each of two bases.
FREE_CONE = (10, 60)
UNDER_CEILING = ((-3.2, 3.65, 0.2), (3.2, 3.65, 9.8))
GALLERY_SPP = 128

#: Samples of paintings and verifications, of bases, of those that verifications are solved with
#: (noise of a column makes its light too dim), and size of the pictures.
SPP, BASIS_SPP, EXACT_SPP, SIZE = 256, 64, 256, (160, 90)


#: Place of the bulb in the room of `--levels`, and the place from which it is searched for.
BULB, MOVED_BULB = 'x="0.9" y="0.4" z="0.6"', 'x="0.6" y="0.7" z="0.3"'


def main() -> None:
    """Print one line for each room, and the sums."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rooms", type=int, default=10)
    parser.add_argument("--first", type=int, default=100)
    parser.add_argument("--kinds", default=",".join(KINDS))
    for name in ("rivals", "behind", "gallery", "levels"):
        parser.add_argument(f"--{name}", action="store_true")
    options = parser.parse_args()
    if options.behind:
        show_behind()
    if options.gallery:
        show_gallery()
    if options.levels:
        show_levels()
    kinds = options.kinds.split(",")
    lines = []
    print("room   lights     known  floor  found  excess  cpu s      s  / render  off       turned")
    for k in range(options.rooms):
        kind = kinds[k % len(kinds)]
        with tempfile.TemporaryDirectory() as folder:
            seed = options.first + k
            lines.append(one_room(Path(folder), kind, seed, with_rivals=options.rivals))
    if lines:
        seconds = [line[2] for line in lines]
        floor_count, found_count = (sum(line[k] for line in lines) for k in range(2))
        print(
            f"{floor_count} of {len(lines)} at the floor, {found_count} found; "
            f"median {statistics.median(seconds):.0f} s, most {max(seconds):.0f} s"
        )


def one_room(folder: Path, kind: str, seed: int, *, with_rivals: bool) -> tuple[bool, bool, float]:
    """Print the line of a room; return whether it is at the floor and is found, and seconds."""
    room = ClosedRoom(seed)
    count = 1 if kind == "panel" else 1 + seed // len(KINDS) % 3
    true = getattr(room, f"{kind}s")(count)
    scene = lp.load_scene(room.write(folder / "room.xml", [], size=SIZE))
    truth = lp.load_scene(room.write(folder / "true.xml", true, size=SIZE))
    start = cpu_s()
    painted = rendered(truth, seed=1)
    render_s = cpu_s() - start
    true_pair = [rendered(truth, seed=k) for k in (2, 4)]
    floor = missed(true_pair[0], painted)
    basis = lp.render_basis(scene, spp=BASIS_SPP, seed=3)
    solution = lp.solve(basis, lp.Target.of(painted), space="linear", hold=0)
    start, waited = cpu_s(), time.perf_counter()
    new = [lp.NewLights(kind, count=3, in_view=True)]
    placement = lp.place(scene, basis, solution, new=new, seed=seed)
    seconds, waited = cpu_s() - start, time.perf_counter() - waited
    found_pair = verifications(placement.scene, solution, folder)
    verified, excess = missed(found_pair[0], painted), distance(found_pair, true_pair, painted)
    position_errors, angle_errors = distances(truth, placement)
    known_loss = sum(solution.certificate.objective) / float(solution.norm2.sum())
    print(
        f"{seed:4d}   {count} {kind:8s} {known_loss:6.3f} {floor:6.4f} {verified:6.4f}"
        f" {excess:7.4f} {seconds:6.1f} {waited:5.0f} {seconds / render_s:9.1f}"
        f"  {listed(position_errors, '.2f'):9s} {listed(angle_errors, '.0f')}",
        flush=True,
    )
    if with_rivals:
        show_rivals(room, scene, kind, count, solution, folder)
    is_at_floor = excess < FOUND
    return is_at_floor, is_at_floor and max(position_errors) < NEAR, seconds


def verifications(scene: Scene, solution: lp.Solution, folder: Path) -> list[Floats]:
    """Return two plain renders of the written scene, its lights solved for with an exact basis."""
    basis = lp.render_basis(scene, spp=EXACT_SPP, seed=11)
    target = solution.problem.views.targets[0]
    lighting = lp.solve(basis, target, space="linear", hold=0).lighting
    relit = lp.relight(scene, lighting, folder / "relit" / "relit.xml")
    return [rendered(relit, seed=k) for k in (12, 13)]


def rendered(scene: Scene, *, seed: int, spp: int = SPP) -> Floats:
    """Return a render by plain Mitsuba, (h, w, 3) linear."""
    import mitsuba as mi

    loaded = mi.load_file(str(scene.path))
    sensor = loaded.sensors()[scene.sensor]
    return np.array(mi.render(loaded, sensor=sensor, spp=spp, seed=seed))[..., :3]


def missed(picture: Floats, painted: Floats) -> float:
    """Return Σ (Ψ − picture)² / Σ Ψ²."""
    return float(np.square(painted - picture).sum() / np.square(painted).sum())


def distance(found: list[Floats], true: list[Floats], painted: Floats) -> float:
    """Return Σ (F − T)(F′ − T′) / Σ Ψ² of two renders each, of which all noise is independent."""
    differences = [f.astype(float) - t for f, t in zip(found, true, strict=True)]
    return float((differences[0] * differences[1]).sum() / np.square(painted).sum())


def distances(truth: Scene, placement: lp.Placement) -> tuple[list[float], list[float]]:
    """Return how far each true light is from its nearest found one, and degrees between them."""
    position_errors, angle_errors = [], []
    for emitter in truth.emitters:
        if not emitter.name.startswith("true") or emitter.site.position is None:
            continue
        candidates = [
            (math.dist(x.site.position or (0, 0, 0), emitter.site.position), x.site)
            for x in placement.additions
        ]
        away, site = min(candidates, key=lambda pair: pair[0], default=(math.inf, emitter.site))
        position_errors.append(away)
        if emitter.site.direction is not None and site.direction is not None:
            cosine = float(np.dot(emitter.site.direction, site.direction))
            angle_errors.append(math.degrees(math.acos(min(1, max(-1, cosine)))))
    return position_errors, angle_errors


def show_rivals(
    room: ClosedRoom, scene: Scene, kind: Any, count: int, solution: lp.Solution, folder: Path
) -> None:
    """Print what rivals leave of the same room. They are told the kind and number of lights."""
    painted = solution.problem.views.targets[0].image
    start = cpu_s()
    lights = chosen_candidates(room, scene, kind, count, painted)
    seconds = cpu_s() - start
    [picture, _] = verifications(scene.with_new_emitters(lights), solution, folder)
    left = missed(picture, painted)
    print(f"         {CANDIDATES} fixed candidates: {left:.4f} in {seconds:.1f} s", flush=True)
    if kind != "panel":
        start = cpu_s()
        left = adam(room, scene, kind, count, painted)
        seconds = cpu_s() - start
        print(f"         Adam, {STARTS} starts: {left:.4f} in {seconds:.1f} s", flush=True)


def show_levels() -> None:
    """Print errors of a place and of levels over seeds, root mean square, and those stated."""
    errors, stated, fixed = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        true, start = Path(folder) / "true.xml", Path(folder) / "start.xml"
        text = ROOM.format(lamp="")
        true.write_text(text, encoding="utf-8")
        start.write_text(text.replace(BULB, MOVED_BULB), encoding="utf-8")
        truth, scene = lp.load_scene(true), lp.load_scene(start)
        painted = lp.render_basis(truth, spp=4096, seed=99)
        target = lp.Target.of(painted.current_look)
        for seed in range(10):
            basis = lp.render_basis(scene, spp=BASIS_SPP, seed=seed)
            solution = lp.correct_noise(lp.solve(basis, target, literal=True))
            placement = lp.place(scene, basis, solution, {"bulb": lp.Freedom(within=0.8)})
            [move] = placement.moves
            assert move.new.position is not None
            assert move.place_error is not None
            off = math.dist(move.new.position, truth.light("bulb").members[0].site.position)
            basis = lp.render_basis(placement.scene, spp=BASIS_SPP, seed=seed)
            solution = lp.correct_noise(lp.solve(basis, target, literal=True))
            levels = solution.weights[:, 1] / painted.current_weights[:, 1]
            bars = [lp.error_bars(solution, level_errors=x) for x in ((), placement.level_errors)]
            here, both = (x.standard_error[:, 1] / painted.current_weights[:, 1] for x in bars)
            errors.append([off, *(levels - 1)])
            stated.append([move.place_error, *both])
            fixed.append([move.place_error, *here])
    print("place of the bulb, and levels of", *basis.names)
    for name, rows in (("errors", errors), ("stated", stated), ("for this place", fixed)):
        rms = np.sqrt(np.mean(np.square(rows), axis=0))
        print(f"{name:16s}" + "".join(f"{x:9.4f}" for x in rms), flush=True)


def show_behind() -> None:
    """Print where a light behind the camera is found by one view, and by two."""
    room = ClosedRoom(7)
    true = np.array([0.6, 2.0, 4.3])
    lights = [point("true_0", true, np.full(3, 4.0))]
    with tempfile.TemporaryDirectory() as folder:
        paths = [
            room.write(Path(folder) / name, emitters, size=SIZE, views=2)
            for name, emitters in (("room.xml", []), ("true.xml", lights))
        ]
        scenes, truths = (
            [lp.load_scene(path, sensor=k) for k in ("camera", "other")] for path in paths
        )
        bases = [lp.render_basis(x, spp=BASIS_SPP, seed=3 + k) for k, x in enumerate(scenes)]
        targets = [lp.Target.of(rendered(x, seed=1 + k)) for k, x in enumerate(truths)]
        for count in (1, 2):
            solution = lp.solve(bases[:count], targets[:count], space="linear", hold=0)
            new = [lp.NewLights("point", count=1)]
            placement = lp.place(scenes[:count], bases[:count], solution, new=new)
            for light in placement.additions:
                position_error = math.dist(light.site.position or (0, 0, 0), true)
                error = light.place_error or 0.0
                print(
                    f"behind the camera, {count} views: {position_error:.3f} off, "
                    f"error bar {error:.3f}; {light}",
                    flush=True,
                )


def show_gallery() -> None:
    """Print what the gallery's evening misses with fixed, moved and new spots.

    Roots of shares of ‖Ψ‖² on 160x90 pixels and on 80x45, where all count alike: of the best lights
    of two bases of the scene that was found, with their noise and without, and of a plain render.
    """
    scene = lp.load_scene(ROOT / "scenes" / "gallery" / "scene.xml").reduced("1/2")
    # The painting itself keeps lamps' colours, and counts what was painted more than the rest.
    target = lp.Target.of(lp.read_target(ROOT / "targets" / "gallery" / "evening.exr").image)
    spots = [light.name for light in scene.lights if light.plugin == "spot"]
    basis = lp.render_basis(scene, spp=BASIS_SPP)
    solution = lp.solve(basis, target, space="linear", hold=0, resize=True)
    rails = {name: rail_of(scene, name) for name in spots}
    print(f"gallery evening, fixed: {gallery_shares(scene, target)}", flush=True)
    added = [lp.NewLights("spot", count=2, freedom=lp.Freedom(box=UNDER_CEILING))]
    for new, cone in (([], None), ([], FREE_CONE), (added, FREE_CONE)):
        freedoms = {
            name: lp.Freedom(line=rail, aim=True, cone=cone, beam=cone is not None)
            for name, rail in rails.items()
        }
        start = cpu_s()
        placement = lp.place(scene, basis, solution, freedoms, new=new)
        seconds = cpu_s() - start
        print(
            f"  {len(placement.additions)} new, cones and beams {'free' if cone else 'fixed'}: "
            f"{gallery_shares(placement.scene, target)}, by the search "
            f"{math.sqrt(placement.missed_after):.3f}, in {seconds:.0f} s",
            flush=True,
        )
        for change in (*placement.moves, *placement.additions):
            print(f"    {change}", flush=True)


def gallery_shares(scene: Scene, target: lp.Target) -> str:
    """Return roots of missed shares on films of two sizes."""
    films = [scene.reduced(part) for part in ("1/2", "1/4")]
    return "; ".join(shares_on(film, target) for film in films)


def shares_on(scene: Scene, target: lp.Target) -> str:
    """Return roots of missed shares: without noise of a basis, with it, and of a plain render."""
    painted = block_mean(target.image, target.image.shape[0] // scene.size[0])
    bases = [lp.render_basis(scene, spp=GALLERY_SPP, seed=seed) for seed in (5, 6)]
    lighting = lp.solve(bases[0], lp.Target.of(painted), space="linear", hold=0).lighting
    with tempfile.TemporaryDirectory() as folder:
        relit = lp.relight(scene, lighting, Path(folder) / "relit.xml")
        # It is written with the size of the scene's file.
        picture = rendered(relit, seed=7, spp=GALLERY_SPP // 8)
    picture = block_mean(picture, picture.shape[0] // painted.shape[0])
    shares = missed_by_best(bases, painted), missed_by_best(bases[:1] * 2, painted)
    exact, noisy, plain = (math.sqrt(share) for share in (*shares, missed(picture, painted)))
    height, width = scene.size
    return f"{width}x{height} {exact:.3f}, with noise {noisy:.3f}, rendered {plain:.3f}"


def rail_of(scene: Scene, name: str) -> Any:
    """Return the track that a spot of the gallery hangs on: along z, through its place."""
    x, y, _ = scene.light(name).members[0].site.position or (0, 0, 0)
    return (x, y, 0.6), (x, y, 6.0)


def missed_by_best(bases: list[lp.Basis], painted: Floats) -> float:
    """Return the share that the best lights >= 0 miss: Σ r r′ / Σ Ψ² of the residuals by two bases.

    Their noise is independent, so that on average the product has none.
    """
    halves = [np.stack(list(basis.planes)).reshape(len(basis.lights), -1, 3) for basis in bases]
    planes, goal, total = np.mean(halves, axis=0, dtype=float), painted.reshape(-1, 3), 0.0
    for c in range(3):
        weights = nnls(planes[:, :, c].T, goal[:, c].astype(float))[0]
        first, second = (goal[:, c] - weights @ half[:, :, c] for half in halves)
        total += float(first @ second)
    return total / float(np.square(goal).sum())


def listed(values: list[float], form: str) -> str:
    """Return numbers in a row."""
    return " ".join(f"{value:{form}}" for value in values)


def cpu_s() -> float:
    """Return the processor's seconds of this process."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


if __name__ == "__main__":
    main()
