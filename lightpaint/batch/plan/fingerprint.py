"""Fingerprints of results: hashes of the request, the content of its files, and our version."""

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

#: Settings that no places depend on.
IRRELEVANT_TO_PLACES: dict[str, Any] = {
    "verify": True,
    "verify_spp": None,
    "report": True,
    "suggest": 0,
}


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
