"""The headline: what was painted, in words, and everywhere the same."""

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import run
from conftest import BasisFactory

from lightpaint.basis.file.basis_file import write_basis
from lightpaint.images.estimate import Estimate
from lightpaint.images.formats.exr import write_rgb
from lightpaint.lighting.analysis.appearance.answer_appearance import Appearance
from lightpaint.lighting.analysis.appearance.area_lights import AreaLights
from lightpaint.lighting.analysis.appearance.delivery import Delivery
from lightpaint.lighting.analysis.appearance.display_difference import UnpaintedChange
from lightpaint.lighting.analysis.appearance.limiting_reasons import HEADLINE_SHARE, Reason
from lightpaint.lighting.analysis.diagnosis import Place
from lightpaint.lighting.answer.combination import combine
from lightpaint.lighting.answer.lighting_file import read_lighting
from lightpaint.lighting.default_solve import solve
from lightpaint.relit.verification import compare
from lightpaint.report.verdict_sentences import agreement, headline, verdict
from lightpaint.target.painted_target import Target

DARK, LIT = (0.1, 0.1, 0.1), (0.4, 0.4, 0.4)


def _seen(missed_delta_e: float, asked_delta_e: float = 20.0, **fields: Any) -> Appearance:
    region, painted, final = fields.pop("at", ((1, 1), LIT, DARK))
    place = Place(region, 0.9, (0, 0, 8, 8), painted, final, fields.pop("on", ""))
    return replace(Appearance(missed_delta_e, 0.0, asked_delta_e, place), **fields)


