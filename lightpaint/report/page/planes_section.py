"""The section of the report on measuring planes."""

from markupsafe import Markup

from lightpaint.lighting.wishes.planes_answer import PlanesAnswer
from lightpaint.report.page.html import html
from lightpaint.report.planes_text import HEADINGS, plane_rows, planes_sentences


def planes_section(answer: PlanesAnswer | None) -> Markup:
    """Return the table of planes with what is said of it; nothing without planes."""
    if answer is None:
        return Markup("")
    return html(
        "planes",
        headings=HEADINGS,
        rows=[*plane_rows(answer)],
        sentences=planes_sentences(answer),
    )
