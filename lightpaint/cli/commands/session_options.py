"""The requests of a painting session, as options of the command line."""

from collections.abc import Mapping, Sequence
from shlex import quote
from typing import Any

from lightpaint.paint.store.session_requests import SessionRequests


def solve_command(
    source: str, paintings: Mapping[str, str], options: Sequence[str], requests: SessionRequests
) -> str:
    """Return the command that gives the same answer to exported paintings as their session.

    paintings: paths by sensor, "" for that of the only view. source, options: those of the painter.
    """
    words = ["lightpaint solve", quote(source)]
    for sensor, path in paintings.items():
        words.append(f"--target {quote(f'{sensor}={path}')}" if sensor else quote(path))
    return " ".join([*words, *options, *options_of(requests)])


def options_of(requests: SessionRequests) -> list[str]:
    """Return requests as options of `lightpaint solve`."""
    options = []
    for name, constraint in requests.lights.items():
        options += [option for key in constraint for option in _options(name, key, constraint)]
    for names in requests.ties:
        options.append(f"--tie {quote(','.join(names))}")
    for key, value in requests.values.items():
        option = f"--{key.replace('_', '-')}"
        options.append(option if value is True else f"{option} {value}")
    return options


def _options(name: str, key: str, constraint: Mapping[str, Any]) -> list[str]:
    """Return one request for a light as options; duv goes with its kelvin."""
    value = constraint[key]
    if key in ("off", "lock") and value is True:
        return [f"--{key} {quote(name)}"]
    if key == "limits":
        ends = ":".join(
            "" if end not in value else _value_text(value[end]) for end in ("min", "max")
        )
        return [f"--limit {quote(f'{name}={ends}')}"]
    if key == "kelvin":
        duv = f",duv={constraint['duv']:g}" if "duv" in constraint else ""
        kelvin = (
            ":".join(map(_value_text, value))
            if isinstance(value, list | tuple)
            else _value_text(value)
        )
        return [f"--kelvin {quote(f'{name}={kelvin}{duv}')}"]
    if key == "duv":
        return []
    return [f"--{key} {quote(f'{name}={_value_text(value)}')}"]


def _value_text(value: Any) -> str:
    """Return a value of a lights file as an option has it, with all digits."""
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ",".join(map(_value_text, value))
    return repr(float(value)) if isinstance(value, int | float) else str(value)
