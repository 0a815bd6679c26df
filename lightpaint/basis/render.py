"""Rendering the basis: all lights in one pass where that is possible, else one by one."""

import gc
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.basis.basis import Basis, BasisLight, Origin
from lightpaint.errors import BasisError, SceneError
from lightpaint.progress import Interrupted, Progress, interruptible_between_pieces, silent
from lightpaint.scene.emitters import RGB
from lightpaint.scene.render import (
    SAMPLES_PER_PASS,
    Stream,
    as_float32,
    pass_seed,
    plan_passes,
    render_loaded,
)
from lightpaint.scene.scene import Scene
from lightpaint.scene.variant import use_variant

WHITE: RGB = (1.0, 1.0, 1.0)
BLACK: RGB = (0.0, 0.0, 0.0)

#: Seconds of work that a crash may cost.
KEEP_EVERY_S = 30.0

#: Emitters that surround the scene.
ENVIRONMENTS = ("constant", "envmap", "sunsky")

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
    if integrator.plugin == "direct" and integrator.samples != (1, 1):
        return "the direct integrator draws other than one sample of emitters and BSDF"
    if scene.has_null and not any(x.plugin in ENVIRONMENTS for x in scene.lights):
        return "rays may pass surfaces and leave, which Mitsuba counts as black"
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
    start: Basis | None = None,
    keep: Callable[[Basis], bool] | None = None,
    progress: Progress = silent,
) -> Basis:
    """Render the image of each light of `scene` alone, at unit emission.

    spp: samples per pixel (the scene's own number by default).
    seed: any number >= 0; other seeds give independent bases.
    start: an earlier basis of the same scene, sensor and seed: its samples count, and only
    what is missing to `spp` is rendered.
    keep: called with what there is, now and then and when Ctrl-C ends the work early;
    returns whether it could be kept.

    Raises SceneError for more lights and pixels than fit, Interrupted for Ctrl-C.
    """
    height, width = scene.size
    spp = scene.spp if spp is None else spp
    if len(scene.lights) * height * width * 3 >= 2**32:
        raise SceneError(
            f"{len(scene.lights)} lights at {width}x{height} are more than one basis can hold: "
            "use --resolution or fewer lights"
        )
    check_memory(scene)
    if start is not None and not is_of(scene, start, seed):
        raise BasisError("the basis to go on from was made of another scene, sensor, film or seed")
    if start is not None and start.origin.spp >= spp:
        return start
    if why_not_one_pass(scene) is None:
        goes_on = start is not None and start.origin.method == ONE_PASS
        return _render_together(scene, spp, seed, start if goes_on else None, keep, progress)
    return _render_separately(scene, spp, seed, progress)


def memory_needed(scene: Scene) -> int:
    """Bytes that a basis of `scene` takes at its peak, whatever the number of samples."""
    height, width = scene.size
    images = len(scene.lights) * height * width * 3 * 4
    # Sums of two halves, the images and half differences made of them, and a copy of both
    # where they are written to a file; passes are small beside that.
    return 6 * images + 512 * SAMPLES_PER_PASS


def check_memory(scene: Scene) -> None:
    """Raise SceneError if a basis of `scene` would not fit, instead of being killed for it."""
    needed, free = memory_needed(scene), _free_memory()
    if free is not None and needed > free:
        height, width = scene.size
        raise SceneError(
            f"{len(scene.lights)} lights at {width}x{height} need {needed / 1e9:.1f} GB, and "
            f"{free / 1e9:.1f} GB are free: use --resolution or fewer lights"
        )


def _free_memory() -> int | None:
    """Bytes that can be had without swapping, where the system tells (Linux)."""
    try:
        with open("/proc/meminfo", encoding="ascii") as lines:
            found = [line.split()[1] for line in lines if line.startswith("MemAvailable:")]
    except OSError:
        return None
    return int(found[0]) * 1024 if found else None


def is_of(scene: Scene, basis: Basis, seed: int) -> bool:
    """Whether `basis` was made of `scene` as it is, through its sensor and film, under `seed`."""
    method = basis.origin.method
    mine = _origin(scene, seed, method, basis.origin.halves, basis.origin.passes)
    return basis.origin == mine and basis.size == scene.size


