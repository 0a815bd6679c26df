"""The drives of lamps that mix more emitters than there are channels, of a wanted emission.

What drives between bounds can mix is a zonotope: a solid whose faces are parallelograms, each of
two emitters that turn while the others are at a bound. An emission within it is mixed by many
drives; the answer here has all of them between their bounds. One outside has a nearest emission, on
one of the faces towards it.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices

#: Relative change of emitters by which no three of them lie in one plane, and hence the size of a
#: parallelogram's neighbours that overlap it.
GENERIC = 1e-10

#: Determinant, relative to the largest entry, of colours too alike to tell three channels by.
SINGULAR = 1e-12

#: Squared sine of the angle between two edges that count as parallel.
FLAT = 1e-16

#: Corrections of drives on the way to a face; distance from a bound that is round-off.
CORRECTIONS, BOUND_ROUND_OFF = 2, 1e-13

#: Emitters of a lamp beyond which its parallelograms are too many.
MAX_EMITTERS = 12


@dataclass(frozen=True)
class EmissionMixes:
    """K lamps of u emitters each, and the p parallelograms on one side of what each can mix.

    columns: (k, u, 3), the emission of each emitter at 1. lower, upper: (k, u), bounds of drives;
    middle, half: their centre, and half the distance between them. pairs: (p, 2), the emitters of a
    parallelogram. normals: (k, p, 3). heights: (k, p), the distance of each from the middle, along
    its normal. signs: (k, p, u), the bounds at which the others are: 1 at the upper, 0 for its own
    two. centers: (k, p, 3), from the middle.
    """

    columns: Doubles
    lower: Doubles
    upper: Doubles
    middle: Doubles
    half: Doubles
    pairs: Indices
    normals: Doubles
    heights: Doubles
    signs: Doubles
    centers: Doubles

    @classmethod
    def of(cls, columns: Doubles, lower: Doubles, upper: Doubles) -> "EmissionMixes":
        """Make them of the emitters (k, u, 3) and their bounds (k, u)."""
        middle, half = (lower + upper) / 2, (upper - lower) / 2
        edges = half[:, :, None] * columns
        size = np.abs(edges).max(axis=(1, 2), keepdims=True)
        noise = np.random.default_rng(0).uniform(-1, 1, edges.shape[1:])
        generic = edges + GENERIC * np.where(size > 0, size, 1) * noise
        pairs = np.array([*combinations(range(edges.shape[1]), 2)], np.intp)
        normals = np.cross(generic[:, pairs[:, 0]], generic[:, pairs[:, 1]])
        normals /= np.sqrt(np.square(normals).sum(axis=2, keepdims=True))
        along = np.matmul(normals, generic.swapaxes(1, 2))
        signs = np.sign(along)
        rows = np.arange(len(pairs))[:, None]
        signs[:, rows, pairs] = 0
        heights = np.abs(signs * along).sum(axis=2)
        centers = np.matmul(signs, edges)
        return cls(columns, lower, upper, middle, half, pairs, normals, heights, signs, centers)

    def nearest(self, k: Indices, emission: Doubles, metric: Doubles) -> Doubles:
        """Return the drives (m, u) of lamps k, (m,), that mix these emissions, (m, 3), or those
        nearest to them.

        metric: (m, 3), the weight of a squared difference in each channel.
        """
        middle = np.matmul(self.middle[k][:, None], self.columns[k])[:, 0]
        from_middle = emission - middle
        along = np.matmul(self.normals[k], from_middle[:, :, None])[..., 0]
        share, side = np.abs(along) / self.heights[k], np.sign(along)
        face = share.argmax(axis=1)
        out = share[np.arange(k.size), face]
        turns = np.empty((k.size, self.half.shape[1]))
        inside, outside = np.flatnonzero(out <= 1), np.flatnonzero(~(out <= 1))
        if inside.size:
            i, side_in = k[inside], side[inside, face[inside]]
            turns[inside] = self._turns_inside(
                i, from_middle[inside], face[inside], side_in, out[inside]
            )
        if outside.size:
            i, is_towards = k[outside], share[outside] > 1
            turns[outside] = self._turns_on_faces(
                i, from_middle[outside], side[outside], is_towards, metric[outside]
            )
        low, high = self.lower[k], self.upper[k]
        drives = np.clip(self.middle[k] + turns * self.half[k], low, high)
        # At a bound a drive equals it to the last bit.
        return np.asarray(np.where(turns >= 1, high, np.where(turns <= -1, low, drives)))

    def _turns_inside(
        self, k: Indices, from_middle: Doubles, face: Indices, side: Doubles, out: Doubles
    ) -> Doubles:
        """Return the drives (m, u) of lamps k, from -1 to 1, on the way from the middle to a
        face.

        from_middle: (m, 3). face, side: (m,), the parallelogram. out: (m,), how far they are on
        that way, from 0 to 1.
        """
        rows = np.arange(k.size)
        edges = self.half[k, :, None] * self.columns[k]
        turns = side[:, None] * self.signs[k, face]
        # Where this way meets the face, less the emitters that are at a bound there.
        end = from_middle / np.where(out > 0, out, 1)[:, None]
        rest = end - np.matmul(turns[:, None], edges)[:, 0]
        own = self.pairs[face]
        turns[rows[:, None], own] = _in_plane(edges[rows, own[:, 0]], edges[rows, own[:, 1]], rest)
        turns *= out[:, None]
        turns = np.clip(turns, -1, 1)
        for _ in range(CORRECTIONS):
            # What is left is due to the width by which planes were turned.
            rest = from_middle - np.matmul(turns[:, None], edges)[:, 0]
            free = edges * (np.abs(turns) < 1)[:, :, None]
            across = np.matmul(free.swapaxes(1, 2), free)
            turns += np.matmul(free, _solve_or_zero(across, rest)[:, :, None])[..., 0]
            turns = np.clip(turns, -1, 1)
        is_at_bound = np.abs(turns) > 1 - BOUND_ROUND_OFF
        return np.asarray(np.where(is_at_bound, np.sign(turns), turns))

    def _turns_on_faces(
        self,
        k: Indices,
        from_middle: Doubles,
        side: Doubles,
        is_towards: Bools,
        metric: Doubles,
    ) -> Doubles:
        """Return the drives (m, u) of lamps k, from -1 to 1, at the nearest point of their faces.

        from_middle, metric: (m, 3). side: (m, p). is_towards: (m, p), the parallelograms whose
        plane lies between.
        """
        root = np.sqrt(metric)[:, None]
        edges = self.half[k, :, None] * self.columns[k] * root
        rest = (from_middle[:, None] - side[:, :, None] * self.centers[k]) * root
        a, b = edges[:, self.pairs[:, 0]], edges[:, self.pairs[:, 1]]
        own = _in_parallelogram(a, b, rest)
        gaps = rest - own[..., :1] * a - own[..., 1:] * b
        distances = np.where(is_towards, np.square(gaps).sum(axis=2), np.inf)
        rows, face = np.arange(k.size), distances.argmin(axis=1)
        turns = side[rows, face][:, None] * self.signs[k, face]
        turns[rows[:, None], self.pairs[face]] = own[rows, face]
        return np.asarray(turns)


def _solve_or_zero(matrices: Doubles, right: Doubles) -> Doubles:
    """Return the solutions (k, 3) of systems (k, 3, 3); 0 where one is singular."""
    size = np.abs(matrices).max(axis=(1, 2)) ** 3
    regular = np.abs(np.linalg.det(matrices)) > SINGULAR * size
    solved = np.zeros(right.shape)
    solved[regular] = np.linalg.solve(matrices[regular], right[regular, :, None])[..., 0]
    return solved


def _in_plane(a: Doubles, b: Doubles, rest: Doubles) -> Doubles:
    """Return the turns (..., 2) of edges a and b that come closest to `rest`; all (..., 3)."""
    aa, ab, bb = ((x * y).sum(axis=-1) for x, y in ((a, a), (a, b), (b, b)))
    ar, br = (a * rest).sum(axis=-1), (b * rest).sum(axis=-1)
    area, both = aa * bb - ab * ab, aa + bb
    is_flat = area <= FLAT * aa * bb
    # Parallel edges turn alike.
    first = np.where(is_flat, ar, bb * ar - ab * br)
    second = np.where(is_flat, br, aa * br - ab * ar)
    scale = np.where(is_flat, np.where(both > 0, both, 1), area)
    return np.stack([first, second], axis=-1) / scale[..., None]


def _in_parallelogram(a: Doubles, b: Doubles, rest: Doubles) -> Doubles:
    """Return the turns (..., 2), each from -1 to 1, of edges a and b nearest to `rest`; all (...,
    3).
    """
    aa, ab, bb = ((x * y).sum(axis=-1) for x, y in ((a, a), (a, b), (b, b)))
    ar, br = (a * rest).sum(axis=-1), (b * rest).sum(axis=-1)
    per_a, per_b = (1 / np.where(x > 0, x, np.inf) for x in (aa, bb))
    best = _in_plane(a, b, rest)
    is_within = (np.abs(best) <= 1).all(axis=-1)
    least = np.where(is_within, -np.inf, np.inf)
    for end in (-1.0, 1.0):
        ends = np.full(ar.shape, end)
        for x, y in (
            (ends, np.clip((br - end * ab) * per_b, -1, 1)),
            (np.clip((ar - end * ab) * per_a, -1, 1), ends),
        ):
            value = x * (aa * x + 2 * ab * y - 2 * ar) + y * (bb * y - 2 * br)
            is_less = value < least
            least = np.where(is_less, value, least)
            best = np.where(is_less[..., None], np.stack([x, y], axis=-1), best)
    return best
