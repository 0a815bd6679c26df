"""Sentences on wishes: the headline names the worst and the newest one, and never praises."""

from dataclasses import replace
from typing import Any

import pytest

from lightpaint.lighting.analysis.appearance.answer_appearance import Appearance
from lightpaint.lighting.analysis.appearance.area_lights import AreaLights
from lightpaint.lighting.analysis.appearance.delivery import Delivery
from lightpaint.lighting.analysis.appearance.limiting_reasons import Reason
from lightpaint.lighting.analysis.diagnosis import Place
from lightpaint.report.diagnosis_sentences import spoken_deliveries
from lightpaint.report.page.report_page import wishes_section
from lightpaint.report.verdict_sentences import headline

PLACE = Place((1, 1), 0.9, (0, 0, 8, 8), (0.4, 0.4, 0.4), (0.1, 0.1, 0.1))

MOON = Delivery("Moonlight", 0.98, 0.43, layers=(3, 4), kind="group", lit_pixels=900.0)
SHADOWS = Delivery("Shadows", 0.9, 0.2, layers=(4,), group="Moonlight", kind="layer")
LANTERN = Delivery("Lantern", 0.08, None, layers=(5,), kind="layer", lit_pixels=20.0)
RIM = Delivery("Rim", 0.95, None, layers=(6,), kind="layer", lit_pixels=20.0)
VASE = Delivery("Vase", 0.95, 0.36, lit_pixels=20.0)
WALLS = Delivery("Walls", 1.0, 0.98, lit_pixels=900.0)
PAINTING = Delivery("Painting", 0.9, 0.5, layers=(0,), kind="layer")


def _seen(delta_e: float, *deliveries: Delivery, **fields: Any) -> Appearance:
    return replace(Appearance(delta_e, 0.0, 20.0, PLACE, deliveries=deliveries), **fields)


