"""Glare in words, and in rows of tables."""

from collections.abc import Iterator, Mapping

from lightpaint.photometry.glare import (
    LARGEST_ANGLE,
    LEAST_ANGLE,
    LEAST_RATING,
    GlareReading,
)

#: Headings of a table of observers.
GLARE_HEADINGS = ("observer", "UGR", "background cd/m²", "most from")


def glare_rows(readings: Mapping[str, GlareReading]) -> Iterator[tuple[str, ...]]:
    """Yield a row for each observer, in the order of `GLARE_HEADINGS`. readings: by title."""
    for title, reading in readings.items():
        yield title, rating_text(reading), f"{reading.background:.3g}", reading.strongest


def rating_text(reading: GlareReading) -> str:
    """Return the UGR with half of its 95 % interval."""
    if reading.rating is None:
        return "unknown"
    if reading.rating < LEAST_RATING:
        return f"< {LEAST_RATING:g}"
    return f"{reading.rating:.1f} ± {max(reading.interval, 0.1):.1f}"


def glare_sentences(readings: Mapping[str, GlareReading]) -> Iterator[str]:
    """Yield what readers of the table have to know. readings: by title."""
    for title, reading in readings.items():
        if reading.rating is None:
            yield f"The UGR of {title} cannot be told: {reading.reason}."
        elif reading.rating >= LEAST_RATING and reading.is_of_unusual_size:
            yield (
                f"The UGR of {title} is that of {reading.strongest}, which fills "
                f"{reading.solid_angle:.2g} sr: it is made for {LEAST_ANGLE:g} to "
                f"{LARGEST_ANGLE:g} sr."
            )
