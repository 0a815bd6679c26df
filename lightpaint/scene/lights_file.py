"""The lights file: which lights to adjust and which go together, in a TOML beside the scene.

For `hall.xml` that is `hall.lights.toml`; docs/formats.md has the details. What it asks of the
lights in the solve is not looked at here (see solve/constraints_file.py).
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lightpaint.errors import SceneError

SUFFIX = ".lights.toml"
#: What asks for something in the solve.
CONSTRAINTS = ("light", "tie", "prefer", "sparse")
KNOWN = ("lights", "groups", *CONSTRAINTS)


@dataclass(frozen=True)
class LightsFile:
    """What a lights file asks for, as `choose_lights` takes it. path: None if there is none."""

    path: Path | None = None
    lights: tuple[str, ...] | None = None
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def lights_file_beside(scene: Path) -> Path:
    """Where the lights file of `scene` lies if it has one."""
    return scene.with_name(scene.stem + SUFFIX)


def read_lights_file(path: Path) -> LightsFile:
    """Read a lights file.

    Raises SceneError, with the line where the TOML is wrong, or with the key that is.
    """
    data = read_keys(path)
    groups = data.get("groups", {})
    if not isinstance(groups, dict):
        raise SceneError(f'{path}: groups is a table, [groups], with lines like a = ["b", "c"]')
    return LightsFile(
        path,
        _names(path, "lights", data["lights"]) if "lights" in data else None,
        {name: _names(path, f"groups.{name}", its) for name, its in groups.items()},
    )


def read_keys(path: Path) -> dict[str, Any]:
    """All keys of a lights file, none of them unknown. Raises SceneError."""
    text = ""
    try:
        text = path.read_text(encoding="utf-8")
        data = tomllib.loads(text)
    except FileNotFoundError:
        raise SceneError(f"no such lights file: {path}") from None
    except OSError as error:
        raise SceneError(f"cannot read {path}: {error.strerror or error}") from None
    except UnicodeDecodeError as error:
        raise SceneError(f"{path} is not text in UTF-8: {error.reason}") from None
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        end = f"at line {text.rstrip().count(chr(10)) + 1}, the end"
        reason = str(error).replace("at end of document", end)
        raise SceneError(f"{path} is not TOML: {reason}") from None
    if unknown := [key for key in data if key not in KNOWN]:
        raise SceneError(f"{path}: unknown key {unknown[0]!r}; known are {', '.join(KNOWN)}")
    return data


def _names(path: Path, key: str, value: Any) -> tuple[str, ...]:
    if not (isinstance(value, list) and value and all(isinstance(v, str) and v for v in value)):
        raise SceneError(f'{path}: {key} is a list of at least one name, ["a", "b"], not {value!r}')
    return tuple(value)
