"""Spelling of the library's arguments as keys of a manifest: `find_template = false` for
`find=False`.
"""

import json

from lightpaint.batch.manifest.keys import DEFAULT_KEYS, SETTINGS
from lightpaint.sentences import Datum, Hint

#: Keys of arguments that a manifest calls by another name.
OTHER_NAMES = {"find": "find_template", "transform": "view"}


def as_key(datum: Datum) -> str | None:
    """Return an argument as a key of a manifest, in TOML; None for what has no key there."""
    if not isinstance(datum, Hint):
        return None
    name = OTHER_NAMES.get(datum.name, datum.name)
    if name not in SETTINGS and name not in DEFAULT_KEYS:
        return None
    is_simple = isinstance(datum.value, bool | int | str)
    if datum.value is not ... and not is_simple:
        return None
    value = json.dumps(datum.value, ensure_ascii=False) if is_simple else "..."
    return f"{'settings.' if name in SETTINGS else ''}{name} = {value}"
