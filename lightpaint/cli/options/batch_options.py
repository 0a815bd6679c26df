"""Options of `batch`: looks, handling of failures, and workers."""

import argparse

from lightpaint.batch.run_options import RunOptions
from lightpaint.cli.options.option_groups import add_fields, add_output
from lightpaint.pipeline.job.settings import Settings


def add_batch(parser: argparse.ArgumentParser) -> None:
    """Add all options of the command."""
    _add_looks(parser)
    _add_failures(parser)
    _add_workers(parser)
    add_fields(parser, RunOptions, "shares_folder")
    parser.add_argument(
        "--export",
        choices=("openjd",),
        help="write a job for a render farm, as an Open Job Description template, into the "
        "folder that follows the manifest, and do nothing else",
    )
    parser.add_argument(
        "--log", metavar="FILE", help="append a line with the time of each step to this file"
    )
    add_fields(parser, Settings, "force")


def _add_looks(parser: argparse.ArgumentParser) -> None:
    """Add options for the looks and their folder."""
    parser.add_argument(
        "paths",
        metavar="looks.toml",
        nargs="+",
        help="manifest of looks; with --init a scene, followed by paintings",
    )
    add_output(
        parser,
        "DIR",
        "folder for all looks (default: named after the manifest); with --init the file to write "
        "(default: looks.toml)",
    )
    parser.add_argument(
        "--init",
        action="store_true",
        help="write a first manifest for a scene and paintings, and do nothing else",
    )
    parser.add_argument(
        "--dry-run",
        action="store_true",
        help="check the manifest and print the steps to do, with estimates of time and memory, "
        "but do none",
    )
    parser.add_argument(
        "--only",
        action="append",
        default=[],
        metavar="PATTERN",
        help="do only looks whose names match, like 'dusk-*'; repeat it for several patterns",
    )


def _add_failures(parser: argparse.ArgumentParser) -> None:
    """Add options for the handling of failed steps."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument(
        "--keep-going",
        dest="keep_going",
        action="store_true",
        default=True,
        help="continue with the other looks after one has failed (default)",
    )
    add_fields(group, RunOptions, "keep_going")
    add_fields(parser, RunOptions, "retry")


def _add_workers(parser: argparse.ArgumentParser) -> None:
    """Add options for workers: local processes, or a cluster."""
    add_fields(parser, RunOptions, "workers", "cluster", "shared_fs", "task_limit_s")
