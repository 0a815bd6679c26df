"""What a painting lets one expect of each light, before anything is solved.

A moonlit picture was painted blue wherever a lamp shines, so that each lamp is expected to become
blue. Of one in an unpainted corner, nothing else than its own colour is. This expectation is where
the pull to colours leads, and it says how strong that pull may be: a small change of colour is
within the error of paint, a large one was meant.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.derived_planes import block_means
from lightpaint.colour.color import luminance
from lightpaint.images.pixel_blocks import block_sums
from lightpaint.target.target import Target

#: Approximate number of blocks of pixels over which the light of a painting is compared.
BLOCKS = 2**13

#: Light below which a ratio says little, relative to the mean of the look.
DARK = 0.01

#: Change of colour, in stops between channels, from which paint means it, and how sharply:
#: benchmarks/intent.py paints hues that are off by 0.25, benchmarks/briefs.py moods of 1 to 3.
MEANT_STOPS, SHARPNESS = 0.6, 6


@dataclass(frozen=True)
class Wash:
    """A painting, the look under it and the light of each lamp, averaged over blocks of pixels.

    rows: (3, n, p), Φ. painted, look: (3, p), linear. importance: (p,), the share of a block that
    is painted. counts: (p,), the number of its pixels that count.
    """

    rows: Floats
    painted: Floats
    look: Floats
    importance: Doubles
    counts: Doubles

    @classmethod
    def of(cls, basis: Basis, target: Target) -> "Wash":
        """Average a view. target: at the size of the basis."""
        height, width = basis.size
        side = max(1, round((height * width / BLOCKS) ** 0.5))
        counted = (~basis.emitters_seen).astype(np.float64)
        weight = np.minimum(target.importance, 1) * counted
        counts, painted_counts = block_sums(counted, side), block_sums(weight, side)

        def mean(image: Floats, weight: Doubles, total: Doubles) -> Doubles:
            sums = block_sums(image * weight[..., None], side)
            return np.asarray(sums / np.where(total > 0, total, 1)[..., None]).reshape(-1, 3).T

        planes = block_means(basis.planes, counted, side).pixels(slice(None))
        return cls(
            np.ascontiguousarray(planes.transpose(2, 0, 1)),
            mean(target.image, weight, painted_counts),
            mean(basis.current_look, counted, counts),
            (painted_counts / np.where(counts > 0, counts, 1)).ravel(),
            counts.ravel(),
        )

    @classmethod
    def joined(cls, views: Sequence["Wash"]) -> "Wash":
        """Return the washes of several views behind each other."""
        if len(views) == 1:
            return views[0]
        names = "rows", "painted", "look", "importance", "counts"
        return cls(*(np.concatenate([getattr(x, k) for x in views], axis=-1) for k in names))

    def asked(self) -> Doubles:
        """Return the change that is asked for in each block, (3, p), in stops; 0 without paint."""
        weight = self.importance * self.counts
        dark = DARK * float(np.average(self.look.mean(axis=0), weights=self.counts + 1e-12))
        if not dark > 0:
            return np.zeros(self.look.shape)
        asked, now = (np.maximum(x, 0).astype(np.float64) + dark for x in (self.painted, self.look))
        return np.where(weight > 0, np.log2(asked / now), 0)


@dataclass(frozen=True)
class ExpectedLights:
    """The emission that a painting lets one expect, and how clearly it asks for other colours.

    emission: (n, 3). clarity: (n,), from 0, where a light is expected to keep its colour, to 1,
    where the painting decides.
    """

    emission: Doubles
    clarity: Doubles

    @classmethod
    def of(cls, wash: Wash, current: Doubles) -> "ExpectedLights":
        """Expect lights of a painting. current: (n, 3), their current emission.

        The change of light i in channel c is the mean change that is asked for, weighted by how
        much of the light in each pixel a unit of it makes: Σ D a Φᵢ / L / Σ Φᵢ / L, with the change
        a in stops and the look L. Its colour changes by the part of this that is clearly meant.
        """
        dark = DARK * float(np.mean(wash.look)) or 1.0
        stops = wash.asked()
        share = wash.counts / (np.maximum(wash.look, 0) + dark)
        asked_share = wash.importance * share
        spread = np.ptp(stops, axis=0)
        sums = np.stack([rows @ x for rows, x in zip(wash.rows, share, strict=True)], axis=-1)
        moved = np.stack(
            [rows @ x for rows, x in zip(wash.rows, asked_share * stops, strict=True)], axis=-1
        )
        squares = sum(rows @ x for rows, x in zip(wash.rows, asked_share * spread**2, strict=True))
        reached = sums.sum(axis=1)
        change = moved / np.where(sums > 0, sums, 1)
        amount = np.sqrt(np.maximum(squares / np.where(reached > 0, reached, 1), 0))
        excess = (amount / MEANT_STOPS) ** SHARPNESS
        clarity = np.asarray(excess / (1 + excess), np.float64)
        level = luminance(change)[:, None]
        return cls(
            np.asarray(current * 2.0 ** (level + clarity[:, None] * (change - level))), clarity
        )

    @classmethod
    def unchanged(cls, current: Doubles) -> "ExpectedLights":
        """Expect lights to stay as they are. current: (n, 3)."""
        return cls(current, np.zeros(len(current)))
