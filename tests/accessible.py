"""axe-core, which finds what keeps people from using a page."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest


def axe_source() -> str:
    """The source of axe-core: LIGHTPAINT_AXE, or where npm has it."""
    places = [Path("node_modules")]
    if npm := shutil.which("npm"):
        found = subprocess.run([npm, "root", "-g"], capture_output=True, text=True, check=False)
        places.append(Path(found.stdout.strip()))
    candidates = [Path(os.environ.get("LIGHTPAINT_AXE", "/nowhere"))]
    candidates += [place / "axe-core" / "axe.min.js" for place in places]
    for path in candidates:
        if path.is_file():
            return path.read_text(encoding="utf8")
    pytest.skip("axe-core")
