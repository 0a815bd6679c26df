"""What is asked of the weights themselves, beside the picture: to stay, or to keep their colour.

Both are quadratics in w, measured by the pictures of the lights over the whole picture: in units
of w they ask the same of every light. Pixels in which an emitter is seen do not count.
"""

import numpy as np

from lightpaint.arrays import Bools
from lightpaint.basis.basis import Basis
from lightpaint.colour.color import LUMINANCE, luminance
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.normal_equations import NormalEquations

#: Strength of the pull to the present colours: of what a light would do to the picture by changing
#: its hue, this much is missed, in proportion to what is painted.
GENTLE = 0.5


def pull_of(
    basis: Basis, fit: Fit, prefer_current: float, painted_share: float, keeps_color: Bools
) -> NormalEquations | None:
    """All that pulls at the weights; None where nothing does.

    prefer_current: as of `Constraints`. painted_share: importance of all that is painted, beside
    the number of pixels, to which the pull to the present colours is in proportion. keeps_color:
    (n,), the lights that it is for.
    """
    gentle = GENTLE * fit.brightness * painted_share if fit.colors == "gentle" else 0.0
    added = [to_present(basis, prefer_current * fit.brightness)] if prefer_current else []
    if gentle:
        added.append(to_colors(basis, gentle, keeps_color))
    return None if not added else added[0] if len(added) == 1 else added[0] + added[1]


def to_present(basis: Basis, strength: float) -> NormalEquations:
    """strength · Σᵢ ‖Φᵢ‖² (wᵢ − presentᵢ)².

    The scale is absolute: it does not depend on what is painted.
    """
    power, present = strength * basis.power, basis.present_weights
    M = np.einsum("ic,ij->cij", power, np.eye(len(power)))
    return NormalEquations(M, (power * present).T, (power * present**2).sum(axis=0))


def to_colors(basis: Basis, strength: float, lights: Bools) -> NormalEquations:
    """strength · Σᵢ ‖Φᵢ (wᵢ − Y(wᵢ) cᵢ)‖² of `lights`, (n,): what leaves the present colour.

    cᵢ is the present emission at luminance 1, white for a light that is off. It costs nothing to
    dim, and in each channel what a change of hue does there.
    """
    n = len(basis.names)
    M, across = np.zeros((3, n, n)), np.zeros((n, 3, 3))
    for k in np.flatnonzero(lights):
        present = basis.present_weights[k]
        now = float(luminance(present))
        color = present / now if now > 0 else np.ones(3)
        hue = np.eye(3) - np.outer(color, LUMINANCE)
        across[k] = hue.T @ (strength * basis.power[k, :, None] * hue)
        M[:, k, k] = np.diag(across[k])
        np.fill_diagonal(across[k], 0)
    return NormalEquations(M, np.zeros((3, n)), np.zeros(3), across)
