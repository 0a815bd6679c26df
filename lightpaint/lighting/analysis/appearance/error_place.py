"""The place of a picture with most of its error: its object, and the lights that reach it."""

import re
from collections import Counter

import numpy as np

from lightpaint.arrays import Doubles, Indices, as_rgb
from lightpaint.basis import light_images, thinned
from lightpaint.colour import LUMINANCE, ciede2000, luminance
from lightpaint.images import Objects
from lightpaint.lighting.analysis.appearance.display_difference import PaintComparison
from lightpaint.lighting.analysis.diagnosis import (
    REGIONS,
    Place,
)
from lightpaint.lighting.analysis.noise.uncertainty import Uncertainty
from lightpaint.lighting.solution import Solution

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
    region = np.zeros((REGIONS, REGIONS))
    regions_of = [REGIONS * np.arange(length) // length for length in amount.shape]
    np.add.at(region, np.ix_(*regions_of), amount)
    worst = np.unravel_index(int(np.argmax(region)), region.shape)
    inside = (regions_of[0] == worst[0])[:, None] & (regions_of[1] == worst[1])
    row, column = np.unravel_index(int(np.argmax(np.where(inside, amount, -1))), amount.shape)
    # Paint and answer there, weighted by the error.
    error_weights = np.where(inside, amount, 0)
    painted, reached = (
        np.average(look.in_blocks(x).reshape(-1, 3), axis=0, weights=error_weights.ravel())
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


def undetermined_at(solution: Solution, place: Place, uncertainty: Uncertainty) -> tuple[str, ...]:
    """Return the lights whose error alone may be all that is missing at a place, or too much there.

    A light of known weight takes no part, whatever the samples say of the others.
    """
    low, high = uncertainty.interval
    errors = np.nan_to_num(high - low) / 2 * _local_light(solution, place)  # (n, 3)
    missed = luminance(np.abs(np.subtract(place.painted, place.reached)))
    names = solution.basis.names
    return tuple(name for name, x in zip(names, luminance(errors), strict=True) if x >= missed > 0)


def _local_light(solution: Solution, place: Place) -> Doubles:
    """Return the mean light of each light at a place, at unit emission, (n, 3)."""
    top, left, bottom, right = place.box
    rows = solution.basis.planes.rows(top, bottom)
    return np.asarray(rows[:, :, left:right].mean(axis=(1, 2), dtype=np.float64))
