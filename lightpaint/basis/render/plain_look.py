"""A picture of the scene as it is, by the scene's own integrator: what a painter shows first.

The first pass for all lights needs seconds, most of them to compile its kernels and to learn where
light comes from. An ordinary render of few pixels and samples needs a fraction of that.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from lightpaint.arrays import Bools, Floats
from lightpaint.basis.derived_planes import ScaledPlanes
from lightpaint.basis.light_basis import PLAIN_LOOK, Basis
from lightpaint.basis.render.rendered_basis import basis_lights, origin_of
from lightpaint.images import denoised, edge_padded, resampled
from lightpaint.scene import (
    Scene,
    Stream,
    loaded_features,
    pass_seed,
    reduction_to,
    render_pass,
)
from lightpaint.scene.runtime.variant import use_variant

#: Most pixels that are rendered, and the samples in each.
LOOK_PIXELS, LOOK_SPP = 2**16, 2


def render_plain_look(
    scene: Scene, *, seed: int = 0, between: Callable[[], None] = lambda: None
) -> Basis:
    """Return a basis of the current look of `scene` alone, denoised, whose lights are unknown.

    It has the size, lights and origin of the basis for which it stands in until that is rendered,
    and no samples. Its planes, which sum to the look, say nothing about single lights. between: is
    called between its kernels, and may raise.
    """
    factor = reduction_to(scene.film, LOOK_PIXELS)
    small = scene if factor == 1 else scene.reduced(f"1/{factor}")
    block_pixels = small.film.block_pixels  # each of which gets a sample
    spp = block_pixels * max(LOOK_SPP // block_pixels, 1)

    def render(loaded: Any) -> tuple[Floats, Bools]:
        seed_of_pass = pass_seed(seed, Stream.PLAIN_LOOK, 0)
        image = render_pass(loaded, small, seed=seed_of_pass, spp=spp)
        between()
        features = None if scene.is_spectral else loaded_features(small, loaded, seed)
        between()
        return denoised(image, features), _emitters_seen(small, loaded)

    look, seen = small.while_loaded(render)
    whole = look if factor == 1 else _enlarged(look, factor, scene.size)
    is_seen = _enlarged(seen[..., None].astype(np.float32), factor, scene.size)[..., 0] > 0
    lights = basis_lights(scene)
    planes = ScaledPlanes.summing_to(whole, lights.current_weights)
    return Basis(
        lights=lights,
        planes=planes,
        noise=ScaledPlanes(whole, np.zeros((len(lights), 3))),
        emitters_seen=is_seen,
        origin=origin_of(scene, seed, PLAIN_LOOK, (0, 0), (0, 0)),
        source=str(scene.path),
    )


def _emitters_seen(scene: Scene, loaded: Any) -> Bools:
    """Return the pixels of a loaded scene in whose middle the camera sees an emitter, (h, w)."""
    import drjit as dr
    import mitsuba as mi

    (height, width) = scene.size
    if scene.integrator.hide_emitters or not use_variant().is_jit:
        return np.zeros((height, width), dtype=bool)
    number = dr.arange(mi.UInt32, height * width)
    place = mi.Point2f((number % width + 0.5) / width, (number // width + 0.5) / height)
    rays, _ = scene.camera(loaded).sample_ray(0, 0.5, place, mi.Point2f(0.5))
    hits = loaded.ray_intersect(rays)
    return np.array(dr.max(hits.emitter(loaded).eval(hits)) > 0).reshape(height, width)


def _enlarged(picture: Floats, factor: int, size: tuple[int, int]) -> Floats:
    """Return a picture of blocks of factor × factor pixels at `size`, (h, w, n) float32."""
    height, width = picture.shape[:2]
    return edge_padded(resampled(picture, (height * factor, width * factor)), size)
