"""PNG files of 16 bits, for what is painted on and read back."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import OpenImageIO

from lightpaint.errors import OutputError
from lightpaint.files import replacing
from lightpaint.images.exr import Floats


def write_png_16(
    path: Path, image_display: Floats, *, texts: Mapping[str, str] | None = None
) -> None:
    """Write display values in [0, 1], (h, w) or (h, w, 3), as a 16-bit PNG, whole or not at all.

    texts: Latin-1, kept in the file.
    """
    values = np.round(image_display * 65535).astype(np.uint16)
    height, width = values.shape[:2]
    spec = OpenImageIO.ImageSpec(width, height, 1 if values.ndim == 2 else 3, "uint16")
    for key, text in (texts or {}).items():
        spec.attribute(key, text)
    with replacing(path) as beside:
        output = OpenImageIO.ImageOutput.create("png")
        assert output is not None  # which formats there are is decided when it is built
        done = output.open(str(beside), spec) and output.write_image(np.ascontiguousarray(values))
        if not (output.close() and done):
            raise OutputError(f"cannot write {path}: {output.geterror() or 'no reason given'}")
