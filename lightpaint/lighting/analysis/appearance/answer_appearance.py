"""The visible difference between an answer and its painting, over the paint.

The objective of a solve is a sum of squares which also holds unpainted pixels and pulls at colours,
whereas painters look at the paint. So reports give the mean CIEDE2000 there, weighted by
importance, at the exposure and through the view transform of the painting.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.colour import luminance
from lightpaint.display_text import short_repr
from lightpaint.images import Estimate
from lightpaint.keywords import keywords
from lightpaint.lighting.analysis.appearance.area_lights import (
    AreaLights,
    compensating_lights,
    lights_of_area,
)
from lightpaint.lighting.analysis.appearance.delivery import (
    Delivery,
    DeliveryReport,
    has_come,
    mean_shares,
    measure_deliveries,
    worst_delivery,
)
from lightpaint.lighting.analysis.appearance.display_difference import (
    NOTICED,
    SPOT,
    PaintComparison,
    UnpaintedChange,
    block_differences,
    change_from_scene,
    lights_at,
    object_with_most_error,
    place_with_most_error,
    undetermined_at,
)
from lightpaint.lighting.analysis.appearance.limiting_reasons import (
    HEADLINE_SHARE,
    Reason,
    reasons_of,
)
from lightpaint.lighting.analysis.appearance.pixel_sample import LimitGroup
from lightpaint.lighting.analysis.diagnosis import Diagnosis, Place, diagnose, error_shares
from lightpaint.lighting.analysis.noise.uncertainty import Uncertainty
from lightpaint.lighting.constraints.light_constraints import constraints_by_light, tied_lights
from lightpaint.lighting.solution import Solution

#: Mean ΔE up to which a result is close: visible only side by side; and from which on it is another
#: picture.
CLOSE, FAR = 3.0, 10.0

#: ΔE that is invisible, and the least share of the requested change to achieve.
INVISIBLE, MIN_CHANGE = 1.0, 0.3

#: Ratio of painted to reached light below which shadow is missing, and no light.
DARKER = 0.8

#: Largest share of a great change that may be missing before the answer counts as far.
FAR_SHARE = 0.5


@keywords()
@dataclass(frozen=True)
class Appearance:
    """The comparison of an answer with its painting, as people see both: mean CIEDE2000.

    Attributes:
        delta_e: Of the prediction, with its noise.
        noise: The part of it that noise explains; 0 for unknown noise.
        requested_change: Of the current scene: the change that the painting asks for.
        place: The place with most of the error, and its object; None without error, and of several
            views.
        is_spot: Whether the error in that place is visible at a glance.
        local_lights: Lights that reach that place, the strongest first; if it is too bright, the
            lights that make it so.
        has_strong_light: Whether one of them contributes much there.
        held_lights: The ones among them that constraints hold back.
        fixed_lights: The ones among them that are not adjusted, as an emitter in view may be.
        area_lights: The lights of the paint in question, and what else they light; None if not
            computed, or if all of the picture is painted.
        reasons: Constraints, holds and other views that keep the lights from the painting, the
            most important first, with the share of the error that vanishes without them.
        error_shares: Shares of the error of the fit that no light can change: `unreachable`,
            `forbidden`, `noise`, `painting_noise`, and `compromise` of several views. Empty if not
            computed.
        unpainted_change: The change of the rest, for a painting over the current look.
        deliveries: How much of each wish came, the lowest first: of each layer or stroke, and of
            each group after its layers.
        lit_delta_e: The mean CIEDE2000 of the lit parts of the paint, as washes.
        reasons_wish: The name of the wish that place, lights and reasons are about: of `worst_wish`
            if it is a part of the paint. "" if they are about all of it.
        compensating_lights: Lights that are down by two stops or more only to make up for what
            others spill on unpainted parts.
        undetermined_lights: Lights whose error may be what is missing at the place: all of it, or
            a third if the samples do not determine them (`Uncertainty.untold`). What they could do
            there is not known. Empty if errors of lights were not computed.
        is_painted_everywhere: Whether all of the picture is painted, so that nothing else can be.

    Examples:
        >>> appearance = lp.compare_appearance(lp.solve(basis, target))
        >>> appearance.is_close, round(appearance.error, 1)
        (True, 0.0)
    """

    delta_e: float
    noise: float
    requested_change: float
    place: Place | None = None
    is_spot: bool = False
    local_lights: tuple[str, ...] = ()
    has_strong_light: bool = True
    held_lights: tuple[str, ...] = ()
    fixed_lights: tuple[str, ...] = ()
    area_lights: AreaLights | None = None
    reasons: tuple[Reason, ...] = ()
    error_shares: Mapping[str, float] = field(default_factory=dict)
    unpainted_change: UnpaintedChange | None = None
    deliveries: tuple[Delivery, ...] = ()
    lit_delta_e: float = 0.0
    reasons_wish: str = ""
    compensating_lights: tuple[str, ...] = ()
    undetermined_lights: tuple[str, ...] = ()
    is_painted_everywhere: bool = False

    __repr__ = short_repr

    @property
    def causes(self) -> tuple[Reason, ...]:
        """The reasons that a headline may name: without one of them a third of the error vanishes,
        or lights could have the colour that `worst_wish` lacks.
        """
        worst = self.worst_wish
        lacks_color = worst is not None and worst.lacks_color
        return tuple(
            reason
            for reason in self.reasons
            if reason.share >= HEADLINE_SHARE or (lacks_color and reason.kind == "colors")
        )

    @property
    def lacks_light_of_its_own(self) -> bool:
        """True if every light that reaches the paint in question lights the rest, too, and light is
        missing there, or its colour.
        """
        if self.area_lights is None or self.area_lights.is_alone or self.place is None:
            return False
        painted, reached = (
            float(luminance(np.array(x))) for x in (self.place.painted, self.place.reached)
        )
        return painted >= DARKER * reached

    @property
    def needs_another_light(self) -> bool:
        """True if a wish is missed because every light that reaches it lights the rest, too, or
        because no light that there is can bring it.
        """
        if self.worst_wish is None or self.is_hidden_by_noise:
            return False
        if self.causes and self.causes[0].kind == "hold":
            return self.lacks_light_of_its_own
        return not self.causes and (self.is_out_of_reach or self.lacks_light_of_its_own)

    @property
    def limit_groups(self) -> tuple[LimitGroup, ...]:
        """The groups of these reasons: `hold`, `colors`, `constraints` or `views`."""
        return tuple(dict.fromkeys(reason.group for reason in self.causes))

    @property
    def limiting_views(self) -> tuple[str, ...]:
        """The sensors of the other views among these reasons, or their paintings where sensors are
        the same.
        """
        return tuple(name for x in self.causes if x.kind == "views" for name in x.names)

    @property
    def is_out_of_reach(self) -> bool:
        """True if a third of the error is out of reach of the lights, whatever the constraints.

        Noise may hide what a light can do: then nothing is known to be out of its reach.
        """
        if self.is_hidden_by_noise:
            return False
        if not self.error_shares:
            return True
        return (
            self.error_shares.get("unreachable", 0) + self.error_shares.get("forbidden", 0)
            >= HEADLINE_SHARE
        )

    @property
    def is_hidden_by_noise(self) -> bool:
        """True if the samples do not determine a light that reaches the place."""
        return bool(self.hidden_lights)

    @property
    def hidden_lights(self) -> tuple[str, ...]:
        """The lights of place and paint in question that the samples do not determine."""
        of_area = () if self.area_lights is None else self.area_lights.names
        names = dict.fromkeys((*self.local_lights, *of_area))
        return tuple(name for name in names if name in self.undetermined_lights)

    @property
    def noise_share(self) -> float:
        """The share of ΔE that render noise explains."""
        return self.noise / self.delta_e if self.delta_e > 0 else 0.0

    @property
    def main_noise(self) -> str:
        """`noise`, if render noise explains a third of ΔE; else `painting_noise` or `energy`, if
        noise of the painting or of the basis is a third of the error of the fit; else "".

        A few bright pixels can have most of that error, and little of ΔE.
        """
        painting, basis = (self.error_shares.get(x, 0.0) for x in ("painting_noise", "noise"))
        if self.noise_share >= max(HEADLINE_SHARE, painting):
            return "noise"
        if painting >= HEADLINE_SHARE:
            return "painting_noise"
        return "energy" if basis >= HEADLINE_SHARE else ""

    @property
    def is_at_cost(self) -> bool:
        """True if unpainted pixels have changed by more than painted ones have come closer."""
        rest = self.unpainted_change
        if rest is None or not self.changes_unpainted:
            return False
        return rest.delta_e > max(self.requested_change - self.error, 0)

    @property
    def changes_unpainted(self) -> bool:
        """True if an unpainted place looks different at a glance."""
        return self.unpainted_change is not None and self.unpainted_change.worst > NOTICED

    @property
    def error(self) -> float:
        """The error of the lighting itself, without noise."""
        return self.delta_e - self.noise

    @property
    def is_worse(self) -> bool:
        """True if the current scene is closer to the paint, by the numbers that reports give, and
        not all of the wishes came.
        """
        return round(self.delta_e, 1) > round(self.requested_change, 1) and not self.has_come

    @property
    def share_met(self) -> float:
        """Achieved share of the requested change: 1 − `delta_e` / `asked`, at least 0."""
        if self.requested_change > 0:
            return max(1 - self.delta_e / self.requested_change, 0.0)
        return float(self.delta_e == 0)

    @property
    def progress(self) -> float:
        """Share that came of what was asked for, from 0 to 1: the smaller of the `mean_shares` of
        brightness and of colour.

        Where no wish asks for anything visible, the share of the requested ΔE, without noise. 0 if
        the current scene is closer.
        """
        known = [x for x in mean_shares(self.deliveries) if x is not None]
        if known and not self.is_worse:
            return min(known)
        if self.requested_change > 0 and not self.is_worse:
            return min(max(1 - self.error / self.requested_change, 0.0), 1.0)
        return self.share_met

    @property
    def is_in_vain(self) -> bool:
        """True if hardly any of the requested change was achieved, and not all of the wishes
        came.
        """
        is_as_before = self.error > max(INVISIBLE, (1 - MIN_CHANGE) * self.requested_change)
        return is_as_before and not self.has_come

    @property
    def has_come(self) -> bool:
        """True if three quarters or more came of each wish that asks for something visible."""
        return has_come(self.deliveries)

    @property
    def worst_wish(self) -> Delivery | None:
        """The wish of which least came, if less than three quarters did."""
        return worst_delivery(self.deliveries)

    @property
    def is_nearly_equal(self) -> bool:
        """True if the two look alike on the whole and in their lit parts; not if little was
        requested and even less achieved.
        """
        return max(self.error, self.lit_delta_e) <= CLOSE and not self.is_in_vain

    @property
    def is_close(self) -> bool:
        """True if the two look alike, and at least three quarters of each wish came."""
        return self.is_nearly_equal and self.worst_wish is None

    @property
    def has_miss(self) -> bool:
        """True if something is missing at `place`: in an answer that is not close, or in a spot of
        one that is.
        """
        return self.place is not None and (not self.is_close or self.is_spot)

    @property
    def is_far(self) -> bool:
        """True if it looks like another picture, or still like the current one.

        Not if more than half of the requested change is achieved.
        """
        is_another = self.error > FAR and self.error > FAR_SHARE * self.requested_change
        return is_another or self.is_in_vain


@keywords()
def compare_appearance(
    solution: Solution, predicted: Estimate | None = None, *, diagnosis: Diagnosis | None = None
) -> Appearance:
    """Measure the visible difference of `solution` from its painting, with place and reasons.

    Args:
        solution: Of one view or, without a place, of several.
        predicted: The result of `combine`, if known.
        diagnosis: The result of `diagnose`, if known.

    Examples:
        >>> lp.compare_appearance(lp.solve(basis, target)).delta_e < 0.1
        True
    """
    problem = solution.problem
    predicted = predicted or solution.basis.predict(solution.weights)
    look = PaintComparison.of_problem(problem)
    light, grain = look.pixels(predicted.image), look.pixels(predicted.half_difference)
    now = look.pixels(problem.basis.current_look)
    with_noise, missed = block_differences(look, light, grain)
    delta_e, error = (
        float(np.average(x, weights=look.block_weights)) for x in (with_noise, missed)
    )
    delivered = measure_deliveries(solution, predicted.image)
    appearance = Appearance(
        delta_e,
        max(delta_e - error, 0.0),
        look.mean(look.difference(now)),
        deliveries=delivered.deliveries,
        lit_delta_e=delivered.lit_delta_e,
        is_painted_everywhere=all(target.everything for target in problem.views.targets),
    )
    if len(problem.views) > 1:
        return appearance
    rest = change_from_scene(solution, look, solution.weights, predicted.image)
    appearance = replace(
        appearance, unpainted_change=rest, compensating_lights=compensating_lights(solution)
    )
    if not missed.any():
        return appearance
    place, share = place_with_most_error(look, missed, light, grain)
    del light, grain, now  # what follows needs memory for pictures
    appearance = replace(appearance, place=place, is_spot=share >= SPOT)
    if not appearance.has_miss:
        return appearance
    if (area := _worst_area(appearance, delivered)) is not None:
        look = look.within(area)
        appearance = replace(appearance, reasons_wish=delivered.name_of_part(appearance.worst_wish))
    return _with_reasons(appearance, solution, look, predicted, area, diagnosis)


def with_undetermined(
    appearance: Appearance, view: Solution, uncertainty: Uncertainty
) -> Appearance:
    """Return the appearance of a view with the lights that its samples do not determine."""
    if (place := appearance.place) is None:
        return appearance
    there, untold = undetermined_at(view, place, uncertainty)
    return replace(
        appearance,
        # What its error may bring to the place, a light can bring there.
        local_lights=tuple(dict.fromkeys((*appearance.local_lights, *there))),
        undetermined_lights=tuple(x for x in view.basis.names if x in {*untold, *there}),
    )


def _worst_area(appearance: Appearance, delivered: DeliveryReport) -> Floats | None:
    """Return the area of the wish of which least came, (h, w); None if enough came of all."""
    worst = appearance.worst_wish
    entries = zip(delivered.deliveries, delivered.areas, strict=True)
    return next((area for delivery, area in entries if delivery is worst), None)


def _with_reasons(
    appearance: Appearance,
    solution: Solution,
    look: PaintComparison,
    predicted: Estimate,
    area: Floats | None,
    diagnosis: Diagnosis | None,
) -> Appearance:
    """Return the appearance with the place of most error, its lights and object, and the reasons.

    look, area: of the paint in question; the area is None for all paint.
    """
    appearance = _with_place(appearance, solution, look, predicted)
    [target] = solution.problem.views.targets
    return replace(
        appearance,
        area_lights=lights_of_area(
            solution.basis, np.minimum(target.importance, 1) if area is None else area
        ),
        reasons=reasons_of(solution, area),
        error_shares=error_shares(diagnosis or diagnose(solution)),
    )


def _with_place(
    appearance: Appearance, solution: Solution, look: PaintComparison, predicted: Estimate
) -> Appearance:
    """Return the appearance with the place of most error, its object, and the lights that reach it,
    some of which constraints hold.
    """
    light, grain = look.pixels(predicted.image), look.pixels(predicted.half_difference)
    _, missed = block_differences(look, light, grain)
    if not missed.any():
        return appearance
    place, _ = place_with_most_error(look, missed, light, grain)
    if (objects := solution.basis.objects) is not None:
        place = replace(place, object=object_with_most_error(look, objects, missed, light))
    local_lights, has_strong_light = lights_at(solution, place)
    # Without the constraint to be white, which applies to all.
    constraints, lights = solution.problem.constraints, solution.basis.lights
    by_light, tied = constraints_by_light(constraints, lights), tied_lights(constraints, lights)
    limits = {
        light.name
        for k, light in enumerate(solution.lighting.lights)
        if light.is_active and (by_light[k] is not None or k in tied)
    }
    return replace(
        appearance,
        place=place,
        local_lights=local_lights,
        has_strong_light=has_strong_light,
        held_lights=tuple(name for name in local_lights if name in limits),
        fixed_lights=tuple(x.name for x in lights if x.is_fixed and x.name in local_lights),
    )
