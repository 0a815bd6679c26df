"""Names of files: those that a pattern of a manifest finds, and those in the folder of a batch."""

import os
import unicodedata
from collections.abc import Iterable, Iterator
from contextlib import suppress
from fnmatch import translate
from functools import cache
from glob import has_magic
from pathlib import Path
from re import Pattern, compile

from lightpaint.errors import BatchError, LightpaintError, OutputError
from lightpaint.files import read_text
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


#: Maximum number of files and folders that one pattern may visit, and the greatest depth of `**`.
MAX_VISITED, MAX_DEPTH = 20_000, 32


def files_matching(pattern: str, base: Path = Path()) -> list[str]:
    """Return the files that match a pattern, relative to a folder, each once, in no order.

    `*`, `?` and `[...]` match characters of a name, and `**` matches folders; neither matches a
    name that begins with a dot, and `**` follows no links. In `base` they stand for themselves.
    Raises BatchError if there are too many files to visit.
    """
    parts = Path(pattern).parts
    fixed_count = next(k for k, part in enumerate(parts) if has_magic(part))
    # Several `**` in a row mean the same as one.
    pattern_tail = parts[fixed_count:]
    pattern_parts = [
        x
        for k, x in enumerate(pattern_tail)
        if x != "**" or pattern_tail[max(k - 1, 0) : k] != ("**",)
    ]
    start = os.path.join("" if base == Path() else base, *parts[:fixed_count])
    paths = dict.fromkeys(_Search(pattern).walk(start, tuple(pattern_parts), 0))
    return [path for path in paths if os.path.isfile(path)]


class _Search:
    """A walk through folders that counts the files it visits."""

    def __init__(self, pattern: str) -> None:
        self._pattern, self._visited_count = pattern, 0
        self._visited: set[tuple[str, int]] = set()

    def walk(self, folder: str, parts: tuple[str, ...], depth: int) -> Iterator[str]:
        """Yield the paths in a folder that match the parts."""
        if (folder, len(parts)) in self._visited:
            return
        self._visited.add((folder, len(parts)))
        first, *remaining_list = parts
        remaining = tuple(remaining_list)
        if first == "**":
            if remaining:
                yield from self.walk(folder, remaining, depth)
            for name, is_folder in self._list_folder(folder):
                path = os.path.join(folder, name)
                if name.startswith("."):
                    continue
                if not remaining:
                    yield path
                if is_folder and depth < MAX_DEPTH:
                    yield from self.walk(path, parts, depth + 1)
        elif not has_magic(first):
            path = os.path.join(folder, first)
            if not remaining:
                yield path
            elif os.path.isdir(path):
                yield from self.walk(path, remaining, depth)
        else:
            for name, _ in self._list_folder(folder):
                if not _regex(first).match(name):
                    continue
                if name.startswith(".") and not first.startswith("."):
                    continue
                path = os.path.join(folder, name)
                if not remaining:
                    yield path
                elif os.path.isdir(path):
                    yield from self.walk(path, remaining, depth)

    def _list_folder(self, folder: str) -> list[tuple[str, bool]]:
        """Return the names in a folder, and which are folders; none if it cannot be read."""
        listing = []
        try:
            with os.scandir(folder or ".") as entries:
                for entry in entries:
                    self._visited_count += 1
                    if self._visited_count > MAX_VISITED:
                        raise BatchError(
                            f"the pattern {self._pattern!r} has more than {MAX_VISITED} files "
                            "to look at: name a folder nearer to them"
                        )
                    listing.append((entry.name, entry.is_dir(follow_symlinks=False)))
        except OSError:
            return []
        return listing


@cache
def _regex(part: str) -> Pattern[str]:
    return compile(translate(part))
