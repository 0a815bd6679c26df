"""The visible difference of a picture from the paint: CIEDE2000, as displayed; the place with most
of it, its object, and the lights that reach it; and the change of the unpainted part.
"""

import re
from collections import Counter
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats, Indices, as_rgb
from lightpaint.basis import Basis, Planes, blocks_of, light_images, thinned
from lightpaint.colour import LUMINANCE, ViewTransform, ciede2000, lab, luminance
from lightpaint.images import Objects, block_sums, enlarged
from lightpaint.lighting.analysis.diagnosis import REGIONS, Place, WorstRegion
from lightpaint.lighting.analysis.noise.uncertainty import Uncertainty
from lightpaint.lighting.constraints.light_constraints import ConstraintKind, ConstraintsByLight
from lightpaint.lighting.loss.painting import at_least_mask, target_light
from lightpaint.lighting.problem import Problem, display_light, display_transform
from lightpaint.lighting.solution import Solution

#: Painted pixels that are compared, and pixels along the side of a block that averages noise.
MAX_COMPARED_PIXELS, BLOCK = 2**15, 8

#: Smallest share of the error on a named object, and its largest share of the picture.
MIN_ERROR_SHARE, MAX_PICTURE_SHARE = 0.6, 0.5

#: Kinds of shapes, and numbers that programs give: names without meaning for people.
NO_NAME = re.compile(
    r"(ply|obj|serialized|mesh|shape|object|unnamed|rectangle|cube|sphere|disk|cylinder|instance|"
    r"merge|sdfgrid|bsplinecurve|linearcurve|ellipsoids(mesh)?|group|default|none)?[\W_\d]*",
    re.IGNORECASE,
)

#: ΔE that is visible at a glance, and the smallest share of the paint of such a spot.
NOTICED, SPOT = 6.0, 0.02

#: Share of its light on its brightest pixels from which a light reaches a place, and from which it
#: contributes much there.
GETS_THERE, DOES_MUCH = 0.01, 0.1

#: Step between pixels, along each side, that suffices to find the brightest.
STEP = 2

#: Paths of a light that a place may lack by chance: where its samples found none, it has fewer than
#: these in 95 of 100 cases.
UNSEEN_PATHS = 3.0

#: Share of what is missing at a place that an undetermined light may bring: with less, it is not
#: the reason.
UNTOLD_SHARE = 1 / 3

#: Maximum number of values, pixels times lights, that suffice to find the light of one path.
PATH_SAMPLE = 2**22

#: Most lights whose planes are read one by one for it: a plane takes as long as some rows of all.
MAX_SINGLE_PLANES = 2**5

#: Smallest unpainted share of the picture for a place to be mentioned.
MIN_PLACE = 0.01

#: Kinds of constraints that fix the level of a light.
FIXING_KINDS: tuple[ConstraintKind, ...] = ("off", "lock")


