"""Rivals of the search for places: a choice among fixed candidates, and descent by gradients."""

import math

import numpy as np
from closed_rooms import ClosedRoom
from scipy.optimize import nnls

import lightpaint as lp
from lightpaint.arrays import Doubles, Floats
from lightpaint.scene.lights.new_emitter import NewKind
from lightpaint.scene.mitsuba_scene import Scene

#: Number of fixed candidates, and samples of each one's image.
CANDIDATES, CANDIDATE_SPP = 96, 16

#: Steps and starts of Adam.
STEPS, STARTS = 60, 2

#: Side of candidate panels, which is the true one.
SIDE = 0.6


def chosen_candidates(
    room: ClosedRoom, scene: Scene, kind: NewKind, count: int, painted: Floats
) -> list[lp.NewEmitter]:
    """Return the best of many random lights, chosen one after the other."""
    lights = random_lights(room, kind, CANDIDATES, (1, 1, 1))
    basis = lp.render_basis(scene.with_new_emitters(lights), spp=CANDIDATE_SPP, seed=21)
    columns = np.stack([np.asarray(plane, dtype=float).reshape(-1, 3) for plane in basis.planes])
    names = [light.name for light in basis.lights]
    chosen = [k for k, name in enumerate(names) if not name.startswith("guess_")]
    for _ in range(count):
        rest = [k for k in range(len(names)) if k not in chosen]
        chosen.append(min(rest, key=lambda k: residual(columns[[*chosen, k]], painted)))
    return [light for light in lights if names.index(light.name) in chosen]


def residual(columns: Doubles, painted: Floats) -> float:
    """Return the squared residual of the best weights >= 0."""
    goal = painted.reshape(-1, 3)
    return sum(nnls(columns[:, :, c].T, goal[:, c].astype(float))[1] ** 2 for c in range(3))


def adam(room: ClosedRoom, scene: Scene, kind: NewKind, count: int, painted: Floats) -> float:
    """Return what the best of some starts misses, as a share of the squared painting."""
    import drjit as dr
    import mitsuba as mi

    best = math.inf
    target = mi.TensorXf(painted)
    for _ in range(STARTS):
        lights = random_lights(room, kind, count, (3, 3, 3))
        loaded = scene.with_new_emitters(lights).load()
        parameters = mi.traverse(loaded)
        optimiser = mi.ad.Adam(lr=0.05)
        chosen = [key for key, _ in parameters if key.startswith("guess_")]
        chosen = [key for key in chosen if key.endswith(("position", "intensity.value"))]
        for key in chosen:
            optimiser[key] = parameters[key]
        parameters.update(optimiser)
        integrator = mi.load_dict({"type": "path", "max_depth": 6})
        for step in range(STEPS):
            image = mi.render(loaded, parameters, integrator=integrator, spp=4, seed=step)
            loss = dr.sum(dr.square(image - target)) / dr.sum(dr.square(target))
            dr.backward(loss)
            optimiser.step()
            for key in chosen:
                if key.endswith("value"):
                    optimiser[key] = dr.maximum(optimiser[key], 0)
            parameters.update(optimiser)
        image = np.array(mi.render(loaded, spp=64, seed=99))[..., :3]
        best = min(best, float(np.square(image - painted).sum() / np.square(painted).sum()))
    return best


def random_lights(
    room: ClosedRoom, kind: NewKind, count: int, emission: tuple[float, float, float]
) -> list[lp.NewEmitter]:
    """Return lights at random free places of a room, aimed at its floor and furniture."""
    lights = []
    for k in range(count):
        x, y, z = (float(v) for v in room.free_place())
        target = None if kind == "point" else room.some_target()
        pose = lp.Pose(position=(x, y, z), target=target)
        size = (SIDE, SIDE) if kind == "panel" else None
        lights.append(lp.NewEmitter(f"guess_{k}", kind, pose, size, emission))
    return lights
