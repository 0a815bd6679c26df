"""The lamps whose pools a wish outlines.

A wish in numbers asks for one change all over its area, and lamps make pools: brightest in the
middle, weaker towards the outline, where the light of the other lamps takes over. Pixel by pixel,
lamps that all change a little are nearer to such a flat painting than the lamps that its outline
follows. So where some lamps, changed as a group against all others, outshine these just within the
area of a wish, the picture of the two groups is asked for, too. It is found so that the median
change within the wish and outside comes out as painted. A brush that paints the pools themselves
asks for no such picture, and outlines that are found in strokes follow pools in any case.
"""

from dataclasses import dataclass
from math import ceil

import numpy as np

from lightpaint.arrays import Bools, Doubles, Indices
from lightpaint.colour import ViewTransform, luminance
from lightpaint.lighting.loss.expected_lights import DARK, Wash
from lightpaint.lighting.loss.painting_loss import display_amplitude
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.threads import one_thread

#: Strength of the picture of the two groups, relative to the importance of all paint.
FOOTPRINT = 2.0

#: Agreement between the area of a wish and the area that a group of lamps outshines from and to
#: which these lamps are meant: the mean over both areas and what is outside of each of the shared
#: part of all that is in either.
AGREEMENT = 0.5, 0.7

#: Most lights among which a group is searched, and approximate numbers of blocks of pixels that
#: are compared in the search, and that the picture of the groups has.
MAX_LIGHTS, SEARCH_BLOCKS, PICTURE_BLOCKS = 64, 2**10, 2**11

#: Agreement that one more lamp in the group has to gain.
GAIN_PER_LAMP = 0.0025

#: Light, relative to the 95th percentile of the look, from which a block counts as lit.
LIT_SHARE = 0.02

#: Fewest sampled blocks within a wish and outside, and their least share of the lit ones.
LEAST_BLOCKS, LEAST_SHARE = 8, 0.03

#: Stops within which blocks ask for the same, and the shares of a zone that do so from and to which
#: its paint is flat.
FLAT_STOPS, FLAT = 0.2, (0.5, 0.7)

#: Most Newton steps for the changes of the groups, and misses of medians in stops that end them and
#: with which they are still an answer.
STEPS, CLOSE, NEAR = 10, 0.02, 0.1

#: Largest change of a group in stops, and least difference of the groups' shares of the light
#: within and outside of a wish that tells them apart.
MOST_STOPS, LEAST_DIFFERENCE = 5.0, 0.03


@dataclass(frozen=True)
class Footprint:
    """A group of lamps whose light ends where a wish ends.

    lamps: (n,), the group. emission: (n, 3), of all lights, those of each group changed alike.
    confidence: from 0 to 1, how well the outlines agree and how clearly the painting asks for one
    change within the wish and one outside.
    """

    lamps: Bools
    emission: Doubles
    confidence: float


@dataclass(frozen=True)
class _Zones:
    """Blocks within a wish and outside, (p,), and their painted changes in stops.

    light: (n, p), of each light now. look: (p,), of all, above black. within, outside: (p,), lit
    blocks. goals: the median changes within and outside.
    """

    light: Doubles
    look: Doubles
    within: Bools
    outside: Bools
    goals: tuple[float, float]

    def changes(self, group: Bools) -> tuple[float, float] | None:
        """Return the changes in stops of a group and of all other lights with which the medians
        within and outside come out as painted; None if there are none.
        """
        bright, other = self.light[group].sum(axis=0), self.light[~group].sum(axis=0)
        fixed = self.look - bright - other
        up, down = self.goals
        for _ in range(STEPS):
            lit = bright * 2**up
            total = np.maximum(lit + other * 2**down + fixed, 1e-12)
            change, share = np.log2(total / self.look), lit / total
            miss, miss_outside = (
                float(np.median(change[zone])) - goal
                for zone, goal in zip((self.within, self.outside), self.goals, strict=True)
            )
            if abs(miss) + abs(miss_outside) < CLOSE:
                return up, down
            inside, spill = (float(np.median(share[zone])) for zone in (self.within, self.outside))
            determinant = inside - spill
            if abs(determinant) < LEAST_DIFFERENCE:
                return None
            step = (1 - spill) * miss - (1 - inside) * miss_outside
            other_step = inside * miss_outside - spill * miss
            up -= float(np.clip(step / determinant, -1, 1))
            down -= float(np.clip(other_step / determinant, -1, 1))
            if max(abs(up), abs(down)) > MOST_STOPS:
                return None
        return (up, down) if abs(miss) + abs(miss_outside) < NEAR else None

    def agreement(self, group: Bools) -> float:
        """Return how well the area that a group outshines agrees with the wish; 0 for none."""
        if not group.any() or group.all() or (changes := self.changes(group)) is None:
            return 0.0
        bright, other = (
            self.light[x].sum(axis=0) * 2**stops
            for x, stops in zip((group, ~group), changes, strict=True)
        )
        lit = self.within | self.outside
        pairs = (self.within, bright > other), (self.outside, bright <= other)
        return float(np.mean([(lit & a & b).sum() / (lit & (a | b)).sum() for a, b in pairs]))

    def best_group(self) -> tuple[Bools, float]:
        """Return the group of lights, (n,), that agrees best, and its agreement.

        Lights join it in the order of the share of their light that is within the wish, and then
        join and leave one at a time as long as that helps.
        """
        relative = self.light / self.look
        inside = relative[:, self.within].sum(axis=1)
        share = inside / np.maximum(inside + relative[:, self.outside].sum(axis=1), 1e-12)
        usable = np.flatnonzero(relative.any(axis=1))
        order = usable[np.argsort(-share[usable], kind="stable")]

        def score(group: Bools) -> float:
            return self.agreement(group) - GAIN_PER_LAMP * int(group.sum())

        def with_changed(group: Bools, lights: Indices) -> Bools:
            changed = group.copy()
            changed[lights] ^= True
            return changed

        none = np.zeros(len(self.light), bool)
        groups = [with_changed(none, order[:k]) for k in range(1, len(order))] or [none]
        scores = [score(x) for x in groups]
        best, value = groups[int(np.argmax(scores))], max(scores)
        while True:
            groups = [with_changed(best, usable[[k]]) for k in range(len(usable))]
            scores = [score(x) for x in groups]
            if not scores or max(scores) <= value:
                return best, self.agreement(best)
            best, value = groups[int(np.argmax(scores))], max(scores)


