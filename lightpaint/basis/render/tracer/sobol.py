"""Low-discrepancy numbers instead of random ones: scrambled Sobol' points, in pairs.

The samples of a pixel are terms of one sequence. It is a (0, 2)-sequence: 2ᵏ terms that start at a
multiple of 2ᵏ cover the unit square evenly. Each pass continues where the one before stopped.
Pixels, halves and dimensions are shuffled and scrambled independently (Burley, "Practical
Hash-based Owen Scrambling", JCGT 2020); each number is uniform, so estimates stay unbiased.

Import this module only after a JIT variant is set: its array types do not exist before.
"""

# mypy: disable-error-code="no-untyped-def, no-untyped-call"

import drjit as dr
import mitsuba as mi

#: Pairs of numbers that a path takes before its first vertex, and at each vertex.
FILM, APERTURE, TIME, FIRST_VERTEX = range(4)
PAIRS_PER_VERTEX = 3


class SobolPairs:
    """The numbers of many pixels, whose samples are terms of sequences.

    pixel: UInt32 array. stream: other streams share nothing with this one. Terms are UInt32 arrays.
    """

    def __init__(self, pixel, stream):
        self._key, _ = mi.sample_tea_32(pixel, stream)

    def pair(self, term, dimension):
        """Return two numbers in [0, 1) per pixel, whose pairs are evenly spread over the terms."""
        seed = hashed(self._key + dimension * mi.UInt32(0x9E3779B9))
        # The terms are shuffled to decorrelate pairs of different dimensions. The reversed bits of
        # a shuffled term are the first Sobol' dimension.
        x = _scrambled(dr.brev(term), seed)
        # The second is its polynomial over GF(2) taken at 1 + x, block by block.
        y = mi.UInt32(x)
        for shift, low_halves in _BLOCKS:
            y ^= (y & mi.UInt32(low_halves)) << shift
        # These words must be unrelated to the scrambling's seed, since they would undo its lower
        # bits.
        shift_x = hashed(seed ^ 0x68BC21EB)
        shift_y = hashed(shift_x ^ 0x02E5BE93)
        return mi.Point2f(_unit(x ^ shift_x), _unit(y ^ shift_y))

    def at_vertex(self, term, depth, which):
        """Return pair `which` (below PAIRS_PER_VERTEX) of the path vertex at `depth`."""
        return self.pair(term, FIRST_VERTEX + which + depth * PAIRS_PER_VERTEX)


_BLOCKS = ((16, 0x0000FFFF), (8, 0x00FF00FF), (4, 0x0F0F0F0F), (2, 0x33333333), (1, 0x55555555))


def hashed(x):
    """Return a UInt32 in which every bit depends on all bits of `x`."""
    x = mi.UInt32(x)
    x ^= x >> 16
    x *= mi.UInt32(0x7FEB352D)
    x ^= x >> 15
    x *= mi.UInt32(0x846CA68B)
    return x ^ (x >> 16)


def _scrambled(reversed_bits, seed):
    """Scramble, as Owen does, numbers whose bits are in reversed order (Laine and Karras 2011)."""
    x = reversed_bits + seed
    for factor in (0x6C50B47C, 0xB82F1E52, 0xC7AFE638, 0x8D22F6E6):
        x ^= x * mi.UInt32(factor)
    return x


def _unit(x):
    """Return the leading 24 bits as a number in [0, 1)."""
    return mi.Float(x >> 8) * (1 / 2**24)
