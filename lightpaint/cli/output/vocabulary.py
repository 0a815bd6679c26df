"""Translation of the library's arguments to options: `--resize` for `resize=True`."""

import os
import re
import shlex
from collections.abc import Sequence

from lightpaint.batch.run_options import RunOptions
from lightpaint.field_options import options_of
from lightpaint.pipeline.job.settings import Settings

#: The records whose fields have options.
RECORDS = (Settings, RunOptions)

#: Options of arguments that are not fields of these.
_OTHER_OPTIONS = {
    "folder": "-o",
    "frames": "--frames",
    "groups": "--group",
    "integrator": "--integrator",
    "layer": "--layer",
    "light_groups": "--lights",
    "lights": "--lights",
    "map_size": "--map-size",
    "mask": "--mask",
    "new": "--new",
    "paint": "--paint",
    "parameters": "-D",
    "pattern": "--pattern",
    "placement": "--places",
    "port": "--port",
    "scene": "--scene",
    "sensor": "-s",
    "split": "--split",
    "stage": "--stage",
    "symmetric": "--symmetric",
    "template": "--template",
    "transform": "--view",
    "variant": "-m",
}
_OTHER_SPELLINGS = {"group_alike=False": "--no-group-alike", "find=False": "--no-template"}

_DECLARED = [x for record in RECORDS for x in options_of(record).values()]

#: Options for the arguments that errors and remarks of the library name.
OPTIONS = _OTHER_OPTIONS | {x.field: x.option.name for x in _DECLARED if x.default is not True}

#: Arguments with a value that have an option of their own.
SPELLINGS = _OTHER_SPELLINGS | {
    f"{x.field}=False": x.name_of_false for x in _DECLARED if x.name_of_false
}

#: The name of the options as the source of constraints and places; the options of their keys that
#: are not called like these.
BY_OPTION = "on the command line"
OPTIONS_OF_KEYS = {"limits": "limit", "duv": "kelvin"}

#: Beginnings of errors: in a light's constraint or place by option, for an unknown light, and for a
#: new light.
_LIGHT = re.compile(
    BY_OPTION + r": light\.(.+?)\.(lock|off|limits|color|kelvin|duv|primaries|move|aim|cone|beam)"
    r"(?:\.\w+)?(?=:? )"
)
_UNKNOWN = re.compile(BY_OPTION + r": light\.[^:]+: (?=no light )")
_NEW = re.compile(BY_OPTION + r": new( \d+)?(?:\.(?:on(?=: )|(\w+)))?(:?) ")

#: `name=value` as the library writes it: a separate word, so that no path matches.
_ARGUMENT = re.compile(
    r"""(?<![^\s(])(\w+)=(\.\.\.|True|False|\d+|'[^']*'|"\w+"|\{'\w+':\ (?:\.\.\.|'[^']*')\})"""
    r"""(?=[,;:.)]*(?:\s|$))""",
    re.VERBOSE,
)


def spoken(text: str) -> str:
    """Return `text` of the library with the options of the command line."""
    text = _LIGHT.sub(lambda match: f"--{OPTIONS_OF_KEYS.get(match[2], match[2])} {match[1]}", text)
    text = _NEW.sub(_spoken_new, _UNKNOWN.sub("", text)).replace(f"{BY_OPTION}: ", "")
    return _ARGUMENT.sub(_spoken, text)


def _spoken_new(match: re.Match[str]) -> str:
    """Return how an error of a new light begins: `--add 2: count is`."""
    number, key, colon = match.groups()
    return f"--add{number or ''}: {key}{colon} " if key else f"--add{number or ''}: "


def _spoken(match: re.Match[str]) -> str:
    argument, (name, value) = match[0], match.groups()
    if argument in SPELLINGS:
        return SPELLINGS[argument]
    if name not in OPTIONS:
        return argument
    if key := re.fullmatch(r"\{'(\w+)': (?:\.\.\.|'(.*)')\}", value):
        return f"{OPTIONS[name]} {key[1]}={key[2] or 'VALUE'}"
    return OPTIONS[name] if value in ("...", "True") else f"{OPTIONS[name]} {value.strip(chr(34))}"


def from_any_folder(words: Sequence[str] | str) -> str:
    """Return a command, as words or as a shell line, that does the same from any folder.

    Its paths stay as given; a subshell first changes to the folder that they are relative to.
    """
    command = words if isinstance(words, str) else shlex.join(words)
    try:
        return f"(cd {shlex.quote(os.getcwd())} && {command})"
    except OSError:  # the working folder was deleted
        return command
