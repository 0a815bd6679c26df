"""The film of a sensor, in full size or reduced so that each pixel is a block of full-size pixels;
what it records of spectra; and points at which light is measured instead of its pixels.

Only then is a box-filtered render on the reduced film the block mean of a full-size one, so that a
painting or a verification in full size can be compared with it exactly. If film size, crop window
and offset are multiples of the block size, Mitsuba's own film is made smaller. Otherwise the film
keeps its size, its crop window is cut to whole blocks, and a pixel is the mean of a block.

By itself Mitsuba samples wavelengths as the eye sees them. Of a narrow LED most samples then see
nothing: there is some five times the noise of RGB. But a `specfilm` samples them by the sum of its
channels. So it gets a channel for each curve of the observer, and one more, whose values are not
used: the light of the scene's emitters.
"""

import hashlib
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lightpaint.arrays import Bools, Doubles, Floats
from lightpaint.colour import Observer
from lightpaint.display_text import some_names
from lightpaint.errors import SceneError
from lightpaint.images import blocks_in, left_over, whole_factor
from lightpaint.keywords import describe_value
from lightpaint.validation import MAX_PIXELS, MAX_SPP

#: Wavelengths of the channels in nm.
WAVES = np.arange(380, 781, dtype=np.float64)

#: Share of the samples whose wavelengths are those that the observer sees, whatever lamps emit.
EVEN_SHARE = 0.25

#: Maximum number of sizes that an error lists.
LISTED_SIZES = 8


@dataclass(frozen=True)
class Bands:
    """The bands that a film records: integrals of radiance over the curves of an observer.

    curves: (401, 3) at WAVES, >= 0. emitted: (401,), the density with which other wavelengths are
    sampled as well; 0 if the curves suffice.
    """

    curves: Doubles
    emitted: Doubles

    def channels(self) -> dict[str, Any]:
        """Return the channels of Mitsuba's film: the channels of the observer come first."""
        columns = [x for x in (*self.curves.T, self.emitted) if x.any()]
        return {
            f"channel_{k}": {
                "type": "regular",
                "wavelength_min": WAVES[0],
                "wavelength_max": WAVES[-1],
                "values": ",".join(f"{x:.7g}" for x in column),
            }
            for k, column in enumerate(columns)
        }


def bands_of(state: Any, emissions: Iterable[tuple[int, str]], observer: Observer) -> Bands:
    """Return the bands of renders of a scene.

    state: its nodes, from Mitsuba's parser. emissions: node and parameter of each.
    """
    curves = observer.curves(WAVES)
    seen, emitted = np.linalg.norm(observer.response(WAVES), axis=1), np.zeros(len(WAVES))
    for power in _spectra(state, emissions):
        contributed = power * seen
        if total := contributed.sum():
            emitted += contributed / total
    if total := emitted.sum():
        emitted *= (1 / EVEN_SHARE - 1) * curves.sum() / total
    return Bands(curves, emitted)


def _spectra(state: Any, emissions: Iterable[tuple[int, str]]) -> Iterator[Doubles]:
    """Yield the power at WAVES of each emitter; a power of RGB counts as even."""
    import mitsuba as mi

    for node, parameter in emissions:
        props = state.nodes[node].props
        if parameter not in props or props.type(parameter) != mi.Properties.Type.Spectrum:
            yield np.ones(len(WAVES))
            continue
        spectrum = props[parameter]
        waves, values = np.array(spectrum.wavelengths), np.array(spectrum.values)
        if len(waves) > 1:
            yield np.maximum(np.interp(WAVES, waves, values, left=0, right=0), 0)


def as_seen(image: Floats, observer: Observer) -> Floats:
    """Return what a film of `Bands` recorded, (h, w, 3 or 4), as linear Rec.709 (h, w, 3)."""
    import mitsuba as mi

    matrix = mi.MI_CIE_Y_NORMALIZATION * observer.matrix
    return np.asarray(image[..., :3] @ matrix.T.astype(np.float32))


#: The version of measurements. Earlier ones in a cache, whose sums of more than 2,048 samples lost
#: light, are not taken for these.
MEASURED_AS = b"sums of blocks"


