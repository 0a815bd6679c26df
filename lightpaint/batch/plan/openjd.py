"""A batch as a farm job: an Open Job Description template for `openjd run`.

Its tasks are lightpaint commands that share the folder of the batch and the cache. The first look
of each basis renders it, and the others find it in the cache.
"""

import json
import os
from collections.abc import Sequence
from glob import escape
from pathlib import Path
from typing import Any

from lightpaint.batch.plan.plan_steps import Plan, PlannedLook
from lightpaint.errors import BatchError
from lightpaint.files import check_writable, write_text
from lightpaint.sentences import Hint

#: Name of the template in the folder of the job.
TEMPLATE = "template.json"

#: Maximum number of values of one parameter of a step, and most characters of a value.
MAX_VALUES, MAX_VALUE_LENGTH = 1024, 1024


#: Placeholder in the command of a task for the pattern of its looks.
LOOK_PARAMETER = "{{Task.Param.Look}}"


def write_openjd(folder: Path, plan: Plan, *, command: Sequence[str], force: bool = False) -> Path:
    """Write the template of `plan` to `folder`, and return its path.

    command: words of the command that runs the looks of one task, including LOOK_PARAMETER.
    """
    check_writable(folder)
    path = folder / TEMPLATE
    if path.exists() and not force:
        raise BatchError(f"{path} is there: name another folder, or pass ", Hint("force", True))
    text = json.dumps(template_of(plan, folder, command), indent=2, ensure_ascii=False)
    write_text(path, text + "\n")
    return path


def template_of(plan: Plan, folder: Path, command: Sequence[str]) -> dict[str, Any]:
    """Return the template, as plain values.

    folder: of the template. Paths of files in it are relative, so that farms may send the files
    with the job; other paths are absolute, and all machines have to share them. command: see
    `write_openjd`.
    """

    base = folder.resolve()

    def path(default: Path, kind: str, flow: str, description: str) -> dict[str, Any]:
        file = default.resolve()
        if base not in (file, *file.parents):
            # The default of a PATH parameter may not lie outside the folder of the job.
            return {"type": "STRING", "default": str(file), "description": description}
        relative_path = os.path.relpath(file, base)
        definition = {
            "type": "PATH",
            "objectType": kind,
            "dataFlow": flow,
            "default": relative_path,
        }
        return {**definition, "description": description}

    manifest = path(plan.manifest, "FILE", "IN", "The looks.")
    output = path(plan.folder, "DIRECTORY", "OUT", "Receives a folder for each look.")
    cache = path(plan.folder / ".cache", "DIRECTORY", "INOUT", "Bases, for all tasks.")
    program = {"type": "STRING", "default": "lightpaint", "description": "The command."}
    return {
        "specificationVersion": "jobtemplate-2023-09",
        "name": _without_braces(plan.manifest.stem)[:128] or "looks",
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
    """Return the job's steps; the tasks of one step do not depend on each other."""
    steps: list[dict[str, Any]] = []
    for name, looks in _waves(plan.chosen_looks):
        for k in range(0, len(looks), MAX_VALUES):
            part = f" {k // MAX_VALUES + 1}" if len(looks) > MAX_VALUES else ""
            range_ = [_pattern(look) for look in looks[k : k + MAX_VALUES]]
            look = {"name": "Look", "type": "STRING", "range": range_}
            space = {"taskParameterDefinitions": [look]}
            steps.append(_step(name + part, command, steps, parameterSpace=space))
    # The last step redoes lost tasks, and writes the gallery.
    steps.append(_step("Gallery", (), steps))
    return steps


def _step(
    name: str, arguments: Sequence[str], earlier_steps: Sequence[dict[str, Any]], **fields: Any
) -> dict[str, Any]:
    args = ["batch", "{{Param.Manifest}}", "-o", "{{Param.Output}}", *arguments]
    command = {"command": "{{Param.Lightpaint}}", "args": args}
    dependencies = [{"dependsOn": step["name"]} for step in earlier_steps]
    return {
        "name": name,
        **({"dependencies": dependencies} if dependencies else {}),
        **fields,
        "script": {"actions": {"onRun": command}},
    }


def _waves(looks: Sequence[PlannedLook]) -> list[tuple[str, list[PlannedLook]]]:
    """Group looks: the first of each basis, those that share one, then those made of others."""
    first_looks: list[PlannedLook] = []
    sharing_looks: list[PlannedLook] = []
    combined_looks: list[PlannedLook] = []
    seen_keys: set[str] = set()
    for look in looks:
        keys = set(look.steps[0].task.bases)
        if look.entry.combined_looks:
            combined_looks.append(look)
        elif keys <= seen_keys:
            sharing_looks.append(look)
        else:
            first_looks.append(look)
            seen_keys |= keys
    waves = [("Bases", first_looks), ("Looks", sharing_looks)]
    while combined_looks:
        names = {look.entry.name for look in combined_looks}
        ready_looks = [
            look for look in combined_looks if not names & set(look.entry.combined_looks)
        ]
        waves.append((f"Made {len(waves) - 1}", ready_looks))
        combined_looks = [look for look in combined_looks if look not in ready_looks]
    return [(name, wave) for name, wave in waves if wave]


def _pattern(look: PlannedLook) -> str:
    """Return a pattern that only this look's name matches. Raises BatchError if there is none."""
    name = look.entry.name
    if "{{" in name or len(escape(name)) > MAX_VALUE_LENGTH:
        raise BatchError(f"look {name!r} cannot be named in a job: set name = ...")
    return escape(name)


def _without_braces(text: str) -> str:
    """Return text without the braces that mark expressions in a format string."""
    return text.replace("{{", "").replace("}}", "")
