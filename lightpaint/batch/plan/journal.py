"""What is done of a batch: a line for each step, on the disk before the next begins.

A kill leaves all lines but maybe half of the last one, which counts for nothing. Nor does a line
that a disk has damaged: its step is done again. Of the steps of a look the last line holds. At the
end of a run the file is written anew, in the order of the looks, so that it does not tell how often
a batch was stopped.
"""

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from lightpaint.batch.manifest.folder_names import JOURNAL, JOURNAL_PART
from lightpaint.batch.work.task import Kind
from lightpaint.errors import BatchError, LightpaintError, OutputError
from lightpaint.files import read_bytes, write_text
from lightpaint.storage.json_records import read_record, strict_json

#: Longest that is read, in bytes.
MAX_BYTES = 2**28


@dataclass(frozen=True)
class JournalLine:
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
            name = hashlib.sha256(part.encode()).hexdigest()[:16]
            self._path = folder / f"{JOURNAL_PART}{name}.jsonl"
        read = {file: _read(file) for file in [self._whole, *_parts(folder)]}
        lines = (line for one in read.values() for line in one.lines)
        self._lines = {(line.look, line.kind): line for line in lines}
        self.remarks = tuple(one.remark(file) for file, one in read.items() if one.damaged)
        own = read.get(self._path, _Read())
        # Half of a line gives way to the next one; behind a line without its end goes the end.
        self._half, self._lacks_end = own.half, own.lacks_end

    @property
    def lines(self) -> Mapping[tuple[str, Kind], JournalLine]:
        """The last of each look and step."""
        return self._lines

    def add(self, line: JournalLine) -> None:
        """Keep a line, whatever comes. Raises OutputError where the disk does not take it."""
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open("ab") as file:
                if self._half is not None:
                    file.truncate(self._half)
                self._half = os.fstat(file.fileno()).st_size
                file.write((b"\n" if self._lacks_end else b"") + _text(line).encode())
                file.flush()
                os.fsync(file.fileno())
            self._half, self._lacks_end = None, False
        except OSError as error:
            raise OutputError(f"cannot write {self._path}: {error.strerror or error}") from error
        self._lines[line.look, line.kind] = line

    def settle(self, steps: Iterable[tuple[str, Kind]]) -> None:
        """Write it anew, with the lines of these steps alone, in this order; parts are in it."""
        kept = [self._lines[step] for step in steps if step in self._lines]
        write_text(self._whole, "".join(map(_text, kept)))
        for file in _parts(self._whole.parent):
            file.unlink(missing_ok=True)
        self._lines = {(line.look, line.kind): line for line in kept}
        self._half, self._lacks_end = None, False


def _text(line: JournalLine) -> str:
    return json.dumps(asdict(line), ensure_ascii=False) + "\n"


def _parts(folder: Path) -> list[Path]:
    """Return the files of those who share the folder."""
    return sorted(folder.glob(f"{JOURNAL_PART}*.jsonl"))


@dataclass(frozen=True)
class _Read:
    """Return what a file holds.

    damaged: how many lines say nothing. half: where in the file half of a line begins, if one does.
    lacks_end: whether nothing but its end is missing of the last one.
    """

    lines: tuple[JournalLine, ...] = ()
    damaged: int = 0
    half: int | None = None
    lacks_end: bool = False

    def remark(self, path: Path) -> str:
        """Return what a person should know of the damage."""
        lines, they = ("a line", "its step") if self.damaged == 1 else ("lines", "their steps")
        count = "" if self.damaged == 1 else f"{self.damaged} "
        return f"{path} has {count}{lines} that cannot be read: {they} will be done again"


def _read(path: Path) -> _Read:
    """Return all that is whole. The lines are read one by one: damage in one costs no other."""
    if not path.exists():
        return _Read()
    data = read_bytes(path, "journal", BatchError, limit=MAX_BYTES, may_be_empty=True)
    *rows, last = data.split(b"\n")
    found = [_line(row) for row in rows]
    # Of the last one a kill may have left half, and its step is begun again anyway.
    end = _line(last)
    half = len(data) - len(last) if last and end is None else None
    damaged = sum(line is None and bool(row.strip()) for row, line in zip(rows, found, strict=True))
    return _Read(tuple(x for x in (*found, end) if x), damaged, half, end is not None)


def _line(row: bytes) -> JournalLine | None:
    """Return the line that a row is, or None."""
    try:
        return read_record(JournalLine, strict_json(row.decode("utf-8-sig")))
    except (LightpaintError, ValueError, RecursionError):
        return None
