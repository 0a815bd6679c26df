"""Denoising of pictures that people look at or paint on.

Images that are solved for, stored or written as EXR are never denoised: a denoiser has no error
bars, and may remove light as noise.
"""

from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from itertools import product
from typing import Any, Literal

import numpy as np

from lightpaint.arrays import Floats
from lightpaint.colour import REC709, rgb_to_xyz
from lightpaint.errors import SizeError
from lightpaint.images.estimate import box_mean, shifted
from lightpaint.images.pixel_blocks import LARGE_PICTURE, block_mean

#: Key of the text in a denoised PNG that names the denoiser and the file of the raw render.
DENOISED_KEY = "lightpaint.denoised"

#: Oldest version of pyoidn that has all that is used here.
OLDEST_OIDN = (2, 5, 1)

#: Remark, shown once, if only simpler filters are available.
MISSING_REMARK = (
    "Open Image Denoise is not installed, or too old, so simpler filters smooth the pictures: for "
    f"cleaner ones, pip install 'pyoidn>={'.'.join(map(str, OLDEST_OIDN))}' (Linux and Windows, "
    "x86-64); the solution is the same"
)

#: `fast` takes a quarter of the time of `high`, but leaves 1.5 times the error.
Quality = Literal["fast", "high"]

#: Pixels that pad a picture for Open Image Denoise. At unpadded borders even a flat picture comes
#: out 0.7 to 1.2 times as bright; with padding, within half a percent.
MARGIN = 16

#: Light below zero, relative to the mean of a picture, from which lamps are outside Rec.709.
NEGATIVE = 1e-3

#: Memory in megabytes that Open Image Denoise may use for a large picture, besides the picture.
TILES_MB = 512

#: Parameters of the plain filter: window radius in pixels; log ratio of light, and distance in
#: pixels, at which a neighbour's weight is 1/√e; exponent of the cosine between normals; smallest
#: albedo to divide by.
RADIUS, RATIO, NEAR, SHARPNESS, DARKEST = 3, 0.3, 2.0, 32, 0.02


