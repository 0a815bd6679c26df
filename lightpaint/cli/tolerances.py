"""What a script asks of an answer, beside that it is the best there is."""

from dataclasses import dataclass

from lightpaint.lighting.analysis.appearance.appearance import Seen


@dataclass(frozen=True)
class Wanted:
    """How close an answer has to come; None for anything will do.

    max_miss: mean ΔE over what was painted, at most. min_fit: `Seen.share_met`, at least.
    """

    max_miss: float | None = None
    min_fit: float | None = None

    def shortfalls(self, seen: Seen) -> list[str]:
        """What an answer lacks, in words behind its name; nothing where it will do."""
        told = []
        if self.max_miss is not None and seen.delta_e > self.max_miss:
            told.append(
                f"misses a mean ΔE of {seen.delta_e:.3f}, more than --max-miss {self.max_miss:g}"
            )
        if self.min_fit is not None and seen.share_met < self.min_fit:
            told.append(
                f"meets a share of {seen.share_met:.3f}, less than --min-fit {self.min_fit:g}"
            )
        return told

    def document(self, seen: Seen) -> dict[str, object]:
        """The same for programs; nothing where nothing is asked."""
        asked = {"max_miss": self.max_miss, "min_fit": self.min_fit}
        if not (asked := {name: value for name, value in asked.items() if value is not None}):
            return {}
        return {"asked": asked, "is_met": not self.shortfalls(seen)}
