"""What colours would cost, and what decided an answer, in words."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lightpaint.colour.color import hue_name, kelvin_to_rgb
from lightpaint.lighting.analysis.appearance.color_choices import ColorChoice
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.default_solve import solve
from lightpaint.report.diagnosis_sentences import fit_options, fit_sentence
from lightpaint.report.measures import ReportedAnswer
from lightpaint.report.page.limit_sections import closer_choice, colors_section, spoken_choice
from lightpaint.report.page.report_page import report_page
from lightpaint.report.report_json import report_numbers
from lightpaint.target.painted_target import Target

WARM, NEUTRAL, COOL = (tuple(kelvin_to_rgb(k).tolist()) for k in (2700.0, 5000.0, 12000.0))
GREEN, PALE = (0.1, 1.3, 0.2), (0.5, 1.15, 0.5)


def _choice(colors: Any, delta_e: float, **fields: Any) -> ColorChoice:
    choice = ColorChoice(colors, False, delta_e, "", (1, 1, 1), (1, 1, 1), np.ones((1, 3)))
    return replace(choice, **fields)


CHOSEN = _choice("gentle", 2.6, is_chosen=True)


@pytest.mark.parametrize(
    ("rgb", "word"),
    [
        (WARM, "warm white"),
        (NEUTRAL, "white"),
        ((1, 1, 1), "white"),
        (COOL, "cool white"),
        ((1, 0, 0), "red"),
        ((1, 0.25, 0), "orange"),
        ((1, 1, 0), "yellow"),
        ((0, 1, 0), "green"),
        ((0, 1, 1), "turquoise"),
        ((0, 0, 1), "blue"),
        ((0.4, 0, 1), "purple"),
        ((1, 0.1, 0.5), "pink"),
    ],
)
def test_hues_have_the_words_of_people(rgb: Any, word: str):
    for bright in (1e-3, 1, 1e3):
        assert hue_name(bright * np.array(rgb)) == word


@pytest.mark.parametrize(
    ("other", "sentence"),
    [
        (
            _choice("free", 2.1, light="pendant", before=WARM, color=GREEN),
            "free: ΔE 2.1 instead of 2.6, but pendant turns green",
        ),
        (
            _choice("white", 4.0, light="sky", before=GREEN, color=COOL),
            "white: ΔE 4.0 instead of 2.6, and sky turns cool white",
        ),
        (_choice("free", 2.55), "free: as close (ΔE 2.5)"),
        (
            _choice("free", 2.6, light="lamp", before=WARM, color=kelvin_to_rgb(3200.0)),
            "free: as close (ΔE 2.6), and lamp turns cooler",
        ),
        (
            _choice("free", 1.0, light="lamp\x1b", before=PALE, color=GREEN),
            "free: ΔE 1.0 instead of 2.6, but lamp\\x1b turns a deeper green",
        ),
    ],
)
def test_a_choice_in_words(other: ColorChoice, sentence: str):
    assert spoken_choice(other, CHOSEN) == sentence


def test_at_once_only_what_comes_notably_closer_is_told():
    near, far = _choice("free", 1.7), _choice("free", 1.5)
    assert closer_choice((near, CHOSEN)) == ""
    assert closer_choice((far, CHOSEN)) == "free: ΔE 1.5 instead of 2.6"
    assert closer_choice(()) == colors_section(()) == ""


def test_names_in_the_section_are_text():
    evil = _choice("free", 1.0, light="<b>\u202e", before=WARM, color=GREEN)
    section = colors_section((evil, CHOSEN, _choice("white", 4.0)))
    assert "&lt;b&gt;\\u202e turns green" in section
    assert "gentle, as solved" in section
    assert section.count("<tr>") == 4


@pytest.mark.parametrize("fit_words", [{}, {"hold": 0.5, "colors": "white"}, {"unpainted": 0.1}])
def test_what_decided_stands_in_the_page_and_in_its_numbers(make_basis: Any, fit_words: Any):
    basis = make_basis(2)
    importance = np.ones(basis.size, np.float32)
    importance[0] = 0
    image = np.full((*basis.size, 3), 0.4, np.float32)
    target = Target.of(image, importance=importance, name="grey")
    solution = solve(basis, target, **fit_words)
    arguments: Any = {
        "basis": basis,
        "target": target,
        "solution": solution,
        "predicted": combine(basis, solution.lighting),
        "verification": None,
        "command": "",
    }
    sentence = fit_sentence(solution)
    assert f'<p class="meant">{sentence}</p>' in report_page(ReportedAnswer(**arguments))
    meaning = json.loads(report_numbers(ReportedAnswer(**arguments)))["meant"]
    assert meaning == {k: v for k, v in fit_options(solution).items() if v is not None}
    assert meaning["colors"] == fit_words.get("colors", "free")
    assert meaning["hold"] == fit_words.get("hold", 0)
    expected = {"white": "lights are white", "free": "any colour"}[meaning["colors"]]
    assert expected in sentence or "counts 0.1" in sentence
    assert ("unpainted" in sentence.lower()) == ("hold" in fit_words or "unpainted" in fit_words)


@pytest.mark.parametrize("fit_words", [{"hold": 4.0}, {"unpainted": 0.1}])
@pytest.mark.parametrize("painted_share", [1.0, 0.9997])  # both are said to be 100 %
def test_a_painting_without_unpainted_parts_is_not_said_to_hold_them(
    make_basis: Any, fit_words: Any, painted_share: float
) -> None:
    basis = make_basis(2)
    whole = Target.of(np.full((*basis.size, 3), 0.4, np.float32), name="grey")
    target = replace(whole, full_size_share=painted_share)
    assert target.spoken_share == "100 %"
    assert "unpainted" not in fit_sentence(solve(basis, target, **fit_words)).lower()
