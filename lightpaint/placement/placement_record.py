"""Placements as JSON: moves and new lights, for other looks and other machines."""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Literal

from lightpaint.arrays import RGB
from lightpaint.errors import SceneError
from lightpaint.file_reading import read_text
from lightpaint.placement.placement import AddedLight, Move, Placement, hung
from lightpaint.scene.scene import Scene
from lightpaint.sentences import Hint
from lightpaint.storage.json_records import read_record, strict_json

FORMAT: Literal["lightpaint-places 1"] = "lightpaint-places 1"

#: Maximum size in bytes of a file.
MAX_BYTES = 2**22


@dataclass(frozen=True)
class PlacementRecord:
    """A placement without its scenes and pictures.

    made_of: fingerprint of its inputs. Others: as in `Placement`.
    """

    moves: tuple[Move, ...]
    additions: tuple[AddedLight, ...]
    missed_before: float
    missed_after: float
    looks: tuple[str, ...] = ()
    level_errors: tuple[tuple[str, RGB], ...] = ()
    made_of: str = ""
    format: Literal["lightpaint-places 1"] = FORMAT

    def hung_in(self, scenes: Sequence[Scene]) -> Placement:
        """Return the placement applied to `scenes`, which differ only in the sensor.

        Raises SceneError for moved lights that these lack, or new lights that exist already.
        """
        return Placement(
            tuple(hung(scenes, self.moves, self.additions)),
            self.moves,
            self.additions,
            self.missed_before,
            self.missed_after,
            self.looks,
            self.level_errors,
        )

    def to_json(self) -> str:
        """Return this record as text."""
        return json.dumps(asdict(self), indent=1, ensure_ascii=False) + "\n"


def record_of(
    placement: Placement, *, looks: Sequence[str] = (), made_of: str = ""
) -> PlacementRecord:
    """Return the record of a placement. looks: the names of looks that share it."""
    return PlacementRecord(
        placement.moves,
        tuple(replace(x, without=None, with_it=None) for x in placement.additions),
        placement.missed_before,
        placement.missed_after,
        tuple(looks),
        placement.level_errors,
        made_of,
    )


def read_placement(path: Path) -> PlacementRecord:
    """Read a record that `to_json` made. Raises SceneError for anything else."""
    text = read_text(path, "file of places", SceneError, limit=MAX_BYTES)
    try:
        data = strict_json(text)
        for light in data["additions"]:
            if light.pop("without", None) or light.pop("with_it", None):
                raise ValueError("it has pictures")
        return read_record(PlacementRecord, data, required=("format",), is_exact=True)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise SceneError(
            f"{path} has no places of lights: {reason}; export it again from the painter, or "
            "leave ",
            Hint("placement"),
            " out",
        ) from None
