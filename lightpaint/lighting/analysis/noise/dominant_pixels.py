"""Single pixels that decide a light, and whose half difference does not show their noise.

A pixel that one rare path has hit in each half of its samples looks as if it had no noise. So where
a few pixels dominate a light, their noise is estimated with the uncertainty of so few
(docs/method.md, "How sure").
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Indices

#: Share of the possible push on a light from which a single pixel is one of few that decide.
PEAK_SHARE = 0.4

#: Variance of a pixel that one path in each half has hit, relative to the square of its mean: the
#: largest variance of a pixel that both halves have hit.
TWO_PATHS = 0.5

#: Standard errors on either side of a 95 % interval.
NORMAL_95 = 1.96

#: Ratios of 95 % intervals of Student's t to the intervals of a normal distribution, for 1, 2, …
#: degrees of freedom.
T_RATIOS = (6.483, 2.195, 1.624, 1.416, 1.312)

#: Largest variance of a pixel among few, relative to the variance of the others.
MAX_UNLIKE = 4.0


#: A function from lights and pixels of a block, (m,) each, to the largest variances that these may
#: have, relative to the squares of their light, (m,).
MostNoise = Callable[[Indices, Indices], Doubles]


@dataclass
class Peaks:
    """The pixels that could push one light most, collected block by block; of one channel.

    total, pushed: (n,), sums of u² and z² so far; u is the push of a pixel if all of it were noise,
    z the push by its half difference. candidates: lights, u², z², v² and κ² of single pixels; v is
    the share of u by which the halves of the pixel differ, whatever the pixel beside shows, and κ²
    the largest variance that it may have, relative to u².
    """

    total: Doubles
    pushed: Doubles
    candidates: list[tuple[npt.NDArray[np.intp], Doubles, Doubles, Doubles, Doubles]] = field(
        default_factory=list
    )

    @classmethod
    def empty(cls, n: int) -> "Peaks":
        """Return the state before the first block."""
        return cls(np.zeros(n), np.zeros(n))

    def add(
        self,
        could: Doubles,
        push: Doubles,
        shown: Doubles,
        most: MostNoise,
        *,
        first: int = 0,
    ) -> None:
        """Add a block of some lights from `first` on: u, z and v, (lights, pixels) each."""
        lights = slice(first, first + len(could))
        self.total[lights] += np.vecdot(could, could)
        self.pushed[lights] += np.vecdot(push, push)
        u2 = np.square(could)
        # Totals only grow: a pixel that is small by now stays small.
        least = PEAK_SHARE * self.total[lights]
        some = np.flatnonzero(u2.max(axis=1, initial=0) > least)
        light, pixel = np.nonzero(u2[some] > least[some, None])
        if light.size:
            light = some[light]
            z2, v2 = (np.square(x[light, pixel]) for x in (push, shown))
            limit = most(light + first, pixel)
            self.candidates.append((light + first, u2[light, pixel], z2, v2, limit))

    def add_entries(
        self,
        lights: Indices,
        could: Doubles,
        push: Doubles,
        shown: Doubles,
        most: MostNoise,
        of_lights: Callable[[Doubles], Doubles],
    ) -> None:
        """Add a block by its lit pixels: their lights, u, z and v, (m,) each.

        of_lights: returns the sum of values, (m,), of each light, (n,).
        """
        u2, z2 = np.square(could), np.square(push)
        self.total += of_lights(u2)
        self.pushed += of_lights(z2)
        large = np.flatnonzero(u2 > PEAK_SHARE * self.total[lights])
        if large.size:
            squares = u2[large], z2[large], np.square(shown[large])
            self.candidates.append((lights[large], *squares, most(lights[large], large)))

    def merge(self, more: "Peaks") -> None:
        """Include the pixels that others collected."""
        self.total += more.total
        self.pushed += more.pushed
        self.candidates += more.candidates

    def hidden(self) -> Doubles:
        """Return the variance that few pixels may have beyond their half differences, (n,).

        For pixels with PEAK_SHARE of Σ u² or more: the variance relative to u², as they or the
        others show it, times the width of Student's t for so few, and at most κ².
        """
        hidden = np.zeros(self.total.size)
        if not self.candidates:
            return hidden
        lights, u2, z2, v2, limits = (np.concatenate(x) for x in zip(*self.candidates, strict=True))
        is_peak = u2 > PEAK_SHARE * self.total[lights]
        for k in np.unique(lights[is_peak]):
            own_peaks = is_peak & (lights == k)
            could, observed = float(u2[own_peaks].sum()), float(z2[own_peaks].sum())
            shares = u2[own_peaks] / could
            rest = float(self.total[k]) - could
            share_of_others = (
                float(self.pushed[k] - observed) / rest if rest > 1e-9 * could else 0.0
            )
            wider = t_ratios(1 / (shares @ shares))
            seen = max(observed, float(v2[own_peaks].sum()))
            variance = max(seen / could * float(wider) ** 2, MAX_UNLIKE * share_of_others)
            most = float(limits[own_peaks] @ u2[own_peaks])
            hidden[k] = max(min(variance * could, most) - observed, 0)
        return hidden


def most_noise(light: Doubles, is_radiance: Bools, samples: float) -> Doubles:
    """Return the largest variance of pixels, (m,), relative to the square of their light: TWO_PATHS
    of rare paths.

    With multiple importance sampling no sample brings more than the radiance of an emitter, 1
    (Veach 1997, 9.2). The mean c of `samples` numbers from 0 to 1 has the relative variance
    (1 - c) / (c samples) at most (Bhatia and Davis 2000), the variance of c samples paths. light:
    (m,), c. is_radiance: (m,), whether it is of an emitter of that radiance.
    """
    is_bounded = is_radiance & (light > 0) & (light <= 1)
    share = np.where(is_bounded, light, 1)
    return np.where(is_bounded, np.minimum((1 - share) / (share * samples), TWO_PATHS), TWO_PATHS)


def t_ratios(freedom: Doubles) -> Doubles:
    """Return ratios of 95 % intervals of Student's t to the intervals of a normal distribution.

    freedom: degrees of freedom, of any shape; NaN where nothing is uncertain. Below one it counts
    as one.
    """
    table = range(len(T_RATIOS), 0, -1)
    with np.errstate(divide="ignore"):
        of_table = np.interp(1 / freedom, [1 / k for k in table], np.log(T_RATIOS[::-1]))
    # The approximation of Wallace (1959), good to 0.3 % from five on.
    many = np.maximum(freedom, len(T_RATIOS))
    squares = np.square(NORMAL_95 * (8 * many + 3) / (8 * many + 1))
    of_many = np.sqrt(many * np.expm1(squares / many)) / NORMAL_95
    ratios = np.where(freedom < len(T_RATIOS), np.exp(of_table), of_many)
    return np.where(np.isnan(freedom), 1, ratios)
