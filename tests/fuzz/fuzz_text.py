"""Fuzz the readers of JSON and TOML with libFuzzer, by way of Atheris; not part of the tests.

    pip install atheris
    python tests/fuzz/fuzz_text.py -max_total_time=600 -rss_limit_mb=2048 -timeout=10 CORPUS

CORPUS is a folder of lightings and lights files to begin with. Each input is read as either.
Whatever is neither read nor refused in one line ends it, and leaves the file that did it.
"""

import sys
import tempfile
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["lightpaint", "json", "tomllib"]):
    from lightpaint.errors import LightpaintError
    from lightpaint.lighting.answer.lighting_file import read_lighting
    from lightpaint.lighting.constraints.constraints_file import read_constraints
    from lightpaint.scene.lights.lights_file import read_lights_file

PATH = Path(tempfile.mkdtemp()) / "text"


def read_one(data: bytes) -> None:
    """Read these bytes as a lighting and as a lights file."""
    PATH.write_bytes(data)
    for read in (read_lighting, read_lights_file, read_constraints):
        try:
            read(PATH)
        except LightpaintError as error:
            if "\n" in str(error) or PATH.name not in str(error):
                raise RuntimeError(f"unclear: {error!r}") from error


if __name__ == "__main__":
    atheris.Setup(sys.argv, read_one)
    atheris.Fuzz()
