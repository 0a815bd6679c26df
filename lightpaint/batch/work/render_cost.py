"""Seconds that samples take, from docs/benchmarks.md: the gallery's scenes on two cores."""

#: Seconds of a sample of one pixel for all lights together, and in addition for each light.
SAMPLE_S, LIGHT_SAMPLE_S = 9.6e-7, 1e-8


def render_seconds(samples: int, lights: int) -> float:
    """Return the seconds for that many samples of a basis."""
    return samples * (SAMPLE_S + LIGHT_SAMPLE_S * lights)
