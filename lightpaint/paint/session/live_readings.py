"""Readings of planes while a stroke is made, as often as they cost little of its time."""

import time
from collections.abc import Callable

from lightpaint.paint.protocol import PlanesReading
from lightpaint.paint.session.live_answer import LiveAnswer

#: Their share of the time at most: the power of many lamps takes longer than an answer.
LARGEST_SHARE = 0.1


class LiveReadings:
    """Readings of the planes, renewed from time to time. clock_s: a clock in seconds."""

    def __init__(self, clock_s: Callable[[], float] = time.monotonic) -> None:
        self._clock_s = clock_s
        self._next_s = float("-inf")

    def take(self, answer: LiveAnswer) -> PlanesReading | None:
        """Return what an answer gives on measuring planes; None without any, and if it is too early
        for them.
        """
        begin_s = self._clock_s()
        if begin_s < self._next_s:
            return None
        reading = answer.planes_reading()
        end_s = self._clock_s()
        self._next_s = end_s + (end_s - begin_s) / LARGEST_SHARE
        return reading
