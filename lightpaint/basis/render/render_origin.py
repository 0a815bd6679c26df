"""The origin of a rendered basis: its method and its number of samples."""

from dataclasses import replace

from lightpaint.basis.basis import Basis, Origin
from lightpaint.basis.lights import BasisLight, Lights
from lightpaint.basis.render.integrators import why_not_one_pass
from lightpaint.basis.render.render_budget import half_of
from lightpaint.basis.render.separate_renders import (
    plan_of_light,
)
from lightpaint.display_text import some_names
from lightpaint.errors import SceneError
from lightpaint.scene import Scene
from lightpaint.sentences import Hint

ONE_PASS = "one pass, several questions"

SEPARATE = "separate renders"

#: Values of `passes` for a one-pass basis, whose samples do not depend on passes: whether it has
#: all requested samples or was interrupted.
FINISHED, UNFINISHED = (1, 1), (0, 0)


def is_of(scene: Scene, basis: Basis, seed: int) -> bool:
    """Return True if `basis` was made from `scene` in its current state, with its sensor, film and
    `seed`.
    """
    start_origin = basis.origin
    current = replace(
        origin_of(scene, seed, start_origin.method, start_origin.halves, start_origin.passes),
        each_light=start_origin.each_light,
        is_composed=start_origin.is_composed,
        extra_spp=start_origin.extra_spp,
    )
    return start_origin == current and basis.size == scene.size


def is_on_the_way(scene: Scene, basis: Basis, spp: int | None) -> bool:
    """Return True if a new render to `spp` samples would pass through exactly the samples of
    `basis`.

    If it has fewer samples, its exact sums are needed, since planes are rounded. Separate renders
    must end at the boundary of a pass. spp: None for the scene's own number.
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
    """Return the samples per pixel of a basis for which `spp` were requested.

    The number is rounded up to make the halves equal. Separate renders of pixels that are blocks of
    film pixels round it up further, to one sample in each of these.
    """
    spp = scene.spp if spp is None else spp
    if method_of(scene) == ONE_PASS:
        return 2 * half_of(spp)
    return sum(size for _, size in plan_of_light(scene, spp))


def method_of(scene: Scene) -> str:
    """Return the method for rendering a basis of `scene`: `ONE_PASS` or `SEPARATE`.

    Raises SceneError for images in texels that one pass cannot render: Mitsuba does not sample a
    map in which only texels at a pole are lit. The same for points, which Mitsuba does not measure.
    """
    reason = why_not_one_pass(scene)
    if reason is not None and scene.points is not None:
        raise SceneError(
            f"{reason}, and light at points is only measured where one pass renders all lights: "
            "use ",
            Hint("integrator", "path"),
            " and a variant like llvm_ad_rgb",
        )
    if reason is not None and scene.split:
        raise SceneError(
            f"{reason}, so that each light is rendered by itself, and {some_names(scene.split)} "
            "cannot be split into texels: leave split out, or use ",
            Hint("integrator", "path"),
            " and a variant like llvm_ad_rgb",
        )
    return ONE_PASS if reason is None else SEPARATE


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
        integrator="" if scene.integrator_choice is None else str(scene.integrator_choice),
        observer=scene.observer.name if scene.is_spectral else "",
    )


def basis_lights(scene: Scene) -> Lights:
    """Return the lights of `scene` as basis lights, with the requests of its lights file."""
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
            min(x.emission) < 0,
            x.lamp,
        )
        for x, identity in zip(scene.lights, scene.light_identities, strict=True)
    )
    return Lights(lights, scene.requests)