@dataclass(frozen=True)
class Features:
    """Nearly noise-free features of each pixel that show a denoiser where edges are.

    albedo: (h, w, 3) float32 in [0, 1]. normal: (h, w, 3) float32, of unit length, or 0 where no
    surface is seen. position: (h, w, 3) float32 of the surface in the scene, None if unknown.
    """

    albedo: Floats
    normal: Floats
    position: Floats | None = None

    def __post_init__(self) -> None:
        planes = [self.albedo, self.normal, *([] if self.position is None else [self.position])]
        if any(x.shape != self.albedo.shape or x.shape[2:] != (3,) for x in planes):
            shapes = ", ".join(str(x.shape) for x in planes)
            raise SizeError(f"albedo, normals and positions {shapes} are not of one picture")

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) in pixels."""
        return self.albedo.shape[0], self.albedo.shape[1]

    def reduced(self, factor: int) -> "Features":
        """Return the features averaged over blocks of factor × factor pixels."""
        position = None if self.position is None else block_mean(self.position, factor)
        return Features(block_mean(self.albedo, factor), block_mean(self.normal, factor), position)


def denoised(
    image: Floats, features: Features | None = None, *, quality: Quality = "fast"
) -> Floats:
    """Return a rendered picture without its noise, using Open Image Denoise or a plain filter.

    image: (h, w, 3) linear. features: features of the image, ignored if their size differs. Returns
    (h, w, 3) float32, equal up to round-off on every machine.
    """
    image = np.ascontiguousarray(image, np.float32)
    mean = float(image.mean(dtype=np.float64))
    if not 0 < mean < np.inf:
        return image
    if features is not None and features.size != image.shape[:2]:
        features = None
    # The network was trained on pictures of ordinary brightness, but the units of scenes are
    # arbitrary.
    scaled = image / np.float32(mean)
    # Networks and filters take light for 0 or more, which lamps outside Rec.709 are as XYZ.
    if scaled.min() >= -NEGATIVE:
        return _denoised_light(scaled, features, quality) * np.float32(mean)
    to_xyz = rgb_to_xyz(REC709)
    clean = _denoised_light(scaled @ to_xyz.T.astype(np.float32), features, quality)
    return clean @ np.linalg.inv(to_xyz).T.astype(np.float32) * np.float32(mean)


def _denoised_light(image: Floats, features: Features | None, quality: Quality) -> Floats:
    """Return light, (h, w, 3) and mostly 0 or more, without its noise."""
    if oidn_is_installed():
        try:
            return _denoise_with_oidn(image, features, quality)
        except (ImportError, OSError, RuntimeError):  # the library does not load here
            pass
    return _denoise_with_filter(image, features)


def oidn_is_installed() -> bool:
    """Return True if Open Image Denoise is installed, in a version that has all that is used."""
    try:
        if find_spec("pyoidn") is None:
            return False
        numbers = [int(number) for number in version("pyoidn").split(".")[:3]]
        return tuple(numbers) >= OLDEST_OIDN
    except (ValueError, PackageNotFoundError):  # a broken module of that name, or another one
        return False


def denoiser_text(features: Features | None, *, raw: str) -> dict[str, str]:
    """Return the text for a denoised PNG: the denoiser, and the file of the raw render."""
    denoiser = (
        f"Open Image Denoise ({_version()})" if oidn_is_installed() else "joint bilateral filter"
    )
    guided = " with albedo and normals" if features is not None else ""
    return {DENOISED_KEY: f"{denoiser}{guided}; raw: {raw}"}


def _version() -> str:
    return f"pyoidn {version('pyoidn')}"


def _denoise_with_oidn(image: Floats, features: Features | None, quality: Quality) -> Floats:
    import pyoidn

    def padded(picture: Floats) -> Floats:
        margins = ((MARGIN, MARGIN), (MARGIN, MARGIN), (0, 0))
        return np.pad(picture.astype(np.float32, copy=False), margins, mode="symmetric")

    guides: dict[str, Any] = {}
    if features is not None:
        guides = {"albedo": padded(features.albedo), "normal": padded(features.normal)}
        # `high` has a separate network for features without noise.
        guides["clean_aux"] = quality == "high"
    height, width = image.shape[:2]
    denoise = _in_tiles if height * width >= LARGE_PICTURE else pyoidn.denoise
    clean = denoise(padded(image), hdr=True, quality=quality, **guides)
    inside = clean[MARGIN : MARGIN + height, MARGIN : MARGIN + width]
    return np.maximum(np.ascontiguousarray(inside, np.float32), 0)


def _in_tiles(
    image: Floats, *, hdr: bool, quality: Quality, clean_aux: bool = False, **guides: Floats
) -> Floats:
    """Denoise like `pyoidn.denoise`, but in tiles within `TILES_MB`, and release the device
    afterwards.
    """
    import pyoidn

    denoised = np.empty_like(image)
    levels = {"fast": pyoidn.OIDN_QUALITY_FAST, "high": pyoidn.OIDN_QUALITY_HIGH}
    with pyoidn.Device() as device:
        device.commit()
        with pyoidn.Filter(device) as tiles:
            pictures = {"color": image, **guides, "output": denoised}
            for name, picture in pictures.items():
                tiles.set_image(name, picture, pyoidn.OIDN_FORMAT_FLOAT3)
            tiles.set_bool("hdr", hdr)
            tiles.set_bool("cleanAux", clean_aux)
            tiles.set_int("maxMemoryMB", TILES_MB)
            tiles.set_quality(levels[quality])
            tiles.commit()
            tiles.execute()
        if error := device.get_error():
            raise RuntimeError(error)
    return denoised


def _denoise_with_filter(image: Floats, features: Features | None) -> Floats:
    """Return weighted means over neighbours of similar light and, if known, similar normal.

    Textures survive, since the filter averages light, the image divided by its albedo.
    """
    albedo = np.float32(1) if features is None else np.maximum(features.albedo, DARKEST)
    light = np.maximum(image, 0) / albedo
    # Means of a few pixels are compared, since single pixels are noisy.
    level = np.log(box_mean(light.mean(axis=-1), 1) + 1e-3).astype(np.float32)
    total, weights = np.zeros_like(light), np.zeros_like(level)
    for dy, dx in product(range(-RADIUS, RADIUS + 1), repeat=2):
        weight = np.exp(-0.5 * np.square((shifted(level, dy, dx) - level) / np.float32(RATIO)))
        weight *= np.float32(np.exp(-0.5 * (dy * dy + dx * dx) / NEAR**2))
        if features is not None:
            cosine = (shifted(features.normal, dy, dx) * features.normal).sum(axis=-1)
            # Background pixels have no normal, so only their light is compared.
            has_normal = np.square(features.normal).sum(axis=-1) > 0
            weight *= np.where(has_normal, np.clip(cosine, 0, 1) ** SHARPNESS, 1)
        weights += weight
        total += weight[..., None] * shifted(light, dy, dx)
    return np.asarray(total / weights[..., None] * albedo, np.float32)
