"""Constraints from a lights file, the TOML beside a scene."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from lightpaint.colour import file_of_spectrum
from lightpaint.errors import ConstraintError
from lightpaint.files import one_line
from lightpaint.keywords import keywords
from lightpaint.lighting.constraints.constraint_table import COLOR_KEYS, LIGHT_KEYS, Constraints
from lightpaint.lighting.constraints.values import check_keys, parse_primaries, parse_strength
from lightpaint.luminaires import LUMINAIRE_KEYS, PHOTOMETRY
from lightpaint.scene.lights.lights_file import IMAGE_KEYS, MOVES, SceneRequests, read_keys
from lightpaint.sentences import SourceKey
from lightpaint.validation import is_number

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
            _constraint_tables(requests),
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


#: Keys of a light that are no constraints.
_OTHER_KEYS = (*MOVES, *IMAGE_KEYS, *LUMINAIRE_KEYS)


def _constraint_tables(requests: SceneRequests) -> Any:
    """Return tables of lights without the keys for moves, images and luminaires, which are not
    constraints. A luminaire without emitters has one.
    """
    light = requests.keys.get("light")
    if not isinstance(light, Mapping):
        return light
    tables = {}
    for name, table in light.items():
        where = SourceKey(requests.source, "light", name)
        check_keys(table, (*LIGHT_KEYS, *_OTHER_KEYS), where)
        remaining = {key: value for key, value in table.items() if key not in _OTHER_KEYS}
        remaining = _with_places_of_spectra(remaining, Path(requests.source).parent)
        if PHOTOMETRY in table and "emitters" not in table:
            remaining = _with_own_emitter(remaining, requests.luminaires[name].watts, where)
        elif PHOTOMETRY in table:
            remaining = _with_losses(remaining, requests.luminaires[name].factor)
        if remaining or not table:
            tables[name] = remaining
    return tables


def _with_places_of_spectra(table: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return the table of a light whose files of spectra, which are relative to `folder`, are found
    from anywhere: constraints from elsewhere may be added to it.
    """
    emitters = table.get("emitters")
    if not isinstance(emitters, Sequence) or isinstance(emitters, str):
        return dict(table)
    return {**table, "emitters": [_with_place(x, folder) for x in emitters]}


def _with_place(emitter: Any, folder: Path) -> Any:
    name = emitter.get("spectrum") if isinstance(emitter, Mapping) else None
    if not (isinstance(name, str) and file_of_spectrum(name)):
        return emitter
    return {**emitter, "spectrum": str(folder / name)}


def _with_losses(table: Mapping[str, Any], factor: float) -> dict[str, Any]:
    """Return the table of a luminaire whose emitters in candela or lumens lose what it loses.

    factor: of the luminaire, which its web, and so emitters in Y, have already.
    """
    emitters = table["emitters"]
    if factor == 1 or not isinstance(emitters, Sequence) or isinstance(emitters, str):
        return dict(table)
    return {**table, "emitters": [_dimmed(x, factor) for x in emitters]}


def _dimmed(emitter: Any, factor: float) -> Any:
    if not isinstance(emitter, Mapping):
        return emitter
    amounts = {key: emitter[key] for key in ("cd", "lm") if is_number(emitter.get(key))}
    return {**emitter, **{key: factor * x for key, x in amounts.items()}}


def _with_own_emitter(
    table: Mapping[str, Any], watts: float | None, where: SourceKey
) -> dict[str, Any]:
    """Return the table of a luminaire with its only emitter, of the luminaire's colour.

    watts: of the luminaire at full, if known.
    """
    colors = parse_primaries(table, where) or ((1.0, 1.0, 1.0),)
    if len(colors) > 1:
        raise ConstraintError(
            where,
            f" has {PHOTOMETRY} and {'kelvin' if 'kelvin' in table else 'primaries'}, and without "
            "emitters a luminaire has one colour: list its emitters, or give one colour",
        )
    emitter = {"name": "lamp", "rgb": list(colors[0]), "Y": 1.0}
    emitter |= {} if watts is None else {"watts": watts}
    # The colour is the emitter's now.
    return {
        **{key: x for key, x in table.items() if key not in (*COLOR_KEYS, "duv")},
        "emitters": [emitter],
    }


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
