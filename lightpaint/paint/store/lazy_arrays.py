"""Contents of a session file that are read on first use: pixels of steps and of looks."""

import json
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from lightpaint.errors import PaintError
from lightpaint.files import first_line
from lightpaint.paint.store.canvas_pixels import Pixels, Region
from lightpaint.paint.store.compression import pack, unpack
from lightpaint.paint.store.history_steps import Patch
from lightpaint.storage.json_records import strict_json

#: Element types of a look's arrays.
DTYPES = ("float32", "float64", "float16", "uint8", "int16")

#: An array of a look: dtype, shape as JSON, data; and all of them by name.
PackedArray = tuple[str, str, bytes]
PackedArrays = dict[str, PackedArray]


class StoredPatch(Patch):
    """A patch in a file. read: returns its pixels before and after."""

    def __init__(
        self, view: int, layer: int, region: Region, read: Callable[[], tuple[Pixels, Pixels]]
    ) -> None:
        vars(self).update(view=view, layer=layer, region=region, _read=read)

    @property
    def before(self) -> Pixels:
        return self._pixels()[0]

    @property
    def after(self) -> Pixels:
        return self._pixels()[1]

    def _pixels(self) -> tuple[Pixels, Pixels]:
        pixels: tuple[Pixels, Pixels] = vars(self)["_read"]()
        return pixels


class LookFile(Protocol):
    """A file of looks, as `LookArrays` reads it."""

    def look_names(self, number: int) -> list[str]:
        """Return the names of a look's arrays, in order."""

    def look_array(self, number: int, name: str) -> PackedArray:
        """Return one of its arrays. Raises KeyError if there is none."""


class LookArrays(Mapping[str, npt.NDArray[Any]]):
    """Arrays of one look in a file, by name."""

    def __init__(self, file: LookFile, number: int) -> None:
        self._file, self._number = file, number

    def matches(self, file: LookFile, number: int) -> bool:
        """Return whether these are the arrays of that look in that file."""
        return (self._file, self._number) == (file, number)

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        dtype, shape, data = self._file.look_array(self._number, name)
        if dtype not in DTYPES:
            raise PaintError(f"a damaged look: {dtype}")
        try:
            return np.asarray(unpack(data, dtype, tuple(map(int, strict_json(shape)))))
        except (TypeError, ValueError) as error:
            raise PaintError(f"a damaged look: {first_line(error)}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._file.look_names(self._number))

    def __len__(self) -> int:
        return len(self._file.look_names(self._number))


def pack_arrays(arrays: Mapping[str, npt.NDArray[Any]]) -> PackedArrays:
    """Return the arrays of a look, packed. Raises PaintError for an unexpected type."""
    packed = {}
    for name, array in arrays.items():
        if array.dtype.name not in DTYPES:
            raise PaintError(f"a look of {array.dtype.name}: expected {', '.join(DTYPES)}")
        packed[name] = (array.dtype.name, json.dumps(array.shape), pack(array))
    return packed