@dataclass(frozen=True, eq=False)
class MeasuringPoints:
    """Points, and the directions in which irradiance is measured there.

    positions: (p, 3) in scene units. normals: (p, 3), unit vectors. is_cylindrical: (p,), whether
    the irradiance is the mean over all directions perpendicular to the normal. is_split: whether
    light that comes straight from emitters is kept apart from all other.
    """

    positions: Doubles
    normals: Doubles
    is_cylindrical: Bools
    is_split: bool = False

    def __post_init__(self) -> None:
        count = len(self.positions)
        if not 0 < count <= MAX_PIXELS:
            raise SceneError(f"{count} measuring points: expected 1 to {MAX_PIXELS}")
        if not np.isfinite(self.positions).all():
            raise SceneError("a measuring point has a position that is not finite")
        if not np.allclose(np.linalg.norm(self.normals, axis=1), 1, atol=1e-5):
            raise SceneError("the normal of a measuring point is not of unit length")

    def __len__(self) -> int:
        return len(self.positions)

    def place_beside(self) -> Any:
        """Return a place from which all points are about equally far, as an `mi.Point3f`."""
        import mitsuba as mi

        low, high = self.positions.min(axis=0), self.positions.max(axis=0)
        return mi.Point3f(*map(float, high + np.linalg.norm(high - low) + 1))

    def identify(self, content: str) -> str:
        """Return the identity of `content`, a hash of a scene, seen at these points."""
        digest = hashlib.sha256(content.encode() + MEASURED_AS)
        for values in (self.positions, self.normals, self.is_cylindrical):
            digest.update(np.ascontiguousarray(values).tobytes())
        if self.is_split:
            digest.update(b"split")
        return digest.hexdigest()[:32]


@dataclass(frozen=True)
class Film:
    """The film of a sensor: its size and its crop window, in pixels.

    sensor: its index in the scene. block: side in film pixels of the block that forms a pixel of
    the picture. All pairs are (x, y).
    """

    sensor: int
    size: tuple[int, int]
    crop_size: tuple[int, int]
    crop_offset: tuple[int, int]
    block: int = 1

    @classmethod
    def of(cls, camera: Any, sensor: int) -> "Film":
        """Return the film of a loaded sensor. sensor: its index."""
        film = camera.film()
        size, crop_size, offset = (
            (int(pair[0]), int(pair[1]))
            for pair in (film.size(), film.crop_size(), film.crop_offset())
        )
        return cls(sensor, size, crop_size, offset)

    @property
    def pixels(self) -> tuple[int, int]:
        """Size of the picture in pixels."""
        return blocks_in(self.crop_size, self.block)

    @property
    def left_out(self) -> tuple[int, int]:
        """Columns at the right and rows at the bottom that do not fill a block."""
        return left_over(self.crop_size, self.block)

    @property
    def block_pixels(self) -> int:
        """Number of film pixels in a pixel of the picture, which is also its minimum number of
        samples.
        """
        return self.block**2

    def load(self, bands: Bands | None = None) -> Any:
        """Create a Mitsuba film with a box filter and float32 pixels, covering all blocks.

        Its pixels are RGB or, in a spectral variant, the channels of `bands`.
        """
        import mitsuba as mi

        width, height = (side * self.block for side in self.pixels)
        rgb = {"type": "hdrfilm", "pixel_format": "rgb"}
        return mi.load_dict(
            {
                **(rgb if bands is None else {"type": "specfilm", **bands.channels()}),
                "width": self.size[0],
                "height": self.size[1],
                "crop_width": width,
                "crop_height": height,
                "crop_offset_x": self.crop_offset[0],
                "crop_offset_y": self.crop_offset[1],
                "component_format": "float32",
                "rfilter": {"type": "box"},
            }
        )


def even_reductions(film: Film) -> list[int]:
    """Return the factors that divide film and crop window without remainder, ascending from 1."""
    common = math.gcd(*film.size, *film.crop_size, *film.crop_offset)
    return [factor for factor in range(1, common + 1) if common % factor == 0]


