"""The file by which programs find a running painter: its address and token, for its owner alone."""

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from lightpaint.files import replacing

#: Its name, in the session's folder.
CONNECTION_FILE = "painter.json"


class ConnectionFile:
    """The connection file of one painter, in the folder of its session.

    about: its content, as JSON, with a `token` unique to this painter.
    """

    def __init__(self, folder: Path, about: Mapping[str, Any]) -> None:
        self.path, self._about = folder / CONNECTION_FILE, dict(about)

    def write(self) -> None:
        """Write the file, replacing one that a killed painter has left.

        Raises OutputError if the file cannot be written.
        """
        with replacing(self.path) as temporary:
            # No other user may read it, even under its temporary name, and no link is followed.
            descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            with open(descriptor, "w", encoding="utf-8") as file:
                file.write(json.dumps(self._about) + "\n")

    def remove(self) -> None:
        """Delete the file, unless another painter has replaced it."""
        with suppress(OSError, ValueError, AttributeError):
            record = json.loads(self.path.read_text(encoding="utf-8"))
            if record.get("token") == self._about["token"]:
                self.path.unlink()
