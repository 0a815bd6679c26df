"""The numbers of the one-pass basis: evenly spread, unrelated between dimensions, unbiased."""

import numpy as np
import pytest

from lightpaint.scene.runtime.variant import use_variant


def pairs(dimension: int, *, pixels: int = 1, first: int = 0, terms: int, stream: int = 0):
    """(pixels, terms, 2) points."""
    use_variant()
    import drjit as dr
    import mitsuba as mi

    from lightpaint.basis.render.tracer.sobol import SobolPairs

    index = dr.arange(mi.UInt32, pixels * terms)
    pixel = index // terms
    numbers = SobolPairs(pixel, mi.UInt32(stream))
    points = np.array(numbers.pair(index - pixel * terms + first, mi.UInt32(dimension)))
    return points.T.reshape(pixels, terms, 2)


@pytest.mark.parametrize("dimension", [0, 1, 7, 40])
@pytest.mark.parametrize(("first", "log_terms"), [(0, 4), (16, 4), (0, 7), (384, 7), (1 << 20, 6)])
def test_every_elementary_interval_holds_one_point(
    dimension: int, first: int, log_terms: int
) -> None:
    """The definition of a (0, m, 2)-net in base 2, whatever the scrambling."""
    [points] = pairs(dimension, first=first, terms=1 << log_terms)
    for rows in range(log_terms + 1):
        cells = np.floor(points * [1 << rows, 1 << (log_terms - rows)]).astype(int)
        cell_numbers = cells[:, 0] * (1 << (log_terms - rows)) + cells[:, 1]
        assert sorted(cell_numbers) == list(range(1 << log_terms))


def test_each_number_alone_is_uniform() -> None:
    # Of a single term, over many pixels: what makes estimates unbiased.
    points = pairs(5, pixels=40_000, first=3, terms=1)[:, 0]
    for column in points.T:
        # Its lower digits too: a choice of emitter stretches them.
        for digits in (0, 4, 8, 12):
            counts = np.histogram(column * 2**digits % 1, bins=16, range=(0, 1))[0]
            # Noise: χ² of 15 degrees of freedom exceeds 48 once in 40 000 times.
            assert np.square(counts - 2500).sum() / 2500 < 48, digits
    assert points.min() >= 0
    assert points.max() < 1


def test_dimensions_pixels_and_streams_are_unrelated() -> None:
    a = pairs(4, pixels=2000, terms=16)
    others = {
        "dimension": pairs(5, pixels=2000, terms=16),
        "pixel": np.roll(a, 1, axis=0),
        "stream": pairs(4, pixels=2000, terms=16, stream=1),
    }
    for label, b in others.items():
        for i in range(2):
            for j in range(2):
                correlation = np.corrcoef(a[..., i].ravel(), b[..., j].ravel())[0, 1]
                # Noise: five standard errors of 2 000 unrelated sets.
                assert abs(correlation) < 5 / np.sqrt(2000), (label, i, j)
