"""The origin of a rendered basis: how its scene is rendered, and with how many samples."""

from dataclasses import replace

from lightpaint.basis.basis import Basis
from lightpaint.basis.lights import BasisLight, Lights
from lightpaint.basis.origin import Origin
from lightpaint.basis.render.integrators import why_not_one_pass
from lightpaint.basis.render.render_budget import half_of
from lightpaint.basis.render.separate_renders import (
    plan_of_light,
)
from lightpaint.scene.scene import Scene

ONE_PASS = "one pass, several questions"

SEPARATE = "separate renders"

#: Passes of a one-pass basis, whose samples do not depend on them: whether it has all that were
#: asked for, or an interrupt ended it.
FINISHED, UNFINISHED = (1, 1), (0, 0)


def is_of(scene: Scene, basis: Basis, seed: int) -> bool:
    """Return whether `basis` was rendered from this `scene`, with its sensor, film and `seed`."""
    of = basis.origin
    current = replace(
        origin_of(scene, seed, of.method, of.halves, of.passes),
        each_light=of.each_light,
        is_composed=of.is_composed,
        extra_spp=of.extra_spp,
    )
    return of == current and basis.size == scene.size


def is_on_the_way(scene: Scene, basis: Basis, spp: int | None) -> bool:
    """Return True if a render from nothing to `spp` samples comes by just those of `basis`.

    With fewer samples it needs its exact sums: without, it was rounded. And those of separate
    renders must not end elsewhere than passes do. spp: the scene's own number if None.
    """
    origin = basis.origin
    if origin.is_composed or origin.extra_spp or origin.method != method_of(scene):
        return False
    goal = samples_for(scene, spp)
    if origin.spp < goal and basis.sums is None:
        return False
    if origin.method == ONE_PASS:
        return origin.spp <= goal
    plan = plan_of_light(scene, scene.spp if spp is None else spp)
    sizes = [[size for half, size in plan if half == h] for h in range(2)]
    return all(
        count <= len(half_sizes) and sum(half_sizes[:count]) == done
        for a, b, first, second in origin.each_light or ((*origin.halves, *origin.passes),)
        for half_sizes, done, count in zip(sizes, (a, b), (first, second), strict=True)
    )


def samples_for(scene: Scene, spp: int | None) -> int:
    """Return the samples per pixel that a basis gets if `spp` are requested.

    One more where that makes the halves equal, and some where a pixel is a block of pixels that
    ordinary renders take one sample of each in.
    """
    spp = scene.spp if spp is None else spp
    if method_of(scene) == ONE_PASS:
        return 2 * half_of(spp)
    return sum(size for _, size in plan_of_light(scene, spp))


def method_of(scene: Scene) -> str:
    """Return how a basis of `scene` is rendered: `ONE_PASS` or `SEPARATE`."""
    return ONE_PASS if why_not_one_pass(scene) is None else SEPARATE


def origin_of(
    scene: Scene, seed: int, method: str, halves: tuple[int, int], passes: tuple[int, int]
) -> Origin:
    """Return the origin of a basis of `scene`."""
    return Origin(
        scene=scene.path.name,
        scene_identity=scene.identity,
        sensor=scene.sensor_names[scene.sensor],
        seed=seed,
        method=method,
        halves=halves,
        passes=passes,
        integrator="" if scene.instead is None else str(scene.instead),
    )


def basis_lights(scene: Scene) -> Lights:
    """Return the lights of `scene` for a basis, with the constraints of its lights file."""
    lights = tuple(
        BasisLight(
            x.name,
            x.plugin,
            x.parameter,
            x.unit,
            x.emission,
            x.form,
            x.is_scalar,
            x.is_fixed,
            x.member_names,
            x.unit_flux,
            identity,
        )
        for x, identity in zip(scene.lights, scene.light_identities, strict=True)
    )
    return Lights(lights, scene.requests)
