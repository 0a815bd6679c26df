"""Lights that a painting cannot tell apart, since their images differ by nothing that counts."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Bools, Doubles
from lightpaint.basis import texel_lights
from lightpaint.lighting.algebra.eigenvectors import eigenvectors
from lightpaint.lighting.algebra.quadratic import UNREACHED_POWER
from lightpaint.lighting.solution import Solution

#: Two images are alike if their normalised inner product is above 1 − ALIKE, and several are
#: ambiguous if a mix of them cancels to less than that share.
ALIKE = 1e-6

#: The largest `alike` that noise justifies.
MAX_ALIKE = 0.01

#: Smallest share of a light in a mix that cancels for it to be a part of the mix.
MIN_PART = 0.05


@dataclass(frozen=True)
class Ambiguity:
    """Lights that can share their light among themselves in many equally good ways.

    names: the lights. is_mix: whether a mix in some channel cancels; otherwise all are alike in all
    channels.
    """

    names: tuple[str, ...]
    is_mix: bool

    @property
    def sentence(self) -> str:
        """The meaning and the remedy, as a sentence."""
        lights = " and ".join([", ".join(self.names[:-1]), self.names[-1]])
        effect = (
            f"mixes of {lights} light the painted part alike"
            if self.is_mix
            else f"{lights} light the painted part alike"
        )
        return (
            f"{effect}: only their sum is determined. A wider mask or another view "
            "would tell them apart; or tie them, or keep one as it is"
        )


def ambiguities(solution: Solution) -> tuple[Ambiguity, ...]:
    """Return the lights that the painting cannot tell apart, as far as its noise allows to see.

    Noise makes the images of two lights at one place differ by its share of their power.
    """
    basis = solution.basis
    # Neighbouring texels are alike by nature, and the expectation of their image decides.
    free = np.flatnonzero(~basis.is_fixed & ~texel_lights(basis.lights))
    noise, power = (planes.squares()[free] for planes in (basis.noise, basis.planes))
    shares = noise[power > 0] / power[power > 0]
    alike = max(ALIKE, 2 * float(np.median(shares))) if shares.size else ALIKE
    # Strong noise would make different images look alike.
    M = solution.equations.M[:, free][:, :, free]
    return indistinguishable(M, [basis.names[k] for k in free], alike=min(alike, MAX_ALIKE))


def indistinguishable(
    M: Doubles, names: Sequence[str], *, alike: float = ALIKE
) -> tuple[Ambiguity, ...]:
    """Return groups of lights that M cannot tell apart, under its importance.

    M: (3, n, n), inner products per channel, or (n, n). Lights that reach nothing are left out.
    Pairs of one shape of light come first, as groups; then other mixes that cancel.
    """
    channels = M[None] if M.ndim == 2 else M
    # Each channel is scaled on its own: another colour is another weight, not another light.
    power = np.einsum("cii->ci", channels)
    lit = power > UNREACHED_POWER * power.max(initial=0)
    scale = np.where(lit, 1 / np.sqrt(np.where(lit, power, 1)), 0)
    cosines = channels * scale[:, :, None] * scale[:, None, :]

    groups = _alike_groups(cosines, lit, alike)
    alike_lights = (
        Ambiguity(tuple(names[i] for i in group), is_mix=False)
        for group in groups
        if len(group) > 1
    )
    # One light stands for each group. Other mixes may cancel; one channel suffices.
    heads = [group[0] for group in groups]
    mixes = (tuple(names[i] for i in mix) for mix in _cancelling_mixes(cosines, lit, heads, alike))
    return *alike_lights, *(Ambiguity(mixed, is_mix=True) for mixed in mixes)


def _alike_groups(cosines: Doubles, lit: Bools, alike: float) -> list[list[int]]:
    """Return the lights that reach something, in groups with images like that of the first."""
    # In the channel where two images differ most; images of other channels differ altogether.
    least = np.where(lit[:, :, None], cosines, np.inf).min(axis=0)
    is_alike = least > 1 - alike
    for channel in lit:
        is_alike &= channel[:, None] == channel
    groups: dict[int, list[int]] = {}
    for i in np.flatnonzero(lit.any(axis=0)).tolist():
        homes = np.fromiter(groups, np.intp, len(groups))
        alike_homes = homes[is_alike[homes, i]]
        groups.setdefault(int(alike_homes[0]) if alike_homes.size else i, []).append(i)
    return list(groups.values())


def _cancelling_mixes(
    cosines: Doubles, lit: Bools, heads: Sequence[int], alike: float
) -> list[tuple[int, ...]]:
    """Return the mixes of the lights `heads` that cancel in some channel, each once."""
    mixes: dict[tuple[int, ...], None] = {}
    for c in range(len(cosines)):
        lit_heads = np.array([head for head in heads if lit[c, head]], dtype=int)
        matrix = cosines[c][np.ix_(lit_heads, lit_heads)]
        if _is_above(matrix, alike):
            continue
        values, vectors = eigenvectors(matrix)
        for value, vector in zip(values, vectors.T, strict=True):
            if value <= alike:
                part = np.abs(vector) > MIN_PART * np.abs(vector).max()
                mixes[tuple(lit_heads[part].tolist())] = None
    return list(mixes)


def _is_above(matrix: Doubles, value: float) -> bool:
    """Return whether all eigenvalues are above a value, in a tenth of the time of computing
    them.
    """
    try:
        np.linalg.cholesky(matrix - value * np.eye(len(matrix)))
    except np.linalg.LinAlgError:
        return False
    return True
