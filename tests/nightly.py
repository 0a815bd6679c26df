"""Which tests only `./check --all` runs: more of what every check tries with some."""

from collections.abc import Iterable
from typing import Any, TypeVar

import pytest
from hypothesis import settings

Case = TypeVar("Case")


def seeds(few: int, many: int) -> Iterable[Any]:
    """Return the seeds 0 to `many`, of which those from `few` on are for the night."""
    return [
        *range(few),
        *(pytest.param(seed, marks=pytest.mark.nightly) for seed in range(few, many)),
    ]


def nightly(*values: Any) -> Any:
    """Return a parameter, or several for one test, that only `./check --all` tries."""
    return pytest.param(*values, marks=pytest.mark.nightly)


#: Parameters of a test of thousands of cases: the first fifth in every check, the rest at night.
FIFTHS = seeds(1, 5)

#: The same for those of which a tenth are hundreds, too.
TENTHS = seeds(1, 10)


def fifth_of(cases: Iterable[Case], fifth: int) -> list[Case]:
    """Return every fifth case, of whatever there are, from that of the number `fifth` on."""
    return list(cases)[fifth::5]


def tenth_of(cases: Iterable[Case], tenth: int) -> list[Case]:
    """Return every tenth case, of whatever there are, from that of the number `tenth` on."""
    return list(cases)[tenth::10]


def examples(few: int, many: int) -> int:
    """Return how many examples of a property to try: `few`, or `many` by `./check --all`."""
    return many if settings.get_current_profile_name() == "nightly" else few
