"""The surfaces that the camera sees first: albedo, normal, depth and object."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats, Indices, aligned
from lightpaint.colour import WAVELENGTHS
from lightpaint.images import BACKGROUND as NOTHING_SEEN
from lightpaint.images import Features, Objects, block_mean, block_pixels
from lightpaint.progress import Progress, silent
from lightpaint.scene.mitsuba_scene import Scene
from lightpaint.scene.runtime.render_lock import tracing
from lightpaint.scene.scene_render import Stream, largest_pass, pass_seed

#: Number of samples per pixel, each a separate render, since shape indices must not be averaged.
SAMPLES = 16

#: Number of samples that decide the object of a pixel.
VOTES = 4

#: Depth of the background, as in compositing programs.
BACKGROUND = 1e10

#: Most pixels that are looked at. Wavelengths that Mitsuba asks for at once.
MAX_PIXELS, PACKET = 2**14, 4

#: Most objects, of which the largest in the picture count.
MAX_OBJECTS = 64


@dataclass(frozen=True)
class Surfaces:
    """The first surfaces in each pixel, averaged over its area.

    albedo: (h, w, 3) float32 in [0, 1], share of light that the materials reflect diffusely.
    normal: (h, w, 3), shading normal in world space, of unit length; 0 for the background. depth:
    (h, w), distance from the camera along its axis in scene units, of the nearest sample;
    BACKGROUND if there is none. coverage: by shape name, (h, w) in [0, 1], share of the pixel
    covered by the shape. Invisible shapes are left out.
    """

    albedo: Floats
    normal: Floats
    depth: Floats
    coverage: Mapping[str, Floats]


def render_surfaces(scene: Scene, *, seed: int = 0, progress: Progress = silent) -> Surfaces:
    """Render the first surfaces of `scene`, without its light."""
    return scene.in_rgb.while_loaded(lambda loaded: _surfaces(scene, loaded, seed, progress))


def render_features(scene: Scene, *, seed: int = 0) -> Features:
    """Return albedo, normals and positions of `scene`; the first two are rounded to half floats."""
    return scene.in_rgb.while_loaded(lambda loaded: loaded_features(scene, loaded, seed))


def render_first_hits(
    scene: Scene, *, seed: int = 0, loaded: Any = None
) -> tuple[Features, Objects]:
    """Return features and the map of visible objects. loaded: the loaded `scene`, if available."""

    def render_both(loaded: Any) -> tuple[Features, Objects]:
        return loaded_features(scene, loaded, seed), _objects(scene, loaded, seed)

    return scene.in_rgb.while_loaded(render_both) if loaded is None else render_both(loaded)


def loaded_features(scene: Scene, loaded: Any, seed: int) -> Features:
    """Return the features of `scene`. loaded: the loaded scene. See `render_features`."""
    import mitsuba as mi

    film = scene.film
    integrator = mi.load_dict({"type": "aov", "aovs": "a:albedo,n:sh_normal,p:position"})
    pixels = scene.size[0] * scene.size[1] * film.block_pixels
    spp = min(max(SAMPLES // film.block_pixels, 1), largest_pass(pixels))
    seed = pass_seed(seed, Stream.SURFACES, SAMPLES)
    camera = scene.camera(loaded)
    with tracing():
        image = mi.render(loaded, sensor=camera, integrator=integrator, spp=spp, seed=seed)
    values = np.nan_to_num(np.array(image)[..., -9:], nan=0, posinf=1, neginf=0)
    values = block_mean(values, film.block)
    albedo, normal, position = (values[..., k : k + 3] for k in (0, 3, 6))
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    normal = normal / np.where(length > 0, length, 1)
    place = np.ascontiguousarray(position, np.float32)
    return Features(_in_half(np.clip(albedo, 0, 1)), _in_half(normal), place)


def _objects(scene: Scene, loaded: Any, seed: int) -> Objects:
    """Return the object that most of a few samples see in each pixel."""
    import mitsuba as mi

    integrator = mi.load_dict({"type": "aov", "aovs": "i:shape_index"})
    camera, block, samples = scene.camera(loaded), scene.film.block, []
    with tracing() as let_others_through:
        for k in range(-(-VOTES // scene.film.block_pixels)):
            seed_k = pass_seed(seed, Stream.SURFACES, SAMPLES + 1 + k)
            image = mi.render(loaded, sensor=camera, integrator=integrator, spp=1, seed=seed_k)
            samples.append(block_pixels(np.array(image)[..., -1], block))
            let_others_through()
    indices = _most_frequent(np.concatenate(samples).astype(np.int32))
    names = _names_by_index(loaded, scene.shape_names)
    values = sorted(set(np.unique(indices).tolist()) - {0})
    place = np.full(int(indices.max(initial=0)) + 1, NOTHING_SEEN, np.int32)
    place[values] = np.arange(len(values))
    return Objects(place[indices], tuple(names.get(k, "") for k in values))


def _most_frequent(votes: npt.NDArray[np.int32]) -> npt.NDArray[np.int32]:
    """Return the most frequent value in (k, h, w) as (h, w); in a tie, the first."""
    counts = [(votes == vote).sum(axis=0) for vote in votes[:VOTES]]
    winners = np.argmax(counts, axis=0)
    return np.asarray(np.take_along_axis(votes, winners[None], axis=0)[0])


def _in_half(image: Floats) -> Floats:
    return image.astype(np.float16).astype(np.float32)


def _surfaces(scene: Scene, loaded: Any, seed: int, progress: Progress) -> Surfaces:
    import mitsuba as mi

    camera, block, samples = scene.camera(loaded), scene.film.block, []
    count = -(-SAMPLES // scene.film.block_pixels)
    integrator = mi.load_dict(
        {"type": "aov", "aovs": "a:albedo,n:sh_normal,p:position,i:shape_index"}
    )
    with tracing() as let_others_through:
        for k in range(count):
            seed_k = pass_seed(seed, Stream.SURFACES, k)
            image = mi.render(loaded, sensor=camera, integrator=integrator, spp=1, seed=seed_k)
            samples.append(block_pixels(np.array(image), block))
            progress("surfaces", k + 1, count)
            let_others_through()
    to_world = np.array(camera.world_transform().matrix).reshape(4, 4)
    return _averaged(
        np.concatenate(samples), np.linalg.inv(to_world), _names_by_index(loaded, scene.shape_names)
    )


def _averaged(
    samples: npt.NDArray[np.float32], to_camera: Floats, names: Mapping[int, str]
) -> Surfaces:
    """Return surfaces averaged over samples.

    samples: (k, h, w, 10): albedo, normal, position, index of shape, 0 for the background.
    to_camera: (4, 4), world to camera, which looks along +z.
    """
    indices = samples[..., 9].astype(np.int64)
    is_hit = indices > 0
    # Some materials, such as metals, state an albedo above 1.
    albedo = np.clip(samples[..., :3], 0, 1) * is_hit[..., None]
    normal = (samples[..., 3:6] * is_hit[..., None]).sum(axis=0)
    length = np.linalg.norm(normal, axis=-1, keepdims=True)
    depths = samples[..., 6:9] @ to_camera[2, :3] + to_camera[2, 3]
    depth = np.where(is_hit, depths, BACKGROUND).min(axis=0)
    coverage: dict[str, Floats] = {}
    for index in np.unique(indices[is_hit]).tolist():
        name = names.get(index) or f"shape {index}"
        share = (indices == index).mean(axis=0, dtype=np.float32)
        coverage[name] = coverage.get(name, np.float32(0)) + share
    return Surfaces(
        albedo=albedo.mean(axis=0, dtype=np.float32),
        normal=(normal / np.where(length > 0, length, 1)).astype(np.float32),
        depth=depth.astype(np.float32),
        coverage=dict(sorted(coverage.items())),
    )


def _names_by_index(loaded: Any, names: Sequence[str]) -> dict[int, str]:
    """Return the name of each shape, by the index that the integrator writes.

    names: names of all shapes in their order, including unnamed ones.
    """
    import drjit as dr
    import mitsuba as mi

    shapes = loaded.shapes()
    names_or_ids = names_by_shape(loaded, names)
    if not dr.is_jit_v(mi.Float):
        return {k + 1: name for k, name in enumerate(names_or_ids)}
    indices = [int(dr.reinterpret_array(mi.UInt32, mi.ShapePtr(shape))[0]) for shape in shapes]
    return dict(zip(indices, names_or_ids, strict=True))


def names_by_shape(loaded: Any, names: Sequence[str]) -> list[str]:
    """Return the name of each shape of a loaded scene, "" for one without a name.

    names: names of all shapes in their order, including unnamed ones.
    """
    ids = [shape.id() for shape in loaded.shapes()]
    if len(names) != len(ids):
        return ids
    return [shape_id or name for shape_id, name in zip(ids, names, strict=True)]


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
