"""axe-core, which finds what keeps people from using a page."""

import os
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest


def axe_source() -> str:
    """The source of axe-core: LIGHTPAINT_AXE, or where npm has it."""
    places = [Path("node_modules")]
    if npm := shutil.which("npm"):
        completed = subprocess.run([npm, "root", "-g"], capture_output=True, text=True, check=False)
        places.append(Path(completed.stdout.strip()))
    candidates = [Path(os.environ.get("LIGHTPAINT_AXE", "/nowhere"))]
    candidates += [place / "axe-core" / "axe.min.js" for place in places]
    for path in candidates:
        if path.is_file():
            return path.read_text(encoding="utf8")
    pytest.skip("axe-core")


def violations(page: Any, selector: str = "html", rules: list[str] | None = None) -> list[Any]:
    """Return what axe-core, which `page` has loaded, finds wrong below a selector.

    rules: their ids; all without.

    Of each rule that is broken its id, and the tags that break it. Only these leave the page: a
    list of all that is right takes seconds.
    """
    page_violations: list[Any] = page.evaluate(
        """async ([where, rules]) => {
          const { violations } = await axe.run(where, rules ? { runOnly: rules } : {});
          return violations.map(({ id, nodes }) => [id, nodes.map(({ html }) => html)]);
        }""",
        [selector, rules],
    )
    return page_violations
