"""The time that a search for poses takes: an estimate from what it will do, before it starts.

Nearly all time goes into light along frozen paths for trial poses: about as many of them for each
light and round, each over all pixels of the small film.
"""

import math
import os
from dataclasses import dataclass

from lightpaint.placement.look_goals import PIXELS
from lightpaint.placement.search.new_light_search import STARTS
from lightpaint.placement.search.pose_search import TURNS

#: Seconds at the usual pace, that of two idle processors, on a film of PIXELS: for one light and
#: round; for a new light and start; for the last steps and the judgement of one light.
LIGHT_S, NEW_LIGHT_S, END_S = 3.5, 12.0, 4.0

#: Seconds to trace the paths and compile kernels.
BEGIN_S = 8.0


@dataclass(frozen=True)
class SearchSize:
    """The work of a search.

    lights: number of those that may move. new: number of those that may be added. pixels: of the
    small films of all views together.
    """

    lights: int
    new: int
    pixels: int

    @classmethod
    def of(cls, lights: int, new: int, pixels: int) -> "SearchSize":
        """Return the size of a search on pictures of so many pixels together."""
        return cls(lights, new, min(pixels, PIXELS))

    def seconds(self, pace: float = 1.0) -> tuple[float, float]:
        """Return about the least and the most seconds that a search takes that is not stopped.

        pace: how much longer than usual it takes here. A second round over all lights follows only
        if the first one helped.
        """
        return pace * self._usual_seconds(1, 1), pace * self._usual_seconds(TURNS, STARTS)

    def _usual_seconds(self, rounds: int, starts: int) -> float:
        """Return the seconds of a search of so many rounds and starts at the usual pace."""
        blocks = rounds * self.lights * LIGHT_S + starts * self.new * NEW_LIGHT_S
        end = (self.lights + self.new) * END_S
        return BEGIN_S + self.pixels / PIXELS * (blocks + end)

    def pace_of(self, seconds: float) -> float:
        """Return the pace of a finished search that took so long, after an unknown round."""
        low, high = self.seconds()
        return seconds / math.sqrt(low * high)


def usual_pace() -> float:
    """Return the pace to expect from how busy this machine is: 1 for an idle one."""
    try:
        load = os.getloadavg()[0]
    except OSError:  # a system that does not count it
        return 1.0
    return max(1.0, load / (os.cpu_count() or 1))
