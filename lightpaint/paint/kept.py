"""What a session file holds and is read when somebody asks for it: pixels of steps and of looks."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.errors import PaintError
from lightpaint.paint.packed import packed, unpacked, unpacked_patch
from lightpaint.paint.pixels import Pixels, Region
from lightpaint.paint.steps import Patch
from lightpaint.records import strict_json

#: What looks are made of.
DTYPES = ("float32", "float64", "float16", "uint8", "int16")

#: Arrays of a look by name: dtype, shape as JSON, data.
PackedArrays = dict[str, tuple[str, str, bytes]]


#: View and region of a patch, and whether it is marked (`is_marked`).
Place = tuple[int, Region, bool]


class KeptPatch(Patch):
    """A patch that is in a file, the k-th of its step.

    places: of each. read: pixels of all of them before, and how those after differ,
    packed.
    """

    def __init__(
        self, places: Sequence[Place], k: int, read: Callable[[], tuple[bytes, bytes]]
    ) -> None:
        view, region, _ = places[k]
        vars(self).update(view=view, region=region, _places=places, _k=k, _read=read)

    @property
    def before(self) -> Pixels:
        return self._pixels()[0]

    @property
    def after(self) -> Pixels:
        return self._pixels()[1]

    def _pixels(self) -> tuple[Pixels, Pixels]:
        its = vars(self)
        places = [(region, marked) for _, region, marked in its["_places"]]
        return unpacked_patch(places, its["_k"], *its["_read"]())


class LookArrays(Mapping[str, npt.NDArray[Any]]):
    """Arrays of a look that are in a file. read: those of the look of a number."""

    def __init__(self, read: Callable[[int], PackedArrays], number: int) -> None:
        self._read, self._number = read, number

    def is_of(self, read: Callable[[int], PackedArrays], number: int) -> bool:
        """Whether these are of that look in that file."""
        return (self._read, self._number) == (read, number)

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        dtype, shape, data = self._read(self._number)[name]
        if dtype not in DTYPES:
            raise PaintError(f"a damaged look: {dtype}")
        return np.asarray(unpacked(data, dtype, tuple(map(int, strict_json(shape)))))

    def __iter__(self) -> Iterator[str]:
        return iter(self._read(self._number))

    def __len__(self) -> int:
        return len(self._read(self._number))


def packed_arrays(arrays: Mapping[str, npt.NDArray[Any]]) -> PackedArrays:
    """Arrays of a look, packed. Raises PaintError for a type that none has."""
    found = {}
    for name, array in arrays.items():
        if array.dtype.name not in DTYPES:
            raise PaintError(f"a look of {array.dtype.name}: expected {', '.join(DTYPES)}")
        found[name] = (array.dtype.name, json.dumps(array.shape), packed(array))
    return found
