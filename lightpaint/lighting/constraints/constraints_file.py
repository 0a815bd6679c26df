"""Constraints from a lights file, the TOML beside a scene."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from lightpaint.errors import ConstraintError
from lightpaint.files import one_line
from lightpaint.keywords import keywords
from lightpaint.lighting.constraints.constraints import LIGHT_KEYS, Constraints
from lightpaint.lighting.constraints.values import check_keys, parse_strength
from lightpaint.scene.lights.lights_file import IMAGE_KEYS, MOVES, SceneRequests, read_keys
from lightpaint.sentences import SourceKey

#: Characters of an error, which names the file, the light and the key before it quotes.
MAX_MESSAGE_LENGTH = 1000


@keywords()
def read_constraints(path: str | Path) -> Constraints:
    """Read the constraints of the lights file at `path`; none if it only chooses lights.

    Args:
        path: TOML (docs/formats.md).

    Raises:
        SceneError: For a file that is missing or no TOML.
        ConstraintError: For a value that means nothing, naming file, light and key.

    Examples:
        >>> constraints = lp.read_constraints("hall.lights.toml")
        >>> lp.solve(basis, target, constraints=constraints).lighting.emission["bulb"]
        (0.0, 0.0, 0.0)
    """
    return constraints_of(SceneRequests.of(Path(path), read_keys(Path(path))))


def constraints_of(requests: SceneRequests) -> Constraints:
    """Return the constraints in the keys of a lights file. Raises ConstraintError."""
    keys = requests.keys
    try:
        strength = _pull_strength(keys, requests.source)
        return Constraints.of(
            _without_moves(keys.get("light"), requests.source),
            tie=keys.get("tie", ()),
            prefer_current=strength,
            sparse=keys.get("sparse"),
            start=keys.get("start", {}),
            near=keys.get("near", 0.0),
            cd_per_unit=keys.get("cd_per_unit"),
            prefer_emitters=keys.get("prefer_emitters"),
            where=requests.source,
        )
    except ConstraintError as error:
        # A value in the file may be of any length.
        raise ConstraintError(one_line(error.sentence, limit=MAX_MESSAGE_LENGTH)) from None


def _without_moves(light: Any, source: str) -> Any:
    """Return tables of lights without the keys for moves and images, which are not constraints."""
    if not isinstance(light, Mapping):
        return light
    tables = {}
    for name, table in light.items():
        check_keys(table, (*LIGHT_KEYS, *MOVES, *IMAGE_KEYS), SourceKey(source, "light", name))
        remaining = {key: value for key, value in table.items() if key not in (*MOVES, *IMAGE_KEYS)}
        if remaining or not table:
            tables[name] = remaining
    return tables


def _pull_strength(keys: Mapping[str, Any], source: str) -> Any:
    """Return the strength of the pull to the current lighting, also from its older keys.

    Files had `prefer = { current = 0.01 }` or `prefer = 0.01` before `prefer_current`.
    """
    if "prefer" not in keys:
        return keys.get("prefer_current", 0.0)
    if "prefer_current" in keys:
        raise ConstraintError(
            f"{source}: both prefer_current and prefer, which is its older name: leave prefer out"
        )
    strength, place = keys["prefer"], SourceKey(source, "prefer")
    if isinstance(strength, Mapping):
        check_keys(strength, ("current",), place)
        strength, place = strength.get("current", 0.0), place / "current"
    return parse_strength(strength, place)
