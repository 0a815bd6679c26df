"""The estimate of how long a search for places takes."""

import os

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpaint.placement.look_goals import PIXELS
from lightpaint.placement.search import new_light_search
from lightpaint.placement.search.new_light_search import SearchSize, usual_pace

SIZES = st.builds(SearchSize.of, st.integers(0, 60), st.integers(0, 4), st.integers(1, 2**22))


@given(SIZES)
def test_a_search_that_took_the_mean_of_its_bounds_has_the_usual_pace(size: SearchSize) -> None:
    low, high = size.seconds()
    assert 0 < low <= high
    assert size.pace_of((low * high) ** 0.5) == pytest.approx(1)
    assert size.seconds(3.0) == pytest.approx((3 * low, 3 * high))


def test_it_grows_with_lights_and_pixels_up_to_those_of_the_small_film() -> None:
    begin = new_light_search.BEGIN_S
    assert SearchSize.of(0, 0, 100).seconds() == (begin, begin)
    low, high = (x - begin for x in SearchSize.of(3, 0, PIXELS).seconds())
    assert (low, high) == (3 * (3.5 + 4), 3 * (2 * 3.5 + 4))
    half = SearchSize.of(3, 0, PIXELS // 2).seconds()
    assert half == pytest.approx((begin + low / 2, begin + high / 2))
    assert SearchSize.of(3, 0, 50 * PIXELS).seconds() == (begin + low, begin + high)
    assert SearchSize.of(0, 2, PIXELS).seconds()[1] == begin + 2 * (2 * 12 + 4)


def test_a_busy_machine_is_slower(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    for load, pace in ((0.1, 1), (2.0, 1), (6.0, 3)):
        monkeypatch.setattr(os, "getloadavg", lambda load=load: (load, 0, 0))
        assert usual_pace() == pace

    def fail() -> None:
        raise OSError

    monkeypatch.setattr(os, "getloadavg", fail)
    assert usual_pace() == 1
