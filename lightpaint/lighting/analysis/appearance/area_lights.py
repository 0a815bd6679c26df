"""The lights of a part of the picture: whether one lights it alone, what else they light, and which
went down only to make up for what others spill on unpainted parts.

A light's share s of the present light is compared, in the mean over the part and over the rest of
the picture, so that dark and pale surfaces count alike. The ratio of both means does not depend on
the strength of the light.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Bools, Doubles, Floats, Indices
from lightpaint.basis import Basis, thinned
from lightpaint.colour import LUMINANCE, luminance
from lightpaint.images import Objects
from lightpaint.lighting.analysis.appearance.display_difference import NO_NAME, object_with_most
from lightpaint.lighting.constraints.light_constraints import SINGLE_LIGHT_KINDS, ConstraintsByLight
from lightpaint.lighting.loss.lit_pixels import LitPixels
from lightpaint.lighting.loss.painting import unpainted_weight_of
from lightpaint.lighting.loss.painting_loss import PaintingLoss
from lightpaint.lighting.normal_equations import NormalEquations
from lightpaint.lighting.problem import Problem
from lightpaint.lighting.solution import Solution

#: Ratio of a light's share in a part to its share in the rest from which it lights the part alone.
ALONE = 3.0

#: Share of a part that such lights have to cover: (mean of s)² / mean of s².
MIN_COVERED = 0.25

#: Part of what the first light has from which another light is named, too.
MIN_NAMED = 0.4

#: Share of the light in a part that another object must have to be named as lit, too, and its least
#: share of the picture.
MIN_ALSO, MIN_SIZE = 0.2, 0.01

#: Part of the brightest light that counts as present light where it is dark.
DARK = 0.01

#: Step between pixels, along each side.
STEP = 2

#: Share of its present luminance below which a light counts as down: two stops.
DOWN = 1 / 4

#: Share of its present luminance that the paint alone would leave a light that is down for the
#: rest.
PAINTED_LEVEL = 1 / 2

#: Share of a light's power that is round-off.
ROUND_OFF = 1e-9


@dataclass(frozen=True)
class AreaLights:
    """The lights of a part of the picture.

    Attributes:
        names: One or two lights that light the part more than the rest; without any, those with
            most of its light.
        is_alone: Whether they light the part more than the rest.
        name: The object that the part is; "" if it is not a single one.
        also: The object of the rest that they light most; "" without a name.

    Examples:
        >>> AreaLights(("sky",), is_alone=False, name="back_wall", also="plinths").is_alone
        False
    """

    names: tuple[str, ...]
    is_alone: bool
    name: str = ""
    also: str = ""


@dataclass(frozen=True)
class _Light:
    """A light's shares of the present light.

    inside, outside: means over the part and the rest. shares: (p,), in the pixels of the part.
    objects: (objects,), sums over the rest on each object.
    """

    index: int
    inside: float
    outside: float
    shares: Doubles
    objects: Doubles

    def ratio(self) -> float:
        """Return how much more of the part's light it is than of the rest's."""
        return self.inside / max(self.outside, 1e-12)

    def strength(self) -> float:
        """Return its share of the light in the part."""
        return self.inside


def lights_of_area(basis: Basis, area: Floats) -> AreaLights | None:
    """Return the lights of a part of the picture; None without light there, or without a rest.

    area: (h, w) from 0 to 1.
    """
    pixels = _Pixels.of(basis, area)
    if not (pixels.area.any() and pixels.rest.any()):
        return None
    strongest: list[_Light] = []
    alone: list[_Light] = []
    for light in pixels.lights(basis):
        if light.ratio() >= ALONE:
            alone.append(light)
        strongest = sorted([*strongest, light], key=lambda x: -x.inside)[:2]
    covered = sum((light.shares / light.inside for light in alone), np.zeros(len(pixels.area)))
    is_alone = bool(alone) and _covered(covered, pixels.area) >= MIN_COVERED
    rank = _Light.ratio if is_alone else _Light.strength
    if not (alone or strongest):
        return None
    first, *others = sorted(alone if is_alone else strongest, key=rank, reverse=True)
    lights = [first, *(light for light in others[:1] if rank(light) >= MIN_NAMED * rank(first))]
    names = tuple(basis.names[light.index] for light in lights)
    return AreaLights(names, is_alone, *_object_names(basis, area, pixels, lights))


@dataclass(frozen=True)
class _Pixels:
    """The compared pixels that show no emitter.

    counts: (h', w'), which they are. area, rest: (p,), their part and the rest, from 0 to 1. now:
    (p,), the present light. objects: (p,), indices of objects, 0 for none.
    """

    counts: Bools
    area: Doubles
    rest: Doubles
    now: Doubles
    objects: Indices

    @staticmethod
    def of(basis: Basis, area: Floats) -> "_Pixels":
        counts = np.logical_not(_every_other(basis.emitters_seen))
        inside = _every_other(area)[counts].astype(np.float64)
        now = luminance(_every_other(basis.current_look))[counts].astype(np.float64)
        dark = DARK * float(np.percentile(now, 99)) if now.size else 0.0
        objects = np.zeros(len(now), np.intp)
        if basis.objects is not None:
            objects = _every_other(basis.objects.index)[counts].astype(np.intp) + 1
        return _Pixels(counts, inside, 1 - inside, now + max(dark, 1e-12), objects)

    def lights(self, basis: Basis) -> Iterator[_Light]:
        """Return the shares of each adjustable light that shines in the part."""
        count = 1 + (0 if basis.objects is None else len(basis.objects.names))
        current = basis.current_weights
        factors = LUMINANCE * np.where(current.any(axis=1, keepdims=True), current, 1)
        for k, light in enumerate(thinned(basis.planes, STEP, factors)):
            if basis.is_fixed[k]:
                continue
            share = light[self.counts] / self.now
            inside = float(np.average(share, weights=self.area))
            if inside > 0:
                outside = float(np.average(share, weights=self.rest))
                sums = np.bincount(self.objects, share * self.rest, count).astype(np.float64)
                yield _Light(k, inside, outside, share, sums)


def _every_other(picture: npt.NDArray[Any]) -> npt.NDArray[Any]:
    return picture[::STEP, ::STEP]


def _covered(shares: Doubles, weights: Doubles) -> float:
    """Return the share of a part over which light is spread, from 0 to 1."""
    square = float(np.average(np.square(shares), weights=weights))
    return float(np.average(shares, weights=weights)) ** 2 / square if square > 0 else 0.0


def _object_names(
    basis: Basis, area: Floats, pixels: _Pixels, lights: list[_Light]
) -> tuple[str, str]:
    """Return the object that an area is, and the object of the rest that lights light most."""
    objects: Objects | None = basis.objects
    if objects is None:
        return "", ""
    index = objects.index.ravel().astype(np.intp)
    name = object_with_most(objects, index, area.ravel().astype(np.float64))
    sizes = np.bincount(pixels.objects, weights=pixels.rest, minlength=len(objects.names) + 1)
    inside = sum(light.inside for light in lights)
    shares = np.sum([light.objects for light in lights], axis=0) / np.maximum(sizes, 1e-12)
    is_named = [False, *(not NO_NAME.fullmatch(x) and x != name for x in objects.names)]
    shares = np.where(is_named & (sizes >= MIN_SIZE * len(pixels.area)), shares, 0)
    most = int(np.argmax(shares))
    return name, objects.names[most - 1] if shares[most] >= MIN_ALSO * inside else ""


def compensating_lights(solution: Solution) -> tuple[str, ...]:
    """Return the names of lights that are down by two stops or more for unpainted parts alone.

    Where nothing is painted they would have to be darker, and the paint would not: it asks for more
    of them, or does not see them. Lights with constraints of their own are left out. solution: of
    one view; if it is part of one of several views, the paint is the paint of all of them.
    """
    whole = solution.whole or solution
    problem, weights = whole.problem, whole.weights
    unpainted = unpainted_weight_of(problem.views, problem.fit)
    reference = np.asarray(luminance(problem.reference), np.float64)
    level = luminance(weights) / np.where(reference > 0, reference, 1)
    down = np.flatnonzero((reference > 0) & (level < DOWN) & ~_constrained(problem))
    if unpainted <= 0 or not down.size:
        return ()
    rest = _rest_equations(problem, weights, unpainted)
    wanted = -(problem.equations.gradient(weights) * problem.reference).sum(axis=1)
    wanted_by_rest = -(rest.gradient(weights) * problem.reference).sum(axis=1)
    by_paint = wanted - wanted_by_rest
    power, rest_power = (
        np.einsum("cii,ic->i", x.M, np.square(problem.reference)) for x in (problem.equations, rest)
    )
    seen = power - rest_power  # in the paint
    # The level that the paint alone would give this light, all others as they are.
    alone = level + by_paint / np.where(seen > 0, seen, np.inf)
    for_rest = (wanted_by_rest < 0) & ((alone >= PAINTED_LEVEL) | (seen <= ROUND_OFF * power))
    return tuple(problem.lights.names[k] for k in down if for_rest[k])


def _constrained(problem: Problem) -> Bools:
    """Return, (n,), which lights have constraints of their own, or may be left out."""
    constraints, lights = problem.constraints, problem.lights
    is_constrained = np.array([light.is_fixed for light in lights], dtype=bool)
    kinds = ConstraintsByLight.of(constraints, lights).kinds()
    # Emitters can be off, as lights without them can.
    for kind in {*SINGLE_LIGHT_KINDS, "tie", "sparse"} - {"emitters"}:
        is_constrained[list(kinds.get(kind, ()))] = True
    return is_constrained


def _rest_equations(problem: Problem, weights: Doubles, unpainted: float) -> NormalEquations:
    """Return the squares of unpainted pixels alone, at the picture of weights (n, 3).

    unpainted: the weight of each of them.
    """
    views = problem.views
    importance = views.join(
        [
            np.where(basis.emitters_seen, 0, unpainted * np.maximum(1 - target.importance, 0))
            for basis, target in zip(views.bases, views.targets, strict=True)
        ]
    )
    look = problem.basis.current_look
    held = PaintingLoss(
        painted=look,
        importance=importance,
        share=np.ones(importance.shape),
        current=look,
        at_least=np.zeros(look.shape, bool),
        transform=problem.transform,
    )
    return LitPixels.whole(problem.basis, held).equations_at(weights)
