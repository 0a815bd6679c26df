"""In exports a light whose colour the painting does not tell keeps that of the scene."""

from typing import Any

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from lightpaint.colour.color import luminance
from lightpaint.lighting.answer.lighting import Lighting, LightSetting
from lightpaint.relit.formats import UNBOUNDED, with_own_colors

OWN = (3.0, 2.5, 2.0)

AMOUNT = st.floats(0.01, 10)
THREE = st.tuples(AMOUNT, AMOUNT, AMOUNT)


def light(emission: Any, interval: Any, **fields: Any) -> Lighting:
    rgb = tuple(map(float, emission))
    setting = LightSetting(
        "window", "area", "radiance", "W/(m² sr)", rgb, rgb, interval=interval, **fields
    )
    return Lighting((setting,))


def own(lighting: Lighting, current: Any = OWN) -> tuple[Any, tuple[str, ...]]:
    own_lighting, names = with_own_colors(lighting, {"window": current})
    return np.array(own_lighting["window"].emission), names


def test_a_blue_window_that_nothing_tells_keeps_its_own_colour() -> None:
    blue = light((0, 0, 4.0), ((0.0, 2.0), (0.0, 1.5), (0.2, 22.0)))
    rgb, names = own(blue)
    assert names == ("window",)
    np.testing.assert_allclose(rgb / rgb[0], np.array(OWN) / OWN[0])
    np.testing.assert_allclose(luminance(rgb), 4 * 0.0722)


def test_what_the_painting_tells_stays() -> None:
    blue = (0, 0, 4.0)
    for interval in (
        ((0.0, 0.1), (0.0, 0.1), (3.9, 4.1)),  # short
        ((0.0, 0.1), (0.0, 0.1), (1.0, 9.0)),  # long, and of no white
        (None, (0.0, 1.5), (0.2, 22.0)),  # nothing is known of a channel
        None,
    ):
        rgb, names = own(light(blue, interval))
        assert (rgb.tolist(), names) == ([0, 0, 4], ())
    wide = ((0.0, 2.0), (0.0, 1.5), (0.2, 22.0))
    assert own(light(blue, wide, constraint="color #0000ff"))[1] == ()
    assert own(light(blue, wide), current=(0, 0, 0))[1] == ()
    assert own(light((6, 5, 4), ((0, 20), (0, 20), (0, 20))))[1] == ()  # its own already


@given(THREE, THREE, THREE, THREE)
def test_what_it_gets_lies_between_the_ends_in_its_own_colour(
    emission: Any, current: Any, below: Any, above: Any
) -> None:
    rgb_values = np.array(emission)
    low, high = np.maximum(rgb_values - below, 0), rgb_values + above
    rgb, names = own(light(emission, tuple(zip(low, high, strict=True))), current=current)
    assume(names)
    assert max(high - low) > UNBOUNDED * rgb_values.max()
    assert (rgb >= low * (1 - 1e-9)).all()
    assert (rgb <= high * (1 + 1e-9)).all()
    np.testing.assert_allclose(rgb * current[0], np.array(current) * rgb[0], rtol=1e-9)
