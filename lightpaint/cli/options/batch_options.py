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
        help="with --only: share the folder with others that do other looks at the same time; the "
        "next run without it writes the gallery",
    )
    parser.add_argument(
        "--export",
        choices=("openjd",),
        help="do nothing, but write an Open Job Description template for a farm to the folder that "
        "is named behind the manifest",
    )
    parser.add_argument("--log", metavar="FILE", help="add a line with its time for each step")
    add_force(parser)


def _add_looks(parser: argparse.ArgumentParser) -> None:
    """Add options for the looks and their folder."""
    parser.add_argument(
        "paths",
        metavar="looks.toml",
        nargs="+",
        help="manifest of looks; with --init a scene, then paintings",
    )
    add_output(
        parser,
        "DIR",
        "folder for all looks (default: named after the manifest); with --init the file to write "
        "(default: looks.toml)",
    )
    parser.add_argument(
        "--init", action="store_true", help="write a first manifest, and do nothing else"
    )
    parser.add_argument(
        "--dry-run",
        action="store_true",
        help="only check it, and say what would be done, with time and memory",
    )
    parser.add_argument("--only", metavar="PATTERN", help="only looks of such names, like 'dusk-*'")


def _add_failures(parser: argparse.ArgumentParser) -> None:
    """Add options for the handling of failed steps."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument(
        "--keep-going",
        dest="keep_going",
        action="store_true",
        default=True,
        help="a look that fails stops no other (default)",
    )
    group.add_argument(
        "--stop-early",
        dest="keep_going",
        action="store_false",
        help="begin nothing more once a look has failed",
    )
    parser.add_argument(
        "--retry",
        type=arguments.at_least(0, most=100),
        default=0,
        metavar="N",
        help="try a failed step up to N more times (default: %(default)s)",
    )


def _add_workers(parser: argparse.ArgumentParser) -> None:
    """Add options for workers: local processes, or a cluster."""
    parser.add_argument(
        "--workers",
        type=arguments.at_least(1, most=1024),
        default=1,
        metavar="N",
        help="processes that share the looks; 1 for this one alone (default: %(default)s)",
    )
    parser.add_argument(
        "--cluster",
        metavar="ADDRESS",
        help="have workers of a Dask cluster do the work, bases in parts among it, by the address "
        "of its scheduler, like tcp://scheduler:8786",
    )
    parser.add_argument(
        "--shared-fs",
        dest="shared_fs",
        action="store_true",
        help="with --cluster: workers see all files under the same paths, so that none is sent",
    )
    parser.add_argument(
        "--task-limit",
        dest="task_limit_s",
        type=arguments.number(" of seconds"),
        metavar="SECONDS",
        help="with --cluster: a worker that takes longer over something counts as hung, and "
        "another does it (default: 20 times what it is expected to take, at least 300)",
    )