def reduction_to(film: Film, pixels: int) -> int:
    """Return the smallest factor that reduces `film` to at most `pixels`, or a slightly larger one
    if that divides the film evenly.
    """
    width, height = film.pixels
    factor = math.isqrt(max(width * height - 1, 0) // pixels) + 1
    smallest = min(factor, width, height)
    even = (k for k in even_reductions(film) if smallest <= k < 2 * smallest)
    return next(even, smallest)


def check_resolution(resolution: str) -> re.Match[str]:
    """Return the match of a fraction, `1/4`, or a size, `320x180`. Raises SceneError otherwise."""
    match = re.fullmatch(r"1/([0-9]{1,9})|([0-9]{1,9})x([0-9]{1,9})", resolution)
    if match is None:
        raise SceneError(f"{resolution!r} is not a resolution: expected one like 1/4 or 320x180")
    return match


def reduction(film: Film, resolution: str) -> int:
    """Return the reduction factor for a `resolution` such as `1/4` or `320x180`.

    A size is the size of the picture. Raises SceneError if no square blocks result in that size.
    """
    match = check_resolution(resolution)
    part, width, height = (int(number or 0) for number in match.groups())
    factor = part if match[1] else None
    if width and height:
        factor = whole_factor(film.pixels, (width, height))
    if not factor or factor > min(film.pixels):
        size = "x".join(map(str, film.pixels))
        raise SceneError(
            f"a film of {size} cannot be reduced to {resolution}, since its parts must be square "
            f"blocks of pixels: {_possible(film, width)} will do"
        )
    return factor


def _possible(film: Film, width: int) -> str:
    """Return sizes to which `film` can be reduced: near `width` if that is > 0, and without
    remainder.
    """
    nearest = film.pixels[0] // width if width else 2
    factors = [*range(max(nearest, 2), nearest + 3), *even_reductions(film)[1 : LISTED_SIZES + 1]]
    sizes = {
        k: f"{'x'.join(map(str, blocks_in(film.pixels, k)))} (1/{k})"
        for k in factors
        if k <= min(film.pixels)
    }
    return ", ".join(sizes[k] for k in sorted(sizes)) or "only its full size"


def reduced(film: Film, factor: int) -> Film:
    """Return `film` in blocks of factor × factor pixels, or in larger blocks if their number is the
    same.
    """
    block_count = blocks_in(film.pixels, factor)
    factor = whole_factor(film.pixels, block_count) or factor
    if film.block > 1 or factor not in even_reductions(film):
        return replace(film, block=film.block * factor)
    return replace(
        film,
        size=blocks_in(film.size, factor),
        crop_size=block_count,
        crop_offset=blocks_in(film.crop_offset, factor),
    )


def with_width(film: Film, width: int) -> Film:
    """Return a film whose picture has this width and the same frame; the height is rounded.

    Its pixels are film pixels, without blocks. Raises SceneError for more than MAX_PIXELS.
    """
    factor = width / film.crop_size[0]
    sides = [round(side * factor) for side in (*film.size, *film.crop_size, *film.crop_offset)]
    crop_size = width, max(1, sides[3])
    if crop_size[0] * crop_size[1] > MAX_PIXELS:
        raise SceneError(
            f"a picture of {crop_size[0]}x{crop_size[1]} pixels: expected at most {MAX_PIXELS}"
        )
    offset = sides[4], sides[5]
    # The crop window lies within the film, also after rounding.
    size = (
        max(sides[0], crop_size[0] + offset[0]),
        max(sides[1], crop_size[1] + offset[1]),
    )
    return replace(film, size=size, crop_size=crop_size, crop_offset=offset, block=1)


def check_film(path: Path, film: Film, spp: int) -> None:
    """Raise SceneError for an invalid film size, or too many samples per pixel."""
    width, height = film.crop_size
    if min(width, height) < 1:
        raise SceneError(
            f"{path} has a film of {width}x{height} pixels: there is nothing to render"
        )
    if width * height > MAX_PIXELS:
        raise SceneError(
            f"{path} has a film of {width}x{height} pixels: expected at most {MAX_PIXELS}; "
            "make its width and height smaller"
        )
    if spp > MAX_SPP:
        raise SceneError(
            f"{path} asks for {spp} samples per pixel: expected at most {MAX_SPP}; "
            "make its sample_count smaller"
        )


def camera_named(loaded: Any, name: str) -> Any:
    """Return the sensor with that id in a loaded scene. Raises SceneError."""
    if not hasattr(loaded, "sensors"):
        raise SceneError(f"loaded is {describe_value(loaded)}: expected what Scene.load() returns")
    for sensor in loaded.sensors():
        if sensor.id() == name:
            return sensor
    # Mitsuba makes one of equal sensors without an id.
    raise SceneError(f"two sensors are equal and have no id (one is {name}): leave one out")


def sensor_index(sensor: int | str | None, names: Sequence[str], path: Path) -> int:
    """Return the index of the sensor with that index or name, by default the first. Raises
    SceneError.
    """
    if not names:
        raise SceneError(f"{path} has no sensor: add one to look through")
    if sensor is None:
        return 0
    if isinstance(sensor, str) and sensor in names:
        return names.index(sensor)
    try:
        index = int(sensor)
    except ValueError:
        index = -1
    if not 0 <= index < len(names):
        names_text = some_names(f"{k} ({name})" for k, name in enumerate(names))
        raise SceneError(f"{path} has no sensor {sensor!r}: it has {names_text}")
    return index
