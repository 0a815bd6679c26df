"""What is said in words about noise and about what is missed."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.lighting.analysis.appearance.answer_appearance import Appearance
from lightpaint.lighting.analysis.appearance.limiting_reasons import Reason
from lightpaint.lighting.analysis.diagnosis import Place, diagnose
from lightpaint.lighting.analysis.noise.uncertainty import error_bars
from lightpaint.lighting.answer.certificate import Bound
from lightpaint.lighting.default_solve import solve
from lightpaint.report.diagnosis_sentences import (
    error_sentences,
    spoken_bound,
    spoken_hold,
    uncertainty_sentence,
)
from lightpaint.report.measures import halving_spp
from lightpaint.report.page.limit_sections import missed_section, sure_section
from lightpaint.report.phrases import (
    spoken_difference,
    spoken_lights,
    spoken_percent,
    spoken_percents,
    spoken_place,
)
from lightpaint.target.painted_target import Target

SIZE = (12, 12)


def _solved(make_basis: Any, **options: Any) -> Any:
    noise = np.random.default_rng(5).normal(0, 0.05, (3, *SIZE, 3))
    basis = make_basis(3, SIZE, half_differences=noise, **options)
    image = np.random.default_rng(1).random((*SIZE, 3)).astype(np.float32)
    target = Target("t", image, np.ones(SIZE, np.float32), everything=False)
    solution = solve(basis, target)
    return basis, solution, error_bars(solution), diagnose(solution)


@pytest.mark.parametrize(
    ("painted", "final", "words"),
    [
        ((2, 2, 2), (1, 1, 1), "brighter"),
        ((1, 1, 1), (2, 2, 2), "darker"),
        ((0.5, 0.5, 1.5), (0.5, 0.5, 0.5), "bluer"),
        ((1, 1, 0.2), (1, 1, 1), "yellower"),
        ((0.2, 0.1, 0.1), (0.01, 0.02, 0.02), "brighter and redder"),
        ((1, 1, 1), (0, 0, 0), "brighter"),
        ((0, 0, 0), (1, 1, 1), "darker"),
        ((1.01, 1, 1), (1, 1, 1), "a little brighter"),
    ],
)
def test_difference_of_colours(painted: Any, final: Any, words: str):
    assert spoken_difference(painted, final) == words


@pytest.mark.parametrize(
    ("region", "place_words"),
    [
        ((0, 0), "is at the top left"),
        ((0, 1), "is at the top"),
        ((1, 1), "is in the middle"),
        ((1, 2), "is on the right"),
        ((2, 2), "is at the bottom right"),
    ],
)
def test_places(region: tuple[int, int], place_words: str):
    place = Place(region, 0.38, (0, 0, 1, 1), (1, 1, 4), (1, 1, 1))
    assert place_words in spoken_place(place)
    assert (
        "(38 % of it): the paint is brighter and bluer than any mix of the lights."
        in spoken_place(place)
    )


def _bound(kind: Any, *lights: str, gain: float = 1.0, multiplier: Any = (1, 1, 1)) -> Bound:
    held_by = {"zero": "zero", "kept": "kept", "left out": "left out"}.get(kind, "as asked")
    per: Any = "emission" if len(multiplier) == 3 else "luminance"
    return Bound(lights, kind, held_by, gain, multiplier, per)


def test_bounds_and_percents():
    assert spoken_hold(_bound("zero", "a", multiplier=(1, 2, 3))) == "off"
    assert spoken_hold(_bound("zero", "a", multiplier=(0, 0, 3))) == "off in blue"
    assert spoken_hold(_bound("zero", "a", multiplier=(4,))) == "off"
    assert spoken_hold(_bound("limits", "a")) == "as asked"
    assert [spoken_percent(x) for x in (0, 0.004, 0.07, 0.62)] == ["0 %", "0.4 %", "7 %", "62 %"]


def test_whites_that_a_light_would_leave_are_told_with_the_side():
    bound = replace(_bound("colour", "spot_tide"), held_by="2200 to 9000 K", tint="greener")
    sentence = spoken_bound(bound, 0.4)
    assert sentence.startswith("Light spot_tide would have to be greener than its whites (2200 to")
    assert spoken_hold(bound) == "2200 to 9000 K; would have to be greener"


def test_scatter_takes_four_times_the_samples_and_bias_twice(make_basis: Any):
    basis, _, bars, _ = _solved(make_basis)
    scatter = replace(bars, bias=np.zeros((3, 3)))
    bias = replace(bars, scatter=np.zeros((3, 3)), bias=np.ones((3, 3)))
    assert halving_spp(basis, scatter, 0) == 4 * basis.origin.spp
    assert halving_spp(basis, bias, 0) == 2 * basis.origin.spp
    assert 128 <= halving_spp(basis, bars, 0) <= 256


def test_the_light_that_matters_is_named(make_basis: Any):
    basis, solution, bars, _ = _solved(make_basis)
    # Its painting is random from pixel to pixel.
    text = uncertainty_sentence(basis, solution, bars)
    assert text.startswith("Noise of the painting leaves light")
    assert "would halve that" not in text
    text = uncertainty_sentence(basis, solution, replace(bars, is_filtered=True))
    assert text.startswith("The reconstruction filter of the painting, which is a render, leaves")
    bars = replace(bars, painting_scatter=0 * bars.scatter)
    text = uncertainty_sentence(basis, solution, bars)
    assert "More samples would change light" in text
    assert "would halve that" in text
    ends = (bars.weights, bars.weights)
    quiet = replace(bars, scatter=0 * bars.scatter, bias=0 * bars.bias, interval=ends)
    assert "change no light" in uncertainty_sentence(basis, solution, quiet)


@given(st.lists(st.floats(0.005, 1), min_size=1, max_size=5))
def test_percentages_of_parts_add_up(parts: list[float]):
    total = sum(parts)
    shares = [x / total for x in parts if x / total >= 0.005]
    percents = [int(x.removesuffix(" %")) for x in spoken_percents(shares)]
    assert sum(percents) == round(100 * sum(shares))
    # One percent for what is less is the most that any is off, beside the rounding.
    assert all(abs(p - 100 * s) <= 1.5 and p >= 1 for p, s in zip(percents, shares, strict=True))


def test_the_parts_of_what_is_missed_add_up(make_basis: Any):
    *_, diagnosis = _solved(make_basis)
    parts = {"unreachable": 0.965, "noise": 0.031, "painting_noise": 0.004, "forbidden": 0.0}
    split = replace(diagnosis, **{name: x * diagnosis.total for name, x in parts.items()})
    shares = [int(x) for x in re.findall(r"(\d+) %", error_sentences(split)[0])]
    assert shares == [97, 3]
    other_parts = {**parts, "unreachable": 0.962, "painting_noise": 0.007}
    split = replace(diagnosis, **{name: x * diagnosis.total for name, x in other_parts.items()})
    assert re.findall(r"([\d.]+) %", error_sentences(split)[0]) == ["96", "3", "1"]


def test_sentence_and_table_give_the_same_percentages(make_basis: Any):
    """Alone, the first part rounds to 96 %; with the others it is 97 %, so that they add up."""
    basis, solution, _, diagnosis = _solved(make_basis)
    parts = {"unreachable": 0.9649, "noise": 0.0246, "painting_noise": 0.0105, "forbidden": 0.0}
    split = replace(diagnosis, **{name: x * diagnosis.total for name, x in parts.items()})
    current = basis.mix(basis.current_weights)
    page = missed_section(solution, split, current, transform=ViewTransform())
    sentence, _, rest = page.partition("</p>")
    [table] = re.findall(r'<table class="shares">(.*?)</table>', rest, re.DOTALL)
    shares = re.findall(r"([\d.]+) %", sentence)
    assert len(shares) == 3
    assert sum(map(int, shares)) == 100
    assert sorted(shares) == sorted(x for x in re.findall(r"([\d.]+) %", table) if x != "0")


def test_the_most_useful_comes_first(make_basis: Any):
    *_, diagnosis = _solved(make_basis)
    first, *rest = error_sentences(diagnosis)
    assert first.startswith("Of the difference (in energy), ")
    assert "is out of reach of any mix of the lights" in first
    assert len(rest) <= 3
    almost_met = replace(diagnosis, missed=0.009)
    assert error_sentences(almost_met) == ["The lights can make what is painted."]
    half = 0.5 * diagnosis.total
    with_bound = replace(
        diagnosis, bounds=(_bound("zero", "key", gain=half, multiplier=(0, 1, 1)),)
    )
    assert (
        "Light key is off in green and blue and still too much" in error_sentences(with_bound)[-1]
    )


def test_what_is_out_of_reach_is_so_beside_what_is_held(make_basis: Any):
    *_, diagnosis = _solved(make_basis)
    appearance = Appearance(12.0, 0.0, 20.0)
    assert "is out of reach of any mix of the lights," in error_sentences(diagnosis, appearance)[0]
    hidden = replace(appearance, local_lights=("bulb",), undetermined_lights=("bulb",))
    assert (
        "is out of reach of any mix of the lights as these samples show them,"
        in error_sentences(diagnosis, hidden)[0]
    )
    with_hold = replace(appearance, reasons=(Reason("hold", (), 0.7),))
    assert (
        "is out of reach of any mix of the lights while the rest is "
        "held," in error_sentences(diagnosis, with_hold)[0]
    )


@pytest.mark.parametrize(
    ("bound", "words"),
    [
        (_bound("kept", "rest"), "Light rest is fixed; adjusting it too would remove"),
        (_bound("lock", "a"), "Light a is locked; adjusting it would"),
        (_bound("off", "a"), "Light a is switched off, as asked; switching it on would"),
        (
            _bound("left out", "a"),
            "Light a is left out, since their number is limited; switching it",
        ),
        (_bound("left out", "a", "b"), "Lights a, b are left out, since their number is limited"),
        (_bound("tie", "a", "b"), "Lights a, b are tied together; adjusting each by itself would"),
        (_bound("limits", "a"), "Light a is at a limit (as asked); removing it would"),
        (_bound("colour", "a"), "Light a is limited in colour (as asked); any other colour would"),
    ],
)
def test_what_holds_a_light_is_said(bound: Bound, words: str):
    sentence = spoken_bound(bound, 0.38)
    assert words in sentence
    assert sentence.endswith("would remove 38 % of the difference from the painting.")


def test_the_switched_off_light_that_would_help_most_is_named(make_basis: Any):
    *_, diagnosis = _solved(make_basis)
    shares = {"tie": 0.5, "off": 0.3, "left out": 0.2, "zero": 0.1}
    bounds = [_bound(kind, kind, gain=share * diagnosis.total) for kind, share in shares.items()]
    *_, first, second = error_sentences(replace(diagnosis, bounds=tuple(bounds)))
    assert "tied together" in first
    assert second == spoken_bound(bounds[1], 0.3)
    assert "30 %" in second
    # If it is what helps most of all, once is enough.
    sentences = error_sentences(replace(diagnosis, bounds=tuple(bounds[1:])))
    assert sentences[-1] == second
    assert sum("switched off" in sentence for sentence in sentences) == 1
    # It is spoken of where others that would help as little are not.
    little = [replace(bound, gain=0.03 * diagnosis.total) for bound in bounds]
    assert "switched off" in error_sentences(replace(diagnosis, bounds=tuple(little)))[-1]
    assert "dimmer" not in " ".join(error_sentences(replace(diagnosis, bounds=tuple(little))))
    # What hardly helps is not spoken of.
    faint = replace(bounds[1], gain=0.009 * diagnosis.total)
    assert "switched off" not in " ".join(error_sentences(replace(diagnosis, bounds=(faint,))))


def test_the_report_says_how_many_bounds_were_not_looked_into(make_basis: Any):
    basis, solution, _, diagnosis = _solved(make_basis)
    bound = _bound("limits", "a", gain=0.5 * diagnosis.total, multiplier=(-2.5,))
    current = basis.mix(basis.current_weights)
    page = missed_section(
        solution, replace(diagnosis, bounds=(bound,)), current, transform=ViewTransform()
    )
    assert "−2.5 <small>per unit of luminance" in page
    assert "were not analysed" not in page
    diagnosis = replace(diagnosis, bounds=(bound,), bounds_left_out=7)
    page = missed_section(solution, diagnosis, current, transform=ViewTransform())
    assert "7 more seem to matter less and were not analysed" in page


@pytest.mark.parametrize(
    ("names", "words"),
    [
        (["key"], "Light key"),
        (["key", "fill"], "Lights key, fill"),
        (["light_3"], "light_3"),
        (["Skylight", "annex_lamp"], "Skylight, annex_lamp"),
        (["light_3", "key"], "Lights light_3, key"),
        ([""], "Light without a name"),
        (["sky.x0.y1"], "Texel sky.x0.y1"),
        (["sky.x0.y1", "sky.sun1.x4.y3"], "2 texels of sky"),
        (["sky.x0.y1", "sky.x1.y1", "key"], "2 texels of sky, key"),
    ],
)
def test_lights_are_called_lights_once(names: list[str], words: str):
    assert spoken_lights(names, start=True) == words
    if words.startswith(("Light", "Texel")):
        assert spoken_lights(names) == words[0].lower() + words[1:]
    assert spoken_bound(_bound("tie", *names), 0.5).startswith(words)


def test_of_hundreds_of_names_the_first_are_said(make_basis: Any):
    names = [f"spot_{k}" for k in range(302)]
    sentence = spoken_bound(_bound("tie", *names), 0.5)
    assert re.match(r"Lights spot_0, spot_1, .*… and 2\d\d more are tied together", sentence)
    assert len(sentence) < 300


def test_a_light_that_is_called_so_is_not_called_twice(make_basis: Any):
    basis, solution, bars, _ = _solved(make_basis, names=["light_1", "light_2", "light_3"])
    bars = replace(bars, painting_scatter=0 * bars.scatter)
    assert re.match(
        r"More samples would change light_\d, ", uncertainty_sentence(basis, solution, bars)
    )


def test_names_are_escaped(make_basis: Any):
    names = ["<b>1", "<b>2", "<b>3"]
    basis, solution, bars, diagnosis = _solved(make_basis, names=names)
    bound = _bound("zero", "<b>2", gain=0.5 * diagnosis.total)
    diagnosis = replace(diagnosis, bounds=(bound,))
    current = basis.mix(basis.current_weights)
    page = sure_section(basis, solution, bars)
    page += missed_section(solution, diagnosis, current, transform=ViewTransform())
    assert "<b>" not in page
    assert "&lt;b&gt;2" in page
