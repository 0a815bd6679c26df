"""The starter manifest of a new batch."""

import json
import os
from collections.abc import Sequence
from pathlib import Path

from lightpaint.errors import BatchError, OutputError
from lightpaint.files import check_files, write_text
from lightpaint.sentences import Hint

HEADER = """\
# Looks to be found in one go:  lightpaint batch {name} -o looks/
# docs/batch.md has all keys. Paths are relative to this file.

[defaults]
scene = {scene}
want = ["solve", "predict", "verify", "report"]  # "render": a final render; "export": for others

[defaults.settings]
quality = "preview"

"""


def write_starter_manifest(
    path: Path, scene: str, paintings: Sequence[str], *, force: bool = False
) -> None:
    """Write a manifest to `path` with a look for each painting of one scene.

    Raises BatchError if there is no painting, or a file does not exist, and OutputError if the
    manifest exists already.
    """
    if not paintings:
        raise BatchError("no painting to begin with: give the scene, then paintings")
    for file in (scene, *paintings):
        if not Path(file).is_file():
            raise BatchError(f"no such file: {file}")
    check_files([path], map(Path, (scene, *paintings)))
    if path.exists() and not force:
        raise OutputError(
            f"{path} is there: choose another name with ",
            Hint("folder"),
            ", or ",
            Hint("force", True),
        )
    base = path.parent
    text = HEADER.format(name=path.name, scene=_quoted(scene, base))
    write_text(
        path, text + "\n".join(f"[[look]]\npainting = {_quoted(x, base)}\n" for x in paintings)
    )


def _quoted(file: str, base: Path) -> str:
    """Return a path relative to `base` as TOML writes it, which is how JSON does."""
    return json.dumps(os.path.relpath(file, base), ensure_ascii=False).replace("\x7f", "\\u007f")
