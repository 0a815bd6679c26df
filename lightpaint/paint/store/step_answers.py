"""The answers after steps, which a session file keeps to show where each step led."""

import json
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles
from lightpaint.paint.store.compression import pack, unpack
from lightpaint.storage.json_records import strict_json


@dataclass(frozen=True, eq=False)
class StepAnswer:
    """The lighting after a step, as it was shown.

    weights: emission (3,) by name of light, under the master dimmer. places: the places of lights,
    as a text that is equal for equal places. picture: (h, w, 3) uint8, small, in display values.
    """

    weights: dict[str, tuple[float, ...]]
    places: str
    picture: npt.NDArray[np.uint8]

    def packed(self) -> tuple[str, bytes]:
        """Return JSON and bytes, which `unpacked` reads."""
        fields = {
            "weights": self.weights,
            "places": self.places,
            "shape": self.picture.shape,
        }
        return json.dumps(fields), pack(np.ascontiguousarray(self.picture))

    @classmethod
    def unpacked(cls, fields: str, picture: bytes) -> "StepAnswer":
        """Return what `packed` wrote. Raises PaintError, LookupError, TypeError or ValueError for
        anything else.
        """
        values = strict_json(fields)
        weights = {str(name): tuple(map(float, rgb)) for name, rgb in values["weights"].items()}
        shape = tuple(map(int, values["shape"]))
        pixels = np.asarray(unpack(picture, "uint8", shape))
        if pixels.ndim != 3 or any(len(rgb) != 3 for rgb in weights.values()):
            raise ValueError("no answer")
        return cls(weights, str(values["places"]), pixels)

    def weights_of(self, names: tuple[str, ...]) -> Doubles:
        """Return the weights (n, 3) of lights with these names; 0 for others."""
        return np.array([self.weights.get(name, (0.0, 0.0, 0.0)) for name in names], np.float64)
