"""The folder that results go to: whose answer it holds, and what may be replaced there."""

import json
import os
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal

from lightpaint.errors import LightpaintError, OutputError
from lightpaint.file_reading import read_text
from lightpaint.files import check_files, check_writable, one_line, write_text
from lightpaint.pipeline.results import RESULTS
from lightpaint.storage.json_records import read_record, strict_json
from lightpaint.storage.staging import finish, is_below, staged
from lightpaint.version import __version__

FORMAT: Literal["lightpaint-result 1"] = "lightpaint-result 1"

#: What a result folder says of itself.
RECORD = "result.json"

#: What the name of a painting ends in that no file was given for.
IN_MEMORY = " (in memory)"

#: What to do about a folder that holds something else.
REMEDY = "name another folder (folder=...), or replace it (force=True)"


@dataclass(frozen=True)
class _Record:
    """What result.json says.

    answers: what the results answer, relative to the folder: paintings, or a lighting.json that the
    scene was relit with. files: relative to the folder, with the CRC-32 of what was written.
    """

    format: Literal["lightpaint-result 1"]
    answers: tuple[str, ...]
    files: Mapping[str, str]
    lightpaint: str = __version__


@dataclass(frozen=True)
class ResultFolder:
    """Where results go.

    What is there is kept, unless it is an answer to the same, as lightpaint wrote it, or `force`
    gives it up; what is read is kept in any case.

    folder: need not be there. files: in it, that may be written. reads: files that what is written
    comes from. answers: paintings, by file or, of those in memory, by name. adds_to: the lighting
    that was read; if it lies in the folder, what is written belongs to it, and it is kept.
    """

    folder: Path
    files: tuple[Path, ...]
    reads: tuple[Path, ...]
    answers: tuple[Path | str, ...]
    adds_to: Path | None = None
    force: bool = False

    def check(self) -> None:
        """Raise OutputError for what cannot be written there, or must not be replaced."""
        finish(self.folder)
        check_writable(self.folder)
        record = self._record()
        replaced = dict.fromkeys(self._gone(record) + list(self.files))
        check_files([*replaced, self.folder / RECORD], self.reads)
        there = [file for file in replaced if os.path.lexists(file)]
        if self._read_record() is None and os.path.lexists(self.folder / RECORD):
            there.append(self.folder / RECORD)
        if self.force or not there or (record is None and self._adds):
            return
        if record is None:
            raise self._unknown(there)
        if not self._is_own(record):
            raise OutputError(
                f"{self.folder} holds the answer to {self._listed(record.answers)}, not to "
                f"{self._listed(self._answers)}: {REMEDY}"
            )
        for file in there:
            known = record.files.get(file.relative_to(self.folder).as_posix())
            if known is None:
                raise OutputError(f"{file} is there, and no result of lightpaint: {REMEDY}")
            if known != _checksum(file):
                raise OutputError(f"{file} was changed since lightpaint wrote it: {REMEDY}")

    @contextmanager
    def filled(self) -> Iterator[Path]:
        """Yield a folder to write to; what is in it then appears in the true one, all at once.

        Raises OutputError as `check` does, also for what came there in between.
        """
        record = self._record()
        with staged(self.folder, self._gone(record)) as stage:
            yield stage
            self._write_record(stage, record)
            self.check()

    @property
    def _real(self) -> str:
        return os.path.realpath(self.folder)

    @property
    def _answers(self) -> list[str]:
        """`answers` as they are recorded."""
        return [
            os.path.relpath(os.path.realpath(one), self._real)
            if isinstance(one, Path)
            else one + IN_MEMORY
            for one in self.answers
        ]

    @property
    def _adds(self) -> bool:
        """Whether what is written belongs to the lighting that lies there."""
        lighting = self.folder / "lighting.json"
        return self.adds_to is not None and lighting.exists() and self.adds_to.samefile(lighting)

    def _is_own(self, record: _Record) -> bool:
        """Whether what stands there answers nothing else."""
        return self._adds or set(record.answers) <= set(self._answers)

    def _gone(self, record: _Record | None) -> list[Path]:
        """What disappears when the new results appear, if it is not among them."""
        if self._adds:
            return []
        if record is not None:
            return [self.folder / name for name in record.files]
        return earlier_results(self.folder)

    def _record(self) -> _Record | None:
        """What result.json says, if any of the files that it names is there."""
        record = self._read_record()
        if record is None:
            return None
        known = {name: value for name, value in record.files.items() if is_below(name)}
        if not any((self.folder / name).is_file() for name in known):
            return None
        return _Record(FORMAT, tuple(map(os.path.normpath, record.answers)), known)

    def _read_record(self) -> _Record | None:
        """None without a result.json, and for one of somebody else's."""
        try:
            text = read_text(self.folder / RECORD, "record", OutputError)
            return read_record(_Record, strict_json(text), others=True)
        except (LightpaintError, ValueError):
            return None

    def _write_record(self, stage: Path, earlier: _Record | None) -> None:
        """What `stage` holds, and what it answers, goes on record."""
        answers, files = tuple(self._answers), {}
        if self._adds:
            if earlier is None:  # an older version's, which goes on saying nothing of itself
                return
            answers, files = earlier.answers, dict(earlier.files)
        written = sorted(file for file in stage.rglob("*") if file.is_file())
        files |= {file.relative_to(stage).as_posix(): _checksum(file) for file in written}
        record = asdict(_Record(FORMAT, answers, files))
        write_text(stage / RECORD, json.dumps(record, indent=2, ensure_ascii=False) + "\n")

    def _listed(self, answers: Iterable[str]) -> str:
        """Recorded answers, as they are called where the command is given."""
        named = [
            one if one.endswith(IN_MEMORY) else os.path.relpath(os.path.join(self._real, one))
            for one in answers
        ]
        return one_line(" and ".join(named))

    def _unknown(self, there: list[Path]) -> OutputError:
        """What to say of a folder that does not say whose results it holds."""
        if self.folder / "lighting.json" in there:
            return OutputError(
                f"{self.folder} holds results that do not say what they answer, as an older "
                f"lightpaint left them: {REMEDY}"
            )
        return OutputError(f"{there[0]} is there, and no result of lightpaint: {REMEDY}")


def is_as_written(folder: Path) -> bool:
    """Whether all that the record of `folder` names is there, as it was written."""
    record = ResultFolder(folder, (), (), ())._read_record()
    return record is not None and all(
        is_below(name) and _checksum(folder / name) == known for name, known in record.files.items()
    )


def earlier_results(folder: Path) -> list[Path]:
    """What a version of lightpaint that kept no record left in `folder`."""
    if not (folder / "lighting.json").is_file():
        return []  # somebody else's files, whatever they are called
    return [file for pattern in RESULTS for file in folder.glob(pattern)]


def _checksum(file: Path) -> str:
    """CRC-32 of a file; "" of none."""
    if not file.is_file():
        return ""
    sum_ = 0
    with file.open("rb") as opened:
        while data := opened.read(2**24):
            sum_ = zlib.crc32(data, sum_)
    return f"{sum_:08x}"
