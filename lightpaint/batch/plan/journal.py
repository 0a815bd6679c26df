"""The journal of a batch: a line for each step, written to disk before the next step begins.

A kill can cut only the last line, and half a line is ignored. So is a line that the disk has
damaged: its step is done again. The last line of each step counts. At the end of a run the file is
rewritten in the order of the looks, so that it does not depend on how often the batch was stopped.

A line has a fingerprint of what its step was made of: a hash of the request, the content of its
files, and our version.
"""

import hashlib
import json
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal

from lightpaint.batch.manifest.entries import LookEntry
from lightpaint.batch.manifest.file_names import JOURNAL, JOURNAL_PART
from lightpaint.batch.manifest.keys import Final, Handover
from lightpaint.batch.work.work_items import Kind
from lightpaint.errors import BatchError, LightpaintError, OutputError
from lightpaint.files import read_bytes, write_text
from lightpaint.storage.json_records import read_record, strict_json
from lightpaint.version import __version__

#: Longest journal that is read, in bytes.
MAX_BYTES = 2**28

#: Settings that no places depend on.
IRRELEVANT_TO_PLACES: dict[str, Any] = {
    "verify": True,
    "verify_spp": None,
    "report": True,
    "suggest": 0,
}


@dataclass(frozen=True)
class JournalLine:
    """A step that was done, or that failed. made_of: fingerprint of its inputs."""

    look: str
    kind: Kind
    state: Literal["done", "failed"]
    made_of: str
    why: str = ""


class Journal:
    """Journal of the batch in `folder`.

    part: identifies this process's looks, if several processes share the folder. Each writes a file
    of its own, and reads the files of all.
    """

    def __init__(self, folder: Path, part: str = "") -> None:
        self._path = self._main_path = folder / JOURNAL
        if part:
            name = hashlib.sha256(part.encode()).hexdigest()[:16]
            self._path = folder / f"{JOURNAL_PART}{name}.jsonl"
        read = {file: _read_journal(file) for file in [self._main_path, *_parts(folder)]}
        lines = (line for file_content in read.values() for line in file_content.lines)
        self._lines = {(line.look, line.kind): line for line in lines}
        self.remarks = tuple(
            file_content.remark(file)
            for file, file_content in read.items()
            if file_content.damaged_count
        )
        own_content = read.get(self._path, _JournalContent())
        # The next line overwrites half a line; a whole line without its newline gets one first.
        self._half_line_offset, self._lacks_end = (
            own_content.half_line_offset,
            own_content.lacks_end,
        )

    @property
    def lines(self) -> Mapping[tuple[str, Kind], JournalLine]:
        """Last line of each look and step."""
        return self._lines

    def add(self, line: JournalLine) -> None:
        """Append a line durably. Raises OutputError if it cannot be written."""
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open("ab") as file:
                if self._half_line_offset is not None:
                    file.truncate(self._half_line_offset)
                self._half_line_offset = os.fstat(file.fileno()).st_size
                file.write((b"\n" if self._lacks_end else b"") + _to_text(line).encode())
                file.flush()
                os.fsync(file.fileno())
            self._half_line_offset, self._lacks_end = None, False
        except OSError as error:
            raise OutputError(f"cannot write {self._path}: {error.strerror or error}") from error
        self._lines[line.look, line.kind] = line

    def rewrite(self, steps: Iterable[tuple[str, Kind]]) -> None:
        """Rewrite the file with the lines of these steps alone, in this order, and merge parts."""
        lines = [self._lines[step] for step in steps if step in self._lines]
        write_text(self._main_path, "".join(map(_to_text, lines)))
        for file in _parts(self._main_path.parent):
            file.unlink(missing_ok=True)
        self._lines = {(line.look, line.kind): line for line in lines}
        self._half_line_offset, self._lacks_end = None, False


def _to_text(line: JournalLine) -> str:
    return json.dumps(asdict(line), ensure_ascii=False) + "\n"


def _parts(folder: Path) -> list[Path]:
    """Return the files of all processes that share the folder."""
    return sorted(folder.glob(f"{JOURNAL_PART}*.jsonl"))


