"""Finds the pixels in which the camera sees an emitter through clear surfaces, without lighting.

Import this module after setting a Dr.Jit variant, since its array types do not exist before.
"""

# mypy: disable-error-code="no-untyped-def, no-untyped-call"

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from lightpaint.arrays import Bools
from lightpaint.basis.render.tracer.path_tracer import View, camera_rays, passes_clearly


def has_clear_surfaces(loaded: Any) -> bool:
    """Return whether a loaded scene has clear glass or other surfaces that let rays pass straight
    through.
    """
    surfaces = [shape.bsdf().flags() for shape in loaded.shapes() if shape.bsdf() is not None]
    clear = mi.BSDFFlags.DeltaTransmission, mi.BSDFFlags.Null
    return any(mi.has_flag(flags, kind) for flags in surfaces for kind in clear)


def emitters_seen_through(view: View, max_depth: int, *, samples: int, seed: int) -> Bools:
    """Return the pixels of a view, (h, w), in which some sample sees an emitter."""
    count = view.width * view.height
    seen = np.zeros(count, bool)
    sampler = mi.load_dict({"type": "independent"})
    for k in range(samples):
        sampler.seed(seed + k, count)
        pixel = dr.arange(mi.UInt32, count)
        seen |= np.array(_sees_emitter(view, sampler, pixel, mi.UInt32(max_depth)))
    return seen.reshape(view.height, view.width)


@dr.syntax
def _sees_emitter(view, sampler, pixel, max_depth):
    """Trace a ray of each pixel through clear surfaces, and return whether it reaches an
    emitter.
    """
    scene = view.scene
    ray, _ = camera_rays(view, sampler, None, pixel, None)
    # fmt: off
    depth = mi.UInt32(0)      # Number of surfaces passed
    seen = mi.Bool(False)     # Rays that reached an emitter
    active = max_depth > 0    # Rays that continue
    # fmt: on
    while active:
        si = scene.ray_intersect(ray, active)
        seen |= active & (si.emitter(scene) != None)  # noqa: E711 (compares arrays)
        active &= ~seen & si.is_valid() & (depth + 1 < max_depth)
        lobe, direction = sampler.next_1d(), sampler.next_2d()
        sample, _ = si.bsdf(ray).sample(mi.BSDFContext(), si, lobe, direction, active)
        active &= passes_clearly(sample)
        ray = si.spawn_ray(si.to_world(sample.wo))
        depth += 1
    return seen