@pytest.mark.parametrize(
    ("appearance", "sentence"),
    [
        (Appearance(0.0, 0.0, 0.0), "Close: it looks as painted."),
        (_seen(2.9), "Close: it looks as painted."),
        (_seen(3.04, noise=0.1), "Close: it looks as painted."),
        (_seen(3.3, noise=0.5), "Close: apart from noise, it looks as painted."),
        (
            _seen(10.0, 16.0, local_lights=("lamp",)),
            "Part of the way, but the brighter light in the middle is out of reach: lamp would "
            "light too much else.",
        ),
        (
            _seen(9.0, 8.0, noise=4.0, local_lights=("lamp",)),
            "The current lighting comes closer to the paint (mean ΔE 8.0) than this answer (9.0): "
            "keep the scene as it is. No closer than the current lighting, and the brighter light "
            "in the middle is out of reach: lamp would light too much else.",
        ),
        (
            _seen(2.0, is_spot=True),
            "Close, but the brighter light in the middle is out of reach: no light reaches it.",
        ),
        (
            _seen(2.0, is_spot=True, local_lights=("lamp", "sun"), has_strong_light=False),
            "Close, but the brighter light in the middle is out of reach: lamp and sun do little "
            "there.",
        ),
        (
            _seen(5.0, local_lights=("lamp",), at=((0, 2), LIT, DARK)),
            "Most of the way, but the brighter light at the top right is out of reach: lamp would "
            "light too much else.",
        ),
        (
            _seen(5.0, local_lights=("sky",), at=((1, 0), DARK, LIT)),
            "Most of the way, but the darker shadow on the left is out of reach: sky lights it "
            "too.",
        ),
        (
            _seen(14.0),
            "These lights cannot match this: in the middle the paint is brighter "
            "than the lights make it; no light reaches it.",
        ),
        (
            _seen(2.8, 3.0, reasons=(Reason("hold"),)),
            "Unpainted parts keep the lights from this: in the middle the paint is "
            "brighter than the lights make it; unpainted parts are held near their current look.",
        ),
        (
            _seen(5.0, reasons=(Reason("colors"), Reason("lock", ("lamp",)))),
            "Most of the way, but the brighter light in the middle is missing: lights keep their "
            "colours, and lamp is locked.",
        ),
        (
            _seen(5.0, on="figure_hollow"),
            "Most of the way, but the brighter light on the figure hollow is out of reach: no "
            "light reaches it.",
        ),
        (
            _seen(14.0, on="<b>\x1b[1m", local_lights=("lamp",)),
            "These lights cannot match this: on the <b>\\x1b[1m the paint is "
            "brighter than the lights make it; lamp would light too much else.",
        ),
        (
            _seen(5.0, reasons=(Reason("views", ("balcony",)),)),
            "Most of the way, but the brighter light in the middle is missing: view balcony "
            "asks for different light.",
        ),
        (
            _seen(5.0, reasons=(Reason("colors"), Reason("views", ("a", "b")))),
            "Most of the way, but the brighter light in the middle is missing: lights keep their "
            "colours, and views a and b ask for different light.",
        ),
        (
            _seen(5.0, local_lights=("lamp", "sun", "sky"), held_lights=("lamp", "sun")),
            "Most of the way, but the brighter light in the middle is out of reach: sky would "
            "light too much else.",
        ),
        (
            _seen(14.0, local_lights=("lamp",), held_lights=("lamp",)),
            "Constraints keep the lights from this: in the middle the paint is "
            "brighter than the lights make it; lamp is limited by its constraints.",
        ),
        (
            _seen(5.0, local_lights=("lamp", "sun"), held_lights=("sun", "lamp")),
            "Most of the way, but the brighter light in the middle is out of reach: lamp and sun "
            "are limited by their constraints.",
        ),
        (
            _seen(5.0, local_lights=("sky",), held_lights=("sky",), at=((1, 0), DARK, LIT)),
            "Most of the way, but the darker shadow on the left is out of reach: sky lights it "
            "too.",
        ),
        (
            _seen(5.0, reasons=(Reason("limits", ("wall.x0.y0", "wall.x1.y0", "wall.x1.y1")),)),
            "Most of the way, but the brighter light in the middle is missing: 3 texels of wall "
            "are at their limits.",
        ),
        (
            _seen(5.0, local_lights=("wall.x1.y0", "wall.x1.y1", "lamp")),
            "Most of the way, but the brighter light in the middle is out of reach: 2 texels of "
            "wall and lamp would light too much else.",
        ),
        (
            _seen(5.0, local_lights=("wall.x1.y0", "wall.x1.y1")),
            "Most of the way, but the brighter light in the middle is out of reach: more light "
            "from 2 texels of wall would fall on too much else.",
        ),
        (
            _seen(5.0, local_lights=("sky.x1.y0",)),
            "Most of the way, but the brighter light in the middle is out of reach: more light "
            "from sky.x1.y0 would fall on too much else.",
        ),
        (
            _seen(5.0, local_lights=("sky.x1.y0", "sky.x2.y0"), at=((1, 0), DARK, LIT)),
            "Most of the way, but the darker shadow on the left is out of reach: 2 texels of sky "
            "shine there, too.",
        ),
        (
            _seen(5.0, reasons=(Reason("lock", ("sky.x1.y0", "sky.x2.y0", *"abc")),)),
            "Most of the way, but the brighter light in the middle is missing: 2 texels of sky "
            "and 3 lights are locked.",
        ),
        (
            _seen(5.0, local_lights=("lamp", "sun"), undetermined_lights=("lamp",)),
            "Most of the way, but the brighter light in the middle is missing: too few samples "
            "tell what lamp can do there.",
        ),
        (
            _seen(14.0, local_lights=("lamp",), undetermined_lights=("lamp",)),
            "The lights do not match this: in the middle the paint is brighter than the lights "
            "make it; too few samples tell what lamp can do there.",
        ),
        (
            _seen(
                5.0,
                local_lights=("lamp",),
                area_lights=AreaLights(("lamp", "sun"), is_alone=False),
                undetermined_lights=("sun",),
            ),
            "Most of the way, but the brighter light in the middle is missing: too few samples "
            "tell what sun can do there.",
        ),
        (
            _seen(10.4, 20.8, noise=5.2, error_shares={"noise": 0.9}),
            "Most of the way, but the brighter light in the middle is missing: 50 % of the "
            "difference from the painting is render noise.",
        ),
        (
            _seen(2.7, 3.9, noise=0.4, is_spot=True, error_shares={"noise": 0.93}),
            "Close, but the brighter light in the middle is missing: much of the difference (in "
            "energy) is render noise, which more samples reduce.",
        ),
        (
            Appearance(14.0, 0.0, 20.0),
            "These lights cannot match this: too much of what was painted is out of reach.",
        ),
    ],
)
def test_the_headline_in_words(appearance: Appearance, sentence: str):
    assert headline(appearance) == sentence


PARTS = ("unreachable", "forbidden", "noise", "painting_noise")

#: What a headline says of each part of the miss.
SAID = {
    "unreachable": "is out of reach: lamp would light too much else.",
    "forbidden": "is out of reach: lamp would light too much else.",
    "noise": "of the difference from the painting is render noise.",
    "painting_noise": "of the difference (in energy) is finer detail than light can show.",
}


