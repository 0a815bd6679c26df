"""`lightpaint blender`: packs the add-on for Blender, a folder of its own that nothing imports."""

import io
import shutil
import sysconfig
import zipfile
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path

from lightpaint.cli.output import documents, terminal
from lightpaint.cli.output.output_mode import CommandOutcome
from lightpaint.errors import OutputError
from lightpaint.files import check_files, check_writable, write_bytes
from lightpaint.sentences import Hint

#: Folder in the archive: the add-on's name in Blender before 4.2. The library is called otherwise.
ADDON_NAME = "lightpaint_blender"

#: File in that folder with the path of the program: Blender seldom has the PATH of a terminal.
PROGRAM_FILE = "PROGRAM"

#: Time of every file in the archive, so that equal sources make equal archives.
ARCHIVE_TIME = (1980, 1, 1, 0, 0, 0)

#: Steps that install it, printed after it is written.
INSTALL_STEPS = (
    "In Blender 4.2 or newer: Edit > Preferences > Get Extensions > Install from Disk",
    "In Blender 3.4 to 4.1: Edit > Preferences > Add-ons > Install, then tick lightpaint",
    "Then press N in the 3D view, and choose the tab lightpaint",
)


def blender(*, output: Path, force: bool) -> CommandOutcome:
    """Run `lightpaint blender -o F.zip`."""
    check_files([output], [])
    check_writable(output.parent)
    data = packed_addon(own_program())
    if output.exists() and not force and not is_addon(output):
        raise OutputError(
            f"{output} exists and is not an add-on of lightpaint: name another file (",
            Hint("output"),
            "), or pass ",
            Hint("force", True),
        )
    write_bytes(output, data)
    terminal.write(str(output))
    for step in INSTALL_STEPS:
        terminal.write(step)
    return CommandOutcome(lambda: documents.files_document(output.parent, [output]))


def own_program() -> str:
    """Return the path of lightpaint as a program, this installation's if it has one; "" if none."""
    scripts = sysconfig.get_path("scripts")
    return shutil.which("lightpaint", path=scripts) or shutil.which("lightpaint") or ""


def packed_addon(program: str = "") -> bytes:
    """Return the archive of the add-on, an extension that older versions install as an add-on.

    program: path that the add-on starts; "" for that on the PATH.
    """
    sources = _sources(files("lightpaint") / "blender_addon", ADDON_NAME)
    if program:
        sources.append((f"{ADDON_NAME}/{PROGRAM_FILE}", f"{program}\n".encode()))
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in sorted(sources):
            archive.writestr(zipfile.ZipInfo(name, ARCHIVE_TIME), data, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def is_addon(path: Path) -> bool:
    """Return whether a file is an add-on that this command has written."""
    try:
        with zipfile.ZipFile(path) as archive:
            return f"{ADDON_NAME}/blender_manifest.toml" in archive.namelist()
    except (OSError, zipfile.BadZipFile):
        return False


def _sources(folder: Traversable, name: str) -> list[tuple[str, bytes]]:
    """Return the files of a folder and of those within, by their names in the archive."""
    found = []
    for item in folder.iterdir():
        if item.is_dir() and item.name != "__pycache__":
            found += _sources(item, f"{name}/{item.name}")
        elif item.name.endswith((".py", ".toml")) or item.name == "LICENSE":
            found.append((f"{name}/{item.name}", item.read_bytes()))
    return found
