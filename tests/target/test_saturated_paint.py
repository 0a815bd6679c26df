"""What saturated paint asks for: at least what the rest of its layer does."""

from typing import Any

import numpy as np
import pytest

import lightpaint as lp
from lightpaint.target.painted_target import Wish
from lightpaint.target.wish_finding import extend_saturated, find_wishes

H, W = 40, 64


def look() -> np.ndarray:
    """A room with a window that is white on the display."""
    light = np.full((H, W, 3), 0.3, np.float32)
    light[12:26, 20:44] = 1.0
    return light


def painted(factor: Any, **fields: Any) -> lp.Target:
    """The look times a factor, in values up to 1."""
    image = look() * np.asarray(factor, np.float32)
    saturated = image >= 1
    return lp.Target(
        "painting",
        np.minimum(image, 1),
        np.ones((H, W), np.float32),
        everything=False,
        at_least=saturated,
        transform=lp.ViewTransform("srgb", 0.0),
        through_view=True,
        over_look=True,
        **fields,
    )


@pytest.mark.parametrize("with_layer", [True, False])
def test_a_wash_goes_on_over_what_is_white(with_layer: bool) -> None:
    wishes = (Wish("wash", np.ones((H, W), np.float32)),) if with_layer else ()
    target = painted([1.8, 1.0, 0.5], wishes=wishes)
    # The median ratio has a hundredth of the mean light added to both.
    expected = look() * [1.8, 1.0, 0.5]
    np.testing.assert_allclose(extend_saturated(target, look()), expected, rtol=0.02)


def test_it_is_never_darker_than_painted() -> None:
    """White paint in a room that was darkened asks for white."""
    target = painted(np.where(look() < 1, 0.5, 1.5))
    np.testing.assert_array_equal(extend_saturated(target, look()), target.image)


def test_what_a_file_can_hold_is_as_painted() -> None:
    target = painted(0.5)
    assert extend_saturated(target, look()) is target.image


def test_the_end_of_eight_bits_is_no_wish() -> None:
    """One wash over everything is one wish, though a white window cannot become warmer in it."""
    assert len(find_wishes(painted([2.5, 1.6, 0.8]), look())) == 1
