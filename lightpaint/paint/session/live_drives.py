"""Drives of lamps while a stroke is made, as often as they cost hardly any of its time."""

import time
from collections.abc import Callable, Mapping

from lightpaint.arrays import Doubles
from lightpaint.colour.lamp import Lamp

#: Seconds between two sets of drives at least, and their share of the time at most.
LEAST_S, LARGEST_SHARE = 0.1, 0.05


class LiveDrives:
    """Drives of all lamps of emitters, renewed from time to time. clock_s: a clock in seconds."""

    def __init__(self, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._clock_s = clock_s
        self._next_s = float("-inf")

    def take(
        self, lamps: Mapping[int, Lamp], weights: Doubles
    ) -> tuple[tuple[float, ...] | None, ...] | None:
        """Return the drives of each light, None for lights without emitters; None for all if it is
        too early for them.

        lamps: by index of the light. weights: (n, 3).
        """
        begin_s = self._clock_s()
        if not lamps or begin_s < self._next_s:
            return None
        drives = tuple(
            tuple(lamps[k].drives_for(weight).tolist()) if k in lamps else None
            for k, weight in enumerate(weights)
        )
        end_s = self._clock_s()
        self._next_s = end_s + max(LEAST_S, (end_s - begin_s) / LARGEST_SHARE)
        return drives