@dataclass(frozen=True)
class _JournalContent:
    """The content of a journal file.

    damaged_count: number of unreadable lines. half_line_offset: where an incomplete last line
    begins, if there is one. lacks_end: whether the last line lacks only its newline.
    """

    lines: tuple[JournalLine, ...] = ()
    damaged_count: int = 0
    half_line_offset: int | None = None
    lacks_end: bool = False

    def remark(self, path: Path) -> str:
        """Return a remark on the damage for the user."""
        lines, steps = (
            ("a line", "its step") if self.damaged_count == 1 else ("lines", "their steps")
        )
        count = "" if self.damaged_count == 1 else f"{self.damaged_count} "
        return f"{path} has {count}{lines} that cannot be read: {steps} will be done again"


def _read_journal(path: Path) -> _JournalContent:
    """Return all whole lines. Each is read by itself, so that damage in one costs no other."""
    if not path.exists():
        return _JournalContent()
    data = read_bytes(path, "journal", BatchError, limit=MAX_BYTES, may_be_empty=True)
    *rows, last = data.split(b"\n")
    parsed = [_parse_line(row) for row in rows]
    # A kill may have cut the last line; its step is begun again anyway.
    end = _parse_line(last)
    half_line_offset = len(data) - len(last) if last and end is None else None
    damaged_count = sum(
        line is None and bool(row.strip()) for row, line in zip(rows, parsed, strict=True)
    )
    return _JournalContent(
        tuple(x for x in (*parsed, end) if x), damaged_count, half_line_offset, end is not None
    )


def _parse_line(row: bytes) -> JournalLine | None:
    """Return the journal line in a row, or None."""
    try:
        return read_record(JournalLine, strict_json(row.decode("utf-8-sig")))
    except (LightpaintError, ValueError, RecursionError):
        return None


class Fingerprints:
    """Fingerprints of one manifest's looks.
    Paths are relative to the manifest's folder, so that it may be moved.
    """

    def __init__(self, base: Path) -> None:
        self._base = base
        self._sums: dict[Path, str] = {}
        self._answers: dict[str, str] = {}

    def answer(self, entry: LookEntry, source_files: Sequence[Path], places: str = "") -> str:
        """Return the fingerprint of an answer; call this for the looks that it combines first.

        source_files: files whose content counts. places: fingerprint of its lights' places.
        Raises OutputError if one cannot be read.
        """
        inputs = [
            __version__,
            self._request(entry),
            sorted(self._content(file) for file in source_files),
            [self._answers[name] for name in entry.combined_looks],
            *(["lights"] if entry.is_by_sums else []),
            *([places] if places else []),
        ]
        self._answers[entry.name] = _sha256(json.dumps(inputs, default=str))
        return self._answers[entry.name]

    def places(self, looks: Sequence[tuple[LookEntry, Sequence[Path]]]) -> str:
        """Return the fingerprint of the places that looks share. looks: with the files they read.

        Raises OutputError if one cannot be read.
        """
        inputs = []
        for entry, source_files in looks:
            normalized = replace(entry, settings=replace(entry.settings, **IRRELEVANT_TO_PLACES))
            inputs.append([self._request(normalized), sorted(map(self._content, source_files))])
        return _sha256(json.dumps([__version__, inputs], default=str))

    def _request(self, entry: LookEntry) -> Any:
        """Return the request of a look as plain values; its steps have separate fingerprints."""
        normalized = replace(
            entry, label="", want=(), final=Final(), handover=Handover(), places=""
        )
        return _relative(asdict(normalized), self._base)

    def render(self, entry: LookEntry) -> str:
        """Return the fingerprint of a final render."""
        return _sha256(json.dumps([self._answers[entry.name], asdict(entry.final)]))

    def export(self, entry: LookEntry) -> str:
        """Return the fingerprint of the exports for other programs."""
        stage = [self._content(Path(entry.handover.stage))] if entry.handover.stage else []
        values = _relative(asdict(entry.handover), self._base)
        return _sha256(json.dumps([self._answers[entry.name], values, stage]))

    def _content(self, file: Path) -> str:
        """Return the SHA-256 of a file; each is read once."""
        if file not in self._sums:
            try:
                with file.open("rb") as stream:
                    self._sums[file] = hashlib.file_digest(stream, "sha256").hexdigest()
            except OSError as error:
                raise OutputError(f"cannot read {file}: {error.strerror or error}") from error
        return self._sums[file]


def _relative(values: Any, base: Path) -> Any:
    """Return plain values with their paths relative to `base`."""
    if isinstance(values, dict):
        return {key: _relative(value, base) for key, value in values.items()}
    if isinstance(values, list | tuple):
        return [_relative(value, base) for value in values]
    if isinstance(values, str) and base.parts and values.startswith(f"{base}{os.sep}"):
        return os.path.relpath(values, base)
    return values


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
