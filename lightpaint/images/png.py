"""Pictures for people, and PNG files: of 8 bits to look at, of 16 to paint on and read back."""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenImageIO
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from lightpaint.arrays import Floats
from lightpaint.colour.display import choose_exposure, encode_display, to_8_bit
from lightpaint.errors import OutputError
from lightpaint.files import replacing, write_bytes


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


def png_bytes(image_8_bit: npt.NDArray[Any], texts: Mapping[str, str] | None = None) -> bytes:
    """An (h, w, 3) or (h, w, 4) uint8 image as a PNG file, with these Latin-1 texts in it."""
    said = PngInfo()
    for key, text in (texts or {}).items():
        said.add_text(key, text)
    buffer = io.BytesIO()
    Image.fromarray(image_8_bit).save(buffer, "PNG", pnginfo=said)
    return buffer.getvalue()


def display_picture(image: Floats, *, stops: float | None = None, zoom: int = 1) -> Image.Image:
    """A linear image as a picture that a notebook shows.

    stops: exposure, chosen if not given. zoom: side of a pixel of `image` in the picture.
    """
    exposure = choose_exposure(image) if stops is None else stops
    pixels = to_8_bit(encode_display(image, stops=exposure))
    return Image.fromarray(np.kron(pixels, np.ones((zoom, zoom, 1), np.uint8)))


def write_png(path: Path, image: Floats, *, stops: float = 0.0) -> None:
    """Write a linear image display-encoded as 8-bit sRGB PNG, whole or not at all."""
    write_bytes(path, png_bytes(to_8_bit(encode_display(image, stops=stops))))