def _origin(
    scene: Scene, seed: int, method: str, halves: tuple[int, int], passes: tuple[int, int]
) -> Origin:
    return Origin(
        scene=scene.path.name,
        scene_identity=scene.identity,
        sensor=scene.sensor_names[scene.sensor],
        seed=seed,
        method=method,
        halves=halves,
        passes=passes,
    )


def _basis_lights(scene: Scene) -> tuple[BasisLight, ...]:
    return tuple(
        BasisLight(
            x.name, x.plugin, x.kind.parameter, x.kind.unit, x.emission, x.form, x.kind.is_scalar
        )
        for x in scene.lights
    )


def _render_together(
    scene: Scene,
    spp: int,
    seed: int,
    start: Basis | None,
    keep: Callable[[Basis], bool] | None,
    progress: Progress,
) -> Basis:
    """All lights in one path-traced pass after another (see lightgroups.py)."""
    import drjit as dr

    from lightpaint.basis.lightgroups import HalfSums, accumulate, lights_by_instance

    height, width = scene.size
    names = [light.name for light in scene.lights]
    sums = HalfSums(len(names), scene.size) if start is None else HalfSums.of(start)
    plan = plan_passes(height * width, spp, done=(sums.spp[0], sums.spp[1]))

    def basis(*, is_last: bool = False) -> Basis:
        images, half_differences = sums.mean_and_half_difference(is_last=is_last)
        halves, passes = (sums.spp[0], sums.spp[1]), (sums.passes[0], sums.passes[1])
        origin = _origin(scene, seed, ONE_PASS, halves, passes)
        return Basis(_basis_lights(scene), images, half_differences, sums.emitters_seen(), origin)

    loaded = scene.load(dict.fromkeys(names, WHITE))
    light_of = lights_by_instance(loaded, names)
    # One sequence of choices for each half, far from all others.
    sequences = [pass_seed(seed, Stream.CHOICE, half) for half in range(2)]
    kept_s, keep_every_s = time.monotonic(), KEEP_EVERY_S
    progress("basis", 0, len(plan))
    try:
        with interruptible_between_pieces() as let_interrupts_through:
            for k, (half, pass_spp) in enumerate(plan):
                sums.spp[half] += accumulate(
                    loaded,
                    scene.integrator,
                    camera=scene.camera(loaded),
                    light_of=light_of,
                    planes=sums.planes[half],
                    seen=sums.seen,
                    seed=pass_seed(seed, Stream.BASIS, 2 * sums.passes[half] + half),
                    spp=pass_spp,
                    turn=(sequences[half], sums.spp[half]),
                )
                sums.passes[half] += 1
                dr.sync_thread()
                progress("basis", k + 1, len(plan))
                now_s = time.monotonic()
                if keep is not None and now_s - kept_s > keep_every_s and all(sums.spp):
                    keep(basis())
                    kept_s = time.monotonic()
                    # Where writing takes long, it must not become the work itself.
                    keep_every_s = max(KEEP_EVERY_S, 10 * (kept_s - now_s))
                let_interrupts_through()
    except KeyboardInterrupt:
        if keep is None or not all(sums.spp) or not keep(basis(is_last=True)):
            raise
        raise Interrupted(
            f"{sum(sums.spp)} of {spp} samples per pixel are kept; the same command goes on"
        ) from None
    finally:
        del loaded, light_of
        gc.collect()
    return basis(is_last=True)


def _render_separately(scene: Scene, spp: int, seed: int, progress: Progress) -> Basis:
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
    plan = plan_passes(height * width, spp)
    half = sum(size for _, size in plan) // 2
    origin = _origin(scene, seed, SEPARATE, (half, half), (len(plan) // 2, len(plan) // 2))
    images, half_differences = np.stack(means), np.stack(differences)
    return Basis(_basis_lights(scene), images, half_differences, _emitters_seen(scene), origin)


def _emitters_seen(scene: Scene) -> npt.NDArray[np.bool_]:
    """Where light reaches the camera without a single bounce."""
    import mitsuba as mi

    if scene.integrator.hide_emitters:
        return np.zeros(scene.size, dtype=bool)
    loaded: Any = scene.load({light.name: WHITE for light in scene.lights})
    direct = mi.load_dict({"type": "path", "max_depth": 1})
    image = as_float32(
        np.array(mi.render(loaded, sensor=scene.camera(loaded), integrator=direct, seed=0, spp=16))
    )
    del loaded
    gc.collect()
    return np.asarray(image.max(axis=-1) > 0)
