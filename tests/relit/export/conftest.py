"""Blender, if it is here."""

import os
import shutil
from collections.abc import Iterator

import pytest


@pytest.fixture(scope="module")
def blender() -> Iterator[list[str]]:
    """How to run Python in Blender: $LIGHTPAINT_BPY, a Python that has its module, or Blender."""
    if python := os.environ.get("LIGHTPAINT_BPY"):
        yield [python]
    elif program := shutil.which("blender"):
        yield [program, "--background", "--factory-startup", "--python-exit-code", "1", "--python"]
    else:
        pytest.skip("Blender (LIGHTPAINT_BPY: a Python with its module bpy)")
