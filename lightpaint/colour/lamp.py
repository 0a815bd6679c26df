"""Lamps that mix their light from emitters, and the drives with which they mix a colour.

A stage light has four to eight kinds of LEDs, its emitters, each of which dims from 0 to 1, its
drive. Its emission is Σ dⱼ eⱼ. More than three emitters can mix most colours in many ways; a
preference chooses one of these, so that the emission stays the same (docs/method.md).

A lamp with a colour wheel has the wheel's slots for emitters, of which one shines at a time; one
that mixes its light has emitters whose light each slot filters.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import combinations, product

import numpy as np

from lightpaint.arrays import RGB, Bools, Doubles, Indices, as_rgb
from lightpaint.colour import Preference
from lightpaint.colour.color import (
    WHITE_DUV,
    cct_and_duv,
    ciede2000,
    lab_of_lights,
    luminance,
)
from lightpaint.colour.primaries import REC709, REC2020, rgb_to_xyz
from lightpaint.colour.rendering_indices import (
    MARGIN,
    MixFidelity,
    best_mix,
    cheapest_mix,
    fidelity,
)
from lightpaint.colour.spectrum import WAVELENGTHS, Spectrum

#: Most emitters of a lamp: the mixes that are compared grow exponentially with their number. Most
#: slots of a colour wheel, which mix nothing.
MAX_EMITTERS, MAX_SLOTS = 10, 40

#: Round-off of drives, relative to their range, and of a determinant relative to its columns.
ROUND_OFF, SINGULAR = 1e-7, 1e-6

#: The least colour temperature of a white emitter, in kelvin: amber LEDs are warmer.
WARMEST_WHITE = 2200.0

#: Share of the largest brightness at which no bound restricts the mixes of a colour, and steps of
#: the search for the largest at which a mix renders colours well enough.
DARK, DIMMINGS = 1e-3, 10

#: Least share of light that a filter lets through, a density of 4.
OPAQUE = 1e-4

#: Weight of the power among mixes that a preference for something else leaves equal.
SECOND = 1e-6


@dataclass(frozen=True)
class LampEmitter:
    """Light sources of one colour in a lamp, which dim together.

    emission: linear Rec.709 at full, in the unit of the light; channels may be negative, since LEDs
    lie outside Rec.709. most: the largest drive, at most 1. bits: of the channel that sets it.
    watts: power at full, if known. spectrum: of luminance 1, if known.
    """

    name: str
    emission: RGB
    most: float = 1.0
    bits: int = 8
    watts: float | None = None
    spectrum: Spectrum | None = None

    def __post_init__(self) -> None:
        if self.spectrum is not None and len(self.spectrum) != len(WAVELENGTHS):
            raise ValueError(
                f"a spectrum has {len(self.spectrum)} powers: expected {len(WAVELENGTHS)}"
            )

    def level(self, drive: float) -> int:
        """Return the level of its channel for a drive."""
        highest: int = 2**self.bits - 1
        return round(drive * highest)


@dataclass(frozen=True)
class SlotFilter:
    """A slot of a colour wheel in front of emitters that mix their light.

    transmission: the share that it lets through of red, green and blue of BT.2020, 0 to 1.
    """

    name: str
    transmission: RGB

    @property
    def is_open(self) -> bool:
        """True if it lets all light through."""
        return self.transmission == (1, 1, 1)

    def filtered(self, emission: RGB) -> RGB:
        """Return the light, linear Rec.709, that it lets through of an emission."""
        passed = np.maximum(self.transmission, OPAQUE)
        xyz = rgb_to_xyz(REC709) @ np.array(emission)
        wide = passed * np.linalg.solve(rgb_to_xyz(REC2020), xyz)
        return as_rgb(np.linalg.solve(rgb_to_xyz(REC709), rgb_to_xyz(REC2020) @ wide))


@dataclass(frozen=True)
class Lamp:
    """A lamp of several emitters.

    power_share: the largest power of all emitters together, relative to the power of all at full;
    of emitters of unknown power, the sum of their drives relative to their number.
    prefer: what to save, or use most, among mixes of the same colour.
    is_wheel: whether they are slots of a colour wheel, of which one shines at a time.
    least_rf: the fidelity index Rf that these mixes need, if they can reach it; else the highest
    counts.
    behind: the slot of a colour wheel through which its emitters shine; "" where it is open.
    """

    emitters: tuple[LampEmitter, ...]
    power_share: float | None = None
    prefer: Preference = "watts"
    is_wheel: bool = False
    least_rf: float | None = None
    behind: str = ""

    def behind_slot(self, slot: SlotFilter) -> "Lamp":
        """Return the lamp with each emitter as a slot filters it."""
        if slot.is_open:
            return replace(self, behind="")
        emitters = tuple(replace(x, emission=slot.filtered(x.emission)) for x in self.emitters)
        return replace(self, emitters=emitters, behind=slot.name)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The names of its emitters."""
        return tuple(x.name for x in self.emitters)

    @cached_property
    def columns(self) -> Doubles:
        """(e, 3), the emission of each emitter at full."""
        return np.array([x.emission for x in self.emitters], np.float64)

    @cached_property
    def levels(self) -> Doubles:
        """(e,), the luminance of each emitter at full."""
        return np.asarray(luminance(self.columns), np.float64)

    @cached_property
    def most(self) -> Doubles:
        """(e,), the largest drive of each emitter."""
        return np.array([x.most for x in self.emitters])

    @cached_property
    def powers(self) -> Doubles:
        """(e,), the power of each emitter at full, relative to the power of all."""
        watts = [x.watts for x in self.emitters]
        known = [w for w in watts if w is not None]
        powers = np.array(known if len(known) == len(watts) else [1.0] * len(watts))
        return np.asarray(powers / powers.sum())

    def mix(self, drives: Doubles) -> Doubles:
        """Return the emission (3,) for drives (e,)."""
        return np.asarray(drives @ self.columns)

    def drives_for(self, emission: Doubles) -> Doubles:
        """Return the preferred drives (e,) that mix an emission (3,); of one that it cannot mix,
        the drives of the nearest that it can. A wheel is at the slot of the closest colour.
        """
        if self.is_wheel:
            return self._drives_on_wheel(emission)
        mixes = _mixes_of(self)
        drives = mixes.values(emission)
        if not len(drives):
            drives = mixes.values(self.mix(self._nearest_drives(emission)))
        if not len(drives):  # round-off at a corner of what it can mix
            return self._nearest_drives(emission)
        return self.preferred(drives)

    def mixes(self, emission: Doubles) -> Doubles:
        """Return drives (k, e) between which lie all that mix an emission (3,); none if it cannot
        be mixed.
        """
        return _mixes_of(self).values(emission)

    def preferred(self, corners: Doubles) -> Doubles:
        """Return the drives (e,) of its preference between corners (k, e), which mix one colour."""
        # The cheapest comes first, for colours of which nothing tells how they render others.
        corners = corners[np.argsort(self._costs(corners), kind="stable")]
        if self.searches_rendering and len(corners) > 1:
            return np.array(_rendering_mix(self, tuple(map(tuple, corners.tolist()))))
        return np.asarray(corners[0])

    @property
    def searches_rendering(self) -> bool:
        """True if it counts how mixes of the same colour render others, and their spectra are
        known.
        """
        counts = self.prefer == "rf" or self.least_rf is not None
        return counts and self.powers_at_full is not None

    @cached_property
    def while_painting(self) -> "Lamp":
        """The lamp without a search for its mix."""
        prefer: Preference = "watts" if self.prefer == "rf" else self.prefer
        return replace(self, prefer=prefer, least_rf=None)

    def best_rendering(self, emission: Doubles) -> Doubles:
        """Return the drives (e,) of the highest Rf found that mix an emission (3,)."""
        return replace(self, prefer="rf", least_rf=None).drives_for(emission)

    @cached_property
    def powers_at_full(self) -> Doubles | None:
        """(e, 81), the spectrum of each emitter at full; None if one is unknown."""
        spectra = [x.spectrum for x in self.emitters if x.spectrum is not None]
        if len(spectra) < len(self.emitters):
            return None
        return np.asarray(self.levels[:, None] * np.array(spectra, np.float64))

    def distances(self, color: Doubles) -> Doubles:
        """Return how far a colour (3,) is from the colour of each emitter, (e,), in CIEDE2000 of a
        white surface.
        """
        return np.asarray(ciede2000(self._looks, lab_of_lights(color)))

    @cached_property
    def _looks(self) -> Doubles:
        return lab_of_lights(self.columns)

    def slot_for(self, color: Doubles, slots: Bools | None = None) -> int:
        """Return the place of the emitter whose colour is closest to a colour (3,); of black, the
        place of the brightest one.

        slots: (e,), those to choose from, all by default.
        """
        is_black = float(luminance(color)) <= 0
        values = -self.levels * self.most if is_black else self.distances(color)
        return int(np.argmin(values if slots is None else np.where(slots, values, np.inf)))

    def _drives_on_wheel(self, emission: Doubles) -> Doubles:
        """Return the drives of a wheel at its closest slot, as bright as an emission (3,)."""
        slot, drives = self.slot_for(emission), np.zeros(len(self.emitters))
        level = max(float(luminance(emission)), 0.0) / self.levels[slot]
        drives[slot] = min(level, self.most[slot])
        return drives

    def can_mix(self, emission: Doubles) -> bool:
        """Return whether some drives mix an emission (3,)."""
        if self.is_wheel:
            made = self.mix(self._drives_on_wheel(emission))
            return bool(np.abs(made - emission).max() <= ROUND_OFF * np.abs(emission).max())
        return len(_mixes_of(self).values(emission)) > 0

    def watts_for(self, emission: Doubles) -> float | None:
        """Return the power at which it emits (3,); None if the power of an emitter is unknown."""
        watts = [x.watts for x in self.emitters]
        known = [w for w in watts if w is not None]
        if len(known) < len(watts):
            return None
        return float(self.drives_for(emission) @ np.array(known))

    def brightest(self, color: Doubles) -> float:
        """Return the largest factor by which a colour (3,) can be mixed; 0 if it cannot be. A wheel
        shows its closest slot as bright as that.
        """
        from scipy.optimize import linprog

        if self.is_wheel:
            slot = self.slot_for(color)
            return float(self.most[slot] * self.levels[slot] / luminance(color))

        count = len(self.emitters)
        size = np.abs(color).max()
        equal = np.hstack([self.columns.T, -color[:, None]]) / size
        bounds = [(0, x) for x in self.most] + [(0, None)]
        limits = {}
        if self.power_share is not None:
            limits = {"A_ub": [[*self.powers, 0.0]], "b_ub": [self.power_share]}
        found = linprog(
            [0.0] * count + [-1.0], A_eq=equal, b_eq=np.zeros(3), bounds=bounds, **limits
        )
        return float(found.x[-1]) if found.success else 0.0

    def corners(self, least: float, most: float) -> Doubles:
        """Return emissions (k, 3) whose mixes, shares of 1 together, are all that the lamp can emit
        between two luminances, within its limit of power; none if there is no such emission.
        """
        size, powers = float(self.levels.max()), self.powers
        share = float(powers @ self.most) if self.power_share is None else self.power_share
        most = min(most, float(self.levels @ self.most))
        # What is left below a limit is one more drive, without light.
        equations = np.hstack([np.array([powers, self.levels / size]), np.eye(2)])
        limits = np.append(self.most, [share, (most - least) / size])
        right = np.array([share, most / size])
        found = [drives for _, drives in _corners(equations, limits, right, 0)]
        drives = np.concatenate(found) if most >= least else np.zeros((0, len(limits)))
        room = ROUND_OFF * np.maximum(limits, ROUND_OFF)
        fits = ((drives >= -room) & (drives <= limits + room)).all(axis=1)
        return _hull(np.clip(drives[fits, : len(self.most)], 0, self.most) @ self.columns)

    def brightest_mix(self, color: Doubles) -> tuple[Doubles, float]:
        """Return drives (e,) and the factor of a colour (3,) that they mix: the largest, or of
        those whose Rf is enough.

        Where no mix of the colour has that Rf, the drives of the best.
        """
        most = self.brightest(color) or 1.0
        if self.least_rf is None or not self.searches_rendering:
            return self.drives_for(most * color), most
        if self._renders(most * color):
            return self.drives_for(most * color), most
        low, high = DARK * most, most
        if not self._renders(low * color):
            drives = self.drives_for(low * color)
            room = self.room(drives)
            return drives * room, low * room
        for _ in range(DIMMINGS):
            middle = (low + high) / 2
            low, high = (middle, high) if self._renders(middle * color) else (low, middle)
        return self.drives_for(low * color), low

    def _renders(self, emission: Doubles) -> bool:
        """Return whether some mix of an emission (3,) has the Rf that is asked for."""
        assert self.powers_at_full is not None
        assert self.least_rf is not None
        return fidelity(self.drives_for(emission) @ self.powers_at_full) >= self.least_rf

    def room(self, drives: Doubles) -> float:
        """Return the largest factor of drives (e,) within their bounds."""
        lit = drives > 0
        room = float((self.most[lit] / drives[lit]).min(initial=np.inf))
        if self.power_share is not None:
            room = min(room, self.power_share / float(drives @ self.powers))
        return room

    def drive_errors(self, drives: Doubles, errors: Sequence[float | None]) -> list[float | None]:
        """Return the standard error of each drive for the errors of the emission's channels; None
        for a drive at 0 or at its largest, which small errors do not move, and where they are
        unknown.
        """
        inside = (drives > ROUND_OFF) & (drives < self.most * (1 - ROUND_OFF))
        unknown: list[float | None] = [None] * len(drives)
        if not inside.any() or any(x is None for x in errors):
            return unknown
        spread = np.linalg.pinv(self.columns[inside].T) ** 2 @ np.square(np.array(errors, float))
        for k, variance in zip(np.flatnonzero(inside), spread, strict=True):
            unknown[k] = float(np.sqrt(variance))
        return unknown

    def _nearest_drives(self, emission: Doubles) -> Doubles:
        """Return the drives of the nearest emission without its limit of power, dimmed into it."""
        from scipy.optimize import lsq_linear

        scale = np.abs(self.columns).max()
        bounds = np.zeros(len(self.most)), self.most
        found = lsq_linear(self.columns.T / scale, emission / scale, bounds, tol=1e-14).x
        power = float(found @ self.powers)
        if self.power_share is not None and power > self.power_share:
            found *= self.power_share / power
        return np.asarray(found)

    def _costs(self, drives: Doubles) -> Doubles:
        """Return what the preference counts against each of several mixes (k, e)."""
        power = drives @ self.powers
        if self.prefer == "fewest":
            return np.asarray((drives > ROUND_OFF).sum(axis=1) + SECOND * power)
        if self.prefer == "white" and self._whites.any():
            bright = np.where(self._whites, luminance(self.columns), 0)
            return np.asarray(SECOND * power - drives @ bright / bright.sum())
        return np.asarray(power)

    @property
    def emitter_costs(self) -> Doubles:
        """(e,), what a search counts against each emitter at full: power, or less white."""
        if self.prefer == "white" and self._whites.any():
            return self._costs(np.eye(len(self.emitters)))
        return self.powers

    @cached_property
    def _whites(self) -> Bools:
        """(e,), the emitters whose colour is a white."""
        return np.array([_is_white(x) for x in self.columns])


