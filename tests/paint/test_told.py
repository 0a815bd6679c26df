"""What a page is told while somebody paints."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import lightpaint as lp
from lightpaint.lighting.analysis.appearance.answer_appearance import Appearance
from lightpaint.lighting.analysis.appearance.area_lights import AreaLights
from lightpaint.lighting.analysis.appearance.delivery import Delivery, spoken_share
from lightpaint.lighting.analysis.appearance.display_difference import UnpaintedChange
from lightpaint.lighting.analysis.appearance.limiting_reasons import Loosening, Reason
from lightpaint.lighting.analysis.diagnosis import Place
from lightpaint.paint.protocol import Advice
from lightpaint.paint.session.session_messages import (
    ADVICE_TEXTS,
    advice,
    answer_findings,
    judge,
    preview_text,
    removable_reason,
    sketch_headline,
    unpainted_text,
    why_not_closer,
)
from lightpaint.report.diagnosis_sentences import (
    spoken_about,
    spoken_cause,
    spoken_mean_shares,
)
from lightpaint.report.verdict_sentences import headline

OFF, HOLD = Reason("off", ("annex_window",), 0.57), Reason("hold", (), 0.5)
COLORS, SIDE = Reason("colors", (), 0.5), Reason("views", ("side",), 0.4)

PLACE = Place((1, 1), 0.9, (0, 0, 8, 8), (0.4, 0.4, 0.4), (0.1, 0.1, 0.1), "floor")


@pytest.mark.parametrize(
    ("miss", "fields", "sentence"),
    [
        (
            18.0,
            {"reasons": (HOLD,)},
            "A first step (10 %). Brighter light on the floor is missing: unpainted parts are "
            "held near their current look. Paint more or loosen the hold.",
        ),
        (
            10.0,
            {"local_lights": ("lamp",)},
            "About half way (50 %). Brighter light on the floor is missing: lamp would light "
            "too much else.",
        ),
        (
            12.08,  # 39.6 %
            {"local_lights": ("lamp",)},
            "About half way (40 %). Brighter light on the floor is missing: lamp would light "
            "too much else.",
        ),
        (
            6.0,
            {"reasons": (COLORS, SIDE)},
            "Most of the way (70 %). Brighter light on the floor is missing: lights keep "
            "their colours. The settings allow any colour.",
        ),
        (
            8.0,
            {"reasons": (SIDE,)},
            "Most of the way (60 %). Brighter light on the floor is missing: view side asks for "
            "different light.",
        ),
        (
            23.0,
            {"reasons": (HOLD,)},
            "Farther from the paint than the current lighting, which undo brings back. Brighter "
            "light on the floor is missing: unpainted parts are held near their current look. "
            "Paint more or loosen the hold.",
        ),
        (
            20.0,
            {"reasons": (HOLD,)},
            "No closer than the current lighting. Brighter light on the floor is missing: "
            "unpainted parts are held near their current look. Paint more or loosen the hold.",
        ),
        (
            14.0,
            {"place": None},
            "Part of the way (30 %). Paint what matters most, or give it more importance.",
        ),
    ],
)
def test_a_sketch_is_helped_and_not_judged(miss: float, fields: Any, sentence: str):
    appearance = replace(Appearance(miss, 0.0, 20.0, PLACE), **fields)
    assert sketch_headline(appearance) == sentence
    assert "cannot" not in sentence


@pytest.mark.parametrize(
    ("verdict_fields", "helps"),
    [
        ({"reasons": (HOLD,)}, "hold"),
        ({"reasons": (COLORS, SIDE)}, "colors"),
        ({"reasons": (SIDE,)}, None),
        ({"reasons": (replace(OFF, kind="emitters"),)}, None),
        ({"reasons": (OFF, HOLD)}, "off"),  # the first reason is told alone
        ({"reasons": (replace(OFF, share=0.3),)}, "reach"),
        ({"reasons": ()}, "reach"),
        ({"reasons": (HOLD,), "place": None}, None),
        ({"reasons": (HOLD,), "delta_e": 2.0}, None),
    ],
)
def test_what_a_sentence_advises_is_said_as_data(verdict_fields: Any, helps: str | None):
    appearance = replace(Appearance(10.0, 0.0, 20.0, PLACE), **verdict_fields)
    cause, fields = removable_reason(appearance), advice(appearance)
    # Moving lights is advised where no setting is the cause.
    assert (cause and cause.kind) == (None if helps == "reach" else helps)
    assert (fields and fields.kind) == helps
    advised = [
        advice_kinds
        for advice_kinds, words in ADVICE_TEXTS.items()
        if words in sketch_headline(appearance)
    ]
    assert advised == [kind for kind in (helps,) if kind in ADVICE_TEXTS]


def test_a_button_says_what_it_lets_go_and_what_that_brings():
    appearance = replace(Appearance(10.0, 0.0, 20.0, PLACE), reasons=(OFF, HOLD))
    assert ": annex_window is switched off." in sketch_headline(appearance)
    fields = Advice("off", ("annex_window",), gain=0.57, hold=None)
    assert advice(appearance) == fields
    weaker = Loosening(0.8, 0.35, UnpaintedChange(2.0, 12.0, "annex"), (10.0, 7.4), 4.0)
    hold_reason = replace(appearance, reasons=(replace(HOLD, loosening=weaker),))
    assert advice(hold_reason) == Advice("hold", (), gain=0.35, hold=0.8, delta_e=(10.0, 7.4))
    assert spoken_cause(hold_reason.reasons[0]) == (
        "A weaker hold on unpainted parts (a hold of 0.8 instead of 4) would bring the mean ΔE "
        "from 10.0 to 7.4, and change the annex by ΔE 12."
    )
    # Of what takes several, none closes a share by itself.
    joint = replace(appearance, reasons=(replace(OFF, is_joint=True), replace(HOLD, is_joint=True)))
    advice_given = advice(joint)
    assert advice_given is not None
    assert advice_given.gain is None


SHARED = AreaLights(("sky", "skylight"), is_alone=False, name="back_wall", also="plinths")
OWN = AreaLights(("spot",), is_alone=True, name="back_wall", also="plinths")


def test_where_no_light_reaches_the_paint_alone_a_new_one_is_advised():
    """And no hold is to be loosened, which would only take the rest along."""
    weaker = Loosening(0.8, 0.35, UnpaintedChange(2.0, 12.0, "annex"), (10.0, 7.4), 4.0)
    hold = replace(HOLD, loosening=weaker)
    appearance = Appearance(10.0, 0.0, 20.0, PLACE, reasons=(hold,), area_lights=SHARED)
    assert sketch_headline(appearance) == (
        "About half way (50 %). Brighter light on the floor is missing: no light reaches it alone; "
        "sky and skylight light the plinths, too. Add a light for it, or paint the rest as well."
    )
    assert advice(appearance) == Advice("light", (), None, None)
    assert advice(replace(appearance, reasons=(), local_lights=("sky",))) == advice(appearance)
    assert advice(replace(appearance, reasons=(), undetermined_lights=("sky",))) is None
    # With a light of its own, the hold is what keeps it.
    own = replace(appearance, area_lights=OWN)
    assert "held near their current look. Paint more or loosen the hold." in sketch_headline(own)
    given = advice(own)
    assert given is not None
    assert given.kind == "hold"
    # Nor where the rest would change by more than the paint gains.
    costly = replace(weaker, unpainted_change=UnpaintedChange(3.0, 12.0, "annex"))
    assert advice(replace(own, reasons=(replace(HOLD, loosening=costly),))) == advice(appearance)
    # Once loosened, it is not advised again.
    once = replace(hold, loosening=replace(weaker, present_hold=1.3))
    again = replace(own, reasons=(once,))
    assert advice(again) == Advice("light", (), None, None)
    assert "loosen" not in sketch_headline(again)
    # What is too bright is not short of light.
    dark = replace(PLACE, painted=PLACE.reached, reached=PLACE.painted)
    assert "sky lights it too" in sketch_headline(
        replace(appearance, reasons=(), local_lights=("sky",), place=dark)
    )


def test_advice_comes_before_what_may_be_cut_off():
    vase = Delivery("Vase, +1.4 stops, warmer", 0.69, 0.47, layers=(3,), kind="layer")
    room = Delivery("Whole picture, −1.5 stops, cooler", 0.97, 0.83, layers=(1,), kind="layer")
    appearance = Appearance(
        4.4,
        0.0,
        14.0,
        PLACE,
        local_lights=("sun", "sky"),
        area_lights=OWN,
        deliveries=(vase, room),
        reasons_wish=vase.name,
    )
    text = sketch_headline(appearance)
    assert text == (
        "Vase, +1.4 stops, warmer: out of reach (brightness 69 %, colour 47 % came), since spot "
        "lights the plinths, too. More importance, or lights that move, may help. On the whole: "
        "most of the way."
    )
    # Parts of one painting, which nobody named: first what came.
    parts = [replace(x, layers=(1,), kind="wish") for x in (vase, room)]
    flat = sketch_headline(replace(appearance, deliveries=tuple(parts)))
    assert flat.startswith("Most of the way: brightness 83 %, colour 65 %. Vase")
    assert "as painted" not in flat


def test_a_sketch_speaks_of_the_wish_that_lacks_most():
    moon = Delivery("Moonlight", 0.98, 0.43, layers=(3,), kind="group")
    rim = Delivery("Rim", 0.95, None, layers=(6,), kind="layer")
    appearance = Appearance(6.0, 0.0, 20.0, PLACE, deliveries=(moon, rim), reasons=(COLORS, SIDE))
    text = (
        "Moonlight: brightness 98 %, colour 43 %, since lights keep their colours. The "
        "settings allow any colour. Rim: 95 %."
    )
    assert sketch_headline(appearance) == f"{text} On the whole: about half way."
    # A warning goes first.
    worse = replace(appearance, delta_e=23.0)
    assert sketch_headline(worse) == (
        f"Farther from the paint than the current lighting, which undo brings back. {text}"
    )
    # A painting without names says where light is missing, and how much came.
    alone = replace(appearance, deliveries=(replace(moon, name="Painting", kind="layer"),))
    assert sketch_headline(alone) == (
        "About half way: brightness 98 %, colour 43 %. Brighter light on the floor is missing: "
        "lights keep their colours. The settings allow any colour."
    )
    # The gain of one wish is not that of the preview.
    assert advice(appearance) == Advice("colors", (), gain=0.5, hold=None)
    of_part = replace(appearance, reasons_wish="Moonlight")
    assert advice(of_part) == Advice("colors", (), gain=None, hold=None)
    assert spoken_cause(COLORS, about=spoken_about(of_part)).endswith(
        "would remove 50 % of the difference in Moonlight."
    )


SHARES = st.floats(0, 1.2)


@given(st.lists(st.tuples(SHARES, SHARES), min_size=1, max_size=4), st.floats(3.5, 9))
def test_a_headline_says_no_share_but_those_that_came(shares: Any, delta_e: float):
    """Three sculptures of which 93 and 95 % came were "About half way (53 %)"."""
    wishes = tuple(
        Delivery(f"Layer {k}", a, b, layers=(k,), kind="layer") for k, (a, b) in enumerate(shares)
    )
    appearance = Appearance(delta_e, 0.0, 16.0, PLACE, local_lights=("lamp",), deliveries=wishes)
    means = spoken_mean_shares(wishes)
    came = {f"{spoken_share(x)}" for pair in shares for x in pair}
    for text in (sketch_headline(appearance), headline(appearance)):
        said = set(re.findall(r"\d+ %", text))
        assert said <= came | set(re.findall(r"\d+ %", means)), text
    # The words are those of the share that is less.
    assert appearance.progress == pytest.approx(
        min(np.mean([min(x[k], 1) for x in shares]) for k in (0, 1))
    )


def test_an_only_wish_that_no_light_brings_is_first_said_to_be_out_of_reach():
    """A wall that all lamps of a room light together, in the page and in the terminal."""
    wall = Delivery("Back wall, +1.0 stops, warmer", 0.27, 0.33, layers=(1,), kind="layer")
    for delta_e in (15.0, 9.0):  # far, and part of the way
        appearance = Appearance(
            delta_e,
            0.0,
            21.0,
            PLACE,
            reasons=(replace(HOLD, share=1.0),),
            area_lights=SHARED,
            deliveries=(wall,),
        )
        expected = (
            "Out of reach (brightness 27 %, colour 33 % came). Brighter light on the floor is "
            "missing: no light reaches it alone; sky and skylight light the plinths, too. Add a "
            "light for it, or paint the rest as well."
        )
        assert sketch_headline(appearance) == expected
        assert headline(appearance) == expected
    # Of which most came is said how far, and then what is missing.
    most = replace(appearance, deliveries=(replace(wall, brightness=0.62, color=0.61),))
    for text in (sketch_headline(most), headline(most)):
        assert text == expected.replace(
            "Out of reach (brightness 27 %, colour 33 % came)",
            "Most of the way: brightness 62 %, colour 61 %",
        )
    # With a light of its own it is the hold that keeps it.
    own = replace(appearance, area_lights=OWN)
    assert sketch_headline(own).startswith("Part of the way: brightness 27 %, colour 33 %. ")


def test_what_came_is_said_in_one_measure():
    """Page, terminal and report say it in the same words."""
    wishes = (Delivery("Painting", 0.93, 0.95),)
    appearance = Appearance(7.5, 0.0, 16.0, PLACE, local_lights=("lamp",), deliveries=wishes)
    assert sketch_headline(appearance).startswith("Nearly there: brightness 93 %, colour 95 %. ")
    assert headline(appearance).startswith("Nearly there, but ")
    # The mean over a picture may be far off all the same: that is no share of what was asked.
    far = replace(appearance, delta_e=17.0)
    assert not far.is_worse
    assert sketch_headline(far).startswith("Nearly there: brightness 93 %, colour 95 %. ")
    # Of nothing visible there is no share.
    faint = replace(appearance, deliveries=(Delivery("Painting", None, None),))
    assert sketch_headline(faint).startswith("About half way (53 %). ")


def test_a_view_that_lacks_a_wish_goes_first(make_basis: Any):
    """Its mean difference is smaller than that of the other view, whose wish came."""
    basis = make_basis(images=np.ones((1, 12, 12, 3)), names=["lamp"], emission=[[0.1] * 3])
    target = lp.Target.of(np.full((12, 12, 3), 0.4), name="t")
    analyses = lp.analyse(lp.solve([basis, basis], [target, target]))
    rim = Delivery(
        "Rim", 0.95, None, layers=(6,), kind="layer", asked_brightness=5.0, lit_pixels=10.0
    )
    deliveries = (rim, replace(rim, brightness=0.1, lit_pixels=30.0))
    seen = [
        replace(analysis, appearance=replace(analysis.appearance, delta_e=delta_e, deliveries=(x,)))
        for analysis, delta_e, x in zip(analyses, (9.0, 1.0), deliveries, strict=True)
    ]
    judgement = judge(seen, [0, 1])
    assert judgement.worst.delta_e == 1.0
    [entry] = judgement.complete(answer_findings([basis, basis], np.full((1, 3), 0.4))).deliveries
    assert entry.layers == (6,)
    assert entry.brightness == pytest.approx((10 * 0.95 + 30 * 0.1) / 40)


def test_a_preview_says_what_it_brings_and_what_it_costs():
    annex = UnpaintedChange(2.0, 12.0, "annex")
    sentence = (
        "Comes closer to the paint (mean ΔE 6.9 instead of 17), and changes the annex by ΔE 12."
    )
    assert preview_text((17.2, 6.9), annex, is_at_cost=False) == (sentence, False)
    costly = preview_text((17.2, 6.9), annex, is_at_cost=True)
    assert costly == (f"{sentence} That is more than it gains.", True)
    none = preview_text((6.94, 6.92), None, is_at_cost=False)[0]
    assert none == "The answer comes no closer."


def test_what_harms_the_rest_is_not_praised():
    """Letting go blew out the annex, and was told as 57 %."""
    appearance = Appearance(
        8.6,
        0.0,
        20.0,
        PLACE,
        local_lights=("lamp",),
        unpainted_change=UnpaintedChange(19.0, 51.0, "annex"),
    )
    text = sketch_headline(appearance)
    assert text.startswith("57 % of the way, at the cost of the annex (ΔE 51). ")
    mild = sketch_headline(replace(appearance, unpainted_change=UnpaintedChange(2.0, 7.0, "annex")))
    assert mild.startswith("About half way (57 %), and changes the annex by ΔE 7.0. ")


def test_what_is_close_is_said_as_elsewhere():
    appearance = Appearance(2.0, 0.0, 20.0, PLACE)
    assert sketch_headline(appearance) == headline(appearance)


@pytest.mark.parametrize("colors", ["free", "white"])
def test_why_it_is_not_closer_is_said_to_who_paints(make_basis: Any, colors: Any):
    size = (12, 12)
    noise = np.random.default_rng(5).normal(0, 0.05, (3, *size, 3))
    basis = make_basis(3, size, half_differences=noise)
    image = np.random.default_rng(1).random((*size, 3)).astype(np.float32)
    image[..., 1] *= 0.6  # which is pinker than any white
    target = lp.Target("t", image, np.ones(size, np.float32), everything=False)
    [analysis] = lp.analyse(lp.solve(basis, target, colors=colors))
    first, *others = why_not_closer(analysis)
    assert "% is out of reach of these lights" in first
    assert "% is render noise" in first
    colours = "% would need colours or levels that the lights may not have"
    assert (colours in first) == (colors == "white")
    text = " ".join([first, *others])
    for word in ("energy", "basis", "renders have", "below zero", "Most of that"):
        assert word not in text
    # A page has settings, and no arguments of Python.
    colors_reason = replace(analysis, appearance=replace(analysis.appearance, reasons=(COLORS,)))
    assert (
        "Lights keep their colours; any colour would remove 50 %"
        in why_not_closer(colors_reason)[-1]
    )
    # Where it is missed most is told once: of a whole, or of a place that is seen.
    placeless = replace(analysis, appearance=replace(analysis.appearance, place=None))
    assert "Most of what is out of reach is" in why_not_closer(placeless)[1]
    close = replace(analysis, diagnosis=replace(analysis.diagnosis, missed=0.009))
    assert why_not_closer(close) == ["The lights can make what is painted."]


@pytest.mark.parametrize("is_asked", [False, True])
def test_lamps_that_became_white_are_not_called_the_present_lighting(is_asked: bool):
    sentence = unpainted_text(is_asked=is_asked, is_white=True)
    assert "nearest to its colour" in sentence
    assert "current lighting" not in sentence
    plain = unpainted_text(is_asked=is_asked, is_white=False)
    assert ("current lighting" in plain) != is_asked
    by_hand = unpainted_text(is_asked=True, is_white=False, is_set=True)
    assert by_hand.endswith("lights that you set are as you set them, all others as they were.")
    assert unpainted_text(is_asked=True, is_white=True, is_set=True).startswith(sentence[:30])
    moved = unpainted_text(is_asked=False, is_white=False, is_moved=True)
    assert moved.endswith("is the current lighting, from where you put the lights.")
