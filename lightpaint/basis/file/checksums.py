"""Checksums in a basis file, which detect that another program has changed it.

OpenEXR's own compression detects damage, but not a part that was painted over, converted to half,
cropped or replaced, and written again. The header of the first part has, as the text attribute
`lightpaint.checksums`, the CRC-32s of every light (header text and pixels together), of the origin
and of the mask of seen emitters. A file without this attribute is read unchecked.
"""

import json
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.errors import BasisError
from lightpaint.files import one_line
from lightpaint.storage.json_records import read_record, strict_json

CHECKSUMS_KEY = "lightpaint.checksums"

Channels = Mapping[str, npt.NDArray[Any]]


@dataclass(frozen=True)
class Checksums:
    """The checksums of a basis. lights: by name, in the order of the lights. learned: that of the
    guide table.
    """

    lights: Mapping[str, str]
    origin: str
    seen: str
    learned: str = ""

    def text(self) -> str:
        """Return the text for the header."""
        return json.dumps(vars(self), ensure_ascii=False)

    @classmethod
    def of_text(cls, text: str) -> "Checksums":
        """Read what `text` returned. Raises ValueError for anything else."""
        return read_record(cls, strict_json(text))

    def in_order(self, names: Sequence[str]) -> list[int]:
        """Return the indices of `names` in the order in which the lights were written.

        Raises BasisError if a light is missing, duplicated, or was not written with the others.
        """
        if missing := [name for name in self.lights if name not in names]:
            raise BasisError(f"has lost the light {one_line(missing[0])!r}: make it again")
        if new := [name for name in names if name not in self.lights]:
            raise BasisError(
                f"has the light {one_line(new[0])!r}, which was not written with the others: "
                "remove it"
            )
        if len(names) > len(self.lights):
            repeated_name = next(name for name in names if names.count(name) > 1)
            raise BasisError(
                f"has the light {one_line(repeated_name)!r} more than once: remove one"
            )
        return [list(names).index(name) for name in self.lights]


def checksum(text: str, channels: Channels) -> str:
    """Return the CRC-32 of a text and of pixels with their sizes, types and names, as eight
    hexadecimal digits.
    """
    crc = zlib.crc32(text.encode())
    for name in sorted(channels):
        pixels = np.ascontiguousarray(channels[name])
        crc = zlib.crc32(repr((name, pixels.shape, pixels.dtype.str)).encode(), crc)
        crc = zlib.crc32(pixels.data, crc)
    return f"{crc:08x}"


def check(expected: str, part: str, text: str, channels: Channels) -> None:
    """Raise BasisError unless text and pixels match the checksum that was stored for them."""
    if checksum(text, channels) == expected:
        return
    raise BasisError(
        f"has a changed {part}: another program has edited or converted the "
        "file; use the original, or make it again with lightpaint basis"
    )
