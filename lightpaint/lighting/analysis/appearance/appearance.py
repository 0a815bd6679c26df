"""What an eye sees of an answer beside its painting, over what was painted and against that alone.

What a solve minimises also holds the rest, pulls at colours, and is a sum of squares; whoever
painted looks at the paint. So the miss that people are told is the mean CIEDE2000 there, at the
exposure and through the view of the painting, weighted by importance.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from lightpaint.arrays import Doubles, as_rgb
from lightpaint.colour.color import luminance
from lightpaint.colour.color_difference import ciede2000
from lightpaint.images.estimate import Estimate
from lightpaint.images.object_map import Objects
from lightpaint.keywords import keywords
from lightpaint.lighting.analysis.appearance.constraint_kinds import (
    ConstraintKind,
    ConstraintsByLight,
)
from lightpaint.lighting.analysis.appearance.display_difference import Looking
from lightpaint.lighting.analysis.appearance.limiting_reasons import NAMED, Held, Reason, reasons_of
from lightpaint.lighting.analysis.appearance.object_miss import object_with_most
from lightpaint.lighting.analysis.appearance.unpainted_change import Elsewhere, what_changes
from lightpaint.lighting.analysis.diagnosis import (
    REGIONS,
    Diagnosis,
    Place,
    diagnose,
    parts_of_miss,
)
from lightpaint.lighting.answer.lighting import combine
from lightpaint.lighting.constraints.light_patterns import constraints_by_light, tied_lights
from lightpaint.lighting.solution import Solution
from lightpaint.screen import shortly

#: Mean ΔE up to which a result is close: seen only by who compares side by side; and from which on
#: it is another picture.
CLOSE, FAR = 3.0, 10.0

#: ΔE that is seen at a glance, and the share of the paint from which on such a spot is told.
NOTICED, SPOT = 6.0, 0.02

#: ΔE below which nobody sees anything, and the share of what was asked that must have come about.
UNSEEN, SOME = 1.0, 0.3

#: Share of what was asked that may be missed of a great change before the answer is called far.
HALF = 0.5

#: A light gets to a place from this share on of what it does to its brightest pixels, and does
#: much there from that.
GETS_THERE, DOES_MUCH = 0.01, 0.1

#: What holds a light at a level.
HELD_THERE: tuple[ConstraintKind, ...] = ("off", "lock")

#: Every so-many-th pixel of each side is enough to find the brightest.
THINNED = 2


@keywords()
@dataclass(frozen=True)
class Seen:
    """How far an answer looks from what was painted: mean CIEDE2000 over the paint.

    Attributes:
        delta_e: Of the prediction, with its noise.
        noise: The part of it that noise explains; 0 where nothing is known of noise.
        asked: Of the scene as it is now: how much was asked for.
        place: Where most of it is missed, and on what; None where nothing is, and of several views.
        is_spot: Whether what is missed in that place is seen at a glance.
        there: Lights that get to that place, the one that does most for it first; where there is
            too much light, those that it is from.
        does_much: Whether one of them does much there.
        kept_there: Those of them that what is asked of them holds back.
        reasons: What is asked beside the painting and keeps the lights from it, what would bring
            most first, with the share of what is missed that goes without it.
        parts: Shares of what is missed, of all that the fit counts, by what no light can change:
            `unreachable`, `forbidden`, `noise`, `painting_noise`, and `compromise` of several
            views. Empty where nobody has looked.
        elsewhere: What becomes of the rest, where it was painted over the present look.

    Examples:
        >>> seen = lp.what_is_seen(lp.solve(basis, target))
        >>> seen.is_close, round(seen.missed, 1)
        (True, 0.0)
    """

    delta_e: float
    noise: float
    asked: float
    place: Place | None = None
    is_spot: bool = False
    there: tuple[str, ...] = ()
    does_much: bool = True
    kept_there: tuple[str, ...] = ()
    reasons: tuple[Reason, ...] = ()
    parts: Mapping[str, float] = field(default_factory=dict)
    elsewhere: Elsewhere | None = None

    __repr__ = shortly

    @property
    def causes(self) -> tuple[Reason, ...]:
        """The reasons that a headline may name: without one of them a third is not missed."""
        return tuple(reason for reason in self.reasons if reason.share >= NAMED)

    @property
    def held(self) -> tuple[Held, ...]:
        """The same by what holds: `hold`, `colors`, `constraints` or `views`."""
        return tuple(dict.fromkeys(reason.held for reason in self.causes))

    @property
    def held_by_views(self) -> tuple[str, ...]:
        """Which other views do, where these are among that: their sensors, or paintings where they
        have the same.
        """
        return tuple(name for x in self.causes if x.kind == "views" for name in x.names)

    @property
    def is_beyond(self) -> bool:
        """Whether a third of what is missed is out of reach of the lights, whatever is asked."""
        if not self.parts:
            return True
        return self.parts.get("unreachable", 0) + self.parts.get("forbidden", 0) >= NAMED

    @property
    def noise_that_counts(self) -> str:
        """`noise` or `painting_noise`, where a third of what is missed is that; else ""."""
        its = {part: self.parts.get(part, 0.0) for part in ("noise", "painting_noise")}
        part = max(its, key=its.__getitem__)
        return part if its[part] >= NAMED else ""

    @property
    def is_at_cost(self) -> bool:
        """Whether what is not painted has changed by more than what is has come closer."""
        rest = self.elsewhere
        if rest is None or not self.changes_elsewhere:
            return False
        return rest.delta_e > max(self.asked - self.missed, 0)

    @property
    def changes_elsewhere(self) -> bool:
        """Whether a place that is not painted looks different at a glance."""
        return self.elsewhere is not None and self.elsewhere.worst > NOTICED

    @property
    def missed(self) -> float:
        """What the lighting itself misses, were it rendered without noise."""
        return self.delta_e - self.noise

    @property
    def is_worse(self) -> bool:
        """Whether the scene as it is comes closer to the paint, in numbers as people are told."""
        return round(self.delta_e, 1) > round(self.asked, 1)

    @property
    def share_met(self) -> float:
        """Share of what was asked that has come about: 1 − `delta_e` / `asked`, at least 0."""
        if self.asked > 0:
            return max(1 - self.delta_e / self.asked, 0.0)
        return float(self.delta_e == 0)

    @property
    def is_in_vain(self) -> bool:
        """Whether hardly any of what was asked has come about."""
        return self.missed > max(UNSEEN, (1 - SOME) * self.asked)

    @property
    def is_close(self) -> bool:
        """Whether the two look alike; not where little was asked and less has come about."""
        return self.missed <= CLOSE and not self.is_in_vain

    @property
    def is_far(self) -> bool:
        """Whether it looks like another picture, or still like the one there was.

        Not where more than half of what was asked has come about.
        """
        is_another = self.missed > FAR and self.missed > HALF * self.asked
        return is_another or self.is_in_vain


@keywords()
def what_is_seen(
    solution: Solution, predicted: Estimate | None = None, *, diagnosis: Diagnosis | None = None
) -> Seen:
    """How far `solution` looks from its painting, where most, and what keeps it from there.

    Args:
        solution: Of one view or, without a place, of several.
        predicted: What `combine` makes of it, where that is known.
        diagnosis: What `diagnose` says of it, where that is known.

    Examples:
        >>> lp.what_is_seen(lp.solve(basis, target)).delta_e < 0.1
        True
    """
    problem = solution.problem
    predicted = predicted or combine(solution.basis, solution.lighting)
    look = Looking.at(problem)
    light, grain = look.of(predicted.image), look.of(predicted.half_difference)
    now = look.of(problem.basis.mix(problem.basis.present_weights))
    with_noise, missed = _missed(look, light, grain)
    delta_e, left = (float(np.average(x, weights=look.block_weights)) for x in (with_noise, missed))
    seen = Seen(delta_e, max(delta_e - left, 0.0), look.mean(look.missed(now)))
    if len(problem.views) > 1:
        return seen
    seen = replace(seen, elsewhere=_rest(solution, look, predicted))
    if not missed.any():
        return seen
    place, share = _place(look, missed, light, grain)
    seen = replace(seen, place=place, is_spot=share >= SPOT)
    if seen.is_close and not seen.is_spot:
        return seen
    there, does_much = _lights_at(solution, place)
    if (objects := solution.basis.objects) is not None:
        seen = replace(seen, place=replace(place, object=_object(look, objects, missed, light)))
    # Not those that are only to be white, as all are.
    asked = constraints_by_light(problem.constraints, solution.basis.lights)
    tied = tied_lights(problem.constraints, solution.basis.lights)
    kept = {
        light.name
        for k, light in enumerate(solution.lighting.lights)
        if light.is_active and (asked[k] is not None or k in tied)
    }
    kept_there = tuple(name for name in there if name in kept)
    seen = replace(seen, there=there, does_much=does_much, kept_there=kept_there)
    return replace(
        seen,
        reasons=reasons_of(solution),
        parts=parts_of_miss(diagnosis or diagnose(solution)),
    )


def _rest(solution: Solution, look: Looking, predicted: Estimate) -> Elsewhere | None:
    """Return how much of what nobody painted changes; None where it was not to stay as it is.

    Both are sums of the same planes, so that noise is no change; nor is what a person did to
    lights, who holds them where they are.
    """
    [target], basis = solution.problem.views.targets, solution.basis
    if not target.over_look or target.everything:
        return None
    kinds = ConstraintsByLight.of(solution.problem.constraints, basis.lights).kinds()
    before = basis.present_weights.copy()
    for kind in HELD_THERE:
        its = list(kinds.get(kind, ()))
        before[its] = solution.weights[its]
    now = basis.mix(before)
    return what_changes(look, basis, target.importance > 0, now, predicted.image)


def _missed(look: Looking, light: Doubles, grain: Doubles) -> tuple[Doubles, Doubles]:
    """Mean ΔE in each block, (rows, columns), as it is and without what noise explains of it.

    Noise and miss are the legs of a right angle, since neither knows of the other. But a painting
    over the same renders shares their noise: it explains no more than is left between the pixels
    when their mean is taken out, which noise hardly moves.
    """
    of_light, of_paint = look.lab(light), look.lab_meant(light)
    whole = look.in_blocks(ciede2000(of_light, of_paint))
    if not grain.any():
        return whole, whole
    of_means = ciede2000(look.in_blocks(of_light), look.in_blocks(of_paint))
    between = np.square(whole) - np.square(np.minimum(of_means, whole))
    noise = np.square(look.in_blocks(ciede2000(of_light, look.lab(light + grain))))
    return whole, np.sqrt(np.square(whole) - np.minimum(noise, between))


def _place(look: Looking, missed: Doubles, light: Doubles, grain: Doubles) -> tuple[Place, float]:
    """Where the fit misses most, and the share of the paint there that is seen at a glance."""
    weights = look.block_weights
    amount = weights * _costs(look, light, grain)
    if not amount.any():
        amount = weights * missed
    region = np.zeros((REGIONS, REGIONS))
    at = [REGIONS * np.arange(length) // length for length in amount.shape]
    np.add.at(region, np.ix_(*at), amount)
    worst = np.unravel_index(int(np.argmax(region)), region.shape)
    inside = (at[0] == worst[0])[:, None] & (at[1] == worst[1])
    row, column = np.unravel_index(int(np.argmax(np.where(inside, amount, -1))), amount.shape)
    # What the paint and the answer are there, of all that is missed there.
    its = np.where(inside, amount, 0)
    painted, reached = (
        np.average(look.in_blocks(x).reshape(-1, 3), axis=0, weights=its.ravel())
        for x in (look.painted[look.counts].astype(np.float64), light)
    )
    place = Place(
        region=(int(worst[0]), int(worst[1])),
        share=float(region[worst] / region.sum()),
        box=look.box(int(row), int(column)),
        painted=as_rgb(painted),
        reached=as_rgb(reached),
    )
    return place, float((weights * (missed > NOTICED) * inside).sum() / weights.sum())


def _costs(look: Looking, light: Doubles, grain: Doubles) -> Doubles:
    """Return what each block misses as the fit counts it, (rows, columns), less its noise.

    Noise explains no more than is left between the pixels, as in `_missed`.
    """
    whole = look.in_blocks(look.costs(light))
    if not grain.any():
        return whole
    shown, meant = look.compare(light), look.compare(look.meant(light))
    of_means = np.square(look.in_blocks(meant) - look.in_blocks(shown)).sum(axis=-1)
    noise = look.in_blocks(np.square(look.compare(light + grain) - shown).sum(axis=-1))
    return np.asarray(whole - np.minimum(noise, np.maximum(whole - of_means, 0)))


def _object(look: Looking, objects: Objects, missed: Doubles, light: Doubles) -> str:
    """What most of that lies on which is missed, or seen at a glance; "" for no single thing."""
    noticed = missed > NOTICED
    told = look.of_blocks(noticed if noticed.any() else missed > 0)
    amount = told * look.costs(light) * look.weight[look.counts]
    return object_with_most(
        objects, look.of(objects.index.astype(np.float32)).astype(np.intp), amount
    )


def _lights_at(solution: Solution, place: Place) -> tuple[tuple[str, ...], bool]:
    """The lights that get to a place, and whether one does much there.

    Where it is too bright, those that most of its light is from; else by what they do there beside
    what they do to their brightest pixels, which does not depend on how strong they are.
    """
    basis = solution.basis
    top, left, bottom, right = place.box
    there = basis.planes.rows(top, bottom)[:, :, left:right].mean(axis=(1, 2), dtype=np.float64)
    if luminance(np.array(place.painted)) < luminance(np.array(place.reached)):
        part, enough = luminance(there * solution.weights), DOES_MUCH
        whole = np.full(len(part), part.sum())
    else:
        part, enough = np.where(basis.is_fixed, 0, luminance(there)), GETS_THERE
        every = np.stack([luminance(x[::THINNED, ::THINNED]) for x in basis.planes])
        whole = np.percentile(every.reshape(len(part), -1), 99, axis=1)
    share = np.where(whole > 0, part / np.where(whole > 0, whole, 1), 0)
    names = (basis.names[k] for k in np.argsort(-share, kind="stable") if share[k] > enough)
    return tuple(names), bool(share.max() > DOES_MUCH)
