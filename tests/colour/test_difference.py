"""CIEDE2000 against published numbers and colour-science."""

import subprocess
import sys
from typing import Any

import numpy as np
import pytest

from lightpaint.colour.color import ciede2000, delta_e, lab
from lightpaint.colour.primaries import REC709, colour_science, rgb_to_xyz


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        # Sharma, Wu, Dalal 2005, Table 1.
        ((50, 2.5, 0), (73, 25, -18), 27.1492),
        ((50, 2.5, 0), (61, -5, 29), 22.8977),
        ((50, 2.5, 0), (56, -27, -3), 31.9030),
        ((50, 2.5, 0), (58, 24, 15), 19.4535),
        ((50, 2.5, 0), (50, 3.1736, 0.5854), 1.0000),
        ((50, 2.5, 0), (50, 3.2972, 0.0000), 1.0000),
        ((50, 2.5, 0), (50, 1.8634, 0.5757), 1.0000),
        ((50, 2.5, 0), (50, 3.2592, 0.3350), 1.0000),
    ],
)
def test_ciede2000_against_published_pairs(first: Any, second: Any, expected: float):
    # Published to four digits.
    a, b = np.array(first, float), np.array(second, float)
    assert ciede2000(a, b) == pytest.approx(expected, abs=5e-5)
    assert ciede2000(b, a) == pytest.approx(expected, abs=5e-5)


def test_ciede2000_against_colour_science():
    """All over L*a*b*, near and far apart, with greys and opposite hues."""
    rng = np.random.default_rng(3)
    low, high = [0, -100, -100], [100, 100, 100]
    a, b = rng.uniform(low, high, (2, 4000, 3))
    b[:1000] = a[:1000] + rng.normal(0, 1, (1000, 3))
    b[1000:1100, 1:], b[1100:1200, 1:] = -a[1000:1100, 1:], 0
    expected = colour_science().delta_E(a, b, method="CIE 2000")
    np.testing.assert_allclose(ciede2000(a, b), expected, rtol=0, atol=1e-9)


def test_lab_and_the_difference_of_light_against_colour_science():
    colour, rng = colour_science(), np.random.default_rng(4)
    a, b = rng.random((2, 4000, 3))
    expected = [colour.XYZ_to_Lab(x @ rgb_to_xyz(REC709).T) for x in (a, b)]
    np.testing.assert_allclose(lab(a), expected[0], rtol=0, atol=1e-9)
    distances = colour.delta_E(*expected, method="CIE 2000")
    np.testing.assert_allclose(delta_e(a, b), distances, rtol=0, atol=1e-9)


def test_the_library_is_not_waited_for():
    """colour-science takes a second to import."""
    code = (
        "import sys, numpy as np; from lightpaint.colour.color import delta_e; "
        "delta_e(np.zeros(3), np.ones(3)); sys.exit('colour' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_equal_images_do_not_differ():
    image = np.random.default_rng(0).random((4, 5, 3)) * 2 - 0.5
    difference = delta_e(image, image.copy())
    assert difference.shape == (4, 5)
    np.testing.assert_array_equal(difference, 0)


def test_what_a_display_cannot_show_does_not_differ():
    a, b = np.array([[[1.0, 0.0, 0.5]]]), np.array([[[9.0, -3.0, 0.5]]])
    np.testing.assert_array_equal(delta_e(a, b), 0)


def test_black_against_white_is_a_hundred():
    # ΔL* is 100; S_L at the mean lightness of 50 is 1.
    assert delta_e(np.zeros(3), np.ones(3)) == pytest.approx(100, abs=1e-9)
