"""Tolerances of a script: how close an answer must come for exit code 0."""

from dataclasses import dataclass

from lightpaint.lighting import Appearance


@dataclass(frozen=True)
class Tolerances:
    """The required closeness of an answer; None for no requirement.

    max_miss: largest mean ΔE over the painted pixels. min_fit: smallest `Appearance.share_met`.
    """

    max_miss: float | None = None
    min_fit: float | None = None

    def shortfalls(self, appearance: Appearance) -> list[str]:
        """Return the unmet tolerances of an answer, as text that follows its name."""
        shortfalls = []
        if self.max_miss is not None and appearance.delta_e > self.max_miss:
            shortfalls.append(
                f"misses a mean ΔE of {appearance.delta_e:.3f}, more than --max-miss "
                f"{self.max_miss:g}"
            )
        if self.min_fit is not None and appearance.share_met < self.min_fit:
            shortfalls.append(
                f"meets a share of {appearance.share_met:.3f}, less than --min-fit {self.min_fit:g}"
            )
        return shortfalls

    def document(self, appearance: Appearance) -> dict[str, object]:
        """Return the requirements and whether they are met, for programs."""
        requirements = {"max_miss": self.max_miss, "min_fit": self.min_fit}
        if not (
            requirements := {
                name: value for name, value in requirements.items() if value is not None
            }
        ):
            return {}
        return {"asked": requirements, "is_met": not self.shortfalls(appearance)}
