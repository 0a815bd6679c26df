"""M and b in the unknowns that constraints leave."""

from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Doubles, Indices
from lightpaint.lighting.algebra.optimum import Cap
from lightpaint.lighting.constraints.reduction import Reduction, Unknown, channel_groups
from lightpaint.lighting.normal_equations import NormalEquations


@dataclass(frozen=True)
class ReducedProblem:
    """½ xᵀM x − bᵀx in the unknowns `its` of a reduction, of the channels it couples."""

    channels: list[int]
    its: list[int]
    M: Doubles
    b: Doubles
    lower: Doubles
    upper: Doubles
    caps: tuple[Cap, ...]


def problems(equations: NormalEquations, reduction: Reduction) -> list[ReducedProblem]:
    """One problem for every set of channels that the unknowns couple.

    With w = C x + w₀ it is M' = Σ_c C_cᵀ M_c C_c and b' = Σ_c C_cᵀ (b_c − M_c w₀_c).
    """
    made = []
    for channels in channel_groups(reduction):
        its = [k for k, x in enumerate(reduction.unknowns) if _touches(x, channels)]
        M, b = np.zeros((len(its), len(its))), np.zeros(len(its))
        for c in channels:
            here, lights, values, first = _entries(reduction, its, c)
            if not here.size:
                continue
            left = equations.b[c] - equations.M[c] @ reduction.held[:, c]
            whole = equations.M[c][np.ix_(lights, lights)] * values[:, None] * values
            # Most columns are of one light: the sum over those of several is a short one.
            M[np.ix_(here, here)] += np.add.reduceat(np.add.reduceat(whole, first, 0), first, 1)
            b[here] += np.add.reduceat(left[lights] * values, first)
        place = {i: k for k, i in enumerate(its)}
        caps = tuple(
            replace(cap, unknowns=tuple(place[i] for i in cap.unknowns))
            for cap in reduction.caps
            if cap.unknowns[0] in place
        )
        lower = np.array([reduction.unknowns[i].lower for i in its])
        upper = np.array([reduction.unknowns[i].upper for i in its])
        made.append(ReducedProblem(channels, its, M, b, lower, upper, caps))
    return made


def _entries(
    reduction: Reduction, its: list[int], c: int
) -> tuple[Indices, Indices, Doubles, Indices]:
    """What is not 0 in C_c, column by column.

    Returns the columns that there are, of each entry its light and value, and where among
    these each column begins.
    """
    entries = [
        (k, light, rgb[c])
        for k, i in enumerate(its)
        for light, rgb in reduction.unknowns[i].columns
        if rgb[c]
    ]
    columns, lights = (np.array([entry[j] for entry in entries], dtype=np.intp) for j in (0, 1))
    here, first = np.unique(columns, return_index=True)
    return here, lights, np.array([value for _, _, value in entries], dtype=np.float64), first


def _touches(unknown: Unknown, channels: list[int]) -> bool:
    return any(rgb[c] for _, rgb in unknown.columns for c in channels)
