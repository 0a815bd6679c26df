"""The section of the report on measuring planes."""

from typing import Any

from markupsafe import Markup

from lightpaint.lighting.wishes.planes_answer import PlanesAnswer
from lightpaint.photometry.false_colour import false_colours
from lightpaint.photometry.measuring_plane import plane_title
from lightpaint.report.glare_text import GLARE_HEADINGS, glare_rows
from lightpaint.report.page.figures import data_uri
from lightpaint.report.page.html import html
from lightpaint.report.planes_text import HEADINGS, glare_by_title, plane_rows, planes_sentences


def planes_section(answer: PlanesAnswer | None) -> Markup:
    """Return the table of planes, what is said of it, and false colours; nothing without planes."""
    if answer is None:
        return Markup("")
    return html(
        "planes",
        has_planes=bool(answer.readings),
        tables=[
            (headings, rows)
            for headings, rows in (
                (HEADINGS, [*plane_rows(answer)]),
                (GLARE_HEADINGS, [*glare_rows(glare_by_title(answer))]),
            )
            if rows
        ],
        sentences=planes_sentences(answer),
        pictures=_pictures(answer),
    )


def _pictures(answer: PlanesAnswer) -> list[dict[str, Any]]:
    """Return false colours of the illuminance on each plane."""
    illuminance, pictures = answer.wished.illuminance, []
    for case, weights in answer.weights_by_case.items():
        values = illuminance.of(weights)
        for plane in illuminance.planes:
            title = plane_title(plane.name, case)
            pixels = false_colours(plane, values[illuminance.points_of(plane.name)], title)
            height, width = pixels.shape[:2]
            source = data_uri(pixels)
            pictures.append({"name": title, "width": width, "height": height, "source": source})
    return pictures