def _hull(points: Doubles) -> Doubles:
    """Return the hull of some points (k, 3) of which all others are mixes."""
    from scipy.spatial import ConvexHull

    if len(points) < 2:
        return points
    middle = points.mean(axis=0)
    _, sizes, axes = np.linalg.svd(points - middle, full_matrices=False)
    flat = (points - middle) @ axes[sizes > SINGULAR * sizes[0]].T
    if flat.shape[1] > 1:
        return np.asarray(points[ConvexHull(flat).vertices])
    return np.asarray(points[[flat.argmin(), flat.argmax()]] if flat.size else points[:1])


def _is_white(color: Doubles) -> bool:
    white = cct_and_duv(color)
    return white is not None and white[0] >= WARMEST_WHITE and abs(white[1]) <= WHITE_DUV


@lru_cache(1024)
def _rendering_mix(lamp: Lamp, corners: tuple[tuple[float, ...], ...]) -> tuple[float, ...]:
    """Return the drives between corners that render colours as well as a lamp needs; the first
    corner if the colour is far from white.
    """
    mixes, powers = np.array(corners), lamp.powers_at_full
    assert powers is not None
    fidelity = MixFidelity.of(powers, mixes[0])
    if fidelity is None:
        return corners[0]
    if lamp.prefer == "rf":
        return tuple(best_mix(mixes, fidelity.rf).tolist())
    assert lamp.least_rf is not None
    least = lamp.least_rf + MARGIN
    if lamp.prefer == "fewest" and (enough := fidelity.rf(mixes) >= least).any():
        return corners[int(np.argmax(enough))]
    return tuple(cheapest_mix(mixes, lamp.emitter_costs, fidelity.rf, least).tolist())


