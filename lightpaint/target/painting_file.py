"""lightpaint's own file format for paintings: light, importance, and how it was painted.

An EXR does not state its display, and marks unpainted pixels only by importance. A painting from
lightpaint records both, so that its solution is the same as during painting.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from lightpaint.colour import ViewTransform
from lightpaint.errors import TargetError
from lightpaint.images import AT_LEAST
from lightpaint.images.formats import ExrPart, rgb_channels, write_parts
from lightpaint.storage.json_records import fields_of, read_record, strict_json
from lightpaint.target.target import Target

#: Text attribute of the EXR.
KEY = "lightpaint.painting"

FORMAT: Literal["lightpaint-painting 1"] = "lightpaint-painting 1"


@dataclass(frozen=True)
class Painted:
    """The way a target was painted; see `Target`. view, stops: the transform; "" for none."""

    format: Literal["lightpaint-painting 1"] = FORMAT
    over_look: bool = False
    through_view: bool = False
    view: str = ""
    stops: float = 0.0

    @property
    def transform(self) -> ViewTransform | None:
        """The view transform of the painting, or None."""
        return ViewTransform(self.view, self.stops) if self.view else None


def write_painting(path: Path, target: Target) -> None:
    """Write a target as an EXR, from which `read_target` restores it to the last bit."""
    transform = target.transform
    name, stops = ("", 0.0) if transform is None else (transform.name, transform.stops)
    painted = Painted(FORMAT, target.over_look, target.through_view, name, stops)
    channels = rgb_channels(target.image) | {"W": target.importance.astype(np.float32)}
    if target.at_least is not None and target.at_least.any():
        channels |= rgb_channels(target.at_least.astype(np.float32), AT_LEAST)
    write_parts(path, [ExrPart("rgb", channels, {KEY: json.dumps(fields_of(painted))})])


def painted_of(attributes: Mapping[str, str], path: Path) -> Painted | None:
    """Return how the EXR at `path` was painted; None if it does not say. Raises TargetError."""
    if KEY not in attributes:
        return None
    try:
        return read_record(Painted, strict_json(attributes[KEY]))
    except ValueError as error:
        raise TargetError(path, f": its attribute {KEY} is damaged: {error}") from None
