"""What a page is told while somebody paints."""

from dataclasses import replace
from typing import Any

import pytest

from lightpaint.lighting.analysis.diagnosis import Place
from lightpaint.lighting.analysis.seen import Seen
from lightpaint.paint.told import sketched
from lightpaint.report.verdict import headline

PLACE = Place((1, 1), 0.9, (0, 0, 8, 8), (0.4, 0.4, 0.4), (0.1, 0.1, 0.1), "floor")


@pytest.mark.parametrize(
    ("missed", "about", "said"),
    [
        (
            18.0,
            {"held": ("hold",)},
            "A first step, 10 %: brighter light on the floor is missing; what you did not paint is "
            "held as it is. Paint what may change too, or let it go.",
        ),
        (
            10.0,
            {"there": ("lamp",)},
            "About half of the way, 50 %: brighter light on the floor is missing; lamp would light "
            "too much else.",
        ),
        (
            6.0,
            {"held": ("colors", "views"), "held_by_views": ("side",)},
            "Most of the way, 70 %: brighter light on the floor is missing; lamps keep their "
            "colours. The settings give them any colour.",
        ),
        (
            8.0,
            {"held": ("views",), "held_by_views": ("side",)},
            "Most of the way, 60 %: brighter light on the floor is missing; view side asks for "
            "other light.",
        ),
        (
            14.0,
            {"place": None},
            "A part of the way, 30 %. Paint what matters most, or give it more importance.",
        ),
    ],
)
def test_a_sketch_is_helped_and_not_judged(missed: float, about: Any, said: str):
    seen = replace(Seen(missed, 0.0, 20.0, PLACE), **about)
    assert sketched(seen) == said
    assert "cannot" not in said


def test_what_is_close_is_said_as_elsewhere():
    seen = Seen(2.0, 0.0, 20.0, PLACE)
    assert sketched(seen) == headline(seen)
