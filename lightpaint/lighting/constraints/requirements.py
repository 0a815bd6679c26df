"""Sums of light and of power that a lighting has to reach, such as the illuminance of a desk."""

from dataclasses import dataclass

from lightpaint.arrays import Doubles


@dataclass(frozen=True)
class Requirements:
    """Sums that have to reach given values: Σ rows·w + watts P ≥ least, P the power of all lamps.

    rows: (m, n, 3), the part of each weight. watts: (m,), -1 for a limit of the power, 0 for sums
    of light. least: (m,).
    """

    rows: Doubles
    watts: Doubles
    least: Doubles

    def __len__(self) -> int:
        return len(self.least)

    def lowered(self, slack: Doubles) -> "Requirements":
        """Return requirements that ask for less. slack: (m,)."""
        return Requirements(self.rows, self.watts, self.least - slack)
