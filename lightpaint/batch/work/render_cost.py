"""Seconds that samples take, as docs/benchmarks.md has them of the gallery on two cores."""

#: Seconds of a sample of one pixel, all lights together, and for each light that it is added to.
SAMPLE_S, LIGHT_SAMPLE_S = 9.6e-7, 1e-8


def render_seconds(samples: int, lights: int) -> float:
    """Return the seconds for so many samples of a basis."""
    return samples * (SAMPLE_S + LIGHT_SAMPLE_S * lights)
