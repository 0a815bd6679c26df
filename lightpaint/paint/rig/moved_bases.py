"""Bases in which some lights have moved: new planes for them, and the old ones for the others."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.derived_planes import PlaneReference, compose_planes
from lightpaint.basis.file.basis_file import is_large
from lightpaint.basis.lights import BasisLight
from lightpaint.basis.planes import IndirectLight, MemoryPlanes, Planes


def one_light_basis(basis: Basis, light: BasisLight, plane: Floats) -> Basis:
    """Return the basis of one light, whose plane (h, w, 3) has no noise."""
    quiet = MemoryPlanes(np.broadcast_to(np.float32(0), (1, *plane.shape)))
    lone = replace(
        basis.on_pixels(basis.planes, basis.noise, basis.emitters_seen),
        lights=(light,),  # type: ignore[arg-type]
        planes=MemoryPlanes(plane[None]),
        noise=quiet,
        origin=replace(basis.origin, each_light=(), extra_spp=0.0),
    )
    return lone


def with_planes_of(basis: Basis, moved: Mapping[int, Basis], *, in_memory: bool) -> Basis:
    """Return `basis` with the lights, planes and noise of bases of one light each, by number.

    Numbers beyond its lights belong to new lights. Unpainted parts are still held near the look of
    `basis`. in_memory: whether to copy planes, which saves time if all of them are read many times.
    """
    count = max(len(basis.lights), 1 + max(moved))
    in_memory = in_memory and not is_large(count, basis.size)

    def compose(planes: Planes, others: Mapping[int, Planes]) -> Planes:
        picks: list[PlaneReference] = [
            (others[k], 0) if k in others else (planes, k) for k in range(count)
        ]
        return compose_planes(picks, basis.size, in_memory=in_memory)

    indirect = None
    if basis.indirect is not None and all(x.indirect is not None for x in moved.values()):
        parts = {k: x.indirect for k, x in moved.items() if x.indirect is not None}
        indirect = IndirectLight(
            compose(basis.indirect.planes, {k: part.planes for k, part in parts.items()}),
            compose(basis.indirect.noise, {k: part.noise for k, part in parts.items()}),
        )
    lights = tuple(moved[k].lights[0] if k in moved else basis.lights[k] for k in range(count))
    moved_basis = replace(
        basis,
        lights=type(basis.lights)(lights, basis.requests),
        planes=compose(basis.planes, {k: x.planes for k, x in moved.items()}),
        noise=compose(basis.noise, {k: x.noise for k, x in moved.items()}),
        indirect=indirect,
        emitters_seen=np.any(
            [basis.emitters_seen, *(x.emitters_seen for x in moved.values())], axis=0
        ),
        former=basis.former or basis.predict(basis.current_weights),  # which it keeps
        guide_table=None,
        sums=None,
        origin=replace(basis.origin, is_composed=True),
    )
    # A pass over all planes gives the same as a pass over each.
    power, totals = np.zeros((2, count, 3))
    power[: len(basis.lights)], totals[: len(basis.lights)] = basis.power, basis.totals
    for k, one_light in moved.items():
        power[k], totals[k] = one_light.power[0], one_light.totals[0]
    moved_basis.set_power_and_totals(power, totals)
    return moved_basis
