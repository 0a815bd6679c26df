"""A batch as a farm job: an Open Job Description template, which `openjd run` takes as it is.

Its tasks are lightpaint commands that share the folder of the batch, and the cache: the first look
of each basis renders it, the others find it there.
"""

import json
import os
from collections.abc import Sequence
from glob import escape
from pathlib import Path
from typing import Any

from lightpaint.batch.plan.plan import Plan, PlannedLook
from lightpaint.errors import BatchError
from lightpaint.files import check_writable, write_text

#: Name of the template in the folder of the job.
TEMPLATE = "template.json"

#: Values of one parameter of a step, and characters of a value, at most.
MAX_VALUES, MAX_VALUE_LENGTH = 1024, 1024


#: Parameter in the command of a task that stands for the pattern of its looks.
LOOK_PARAMETER = "{{Task.Param.Look}}"


def write_openjd(folder: Path, plan: Plan, *, command: Sequence[str], force: bool = False) -> Path:
    """Write the template of `plan` to `folder`, and return its path.

    command: words of the command that does the looks of one task, LOOK_PARAMETER among them.
    """
    check_writable(folder)
    path = folder / TEMPLATE
    if path.exists() and not force:
        raise BatchError(f"{path} is there: name another folder, or pass force=True")
    text = json.dumps(template_of(plan, folder, command), indent=2, ensure_ascii=False)
    write_text(path, text + "\n")
    return path


def template_of(plan: Plan, folder: Path, command: Sequence[str]) -> dict[str, Any]:
    """Return the template, as plain values.

    folder: of the template. Files in it are named relative to it, so that farms may send them with
    the job; others by absolute paths, which all machines have to share. command: as of
    `write_openjd`.
    """

    base = folder.resolve()

    def path(default: Path, kind: str, flow: str, about: str) -> dict[str, Any]:
        file = default.resolve()
        if base not in (file, *file.parents):
            # A path that leaves the folder of the job may not be its default.
            return {"type": "STRING", "default": str(file), "description": about}
        inside = os.path.relpath(file, base)
        how = {"type": "PATH", "objectType": kind, "dataFlow": flow, "default": inside}
        return {**how, "description": about}

    manifest = path(plan.manifest, "FILE", "IN", "The looks.")
    output = path(plan.folder, "DIRECTORY", "OUT", "Receives a folder for each look.")
    cache = path(plan.folder / ".cache", "DIRECTORY", "INOUT", "Bases, for all tasks.")
    program = {"type": "STRING", "default": "lightpaint", "description": "The command."}
    return {
        "specificationVersion": "jobtemplate-2023-09",
        "name": _plain(plan.manifest.stem)[:128] or "looks",
        "parameterDefinitions": [
            {"name": "Manifest", **manifest},
            {"name": "Output", **output},
            {"name": "Cache", **cache},
            {"name": "Lightpaint", **program},
        ],
        "jobEnvironments": [
            {"name": "Cache", "variables": {"LIGHTPAINT_CACHE": "{{Param.Cache}}"}}
        ],
        "steps": _steps(plan, command),
    }


def _steps(plan: Plan, command: Sequence[str]) -> list[dict[str, Any]]:
    """Return the job's steps, each of tasks that do not wait for each other."""
    steps: list[dict[str, Any]] = []
    for name, looks in _waves(plan.chosen_looks):
        for k in range(0, len(looks), MAX_VALUES):
            part = f" {k // MAX_VALUES + 1}" if len(looks) > MAX_VALUES else ""
            range_ = [_pattern(look) for look in looks[k : k + MAX_VALUES]]
            look = {"name": "Look", "type": "STRING", "range": range_}
            space = {"taskParameterDefinitions": [look]}
            steps.append(_step(name + part, command, steps, parameterSpace=space))
    # What is left, if a task was lost, and the gallery.
    steps.append(_step("Gallery", (), steps))
    return steps


def _step(
    name: str, how: Sequence[str], before: Sequence[dict[str, Any]], **others: Any
) -> dict[str, Any]:
    args = ["batch", "{{Param.Manifest}}", "-o", "{{Param.Output}}", *how]
    command = {"command": "{{Param.Lightpaint}}", "args": args}
    waits = [{"dependsOn": step["name"]} for step in before]
    return {
        "name": name,
        **({"dependencies": waits} if waits else {}),
        **others,
        "script": {"actions": {"onRun": command}},
    }


def _waves(looks: Sequence[PlannedLook]) -> list[tuple[str, list[PlannedLook]]]:
    """Group looks: the first of each basis; those that share them; those combined from others."""
    first: list[PlannedLook] = []
    rest: list[PlannedLook] = []
    made: list[PlannedLook] = []
    seen: set[str] = set()
    for look in looks:
        keys = set(look.steps[0].task.bases)
        if look.entry.of:
            made.append(look)
        elif keys <= seen:
            rest.append(look)
        else:
            first.append(look)
            seen |= keys
    waves = [("Bases", first), ("Looks", rest)]
    while made:
        names = {look.entry.name for look in made}
        ready = [look for look in made if not names & set(look.entry.of)]
        waves.append((f"Made {len(waves) - 1}", ready))
        made = [look for look in made if look not in ready]
    return [(name, wave) for name, wave in waves if wave]


def _pattern(look: PlannedLook) -> str:
    """Return a pattern that only this look's name matches. Raises BatchError if there is none."""
    name = look.entry.name
    if "{{" in name or len(escape(name)) > MAX_VALUE_LENGTH:
        raise BatchError(f"look {name!r} cannot be named in a job: say name = ...")
    return escape(name)


def _plain(text: str) -> str:
    """Return text without what a format string would take for an expression."""
    return text.replace("{{", "").replace("}}", "")
