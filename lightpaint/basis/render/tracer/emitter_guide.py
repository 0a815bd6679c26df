"""The emitter guide: learns which emitters to sample from each region of space.

A path tracer that chooses emitters uniformly wastes most samples: on a spot whose cone points
elsewhere, or a window behind a wall. Space is divided into cells, and each cell records how much
light its surface points received from every emitter, shadows included. A path then chooses an
emitter with a probability proportional to that light, relative to the light that the emitter
contributes to the whole picture, so that a faint light gets rays where it matters just like a
bright one. A fixed share of the choices is uniform. So every emitter may be chosen everywhere, and
the mean of every image is independent of what was learned.

Light is counted in integers, whose sums do not depend on the order in which threads add.

Import this module after setting a Dr.Jit variant, since its array types do not exist before.
"""

# mypy: disable-error-code="no-untyped-def, no-untyped-call"

from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Floats
from lightpaint.basis.render.tracer.sobol import hashed

#: Share of the samples that is distributed uniformly over the emitters.
EVEN_SHARE = 0.1
#: Units in which the light of an emitter is counted: units of its mean contribution, and the
#: maximum number of units for one sample.
MEAN_UNITS, MAX_UNITS = 2.0**12, 2.0**31
#: Units of radiance 1, until something is known about an emitter.
FIRST_UNITS = 2.0**20
#: Weight of the mean over all cells, as a number of samples in the cell.
PRIOR_SAMPLES = 0.5
#: Largest ratio of a cell's distance from the camera to its width, in a table of this number of
#: cells or more; the smallest is half of that.
CELLS_PER_DISTANCE, ENOUGH_CELLS = 24.0, 2**15
#: The largest number in [0, 1).
BELOW_1 = 1 - 2**-24
#: Maximum size of the table: number of entries, and number of cells.
MAX_ENTRIES, MAX_CELLS = 2**21, 2**16


