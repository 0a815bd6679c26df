"""Pictures of Blender's add-on, from its window, while a script presses what a user presses.

    python docs/images/blender.py

Needs Blender and xvfb-run. The script is that of a test, `tests/blender_addon/window.py`.
"""

import io
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

from lightpaint.cli.commands.blender_command import packed_addon  # noqa: E402


def main() -> None:
    """Walk through the window, and keep its pictures beside this file."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        zipfile.ZipFile(io.BytesIO(packed_addon())).extractall(folder / "addon")
        program = folder / "bin" / "lightpaint"
        program.parent.mkdir()
        program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m lightpaint "$@"\n')
        program.chmod(0o755)
        variables = {
            "ADDON_FOLDER": str(folder / "addon"),
            "PATH": f"{program.parent}:/usr/bin:/bin",
            "BROWSER": "true",
            "SHOT_SCRIPT": str(HERE / "blender_still_life.py"),
            "HOME": name,
        }
        output = run_in_window(
            TESTS / "blender_addon" / "window.py", folder, folder, variables=variables
        )
        found = json.loads((folder / "found.json").read_text())
        assert "error" not in found, found.get("error", "") + output
        for picture in sorted(folder.glob("*.png")):
            target = HERE / f"blender-{picture.stem}.jpg"
            Image.open(picture).convert("RGB").save(target, quality=65)
            print(target)


if __name__ == "__main__":
    main()
