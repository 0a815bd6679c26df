"""Fuzz `read_picture` with libFuzzer, by way of Atheris; not part of the tests.

    pip install atheris
    python tests/fuzz/fuzz_picture.py -max_total_time=600 -rss_limit_mb=2048 -timeout=10 CORPUS

CORPUS is a folder of pictures to begin with. Whatever is neither a picture nor an ImageError of
one line ends it, and leaves the file that did it.
"""

import sys
import tempfile
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["lightpaint"]):
    from lightpaint.errors import ImageError
    from lightpaint.images.picture import read_picture

PATH = Path(tempfile.mkdtemp()) / "picture"


def read_one(data: bytes) -> None:
    """Read these bytes as a picture."""
    PATH.write_bytes(data)
    try:
        read_picture(PATH)
    except ImageError as error:
        if "\n" in str(error) or PATH.name not in str(error):
            raise RuntimeError(f"unclear: {error!r}") from error


if __name__ == "__main__":
    atheris.Setup(sys.argv, read_one)
    atheris.Fuzz()
