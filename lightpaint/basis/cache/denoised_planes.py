"""Denoised planes of a basis, cached from earlier runs.

Since light adds, a weighted sum of denoised planes is a denoised picture of any lighting, at the
cost of a sum; compared with a render of many samples, it is slightly closer than the denoised sum.
Denoised planes are for display only: the solver uses the basis as it was rendered. They lie beside
the cached basis, are keyed by the content that they were computed from, and may be deleted at any
time.
"""

import hashlib
import zipfile
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.cache import basis_cache
from lightpaint.basis.denoised_mixes import (
    MixQuality,
    denoise_current_look,
    denoise_plane,
    share_of_clean,
)
from lightpaint.basis.file.file_parts import plane_sets
from lightpaint.basis.light_basis import Basis
from lightpaint.basis.plane_results import file_content
from lightpaint.basis.planes import mix
from lightpaint.errors import LightpaintError
from lightpaint.files import replacing
from lightpaint.images import (
    Size,
    block_mean,
    blocks_in,
    denoiser_text,
    oidn_is_installed,
    resampled,
    whole_factor,
)
from lightpaint.progress import with_progress
from lightpaint.threads import parallel_map

FORMAT, ARRAY_NAMES = "lightpaint-clean 4", ("halves", "scales", "present")

#: Number of pixels of all planes below which denoising the sum is as fast as reading planes.
MIN_PIXELS = 2**18

#: Brightest value of a plane in half floats, which leaves 24 stops below it at full precision.
BRIGHTEST_HALF = 1024.0

#: Side in pixels of the blocks over which the share of a light is computed if surfaces are unknown.
ROUGH_BLOCK = 8

#: Maximum gain applied to rough planes to match the denoised planes in a block.
MAX_BLOCK_GAIN = 4.0

#: Number of rows that are converted to single precision at a time.
STRIP_ROWS = 64

#: Exceptions raised by reading a truncated or foreign file.
_READ_ERRORS = (
    *(OSError, EOFError, LookupError, MemoryError, NotImplementedError, RuntimeError, ValueError),
    zipfile.BadZipFile,
)

Halves = npt.NDArray[np.float16]


@dataclass(frozen=True)
class DenoisedPlanes:
    """Denoised planes, for display.

    halves: (n, h, w, 3) float16, linear, at unit emission divided by `scales`; h and w are smaller
    if they are means over blocks of pixels. scales: (n,), powers of 2. current: (h, w, 3) float32,
    the scene in its current state: the sum of the planes, or the denoised sum if that was shown
    first, so that a painter continues from the picture on screen. Beside planes of blocks it may be
    of blocks, too, which are smaller.
    """

    halves: Halves
    scales: Doubles
    current: Floats

    @classmethod
    def of(cls, basis: Basis, halves: Halves, scales: Doubles) -> "DenoisedPlanes":
        """Return the planes together with their sum for the current scene."""
        return cls(halves, scales, _mixed(halves, scales, basis.current_weights))

    @property
    def is_whole(self) -> bool:
        """True if the planes have all pixels; False if they are means over blocks."""
        return self.halves.shape[1:] == self.current.shape

    def look(self, size: Size) -> Floats | None:
        """Return the current look at a size, (height, width), of whole blocks of its pixels; None
        if it has none of these.
        """
        factor = whole_factor(self.current.shape[:2], size)
        return None if factor is None else block_mean(self.current, factor)

    def mix(self, weights: Doubles) -> Floats:
        """Return Σ w_i of the planes, (h, w, 3) float32. weights: (n, 3)."""
        return _mixed(self.halves, self.scales, weights)

    def scaled_as(self, basis: Basis) -> "DenoisedPlanes":
        """Return the same light in the scales of another basis of the same lights."""
        scales = np.array([scale_of(plane) for plane in basis.planes])
        halves = np.stack([as_halves(self.plane(k), x) for k, x in enumerate(scales)])
        return DenoisedPlanes(halves, scales, self.current)

    def plane(self, k: int) -> Floats:
        """Return the plane of light k at unit emission, (h, w, 3) float32."""
        return np.asarray(self.halves[k] * np.float32(self.scales[k]), np.float32)


