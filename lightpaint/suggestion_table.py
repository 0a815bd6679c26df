"""What commands print of suggested lights."""

from collections.abc import Sequence

from lightpaint import console
from lightpaint.relight.explanation import spoken_percent
from lightpaint.relight.report_suggestion import spoken_position, spoken_suggestions
from lightpaint.relight.suggestion import Suggestion


def show_suggestions(
    suggestions: Sequence[Suggestion], *, cd_per_unit: float | None = None
) -> None:
    """Print the lights that would help, and their XML."""
    console.write("")
    console.write(spoken_suggestions(suggestions))
    if not suggestions:
        return
    headings = ("suggested light", "at", "intensity R G B", "unit", "takes away", "left", "colour")
    amounts = () if cd_per_unit is None else ("luminous", "flux")
    table = console.table(*headings, *amounts)
    for light in suggestions:
        seen = light.photometry(cd_per_unit)
        table.add_row(
            light.name,
            spoken_position(light),
            console.numbers(light.emission),
            "W/sr",
            spoken_percent(light.gain_share),
            spoken_percent(light.missed_share),
            seen.color,
            *seen.amounts[: len(amounts)],
        )
    console.print_table(table)
    console.write("to be pasted into <scene>, and solved again:")
    for light in suggestions:
        console.write(light.xml)
