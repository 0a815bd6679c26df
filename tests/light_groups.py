"""Light-group files as renderers name them, small and made up."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR

SIZE = (6, 8)


def pictures(n: int = 3, *, seed: int = 0, size: tuple[int, int] = SIZE) -> Any:
    """(n, h, w, 3) float32 with a sharp edge each, so that no two are alike."""
    return np.random.default_rng(seed).gamma(0.5, 1, (n, *size, 3)).astype(np.float32)


def channels(layer: str, image: Any, *, names: Sequence[str] = "RGB", kind: Any = None) -> Any:
    prefix = f"{layer}." if layer else ""
    image = image.astype(kind or image.dtype)
    return {f"{prefix}{c}": np.ascontiguousarray(image[..., k]) for k, c in enumerate(names)}


def write(path: Path, *parts: tuple[str, Mapping[str, Any]], **header: Any) -> Path:
    """An EXR with these parts, (name, channels) each."""
    head = {"type": OpenEXR.scanlineimage, "compression": OpenEXR.ZIP_COMPRESSION, **header}
    parts_of_file = [
        OpenEXR.Part(dict(head), dict(file_channels), name) for name, file_channels in parts
    ]
    OpenEXR.File(parts_of_file).write(str(path))
    return path


def interleaved(path: Path, layers: Mapping[str, Any], **options: Any) -> Path:
    """One part with all layers."""
    header = options.pop("header", {})
    file_channels = {
        k: v for name, image in layers.items() for k, v in channels(name, image, **options).items()
    }
    return write(path, ("", file_channels), **header)


def multi_part(path: Path, layers: Mapping[str, Any], *, is_plain: bool = False) -> Path:
    """A part for each layer, with the channels named after it too, or plain R, G, B."""
    parts = [(name, channels("" if is_plain else name, image)) for name, image in layers.items()]
    return write(path, *parts)
