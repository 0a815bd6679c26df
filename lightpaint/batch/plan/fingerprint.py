"""What went into a result, in one number: what was asked, the content of files, our version."""

import hashlib
import json
import os
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from lightpaint.batch.manifest.entries import LookEntry
from lightpaint.batch.manifest.keys import Final, Handover
from lightpaint.errors import OutputError
from lightpaint.version import __version__


class Fingerprints:
    """Of the looks of one manifest. Paths are told from its folder, so that it may be moved."""

    def __init__(self, base: Path) -> None:
        self._base = base
        self._sums: dict[Path, str] = {}
        self._answers: dict[str, str] = {}

    def answer(self, entry: LookEntry, reads: Sequence[Path]) -> str:
        """Of all that goes into an answer; looks that it is made of have been asked for before.

        reads: files whose content counts. Raises OutputError for one that cannot be read.
        """
        told = asdict(replace(entry, where="", want=(), final=Final(), handover=Handover()))
        made_of = [
            __version__,
            _relative(told, self._base),
            sorted(self._content(file) for file in reads),
            [self._answers[name] for name in entry.of],
            *(["lights"] if entry.is_by_sums else []),
        ]
        self._answers[entry.name] = _sum(json.dumps(made_of, default=str))
        return self._answers[entry.name]

    def render(self, entry: LookEntry) -> str:
        """Of all that goes into a final render."""
        return _sum(json.dumps([self._answers[entry.name], asdict(entry.final)]))

    def export(self, entry: LookEntry) -> str:
        """Of all that other programs get."""
        stage = [self._content(Path(entry.handover.stage))] if entry.handover.stage else []
        told = _relative(asdict(entry.handover), self._base)
        return _sum(json.dumps([self._answers[entry.name], told, stage]))

    def _content(self, file: Path) -> str:
        """SHA-256 of a file; each is read once."""
        if file not in self._sums:
            try:
                with file.open("rb") as opened:
                    self._sums[file] = hashlib.file_digest(opened, "sha256").hexdigest()
            except OSError as error:
                raise OutputError(f"cannot read {file}: {error.strerror or error}") from error
        return self._sums[file]


def _relative(told: Any, base: Path) -> Any:
    """Paths in plain values, from `base`."""
    if isinstance(told, dict):
        return {key: _relative(value, base) for key, value in told.items()}
    if isinstance(told, list | tuple):
        return [_relative(value, base) for value in told]
    if isinstance(told, str) and base.parts and told.startswith(f"{base}{os.sep}"):
        return os.path.relpath(told, base)
    return told


def _sum(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