@dataclass(frozen=True)
class PaintComparison:
    """The compared pixels of a painting: every `step`-th one along each side.

    painted: (h, w, 3) linear. at_least: (h, w, 3), where brighter is as good. weight: (h, w), the
    importance. transform: the view of a display. compared: the view transform of the fit; None in
    linear light.
    """

    painted: Floats
    at_least: Bools
    weight: Doubles
    step: int
    transform: ViewTransform
    compared: ViewTransform | None = None

    @staticmethod
    def of_problem(problem: Problem, *, max_pixels: int = MAX_COMPARED_PIXELS) -> "PaintComparison":
        """Choose pixels of the painting of a problem, in all its views, about `max_pixels`."""
        views = problem.views
        weight = views.join([target.importance for target in views.targets])
        step = max(int(np.sqrt((weight > 0).sum() / max_pixels)), 1)
        if not weight[::step, ::step].any():
            step = 1
        compared = (slice(None, None, step), slice(None, None, step))
        return PaintComparison(
            # Copies, which do not keep the whole pictures.
            target_light(views)[compared].astype(np.float64),
            at_least_mask(views)[compared].copy(),
            weight[compared].astype(np.float64),
            step,
            display_transform(problem),
            problem.loss.transform,
        )

    def within(self, area: Floats) -> "PaintComparison":
        """Return the comparison of a part of the paint, (H, W) from 0 to 1; of all of it if no
        compared pixel lies there.
        """
        weight = self.weight * area[:: self.step, :: self.step]
        return replace(self, weight=weight) if weight.any() else self

    @cached_property
    def counts(self) -> Bools:
        """(h, w), the painted pixels."""
        return self.weight > 0

    def pixels(self, image: Floats) -> Doubles:
        """Return the painted pixels of a whole picture (H, W, 3), (p, 3)."""
        return image[:: self.step, :: self.step][self.counts].astype(np.float64)

    def rows(self, planes: Planes) -> Floats:
        """Return the painted pixels of whole pictures (H, W, 3), (n, p, 3)."""
        return np.stack([x[:: self.step, :: self.step][self.counts] for x in planes])

    def missed(self, rows: Floats, weights: Doubles) -> float:
        """Return the mean difference of a lighting, weights (n, 3), by the rows of its planes."""
        return self.mean(self.difference(np.einsum("npc,nc->pc", rows, weights)))

    def goal(self, pixels: Doubles) -> Doubles:
        """Return the goal, (p, 3): the paint, or light `pixels` (p, 3) where brighter is as
        good."""
        painted = self.painted[self.counts]
        brighter = self.at_least[self.counts] & (pixels > painted)
        return np.asarray(np.where(brighter, pixels, painted), np.float64)

    def difference(self, pixels: Doubles) -> Doubles:
        """Return the difference of light (p, 3) from the paint, CIEDE2000 (p,)."""
        return ciede2000(self.lab(pixels), self.lab_goal(pixels))

    def fit_errors(self, pixels: Doubles) -> Doubles:
        """Return the error of light x, (p, 3), in the fit, (p,): ‖V(ψ) − V(x)‖².

        Importance is not included.
        """
        missed = self.compare(self.goal(pixels)) - self.compare(pixels)
        return np.asarray(np.square(missed).sum(axis=-1))

    def share_removed(self, before: Floats, after: Floats) -> float:
        """Return the share of the error of a whole picture that another does not have.

        before, after: (H, W, 3) linear. Errors are the errors of the fit, with importance. Negative
        if the error grows; 0 without an error before.
        """
        now, then = (self.mean(self.fit_errors(self.pixels(x))) for x in (before, after))
        return 1 - then / now if now > 0 else 0.0

    def compare(self, pixels: Doubles) -> Doubles:
        """Return V of light (p, 3): the values that the fit compares."""
        encoded = pixels if self.compared is None else self.compared.encode(pixels)
        return np.asarray(encoded, np.float64)

    def lab(self, pixels: Doubles) -> Doubles:
        """Return L*a*b* (p, 3) of light (p, 3) on the display."""
        return lab(display_light(pixels, self.transform))

    def lab_goal(self, pixels: Doubles) -> Doubles:
        """Return L*a*b* (p, 3) of the goal."""
        return self.lab(self.goal(pixels)) if self._has_moving_goal else self._painted_lab

    @cached_property
    def _has_moving_goal(self) -> bool:
        """True if the goal follows the light anywhere."""
        return bool(self.at_least[self.counts].any())

    @cached_property
    def _painted_lab(self) -> Doubles:
        return self.lab(self.painted[self.counts].astype(np.float64))

    def mean(self, values: Doubles) -> float:
        """Return the mean of (p,) over the painted pixels, weighted by importance."""
        return float(np.average(values, weights=self.weight[self.counts]))

    def in_blocks(self, values: Doubles) -> Doubles:
        """Return means of (p, …) over the paint of each block, (rows, columns, …); 0 without
        paint."""
        weight = self.weight[self.counts].reshape(-1, *[1] * (values.ndim - 1))
        sums, total = self._sums(weight * values), self.block_weights
        total = total.reshape(*total.shape, *[1] * (values.ndim - 1))
        return np.asarray(sums / np.where(total > 0, total, 1))

    def spread_blocks(self, values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        """Return the block's value, of (rows, columns), for each painted pixel, (p,)."""
        height, width = self.weight.shape
        return np.asarray(enlarged(values, BLOCK)[:height, :width][self.counts])

    @cached_property
    def block_weights(self) -> Doubles:
        """(rows, columns), the importance in each block."""
        return self._sums(self.weight[self.counts])

    def _sums(self, values: Doubles) -> Doubles:
        image = np.zeros((*self.weight.shape, *values.shape[1:]))
        image[self.counts] = values
        return block_sums(image, BLOCK)

    def box(self, row: int, column: int) -> tuple[int, int, int, int]:
        """Return top, left, bottom and right of a block, in pixels of the whole picture."""
        top, left = (self.step * BLOCK * k for k in (row, column))
        ends = zip((top, left), self.weight.shape, strict=True)
        bottom, right = (self.step * min(start // self.step + BLOCK, n) for start, n in ends)
        return top, left, bottom, right


def object_with_most(
    objects: Objects, index: Indices, missed: Doubles, least: float = MIN_ERROR_SHARE
) -> str:
    """Return the object with most of the error, or the first word that several names share; "" for
    none.

    index, missed: (p,), the object and the error, >= 0, of some of the pixels. least: smallest
    share of the error.
    """
    on_each = np.bincount(index + 1, weights=missed, minlength=len(objects.names) + 1)[1:]
    size = np.bincount(objects.index.ravel() + 1, minlength=len(objects.names) + 1)[1:]
    total, pixels = float(missed.sum()), objects.index.size
    for name_of in (str, _first_word):
        on: Counter[str] = Counter()
        by_name: Counter[str] = Counter()
        for name, amount_on, large in zip(objects.names, on_each, size, strict=True):
            on[name_of(name)] += amount_on
            by_name[name_of(name)] += large
        name, most = max(on.items(), key=lambda item: item[1], default=("", 0.0))
        if (
            most >= least * total > 0
            and by_name[name] <= MAX_PICTURE_SHARE * pixels
            and not NO_NAME.fullmatch(name)
        ):
            return name
    return ""


def _first_word(name: str) -> str:
    """Return `statue` for `statue_head`."""
    return re.split(r"[_.\-\s]", name, maxsplit=1)[0]


def block_differences(
    look: PaintComparison, light: Doubles, grain: Doubles
) -> tuple[Doubles, Doubles]:
    """Return the mean ΔE in each block, (rows, columns), with and without the part of noise.

    Noise and error add as squares, since they are independent. But a painting over the same renders
    shares their noise: so noise explains at most the variation between pixels around their mean,
    which noise hardly changes.
    """
    of_light, of_paint = look.lab(light), look.lab_goal(light)
    whole = look.in_blocks(ciede2000(of_light, of_paint))
    if not grain.any():
        return whole, whole
    of_means = ciede2000(look.in_blocks(of_light), look.in_blocks(of_paint))
    between = np.square(whole) - np.square(np.minimum(of_means, whole))
    noise = np.square(look.in_blocks(ciede2000(of_light, look.lab(light + grain))))
    return whole, np.sqrt(np.square(whole) - np.minimum(noise, between))


def place_with_most_error(
    look: PaintComparison, missed: Doubles, light: Doubles, grain: Doubles
) -> tuple[Place, float]:
    """Find the place with most of the error, and the share of its paint with visible error."""
    weights = look.block_weights
    amount = weights * _block_errors(look, light, grain)
    if not amount.any():
        amount = weights * missed
    worst = WorstRegion.of(amount)
    # Paint and answer there, weighted by the error.
    error_weights = np.where(worst.inside, amount, 0)
    painted, reached = (
        np.average(look.in_blocks(x).reshape(-1, 3), axis=0, weights=error_weights.ravel())
        for x in (look.painted[look.counts].astype(np.float64), light)
    )
    place = Place(
        region=worst.region,
        share=worst.share,
        box=look.box(*worst.block),
        painted=as_rgb(painted),
        reached=as_rgb(reached),
    )
    return place, float((weights * (missed > NOTICED) * worst.inside).sum() / weights.sum())


def _block_errors(look: PaintComparison, light: Doubles, grain: Doubles) -> Doubles:
    """Return the error of each block in the fit, (rows, columns), less its noise.

    Noise explains at most the differences between pixels, as in `block_differences`.
    """
    whole = look.in_blocks(look.fit_errors(light))
    if not grain.any():
        return whole
    values, goal_values = look.compare(light), look.compare(look.goal(light))
    of_means = np.square(look.in_blocks(goal_values) - look.in_blocks(values)).sum(axis=-1)
    noise = look.in_blocks(np.square(look.compare(light + grain) - values).sum(axis=-1))
    return np.asarray(whole - np.minimum(noise, np.maximum(whole - of_means, 0)))


def object_with_most_error(
    look: PaintComparison, objects: Objects, missed: Doubles, light: Doubles
) -> str:
    """Return the object with most of the visible error; "" if there is no single one."""
    noticed = missed > NOTICED
    is_counted = look.spread_blocks(noticed if noticed.any() else missed > 0)
    amount = is_counted * look.fit_errors(light) * look.weight[look.counts]
    return object_with_most(
        objects, look.pixels(objects.index.astype(np.float32)).astype(np.intp), amount
    )


def lights_at(solution: Solution, place: Place) -> tuple[tuple[str, ...], bool]:
    """Return the lights that reach a place, and whether one contributes much there.

    If it is too bright, the sources of most of its light, texels of an image together; else lights
    by their effect there relative to their brightest pixels, which does not depend on their
    strength.
    """
    basis, local_light = solution.basis, _local_light(solution, place)
    if luminance(np.array(place.painted)) < luminance(np.array(place.reached)):
        part, enough = luminance(local_light * solution.weights), DOES_MUCH
        whole = np.full(len(part), part.sum())
        for image in light_images(basis.lights):  # no texel alone does much
            part[image.lights] = part[image.lights].sum()
    else:
        part, enough = np.where(basis.is_fixed, 0, luminance(local_light)), GETS_THERE
        brightness = thinned(basis.planes, STEP, np.tile(LUMINANCE, (len(part), 1)))
        whole = np.array([np.percentile(x, 99) for x in brightness])
    share = np.where(whole > 0, part / np.where(whole > 0, whole, 1), 0)
    names = (basis.names[k] for k in np.argsort(-share, kind="stable") if share[k] > enough)
    return tuple(names), bool(share.max() > DOES_MUCH)


def undetermined_at(
    solution: Solution, place: Place, uncertainty: Uncertainty
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the lights whose error alone may be all that is missing at a place, or too much there;
    and of those that the samples do not determine, the lights whose error may be a third of it, in
    the channel that lacks most. The others hardly reach it, however bright they are.

    A light of known weight takes no part, whatever the samples say of the others.
    """
    missing, possible = _light_of_errors(solution, place, uncertainty)
    lacking = abs(float(luminance(missing)))
    is_all = luminance(possible) >= lacking if lacking > 0 else np.zeros(len(possible), bool)
    channel = int(np.argmax(np.abs(missing)))
    is_enough = possible[:, channel] >= UNTOLD_SHARE * abs(missing[channel])
    alone, untold = (
        tuple(solution.basis.names[k] for k in np.flatnonzero(x))
        for x in (is_all, uncertainty.untold & is_enough)
    )
    return alone, untold


def _light_of_errors(
    solution: Solution, place: Place, uncertainty: Uncertainty
) -> tuple[Doubles, Doubles]:
    """Return what a place lacks, (3,), negative where it is too bright, and what the error of each
    light may bring to it or take from it, (n, 3) >= 0; both are 0 without paint there.

    Of a light that the samples do not determine, more may reach the place than they have found.
    """
    top, left, bottom, right = place.box
    box, views = (slice(top, bottom), slice(left, right)), solution.problem.views
    missed = target_light(views)[box] - solution.basis.predict(solution.weights).image[box]
    missed[at_least_mask(views)[box]] = np.maximum(missed[at_least_mask(views)[box]], 0)
    weight = solution.importance[box]
    if not weight.any():
        return np.zeros(3), np.zeros_like(solution.weights)
    # Both are means over the paint of the same pixels: of other pixels, no error explains a miss.
    missing = np.average(missed, axis=(0, 1), weights=_in_channels(weight)).astype(np.float64)
    low, high = uncertainty.interval
    is_dark = float(luminance(missing)) > 0
    errors = np.nan_to_num(high - solution.weights if is_dark else solution.weights - low)
    reaching = _local_light(solution, place, weight)
    if uncertainty.untold.any():
        untold = np.flatnonzero(uncertainty.untold)
        unseen = UNSEEN_PATHS * _light_of_paths(solution, untold) / np.count_nonzero(weight)
        reaching[untold] += unseen
    return missing, errors * reaching


def _light_of_paths(solution: Solution, lights: Indices) -> Doubles:
    """Return the light that one path of each of some lights, (k,), brings to a pixel, (k, 3), by a
    sample of the painted pixels.

    If paths find a light by chance, its variance is its mean times the light of a path. Of a light
    without noise it is 0.
    """
    basis, painted = solution.basis, np.flatnonzero(solution.importance)
    step = -(-len(painted) * len(basis.names) // PATH_SAMPLE)
    total, variance = np.zeros((2, len(lights), 3))
    if len(lights) > MAX_SINGLE_PLANES:
        for block in blocks_of(basis.planes, painted[::step]):
            light, noise = (x.pixels(block)[lights] for x in (basis.planes, basis.noise))
            total += light.sum(axis=1, dtype=np.float64)
            variance += np.square(noise, dtype=np.float64).sum(axis=1)
    else:
        for row, k in enumerate(lights.tolist()):
            light, noise = (
                x.plane(k).reshape(-1, 3)[painted[::step]].astype(np.float64)
                for x in (basis.planes, basis.noise)
            )
            total[row], variance[row] = light.sum(axis=0), np.square(noise).sum(axis=0)
    return np.asarray(np.divide(variance, total, out=np.zeros_like(total), where=total > 0))


def _local_light(solution: Solution, place: Place, weight: Floats | None = None) -> Doubles:
    """Return the mean light of each light at a place, at unit emission, (n, 3).

    weight: (h, w), of its pixels; None for equal weights.
    """
    top, left, bottom, right = place.box
    rows = solution.basis.planes.rows(top, bottom)[:, :, left:right].astype(np.float64)
    weights = None if weight is None else np.broadcast_to(_in_channels(weight), rows.shape)
    return np.asarray(np.average(rows, axis=(1, 2), weights=weights), np.float64)


def _in_channels(weight: Floats) -> Floats:
    """Return the weight of pixels, (h, w), in each channel, (h, w, 3)."""
    return np.repeat(weight[..., None], 3, axis=2)


@dataclass(frozen=True)
class UnpaintedChange:
    """The change of the unpainted part of the picture, in CIEDE2000.

    Attributes:
        delta_e: Its mean over all unpainted pixels.
        worst: Its mean over the object, or the ninth of the picture, that changes most.
        object: The name of that object; "" without a name.
        region: Row and column of that ninth, 0 to 2, if there is no object.
    """

    delta_e: float
    worst: float
    object: str = ""
    region: tuple[int, int] = (1, 1)


def change_from_scene(
    solution: Solution, look: PaintComparison, weights: Doubles, picture: Floats
) -> UnpaintedChange | None:
    """Return the change of unpainted pixels from the current scene; None if they may change freely.

    solution: has the painting and the constraints. look: at the painting. picture: (h, w, 3)
    linear, under lights of weights (n, 3). Both pictures are sums of the same planes, so noise does
    not count as change. Lights fixed by the user are fixed in both.
    """
    [target], basis = solution.problem.views.targets, solution.basis
    if not target.over_look or target.everything:
        return None
    kinds = ConstraintsByLight.of(solution.problem.constraints, basis.lights).kinds()
    reference_weights = basis.current_weights.copy()
    for kind in FIXING_KINDS:
        fixed_lights = list(kinds.get(kind, ()))
        reference_weights[fixed_lights] = weights[fixed_lights]
    is_current = np.array_equal(reference_weights, basis.current_weights)
    now = basis.current_look if is_current else basis.mix(reference_weights)
    return unpainted_change(look, basis, target.importance > 0, now, picture)


def unpainted_change(
    look: PaintComparison, basis: Basis, painted: Bools, before: Floats, after: Floats
) -> UnpaintedChange | None:
    """Return the difference of two pictures over the unpainted part; None if all is painted.

    look: at the painting. painted: (h, w). before, after: (h, w, 3) linear, the two pictures.
    """
    compared = (slice(None, None, look.step), slice(None, None, look.step))
    rest = ~painted[compared]
    if not rest.any():
        return None
    labs = (look.lab(x[compared][rest].astype(np.float64)) for x in (before, after))
    difference = ciede2000(*labs)
    worst, name, region = _worst(basis, compared, rest, difference)
    return UnpaintedChange(float(difference.mean()), worst, name, region)


def _worst(
    basis: Basis, compared: tuple[slice, slice], rest: Bools, difference: Doubles
) -> tuple[float, str, tuple[int, int]]:
    """Return the largest mean of `difference` over one place: its ΔE, object and region."""
    rows, columns = (REGIONS * np.arange(n) // n for n in rest.shape)
    ninth = (REGIONS * rows[:, None] + columns[None, :])[rest]
    enough = MIN_PLACE * rest.size
    worst_region, most = _largest_mean(ninth, difference, REGIONS**2, enough)
    region = (worst_region // REGIONS, worst_region % REGIONS)
    objects = basis.objects
    if objects is None:
        return most, "", region
    has_name = np.array([not NO_NAME.fullmatch(name) for name in objects.names], dtype=bool)
    index = objects.index[compared][rest].astype(np.int64)
    has_object = index >= 0
    if not (has_object.any() and has_name.any()):
        return most, "", region
    worst_object, mean = _largest_mean(
        index[has_object], difference[has_object], len(has_name), enough, has_name
    )
    return (mean, objects.names[worst_object], region) if mean > 0 else (most, "", region)


def _largest_mean(
    index: Indices, values: Doubles, count: int, enough: float, among: Bools | None = None
) -> tuple[int, float]:
    """Return which of `count` places has the largest mean, and that mean.

    index, values: (p,), the place of each pixel, and its value. enough: pixels that a place must
    have. among: (count,), places that may be named; None for all.
    """
    sizes = np.bincount(index, minlength=count)
    means = np.bincount(index, weights=values, minlength=count) / np.maximum(sizes, 1)
    means = np.where((sizes >= enough) & (True if among is None else among), means, 0)
    best = int(np.argmax(means))
    return best, float(means[best])
