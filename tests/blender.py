"""Runs scripts in Blender."""

import os
import subprocess
from pathlib import Path


def in_blender(blender: list[str], script: Path, *arguments: object) -> str:
    dashes = ["--"] if len(blender) > 1 else []
    run = [*blender, str(script), *dashes, *map(str, arguments)]
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    done = subprocess.run(run, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout
