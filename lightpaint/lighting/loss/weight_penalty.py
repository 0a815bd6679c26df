"""What is asked of the weights themselves, beside the picture: to stay, or to keep their colour.

Both are quadratics in w, measured by the pictures of the lights over the whole picture: in units
of w they ask the same of every light. Pixels in which an emitter is seen do not count.
"""

import numpy as np

from lightpaint.arrays import Bools, Doubles
from lightpaint.colour.color import LUMINANCE, luminance
from lightpaint.lighting.fit import Fit
from lightpaint.lighting.normal_equations import NormalEquations

#: Strength of the pull to the present colours: of what a light would do to the picture by changing
#: its hue, this much is missed, in proportion to what is painted.
GENTLE = 0.5

#: Times by which a light may be dimmer than at present and have a stronger pull to its colour.
DIMMEST = 100.0


def pull_of(
    power: Doubles,
    present: Doubles,
    fit: Fit,
    *,
    prefer_current: float,
    painted_share: float,
    keeps_color: Bools,
    dimming: Doubles | None = None,
) -> NormalEquations | None:
    """All that pulls at the weights; None where nothing does.

    power, present: (n, 3), ‖Φᵢ‖² of the lights' pictures, and their weights now. prefer_current: as
    of `Constraints`. painted_share: importance of all that is painted, beside the number of pixels,
    to which the pull to the present colours is in proportion. keeps_color: (n,), the lights that it
    is for. dimming: (n,), as of `dimming_of`; None where no light is known to be dim.
    """
    gentle = GENTLE * fit.brightness * painted_share if fit.colors == "gentle" else 0.0
    added = [to_present(prefer_current * fit.brightness * power, present)] if prefer_current else []
    if gentle:
        dim = 1.0 if dimming is None else dimming[:, None]
        added.append(to_colors(gentle * dim * power, present, keeps_color))
    return None if not added else added[0] if len(added) == 1 else added[0] + added[1]


def dimming_of(present: Doubles, weights: Doubles) -> Doubles:
    """(n,), by how many times weights (n, 3) are dimmer than the present; 1 where they are not.

    The pull to a light's colour is in light squared, and would vanish as the light does: by so much
    stronger it is in proportion to the light itself.
    """
    now, then = (np.asarray(luminance(x), np.float64) for x in (present, weights))
    least = np.where(now > 0, now / DIMMEST, 1)
    return np.clip(now / np.maximum(then, least), 1, DIMMEST)


def to_present(power: Doubles, present: Doubles) -> NormalEquations:
    """Σᵢ powerᵢ (wᵢ − presentᵢ)²; both (n, 3), power s ‖Φᵢ‖² for a pull of strength s.

    The scale is absolute: it does not depend on what is painted.
    """
    M = np.einsum("ic,ij->cij", power, np.eye(len(power)))
    return NormalEquations(M, (power * present).T, (power * present**2).sum(axis=0))


def to_colors(power: Doubles, present: Doubles, lights: Bools) -> NormalEquations:
    """s Σᵢ ‖Φᵢ (wᵢ − Y(wᵢ) cᵢ)‖² of `lights`, (n,): what leaves the present colour.

    power: (n, 3), s ‖Φᵢ‖². cᵢ is the present emission at luminance 1, white for a light that is
    off. It costs nothing to dim, and in each channel what a change of hue does there.
    """
    n = len(power)
    M, across = np.zeros((3, n, n)), np.zeros((n, 3, 3))
    for k in np.flatnonzero(lights):
        now = float(luminance(present[k]))
        color = present[k] / now if now > 0 else np.ones(3)
        hue = np.eye(3) - np.outer(color, LUMINANCE)
        across[k] = hue.T @ (power[k, :, None] * hue)
        M[:, k, k] = np.diag(across[k])
        np.fill_diagonal(across[k], 0)
    return NormalEquations(M, np.zeros((3, n)), np.zeros(3), across)


def drawn_more(pull: NormalEquations, dimming: Doubles) -> NormalEquations:
    """The pull of `to_colors`, of each light so many times as strong. dimming: (n,)."""
    across = None if pull.across is None else dimming[:, None, None] * pull.across
    return NormalEquations(dimming[:, None] * pull.M, pull.b, pull.target_norm2, across)
