"""Blender, if it is here."""

import re
import subprocess

import pytest
from blender import blender_command


@pytest.fixture(scope="module")
def blender() -> list[str]:
    """How to run Python in Blender."""
    return blender_command()


@pytest.fixture(scope="module")
def new_blender(blender: list[str]) -> list[str]:
    """The same, of a version that shows lights as the exports mean them.

    3.4.1 makes area lamps π/4 as bright, and slides a tenth darker; its new materials have an
    emission that counts.
    """
    if len(blender) > 1:
        run = subprocess.run([blender[0], "--version"], capture_output=True, text=True, check=True)
        version = re.search(r"Blender (\d+)\.(\d+)", run.stdout)
        if version is None or (int(version[1]), int(version[2])) < (4, 2):
            pytest.skip("Blender 4.2 (LIGHTPAINT_BPY: a Python with its module bpy)")
    return blender
