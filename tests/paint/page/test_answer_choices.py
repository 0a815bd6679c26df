"""Three small pictures beside the sentence: what they show, and what a click on one asks for."""

from typing import Any

import numpy as np
import pytest
from painter_page import Painter

#: Of the answers that the session has solved.
CHOICES = [
    {"colors": "own", "is_chosen": False, "delta_e": 8.42},
    {"colors": "gentle", "is_chosen": True, "delta_e": 2.31},
    {"colors": "free", "is_chosen": False, "delta_e": 1.2},
]


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
    for name, number in (("Own colours", "8.4"), ("As painted", "2.3"), ("Bold", "1.2")):
        button = _button(painter, name)
        assert f"mean ΔE {number} from the painting" in button.get_attribute("aria-label")
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


@pytest.mark.parametrize("viewport", [(1440, 900), (1240, 720), (1920, 1080)], ids=str)
def test_they_move_nothing(new_painter: Any, viewport: tuple[int, int]) -> None:
    """What is around them stays where it is when they come."""
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
    overflow = painter.page.locator(".answer").evaluate(
        "(line) => [line.scrollWidth - line.clientWidth, line.scrollHeight - line.clientHeight]"
    )
    np.testing.assert_array_less(overflow, 1)
