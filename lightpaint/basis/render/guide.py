"""Learned probabilities of sampling each emitter from each place.

A path tracer that chooses emitters at random samples most of them in vain: a spot whose cone is
elsewhere, a window behind a wall. Space is divided into cells, and each cell remembers what
its surface points received from every emitter, shadows included. The next pass draws an
emitter with a probability that follows that light, relative to what the light of that emitter does
in the whole picture, so that a faint light gets its rays where it matters as well as a
bright one. A remainder is drawn evenly: no emitter is left out anywhere, so that the mean of
every image does not depend on what has been learned.

Import it once a variant is set and not a scalar one: its arrays do not exist before.
"""

# mypy: disable-error-code="no-untyped-def, no-untyped-call"

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.basis.render.sobol import hashed

#: Share of the samples that is spread evenly over the emitters of a cell.
EVEN_SHARE = 0.1
#: Samples of emitters after which there is little left to learn: in all, and for each emitter.
ENOUGH, ENOUGH_EACH = 2**23, 2**17
#: Weight of the mean over all cells, in samples of the cell itself.
PRIOR_SAMPLES = 0.5
#: Largest ratio of a cell's distance from the camera to its width; the least is half of that.
CELLS_PER_DISTANCE = 24.0
#: Largest size of the table: entries in all, and cells.
ENTRIES, CELLS = 2**22, 2**16


class Guide:
    """Probabilities of emitters by cell, and what they are learned from.

    scene: an `mi.Scene`, whose emitters it chooses from.
    light_of: UInt32 array, the light that an emitter belongs to, by its Dr.Jit instance id.
    eye: position of the camera; cells are smaller near it.
    learned: table that `learned()` of an earlier guide returned; ignored if it is implausible.
    """

    def __init__(self, scene: Any, light_of: Any, eye: Any, learned: Floats | None = None) -> None:
        self.emitters = scene.emitters_dr()
        instances = np.array(dr.reinterpret_array(mi.UInt32, self.emitters))
        self._lights = np.array(light_of)[instances].astype(int)
        self.count = len(instances)
        self.cells = table_cells(self.count)
        self.eye = eye
        index_of = np.zeros(instances.max() + 1, np.uint32)
        index_of[instances] = np.arange(self.count)
        self._index_of = mi.UInt32(index_of)
        # Emitters that the scene never samples are not chosen; point lights among them are dark.
        self._sampled = np.array([emitter.sampling_weight() > 0 for emitter in scene.emitters()])
        shape = (2, self.cells, self.count)
        if learned is None or learned.shape != shape or not _is_sane(learned):
            learned = np.zeros(shape, np.float32)
        # In double precision the order of additions, which differs between runs, has no effect.
        self.received = mi.Float64(learned[0].ravel().astype(np.float64))
        self.asked = mi.UInt32(learned[1].ravel().astype(np.uint32))
        self._learning = True
        self.update()

    def learned(self) -> Floats:
        """Return (2, cells, emitters) float32: the light received in all, the number of samples."""
        return np.stack(
            [np.array(x).reshape(self.cells, self.count) for x in (self.received, self.asked)]
        ).astype(np.float32)

    def freeze(self) -> None:
        """Stop learning, so that later choices do not depend on what has been rendered."""
        self._learning = False
        self._learns = dr.opaque(mi.Bool, False)

    def update(self) -> None:
        """Update the probabilities by what passes have learned since the last call."""
        if not self._learning:
            return
        # Rounded as in a file, so that continuing from a file makes no difference.
        received, asked = self.learned()
        # Most cells of the table hold no surface: there the choice is even.
        known = asked.any(axis=1)
        even = np.cumsum(self._sampled, dtype=np.float32) / self._sampled.sum()
        cumulative = np.tile(even, (self.cells, 1))
        found = _probabilities(
            received[known].astype(np.float64),
            asked[known].astype(np.float64),
            self._lights,
            self._sampled,
        )
        cumulative[known] = np.cumsum(found, axis=1)
        cumulative[:, np.flatnonzero(self._sampled)[-1] :] = 1
        self._cumulative = mi.Float(cumulative.ravel())
        self._learning = bool(asked.sum() < max(ENOUGH, ENOUGH_EACH * self.count))
        self._learns = dr.opaque(mi.Bool, self._learning)
        dr.eval(self._cumulative)

    def cell(self, si):
        """Return the index of a surface point's cell, by its place and the side it is seen from."""
        # The exponent of a float is its logarithm: cells are powers of two wide.
        distance = dr.norm(si.p - self.eye) * (1 / CELLS_PER_DISTANCE)
        exponent = dr.clip(dr.reinterpret_array(mi.UInt32, distance) >> 23, 1, 252)
        per_unit = dr.reinterpret_array(mi.Float, (253 - exponent) << 23)
        x, y, z = mi.Vector3i(dr.floor(si.p * per_unit))
        normal = si.n * dr.sign(si.wi.z)
        size = dr.abs(normal)
        axis = dr.select(
            size.x > dr.maximum(size.y, size.z), 0, dr.select(size.y > size.z, 1, mi.UInt32(2))
        )
        towards = dr.select(axis == 0, normal.x, dr.select(axis == 1, normal.y, normal.z))
        key = exponent * 6 + axis * 2 + dr.select(towards > 0, 1, mi.UInt32(0))
        for coordinate, factor in ((x, 0x9E3779B1), (y, 0x85EBCA77), (z, 0xC2B2AE3D)):
            key += mi.UInt32(coordinate) * mi.UInt32(factor)
        return hashed(key) & (self.cells - 1)

    def choose(self, cell, number, active):
        """Return per path an emitter, its probability, and `number` made uniform again in it."""
        first = cell * self.count
        emitter = dr.binary_search(
            0,
            self.count - 1,
            lambda k: dr.gather(mi.Float, self._cumulative, first + k, active) <= number,
        )
        below, probability = self._share(first, emitter, active)
        return emitter, probability, dr.minimum((number - below) / probability, _BELOW_1)

    def probability(self, cell, emitter, active):
        """Return the probability with which `choose` draws `emitter`, a pointer, in `cell`."""
        instance = dr.reinterpret_array(mi.UInt32, emitter)
        index = dr.gather(mi.UInt32, self._index_of, instance, active)
        return self._share(cell * self.count, index, active)[1]

    def _share(self, first, emitter, active):
        """Return (lower end, length) of an emitter's share of the unit interval."""
        above = dr.gather(mi.Float, self._cumulative, first + emitter, active)
        below = dr.gather(mi.Float, self._cumulative, first + emitter - 1, active & (emitter > 0))
        return below, above - below

    def learn(self, cell, emitter, contribution, *, asked, lit):
        """Record the light that `emitter` contributed to the picture from `cell`.

        contribution: RGB, not divided by the probability of the emitter.
        """
        entry = cell * self.count + emitter
        asked, lit = asked & self._learns, lit & self._learns
        dr.scatter_add(self.asked, mi.UInt32(1), entry, asked)
        gray = dr.mean(contribution)
        dr.scatter_add(self.received, mi.Float64(gray), entry, lit & dr.isfinite(gray))


