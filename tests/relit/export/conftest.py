"""Blender, if it is here."""

import re
import subprocess

import pytest
from blender import blender_command


@pytest.fixture(scope="module")
def blender() -> list[str]:
    """How to run Python in Blender.

    Before 4.2, Cycles chose among lights by chance, so that a picture of a few hundred samples has
    more noise than these tests allow for.
    """
    command = blender_command()
    if len(command) > 1:
        run = subprocess.run([command[0], "--version"], capture_output=True, text=True, check=True)
        version = re.search(r"Blender (\d+)\.(\d+)", run.stdout)
        if version is None or (int(version[1]), int(version[2])) < (4, 2):
            pytest.skip("Blender 4.2 (LIGHTPAINT_BPY: a Python with its module bpy)")
    return command
