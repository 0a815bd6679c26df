"""What commands print of suggested lights."""

from collections.abc import Sequence

from lightpaint.cli import terminal
from lightpaint.placement.suggest import Suggestion
from lightpaint.report.sentences import spoken_percent
from lightpaint.report.suggestion import spoken_position, spoken_suggestions


def show_suggestions(
    suggestions: Sequence[Suggestion], *, cd_per_unit: float | None = None
) -> None:
    """Print the lights that would help, and their XML."""
    terminal.write("")
    terminal.write(spoken_suggestions(suggestions))
    if not suggestions:
        return
    headings = ("suggested light", "at", "intensity R G B", "unit", "takes away", "left", "colour")
    amounts = () if cd_per_unit is None else ("luminous", "flux")
    table = terminal.table(*headings, *amounts)
    for light in suggestions:
        seen = light.photometry(cd_per_unit)
        table.add_row(
            light.name,
            spoken_position(light),
            terminal.numbers(light.emission),
            "W/sr",
            spoken_percent(light.gain_share),
            spoken_percent(light.missed_share),
            seen.color,
            *seen.amounts[: len(amounts)],
        )
    terminal.print_table(table)
    terminal.write("to be pasted into <scene>, and solved again:")
    for light in suggestions:
        terminal.write(light.xml)
