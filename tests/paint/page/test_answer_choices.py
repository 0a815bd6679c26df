"""Three small pictures beside the sentence: what they show, and what a click on one asks for."""

from typing import Any

import numpy as np
import pytest
from nightly import nightly
from painter_page import Painter

#: Of the answers that the session has solved.
CHOICES = [
    {
        "colors": "own",
        "is_chosen": False,
        "delta_e": 8.42,
        "brightness": 0.8,
        "color": 0.06,
        "worst": {
            "name": "Lantern",
            "kind": "layer",
            "layers": [1],
            "brightness": 0.7,
            "color": -0.3,
            "delta_e": 12.0,
        },
    },
    {
        "colors": "gentle",
        "is_chosen": True,
        "delta_e": 2.31,
        "brightness": 0.982,
        "color": 0.9,
        "worst": None,
    },
    {
        "colors": "free",
        "is_chosen": False,
        "delta_e": 1.2,
        "brightness": 1.0,
        "color": 1.0,
        "worst": None,
    },
]

#: What is said of each, and what is on its picture.
SAID = {
    "Own colours": (
        "80 % of the asked brightness and 6 % of the asked colour came. "
        "Least came of Lantern: 0 %. Mean ΔE 8.4 from the painting.",
        "80 · 6 %",
    ),
    "As painted": (
        "98 % of the asked brightness and 90 % of the asked colour came. "
        "Mean ΔE 2.3 from the painting.",
        "98 · 90 %",
    ),
    "Bold": (
        "100 % of the asked brightness and 100 % of the asked colour came. "
        "Mean ΔE 1.2 from the painting.",
        "100 · 100 %",
    ),
}


def _offer(painter: Painter, version: int) -> None:
    """The session tells of the answers, and the page can fetch their pictures."""
    painter.page.evaluate(
        """() => {
          const { host } = window, fetch = host.fetch.bind(host);
          host.fetch = (name) => name.startsWith('choice/')
            ? Promise.resolve({ data: new Uint8Array(6).fill(200), shape: [1, 2, 3] })
            : fetch(name);
        }"""
    )
    resources = {f"choice/{choice['colors']}": version for choice in CHOICES}
    painter.tell(kind="choices", version=version, choices=CHOICES, resources=resources)


def _button(painter: Painter, name: str) -> Any:
    return painter.page.locator(".choices").get_by_role("button", name=name)


def test_a_click_on_a_picture_is_one_request(painter: Painter) -> None:
    painter.stroke()
    painter.still()
    _offer(painter, painter.ui("version"))
    for name, (said, on_picture) in SAID.items():
        button = _button(painter, name)
        assert button.get_attribute("aria-label") == f"{name}. {said}"
        assert said in button.get_attribute("data-tip")
        numbers = button.locator("b")
        assert numbers.text_content() == on_picture
        assert ("is-short" in numbers.get_attribute("class")) == (name == "Own colours")
        shown = button.locator("canvas").evaluate(
            "(canvas) => [...canvas.getContext('2d').getImageData(0, 0, 1, 1).data]"
        )
        assert shown == [200, 200, 200, 255]
    assert _button(painter, "As painted").get_attribute("aria-pressed") == "true"
    _button(painter, "As painted").click()
    assert painter.requests("change_settings") == []
    _button(painter, "Bold").click()
    _button(painter, "Own colours").click()
    asked = [request["settings"] for request in painter.requests("change_settings")]
    assert asked == [{"colors": "free"}, {"colors": "own"}]


@pytest.mark.nightly
def test_pictures_of_an_earlier_answer_are_dimmed(painter: Painter) -> None:
    painter.stroke()
    painter.still()
    group = painter.page.locator(".choices")
    _offer(painter, painter.ui("version"))
    assert "is-old" not in group.get_attribute("class")
    painter.stroke()
    painter.still()
    assert "is-old" in group.get_attribute("class")
    _offer(painter, painter.ui("version"))
    assert "is-old" not in group.get_attribute("class")


@pytest.mark.nightly
def test_a_share_that_nothing_was_asked_of_is_a_dash(painter: Painter) -> None:
    painter.stroke()
    painter.still()
    difference = "Mean ΔE 1.2 from the painting."
    cases: list[tuple[float | None, float | None, list[str], str]] = [
        (None, 0.9, ["– · 90 %"], f"Bold. 90 % of the asked colour came. {difference}"),
        (0.5, None, ["50 · – %"], f"Bold. 50 % of the asked brightness came. {difference}"),
        (None, None, [], f"Bold. {difference}"),
    ]
    for brightness, color, on_picture, said in cases:
        choice = {**CHOICES[2], "brightness": brightness, "color": color}
        painter.tell(kind="choices", version=painter.ui("version"), choices=[choice], resources={})
        button = _button(painter, "Bold")
        assert button.locator("b").all_text_contents() == on_picture
        assert button.get_attribute("aria-label") == said


@pytest.mark.nightly
@pytest.mark.parametrize(
    "viewport", [(1240, 720), *map(nightly, [(1440, 900), (1920, 1080)])], ids=str
)
def test_they_move_nothing(new_painter: Any, viewport: tuple[int, int]) -> None:
    """All that is around them stays where it is when they come."""
    width, height = viewport
    painter = new_painter(viewport={"width": width, "height": height})
    boxes = ".stage, .choices, .answer, .looks"

    def places() -> Any:
        return [box.bounding_box() for box in painter.page.locator(boxes).all()]

    painter.stroke()
    painter.still()
    before = places()
    _offer(painter, painter.ui("version"))
    assert places() == before
    pictures = painter.page.locator(".answer-choice canvas").all()
    assert len({picture.bounding_box()["width"] for picture in pictures}) == 1
    for name in SAID:  # what is on a picture stays on it
        numbers = _button(painter, name).locator("b").bounding_box()
        picture = _button(painter, name).locator("canvas").bounding_box()
        assert picture["x"] <= numbers["x"]
        assert numbers["x"] + numbers["width"] <= picture["x"] + picture["width"] + 1
    overflow = painter.page.locator(".answer").evaluate(
        "(line) => [line.scrollWidth - line.clientWidth, line.scrollHeight - line.clientHeight]"
    )
    np.testing.assert_array_less(overflow, 1)
