"""From linear light to what a display shows, and PNG files."""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from lightpaint.files import write_bytes
from lightpaint.images.exr import Floats


def choose_exposure(image: Floats) -> float:
    """Exposure in stops at which to show a linear image.

    0 for a picture that is meant to be seen as it is; only one so dark or bright that it
    would show nothing is brought back, its 99th percentile to white.
    """
    bright = float(np.percentile(image.max(axis=-1), 99))
    if bright <= 0 or 0.125 <= bright <= 8:
        return 0.0
    return float(np.round(-np.log2(bright), 1))


def encode_display(image: Floats, *, stops: float = 0.0) -> Floats:
    """sRGB-encoded values in [0, 1] of linear Rec.709, scaled by 2^stops and clipped.

    The transfer function is IEC 61966-2-1's.
    """
    linear = np.clip(image * 2.0**stops, 0, 1)
    curve = 1.055 * linear ** (1 / 2.4) - 0.055
    return np.asarray(np.where(linear <= 0.0031308, 12.92 * linear, curve))


def decode_display(image_display: Floats) -> Floats:
    """Linear Rec.709 in [0, 1] of sRGB-encoded values in [0, 1]: undoes `encode_display`."""
    curve = ((image_display + 0.055) / 1.055) ** 2.4
    return np.asarray(np.where(image_display <= 0.04045, image_display / 12.92, curve))


def to_8_bit(image_display: Floats) -> npt.NDArray[np.uint8]:
    """Display values in [0, 1] as 8-bit integers."""
    return np.asarray(np.round(image_display * 255), dtype=np.uint8)


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
