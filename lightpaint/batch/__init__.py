"""Many looks in one run: read a manifest, plan its steps, run them, and show the results."""

from typing import TYPE_CHECKING

from lightpaint.lazy_names import lazy_names

if TYPE_CHECKING:
    from lightpaint.batch.gallery.gallery_page import counts_text as counts_text
    from lightpaint.batch.gallery.gallery_page import entry_of as entry_of
    from lightpaint.batch.gallery.gallery_page import write_solve_gallery as write_solve_gallery
    from lightpaint.batch.gallery.summary import SummaryRow as SummaryRow
    from lightpaint.batch.gallery.summary import summary_document as summary_document
    from lightpaint.batch.manifest.entries import LookEntry as LookEntry
    from lightpaint.batch.manifest.file_names import FILES as FILES
    from lightpaint.batch.manifest.file_names import check_gallery as check_gallery
    from lightpaint.batch.manifest.file_names import is_reserved as is_reserved
    from lightpaint.batch.manifest.keys import as_key as as_key
    from lightpaint.batch.manifest.keys import parse_variations as parse_variations
    from lightpaint.batch.manifest.looks_file import (
        write_starter_manifest as write_starter_manifest,
    )
    from lightpaint.batch.plan.openjd import LOOK_PARAMETER as LOOK_PARAMETER
    from lightpaint.batch.plan.openjd import write_openjd as write_openjd
    from lightpaint.batch.plan.plan_steps import Plan as Plan
    from lightpaint.batch.plan.plan_steps import PlannedLook as PlannedLook
    from lightpaint.batch.plan.plan_steps import estimate as estimate
    from lightpaint.batch.plan.planner import plan_batch as plan_batch
    from lightpaint.batch.run import BatchOutcome as BatchOutcome
    from lightpaint.batch.run import run_batch as run_batch
    from lightpaint.batch.run_options import RunOptions as RunOptions
    from lightpaint.batch.work.derived_looks import publish_shifted as publish_shifted
    from lightpaint.batch.work.derived_looks import shifted_folders as shifted_folders
    from lightpaint.batch.work.derived_looks import variation_folder as variation_folder
    from lightpaint.batch.work.derived_looks import variation_jobs as variation_jobs
    from lightpaint.batch.work.item_execution import is_disk_full as is_disk_full
    from lightpaint.batch.work.work_items import ItemResult as ItemResult

if not TYPE_CHECKING:  # a type checker would take any name
    __getattr__, __dir__, __all__ = lazy_names(__name__)
