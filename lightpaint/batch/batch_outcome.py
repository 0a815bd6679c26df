"""The outcome of a batch run."""

from dataclasses import dataclass, field

from lightpaint.batch.gallery.summary import SummaryRow


@dataclass
class BatchOutcome:
    """Outcome of a run. done, failed: names of looks, and reasons. skipped: done earlier.

    waiting: not started. rows: of all looks, as in the summary.
    """

    done: list[str] = field(default_factory=list)
    failed: dict[str, str] = field(default_factory=dict)
    skipped: list[str] = field(default_factory=list)
    waiting: list[str] = field(default_factory=list)
    rows: list[SummaryRow] = field(default_factory=list)