@pytest.mark.parametrize("share", [0.3, 0.36, 0.9])
@pytest.mark.parametrize("part", PARTS)
def test_a_headline_names_no_cause_of_less_than_a_third(part: str, share: float):
    """Whatever the rest is, of parts as report.json has them; noise by its part of ΔE."""
    others = [x for x in PARTS if x not in (part, "unreachable", "forbidden")]
    parts = {part: share} | dict.fromkeys(others, (1 - share) / 4)
    noise = 40 * parts.get("noise", 0.0)
    sentence = headline(_seen(40, 160, noise=noise, local_lights=("lamp",), error_shares=parts))
    causes = [x for x in PARTS if SAID[x] in sentence]
    assert all(parts.get(x, 0) >= HEADLINE_SHARE for x in causes if x == part)
    assert (part in causes) == (share >= HEADLINE_SHARE)
    assert ("none of which accounts for a third" in sentence) == (share < HEADLINE_SHARE)


def test_a_spot_of_a_close_answer_is_laid_on_no_light_that_samples_do_not_tell(
    make_basis: BasisFactory, monkeypatch: pytest.MonkeyPatch
):
    """One that was not shown with an appearance finds out, as it does for answers that are far."""
    noise = np.random.default_rng(4).normal(0, 8, (2, 2, 16, 16, 3))
    noise[:, 0] = 0
    basis = make_basis(images=0.5 + noise[0], half_differences=noise[1], names=["lamp", "bulb"])
    solution = solve(basis, Target.of(basis.images[0], name="lamp"), literal=True)
    seen = _seen(2.0, is_spot=True, local_lights=("bulb",))
    monkeypatch.setattr("lightpaint.lighting.compare_appearance", lambda *_: seen)
    sentence = verdict(solution, combine(basis, solution.lighting), None)
    start = "Close, but the brighter light in the middle is missing: "
    assert sentence.startswith(f"{start}too few samples tell what bulb can do there.")


@pytest.mark.parametrize(("share", "is_named"), [(0.3, False), (0.36, True)])
def test_a_headline_names_no_reason_of_less_than_a_third(share: float, is_named: bool):
    reason = Reason("off", ("cove",), share)
    sentence = headline(
        _seen(5.0, local_lights=("lamp",), reasons=(reason,), error_shares={"unreachable": 0.9})
    )
    assert ("cove is switched off" in sentence) == is_named
    assert ("out of reach" in sentence) != is_named


def test_a_wish_of_the_headline_is_not_listed_again(make_basis: BasisFactory):
    basis = make_basis(2, (4, 4))
    importance = np.ones((4, 4), np.float32)
    solution = solve(basis, Target("dusk", basis.images.sum(0), importance, everything=True))
    wishes = (Delivery("Vase", 1.03, 0.23), Delivery("Back vase", 1.03, 0.23, layers=(1,)))
    seen = Appearance(2.0, 0.0, 20.0, None, deliveries=wishes, reasons=(Reason("colors"),))
    sentence = verdict(solution, combine(basis, solution.lighting), None, appearance=seen)
    assert sentence.count("Vase: brightness 103 %, colour 23 %") == 1
    assert " Back vase: brightness 103 %, colour 23 %." in sentence


def test_what_changes_elsewhere_is_part_of_the_verdict():
    annex = UnpaintedChange(19.0, 51.0, "annex")
    close_look = _seen(1.0, unpainted_change=annex)
    sentence = "Unpainted parts change too, most of all the annex, by ΔE 51."
    assert headline(close_look) == f"Close: it looks as painted. {sentence}"
    assert headline(_seen(5.0, unpainted_change=annex)).endswith(sentence)
    corner = UnpaintedChange(3.0, 7.5, region=(0, 2))
    assert headline(_seen(1.0, unpainted_change=corner)).endswith(
        "most of all at the top right, by ΔE 7.5."
    )
    # What nobody sees at a glance is not spoken of.
    assert headline(_seen(1.0, unpainted_change=UnpaintedChange(1.0, 5.0, "annex"))) == headline(
        _seen(1.0)
    )


def test_noise_is_no_fault_of_the_lighting():
    assert headline(replace(_seen(4.0), noise=1.5)).startswith("Close:")


def test_darkness_that_is_painted_dark_is_close(make_basis: Any):
    basis = make_basis(2, (4, 6))
    black = Target.of(np.zeros((4, 6, 3), np.float32), name="night")
    solution = solve(basis, black)
    sentence = verdict(solution, combine(basis, solution.lighting), None)
    assert sentence.startswith("Close: it looks as painted. Mean ΔE 0.0 over what was painted (")
    assert sentence.endswith(" Not checked by a render.")


