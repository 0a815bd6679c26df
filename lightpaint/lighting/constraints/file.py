"""Constraints from a lights file, the TOML beside a scene."""

from pathlib import Path

from lightpaint.errors import ConstraintError
from lightpaint.files import one_line
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.scene.lights_file import CONSTRAINTS, read_keys

#: Characters of an error, which names the file, the light and the key before it quotes.
MAX_SAID = 1000


def read_constraints(path: str | Path) -> Constraints:
    """What the lights file at `path` asks of the lights; nothing if it only chooses them.

    Raises SceneError for a file that is missing or no TOML, ConstraintError for a value that
    means nothing, naming file, light and key.
    """
    data = {key: value for key, value in read_keys(Path(path)).items() if key in CONSTRAINTS}
    try:
        return Constraints.of(
            data.get("light"),
            tie=data.get("tie", ()),
            prefer_current=data.get("prefer", 0.0),
            sparse=data.get("sparse"),
            where=str(path),
        )
    except ConstraintError as error:
        # What stands in the file may be of any length.
        raise ConstraintError(one_line(str(error), limit=MAX_SAID)) from None
