"""What a page is told while somebody paints."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import lightpaint as lp
from lightpaint.lighting.analysis.diagnosis import Place
from lightpaint.lighting.analysis.seen import Seen
from lightpaint.paint.told import HELP, helped, sketched, why_not_closer
from lightpaint.report.verdict import headline

PLACE = Place((1, 1), 0.9, (0, 0, 8, 8), (0.4, 0.4, 0.4), (0.1, 0.1, 0.1), "floor")


@pytest.mark.parametrize(
    ("missed", "about", "said"),
    [
        (
            18.0,
            {"held": ("hold",)},
            "A first step, 10 %: brighter light on the floor is missing; what is not painted is "
            "held near how it is. Paint what may change too, or let it go.",
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
            "Most of the way, 70 %: brighter light on the floor is missing; lamps are not "
            "free in their colour. The settings allow any colour.",
        ),
        (
            8.0,
            {"held": ("views",), "held_by_views": ("side",)},
            "Most of the way, 60 %: brighter light on the floor is missing; view side asks for "
            "other light.",
        ),
        (
            23.0,
            {"held": ("hold",)},
            "No closer than it is now: brighter light on the floor is missing; what is not "
            "painted is held near how it is. Paint what may change too, or let it go.",
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


@pytest.mark.parametrize(
    ("about", "helps"),
    [
        ({"held": ("hold",)}, "hold"),
        ({"held": ("colors", "views")}, "colors"),
        ({"held": ("views",)}, None),
        ({"held": ("constraints", "hold")}, None),  # the first reason is told alone
        ({"held": ()}, None),
        ({"held": ("hold",), "place": None}, None),
        ({"held": ("hold",), "delta_e": 2.0}, None),
    ],
)
def test_what_a_sentence_advises_is_said_as_data(about: Any, helps: str | None):
    seen = replace(Seen(10.0, 0.0, 20.0, PLACE), **about)
    assert helped(seen) == helps
    advised = [held for held, words in HELP.items() if words in sketched(seen)]
    assert advised == [one for one in (helps,) if one]


def test_what_is_close_is_said_as_elsewhere():
    seen = Seen(2.0, 0.0, 20.0, PLACE)
    assert sketched(seen) == headline(seen)


@pytest.mark.parametrize("colors", ["free", "white"])
def test_why_it_is_not_closer_is_said_to_who_paints(make_basis: Any, colors: Any):
    size = (12, 12)
    noise = np.random.default_rng(5).normal(0, 0.05, (3, *size, 3))
    basis = make_basis(3, size, half_differences=noise)
    image = np.random.default_rng(1).random((*size, 3)).astype(np.float32)
    target = lp.Target("t", image, np.ones(size, np.float32), everything=False)
    [analysis] = lp.analyse(lp.solve(basis, target, colors=colors))
    first, *rest = why_not_closer(analysis)
    assert "% no setting of these lights reaches" in first
    assert "% is grain of the samples" in first
    colours = "% would need lights of other colours or levels than they may have"
    assert (colours in first) == (colors == "white")
    said = " ".join([first, *rest])
    for word in ("energy", "basis", "renders have", "below zero", "Most of that"):
        assert word not in said
    # Where it is missed most is told once: of a whole, or of a place that is seen.
    unseen = replace(analysis, seen=replace(analysis.seen, place=None))
    assert "Most of that out of reach is" in why_not_closer(unseen)[1]
    met = replace(analysis, diagnosis=replace(analysis.diagnosis, missed=0.009))
    assert why_not_closer(met) == ["The lights can do what is painted."]
