"""The words of the command line for those of the library: `--resize` for `resize=True`."""

import os
import re
import shlex
from collections.abc import Sequence

#: Arguments of the library that errors and remarks name, and their options.
OPTIONS = {
    "cd_per_unit": "--unit",
    "colors": "--colors",
    "emitters": "--emitters",
    "exact_spp": "--exact-spp",
    "folder": "-o",
    "force": "--force",
    "groups": "--group",
    "hold": "--hold",
    "integrator": "--integrator",
    "layer": "--layer",
    "light_groups": "--lights",
    "lights": "--lights",
    "literal": "--literal",
    "mask": "--mask",
    "new": "--new",
    "noise_correction": "--correct-noise",
    "paint": "--paint",
    "parameters": "-D",
    "pattern": "--pattern",
    "port": "--port",
    "quality": "--quality",
    "refine": "--refine",
    "resize": "--resize",
    "resolution": "--resolution",
    "seed": "--seed",
    "scene": "--scene",
    "sensor": "-s",
    "shared_fs": "--shared-fs",
    "space": "--space",
    "spp": "--spp",
    "stage": "--stage",
    "suggest": "--suggest",
    "task_limit_s": "--task-limit",
    "template": "--template",
    "time_s": "--time",
    "transform": "--view",
    "variant": "-m",
    "verify_spp": "--verify-spp",
}

#: What is spelled otherwise than by an option and a value.
SPELLINGS = {
    "group_alike=False": "--no-group-alike",
    "find=False": "--no-template",
    "noise_correction=False": "--no-correct-noise",
    "use_cache=False": "--no-cache",
    "verify=False": "--no-verify",
}

#: `name=value` as the library writes it: alone among words, so that no path is taken for one.
_SAID = re.compile(
    r"""(?<![^\s(])(\w+)=(\.\.\.|True|False|\d+|'[^']*'|"\w+"|\{'\w+':\ \.\.\.\})"""
    r"""(?=[,;:.)]*(?:\s|$))""",
    re.VERBOSE,
)


def spoken(text: str) -> str:
    """`text` of the library in the words of the command line."""
    return _SAID.sub(_spoken, text)


def _spoken(match: re.Match[str]) -> str:
    said, (name, value) = match[0], match.groups()
    if said in SPELLINGS:
        return SPELLINGS[said]
    if name not in OPTIONS:
        return said
    if key := re.fullmatch(r"\{'(\w+)': \.\.\.\}", value):
        return f"{OPTIONS[name]} {key[1]}=VALUE"
    return OPTIONS[name] if value in ("...", "True") else f"{OPTIONS[name]} {value.strip(chr(34))}"


def from_any_folder(words: Sequence[str] | str) -> str:
    """Return a command, given as words or as a shell has it, that does the same from any folder.

    Paths stand in it as they were given. In a shell of its own it first goes to the folder that
    they are meant from.
    """
    command = words if isinstance(words, str) else shlex.join(words)
    try:
        return f"(cd {shlex.quote(os.getcwd())} && {command})"
    except OSError:  # of a folder that is there no more
        return command
