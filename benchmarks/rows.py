"""Rows of a benchmark as CSV for docs/benchmarks/, which docs/benchmarks.md links to."""

import csv
from argparse import ArgumentParser
from collections.abc import Mapping, Sequence
from pathlib import Path


def add_csv(parser: ArgumentParser) -> None:
    """Add the option that names the file."""
    parser.add_argument("--csv", type=Path, metavar="FILE", help="also write the rows as CSV")


def write_rows(path: Path | None, rows: Sequence[Mapping[str, object]]) -> None:
    """Write rows by the names of their columns, if a file is named.

    A column stands where its name comes first. What a row lacks stays empty.
    """
    if path is None:
        return
    names = list(dict.fromkeys(name for row in rows for name in row))
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, names, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
