"""Pictures for people, without the grain of few samples.

Only what is looked at or painted on is denoised. What is solved, kept and written as EXR is not:
a denoiser has no error bars, and what it takes for noise may be light.
"""

from dataclasses import dataclass
from importlib.metadata import version
from importlib.util import find_spec
from itertools import product
from typing import Any, Literal

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.errors import SizeError
from lightpaint.images.estimate import box_mean
from lightpaint.images.pixel_blocks import block_mean

#: Text of a PNG that was denoised: how, and where the picture is as it was rendered.
DENOISED_KEY = "lightpaint.denoised"

#: What is said once where only the plain filter is there.
LACKING = (
    "pictures are smoothed by a plain filter, since Open Image Denoise is not installed: pip "
    "install pyoidn (Linux and Windows, x86-64) makes cleaner ones; what is solved is the same"
)

#: `fast` takes a quarter of the time of `high`, and leaves half again as much error.
Quality = Literal["fast", "high"]

#: Pixels put around a picture for Open Image Denoise, which is off by a third at borders: even a
#: flat picture comes out 0.7 to 1.2 times as bright there, and with them within half a percent.
MARGIN = 16

#: Of the plain filter: pixels on either side; ratio of light, as a natural logarithm, and distance
#: in pixels at which a neighbour counts 1/√e; how sharply normals part; least albedo divided by.
RADIUS, RATIO, NEAR, SHARPNESS, DARKEST = 3, 0.3, 2.0, 32, 0.02


@dataclass(frozen=True)
class Features:
    """What tells edges from noise: it is known of each pixel almost without any.

    albedo: (h, w, 3) float32 in [0, 1]; normal: (h, w, 3) float32, of unit length or 0.
    """

    albedo: Floats
    normal: Floats

    def __post_init__(self) -> None:
        if self.albedo.shape != self.normal.shape or self.albedo.shape[2:] != (3,):
            raise SizeError(
                f"albedo {self.albedo.shape} and normals {self.normal.shape} are not of one picture"
            )

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self.albedo.shape[0], self.albedo.shape[1]

    def reduced(self, factor: int) -> "Features":
        """Of the same picture with a pixel for each block of factor x factor."""
        return Features(block_mean(self.albedo, factor), block_mean(self.normal, factor))


def denoised(
    image: Floats, features: Features | None = None, *, quality: Quality = "fast"
) -> Floats:
    """A rendered picture without its grain, by Open Image Denoise or else a plain filter.

    image: (h, w, 3) linear. features: of it; those of another size are not used. Returns
    (h, w, 3) float32, the same up to round-off wherever it is computed.
    """
    image = np.ascontiguousarray(image, np.float32)
    mean = float(image.mean(dtype=np.float64))
    if not 0 < mean < np.inf:
        return image
    if features is not None and features.size != image.shape[:2]:
        features = None
    # It was trained on pictures of common brightness, and scenes have units of their own.
    scaled = image / np.float32(mean)
    if is_there():
        try:
            return _by_oidn(scaled, features, quality) * np.float32(mean)
        except (ImportError, OSError, RuntimeError):  # a library that does not load here
            pass
    return _by_filter(scaled, features) * np.float32(mean)


def is_there() -> bool:
    """Whether Open Image Denoise is installed."""
    try:
        return find_spec("pyoidn") is not None
    except ValueError:  # somebody has put something else in its place
        return False


def how_denoised(features: Features | None, *, raw: str) -> dict[str, str]:
    """The text of a PNG that was denoised. raw: where it is as it was rendered."""
    by = f"Open Image Denoise ({_version()})" if is_there() else "joint bilateral filter"
    guided = " with albedo and normals" if features is not None else ""
    return {DENOISED_KEY: f"{by}{guided}; raw: {raw}"}


def _version() -> str:
    return f"pyoidn {version('pyoidn')}"


def _by_oidn(image: Floats, features: Features | None, quality: Quality) -> Floats:
    import pyoidn

    def wider(picture: Floats) -> Floats:
        around = ((MARGIN, MARGIN), (MARGIN, MARGIN), (0, 0))
        return np.pad(picture.astype(np.float32, copy=False), around, mode="symmetric")

    guides: dict[str, Any] = {}
    if features is not None:
        guides = {"albedo": wider(features.albedo), "normal": wider(features.normal)}
        # `high` has a network of its own for features that have no noise.
        guides["clean_aux"] = quality == "high"
    clean = pyoidn.denoise(wider(image), hdr=True, quality=quality, **guides)
    height, width = image.shape[:2]
    inside = clean[MARGIN : MARGIN + height, MARGIN : MARGIN + width]
    return np.maximum(np.ascontiguousarray(inside, np.float32), 0)


def _by_filter(image: Floats, features: Features | None) -> Floats:
    """Means over neighbours that are alike in light, and in normal where it is known.

    Textures are kept: what is averaged is light, the image over its albedo.
    """
    albedo = np.float32(1) if features is None else np.maximum(features.albedo, DARKEST)
    light = np.maximum(image, 0) / albedo
    # Alike in the mean of a few pixels: single ones are what the noise is in.
    level = np.log(box_mean(light.mean(axis=-1), 1) + 1e-3).astype(np.float32)
    total, weights = np.zeros_like(light), np.zeros_like(level)
    for dy, dx in product(range(-RADIUS, RADIUS + 1), repeat=2):
        weight = np.exp(-0.5 * np.square((_shifted(level, dy, dx) - level) / np.float32(RATIO)))
        weight *= np.float32(np.exp(-0.5 * (dy * dy + dx * dx) / NEAR**2))
        if features is not None:
            alike = (_shifted(features.normal, dy, dx) * features.normal).sum(axis=-1)
            # Where nothing is seen there is no normal, and only the light tells.
            there = np.square(features.normal).sum(axis=-1) > 0
            weight *= np.where(there, np.clip(alike, 0, 1) ** SHARPNESS, 1)
        weights += weight
        total += weight[..., None] * _shifted(light, dy, dx)
    return np.asarray(total / weights[..., None] * albedo, np.float32)


def _shifted(values: Floats, dy: int, dx: int) -> Floats:
    """The neighbour of each pixel so far below and to the right; at the border the last one."""
    height, width = values.shape[:2]
    y = np.clip(np.arange(height) + dy, 0, height - 1)
    x = np.clip(np.arange(width) + dx, 0, width - 1)
    return values[y[:, None], x]
