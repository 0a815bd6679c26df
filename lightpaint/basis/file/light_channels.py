"""The channels of the part of a light in a basis file: of all pixels, or of its lit pixels."""

from collections.abc import Collection

from lightpaint.images import HALF_DIFFERENCE

#: Channels of each light: its image and its noise.
IMAGE_CHANNELS, NOISE_CHANNELS = (*"RGB",), (*(f"{HALF_DIFFERENCE}.{c}" for c in "RGB"),)
LIGHT_CHANNELS = {*IMAGE_CHANNELS, *NOISE_CHANNELS}

#: Channels of the indirect part of image and noise, if it is stored separately.
INDIRECT_IMAGE_CHANNELS = (*(f"indirect.{c}" for c in "RGB"),)
INDIRECT_NOISE_CHANNELS = (*(f"indirect_{HALF_DIFFERENCE}.{c}" for c in "RGB"),)
INDIRECT_CHANNELS = {*INDIRECT_IMAGE_CHANNELS, *INDIRECT_NOISE_CHANNELS}

#: Channels of all planes that a light may have.
PLANE_CHANNELS = (IMAGE_CHANNELS, NOISE_CHANNELS, INDIRECT_IMAGE_CHANNELS, INDIRECT_NOISE_CHANNELS)

#: The channel of a part with only lit pixels (see lit_parts.py) that has the steps between them.
STEP = "step"

#: Prefixes of the channels of image and ratios, of all light and of indirect light.
PREFIXES = (("", "half_ratio."), ("indirect.", "indirect_half_ratio."))

#: All channels of a part with indirect light.
LIT_CHANNELS = {STEP, *(f"{prefix}{c}" for pair in PREFIXES for prefix in pair for c in "RGB")}


def has_indirect_channels(names: Collection[str]) -> bool:
    """Return whether the part of a light with these channels has its indirect light."""
    wanted = LIT_CHANNELS if is_lit_part(names) else INDIRECT_CHANNELS
    return wanted <= {*names}


def channels_of_plane(number: int) -> tuple[list[str], list[str]]:
    """Return the channels of the image and, if it is a half difference, the ratios of a plane.

    number: index into `PLANE_CHANNELS`.
    """
    image, ratios = ([f"{prefix}{c}" for c in "RGB"] for prefix in PREFIXES[number // 2])
    return image, ratios if number % 2 else []


def is_lit_part(channels: Collection[str]) -> bool:
    """Return whether a part with these channels holds the lit pixels of a light."""
    return STEP in channels
