"""Which tests only `./check --all` runs: more of what every check tries with some."""

from collections.abc import Iterable
from typing import Any

import pytest


def seeds(few: int, many: int) -> Iterable[Any]:
    """Return the seeds 0 to `many`, of which those from `few` on are for the night."""
    return [
        *range(few),
        *(pytest.param(seed, marks=pytest.mark.nightly) for seed in range(few, many)),
    ]


def nightly(*values: Any) -> Any:
    """Return a parameter, or several for one test, that only `./check --all` tries."""
    return pytest.param(*values, marks=pytest.mark.nightly)
