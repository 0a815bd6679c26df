# SPDX-License-Identifier: GPL-3.0-or-later
"""The files of a shot: its render with light groups, and what it was rendered from.

FOLDER/shot.exr      the render, a multilayer EXR
FOLDER/shot.json     a digest of the scene that it shows, and its groups
FOLDER/painting/     the painter's session and exports
FOLDER/looks.json    looks of the painter, for when it does not run
"""

import json
import os
from pathlib import Path

from ..lamps.lamp_units import checked_factor

#: Maximum size of a file with JSON in bytes.
MAX_JSON_FILE = 2**26


def read_json(path):
    """Return what a file with JSON has. Raises OSError or ValueError."""
    if not os.path.isfile(path) or os.path.getsize(path) > MAX_JSON_FILE:
        raise ValueError(f"{path} is not a file that lightpaint has written")
    try:
        return json.loads(Path(path).read_text(encoding="utf-8"))
    except RecursionError:
        raise ValueError(f"{path} is nested too deeply") from None


class ShotFolder:
    """A folder with the files of one shot."""

    def __init__(self, path):
        self.path = Path(path)
        self.render = self.path / "shot.exr"
        self.record = self.path / "shot.json"
        self.session = self.path / "painting"
        self.looks = self.path / "looks.json"

    @property
    def part(self):
        """The render while it is written."""
        return self.path / "shot.part.exr"

    def check_writable(self):
        """Make the folder. Raises OSError if nothing can be written there."""
        self.path.mkdir(parents=True, exist_ok=True)
        trial = self.path / ".lightpaint-trial"
        trial.write_bytes(b"")
        trial.unlink()

    def rendered_digest(self):
        """Return the digest of the scene that the render shows; "" without a whole render."""
        try:
            record = read_json(self.record)
            is_whole = self.render.stat().st_size == record["bytes"]
        except (OSError, ValueError, KeyError, TypeError):
            return ""
        return str(record.get("digest", "")) if is_whole else ""

    def finish_render(self, digest, groups):
        """Give the written render its name, and record what it shows."""
        os.replace(self.part, self.render)
        size = self.render.stat().st_size
        self._write(self.record, {"digest": digest, "groups": groups, "bytes": size})

    def read_looks(self):
        """Return kept looks as (name, multipliers by group); none if there are none."""
        try:
            looks = read_json(self.looks)
            return [
                (str(x["name"]), {k: checked_factor(v) for k, v in x["factors"].items()})
                for x in looks
            ]
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            return []

    def write_looks(self, looks):
        """Keep looks, for when the painter does not run."""
        self._write(self.looks, [{"name": name, "factors": factors} for name, factors in looks])

    @staticmethod
    def _write(path, content):
        beside = path.with_name(path.name + ".part")
        beside.write_text(json.dumps(content), encoding="utf-8")
        os.replace(beside, path)
