"""Blender, if it is here."""

import pytest
from blender import blender_command


@pytest.fixture(scope="module")
def blender() -> list[str]:
    """How to run Python in Blender."""
    return blender_command()