@pytest.mark.parametrize(
    ("appearance", "sentence"),
    [
        (
            _seen(2.0, MOON, reasons=(Reason("colors"),)),
            "Moonlight: brightness 98 %, colour 43 %, since lights keep their colours. "
            "On the whole it is close.",
        ),
        (
            _seen(2.0, MOON, LANTERN, local_lights=(), reasons_wish="Lantern"),
            "Lantern: out of reach (8 % came), since no light reaches it. A light that hangs or "
            "points elsewhere may reach it. On the whole it is close.",
        ),
        (
            _seen(5.0, LANTERN, RIM, local_lights=("sun",), reasons_wish="Lantern"),
            "Lantern: out of reach (8 % came), since sun would light too much else. "
            "More importance, or lights that move, may help. Rim: 95 %. "
            "On the whole: about half way.",
        ),
        (
            _seen(
                5.0,
                LANTERN,
                RIM,
                local_lights=("sun", "sky"),
                area_lights=AreaLights(("spot",), is_alone=True, also="big_plinth"),
                reasons_wish="Lantern",
            ),
            "Lantern: out of reach (8 % came), since spot lights the big plinth, too. More "
            "importance, or lights that move, may help. Rim: 95 %. On the whole: about "
            "half way.",
        ),
        (
            _seen(
                5.0,
                LANTERN,
                RIM,
                local_lights=("sun",),
                area_lights=AreaLights(("sun", "sky"), is_alone=False),
                reasons=(Reason("hold"),),
                reasons_wish="Lantern",
            ),
            "Lantern: 8 %, since no light reaches it alone; sun and sky light the rest, too. "
            "Rim: 95 %. On the whole: about half way.",
        ),
        (
            _seen(
                5.0,
                LANTERN,
                RIM,
                local_lights=("sun",),
                area_lights=AreaLights(("sky",), is_alone=False, also="floor"),
                reasons_wish="Lantern",
            ),
            "Lantern: out of reach (8 % came), since no light reaches it alone; sky lights the "
            "floor, too. Add a light for it, or paint the rest as well. Rim: 95 %. On the whole: "
            "about half way.",
        ),
        # Where all is painted, there is no rest to paint.
        (
            _seen(
                5.0,
                LANTERN,
                RIM,
                local_lights=("sun",),
                area_lights=AreaLights(("sky",), is_alone=False, also="floor"),
                reasons_wish="Lantern",
                is_painted_everywhere=True,
            ),
            "Lantern: out of reach (8 % came), since no light reaches it alone; sky lights the "
            "floor, too. Add a light for it. Rim: 95 %. On the whole: about half way.",
        ),
        # What samples do not tell of a light is no matter of its reach.
        (
            _seen(
                5.0,
                LANTERN,
                RIM,
                local_lights=("sun", "bulb"),
                area_lights=AreaLights(("sky",), is_alone=False, also="floor"),
                reasons_wish="Lantern",
                undetermined_lights=("bulb",),
            ),
            "Lantern: 8 %: too few samples tell what bulb can do there. Render more samples. Rim: "
            "95 %. On the whole: about half way.",
        ),
        # Where shadow is missing, nothing has to reach it.
        (
            _seen(
                5.0,
                replace(LANTERN, brightness=0.9, color=0.3),
                RIM,
                local_lights=("sky",),
                place=replace(PLACE, reached=(0.9, 0.9, 0.9)),
                area_lights=AreaLights(("sky",), is_alone=False, also="floor"),
                reasons_wish="Lantern",
            ),
            "Lantern: out of reach in colour (30 % came), since sky lights the floor, too. More "
            "importance, or lights that move, may help. Rim: 95 %. On the whole: part of the "
            "way.",
        ),
        # A lamp in view that is not adjusted shines on, whatever its importance.
        (
            _seen(
                5.0,
                LANTERN,
                RIM,
                local_lights=("exit_sign", "sky"),
                fixed_lights=("exit_sign",),
                place=replace(PLACE, reached=(0.9, 0.9, 0.9)),
                reasons_wish="Lantern",
            ),
            "Lantern: out of reach (8 % came), since exit_sign and sky light it too. Importance "
            "cannot help, as this light stays as it is: adjust it, too. Rim: 95 %. On the whole: "
            "about half way.",
        ),
        # Of one painting, whose parts nobody named, the whole goes first.
        (
            _seen(5.0, VASE, WALLS, local_lights=("spot",), reasons_wish="Vase"),
            "Most of the way: brightness 98 %, colour 67 %. Vase: out of reach in colour (36 % "
            "came), since spot would colour too much else. More importance, or lights that move, "
            "may help.",
        ),
        (
            _seen(2.0, VASE, WALLS, reasons=(Reason("colors"),)),
            "Close on the whole: brightness 98 %, colour 67 %. Vase: brightness 95 %, colour 36 "
            "%, since lights keep their colours.",
        ),
        (
            _seen(5.0, LANTERN, RIM, reasons=(Reason("lock", ("lamp",)),)),
            "Lantern: 8 %, since lamp is locked. Rim: 95 %. On the whole: about half way.",
        ),
        (
            _seen(2.0, replace(MOON, color=0.7), local_lights=("sun", "sky")),
            "Moonlight: out of reach in colour (70 % came), since sun and sky would colour too "
            "much else. A light that hangs or points elsewhere may reach it. On the whole it is "
            "close.",
        ),
        # A part of a group counts where the whole came.
        (
            _seen(2.0, SHADOWS, replace(MOON, color=0.9), reasons=(Reason("colors"),)),
            "Shadows of Moonlight: brightness 90 %, colour 20 %, since lights keep their "
            "colours. On the whole it is close.",
        ),
        (_seen(2.0, replace(MOON, color=0.76), RIM), "Close: it looks as painted."),
        # The only wish of a painting has no name that says more than where light is missing.
        (
            _seen(2.0, PAINTING, reasons=(Reason("colors"),)),
            "Close, but the brighter light in the middle is missing: lights keep their colours.",
        ),
    ],
)
def test_the_headline_is_about_the_worst_and_the_newest_wish(appearance: Appearance, sentence: str):
    assert headline(appearance) == sentence


@pytest.mark.parametrize("share", [-1.0, 0.0, 0.5, 0.74])
@pytest.mark.parametrize("part", ["brightness", "color"])
def test_nothing_is_as_painted_that_lacks_a_wish(part: str, share: float):
    for wish in (MOON, SHADOWS, LANTERN, PAINTING):
        met = replace(wish, brightness=1.0, color=1.0)
        assert "as painted" in headline(_seen(0.5, met, RIM))
        assert "as painted" not in headline(_seen(0.5, replace(met, **{part: share}), RIM))


def test_nothing_is_as_painted_whose_lit_parts_are_off():
    """Half of it is black, and as painted."""
    assert "as painted" in headline(_seen(2.0, RIM, lit_delta_e=2.9))
    sentence = headline(_seen(2.0, RIM, lit_delta_e=4.0, local_lights=("lamp",)))
    assert sentence.startswith("Nearly there, but the brighter light in the middle is out of reach")


