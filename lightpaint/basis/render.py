"""Rendering the basis: all lights in one pass where that is possible, else one by one."""

import gc
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.basis.basis import Basis, BasisLight, Origin
from lightpaint.errors import SceneError
from lightpaint.images.exr import Floats
from lightpaint.progress import Progress, interruptible_between_pieces, silent
from lightpaint.scene.emitters import RGB
from lightpaint.scene.render import Stream, as_float32, pass_seed, plan_passes, render_loaded
from lightpaint.scene.scene import Scene
from lightpaint.scene.variant import use_variant

WHITE: RGB = (1.0, 1.0, 1.0)
BLACK: RGB = (0.0, 0.0, 0.0)

ONE_PASS = "one pass"
SEPARATE = "separate renders"


def why_not_one_pass(scene: Scene) -> str | None:
    """What keeps `scene` from the one-pass basis, in a few words; None if nothing does."""
    variant = use_variant()
    integrator = scene.integrator
    if not variant.is_jit:
        return f"the variant is {variant.variant}"
    if integrator.plugin not in ("path", "direct"):
        return f"the integrator is {integrator.plugin!r}"
    if scene.has_media:
        return "the scene has participating media"
    if integrator.hide_emitters:
        return "the integrator hides emitters"
    return None


def render_basis(
    scene: Scene,
    *,
    spp: int | None = None,
    seed: int = 0,
    progress: Progress = silent,
) -> Basis:
    """Render the image of each light of `scene` alone, at unit emission.

    spp: samples per pixel (the scene's own number by default), rounded up to whole passes.
    seed: any number >= 0; other seeds give independent bases.
    """
    height, width = scene.size
    spp = scene.spp if spp is None else spp
    if len(scene.lights) * height * width * 3 >= 2**32:
        raise SceneError(
            f"{len(scene.lights)} lights at {width}x{height} are more than one basis can hold: "
            "use a smaller film or fewer lights"
        )
    if why_not_one_pass(scene) is None:
        halves, seen, spp = _render_together(scene, spp, seed, progress)
        method = ONE_PASS
    else:
        halves, seen, spp = _render_separately(scene, spp, seed, progress)
        method = SEPARATE
    lights = tuple(
        BasisLight(
            x.name, x.plugin, x.kind.parameter, x.kind.unit, x.emission, x.form, x.kind.is_scalar
        )
        for x in scene.lights
    )
    origin = Origin(
        scene=scene.path.name,
        scene_identity=scene.identity,
        sensor=scene.sensor_names[scene.sensor],
        spp=spp,
        seed=seed,
        method=method,
    )
    images, half_differences = _mean_and_half_difference(halves)
    return Basis(lights, images, half_differences, seen, origin)


def _mean_and_half_difference(halves: list[Floats]) -> tuple[Floats, Floats]:
    a, b = halves
    images = (a + b) / 2
    # In place: these are the largest arrays there are.
    a -= b
    a /= 2
    return images, a


def _render_together(
    scene: Scene, spp: int, seed: int, progress: Progress
) -> tuple[list[Floats], npt.NDArray[np.bool_], int]:
    """One path-traced pass for all lights (see lightgroups.py)."""
    import drjit as dr
    import mitsuba as mi

    from lightpaint.basis.lightgroups import accumulate, lights_by_instance

    height, width = scene.size
    names = [light.name for light in scene.lights]
    passes = plan_passes(height * width, spp)
    loaded = scene.load(dict.fromkeys(names, WHITE))
    light_of = lights_by_instance(loaded, names)
    planes = [dr.zeros(mi.Float, len(names) * height * width * 3) for _ in range(2)]
    seen = dr.zeros(mi.Float, height * width)
    # One sequence of choices for each half, far from all others.
    sequences = [pass_seed(seed, Stream.CHOICE, half) for half in range(2)]
    traced = [0, 0]
    progress("basis", 0, len(passes))
    with interruptible_between_pieces() as let_interrupts_through:
        for k, pass_spp in enumerate(passes):
            traced[k % 2] += accumulate(
                loaded,
                scene.integrator,
                sensor=scene.sensor,
                light_of=light_of,
                planes=planes[k % 2],
                seen=seen,
                seed=pass_seed(seed, Stream.BASIS, k),
                spp=pass_spp,
                turn=(sequences[k % 2], traced[k % 2]),
            )
            dr.sync_thread()
            progress("basis", k + 1, len(passes))
            let_interrupts_through()
    del loaded, light_of
    gc.collect()
    halves = []
    for half_spp in traced:
        plane = np.array(planes.pop(0)).reshape(len(names), height, width, 3)
        plane /= half_spp
        halves.append(plane)
    return halves, np.array(seen).reshape(height, width) > 0, sum(traced)


def _render_separately(
    scene: Scene, spp: int, seed: int, progress: Progress
) -> tuple[list[Floats], npt.NDArray[np.bool_], int]:
    """One ordinary render per light: right for any integrator, n times the work."""
    names = [light.name for light in scene.lights]
    means, differences = [], []
    for name in names:
        emission = {other: WHITE if other == name else BLACK for other in names}
        loaded = scene.load(emission)
        estimate = render_loaded(
            loaded,
            scene,
            spp=spp,
            # Each light has samples of its own.
            seed=pass_seed(seed, Stream.BASIS, names.index(name)),
            stream=Stream.BASIS,
            label=f"basis: {name}",
            progress=progress,
        )
        del loaded
        gc.collect()
        means.append(estimate.image)
        differences.append(estimate.half_difference)
    height, width = scene.size
    traced = sum(plan_passes(height * width, spp))
    mean, difference = np.stack(means), np.stack(differences)
    return [mean + difference, mean - difference], _emitters_seen(scene), traced


def _emitters_seen(scene: Scene) -> npt.NDArray[np.bool_]:
    """Where light reaches the camera without a single bounce."""
    import mitsuba as mi

    if scene.integrator.hide_emitters:
        return np.zeros(scene.size, dtype=bool)
    loaded: Any = scene.load({light.name: WHITE for light in scene.lights})
    direct = mi.load_dict({"type": "path", "max_depth": 1})
    image = as_float32(
        np.array(mi.render(loaded, sensor=scene.sensor, integrator=direct, seed=0, spp=16))
    )
    del loaded
    gc.collect()
    return np.asarray(image.max(axis=-1) > 0)
