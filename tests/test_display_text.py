"""Texts for users."""

import pytest

from lightpaint.display_text import rounded_text


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(13.2, 1, "10"), (0.0519, 1, "0.05"), (123.4, 2, "120"), (2.0, 2, "2"), (0.0, 1, "0")],
)
def test_rounded_numbers_have_no_exponent(value: float, digits: int, text: str) -> None:
    """Turns of ten degrees and ways of a hundred units are read as people write them."""
    assert rounded_text(value, digits) == text
