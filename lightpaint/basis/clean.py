"""Planes of a basis without their grain, kept from earlier runs.

Light adds, so the sum of clean planes is a clean picture of any lighting, for the price of a sum;
beside a render of many samples it is a little nearer than the sum denoised is. Only for eyes: what
is solved is the basis as it was rendered. They are kept where bases are, by the content of what
they were made of, and may be deleted at any time.
"""

import hashlib
import io
import os
import zipfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis import cache
from lightpaint.basis.basis import Basis, mix
from lightpaint.errors import OutputError
from lightpaint.files import write_bytes
from lightpaint.images.denoise import denoised, is_there
from lightpaint.threads import side_by_side

#: Pixels of all planes below which a sum is denoised as soon as planes are read, up to which they
#: are made where they are wanted, and up to which a render is followed by them.
FEWEST, MOST_WANTED, MOST = 2**18, 2**22, 2**24

#: The brightest value of a plane as half floats, which leaves 24 stops below it to their full
#: precision.
BRIGHTEST = 1024.0

#: Bytes above which those that were not used for longest are deleted.
LARGEST = 2 * 2**30
SUFFIX = ".clean.npz"

#: Rows of planes that are brought to single precision at a time.
STRIP = 64

Halves = npt.NDArray[np.float16]


@dataclass(frozen=True)
class CleanPlanes:
    """What each light does, for eyes.

    halves: (n, h, w, 3) float16, linear, at unit emission over `scales`. scales: (n,), powers of 2.
    """

    halves: Halves
    scales: Doubles

    def mix(self, weights: Doubles) -> Floats:
        """Σ w_i of the planes, (h, w, 3) float32. weights: (n, 3)."""
        own = weights * self.scales[:, None]

        def strip(top: int) -> Floats:
            return mix(self.halves[:, top : top + STRIP].astype(np.float32), own)

        return np.concatenate(side_by_side(strip, range(0, self.halves.shape[1], STRIP)))

    def plane(self, k: int) -> Floats:
        """That of light k at unit emission, (h, w, 3) float32."""
        return np.asarray(self.halves[k] * np.float32(self.scales[k]), np.float32)


def scale_of(plane: Floats) -> float:
    """What a plane is divided by to be half floats: a power of two."""
    brightest = float(plane.max(initial=0))
    return float(2.0 ** np.ceil(np.log2(brightest / BRIGHTEST))) if brightest > 0 else 1.0


def as_halves(plane: Floats, scale: float = 1.0) -> Halves:
    """Light as half floats, what they cannot hold clipped."""
    return np.asarray(np.clip(plane / np.float32(scale), 0, 65504), np.float16)


def clean_planes(
    basis: Basis, *, most: int = MOST_WANTED, progress: Callable[[int, int], None] | None = None
) -> CleanPlanes | None:
    """Those that are kept, or else made now, and kept.

    most: pixels of all planes up to which they are made. progress: hears how many are, of how many.
    None where there are none, and sums of so few pixels are denoised sooner.
    """
    pixels = len(basis.lights) * basis.size[0] * basis.size[1]
    if pixels < FEWEST or not is_there():
        return None
    path = _path(basis)
    found = _read(path, basis)
    if found is None and pixels <= most:
        halves, scales = np.empty(basis.images.shape, np.float16), np.ones(len(basis.lights))
        for k, plane in enumerate(basis.images):
            scales[k] = scale_of(plane)
            halves[k] = as_halves(denoised(plane, basis.features), scales[k])
            if progress is not None:
                progress(k + 1, len(basis.lights))
        found = CleanPlanes(halves, scales)
        _keep(path, found)
    return found


def forget(limit: int = 0) -> int:
    """Delete those that were not used for longest until `limit` bytes are left; bytes freed."""
    files = []
    for path in cache.folder().glob(f"*{SUFFIX}"):
        with suppress(OSError):
            about = path.stat()
            files.append((about.st_mtime, about.st_size, path))
    left, freed = limit, 0
    for _, size, path in sorted(files, reverse=True):
        left -= size
        if left < 0:
            with suppress(OSError):
                path.unlink(missing_ok=True)
                freed += size
    return freed


def _path(basis: Basis) -> Path:
    """Named after all that they are made of."""
    its = [basis.images]
    if basis.features is not None:
        its += [basis.features.albedo[None], basis.features.normal[None]]

    def digest(plane: Floats) -> bytes:
        return hashlib.blake2b(np.ascontiguousarray(plane).data, digest_size=16).digest()

    content = hashlib.blake2b(repr(basis.images.shape).encode(), digest_size=16)
    for one in side_by_side(digest, [plane for planes in its for plane in planes]):
        content.update(one)
    return cache.folder() / f"{content.hexdigest()}{SUFFIX}"


def _read(path: Path, basis: Basis) -> CleanPlanes | None:
    """What is kept there; None for nothing, or for what is damaged."""
    try:
        with np.load(path, allow_pickle=False) as file:
            found = CleanPlanes(file["halves"], file["scales"])
        os.utime(path)
    except (OSError, ValueError, LookupError, EOFError, zipfile.BadZipFile):
        return None
    is_whole = found.halves.shape == basis.images.shape and found.halves.dtype == np.float16
    return found if is_whole and found.scales.shape == (len(basis.lights),) else None


def _keep(path: Path, planes: CleanPlanes) -> None:
    """Where that works: a full disk is no reason to show nothing."""
    buffer = io.BytesIO()
    np.savez(buffer, halves=planes.halves, scales=planes.scales)
    with suppress(OutputError, OSError):
        write_bytes(path, buffer.getvalue())
        forget(LARGEST)
