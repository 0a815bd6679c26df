"""The film of a sensor, whole or reduced by a factor so that each pixel is a block of the whole's.

Only then is a box-filtered render on the small film the block mean of one on the large, and a
painting or a verification of full size can be compared with it exactly.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from lightpaint.errors import SceneError
from lightpaint.images.blocks import whole_factor
from lightpaint.screen import some_names

#: Pixels of a film and its samples per pixel beyond which each is a mistake.
MAX_PIXELS = 2**28
MAX_SPP = 2**20

#: How many sizes a refusal names.
NAMED = 8


@dataclass(frozen=True)
class Film:
    """The film of a sensor: size of the whole and of the crop window within, in pixels.

    sensor: its index among the scene's own. All pairs are (x, y).
    """

    sensor: int
    size: tuple[int, int]
    crop_size: tuple[int, int]
    crop_offset: tuple[int, int]

    @classmethod
    def of(cls, camera: Any, sensor: int) -> "Film":
        """Of a loaded sensor, and its index."""
        film = camera.film()
        size, crop_size, offset = (
            (int(pair[0]), int(pair[1]))
            for pair in (film.size(), film.crop_size(), film.crop_offset())
        )
        return cls(sensor, size, crop_size, offset)

    def load(self) -> Any:
        """A box-filtered RGB float32 film of this size, as Mitsuba has it."""
        import mitsuba as mi

        return mi.load_dict(
            {
                "type": "hdrfilm",
                "width": self.size[0],
                "height": self.size[1],
                "crop_width": self.crop_size[0],
                "crop_height": self.crop_size[1],
                "crop_offset_x": self.crop_offset[0],
                "crop_offset_y": self.crop_offset[1],
                "pixel_format": "rgb",
                "component_format": "float32",
                "rfilter": {"type": "box"},
            }
        )


def reductions(film: Film) -> list[int]:
    """The factors that divide film and crop window, ascending from 1."""
    common = math.gcd(*film.size, *film.crop_size, *film.crop_offset)
    return [factor for factor in range(1, common + 1) if common % factor == 0]


def check_resolution(resolution: str) -> re.Match[str]:
    """Its numbers. Raises SceneError for what is neither a part, `1/4`, nor a size, `320x180`."""
    given = re.fullmatch(r"1/(\d{1,9})|(\d{1,9})x(\d{1,9})", resolution)
    if given is None:
        raise SceneError(f"{resolution!r} is not a resolution: give one like 1/4 or 320x180")
    return given


def reduction(film: Film, resolution: str) -> int:
    """The factor that `resolution`, `1/4` or `320x180`, means for `film`.

    A size is that of the image, so of the crop window. Raises SceneError if it is neither,
    or if film or crop window are not whole multiples of it.
    """
    given = check_resolution(resolution)
    part, width, height = (int(number or 0) for number in given.groups())
    factor = part if given[1] else None
    if width and height:
        factor = whole_factor(film.crop_size, (width, height))
    possible = reductions(film)
    if factor not in possible:
        whole = "x".join(map(str, film.crop_size))
        sizes = [f"{_size(film, k)} (1/{k})" for k in possible[1 : NAMED + 1]]
        raise SceneError(
            f"a film of {whole} cannot be reduced to {resolution}, since its parts must be whole "
            f"blocks of pixels: {', '.join(sizes) or 'only its full size'} will do"
        )
    return factor


def reduced(film: Film, factor: int) -> Film:
    """`film` on a film that is smaller by one of its `reductions`."""

    def part(pair: tuple[int, int]) -> tuple[int, int]:
        return pair[0] // factor, pair[1] // factor

    return replace(
        film,
        size=part(film.size),
        crop_size=part(film.crop_size),
        crop_offset=part(film.crop_offset),
    )


def _size(film: Film, factor: int) -> str:
    return "x".join(str(side // factor) for side in film.crop_size)


def check_film(path: Path, film: Film, spp: int) -> None:
    """Raise SceneError for a film, or samples per pixel, that nobody can mean."""
    width, height = film.crop_size
    if min(width, height) < 1:
        raise SceneError(
            f"{path} has a film of {width}x{height} pixels: there is nothing to render"
        )
    if width * height > MAX_PIXELS:
        raise SceneError(
            f"{path} has a film of {width}x{height} pixels: no more than {MAX_PIXELS} can be "
            "rendered; make its width and height smaller"
        )
    if spp > MAX_SPP:
        raise SceneError(
            f"{path} asks for {spp} samples per pixel: no more than {MAX_SPP} can be rendered; "
            "make its sample_count smaller"
        )


def camera_named(loaded: Any, name: str) -> Any:
    """The sensor of that name in a loaded scene."""
    return next(sensor for sensor in loaded.sensors() if sensor.id() == name)


def sensor_index(wanted: int | str | None, names: Sequence[str], path: Path) -> int:
    """Of the sensor with that index or name, the first by default. Raises SceneError."""
    if not names:
        raise SceneError(f"{path} has no sensor: add one to look through")
    if wanted is None:
        return 0
    if isinstance(wanted, str) and wanted in names:
        return names.index(wanted)
    try:
        index = int(wanted)
    except ValueError:
        index = -1
    if not 0 <= index < len(names):
        listed = some_names(f"{k} ({name})" for k, name in enumerate(names))
        raise SceneError(f"{path} has no sensor {wanted!r}: it has {listed}")
    return index
