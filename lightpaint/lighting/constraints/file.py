"""Constraints from a lights file, the TOML beside a scene."""

from pathlib import Path

from lightpaint.errors import ConstraintError
from lightpaint.files import one_line
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.scene.lights_file import Asked, read_keys

#: Characters of an error, which names the file, the light and the key before it quotes.
MAX_SAID = 1000


def read_constraints(path: str | Path) -> Constraints:
    """What the lights file at `path` asks of the lights; nothing if it only chooses them.

    Args:
        path: TOML (docs/formats.md).

    Raises:
        SceneError: For a file that is missing or no TOML.
        ConstraintError: For a value that means nothing, naming file, light and key.

    Examples:
        >>> asked = lp.read_constraints("hall.lights.toml")
        >>> lp.solve(basis, target, constraints=asked).lighting.emission["bulb"]
        (0.0, 0.0, 0.0)
    """
    return constraints_of(Asked.of(Path(path), read_keys(Path(path))))


def constraints_of(asked: Asked) -> Constraints:
    """The same of what was read already. Raises ConstraintError."""
    keys = asked.keys
    try:
        return Constraints.of(
            keys.get("light"),
            tie=keys.get("tie", ()),
            prefer_current=keys.get("prefer", 0.0),
            sparse=keys.get("sparse"),
            where=asked.source,
        )
    except ConstraintError as error:
        # What stands in the file may be of any length.
        raise ConstraintError(one_line(str(error), limit=MAX_SAID)) from None
