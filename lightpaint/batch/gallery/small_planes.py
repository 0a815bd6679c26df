"""Small planes of a basis, kept beside the looks and shared by all of them.

The gallery's mixer uses them when the basis is gone.
"""

import hashlib
import json
import os
from collections.abc import Collection, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from lightpaint.basis.basis import Basis
from lightpaint.basis.light_images import light_images
from lightpaint.basis.lightgroups.light_groups import LightGroups
from lightpaint.batch.manifest.folder_names import THUMBNAILS
from lightpaint.batch.work.item_execution import job_fields
from lightpaint.batch.work.task import Task
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.errors import LightpaintError
from lightpaint.file_reading import read_text
from lightpaint.files import write_text
from lightpaint.pipeline.job.sources import content
from lightpaint.report.page.mixer import light_data, planes_for_page
from lightpaint.storage.json_records import strict_json
from lightpaint.version import __version__

#: Suffix of the files' names.
SUFFIX = ".planes.json"

#: Number of the format, which changes with its fields.
FORMAT = 2

#: Longest file that is read, in bytes.
MAX_BYTES = 2**27


def planes_name(folder: Path, key: str) -> str:
    """Return the name of a basis' small planes in the folder of a batch. key: of `bases_of`.

    Paths are relative to the folder, so that a batch finds its planes after a move with its files.
    """
    base = os.path.realpath(folder)
    record = json.dumps(_relative_paths(json.loads(key), base))
    return hashlib.sha256(record.encode()).hexdigest()[:16]


def write_planes(folder: Path, key: str, basis: Basis) -> None:
    """Write a basis' small planes for the gallery in `folder`, unless they exist."""
    path = folder / THUMBNAILS / f"{planes_name(folder, key)}{SUFFIX}"
    identity = _identity(basis)
    if read_planes(path).get("identity") == identity:
        return
    is_noisy = any(x.any() for x in basis.noise)
    size, planes = planes_for_page(basis, is_clean=is_noisy)
    record = {
        "identity": identity,
        "scene": Path(basis.origin.scene).name,
        "sensor": basis.origin.sensor,
        "size": size,
        "totals": [float(sum(total)) for total in basis.totals],
        "lights": [
            {**light_data(x), "present": list(map(float, x.emission))} for x in basis.lights
        ],
        "images": [
            {
                "label": image.name,
                "columns": image.size[0],
                "members": image.lights.tolist(),
                "places": image.map_order,
            }
            for image in light_images(basis.lights)
            if image.is_whole
        ],
        "planes": planes,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, json.dumps(record, ensure_ascii=False, allow_nan=False) + "\n")


def write_task_planes(folder: Path, task: Task, bases: Sequence[Basis], cache: WorkerCache) -> None:
    """Write the small planes of a task's bases. bases: those that were not read from files."""
    if not bases:
        source = content(job_fields(task, cache)["basis"])
        bases = [source.basis if isinstance(source, LightGroups) else source]
    for key, basis in zip(task.bases, bases, strict=True):
        write_planes(folder, key, basis)


def read_planes(path: Path) -> dict[str, Any]:
    """Return the record that `write_planes` wrote; {} if it cannot be read."""
    with suppress(LightpaintError, ValueError):
        record = strict_json(read_text(path, "planes", LightpaintError, limit=MAX_BYTES))
        return record if isinstance(record, dict) else {}
    return {}


def drop_planes(folder: Path, used_names: Collection[str]) -> None:
    """Delete small planes that no look uses. used_names: names of those to keep."""
    for path in (folder / THUMBNAILS).glob(f"*{SUFFIX}"):
        if path.name.removesuffix(SUFFIX) not in used_names:
            path.unlink(missing_ok=True)


def _identity(basis: Basis) -> str:
    """Return a hash of everything that is shown of a basis: equal hashes mean equal samples."""
    lights = [(light.name, light.unit, list(light.emission)) for light in basis.lights]
    record = [__version__, FORMAT, basis.origin.scene_identity, basis.origin.halves, lights]
    text = json.dumps([*record, basis.totals.tolist()], default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def _relative_paths(record: Any, base: str) -> Any:
    """Return plain values with their paths relative to `base`."""
    if isinstance(record, dict):
        return {key: _relative_paths(value, base) for key, value in record.items()}
    if isinstance(record, str) and os.sep in record:
        return os.path.relpath(os.path.realpath(record), base)
    return record
