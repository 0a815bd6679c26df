"""Rendered parts of a basis that are not yet added up, on the disk, where they survive a kill."""

import hashlib
import re
import shutil
import tempfile
import time
import zipfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.cache.cache import PARTS, folder, is_trusted_owner
from lightpaint.basis.render.render_parts import Part
from lightpaint.errors import BasisError, OutputError
from lightpaint.files import first_line
from lightpaint.scene.scene import Scene
from lightpaint.version import __version__

#: Seconds after which leftover parts of a basis are deleted.
LEFTOVER_S = 7 * 86_400.0

#: Names of folders with the parts of one basis.
_NAME = re.compile("[0-9a-f]{32}")


class Spool:
    """Rendered parts of one basis. If the disk cannot store them, the render continues."""

    def __init__(
        self, scene: Scene, parts: Sequence[Part], *, seed: int, start: Basis | None
    ) -> None:
        start_origin = None if start is None else start.origin
        identity = (
            __version__,
            scene.identity,
            scene.sensor,
            seed,
            scene.size,
            start_origin,
            list(parts),
        )
        name = hashlib.sha256(repr(identity).encode()).hexdigest()[:32]
        try:
            self.folder = folder() / PARTS / name
            self._delete_leftovers()
            self.folder.mkdir(parents=True, exist_ok=True)
            if not is_trusted_owner(self.folder.stat()):
                raise PermissionError(f"{self.folder} is somebody else's")
        except (OSError, OutputError):
            self.folder = Path(tempfile.mkdtemp(prefix="lightpaint-"))

    @property
    def guide_file(self) -> Path:
        """Path of the guide's table."""
        return self.folder / "learned.npz"

    def guide_table(self) -> Floats | None:
        """Return the table of the emitter guide; None before it is trained."""
        try:
            return read_guide_table(str(self.guide_file))
        except BasisError:
            return None

    def keep_guide_table(self, table: Floats) -> None:
        """Store the table of the emitter guide. Raises OSError."""
        _write(self.guide_file, is_compressed=True, learned=table)

    def part(self, part: Part) -> tuple[Floats, Floats] | None:
        """Return the sums of a part; None if they are not stored, or damaged."""
        try:
            with np.load(self._file(part), allow_pickle=False) as arrays:
                return arrays["planes"], arrays["seen"]
        except (OSError, ValueError, KeyError, zipfile.BadZipFile):
            return None

    def keep_part(self, part: Part, planes: Floats, first_hits: Floats) -> None:
        """Store the sums of a part, if the disk can take them."""
        with suppress(OSError):
            _write(self._file(part), planes=planes, seen=first_hits)

    def drop(self) -> None:
        """Delete all parts once the basis is complete."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def _file(self, part: Part) -> Path:
        light = "" if part.light is None else f"-{part.light}-{part.half}"
        return self.folder / f"{part.top}-{part.first}{light}.npz"

    def _delete_leftovers(self) -> None:
        for leftover in self.folder.parent.glob("*"):
            if _NAME.fullmatch(leftover.name) is None:
                continue
            with suppress(OSError):
                if time.time() - leftover.stat().st_mtime > LEFTOVER_S:
                    shutil.rmtree(leftover, ignore_errors=True)


def read_guide_table(file: str) -> Floats:
    """Return the table of the emitter guide that `file` holds. Raises BasisError."""
    try:
        with np.load(file, allow_pickle=False) as arrays:
            table: Floats = arrays["learned"]
            return table
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise BasisError(f"cannot read {file}: {first_line(error)}") from error


def _write(file: Path, *, is_compressed: bool = False, **arrays: Any) -> None:
    """Write all arrays to `file`, or nothing."""
    temporary = file.with_name(f".{file.name}.half")
    with temporary.open("wb") as stream:
        (np.savez_compressed if is_compressed else np.savez)(stream, **arrays)
    temporary.replace(file)
