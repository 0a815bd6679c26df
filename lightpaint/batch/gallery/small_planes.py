"""What each light of a basis does, small: kept beside the looks, once for all of them.

A gallery's mixer is made of it, when no basis is at hand any more.
"""

import hashlib
import json
import os
from collections.abc import Collection, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from lightpaint.basis.basis import Basis
from lightpaint.basis.lightgroups.read import LightGroups
from lightpaint.batch.manifest.folder_names import THUMBNAILS
from lightpaint.batch.work.task import Task
from lightpaint.batch.work.work import fields_of
from lightpaint.batch.work.worker_cache import WorkerCache
from lightpaint.errors import LightpaintError
from lightpaint.files import read_text, write_text
from lightpaint.pipeline.sources import content
from lightpaint.report.page.mixer import planes_for_page, told_light
from lightpaint.storage.json_records import strict_json
from lightpaint.version import __version__

#: What their names end in.
SUFFIX = ".planes.json"

#: Longest that is read, in bytes.
MAX_BYTES = 2**27


def planes_name(folder: Path, key: str) -> str:
    """The name of those of a basis in the folder of a batch. key: as of `bases_of`.

    Paths count from the folder, so that a batch that is moved with its files finds its own.
    """
    base = os.path.realpath(folder)
    told = json.dumps(_from_there(json.loads(key), base))
    return hashlib.sha256(told.encode()).hexdigest()[:16]


def keep_planes(folder: Path, key: str, basis: Basis) -> None:
    """Write what a gallery in `folder` needs of a basis, unless it is there."""
    path = folder / THUMBNAILS / f"{planes_name(folder, key)}{SUFFIX}"
    identity = _identity(basis)
    if read_planes(path).get("identity") == identity:
        return
    is_noisy = any(x.any() for x in basis.noise)
    size, planes = planes_for_page(basis, is_clean=is_noisy)
    told = {
        "identity": identity,
        "scene": Path(basis.origin.scene).name,
        "sensor": basis.origin.sensor,
        "size": size,
        "totals": [float(sum(total)) for total in basis.totals],
        "lights": [
            {**told_light(x), "present": list(map(float, x.emission))} for x in basis.lights
        ],
        "planes": planes,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, json.dumps(told, ensure_ascii=False, allow_nan=False) + "\n")


def keep_all_planes(folder: Path, task: Task, obtained: Sequence[Basis], held: WorkerCache) -> None:
    """The same of each basis of a task. obtained: those that are no files already."""
    bases = list(obtained)
    if not bases:
        given = content(fields_of(task, held)["basis"])
        bases = [given.basis if isinstance(given, LightGroups) else given]
    for key, basis in zip(task.bases, bases, strict=True):
        keep_planes(folder, key, basis)


def read_planes(path: Path) -> dict[str, Any]:
    """What `keep_planes` wrote; {} where there is nothing that can be read."""
    with suppress(LightpaintError, ValueError):
        told = strict_json(read_text(path, "planes", LightpaintError, limit=MAX_BYTES))
        return told if isinstance(told, dict) else {}
    return {}


def drop_planes(folder: Path, kept: Collection[str]) -> None:
    """Delete those of bases that no look has any more. kept: names."""
    for path in (folder / THUMBNAILS).glob(f"*{SUFFIX}"):
        if path.name.removesuffix(SUFFIX) not in kept:
            path.unlink(missing_ok=True)


def _identity(basis: Basis) -> str:
    """Of all that is told of a basis: two with the same are of the same samples."""
    lights = [(light.name, light.unit, list(light.emission)) for light in basis.lights]
    told = [__version__, basis.origin.scene_identity, basis.origin.halves, lights]
    text = json.dumps([*told, basis.totals.tolist()], default=str)
    return hashlib.sha256(text.encode()).hexdigest()


def _from_there(told: Any, base: str) -> Any:
    """Paths in plain values, from `base`."""
    if isinstance(told, dict):
        return {key: _from_there(value, base) for key, value in told.items()}
    if isinstance(told, str) and os.sep in told:
        return os.path.relpath(os.path.realpath(told), base)
    return told
