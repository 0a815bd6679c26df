"""All looks at once: their pictures on a sheet, and the lamps of one against another's."""

from typing import Any

import pytest
from axe import violations
from painter_page import Painter

DIFFERENCE = """async ([first, second]) => {
  const { differenceOf } = await import('/ui/lamp_table.js');
  return differenceOf([first, second]);
}"""


@pytest.fixture
def painter(new_painter: Any, axe: str) -> Painter:
    """A painter with two looks: in the second the first lamp is a stop brighter."""
    opened: Painter = new_painter("lights=5", axe=axe)
    opened.button("Save look").click()
    opened.still()
    opened.page.evaluate(
        "() => painter.session.lockLight(0, host.weights[0].map((x) => 2 * x), true)"
    )
    opened.still()
    opened.button("Save look").click()
    opened.still()
    opened.button("All looks: pictures and lamps").click()
    return opened


def test_the_sheet_shows_every_look_and_a_click_goes_on_from_one(painter: Painter) -> None:
    sheet = painter.page.locator(".sheet button")
    assert sheet.all_inner_texts() == ["Look 1", "Look 2"]
    drawn = "() => [...document.querySelectorAll('.sheet canvas')].every(({ width }) => width > 1)"
    painter.page.wait_for_function(drawn)
    with painter.page.expect_download() as download:
        painter.button("Save as a picture").click()
    assert download.value.suggested_filename == "looks.png"
    assert violations(painter.page, ".lightpaint") == []
    sheet.nth(0).click()
    assert [request["look"] for request in painter.requests("load_look")] == [1]
    assert painter.ui("dialog") is None


@pytest.mark.nightly
def test_the_table_has_the_lamp_that_differs_most_on_top(painter: Painter) -> None:
    painter.button("Lamps", exact=True).click()
    rows = painter.page.locator(".lamp-table tbody tr")
    assert rows.count() == 5
    cells = rows.nth(0).locator("th, td").all_inner_texts()
    assert cells[0] == "key"
    assert cells[1].strip().startswith("0 st")
    assert cells[2].strip().startswith("+1.0 st")
    assert cells[3] == "+1.0 st"
    assert rows.nth(1).locator("td").last.inner_text() == "equal"
    painter.choose("Lamps of", "2")
    painter.choose("against", "1")
    assert rows.nth(0).locator("td").last.inner_text() == "−1.0 st"
    assert violations(painter.page, ".lightpaint") == []


@pytest.mark.parametrize(
    ("first", "second", "text"),
    [
        ([1, 1, 1], [1, 1, 1], ""),
        ([0, 0, 0], [0, 0, 0], ""),
        ([0, 0, 0], [1, 0.5, 0.2], "on"),
        ([1, 0.5, 0.2], [0, 0, 0], "off"),
        (None, [1, 1, 1], "is new"),
        ([1, 1, 1], None, "is not there"),
        ([1, 1, 1], [4, 4, 4], "+2.0 st"),
        ([0, 1, 0], [1, 0, 0], "−1.8 st, other colour"),
    ],
)
def test_a_difference_in_words(page: Any, first: Any, second: Any, text: str) -> None:
    assert page.evaluate(DIFFERENCE, [first, second])["text"] == text


def test_warmth_differs_in_mired(page: Any) -> None:
    whites = page.evaluate(
        """async () => {
          const { fromKelvin, luminance } = await import('/viewer/drawing/colour.js');
          return [5000, 4000].map((kelvin) => {
            const rgb = fromKelvin(kelvin);
            return rgb.map((x) => x / luminance(rgb));
          });
        }"""
    )
    assert page.evaluate(DIFFERENCE, whites)["text"] == "+50 mired"