@one_thread()
def find_footprint(wash: Wash, own: Doubles) -> Footprint | None:
    """Find the group of lamps whose light ends where a wish of a painting ends; None without one.

    own: (n, 3), weights of the lights in the look.
    """
    if not (wash.is_outlined and 2 <= len(own) <= MAX_LIGHTS):
        return None
    sampled = slice(None, None, ceil(wash.counts.size / SEARCH_BLOCKS))
    dark = DARK * float(np.maximum(wash.look, 0).mean()) or 1.0
    look = np.maximum(wash.look[:, sampled], 0).astype(np.float64) + dark
    stops = wash.asked()
    light = wash.rows[:, :, sampled].astype(np.float64) * own.T[:, :, None]
    painted = (wash.importance[sampled] > 0.5) & (wash.counts[sampled] > 0)
    shown = luminance(look.T)
    lit = painted & (shown > LIT_SHARE * np.percentile(shown, 95))
    # The change of luminance, and the changes of the channels.
    changes = [np.log2(luminance((look * 2.0 ** stops[:, sampled]).T) / shown), *stops[:, sampled]]
    lights = [luminance(light.transpose(1, 2, 0)), *light]
    looks = [shown, *look]
    found = None
    for area in wash.wishes[:, sampled]:
        within, outside = lit & (area > 0.5), lit & (area <= 0.5)
        if min(within.sum(), outside.sum()) < max(LEAST_SHARE * lit.sum(), LEAST_BLOCKS):
            continue
        flatness = min(_flatness(stops[:, sampled][:, zone]) for zone in (within, outside))
        zones = [
            _Zones(one, now, within, outside, tuple(np.median(x[z]) for z in (within, outside)))
            for one, now, x in zip(lights, looks, changes, strict=True)
        ]
        if flatness == 0 or zones[0].goals[0] <= zones[0].goals[1]:
            continue
        group, agreement = zones[0].best_group()
        confidence = flatness * _ramp(agreement, AGREEMENT)
        if confidence <= (0.0 if found is None else found.confidence):
            continue
        gains = [x.changes(group) for x in zones[1:]]
        if None in gains:
            continue
        up, down = np.array(gains).T
        emission = own * 2.0 ** np.where(group[:, None], up, down)
        found = Footprint(group, emission, confidence)
    return found


def _flatness(stops: Doubles) -> float:
    """Return how clearly changes (3, p), in stops, are one change: from 0 to 1."""
    differs = np.abs(stops - np.median(stops, axis=1, keepdims=True)).max(axis=0)
    return _ramp(float((differs < FLAT_STOPS).mean()), FLAT)


def _ramp(value: float, ends: tuple[float, float]) -> float:
    """Return 0 up to the first end, 1 from the second one on."""
    low, high = ends
    return float(np.clip((value - low) / (high - low), 0, 1))


@one_thread()
def footprint_term(
    wash: Wash, found: Footprint, transform: ViewTransform | None, strength: float
) -> NormalEquations:
    """Return the term of the picture of the two groups of lamps.

    transform: the view transform of the loss; None for linear light. strength: the importance of
    all paint.
    """
    sampled = slice(None, None, ceil(wash.counts.size / PICTURE_BLOCKS))
    rows = wash.rows[:, :, sampled].astype(np.float64)
    picture = np.einsum("cnp,nc->cp", rows, found.emission)
    dark = DARK * float(np.maximum(wash.look, 0).mean()) or 1.0
    slope = display_amplitude(picture, transform) / (picture + dark)
    amount = (wash.counts * wash.importance)[sampled]
    weight = FOOTPRINT * found.confidence * strength * np.square(slope) * amount / amount.sum()
    weighted = rows * weight[:, None]
    M = weighted @ rows.transpose(0, 2, 1)
    b = np.einsum("cnp,cp->cn", weighted, picture)
    return NormalEquations(M, b, (weight * np.square(picture)).sum(axis=1))