_BELOW_1 = 1 - 2**-24


def _is_sane(learned: Floats) -> bool:
    return bool(np.isfinite(learned).all() and learned.min() >= 0 and learned.max() < 2**32)


def table_cells(emitters: int) -> int:
    """Return the number of cells, a power of two, for that many emitters."""
    return int(2 ** np.floor(np.log2(np.clip(ENTRIES / emitters, 1, CELLS))))


def _probabilities(
    received: npt.NDArray[np.float64],
    asked: npt.NDArray[np.float64],
    lights: npt.NDArray[np.int_],
    sampled: npt.NDArray[np.bool_],
) -> npt.NDArray[np.float64]:
    """Return (cells, emitters) probabilities, from the received light and the number of samples.

    lights: the light of each emitter; sampled: whether it may be chosen at all.
    """
    even = sampled / sampled.sum()
    everywhere = received.sum(axis=0) / np.maximum(asked.sum(axis=0), 1)
    mean = (received + PRIOR_SAMPLES * everywhere) / (asked + PRIOR_SAMPLES)
    visits = asked.sum(axis=1, keepdims=True)
    whole = np.bincount(lights, (mean * visits).sum(axis=0))[lights]
    wanted = sampled * mean / np.where(whole > 0, whole, 1)
    total = wanted.sum(axis=1, keepdims=True)
    wanted = np.where(total > 0, wanted / np.where(total > 0, total, 1), even)
    return np.asarray((1 - EVEN_SHARE) * wanted + EVEN_SHARE * even)
