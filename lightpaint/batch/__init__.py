"""Many looks in one run: read a manifest, plan its steps, run them, and show the results."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    # fmt: off
    from lightpaint.batch.gallery.gallery_page import counts_text, entry_of, write_solve_gallery
    from lightpaint.batch.gallery.summary import SummaryRow, summary_document
    from lightpaint.batch.manifest.entries import LookEntry
    from lightpaint.batch.manifest.file_names import FILES, check_gallery, is_reserved
    from lightpaint.batch.manifest.keys import as_key, parse_variations
    from lightpaint.batch.manifest.looks_file import write_starter_manifest
    from lightpaint.batch.plan.openjd import LOOK_PARAMETER, write_openjd
    from lightpaint.batch.plan.plan_steps import Plan, PlannedLook, estimate
    from lightpaint.batch.plan.planner import plan_batch
    from lightpaint.batch.run import BatchOutcome, run_batch
    from lightpaint.batch.run_options import RunOptions
    from lightpaint.batch.work.derived_looks import (
        publish_shifted, shifted_folders, variation_folder, variation_jobs,
    )
    from lightpaint.batch.work.item_execution import is_disk_full
    from lightpaint.batch.work.work_items import ItemResult
    # fmt: on

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
