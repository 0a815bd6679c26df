"""What is done of a batch: a line for each step, on the disk before the next begins.

A kill leaves all lines but maybe half of the last one, which counts for nothing. Of the steps of a
look the last line holds. At the end of a run the file is written anew, in the order of the looks,
so that it does not tell how often a batch was stopped.
"""

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from lightpaint.batch.task import Kind
from lightpaint.errors import BatchError, LightpaintError, OutputError
from lightpaint.files import read_text, write_text
from lightpaint.records import read_record, strict_json

#: Its name in the folder of a batch.
JOURNAL = "journal.jsonl"

#: Longest that is read, in bytes.
MAX_BYTES = 2**28


@dataclass(frozen=True)
class Line:
    """A step that was done, or that failed. made_of: fingerprint of all that went in."""

    look: str
    kind: Kind
    state: Literal["done", "failed"]
    made_of: str
    why: str = ""


class Journal:
    """That of the batch in `folder`.

    part: of several processes that share the folder, which part of the looks this one does: it has
    a file of its own, and reads those of all.
    """

    def __init__(self, folder: Path, part: str = "") -> None:
        self._path = self._whole = folder / JOURNAL
        if part:
            self._path = folder / f"journal-{hashlib.sha256(part.encode()).hexdigest()[:16]}.jsonl"
        files = [self._whole, *sorted(folder.glob("journal-*.jsonl"))]
        self._lines = {(line.look, line.kind): line for file in files for line in _read(file)}
        # Behind half of a line nothing could be read.
        self._is_whole = not self._path.exists() or _ends_whole(self._path)

    @property
    def lines(self) -> Mapping[tuple[str, Kind], Line]:
        """The last of each look and step."""
        return self._lines

    def add(self, line: Line) -> None:
        """Keep a line, whatever comes. Raises OutputError where the disk does not take it."""
        text = ("" if self._is_whole else "\n") + _text(line)
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open("ab") as file:
                self._is_whole = False
                file.write(text.encode())
                file.flush()
                os.fsync(file.fileno())
            self._is_whole = True
        except OSError as error:
            raise OutputError(f"cannot write {self._path}: {error.strerror or error}") from error
        self._lines[line.look, line.kind] = line

    def settle(self, steps: Iterable[tuple[str, Kind]]) -> None:
        """Write it anew, with the lines of these steps alone, in this order; parts are in it."""
        kept = [self._lines[step] for step in steps if step in self._lines]
        write_text(self._whole, "".join(map(_text, kept)))
        for file in self._whole.parent.glob("journal-*.jsonl"):
            file.unlink(missing_ok=True)
        self._lines = {(line.look, line.kind): line for line in kept}
        self._is_whole = True


def _text(line: Line) -> str:
    return json.dumps(asdict(line), ensure_ascii=False) + "\n"


def _read(path: Path) -> Iterator[Line]:
    """All that is whole."""
    if not path.exists():
        return
    text = read_text(path, "journal", BatchError, limit=MAX_BYTES, may_be_empty=True)
    for row in text.split("\n"):
        with suppress(LightpaintError, ValueError):
            yield read_record(Line, strict_json(row))


def _ends_whole(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(0, os.SEEK_END)
        if file.tell() == 0:
            return True
        file.seek(-1, os.SEEK_END)
        return file.read(1) == b"\n"