@dataclass(frozen=True)
class _Mixes:
    """The corners of the drives that mix an emission, as functions of the emission.

    A linear preference, and the fewest emitters, are at a corner: there as many drives as there are
    equations are between their bounds, and each of the others is at one of its two.
    basis: (3, r), of the emissions that can be mixed. slopes: (k, n, r); constants, (k, n): of the
    drives, and of the unused power where there is a limit. most: (n,).
    """

    basis: Doubles
    slopes: Doubles
    constants: Doubles
    most: Doubles
    count: int

    def values(self, emission: Doubles) -> Doubles:
        """Return the corners (k, e) for an emission (3,); none if it cannot be mixed."""
        inside = emission @ self.basis
        outside = emission - self.basis @ inside
        if np.abs(outside).max() > ROUND_OFF * np.abs(emission).max(initial=1e-300):
            return np.zeros((0, self.count))
        drives = self.slopes @ inside + self.constants
        room = ROUND_OFF * self.most
        fits = ((drives >= -room) & (drives <= self.most + room)).all(axis=1)
        drives = drives[fits]
        drives = np.where(drives < room, 0, np.where(drives > self.most - room, self.most, drives))
        return np.asarray(drives[:, : self.count])


@lru_cache(256)
def _mixes_of(lamp: Lamp) -> _Mixes:
    """Return the corners of a lamp, which lamps of the same kind share."""
    U, sizes, _ = np.linalg.svd(lamp.columns.T, full_matrices=False)
    basis = U[:, sizes > SINGULAR * sizes[0]]
    equations, most, right = basis.T @ lamp.columns.T, lamp.most, np.zeros(basis.shape[1])
    if lamp.power_share is not None:
        # The power that is left is one more drive, without light.
        equations = np.block(
            [[equations, np.zeros((len(equations), 1))], [lamp.powers[None], np.ones((1, 1))]]
        )
        most, right = np.append(most, lamp.power_share), np.append(right, lamp.power_share)
    corners = list(_corners(equations, most, right, basis.shape[1]))
    slopes, constants = (np.concatenate([x[k] for x in corners]) for k in range(2))
    return _Mixes(basis, slopes, constants, most, len(lamp.emitters))


def _corners(
    equations: Doubles, most: Doubles, right: Doubles, rank: int
) -> Iterator[tuple[Doubles, Doubles]]:
    """Yield slopes (k, n, rank) and constants (k, n) of all unknowns at the corners that have the
    same unknowns between their bounds.

    equations: (m, n), of which the first `rank` equal the emission and the others `right`.
    """
    rows, count = equations.shape
    sizes = np.linalg.norm(equations, axis=0)
    is_full = np.array(list(product((0.0, 1.0), repeat=count - rows)))
    for inner in combinations(range(count), rows):
        places: Indices = np.array(inner, dtype=np.intp)
        square = equations[:, places]
        if abs(np.linalg.det(square)) <= SINGULAR * np.prod(sizes[places]):
            continue
        inverse = np.linalg.inv(square)
        others = np.setdiff1d(np.arange(count), places)
        constants, slope = np.zeros((len(is_full), count)), np.zeros((count, rank))
        constants[:, others] = is_full * most[others]
        constants[:, places] = (right - constants @ equations.T) @ inverse.T
        slope[places] = inverse[:, :rank]
        yield np.broadcast_to(slope, (len(is_full), count, rank)), constants