class EmitterGuide:
    """Probabilities of emitters by cell, and the records from which they are computed.

    scene: an `mi.Scene`, whose emitters are chosen.
    light_of: UInt32 array from the Dr.Jit instance id of an emitter to its light.
    eye: position of the camera; cells near it are smaller.
    table: a table from `table()` of an earlier guide, to be used unchanged. None, or an implausible
    table, starts a guide that learns from the passes that use it.
    """

    def __init__(self, scene: Any, light_of: Any, eye: Any, table: Floats | None = None) -> None:
        self.emitters = scene.emitters_dr()
        instances = np.array(dr.reinterpret_array(mi.UInt32, self.emitters))
        self._lights = np.array(light_of)[instances].astype(int)
        self.count = len(instances)
        self.cells = table_cells(self.count)
        # A scene must not have more cells on its surfaces than there are in the table: those that
        # share a place in it would mix what they learn.
        share = min(1.0, self.cells / ENOUGH_CELLS)
        self._cells_per_distance = CELLS_PER_DISTANCE * float(np.sqrt(share))
        self.eye = eye
        index_of = np.zeros(instances.max() + 1, np.uint32)
        index_of[instances] = np.arange(self.count)
        self._index_of = mi.UInt32(index_of)
        # Emitters that the scene never samples are never chosen; any point lights among them are
        # black.
        self._can_sample = np.array([emitter.sampling_weight() > 0 for emitter in scene.emitters()])
        shape = (2, self.cells, self.count)
        if table is not None and (table.shape != shape or not _is_sane(table)):
            table = None
        #: Whether it was given what an earlier guide has learned.
        self.is_trained = table is not None
        self._units = np.full(self.count, FIRST_UNITS)
        self._received_light, self._sample_counts = (
            np.zeros(shape) if table is None else table.astype(float)
        )
        self._learns = dr.opaque(mi.Bool, True)
        self._begin_counting(self.cells * self.count)
        if table is not None:
            self.freeze()
        self._set_probabilities()

    @property
    def has_choice(self) -> bool:
        """True if there is more than one emitter to choose from."""
        return bool(self._can_sample.sum() > 1)

    def table(self) -> Floats:
        """Return (2, cells, emitters) float32: received light, and numbers of samples."""
        return np.stack([self._received_light, self._sample_counts]).astype(np.float32)

    def update(self) -> None:
        """Update the probabilities from the records of a pass."""
        shape = self.cells, self.count
        new_light = np.array(self._new_light).reshape(shape).astype(float)
        new_counts = np.array(self._new_counts).reshape(shape)
        self._received_light += new_light / self._units
        self._sample_counts += new_counts
        mean = new_light.sum(axis=0) / np.maximum(new_counts.sum(axis=0), 1)
        # Powers of two, so that scaling is exact.
        units = self._units * 2.0 ** np.round(
            np.log2(MEAN_UNITS / np.maximum(mean, 1 / MEAN_UNITS))
        )
        self._units = np.clip(units, 2.0**-60, 2.0**100)
        self._begin_counting(self.cells * self.count)
        self._set_probabilities()

    def freeze(self) -> None:
        """Stop learning."""
        self._learns = dr.opaque(mi.Bool, False)
        self._begin_counting(1)

    def _begin_counting(self, entries: int) -> None:
        self._new_light = dr.zeros(mi.UInt64, entries)
        self._new_counts = dr.zeros(mi.UInt32, entries)
        self._units_of = mi.Float(self._units.astype(np.float32))

    def _set_probabilities(self) -> None:
        # Rounded as in a file, so that the result does not depend on where the training ran.
        received_light, sample_counts = self.table()
        # Most cells of the table contain no surface; there the choice is uniform.
        visited = sample_counts.any(axis=1)
        even = np.cumsum(self._can_sample, dtype=np.float32) / self._can_sample.sum()
        cumulative = np.tile(even, (self.cells, 1))
        probabilities = _probabilities(
            received_light[visited].astype(np.float64),
            sample_counts[visited].astype(np.float64),
            self._lights,
            self._can_sample,
        )
        cumulative[visited] = np.cumsum(probabilities, axis=1)
        cumulative[:, np.flatnonzero(self._can_sample)[-1] :] = 1
        self._cumulative = mi.Float(cumulative.ravel())
        dr.eval(self._cumulative)

    def cell(self, si):
        """Return the index of a surface point's cell, which depends on its position and visible
        side.
        """
        # The exponent of a float is its binary logarithm, so the widths of cells are powers of two.
        distance = dr.norm(si.p - self.eye) * (1 / self._cells_per_distance)
        exponent = dr.clip(dr.reinterpret_array(mi.UInt32, distance) >> 23, 1, 252)
        per_unit = dr.reinterpret_array(mi.Float, (253 - exponent) << 23)
        x, y, z = mi.Vector3i(dr.floor(si.p * per_unit))
        normal = si.n * dr.sign(si.wi.z)
        size = dr.abs(normal)
        axis = dr.select(
            size.x > dr.maximum(size.y, size.z), 0, dr.select(size.y > size.z, 1, mi.UInt32(2))
        )
        facing = dr.select(axis == 0, normal.x, dr.select(axis == 1, normal.y, normal.z))
        key = exponent * 6 + axis * 2 + dr.select(facing > 0, 1, mi.UInt32(0))
        for coordinate, factor in ((x, 0x9E3779B1), (y, 0x85EBCA77), (z, 0xC2B2AE3D)):
            key += mi.UInt32(coordinate) * mi.UInt32(factor)
        return hashed(key) & (self.cells - 1)

    def choose(self, cell, number, active):
        """Choose an emitter for each path. Returns its index, its probability, and `number`
        rescaled to be uniform again.
        """
        first = cell * self.count
        emitter = dr.binary_search(
            0,
            self.count - 1,
            lambda k: dr.gather(mi.Float, self._cumulative, first + k, active) <= number,
        )
        below, probability = self._share(first, emitter, active)
        return emitter, probability, dr.minimum((number - below) / probability, BELOW_1)

    def probability(self, cell, emitter, active):
        """Return the probability with which `choose` selects `emitter`, a pointer, in `cell`."""
        instance = dr.reinterpret_array(mi.UInt32, emitter)
        index = dr.gather(mi.UInt32, self._index_of, instance, active)
        return self._share(cell * self.count, index, active)[1]

    def _share(self, first, emitter, active):
        """Return the start and length of an emitter's interval within [0, 1)."""
        above = dr.gather(mi.Float, self._cumulative, first + emitter, active)
        below = dr.gather(mi.Float, self._cumulative, first + emitter - 1, active & (emitter > 0))
        return below, above - below

    def learn(self, cell, emitter, gray, *, is_sampled, lit):
        """Record the light that `emitter` contributed to the picture from `cell`.

        gray: mean of its channels, not divided by the probability of the emitter. is_sampled:
        whether the emitter was sampled at all. lit: whether its light arrived.
        """
        entry = cell * self.count + emitter
        is_sampled, lit = is_sampled & self._learns, lit & self._learns
        _count(self._new_counts, mi.UInt32(1), entry, is_sampled)
        units = gray * dr.gather(mi.Float, self._units_of, emitter, lit)
        units = mi.UInt64(mi.UInt32(dr.clip(units, 0, MAX_UNITS)))
        _count(self._new_light, units, entry, lit & dr.isfinite(gray))

    def evaluate(self) -> None:
        """Run the recorded kernels, and wait for them."""
        dr.eval(self._new_light, self._new_counts)
        dr.sync_thread()


def _count(array, value, entry, active):
    """Add to entries of an array with code that is independent of its length, unlike Dr.Jit's
    default.
    """
    dr.scatter_reduce(dr.ReduceOp.Add, array, value, entry, active, mode=dr.ReduceMode.Direct)


def _is_sane(table: Floats) -> bool:
    return bool(np.isfinite(table).all() and table.min() >= 0 and table.max() < 2**32)


def table_cells(emitters: int) -> int:
    """Return the number of cells for this number of emitters, a power of two."""
    return int(2 ** np.floor(np.log2(np.clip(MAX_ENTRIES / emitters, 1, MAX_CELLS))))


def _probabilities(
    received_light: npt.NDArray[np.float64],
    sample_counts: npt.NDArray[np.float64],
    lights: npt.NDArray[np.int_],
    can_sample: npt.NDArray[np.bool_],
) -> npt.NDArray[np.float64]:
    """Return (cells, emitters) probabilities from the received light and the numbers of samples.

    lights: the light of each emitter. can_sample: whether it may be chosen at all.
    """
    even = can_sample / can_sample.sum()
    mean_of_all = received_light.sum(axis=0) / np.maximum(sample_counts.sum(axis=0), 1)
    mean = (received_light + PRIOR_SAMPLES * mean_of_all) / (sample_counts + PRIOR_SAMPLES)
    visits = sample_counts.sum(axis=1, keepdims=True)
    whole = np.bincount(lights, (mean * visits).sum(axis=0))[lights]
    probability = can_sample * mean / np.where(whole > 0, whole, 1)
    total = probability.sum(axis=1, keepdims=True)
    probability = np.where(total > 0, probability / np.where(total > 0, total, 1), even)
    return np.asarray((1 - EVEN_SHARE) * probability + EVEN_SHARE * even)
