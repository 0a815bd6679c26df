"""The basis to solve with: an earlier one where it fits, with what it lacks rendered."""

from collections.abc import Callable
from dataclasses import replace

from lightpaint.basis import cache
from lightpaint.basis.basis import Basis
from lightpaint.basis.file import as_stored, is_large
from lightpaint.basis.render.render import basis_lights, is_of, is_on_the_way, render_basis
from lightpaint.errors import BasisError, SceneError
from lightpaint.images.pixel_blocks import whole_factor
from lightpaint.progress import Progress, silent
from lightpaint.scene.scene import Scene
from lightpaint.screen import some_names

#: `render_basis`, or another that takes and gives the same.
Render = Callable[..., Basis]


def obtain_basis(
    scene: Scene,
    *,
    spp: int | None = None,
    time_s: float | None = None,
    seed: int = 0,
    use_cache: bool = True,
    exact_spp: bool = False,
    progress: Progress = silent,
    render: Render = render_basis,
) -> Basis:
    """The basis of `scene`: what an earlier run kept, with the samples that are missing.

    time_s: instead of spp, seconds of rendering to add to what was kept.
    use_cache: False neither looks for one nor keeps it.
    exact_spp: whether it has just as many samples as are asked for, and the same ones, whatever
    was kept. One with more samples stays kept.
    render: who renders what is missing.

    Raises SceneError for exact_spp with a time, which asks for no number.
    """
    if exact_spp and time_s is not None:
        raise SceneError("exact_spp=True goes with a number of samples, not with time_s=...")
    if not use_cache:
        return as_stored(render(scene, spp=spp, time_s=time_s, seed=seed, progress=progress))
    kept = cache.find(scene.identity, scene.sensor_names[scene.sensor], seed, scene.size)
    if kept is not None and not is_of(scene, kept, seed):
        kept = None
    start = kept
    if (
        start is not None
        and exact_spp
        and not is_on_the_way(scene, start, spp, is_in_parts=render is not render_basis)
    ):
        start = None

    def keep(basis: Basis) -> bool:
        return (kept is None or basis.origin.spp >= kept.origin.spp) and cache.keep(basis)

    if start is not None:
        # One kept by an earlier version may know less of the same lights.
        start = replace(start, lights=basis_lights(scene), source=str(scene.path))
    basis = render(
        scene,
        spp=spp,
        time_s=time_s,
        seed=seed,
        start=start,
        keep=keep,
        progress=progress,
    )
    if basis is start:
        return basis
    if keep(basis) and is_large(len(basis.lights), basis.size):
        of_file = cache.find(scene.identity, basis.origin.sensor, seed, basis.size)
        if of_file is not None and of_file.origin == basis.origin:
            return replace(basis, planes=of_file.planes, noise=of_file.noise)
    # As from its file, so that the next run finds the same.
    return as_stored(basis)


def check_same_view(scene: Scene, basis: Basis) -> None:
    """Raise BasisError unless `basis` was made of `scene` as it is, through its sensor."""
    origin, sensor = basis.origin, scene.sensor_names[scene.sensor]
    mine = {light.name: light.member_names for light in scene.lights}
    its = {light.name: light.members for light in basis.lights}
    if mine != its:
        raise BasisError(
            f"the basis has the lights {some_names(its)}, and {scene.path} was loaded with "
            f"{some_names(mine)}: load it with the same lights and groups"
        )
    if (origin.scene_identity, origin.sensor) != (scene.identity, sensor):
        what = "another state of the scene" if origin.sensor == sensor else "another sensor"
        raise BasisError(
            f"the basis shows {what}: it was made of {origin.scene} through {origin.sensor}, not "
            f"of {scene.path} as it is through {sensor}; make it again"
        )
    if whole_factor(scene.size, basis.size) is None:
        raise BasisError(
            f"the basis is {basis.size[1]}x{basis.size[0]} but {scene.path} renders "
            f"{scene.size[1]}x{scene.size[0]}, of which no square blocks are as many: make it again"
        )
