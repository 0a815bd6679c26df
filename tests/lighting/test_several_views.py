"""Several views as one problem, without a renderer (tests/test_views.py has one)."""

from dataclasses import replace
from typing import Any

import pytest

from lightpaint.errors import BasisError
from lightpaint.lighting.joined_views import check_same_lights, joint_basis


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"is_scalar": True}, "one weight for all channels in the basis of sensor"),
        ({"emission": (0.5, 0.25, 0.125)}, "has the emission 0.5 0.25 0.125 in the basis"),
        ({"unit": "W/sr"}, "has the unit W/sr in"),
        ({"members": ("x", "y")}, "has the members x, y in"),
        ({"is_fixed": True, "emission": (1, 1, 1)}, "has no weight of its own in"),
    ],
    ids=lambda x: next(iter(x)) if isinstance(x, dict) else "",
)
def test_lights_that_are_not_the_same_are_refused(
    make_basis: Any, change: dict[str, Any], words: str
):
    """The first basis would speak for all: a colour for a light that has only a dimmer."""
    basis = make_basis(2)
    other = replace(basis, lights=(replace(basis.lights[0], **change), basis.lights[1]))
    check_same_lights(basis, make_basis(2))
    for pair in ((other, basis), (basis, other)):
        with pytest.raises(BasisError, match="light 'light 0' has"):
            joint_basis(pair)
    with pytest.raises(BasisError, match=words):
        joint_basis((other, basis))
