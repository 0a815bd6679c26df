"""pandas tables and labelled xarray arrays; nothing else here needs either library."""

import math
from importlib import import_module
from typing import Any

from lightpaint.errors import LightpaintError

#: Names of the colour channels, linear Rec.709.
CHANNELS = ("red", "green", "blue")


def pandas() -> Any:
    """Return the pandas module. Raises LightpaintError if it is not installed."""
    return _module("pandas")


def xarray() -> Any:
    """Return the xarray module. Raises LightpaintError if it is not installed."""
    return _module("xarray")


def by_channel(name: str, values: Any) -> dict[str, Any]:
    """Return a column for each channel: `{"red": ...}`, or `{"error_red": ...}` for a name."""
    prefix = f"{name}_" if name else ""
    return {f"{prefix}{channel}": values[k] for k, channel in enumerate(CHANNELS)}


def number(value: float | None) -> float:
    """Return a float, NaN for None, so that a column of numbers stays one."""
    return math.nan if value is None else float(value)


def _module(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError as error:
        raise LightpaintError(
            f"this needs {name}, which cannot be imported ({error}): pip install "
            "'lightpaint[tables]'"
        ) from None
