"""The locus of black bodies and matrices of primaries, held to colour-science."""

import subprocess
import sys

import numpy as np
import pytest
from patience import PATIENCE_S

from lightpaint.colour.color import (
    cct_and_duv,
    kelvin_to_rgb,
    nearest_mired,
    uv_of,
    uv_of_black_body,
    xyz_of,
)
from lightpaint.colour.primaries import REC709, SPACES, colour_science, primaries_in, rgb_to_xyz

KELVIN = np.geomspace(1000, 100_000, 60)


def test_the_locus_is_that_of_colour_science():
    expected = colour_science().temperature.CCT_to_uv_Planck1900(KELVIN)
    np.testing.assert_allclose(uv_of_black_body(KELVIN), expected, rtol=0, atol=1e-10)


def test_temperatures_are_those_of_ohno():
    """His table and its parabola are good to 1e-5 or so; ours are exact."""
    colour = colour_science()
    for kelvin in np.geomspace(1500, 20_000, 9):
        for duv in (-0.01, 0.0, 0.01):
            rgb = kelvin_to_rgb(float(kelvin), duv)
            uv = colour.UCS_to_uv(colour.XYZ_to_UCS(rgb_to_xyz(REC709) @ rgb))
            white = cct_and_duv(rgb)
            assert white is not None
            np.testing.assert_allclose(uv, uv_of(rgb_to_xyz(REC709) @ rgb), rtol=1e-12)
            expected = colour.temperature.uv_to_CCT_Ohno2013(uv)
            assert white[0] == pytest.approx(expected[0], rel=1e-4)
            assert white[1] == pytest.approx(expected[1], abs=1e-6)


@pytest.mark.parametrize("kelvin", [1000.0, 1234.5, 6504.0, 40_000.0, 100_000.0])
def test_the_nearest_that_is_tried_is_near(kelvin: float):
    [uv] = uv_of_black_body(np.array([kelvin]))
    # Newton's steps begin within one of the 400 that are tried, 1.3 % apart.
    assert nearest_mired(uv) == pytest.approx(1e6 / kelvin, rel=0.014)
    np.testing.assert_allclose(uv_of(xyz_of(uv)), uv, rtol=1e-13)
    assert xyz_of(uv)[1] == 1


@pytest.mark.parametrize("space", SPACES.values())
def test_matrices_are_those_of_colour_science(space: str):
    primaries = primaries_in(space)
    xy = np.reshape(primaries, (4, 2))
    expected = colour_science().normalised_primary_matrix(xy[:3], xy[3])
    np.testing.assert_allclose(rgb_to_xyz(primaries), expected, rtol=0, atol=1e-13)


def test_naming_a_colour_does_not_wait_for_colour_science():
    """A second of every answer."""
    code = (
        "import sys; from lightpaint.colour.color import cct_and_duv, kelvin_to_rgb; "
        "assert abs(cct_and_duv(kelvin_to_rgb(3200.0))[0] - 3200) < 1e-4; "
        "assert 'colour' not in sys.modules and 'scipy' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=PATIENCE_S)
