"""Pictures without grain, kept: denoising all planes takes seconds, and gives the same each time.

They lie beside the basis in the cache, and are of just its pixels: what they were made of, and by
which denoiser, is kept with them. Whatever is not as it should be is made again.
"""

import hashlib
import json
import zipfile
import zlib
from contextlib import suppress
from dataclasses import asdict, dataclass

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.basis import cache
from lightpaint.basis.basis import Basis
from lightpaint.errors import LightpaintError
from lightpaint.files import replacing
from lightpaint.images.denoise import how_denoised
from lightpaint.paint.pictures import Picture

FORMAT = "lightpaint-clean 1"

#: What comes of reading a file that is cut off, or another one.
_DAMAGES = (
    *(OSError, EOFError, KeyError, MemoryError, NotImplementedError, RuntimeError, ValueError),
    *(zipfile.BadZipFile, zlib.error),
)


@dataclass(frozen=True)
class Clean:
    """present: (h, w, 3) float32, the present look. planes: (n, h, w, 3) halves, as pages have
    them.
    """

    present: Floats
    planes: Picture


def kept_clean(basis: Basis) -> Clean | None:
    """What was kept of `basis`, or None."""
    path = cache.place_beside(basis, cache.CLEAN)
    size = (*basis.size, 3)
    with suppress(*_DAMAGES):
        with path.open("rb") as file, np.load(file, allow_pickle=False) as kept:
            if str(kept["made_of"]) != _made_of(basis):
                return None
            clean = Clean(kept["present"], kept["planes"])
        shapes = clean.present.shape, clean.planes.shape
        types = clean.present.dtype.name, clean.planes.dtype.name
        if shapes == (size, basis.images.shape) and types == ("float32", "float16"):
            path.touch()
            return clean
    return None


def keep_clean(basis: Basis, clean: Clean) -> bool:
    """Keep what was made of `basis`. Returns whether that worked: nothing is lost if not."""
    path = cache.place_beside(basis, cache.CLEAN)
    try:
        with replacing(path) as place, place.open("wb") as file:
            made_of = np.array(_made_of(basis))
            np.savez(file, made_of=made_of, present=clean.present, planes=clean.planes)
    except (OSError, LightpaintError):
        return False
    return True


def _made_of(basis: Basis) -> str:
    """What decides how they come out."""
    how = how_denoised(basis.features, raw="")
    digest = hashlib.sha256(json.dumps([FORMAT, how, asdict(basis.origin)]).encode())
    pictures = [basis.images, basis.present_weights]
    if basis.features is not None:
        pictures += [basis.features.albedo, basis.features.normal]
    for picture in pictures:
        digest.update(np.ascontiguousarray(picture).data)
    return digest.hexdigest()
