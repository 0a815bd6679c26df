"""Pixels that decide by themselves: what a half difference each cannot say of them.

A pixel that one rare path has met in each half of its samples looks as if it had no noise. So where
a few pixels could push a light most they are taken to be as noisy as so few can tell
(docs/method.md, "How sure").
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles

#: Part of what could push a light, from which on a single pixel is one of few that decide.
PEAK = 0.4

#: Variance of a pixel that one path in each half has met, beside the square of its mean: nothing
#: that both halves have seen is noisier than that.
TWO_PATHS = 0.5

#: By how much Student's t is wider than a normal distribution, where either leaves 5 % outside, of
#: 1, 2, … degrees of freedom.
WIDER = (6.483, 2.195, 1.624, 1.416, 1.312)

#: Times the variance of the others that a pixel among few may have.
UNLIKE = 4.0


@dataclass
class Peaks:
    """The pixels that could push one light most, while blocks of pixels go by; of one channel.

    total, pushed: (n,), sums of u² and z² so far; u is what a pixel would push if all of it were
    noise, z what the half difference says. found: lights, u² and z² of single pixels.
    """

    total: Doubles
    pushed: Doubles
    found: list[tuple[npt.NDArray[np.intp], Doubles, Doubles]] = field(default_factory=list)

    @classmethod
    def none(cls, n: int) -> "Peaks":
        """Before the first block."""
        return cls(np.zeros(n), np.zeros(n))

    def see(self, could: Doubles, push: Doubles) -> None:
        """Another block: u and z, (n, pixels) each."""
        u2 = np.square(could)
        self.total += u2.sum(axis=1)
        self.pushed += np.einsum("ip,ip->i", push, push)
        # In all there is more than up to here: who is small by now stays small.
        light, pixel = np.nonzero(u2 > PEAK * self.total[:, None])
        if light.size:
            self.found.append((light, u2[light, pixel], np.square(push[light, pixel])))

    @classmethod
    def together(cls, parts: Sequence["Peaks"]) -> "Peaks":
        """Of all blocks of several."""
        first = cls.none(parts[0].total.size)
        for part in parts:
            first.total += part.total
            first.pushed += part.pushed
            first.found += part.found
        return first

    def hidden(self) -> Doubles:
        """Variance that few pixels may have beyond what their half differences say, (n,).

        Of the pixels that hold PEAK of Σ u² or more: as noisy beside u as they say or the others
        are, times what Student's t is wider for so few, and at most TWO_PATHS.
        """
        made = np.zeros(self.total.size)
        if not self.found:
            return made
        lights, u2, z2 = (np.concatenate(x) for x in zip(*self.found, strict=True))
        its = u2 > PEAK * self.total[lights]
        for k in np.unique(lights[its]):
            mine = its & (lights == k)
            could, said = float(u2[mine].sum()), float(z2[mine].sum())
            rest = float(self.total[k]) - could
            others = float(self.pushed[k] - said) / rest if rest > 1e-9 * could else 0.0
            wider = _wider(could**2 / float(np.square(u2[mine]).sum()))
            variance = max(said / could * wider**2, UNLIKE * others)
            made[k] = max(min(variance, TWO_PATHS) * could - said, 0)
        return made


def _wider(pixels: float) -> float:
    """By how much an interval from so many half differences is wider than from very many."""
    return float(np.interp(pixels, range(1, len(WIDER) + 1), WIDER))