@pytest.mark.parametrize("bias", [1.0, 1.2])
def test_the_verdict_tells_of_the_verification(make_basis: Any, bias: float):
    rng = np.random.default_rng(1)
    basis = make_basis(2, (16, 16))
    target = Target.of(basis.images.sum(axis=0), name="sum")
    solution = solve(basis, target)
    predicted = combine(basis, solution.lighting)
    noise = rng.normal(0, 0.02, (3, *predicted.image.shape)).astype(np.float32)
    rendered = Estimate(bias * predicted.image + noise[0], noise[1])
    checked = compare(replace(predicted, half_difference=noise[2]), rendered)
    sentence = verdict(solution, predicted, checked)
    if bias == 1:
        assert sentence.endswith("Rendered again: equal within noise.")
    else:
        assert "Rendered again: NOT equal" in sentence
        assert "standard errors apart, limit 5" in sentence


def test_one_number_everywhere(tmp_path: Path, make_basis: Any):
    """Console, report, lighting.json read back."""
    basis = make_basis(3, (24, 32), emission=[[0.3, 0.2, 0.1]] * 3)
    write_basis(tmp_path / "b.basis.exr", basis)
    rng = np.random.default_rng(5)
    write_rgb(tmp_path / "p.exr", rng.random((24, 32, 3)).astype(np.float32))
    completed = run(tmp_path, "solve", "b.basis.exr", "p.exr", "-o", "out")
    assert completed.returncode == 0, completed.stderr
    [delta_e] = re.findall(r"Mean ΔE ([\d.]+) over what was painted", completed.stdout)
    certificate = read_lighting(tmp_path / "out" / "lighting.json").certificate
    assert certificate is not None
    assert certificate.delta_e is not None
    assert f"{certificate.delta_e:.1f}" == delta_e
    stored = json.loads((tmp_path / "out" / "lighting.json").read_text(encoding="utf-8"))
    assert stored["solve"]["delta_e"] == certificate.delta_e
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert f"Mean ΔE {delta_e} over what was painted" in page
    for line in (completed.stdout, page.split("</header>")[0]):
        assert "meets" not in line
        assert "RMS" not in line.split("missed of the painting")[0]


def test_what_a_render_would_have_missed_is_said(make_basis: BasisFactory):
    basis = make_basis()
    solution = solve(basis, Target.of(basis.current_look))
    predicted = combine(basis, solution.lighting)
    checked = compare(predicted, predicted)
    for power, names in (
        ({"bulb": 0.49, "sun": 1.0}, "bulb"),
        ({"bulb": 0.3, "sun": 0.1}, "sun and bulb"),
        (
            {"sky.x0.y0": 0.3, "sky.x1.y0": 0.2, "sun": 0.1},
            "sun and any of 2 texels of sky",
        ),
        ({"a": 0.3, "b": 0.1, "c": 0.2, "d": 0.0}, "any light"),
        ({"a": 0.3, "b": 0.1, "c": 0.2, "d": 0.9}, "any light but d"),
        ({"a": 0.3, "b": 0.1, "c": 0.2, **dict.fromkeys("def", 1.0)}, "b, c and 1 more"),
    ):
        sentence = verdict(solution, predicted, replace(checked, power=power))
        warning = f"An error of 5 % in {names} would probably not show in this render."
        state = "equal within noise" if max(power.values()) >= 0.5 else "nothing found against it"
        assert sentence.endswith(f"Rendered again: {state}. {warning}")
    assert verdict(solution, predicted, replace(checked, power={"sun": 0.5})).endswith(
        "equal within noise."
    )


def test_an_answer_that_is_worse_than_the_present_says_so_first():
    worse = _seen(3.6, 3.4, local_lights=("lamp",))
    assert headline(worse).startswith(
        "The current lighting comes closer to the paint (mean ΔE 3.4) than this answer (3.6): "
        "keep the scene as it is. "
    )
    # What nobody reads is no difference.
    assert not headline(_seen(3.42, 3.4, local_lights=("lamp",))).startswith("The current lighting")


@pytest.mark.parametrize(
    ("power", "words"),
    [
        (
            0.01,
            "nothing found against the prediction with 2 samples per pixel, but an error of 5 %",
        ),
        (0.99, "prediction and verification agree within noise ("),
    ],
)
def test_a_render_that_could_not_see_an_error_agrees_with_nothing(power: float, words: str) -> None:
    image = np.full((16, 16, 3), 0.5, np.float32)
    picture = Estimate(image, 0.01 * np.random.default_rng(1).normal(size=image.shape))
    checked = replace(compare(picture, picture), power={"all lights": power}, spp=2)
    assert agreement(checked).startswith(words)
