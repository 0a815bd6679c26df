"""Pictures of Blender's add-on, from its window, while a script presses what a user presses.

    python docs/images/blender.py [window] [blender_paint_over]

Needs Blender and xvfb-run. `window` is the script of a test, `tests/blender_addon/window.py`.
"""

import json
import sys
import tempfile
import zipfile
from pathlib import Path

from PIL import Image

HERE = Path(__file__).parent
TESTS = HERE.parent.parent / "tests"
sys.path.insert(0, str(TESTS))

from blender_window import run_in_window  # noqa: E402

from lightpaint.cli.commands.program_commands import packed_addon  # noqa: E402

#: Seconds in which all pictures of a walk are there on a busy machine.
PATIENCE_S = 1200.0

#: Scripts of what a user does in the window.
WALKS = (TESTS / "blender_addon/window.py", HERE / "blender_paint_over.py")


def main(walks: list[str]) -> None:
    """Walk through the window, and keep its pictures beside this file."""
    for walk in WALKS:
        if not walks or walk.stem in walks:
            with tempfile.TemporaryDirectory() as name:
                keep_pictures(walk, Path(name))


def keep_pictures(walk: Path, folder: Path) -> None:
    """Let a script walk through the window, in a folder that is its home."""
    program = folder / "venv" / "bin" / "lightpaint"
    program.parent.mkdir(parents=True)
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m lightpaint "$@"\n')
    program.chmod(0o755)
    archive = folder / "lightpaint-blender.zip"
    archive.write_bytes(packed_addon(str(program)))
    zipfile.ZipFile(archive).extractall(folder / "addon")
    variables = {
        "ADDON_FOLDER": str(folder / "addon"),
        "PATH": "/usr/bin:/bin",
        "BROWSER": "true",
        "SHOT_SCRIPT": str(HERE / "blender_still_life.py"),
        "STEPS_FOLDER": str(TESTS / "blender_addon"),
        "HOME": str(folder),
    }
    output = run_in_window(walk, folder, folder, variables=variables, patience_s=PATIENCE_S)
    found = json.loads((folder / "found.json").read_text())
    assert "error" not in found, found.get("error", "") + output
    for picture in sorted(folder.glob("*.png")):
        target = HERE / f"blender-{picture.stem}.jpg"
        Image.open(picture).convert("RGB").save(target, quality=65)
        print(target)


if __name__ == "__main__":
    main(sys.argv[1:])
