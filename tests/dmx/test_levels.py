"""Levels of fixtures whose dimmer is coarser than their emitters."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpaint.dmx.console_rig import ConsoleRig, DmxChannel, RigEmitter, RigFixture, RigLight
from lightpaint.dmx.levels import decode_levels, encode_levels

NAMES = ("red", "green", "blue")

drives_of_three = st.tuples(*[st.floats(0, 1) for _ in NAMES])


def _rig(*, inverted: bool = False) -> ConsoleRig:
    """A lamp with a dimmer of one byte and three emitters of two."""
    curve = ((1.0, 0.0), (0.0, 1.0)) if inverted else ()
    channels = (
        DmxChannel("Dimmer", "Body", (1,), curve=curve),
        *(DmxChannel(f"ColorAdd_{x}", "Body", (2 * k, 2 * k + 1)) for k, x in enumerate("RGB", 1)),
    )
    emitters = tuple(RigEmitter(x, (0.3, 0.3), 100, (k,)) for k, x in enumerate(NAMES, 1))
    light = RigLight("lamp", (0, 0, 3), (0, 0, -1), (0, 1, 0), 20, 30, emitters, (0,))
    return ConsoleRig("r", (RigFixture("1", "lamp", "t", "m", {1: 1}, channels, (light,)),))


@pytest.mark.parametrize("inverted", [False, True])
@given(drives=drives_of_three)
def test_a_coarse_dimmer_costs_no_more_than_the_rounding_of_the_emitters(
    inverted: bool, drives: tuple[float, ...]
) -> None:
    rig, asked = _rig(inverted=inverted), dict(zip(NAMES, drives, strict=True))
    found = decode_levels(rig, encode_levels(rig, {"lamp": asked}))["lamp"]
    assert found == pytest.approx(asked, abs=0.51 / 65535)
