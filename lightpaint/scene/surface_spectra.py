"""The share of light that visible objects reflect at each wavelength."""

from typing import Any

import numpy as np

from lightpaint.arrays import Doubles, Indices, aligned
from lightpaint.colour import WAVELENGTHS
from lightpaint.images import Objects
from lightpaint.scene.runtime.render_lock import tracing
from lightpaint.scene.scene import Scene

#: Most pixels that are looked at. Wavelengths that Mitsuba asks for at once.
MAX_PIXELS, PACKET = 2**14, 4

#: Most objects, of which the largest in the picture count.
MAX_OBJECTS = 64


def render_reflectances(scene: Scene, objects: Objects) -> dict[int, Doubles]:
    """Return the reflectance (81,) of visible objects by their index, the largest ones.

    scene: for renders with spectra. objects: of its film. Only what materials reflect diffusely
    counts, at the first surfaces that the camera sees. Wavelengths are WAVELENGTHS.
    """
    seen = np.flatnonzero(objects.index >= 0)
    chosen = seen[:: max(1, len(seen) // MAX_PIXELS)]
    if not len(chosen):
        return {}
    values = scene.while_loaded(lambda loaded: _reflectances(scene, loaded, chosen, objects.size))
    index = objects.index.ravel()[chosen]
    largest = np.argsort(-np.bincount(index), kind="stable")[:MAX_OBJECTS].tolist()
    return {
        k: np.clip(values[index == k].mean(axis=0), 0, 1) for k in largest if (index == k).any()
    }


def _reflectances(scene: Scene, loaded: Any, pixels: Indices, size: tuple[int, int]) -> Doubles:
    """Return the reflectance (p, 81) at the middle of some pixels of a film of this size."""
    import drjit as dr
    import mitsuba as mi

    height, width = size
    x, y = (pixels % width + 0.5) / width, (pixels // width + 0.5) / height
    position = mi.Point2f(*(mi.Float(aligned(v, np.float32)) for v in (x, y)))
    camera = scene.camera(loaded)
    with tracing():
        ray, _ = camera.sample_ray(camera.shutter_open(), 0.5, position, mi.Point2f(0.5))
        si = loaded.ray_intersect(mi.Ray3f(ray))
        bsdf, packets = si.bsdf(), []
        for first in range(0, len(WAVELENGTHS), PACKET):
            waves = np.resize(WAVELENGTHS[first : first + PACKET], PACKET).astype(float).tolist()
            si.wavelengths = mi.Spectrum(*waves)
            value = bsdf.eval_diffuse_reflectance(si, si.is_valid())
            packets.append(np.array(value + dr.zeros(mi.Spectrum, len(pixels)), np.float64).T)
    return np.concatenate(packets, axis=1)[:, : len(WAVELENGTHS)]
