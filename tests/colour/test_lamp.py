"""Drives of lamps against scipy's linear programs, and their preferences in closed form."""

from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from lightpaint.colour.color import luminance
from lightpaint.colour.lamp import Lamp, LampEmitter

#: Linear Rec.709 of LEDs at full: all but the white are outside it.
RED, GREEN, BLUE = (11.5, -0.75, -0.13), (-3.2, 6.26, 0.02), (-0.74, 0.09, 12.4)
WHITE, AMBER, LIME = (5.73, 4.98, 4.47), (8.0, 1.2, -0.2), (2.6, 6.4, -0.5)
COLORS = (RED, GREEN, BLUE, WHITE, AMBER, LIME)

#: Drives are in float64, and snapped to their bounds within 1e-7.
SAME = 1e-6


def _lamp(colors: Any = COLORS, watts: Any = None, **fields: Any) -> Lamp:
    watts = watts or [12.0] * len(colors)
    emitters = (
        LampEmitter(f"e{k}", color, watts=power)
        for k, (color, power) in enumerate(zip(colors, watts, strict=True))
    )
    return Lamp(tuple(emitters), **fields)


def _least(lamp: Lamp, emission: Any, costs: Any) -> Any:
    """The least cost of drives that mix an emission, by scipy's linear program."""
    limits: dict[str, Any] = {}
    if lamp.power_share is not None:
        limits = {"A_ub": [lamp.powers], "b_ub": [lamp.power_share]}
    bounds = list(zip(np.zeros(len(lamp.most)), lamp.most, strict=True))
    equal = {"A_eq": lamp.columns.T, "b_eq": emission}
    return linprog(costs, **equal, bounds=bounds, **limits).fun


drives_of_six = st.lists(st.sampled_from([0.0, 0.1, 0.35, 0.7, 1.0]), min_size=6, max_size=6)
powers = st.lists(st.floats(1, 50), min_size=6, max_size=6)


@given(drives_of_six, powers, st.sampled_from([None, 0.4, 0.9]))
@settings(max_examples=60, deadline=None)
def test_the_least_power_is_that_of_a_linear_program(drives, watts, share):
    lamp = _lamp(watts=watts, power_share=share)
    asked = np.array(drives)
    if share is not None:
        asked *= min(1.0, share / max(float(asked @ lamp.powers), 1e-9))
    emission = lamp.mix(asked)
    found = lamp.drives_for(emission)
    assert ((found >= 0) & (found <= lamp.most)).all()
    assert np.allclose(lamp.mix(found), emission, atol=SAME * 12)
    assert found @ lamp.powers == pytest.approx(_least(lamp, emission, lamp.powers), abs=SAME)
    assert share is None or found @ lamp.powers <= share + SAME


@given(drives_of_six)
@settings(max_examples=40, deadline=None)
def test_the_fewest_emitters_are_those_of_all_choices(drives):
    lamp = _lamp(prefer="fewest")
    emission = lamp.mix(np.array(drives))
    found = lamp.drives_for(emission)
    assert np.allclose(lamp.mix(found), emission, atol=SAME * 12)

    def mixes(chosen: Any) -> bool:
        left_out = [k for k in range(6) if k not in chosen]
        bounds = [(0, 0) if k in left_out else (0, 1) for k in range(6)]
        equal = {"A_eq": lamp.columns.T, "b_eq": emission}
        return bool(linprog(np.zeros(6), **equal, bounds=bounds).success)

    count = next(n for n in range(7) if any(map(mixes, combinations(range(6), n))))
    assert (found > SAME).sum() <= max(count, 0)


def test_a_preference_for_white_uses_the_white_emitter():
    lamp = _lamp(COLORS[:4])
    emission = lamp.mix(np.array([0.5, 0.5, 0.5, 0.5]))
    most = -_least(lamp, emission, [0, 0, 0, -1])
    assert replace(lamp, prefer="white").drives_for(emission)[3] == pytest.approx(most, abs=SAME)


def test_three_emitters_mix_a_colour_in_one_way():
    lamp, drives = _lamp(COLORS[:3]), np.array([0.2, 0.9, 0.4])
    for prefer in ("watts", "white", "fewest"):
        assert np.allclose(replace(lamp, prefer=prefer).drives_for(lamp.mix(drives)), drives)


@pytest.mark.parametrize("colors", [(WHITE,), (WHITE, AMBER), (WHITE, WHITE), (RED, RED, BLUE)])
def test_few_or_equal_emitters_are_driven_as_well(colors):
    lamp = _lamp(colors)
    emission = lamp.mix(np.linspace(0.3, 0.8, len(colors)))
    assert np.allclose(lamp.mix(lamp.drives_for(emission)), emission, atol=SAME * 12)


def test_what_cannot_be_mixed_becomes_the_nearest_that_can():
    lamp = _lamp(COLORS[:4])
    assert not lamp.can_mix(np.array([100.0, 0, 0]))
    assert np.allclose(lamp.drives_for(np.array([11.5, -5.0, -0.13])), [1, 0, 0, 0], atol=1e-3)


def test_the_brightest_of_a_colour_is_at_a_bound():
    white = np.array(WHITE) / float(luminance(np.array(WHITE)))
    lamp = _lamp([WHITE])
    assert lamp.brightest(white) == pytest.approx(float(luminance(np.array(WHITE))))
    assert replace(lamp, power_share=0.25).brightest(white) == pytest.approx(
        float(luminance(np.array(WHITE))) / 4
    )
    assert lamp.brightest(np.array([1.0, 0, 0])) == 0
    # More emitters never make a colour darker.
    assert _lamp().brightest(white) > _lamp(COLORS[:4]).brightest(white)


def test_errors_of_drives_are_those_of_the_linear_map():
    lamp, drives = _lamp(COLORS[:3]), np.array([0.2, 0.0, 0.4])
    red, green, blue = lamp.drive_errors(drives, (0.1, 0.2, 0.3))
    assert green is None  # at its bound
    inverse = np.linalg.pinv(np.array([RED, BLUE]).T)
    expected = np.sqrt(np.square(inverse) @ np.square([0.1, 0.2, 0.3]))
    assert [red, blue] == pytest.approx(list(expected))
    assert lamp.drive_errors(drives, (0.1, None, 0.3)) == [None, None, None]


def test_levels_fill_the_bits_of_a_channel():
    assert LampEmitter("e", WHITE, bits=8).level(1.0) == 255
    assert LampEmitter("e", WHITE, bits=16).level(0.5) == 32768


def test_amber_and_lime_are_no_whites():
    lamp = _lamp(COLORS, prefer="white")
    emission = lamp.mix(np.array([0.3, 0.3, 0.3, 0.3, 0.3, 0.3]))
    found = lamp.drives_for(emission)
    most = -_least(lamp, emission, [0, 0, 0, -1, 0, 0])
    assert found[3] == pytest.approx(most, abs=SAME)
    without_white = _lamp((*COLORS[:3], AMBER, LIME))
    emission = without_white.mix(np.full(5, 0.3))
    drives = replace(without_white, prefer="white").drives_for(emission)
    assert np.allclose(drives, without_white.drives_for(emission))  # that of least power
