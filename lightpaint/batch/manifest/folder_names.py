"""Names in the folder of a batch: those of looks, and those that the batch needs for itself."""

import unicodedata
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from lightpaint.errors import LightpaintError, OutputError
from lightpaint.file_reading import read_text
from lightpaint.storage.json_records import strict_json

#: The summary for programs, and the format that it names.
SUMMARY, SUMMARY_FORMAT = "summary.json", "lightpaint-batch 1"

#: Files that a batch writes beside its looks, and may replace.
FILES = ("index.html", "contact.png", "summary.csv", SUMMARY)

#: Name of the journal in the folder of a batch; and how the name of a part's journal begins.
JOURNAL, JOURNAL_PART = "journal.jsonl", "journal-"

#: The folder of small pictures.
THUMBNAILS = "thumbnails"


def folded(name: str) -> str:
    """Return what two names have in common that some disks take for one: Mac's and Windows'."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())


def is_reserved(name: str) -> bool:
    """Return whether a look of that name would lie where the batch writes files of its own.

    Hidden names are the batch's, too: a file that is being written, and the cache of a farm.
    """
    name = folded(name)
    if name.startswith(JOURNAL_PART) and name.endswith(".jsonl"):
        return True
    return name.startswith(".") or name in (*FILES, JOURNAL, THUMBNAILS)


def name_clashes(names: Iterable[str]) -> list[list[str]]:
    """Return the names that some disks take for one, together, each once; [] where there are none.

    A name that stands twice clashes with itself, and is a list of one.
    """
    alike: dict[str, list[str]] = {}
    for name in names:
        alike.setdefault(folded(name), []).append(name)
    return [list(dict.fromkeys(same)) for same in alike.values() if len(same) > 1]


def check_gallery(folder: Path, *, force: bool = False) -> None:
    """Raise OutputError where a gallery would take the place of somebody else's files."""
    there = [folder / name for name in FILES if (folder / name).exists()]
    if there and not force and not _is_summary(folder / SUMMARY):
        raise OutputError(
            f"{there[0]} is there, and of no batch: name another folder (folder=...), or replace "
            "it (force=True)"
        )


def _is_summary(path: Path) -> bool:
    """Return whether a file is the summary of a batch."""
    with suppress(LightpaintError, ValueError):
        record = strict_json(read_text(path, "summary", LightpaintError))
        return isinstance(record, dict) and record.get("format") == SUMMARY_FORMAT
    return False
