"""Names in the folder of a batch: those of looks, and those that the batch needs for itself."""

import unicodedata
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from lightpaint.errors import LightpaintError, OutputError
from lightpaint.file_reading import read_text
from lightpaint.sentences import Hint
from lightpaint.storage.json_records import strict_json

#: The summary for programs, and the format that it names.
SUMMARY, SUMMARY_FORMAT = "summary.json", "lightpaint-batch 1"

#: Files that a batch writes beside its looks, and may replace.
FILES = ("index.html", "contact.png", "summary.csv", SUMMARY)

#: Name of the journal in the folder of a batch; and how the name of a part's journal begins.
JOURNAL, JOURNAL_PART = "journal.jsonl", "journal-"

#: The folders of small pictures, and of places of lights.
THUMBNAILS, PLACES = "thumbnails", "places"


def fold_name(name: str) -> str:
    """Return the form that two names share if macOS or Windows takes them for the same file."""
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())


def is_reserved(name: str) -> bool:
    """Return whether the batch reserves a name for its own files.

    Hidden names are reserved, too: for files that are being written, and for the cache of a farm.
    """
    name = fold_name(name)
    if name.startswith(JOURNAL_PART) and name.endswith(".jsonl"):
        return True
    return name.startswith(".") or name in (*FILES, JOURNAL, THUMBNAILS, PLACES)


def name_clashes(names: Iterable[str]) -> list[list[str]]:
    """Return groups of names that are the same on some disks, each name once.

    A name that occurs twice clashes with itself, and is a group of one.
    """
    names_by_form: dict[str, list[str]] = {}
    for name in names:
        names_by_form.setdefault(fold_name(name), []).append(name)
    return [list(dict.fromkeys(same)) for same in names_by_form.values() if len(same) > 1]


def check_gallery(folder: Path, *, force: bool = False) -> None:
    """Raise OutputError if a gallery would replace files that no batch has written."""
    existing_files = [folder / name for name in FILES if (folder / name).exists()]
    if existing_files and not force and not _is_summary(folder / SUMMARY):
        raise OutputError(
            f"{existing_files[0]} is there, and of no batch: name another folder (",
            Hint("folder"),
            "), or replace it (",
            Hint("force", True),
            ")",
        )


def _is_summary(path: Path) -> bool:
    """Return whether a file is the summary of a batch."""
    with suppress(LightpaintError, ValueError):
        record = strict_json(read_text(path, "summary", LightpaintError))
        return isinstance(record, dict) and record.get("format") == SUMMARY_FORMAT
    return False
