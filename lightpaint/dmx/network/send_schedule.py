"""When the levels of a universe leave, as both protocols ask for it.

E1.31 (6.6.1) wants levels that no longer change sent three times, and then every 0.8 to 1 s;
Art-Net 4 wants the latter, too.
"""

import math
from collections.abc import Mapping

#: Packets with the same levels before a universe falls silent.
REPEATS = 3

#: Seconds between packets of a universe whose levels do not change.
KEEP_ALIVE_S = 0.8


class SendSchedule:
    """The universes that are due, by the levels and times of what was sent."""

    def __init__(self) -> None:
        self._levels: dict[int, bytes] = {}
        self._repeats: dict[int, int] = {}
        self._sent_s: dict[int, float] = {}

    def take_due(self, levels: Mapping[int, bytes], now_s: float) -> dict[int, bytes]:
        """Return the levels of the universes that are due, which count as sent."""
        due = {}
        for universe, values in levels.items():
            if self._levels.get(universe) != values:
                self._levels[universe], self._repeats[universe] = values, REPEATS
            is_silent = now_s - self._sent_s.get(universe, -math.inf) >= KEEP_ALIVE_S
            if self._repeats[universe] or is_silent:
                due[universe] = values
                self._repeats[universe] = max(self._repeats[universe] - 1, 0)
                self._sent_s[universe] = now_s
        return due

    @property
    def is_settled(self) -> bool:
        """True if all levels have been sent as often as they should, and only stay alive."""
        return not any(self._repeats.values())

    @property
    def next_s(self) -> float:
        """The time of the next packet: at once until it is settled; never before the first."""
        if not self.is_settled:
            return -math.inf
        return min(self._sent_s.values(), default=math.inf) + KEEP_ALIVE_S
