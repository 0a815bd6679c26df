"""Fluxes in closed form, and what a light is called in candela, lux and lumen."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpaint.colour import kelvin_to_rgb
from lightpaint.colour.luminous_flux import (
    lambertian_flux,
    photometry,
    point_flux,
    spot_flux,
)

RADIANCE, INTENSITY, IRRADIANCE = "W/(m² sr)", "W/sr", "W/m²"


def test_sphere_of_radiance_one() -> None:
    # A sphere of radius r looks from afar like a disc of radiance 1: intensity π r².
    r = 0.3
    assert lambertian_flux(4 * math.pi * r**2) == pytest.approx(4 * math.pi * (math.pi * r**2))


@given(st.floats(0.01, math.pi / 2), st.floats(0, 1))
def test_spot_against_the_integral_of_its_falloff(cutoff: float, share: float) -> None:
    beam = cutoff * share
    theta = (np.arange(20_000) + 0.5) / 20_000 * cutoff
    falloff = np.clip((cutoff - theta) / max(cutoff - beam, 1e-12), 0, 1)
    integral = 2 * np.pi * (np.sin(theta) * falloff).sum() * cutoff / 20_000
    # The midpoint rule misses the kink by a thousandth of its step at most.
    assert spot_flux(cutoff, beam) == pytest.approx(integral, rel=1e-4)


def test_spot_without_falloff_is_a_part_of_the_sphere() -> None:
    assert spot_flux(math.pi, math.pi) == pytest.approx(point_flux(), rel=1e-12)
    assert spot_flux(0.5, 0.5) == pytest.approx(2 * math.pi * (1 - math.cos(0.5)), rel=1e-12)
    assert spot_flux(0.5, 0.7) == spot_flux(0.5, 0.5)


@pytest.mark.parametrize(
    ("unit", "luminous_unit"), [(RADIANCE, "cd/m²"), (INTENSITY, "cd"), (IRRADIANCE, "lx")]
)
def test_luminous_quantities_are_the_scale_times_y(unit: str, luminous_unit: str) -> None:
    amounts = photometry((1, 2, 3), unit=unit, unit_flux=(2, 2, 2), cd_per_unit=100)
    y = 0.2126 + 2 * 0.7152 + 3 * 0.0722
    assert amounts.y == pytest.approx(y)
    assert amounts.flux_w == (2, 4, 6)
    assert amounts.luminous == pytest.approx(100 * y)
    assert amounts.luminous_unit == luminous_unit
    assert amounts.flux_lm == pytest.approx(200 * y)


def test_without_a_scale_there_are_no_units() -> None:
    amounts = photometry((1, 1, 1), unit=RADIANCE, unit_flux=(1, 1, 1))
    assert (amounts.luminous, amounts.luminous_unit, amounts.flux_lm) == (None, "", None)
    assert amounts.amounts == ("", "")
    assert set(amounts.fields()) == {"y", "hex", "cct_k", "duv", "flux_w", "flux_y"}
    assert amounts.color == "#ffffff 6504 K"


def test_a_light_that_is_off_has_no_colour() -> None:
    amounts = photometry((0, 0, 0), unit=RADIANCE, unit_flux=(1, 1, 1), cd_per_unit=5)
    assert (amounts.hex, amounts.kelvin, amounts.duv, amounts.color) == (None, None, None, "")
    assert (amounts.luminous, amounts.flux_lm) == (0, 0)


def test_a_saturated_light_has_a_colour_and_no_temperature() -> None:
    assert photometry((0, 0, 2), unit=INTENSITY).color == "#0000ff"


def test_only_whites_have_a_temperature() -> None:
    for duv, is_white in ((0.019, True), (-0.019, True), (0.021, False), (-0.021, False)):
        rgb = kelvin_to_rgb(4000, duv)
        found = photometry((float(rgb[0]), float(rgb[1]), float(rgb[2])), unit=INTENSITY)
        assert (found.kelvin is not None, found.duv is not None) == (is_white, is_white)


def test_a_multiple_has_the_colour_of_its_flux_if_it_is_known() -> None:
    amounts = photometry((2, 2, 2), unit="× as authored", unit_flux=(3, 3, 3), cd_per_unit=10)
    assert amounts.color == "#ffffff 6504 K"
    assert (amounts.luminous, amounts.flux_lm) == (None, pytest.approx(60))
    image = photometry((2, 2, 2), unit="× as authored", cd_per_unit=10)
    assert image.fields() == {"y": pytest.approx(2)}


def test_amounts_are_easy_to_read() -> None:
    amounts = photometry(
        (1, 1, 1), unit=RADIANCE, unit_flux=(0.001, 0.001, 0.001), cd_per_unit=14800
    )
    assert amounts.amounts == ("14,800 cd/m²", "14.8 lm")
