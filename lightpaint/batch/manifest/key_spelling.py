"""Spelling of the library's arguments as keys of a manifest: `find_template = false` for
`find=False`.
"""

import json
import re

from lightpaint.batch.manifest.keys import DEFAULT_KEYS, SETTINGS

#: Keys of arguments that a manifest calls by another name.
OTHER_NAMES = {"find": "find_template", "transform": "view"}

#: Values of TOML for values of Python.
VALUES = {"True": "true", "False": "false"}

#: `name=value` as the library writes it: a separate word, so that no path matches.
_ARGUMENT = re.compile(
    r"""(?<![^\s(])(\w+)=(\.\.\.|True|False|\d+|'[^']*'|"\w+")(?=[,;:.)]*(?:\s|$))"""
)


def with_manifest_keys(text: str) -> str:
    """Return an error of the library with the keys of a manifest for arguments that have one."""
    return _ARGUMENT.sub(_as_key, text)


def _as_key(match: re.Match[str]) -> str:
    name, value = match.groups()
    name = OTHER_NAMES.get(name, name)
    if name in SETTINGS:
        name = f"settings.{name}"
    elif name not in DEFAULT_KEYS:
        return match[0]
    value = json.dumps(value[1:-1], ensure_ascii=False) if value[0] == "'" else value
    return f"{name} = {VALUES.get(value, value)}"
