"""Parts of a basis file that hold only the lit pixels of a light, for bases of many lights.

The numbers of the lit pixels follow one another, in row-major order, in rows as wide as the
picture. `step` is the distance in pixels from the previous lit pixel, or from the pixel before the
first one; 0 ends the list. Half differences are stored as ratios to their image, of which most are
1 or −1, since most pixels of noisy lights are lit by one half of the samples alone.
"""

from collections.abc import Sequence

import numpy as np

from lightpaint.basis.file import light_channels
from lightpaint.basis.file.half_floats import HALF, EncodedPlane, PlaneEncoding
from lightpaint.basis.file.lit_planes import LitPlane
from lightpaint.basis.file.noise_rounding import noise_ratios
from lightpaint.images.formats import Channels

#: Largest step, up to which half floats hold integers exactly. Where no pixel is lit for longer,
#: black ones stand in between.
MAX_STEP = 2**11


def as_lit_plane(plane: EncodedPlane | LitPlane) -> LitPlane:
    """Return the lit pixels of a plane."""
    return plane if isinstance(plane, LitPlane) else LitPlane.of([*plane.numbers], plane.scale)


def as_lit_planes(planes: Sequence[EncodedPlane | LitPlane]) -> list[LitPlane]:
    """Return the planes of a light with the same lit pixels."""
    lit = [as_lit_plane(plane) for plane in planes]
    pixels = lit[0].pixels
    if all(x.pixels is pixels or np.array_equal(x.pixels, pixels) for x in lit):
        return lit
    merged = np.sort(np.concatenate([x.pixels for x in lit]), kind="stable")
    is_new = np.ones(merged.size, bool)
    np.not_equal(merged[1:], merged[:-1], out=is_new[1:])
    return [x.at(merged[is_new]) for x in lit]


def as_encoded_plane(plane: EncodedPlane | LitPlane, size: tuple[int, int]) -> EncodedPlane:
    """Return a plane with all its pixels."""
    if isinstance(plane, EncodedPlane):
        return plane
    numbers = np.zeros((3, size[0] * size[1]), plane.numbers.dtype)
    numbers[:, plane.pixels] = plane.numbers
    encoding = PlaneEncoding(plane.numbers.dtype, plane.scale)
    return EncodedPlane(encoding, numbers.reshape(3, *size))


def lit_channels(
    planes: Sequence[EncodedPlane | LitPlane], size: tuple[int, int]
) -> Channels | None:
    """Return the channels of a part with the lit pixels of a light; None if they do not hold its
    planes exactly.
    """
    lit = as_lit_planes(planes)
    pairs = list(zip(lit[::2], lit[1::2], strict=True))
    # Half differences that are read have the scale of their image.
    if any(x.numbers.dtype != HALF for x in lit) or any(x.scale != y.scale for x, y in pairs):
        return None
    steps = np.diff(lit[0].pixels.astype(np.intp), prepend=-1)
    places = np.cumsum(-(-steps // MAX_STEP)) - 1  # with the black pixels in between
    count, width = int(places[-1]) + 1 if places.size else 0, size[1]
    rows = max(1, -(-count // width))
    listed = np.zeros(rows * width, HALF)
    listed[:count] = MAX_STEP
    listed[places] = steps - MAX_STEP * (-(-steps // MAX_STEP) - 1)
    channels = {light_channels.STEP: listed.reshape(rows, width)}
    for (image, noise), prefixes in zip(pairs, light_channels.PREFIXES, strict=False):
        ratios = noise_ratios(image.numbers, noise.numbers)
        if ratios is None:
            return None
        for prefix, numbers in zip(prefixes, (image.numbers, ratios), strict=True):
            for c, values in zip("RGB", numbers, strict=True):
                channel = np.zeros(rows * width, HALF)
                channel[places] = values
                channels[prefix + c] = channel.reshape(rows, width)
    return channels


def read_lit_planes(
    channels: Channels, scales: Sequence[float], size: tuple[int, int]
) -> list[LitPlane]:
    """Return the planes that a part with lit pixels holds, in the order of `PLANE_CHANNELS`.

    Raises BasisError if it is damaged.
    """
    pixels = light_channels.lit_pixels(channels[light_channels.STEP].reshape(-1), size)
    planes = []
    has_indirect = channels.keys() >= light_channels.LIT_CHANNELS
    for k, (first, second) in enumerate(
        light_channels.PREFIXES if has_indirect else light_channels.PREFIXES[:1]
    ):
        light, ratios = (
            np.stack([channels[prefix + c].reshape(-1)[: pixels.size] for c in "RGB"])
            for prefix in (first, second)
        )
        planes.append(LitPlane(pixels, light, scales[2 * k]))
        planes.append(LitPlane(pixels, light_channels.noise_numbers(light, ratios), scales[2 * k]))
    return planes
