"""Blender, the add-on as `lightpaint blender` writes it, and lightpaint as a program."""

import io
import os
import sys
import zipfile
from pathlib import Path

import pytest
from blender import blender_command
from renderer import REPOSITORY

from lightpaint.cli.commands.program_commands import packed_addon


@pytest.fixture(scope="module")
def blender() -> list[str]:
    """How to run Python in Blender."""
    return blender_command()


@pytest.fixture(scope="session")
def addon_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the unpacked add-on, to import it from."""
    folder = tmp_path_factory.mktemp("addon")
    zipfile.ZipFile(io.BytesIO(packed_addon())).extractall(folder)
    return folder


@pytest.fixture
def variables(tmp_path: Path, addon_folder: Path) -> dict[str, str]:
    """The environment of a Blender that finds the add-on and the program, and no browser."""
    program = tmp_path / "bin" / "lightpaint"
    program.parent.mkdir()
    program.write_text(
        f'#!/bin/sh\nPYTHONPATH="{REPOSITORY}" exec "{sys.executable}" -m lightpaint "$@"\n'
    )
    program.chmod(0o755)
    return {
        "ADDON_FOLDER": str(addon_folder),
        "PATH": f"{program.parent}{os.pathsep}/usr/bin{os.pathsep}/bin",
        "BROWSER": "true",
        "HOME": str(tmp_path),
        "LIGHTPAINT_CACHE": str(tmp_path / "cache"),
    }
