"""Options of `batch`: looks, handling of failures, and workers."""

import argparse

from lightpaint.cli.options import arguments
from lightpaint.cli.options.option_groups import add_force, add_output


def add_batch(parser: argparse.ArgumentParser) -> None:
    """Add all options of the command."""
    _add_looks(parser)
    _add_failures(parser)
    _add_workers(parser)
    parser.add_argument(
        "--apart",
        action="store_true",
        help="with --only: share the folder with processes that do other looks at the same time; "
        "the next run without this option writes the gallery",
    )
    parser.add_argument(
        "--export",
        choices=("openjd",),
        help="write a job for a render farm, as an Open Job Description template, into the "
        "folder that follows the manifest, and do nothing else",
    )
    parser.add_argument(
        "--log", metavar="FILE", help="append a line with the time of each step to this file"
    )
    add_force(parser)


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
    group.add_argument(
        "--stop-early",
        dest="keep_going",
        action="store_false",
        help="start nothing more after a look has failed",
    )
    parser.add_argument(
        "--retry",
        type=arguments.at_least(0, maximum=100),
        default=0,
        metavar="N",
        help="try a failed step up to N more times (default: %(default)s)",
    )


def _add_workers(parser: argparse.ArgumentParser) -> None:
    """Add options for workers: local processes, or a cluster."""
    parser.add_argument(
        "--workers",
        type=arguments.at_least(1, maximum=1024),
        default=1,
        metavar="N",
        help="number of processes that share the looks (default: %(default)s)",
    )
    parser.add_argument(
        "--cluster",
        metavar="ADDRESS",
        help="let workers of a Dask cluster do the looks, and parts of bases; ADDRESS is that of "
        "its scheduler, like tcp://scheduler:8786",
    )
    parser.add_argument(
        "--shared-fs",
        dest="shared_fs",
        action="store_true",
        help="with --cluster: send no files, because workers see them all under the same paths",
    )
    parser.add_argument(
        "--task-limit",
        dest="task_limit_s",
        type=arguments.number(" of seconds"),
        metavar="SECONDS",
        help="end a step after this time: its look fails, and the others go on. With --cluster, "
        "another worker tries it (default: 20 times what it is expected to take, at least 300)",
    )
