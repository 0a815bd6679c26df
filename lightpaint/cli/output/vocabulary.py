"""Translation of the library's arguments to options: `--resize` for `resize=True`."""

import os
import shlex
from collections.abc import Mapping, Sequence

from lightpaint.batch import RunOptions
from lightpaint.pipeline import Settings
from lightpaint.sentences import Datum, Hint, Lead, Sentence, SourceKey, Word
from lightpaint.validation import options_of

#: The records whose fields have options.
RECORDS = (Settings, RunOptions)

#: Options of arguments that are not fields of these.
_OTHER_OPTIONS = {
    "folder": "-o",
    "frames": "--frames",
    "gdtf_folder": "--gdtf",
    "usual_colors": "--usual-colors",
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
    "rig": "--rig",
    "scene": "--scene",
    "sensor": "-s",
    "split": "--split",
    "stage": "--stage",
    "start": "--start",
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


def spoken(text: str) -> str:
    """Return `text` of the library with the options of the command line."""
    return text.spelled(_spell) if isinstance(text, Sentence) else text


def spoken_of_manifest(text: str) -> str:
    """Return `text` of the library with the keys of a manifest, and options for what has none."""
    if not isinstance(text, Sentence):
        return text
    from lightpaint.batch import as_key  # late: keys of a manifest need NumPy, and --help does not

    return text.spelled(lambda datum: as_key(datum) or _spell(datum))


def _spell(datum: Datum) -> str | None:
    if isinstance(datum, Hint):
        return _option(datum)
    if isinstance(datum, SourceKey) and datum.source == BY_OPTION:
        return _option_of_key(datum) or datum.path
    if isinstance(datum, Lead) and datum.key.source == BY_OPTION:
        option = _option_of_key(datum.key)
        if option is None:
            return "" if datum.key.keys[0] == "light" else f"{datum.key.path}: "
        return f"{option.removesuffix(' on').removesuffix(':')}: "
    return None


def _option(hint: Hint) -> str | None:
    """Return the option of an argument, with its value; None if it has none."""
    if str(hint) in SPELLINGS:
        return SPELLINGS[str(hint)]
    option = OPTIONS.get(hint.name)
    if option is None or hint.value is ... or hint.value is True:
        return option
    if isinstance(hint.value, Mapping):
        [(key, value)] = hint.value.items()
        return f"{option} {key}={'VALUE' if value is ... else value}"
    return f"{option} {hint.value if isinstance(hint.value, Word) else repr(hint.value)}"


def _option_of_key(key: SourceKey) -> str | None:
    """Return `--limit NAME`, or `--add 2: count` for a new light; None for other keys."""
    match key.keys:
        case ("light", name, setting, *_):
            return f"--{OPTIONS_OF_KEYS.get(str(setting), setting)} {name}"
        case ("new", int(number), *setting) if len(setting) < 2:
            return " ".join((f"--add {number}:", *map(str, setting)))
        case ("new", *setting) if len(setting) < 2:
            return " ".join(("--add:", *map(str, setting)))
    return None


def from_any_folder(words: Sequence[str] | str) -> str:
    """Return a command, as words or as a shell line, that does the same from any folder.

    Its paths stay as given; a subshell first changes to the folder that they are relative to.
    """
    command = words if isinstance(words, str) else shlex.join(words)
    try:
        return f"(cd {shlex.quote(os.getcwd())} && {command})"
    except OSError:  # the working folder was deleted
        return command
