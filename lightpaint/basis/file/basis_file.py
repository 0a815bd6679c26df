"""Writes a basis as a multi-part OpenEXR file that other programs can open.

Part k is named after light k and holds its image as R, G, B; docs/formats.md has the details.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from lightpaint.basis.basis import Basis
from lightpaint.basis.file.checksums import CHECKSUMS_KEY, Checksums, checksum
from lightpaint.basis.file.file_parts import (
    LARGEST_SCALE,
    LIGHT_CHANNELS,
    PLANE_CHANNELS,
    checked_text,
    encoded_planes_of,
    light_channels,
    light_texts,
    other_parts,
    plane_sets,
)
from lightpaint.basis.file.half_floats import EncodedPlanes, PlaneEncoding
from lightpaint.basis.planes import IndirectLight
from lightpaint.images.formats.exr import (
    Channels,
    ExrPart,
)
from lightpaint.images.formats.exr_streams import PartHead, room_for, write_streamed
from lightpaint.keywords import keywords
from lightpaint.storage.json_records import fields_of

#: The written format, and an older one that is still read, in which all planes are float32.
FORMAT, OLD_FORMAT = "lightpaint-basis 2", "lightpaint-basis 1"
FORMAT_KEY = "lightpaint.format"
ORIGIN_KEY = "lightpaint.origin"

#: Size of all images in float32, in bytes, above which memory holds half floats: below it decoding
#: time matters more, above it memory.
SINGLES_MAX_BYTES = 2**27

#: Size of all planes in float32, in bytes, above which they stay in their file.
IN_MEMORY_MAX_BYTES = 2**31


@keywords()
def write_basis(path: str | Path, basis: Basis) -> None:
    """Write `basis` as a multi-part EXR file, atomically.

    Args:
        path: The file to write, by convention `*.basis.exr`.
        basis: The basis to write.

    Examples:
        >>> lp.write_basis("again.basis.exr", basis)
        >>> lp.read_basis("again.basis.exr").names
        ('panel', 'bulb')
    """
    # Newer fields are left out at their defaults, as in files that are older than these fields.
    later = ("each_light", "integrator", "is_composed", "extra_spp")
    of_origin = json.dumps(fields_of(basis.origin, *later), ensure_ascii=False)
    others, sums = list(other_parts(basis)), dict[str, str]()

    def parts() -> Iterator[tuple[PartHead, Channels]]:
        for k, light in enumerate(basis.lights):
            planes = encoded_planes_of(basis, k)
            texts = light_texts(light, [part.encoding for part in planes])
            channels = light_channels(planes)
            sums[light.name] = checksum(checked_text(texts), channels)
            yield PartHead.of(light.name, channels, texts), channels
        for part in others:
            head = PartHead.of(part.name, part.channels, part.attributes, display=part.display)
            yield head, part.channels

    def texts() -> dict[str, str]:
        seen_checksum = checksum("", others[0].channels)
        guide = "" if basis.guide_table is None else checksum("", others[1].channels)
        checksums = Checksums(sums, checksum(of_origin, {}), seen_checksum, guide)
        return {FORMAT_KEY: FORMAT, ORIGIN_KEY: of_origin, CHECKSUMS_KEY: checksums.text()}

    write_streamed(Path(path), parts(), room=_room(basis, others, of_origin), texts=texts)


def _room(basis: Basis, others: Sequence[ExrPart], of_origin: str) -> int:
    """Return an upper bound for the number of bytes before the first pixel of a basis file."""
    scaled_encodings = [PlaneEncoding(scale=LARGEST_SCALE)] * len(PLANE_CHANNELS)
    lights = [
        (light.name, light_texts(light, scaled_encodings), basis.size[0]) for light in basis.lights
    ]
    parts = [(part.name, part.attributes, part.size[0]) for part in others]
    checksums = Checksums(dict.fromkeys(basis.names, "0" * 8), *("0" * 8,) * 3)
    of_file = {FORMAT_KEY: FORMAT, ORIGIN_KEY: of_origin, CHECKSUMS_KEY: checksums.text()}
    return sum(room_for(*part) for part in (*lights, *parts, ("", of_file, 0)))


def as_stored(basis: Basis, keep: Callable[[Basis], object] = lambda basis: None) -> Basis:
    """Return `basis` with its planes rounded as `write_basis` stores them.

    Solving a basis that was just rendered then gives the same result as solving the one read back
    from its file. A large basis is returned with new planes in half floats. The planes of a small
    one, which must be in memory, are rounded in place.

    keep: called with the basis in stored encoding, which can be written without further rounding.
    """
    stored_basis = _encoded(basis)
    keep(stored_basis)
    if is_encoded(len(basis.lights), basis.size):
        return stored_basis
    for planes, stored_planes in zip(plane_sets(basis), plane_sets(stored_basis), strict=True):
        if planes is not stored_planes:
            for plane, rounded in zip(planes, stored_planes, strict=True):
                plane[...] = rounded
    return basis.without_cached_values()


def is_encoded(lights: int, size: tuple[int, int]) -> bool:
    """Return whether planes of this number of lights are held in memory in their file's
    encoding.
    """
    return 12 * lights * size[0] * size[1] > SINGLES_MAX_BYTES


def _encoded(basis: Basis) -> Basis:
    """Return `basis` with planes in the encoding of its file."""
    of_lights = [encoded_planes_of(basis, k) for k in range(len(basis.lights))]
    images, noise, *indirect = map(EncodedPlanes, zip(*of_lights, strict=True))
    parts = IndirectLight(*indirect) if indirect else None
    return replace(basis, planes=images, noise=noise, indirect=parts)


def is_large(lights: int, size: tuple[int, int]) -> bool:
    """Return whether planes of this number of lights stay in their file when it is read."""
    return 4 * len(LIGHT_CHANNELS) * lights * size[0] * size[1] > IN_MEMORY_MAX_BYTES


def is_basis_file(path: Path) -> bool:
    """Return True if `path` has the suffix of a basis file (EXR) rather than of a scene (XML)."""
    return path.suffix.lower() == ".exr"
