"""CIEDE2000 held to colour-science, and to the pairs that are easily got wrong."""

import numpy as np
import pytest

from lightpaint.colour.color import delta_e
from lightpaint.colour.difference import ciede2000, lab
from lightpaint.colour.science import colour_science


def test_differences_are_those_of_colour_science():
    """Of colours far apart and near, of greys, of black and of blues, which turn."""
    rng = np.random.default_rng(0)
    a = rng.random((4000, 3)) ** rng.choice([1, 4], (4000, 1))
    b = np.where(rng.random((4000, 1)) < 0.5, a * rng.normal(1, 0.05, a.shape), rng.random(a.shape))
    a[:100], b[50:150] = a[:100, :1], 0
    a[200:400, :2] *= 0.1
    b = np.clip(b, 0, 1)
    colour = colour_science()
    theirs = [
        colour.XYZ_to_Lab(colour.RGB_to_XYZ(x, "ITU-R BT.709", apply_cctf_decoding=False))
        for x in (a, b)
    ]
    np.testing.assert_allclose(lab(a).T, theirs[0], rtol=0, atol=1e-10)
    expected = colour.delta_E(*theirs, method="CIE 2000")
    np.testing.assert_allclose(ciede2000(*(x.T for x in theirs)), expected, rtol=0, atol=1e-10)
    # The hue of a grey is one of round-off, and decides the sixth digit.
    np.testing.assert_allclose(delta_e(a, b), expected, rtol=0, atol=1e-5)
    coloured = (np.ptp(a, axis=1) > 1e-6) & (np.ptp(b, axis=1) > 1e-6)
    np.testing.assert_allclose(delta_e(a, b)[coloured], expected[coloured], rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        # Sharma, Wu, Dalal 2005, Table 1: means of hue across 0, hues apart by 180°, greys, dark.
        ((50, 2.6772, -79.7751), (50, 0, -82.7485), 2.0425),
        ((50, -1.3802, -84.2814), (50, 0, -82.7485), 1.0000),
        ((50, 0, 0), (50, -1, 2), 2.3669),
        ((50, 2.49, -0.001), (50, -2.49, 0.0009), 7.1792),
        ((50, 2.49, -0.001), (50, -2.49, 0.0010), 7.1792),
        ((50, 2.49, -0.001), (50, -2.49, 0.0011), 7.2195),
        ((50, 2.49, -0.001), (50, -2.49, 0.0012), 7.2195),
        ((50, -0.001, 2.49), (50, 0.0009, -2.49), 4.8045),
        ((50, -0.001, 2.49), (50, 0.0011, -2.49), 4.7461),
        ((50, 2.5, 0), (50, 0, -2.5), 4.3065),
        ((60.2574, -34.0099, 36.2677), (60.4626, -34.1751, 39.4387), 1.2644),
        ((22.7233, 20.0904, -46.694), (23.0331, 14.973, -42.5619), 2.0373),
        ((2.0776, 0.0795, -1.135), (0.9033, -0.0636, -0.5514), 0.9082),
    ],
)
def test_published_pairs(one: tuple[float, ...], other: tuple[float, ...], expected: float):
    a, b = np.array(one, float), np.array(other, float)
    assert ciede2000(a, b) == pytest.approx(expected, abs=5e-5)
    assert ciede2000(b, a) == pytest.approx(expected, abs=5e-5)
