"""Other mixes of lamps whose emitters have a picture each, chosen after the solve, at its
brightness.

Lights of one colour and different spectra show surfaces in different colours. So of all mixes of a
lamp's colour only those count that leave the picture as it is.

There such a lamp, or several on one dimmer, is one unknown, which moves all emitters together. In
the first solve they are in the mix at full. A dimmed lamp has a choice of others, of which it
prefers one (`Lamp.drives_for`).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from lightpaint.arrays import Doubles, Floats
from lightpaint.colour import Lamp, ViewTransform, ciede2000, fidelity, lab
from lightpaint.lighting.problem import display_light, display_transform
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.unknowns.knobs import Knob
from lightpaint.lighting.unknowns.lamp_parts import WholeLamps
from lightpaint.lighting.unknowns.reduction import Reduction, lamps_by_name

#: Change of a drive, relative to full, below which two mixes count as one.
SAME = 1e-3

#: CIEDE2000 by which such choices may change the picture, in all but a share of its pixels.
HELD, SHARE_OF_PIXELS = 0.1, 0.99

#: Most pixels that are compared.
MAX_PIXELS = 2**14

#: Factor by which a step shrinks while the picture changes too much, and how often.
SHRINK, SHRINKS = 0.8, 20


def with_mixes_at(
    weights: Doubles,
    reduction: Reduction,
    lamps: Mapping[tuple[int, ...], Lamp],
    *,
    within: bool = False,
) -> Reduction:
    """Return the reduction with the mixes that lamps of one colour prefer at weights (n, 3); itself
    where these are the same.

    lamps: by the lights that are their emitters. within: whether to limit these unknowns to the
    drives that the new mixes allow, also of mixes that are the same.
    """
    knobs = tuple(_remixed(knob, weights, lamps, within=within) for knob in reduction.knobs)
    is_same = all(a is b for a, b in zip(knobs, reduction.knobs, strict=True))
    return reduction if is_same else replace(reduction, knobs=knobs)


def _remixed(
    knob: Knob, weights: Doubles, lamps: Mapping[tuple[int, ...], Lamp], *, within: bool
) -> Knob:
    """Return a knob with the mixes of its lamps at weights (n, 3)."""
    if len(knob.unknowns) != 1:
        return knob
    [unknown] = knob.unknowns
    columns = {k: float(rgb[0]) for k, rgb in unknown.columns}
    shining = [(k, x) for k, x in columns.items() if x > 0]
    level = float(weights[shining[0][0], 0]) / shining[0][1] if shining else 0.0
    change, room = 0.0, np.inf
    for parts, lamp in lamps.items():
        if level <= 0 or not columns.keys() >= set(parts):
            continue
        now = level * np.array([columns[k] for k in parts]) / lamp.levels
        drives = lamp.drives_for(lamp.mix(now))
        change = max(change, float(np.abs(drives - now).max()))
        room = min(room, lamp.room(drives))
        columns |= dict(zip(parts, (drives * lamp.levels / level).tolist(), strict=True))
    if change <= SAME and not (within and room < np.inf):
        return knob
    upper = min(unknown.upper, room * level) if within else unknown.upper
    mixed = tuple((k, np.full(3, x)) for k, x in columns.items())
    unknown = replace(unknown, columns=mixed, upper=max(upper, unknown.lower))
    return replace(knob, unknowns=(unknown,))


def choose_held_mixes(solution: Solution) -> Solution:
    """Return a solution whose lamps have their preferred mixes among those that leave the picture
    as it is, and the Rf that constraints ask for, if such a mix has it.

    Of a basis with a picture for each lamp, the mix follows from the colour instead
    (`Lamp.drives_for`), and the solution is returned unchanged.
    """
    problem = solution.problem
    whole = WholeLamps.of(problem.lights)
    if not whole.has_parts:
        return solution
    lamps = lamps_by_name(problem.constraints, whole.lights)
    has_preference = problem.constraints.prefer_emitters is not None
    chosen = [
        (parts, lamps[light.name])
        for light, parts in zip(whole.lights, whole.parts, strict=True)
        if light.name in lamps
        and (has_preference or lamps[light.name].least_rf is not None)
        and _turn_freely(solution, parts)
    ]
    if not chosen:
        return solution
    picture = _Picture.of(solution)
    weights, held_back = solution.weights.copy(), dict[int, float]()
    for count, (parts, lamp) in enumerate(chosen, 1):
        # What one lamp leaves of the change that is allowed, others may use.
        limit = HELD * count / len(chosen)
        weights, beyond = _chosen(picture, weights, parts, lamp, limit, keep=not has_preference)
        held_back |= dict.fromkeys(parts if beyond is not None else (), beyond or 0.0)
    return _with_weights(solution, weights, held_back)


def _turn_freely(solution: Solution, parts: tuple[int, ...]) -> bool:
    """Return whether the emitters of a lamp are unknowns of their own."""
    singles = {
        x.columns[0][0]
        for x in solution.problem.reduction.unknowns
        if len(x.columns) == 1 and x.upper > x.lower
    }
    return singles.issuperset(parts)


@dataclass(frozen=True)
class _Picture:
    """The picture of a solution, in some of its pixels.

    planes: (n, p, 3), of each light. transform: of the display. shown: (p, 3), L*a*b* of the
    picture.
    """

    planes: Floats
    transform: ViewTransform
    weights: Doubles
    shown: Doubles

    @classmethod
    def of(cls, solution: Solution) -> "_Picture":
        planes = solution.basis.planes
        height, width = planes.size
        step = max(1, height * width // MAX_PIXELS)
        pixels = planes.pixels(slice(None, None, step))
        transform, weights = display_transform(solution.problem), solution.weights
        return cls(pixels, transform, weights, _shown(pixels, weights, transform))

    def change(self, weights: Doubles) -> float:
        """Return the CIEDE2000 to the picture under weights (n, 3), which few pixels exceed."""
        now = _shown(self.planes, weights, self.transform)
        return float(np.quantile(ciede2000(self.shown, now), SHARE_OF_PIXELS))


def _shown(pixels: Floats, weights: Doubles, transform: ViewTransform) -> Doubles:
    return lab(display_light(np.einsum("npc,nc->pc", pixels, weights), transform))


def _chosen(
    picture: _Picture,
    weights: Doubles,
    parts: tuple[int, ...],
    lamp: Lamp,
    limit: float,
    *,
    keep: bool,
) -> tuple[Doubles, float | None]:
    """Return weights (n, 3) with the mix that a lamp prefers where the picture is held, and the
    change of the picture by the mix that it would prefer else; None if that is held as well.

    keep: whether a mix stays that has the Rf which is asked for.
    """
    places, powers = list(parts), lamp.powers_at_full
    now = weights[places, 0] / lamp.levels
    corners = lamp.mixes(lamp.mix(now))
    if len(corners) < 2 or powers is None:
        return weights, None
    if keep and lamp.least_rf is not None and fidelity(now @ powers) >= lamp.least_rf:
        return weights, None

    def moved(drives: Doubles) -> Doubles:
        new = weights.copy()
        new[places] = (drives * lamp.levels)[:, None]
        return new

    def held(drives: Doubles) -> Doubles:
        step = drives - now
        if (change := picture.change(moved(drives))) > limit:
            step *= limit / change
        for _ in range(SHRINKS):
            if picture.change(moved(now + step)) <= limit:
                return np.asarray(now + step)
            step *= SHRINK
        return now

    wanted = lamp.preferred(corners)
    change = picture.change(moved(wanted))
    if change <= limit:
        return moved(wanted), None
    found = lamp.preferred(np.array([now, *(held(x) for x in corners)]))
    return moved(held(found)), change


def _with_weights(solution: Solution, weights: Doubles, held_back: dict[int, float]) -> Solution:
    """Return a solution with other weights (n, 3) of emitters, and what others would change."""
    lights = []
    for k, (light, row) in enumerate(zip(solution.lighting.lights, weights.tolist(), strict=True)):
        emission = (row[0], row[1], row[2])
        if emission != light.weight and light.lamp is not None:
            solved = (light.emission[0] / float(light.lamp.levels[0]),)
            light = replace(light, emission=emission, weight=emission, solved_mix=solved)
        lights.append(replace(light, held_mix_change=held_back.get(k)))
    certificate = solution.certificate.with_objective(
        solution.problem.objective(weights),
        solution.norm2,
        error=solution.certificate.objective_error,
    )
    lighting = replace(solution.lighting, lights=tuple(lights)).with_certificate(certificate)
    return replace(solution, lighting=lighting)
