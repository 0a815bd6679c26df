"""Equations of many lights, from indirect light averaged along surfaces.

The more lights share the samples, the noisier each plane is, and the more of M is noise, whose bias
and variance then decide the answer. An average over 5 x 5 pixels (`SurfaceFilter`) removes most of
both and changes the sums little. It is linear and the same for both halves, so the noise left in M
is the sum of averaged half differences.

The weight of the average in a pixel follows from the noise of all lights together and from the
change beyond it: t = V / (V + B), as for pictures. So with more samples the sums converge to those
of the basis, and reflections or caustics are kept once they are clean.
"""

from collections.abc import Sequence
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.planes import Planes, as_planes
from lightpaint.images.estimate import box_mean
from lightpaint.images.surface_filter import SurfaceFilter
from lightpaint.lighting.joined_views import joint_basis
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.solution import Solution

#: Fewest lights for which sums use averaged light: with a dozen, the basis itself is as good.
MIN_LIGHTS = 64

#: Pixels on either side that light is averaged over.
FILTER_RADIUS = 2

#: Pixels on either side over which noise and change are compared.
WINDOW_RADIUS = 3

#: Maximum number of bytes of the averaged planes and of their noise.
MAX_BYTES = 2**29


def can_smooth(views: Sequence[Basis]) -> bool:
    """Return True for many lights whose indirect light and surfaces are known, in all views."""
    lights, pixels = len(views[0].lights), sum(basis.emitters_seen.size for basis in views)
    is_known = all(x.indirect is not None and x.surface_filter is not None for x in views)
    return lights >= MIN_LIGHTS and is_known and 2 * 12 * lights * pixels <= MAX_BYTES


def on_smooth_light(solution: Solution) -> Solution:
    """Return the solution with equations and noise of averaged planes, and the same weights."""
    basis, problem = solution.basis, solution.problem
    smooth, _ = joint_basis([_smooth(view) for view in problem.views.bases])
    # A goal that is the current look is averaged alike.
    moved = problem.squares.share * (smooth.current_look - basis.current_look)
    squares = replace(problem.squares, image=problem.squares.image + moved)
    equations = NormalEquations.of(smooth, squares.image, squares.weight)
    return replace(
        solution, problem=replace(problem, basis=smooth, squares=squares, equations=equations)
    )


def _smooth(basis: Basis) -> Basis:
    """Return the basis of a view with averaged planes."""
    if basis.planes not in _averaged:
        _averaged[basis.planes] = _average(basis)
    planes, noise = _averaged[basis.planes]
    return replace(basis, planes=planes, noise=noise, indirect=None)


#: Averaged planes and their noise, by the planes of a basis, as long as these are there.
_averaged: WeakKeyDictionary[Planes, tuple[Planes, Planes]] = WeakKeyDictionary()


def _average(basis: Basis) -> tuple[Planes, Planes]:
    """Return averaged planes and their half differences."""
    assert basis.features is not None
    assert basis.indirect is not None
    along = SurfaceFilter(basis.features, FILTER_RADIUS)
    # The arrays hold the change by the average first, and the averaged planes later.
    changed = [
        np.stack([along(x) - x for x in planes])
        for planes in (basis.indirect.planes, basis.indirect.noise)
    ]
    share = _share(basis.indirect.noise, *changed)
    for values, planes in zip(changed, (basis.planes, basis.noise), strict=True):
        for value, plane in zip(values, planes, strict=True):
            value *= share
            value += plane
    return as_planes(changed[0]), as_planes(changed[1])


def _share(noise: Planes, of_planes: Floats, of_noise: Floats) -> Floats:
    """Return how far each pixel is averaged, (h, w, 1).

    of_planes, of_noise: (n, h, w, 3), by how much the average changes either.
    """
    variance, remainder, change = np.zeros((3, *noise.size))
    for half, of_plane, of_half in zip(noise, of_planes, of_noise, strict=True):
        squares = np.square(half, dtype=np.float64).mean(axis=-1)
        # Each light counts alike, by its noise.
        unit = 1 / max(float(squares.mean()), np.finfo(np.float64).tiny)
        variance += unit * squares
        remainder += unit * np.square(of_half, dtype=np.float64).mean(axis=-1)
        change += unit * np.square(of_plane, dtype=np.float64).mean(axis=-1)
    V, B = (box_mean(x, WINDOW_RADIUS) for x in (variance, change - remainder))
    total = V + np.maximum(B, 0)
    share = np.divide(V, total, out=np.zeros_like(total), where=total > 0)
    return share[..., None].astype(np.float32)