class RoughPlanes:
    """Planes without most of the noise, available at once, while denoising takes seconds.

    A rough plane is the denoised picture of the current scene times the share of the light in it,
    so the planes add up to that picture. The shares are computed from light that is averaged along
    surfaces; direct light is averaged only as far as its noise in that picture demands. If surfaces
    are unknown, or the picture is too large for that to be quick, shares are computed over square
    blocks of pixels, and shadows become soft.

    current: (h, w, 3) float32, the denoised picture of the current scene. small: denoised planes of
    blocks of pixels, as a report page stores them; rough planes then match their light in each
    block.
    """

    def __init__(self, basis: Basis, current: Floats, small: DenoisedPlanes | None = None) -> None:
        self.basis, self.current, self._small = basis, current, small

    def plane(self, k: int) -> Floats:
        """Return the plane of light k at unit emission, (h, w, 3) float32; 0 where the scene is
        black.
        """
        parts = self.basis.indirect
        indirect = None if parts is None else parts.planes.plane(k)
        smoothed, total = self._averaged(self.basis.planes.plane(k), indirect), self._total
        share = np.divide(smoothed, total, out=np.zeros_like(smoothed), where=total > 0)
        rough = self.current * resampled(share, self.basis.size)
        if self._small is None:
            return rough
        small = self._small.plane(k)
        target_mean, mean_here = (
            resampled(x, self.basis.size)
            for x in (small, block_mean(rough, -(-self.basis.size[0] // len(small))))
        )
        # Where a block has hardly any light, its ratio is unreliable.
        floor = np.float32(1e-4) * mean_here.mean()
        gain = np.clip((target_mean + floor) / (mean_here + floor), 0, MAX_BLOCK_GAIN)
        return np.asarray(rough * gain, np.float32)

    @cached_property
    def _total(self) -> Floats:
        parts, weights = self.basis.indirect, self.basis.current_weights
        indirect = None if parts is None else parts.planes.mix(weights)
        return self._averaged(self.basis.current_look, indirect)

    def _averaged(self, picture: Floats, indirect: Floats | None) -> Floats:
        """Return a smoothed picture. This is linear: a sum of pictures becomes the sum of their
        smoothed forms.
        """
        along_surfaces = self.basis.surface_filter
        if indirect is None or along_surfaces is None or not along_surfaces.is_quick:
            height, width = self.basis.size
            return resampled(picture, (-(-height // ROUGH_BLOCK), -(-width // ROUGH_BLOCK)))
        direct = picture - indirect
        change = along_surfaces(direct) - direct
        return along_surfaces(indirect) + direct + self._share_of_smooth * change

    @cached_property
    def _share_of_smooth(self) -> Floats:
        """Share of the smoothed picture in direct light, (h, w, 1)."""
        basis, weights = self.basis, self.basis.current_weights
        assert basis.indirect is not None
        assert basis.surface_filter is not None
        direct = basis.current_look - basis.indirect.planes.mix(weights)
        noise = basis.noise.mix(weights) - basis.indirect.noise.mix(weights)
        return share_of_clean(direct, noise, basis.surface_filter(direct))


def scale_of(plane: Floats) -> float:
    """Return the power of two by which a plane is divided before conversion to half floats."""
    brightest = float(plane.max(initial=0))
    return float(2.0 ** np.ceil(np.log2(brightest / BRIGHTEST_HALF))) if brightest > 0 else 1.0


def as_halves(plane: Floats, scale: float = 1.0) -> Halves:
    """Return light as half floats, clipped to their range."""
    numbers = plane if scale == 1 else plane / np.float32(scale)
    return np.asarray(np.clip(numbers, 0, 65504), np.float16)


def obtain_denoised_planes(
    basis: Basis, *, factor: int = 1, look_factor: int = 1
) -> DenoisedPlanes | None:
    """Return the denoised planes, from the cache or computed and cached now.

    factor: side of the blocks of pixels whose means are denoised, coarsely, which costs accordingly
    less; if whole planes are cached, these are returned. look_factor: side of the blocks of the
    current look beside such planes. None if Open Image Denoise is not installed, or if there are so
    few pixels that denoising their sum is faster. Planes that another basis shares, as before a
    lamp was moved, are taken from its file; but not blocks of a basis that has a file itself, since
    to compare all its pixels takes longer.
    """
    pixels = len(basis.lights) * basis.size[0] * basis.size[1]
    if pixels < MIN_PIXELS or not oidn_is_installed():
        return None
    planes = read_denoised_planes(basis, factor=factor, look_factor=look_factor)
    if planes is None:
        keys = [] if factor > 1 and _file_key(basis) else _content_keys(basis)
        shared = _read_shared(basis, keys, factor) if keys else {}
        quality: MixQuality = "fast" if factor == 1 else "coarse"
        pairs = [
            shared[k] if k in shared else denoise_to_halves(basis, k, factor, quality=quality)
            for k in with_progress(range(len(basis.lights)), "lights")
        ]
        halves, scales = zip(*pairs, strict=True)
        denoised = np.stack(halves), np.array(scales)
        if factor == 1:
            planes = DenoisedPlanes.of(basis, *denoised)
        else:
            look = denoise_current_look(
                replace(basis, former=None), factor=look_factor, quality=quality
            )
            planes = DenoisedPlanes(*denoised, look)
        _write(basis, keys, planes)
    return planes


def denoise_to_halves(
    basis: Basis, k: int, factor: int = 1, *, quality: MixQuality = "fast"
) -> tuple[Halves, float]:
    """Return the denoised plane of light k in the form of `DenoisedPlanes.halves`, and its
    scale.
    """
    scale = scale_of(basis.planes.plane(k))
    return as_halves(denoise_plane(basis, k, factor=factor, quality=quality), scale), scale


def read_denoised_planes(
    basis: Basis, *, factor: int = 1, look_factor: int = 1
) -> DenoisedPlanes | None:
    """Return the cached denoised planes of exactly this basis; None if missing or damaged.

    factor: side of blocks; planes of such blocks are accepted as well as whole planes. look_factor:
    side of the blocks of the current look beside planes of blocks.
    """
    with suppress(*_READ_ERRORS, LightpaintError):
        path = basis_cache.companion_path(basis, basis_cache.DENOISED_SUFFIX)
        if not path.exists() or not basis_cache.is_own(path):
            return None  # before all planes are read for their keys
        with path.open("rb") as file, np.load(file, allow_pickle=False) as file_arrays:
            if not _is_made_of(file_arrays, basis):
                return None
            planes = DenoisedPlanes(*(file_arrays[name] for name in ARRAY_NAMES))
        arrays: list[Any] = [planes.halves, planes.scales, planes.current]
        n, shapes = len(basis.lights), [[_shape(basis), (len(basis.lights),), (*basis.size, 3)]]
        if factor > 1:
            of_planes, of_look = (blocks_in(basis.size, x) for x in (factor, look_factor))
            shapes.append([(n, *of_planes, 3), (n,), (*of_look, 3)])
        types = ["float16", "float64", "float32"]
        if [x.shape for x in arrays] in shapes and [x.dtype.name for x in arrays] == types:
            path.touch()
            return planes
    return None


def _is_made_of(file_arrays: Mapping[str, npt.NDArray[Any]], basis: Basis) -> bool:
    """Return whether denoised planes were made of exactly this basis, which the content of its file
    tells at once; without a file, all planes are read for their keys.
    """
    key = _file_key(basis)
    if key and "of_file" in file_arrays and str(file_arrays["of_file"]) == key:
        return True
    made_of = file_arrays["made_of"].tolist()
    return bool(made_of) and bool(made_of == _content_keys(basis))


def _read_shared(basis: Basis, keys: list[str], factor: int) -> dict[int, tuple[Halves, float]]:
    """Return cached denoised planes of single lights, whichever basis they were denoised for: by
    their numbers in `basis`, in the form of `denoise_to_halves`.
    """
    missing = {key: k for k, key in enumerate(keys[:-1])}
    found: dict[int, tuple[Halves, float]] = {}
    for path in basis_cache.companions_with(basis_cache.DENOISED_SUFFIX):
        with suppress(*_READ_ERRORS), path.open("rb") as file, np.load(file) as file_arrays:
            made_of = file_arrays["made_of"].tolist()[:-1]
            numbers = {key: number for number, key in enumerate(made_of) if key in missing}
            if not numbers:
                continue
            halves, scales = file_arrays["halves"], file_arrays["scales"]
            shape = (*blocks_in(basis.size, factor), 3)
            if (halves.shape[1:], halves.dtype) != (shape, np.float16):
                continue
            for key, number in numbers.items():
                found[missing.pop(key)] = halves[number], float(scales[number])
    return found


def cache_denoised_planes(basis: Basis, planes: DenoisedPlanes) -> bool:
    """Store denoised planes of `basis`. Returns whether that worked: if not, nothing is lost."""
    return _write(basis, _content_keys(basis), planes)


def _write(basis: Basis, keys: list[str], planes: DenoisedPlanes) -> bool:
    try:
        path = basis_cache.companion_path(basis, basis_cache.DENOISED_SUFFIX)
        with replacing(path) as place, place.open("wb") as file:
            made_of, of_file = np.array(keys), np.array(_file_key(basis))
            arrays = (planes.halves, planes.scales, planes.current)
            parts: dict[str, Any] = dict(zip(ARRAY_NAMES, arrays, strict=True))
            np.savez(file, made_of=made_of, of_file=of_file, **parts)
    except (OSError, LightpaintError):
        return False
    return True


def _mixed(halves: Halves, scales: Doubles, weights: Doubles) -> Floats:
    scaled_weights = weights * scales[:, None]

    def strip(top: int) -> Floats:
        return mix(halves[:, top : top + STRIP_ROWS].astype(np.float32), scaled_weights)

    return np.concatenate(parallel_map(strip, range(0, halves.shape[1], STRIP_ROWS)))


def _shape(basis: Basis) -> tuple[int, int, int, int]:
    return (len(basis.lights), *basis.size, 3)


def _content_keys(basis: Basis) -> list[str]:
    """Return hashes of all that the denoised planes depend on: one for each light, and one for all
    of them in the current scene.
    """
    shared, stacks = _shared_key(basis), plane_sets(basis)
    keys = parallel_map(
        lambda k: _digest(*(planes.plane(k) for planes in stacks), start=shared),
        range(len(basis.lights)),
        unit="lights",
    )
    return [*keys, _digest(basis.current_weights, start=" ".join(keys))]


def _file_key(basis: Basis) -> str:
    """Return a hash of the same by the content of the file that has all planes; "" if there is
    none.
    """
    contents = {file_content(planes) for planes in plane_sets(basis)}
    if len(contents) > 1 or None in contents:
        return ""
    return _digest(basis.current_weights, start=f"{_shared_key(basis)} {contents.pop()}")


def _shared_key(basis: Basis) -> str:
    """Return a hash of what the denoised planes of all lights depend on."""
    features = basis.features
    parameters = repr(
        (
            FORMAT,
            denoiser_text(features, raw=""),
            basis.size,
            len(plane_sets(basis)),
            basis.knows_noise,
        )
    )
    inputs = [] if features is None else [features.albedo, features.normal]
    return _digest(*inputs, start=parameters)


def _digest(*arrays: npt.NDArray[Any], start: str) -> str:
    content = hashlib.blake2b(start.encode(), digest_size=16)
    for array in arrays:
        content.update(np.ascontiguousarray(array).data)
    return content.hexdigest()
