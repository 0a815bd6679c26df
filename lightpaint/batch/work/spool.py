"""Rendered parts of a basis that are not yet added up, on the disk: no kill costs them."""

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
from lightpaint.basis.cache_folder import PARTS, folder, is_believed
from lightpaint.basis.render.parts import Part
from lightpaint.errors import BasisError, OutputError
from lightpaint.files import first_line
from lightpaint.scene.scene import Scene
from lightpaint.version import __version__

#: Seconds after which leftover parts of a basis are deleted.
LEFTOVER_S = 7 * 86_400.0

#: Names of folders with the parts of one basis.
_NAME = re.compile("[0-9a-f]{32}")


class Spool:
    """Rendered parts of one basis. A disk that takes none is no reason to lose a render."""

    def __init__(
        self, scene: Scene, parts: Sequence[Part], *, seed: int, start: Basis | None
    ) -> None:
        begun = None if start is None else start.origin
        what = (__version__, scene.identity, scene.sensor, seed, scene.size, begun, list(parts))
        name = hashlib.sha256(repr(what).encode()).hexdigest()[:32]
        try:
            self.folder = folder() / PARTS / name
            self._delete_leftovers()
            self.folder.mkdir(parents=True, exist_ok=True)
            if not is_believed(self.folder.stat()):
                raise PermissionError(f"{self.folder} is somebody else's")
        except (OSError, OutputError):
            self.folder = Path(tempfile.mkdtemp(prefix="lightpaint-"))

    @property
    def learned(self) -> Path:
        """Path of the lesson."""
        return self.folder / "learned.npz"

    def lesson(self) -> Floats | None:
        """Return the lesson; None before it is learned."""
        try:
            return read_lesson(str(self.learned))
        except BasisError:
            return None

    def keep_lesson(self, learned: Floats) -> None:
        """Keep what was learned. Raises OSError."""
        _write(self.learned, compressed=True, learned=learned)

    def part(self, part: Part) -> tuple[Floats, Floats] | None:
        """Return the sums of a part; None if they are not kept, or damaged."""
        try:
            with np.load(self._file(part), allow_pickle=False) as kept:
                return kept["planes"], kept["seen"]
        except (OSError, ValueError, KeyError, zipfile.BadZipFile):
            return None

    def keep_part(self, part: Part, planes: Floats, seen: Floats) -> None:
        """Keep the sums of that part, if the disk takes them."""
        with suppress(OSError):
            _write(self._file(part), planes=planes, seen=seen)

    def drop(self) -> None:
        """Delete all parts: the basis is made."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def _file(self, part: Part) -> Path:
        light = "" if part.light is None else f"-{part.light}-{part.half}"
        return self.folder / f"{part.top}-{part.first}{light}.npz"

    def _delete_leftovers(self) -> None:
        for other in self.folder.parent.glob("*"):
            if _NAME.fullmatch(other.name) is None:
                continue
            with suppress(OSError):
                if time.time() - other.stat().st_mtime > LEFTOVER_S:
                    shutil.rmtree(other, ignore_errors=True)


def read_lesson(file: str) -> Floats:
    """Return a saved lesson. Raises BasisError."""
    try:
        with np.load(file, allow_pickle=False) as kept:
            learned: Floats = kept["learned"]
            return learned
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise BasisError(f"cannot read {file}: {first_line(error)}") from error


def _write(file: Path, *, compressed: bool = False, **arrays: Any) -> None:
    """Write all arrays under that name, or nothing."""
    half = file.with_name(f".{file.name}.half")
    with half.open("wb") as opened:
        (np.savez_compressed if compressed else np.savez)(opened, **arrays)
    half.replace(file)