def test_colours_that_are_kept_are_named_where_a_colour_is_missing():
    """Whatever else the difference is made of."""
    kept = (Reason("colors", share=0.2),)
    assert "lights keep their colours" in headline(_seen(2.0, MOON, reasons=kept))
    dark = replace(MOON, brightness=0.3, color=0.9)
    assert "lights keep their colours" not in headline(_seen(2.0, dark, reasons=kept))


def test_wishes_are_listed():
    text = "Moonlight: brightness 98 %, colour 43 %. Lantern: 8 %."
    assert spoken_deliveries([SHADOWS, MOON, LANTERN]) == text
    assert spoken_deliveries([]) == ""
    assert spoken_deliveries([PAINTING]) == (
        "Brightness 90 %, colour 50 % of what was asked for came."
    )
    shares = (0.5, 0.9, 0.1, 0.7, 0.8, 0.3)
    many = [
        replace(LANTERN, name=f"Lamp {k}", brightness=share, layers=(k,))
        for k, share in enumerate(shares)
    ]
    assert spoken_deliveries(many) == (
        "Lamp 0: 50 %. Lamp 2: 10 %. Lamp 3: 70 %. Lamp 5: 30 %. More came of 2 others."
    )
    assert spoken_deliveries(many[:5]).endswith("Lamp 4: 80 %. More came of one other.")
    assert spoken_deliveries([MOON, LANTERN], told="Close. Lantern: 8 %, since it is off.") == (
        "Moonlight: brightness 98 %, colour 43 %."
    )
    # What a sentence before says of the worst wish is not said again.
    told = "Close. Lantern: out of reach (8 % came), since sun would light too much else."
    assert spoken_deliveries([MOON, LANTERN], told=told) == (
        "Moonlight: brightness 98 %, colour 43 %."
    )
    told = "Close. Moonlight: out of reach in colour (43 % came), since sky lights the floor, too."
    assert spoken_deliveries([MOON, LANTERN], told=told) == (
        "Moonlight: brightness 98 %. Lantern: 8 %."
    )
    parts = [replace(RIM, name=name, kind="wish", layers=()) for name in ("Vase", "Top left")]
    assert spoken_deliveries(parts) == "Of each of 2 wishes at least 95 % came."
    assert spoken_deliveries([replace(parts[0], brightness=0.5), parts[1]]) == (
        "Vase: 50 %. Top left: 95 %."
    )
    darker = replace(parts[0], brightness=2.01, is_darker=True)
    text = "Of each of 2 wishes at least 95 % came. Vase: darkened twice as much as painted."
    assert spoken_deliveries([darker, parts[1]]) == text
    nothing = replace(LANTERN, brightness=None)
    assert spoken_deliveries([nothing, RIM]) == "95 % of what was asked for came."
    other_way = replace(LANTERN, brightness=-0.3)
    assert spoken_deliveries([MOON, other_way]).endswith("Lantern: 0 %.")


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"brightness": 1.24}, "brightness 124 %, colour 50 %"),
        ({"brightness": 1.4}, "brightened 1.4 times as much as painted, colour 50 %"),
        (
            {"brightness": 2.01, "is_darker": True},
            "darkened twice as much as painted, colour 50 %",
        ),
        ({"color": 1.5}, "brightness 90 %, coloured 1.5 times as much as painted"),
        ({"brightness": 1.5, "color": None}, "brightened 1.5 times as much as painted"),
    ],
)
def test_too_much_is_said_as_a_ratio_and_with_its_direction(changes: Any, text: str) -> None:
    painting = replace(PAINTING, **changes)
    assert painting.spoken_shares == text
    if painting.is_overdone:
        assert spoken_deliveries([painting]) == f"{text[0].upper()}{text[1:]}."


def test_the_report_has_a_bar_for_each_part():
    page = wishes_section(_seen(2.0, replace(MOON, name="<b>", color=1.4), LANTERN))
    assert "&lt;b&gt;" in page
    assert page.count('<i style="width: ') == 3
    assert "width: 8.00%" in page
    assert "width: 100.00%" in page
    assert wishes_section(None) == ""
    assert wishes_section(_seen(2.0)) == ""
    assert wishes_section(_seen(2.0, PAINTING)) == ""
