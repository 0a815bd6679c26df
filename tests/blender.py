"""Runs scripts in Blender."""

import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest


def blender_command() -> list[str]:
    """How to run Python in Blender: $LIGHTPAINT_BPY, a Python that has its module, or Blender."""
    if python := os.environ.get("LIGHTPAINT_BPY"):
        return [python]
    if program := shutil.which("blender"):
        return [program, "--background", "--factory-startup", "--python-exit-code", "1", "--python"]
    pytest.skip("Blender (LIGHTPAINT_BPY: a Python with its module bpy)")


def has_working_spaces(blender: list[str]) -> bool:
    """Return True for Blender 5, whose files may have other primaries than Rec.709."""
    command, code = [blender[0], "--version"], "Blender 5"
    if len(blender) == 1:
        code = "5"
        command = [*blender, "-c", "import bpy; print(bpy.app.version_string)"]
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    run = subprocess.run(command, capture_output=True, text=True, env=environment, check=True)
    return any(line.startswith(code) for line in run.stdout.splitlines())


def in_blender(
    blender: list[str], script: Path, *arguments: object, variables: dict[str, str] | None = None
) -> str:
    if len(blender) > 1:
        # Unlike Python, Blender does not look for modules beside its script.
        beside = f"import sys; sys.path.insert(0, {str(script.parent)!r})"
        run = [*blender[:-1], "--python-expr", beside, blender[-1], str(script), "--"]
    else:
        run = [*blender, str(script)]
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    environment |= variables or {}
    run += map(str, arguments)
    completed = subprocess.run(run, capture_output=True, text=True, env=environment, check=False)
    assert completed.returncode == 0, completed.stdout + completed.stderr
    return completed.stdout


def found_in_blender(
    blender: list[str], script: Path, folder: Path, variables: dict[str, str]
) -> Any:
    """Run a script in Blender, and return the contents of the found.json that it writes."""
    in_blender(blender, script, folder, variables=variables)
    return json.loads((folder / "found.json").read_text())
