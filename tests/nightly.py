"""Which tests only `./check --all` runs: more seeds of what every check tries with some."""

from collections.abc import Iterable
from typing import Any

import pytest


def seeds(few: int, many: int) -> Iterable[Any]:
    """Return the seeds 0 to `many`, of which those from `few` on are for the night."""
    return [
        *range(few),
        *(pytest.param(seed, marks=pytest.mark.nightly) for seed in range(few, many)),
    ]
