"""Low-discrepancy numbers instead of random ones: scrambled Sobol' points, in pairs.

The samples of a pixel are terms of one sequence. Every 2^k consecutive terms, starting at a
multiple of 2^k, cover the unit square evenly (a (0, 2)-sequence), and each pass continues where the
previous one stopped. Pixels, halves and dimensions are shuffled and scrambled independently
(Burley, "Practical Hash-based Owen Scrambling", JCGT 2020). Every single number is uniform, so
estimates stay unbiased.

Import this module after setting a Dr.Jit variant, since its array types do not exist before.
"""

# mypy: disable-error-code="no-untyped-def, no-untyped-call"

import drjit as dr
import mitsuba as mi

#: Indices of the pairs that a path uses before its first vertex, and number of pairs per vertex.
FILM, APERTURE, TIME, FIRST_VERTEX = range(4)
PAIRS_PER_VERTEX = 3


class SobolPairs:
    """The numbers of many pixels, in which each sample of a pixel is one term of a sequence.

    pixel: UInt32 array. stream: index; different streams are independent. Terms are UInt32 arrays.
    """

    def __init__(self, pixel, stream):
        self._key, _ = mi.sample_tea_32(pixel, stream)

    def pair(self, term, dimension):
        """Return a pair of numbers in [0, 1) for each pixel, evenly distributed over the terms."""
        seed = hashed(self._key + dimension * mi.UInt32(0x9E3779B9))
        # Shuffling the terms decorrelates different dimensions. A shuffled term with its bits
        # reversed is already the first Sobol' dimension.
        x = _scrambled(dr.brev(term), seed)
        # The second dimension is its polynomial over GF(2) evaluated at 1 + x, block by block.
        y = mi.UInt32(x)
        for shift, low_halves in _BLOCKS:
            y ^= (y & mi.UInt32(low_halves)) << shift
        # The digital shifts must be unrelated to the scrambling seed, whose lower bits they would
        # cancel.
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
    """Apply Owen scrambling to numbers with reversed bits (Laine and Karras 2011)."""
    x = reversed_bits + seed
    for factor in (0x6C50B47C, 0xB82F1E52, 0xC7AFE638, 0x8D22F6E6):
        x ^= x * mi.UInt32(factor)
    return x


def _unit(x):
    """Return the leading 24 bits as a number in [0, 1)."""
    return mi.Float(x >> 8) * (1 / 2**24)
