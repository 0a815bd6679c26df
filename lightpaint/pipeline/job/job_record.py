"""Jobs as JSON, to send them to another machine: paths of files, and plain values."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from lightpaint.basis import FrameSequence, find_frames
from lightpaint.errors import LightpaintError
from lightpaint.lighting import Constraints
from lightpaint.pipeline.job.settings import Settings
from lightpaint.pipeline.job.sources import (
    BasisFile,
    File,
    GroupsFile,
    Painting,
    PlacementFile,
    SceneFile,
)
from lightpaint.placement import Rigging
from lightpaint.storage.json_records import read_record, strict_json

FORMAT = "lightpaint-job 1"

#: Kinds of files of a basis, by their key in the JSON.
BASIS_KINDS: Mapping[str, type[BasisFile] | type[GroupsFile]] = {
    "BasisFile": BasisFile,
    "GroupsFile": GroupsFile,
}


@dataclass(frozen=True)
class JobRecord:
    """The fields of a job in JSON.

    basis: its fields, by the name of its kind; bases: the same of each of several views. sequence:
    its pattern.
    """

    scenes: tuple[SceneFile, ...]
    targets: tuple[Painting, ...]
    basis: Mapping[str, Mapping[str, Any]] | None
    constraints: Constraints
    settings: Settings
    folder: str
    by_sensor: bool
    rigging: Rigging = field(default_factory=Rigging)
    placement: PlacementFile | None = None
    bases: tuple[Mapping[str, Mapping[str, Any]], ...] = ()
    sequence: str | None = None


def encode_job(
    scenes: Sequence[Any],
    targets: Sequence[Any],
    basis: Any,
    constraints: Constraints,
    settings: Settings,
    *,
    folder: str,
    by_sensor: bool,
    rigging: Rigging | None = None,
    placement: Any = None,
    sequence: FrameSequence | None = None,
) -> str:
    """Return a job's fields as text. Raises LightpaintError for objects in memory."""
    bases = basis if isinstance(basis, tuple) else (basis,) if basis else ()
    groups: list[tuple[str, Sequence[Any]]]
    groups = [("scene", scenes), ("target", targets), ("basis", bases)]
    groups.append(("placement", [placement] if placement else []))
    for kind, sources in groups:
        if not all(isinstance(source, File) for source in sources):
            raise LightpaintError(
                f"this job cannot be sent: its {kind} is in memory; give the path of a file"
            )
    records = tuple({type(x).__name__: asdict(x)} for x in bases)
    record = JobRecord(
        tuple(scenes),
        tuple(targets),
        records[0] if records and not isinstance(basis, tuple) else None,
        constraints,
        settings,
        folder,
        by_sensor,
        rigging or Rigging(),
        placement,
        records if isinstance(basis, tuple) else (),
        None if sequence is None else sequence.pattern,
    )
    # `item` makes NumPy's numbers Python's.
    data = {"format": FORMAT, **asdict(record)}
    return json.dumps(data, indent=1, default=lambda number: number.item())


def decode_job(text: str) -> dict[str, Any]:
    """Return the fields that `encode_job` wrote. Raises LightpaintError for invalid text."""
    try:
        data = strict_json(text)
        if (form := data.pop("format")) != FORMAT:
            raise ValueError(f"its format is {form!r}, not {FORMAT!r}")
        # A command line may be longer than a text of a record; `Settings` checks that it is one.
        command = data["settings"].pop("command", "")
        record = read_record(JobRecord, data, is_exact=True)
        fields = {name: getattr(record, name) for name in JobRecord.__dataclass_fields__}
        bases, basis = tuple(map(_decode_basis, fields.pop("bases"))), _decode_basis(record.basis)
        return {
            **fields,
            "basis": bases or basis,
            "sequence": None if record.sequence is None else find_frames(record.sequence),
            "settings": replace(record.settings, command=command),
            "folder": Path(record.folder),
        }
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise LightpaintError(f"this is not a job: {reason}; make one with Job.to_json") from None


def _decode_basis(record: Mapping[str, Any] | None) -> BasisFile | GroupsFile | None:
    """Return the file of a basis or of light groups."""
    if record is None:
        return None
    [(kind, values)] = record.items()
    return read_record(BASIS_KINDS[kind], dict(values), is_exact=True)
