"""Runs scripts in Blender."""

import os
import subprocess
from pathlib import Path


def in_blender(blender: list[str], script: Path, *arguments: object) -> str:
    dashes = ["--"] if len(blender) > 1 else []
    run = [*blender, str(script), *dashes, *map(str, arguments)]
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    completed = subprocess.run(run, capture_output=True, text=True, env=environment, check=False)
    assert completed.returncode == 0, completed.stdout + completed.stderr
    return completed.stdout
