"""The rival of the search for a sky: Adam through Mitsuba's differentiable renderer."""

import time
from pathlib import Path

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.scene.lights.texels.image_domains import GridSize
from lightpaint.scene.runtime.variant import use_variant

#: Samples per pixel of a step, and least radiance: what is black is not sampled any more.
STEP_SPP, LEAST = 8, 1e-3


def adam(
    path: Path,
    target: Floats,
    counted: Bools,
    *,
    size: GridSize,
    budget_s: float,
    step_size: float,
) -> tuple[Doubles, int]:
    """Return the texels (rows, columns, 3) that Adam finds in a scene, and its number of steps.

    path: scene whose light `sky` has a map of `size`, the start. counted: (h, w), pixels of the
    squared error, relative to the target's mean there. budget_s: of the processor, without what the
    first step takes, which compiles.
    """
    use_variant()
    import drjit as dr
    import mitsuba as mi

    scene = mi.load_file(str(path))
    parameters = mi.traverse(scene)
    columns, rows = size
    stored = np.array(parameters["sky.data"])
    # Mitsuba's map has a column more on each side, which wrap around.
    assert stored.shape == (rows, columns + 2, 3)
    places = np.arange(rows * columns * 3).reshape(rows, columns, 3)
    places = places[:, np.arange(-1, columns + 1) % columns]
    at = mi.UInt32(places.ravel().astype(np.uint32))
    integrator = mi.load_dict({"type": "prb", "max_depth": 6})
    scale = float(target[counted].mean())
    weight = mi.TensorXf((counted[..., None] / scale * np.ones(3)).astype(np.float32))
    psi = mi.TensorXf(target.astype(np.float32))
    optimizer = mi.ad.Adam(lr=step_size)
    optimizer["texels"] = mi.Float(stored[:, 1:-1].ravel())
    spent_s, step = 0.0, 0
    while spent_s < budget_s:
        begin_s = time.process_time()
        optimizer["texels"] = dr.maximum(optimizer["texels"], LEAST)
        wrapped = dr.gather(mi.Float, optimizer["texels"], at)
        parameters["sky.data"] = mi.TensorXf(wrapped, shape=stored.shape)
        parameters.update()
        rendered = mi.render(scene, parameters, integrator=integrator, spp=STEP_SPP, seed=step)
        dr.backward(dr.sum(dr.square(weight * (rendered - psi)), axis=None))
        optimizer.step()
        dr.eval(optimizer["texels"])
        step += 1
        spent_s += time.process_time() - begin_s if step > 1 else 0.0
    found = np.array(dr.maximum(optimizer["texels"], LEAST))
    return found.reshape(rows, columns, 3).astype(np.float64), step
