"""What an answer was computed with, on which its last digits depend (docs/method.md)."""

import importlib.metadata
from dataclasses import dataclass
from functools import cache

from lightpaint.threads import linear_algebra
from lightpaint.version import __version__


@dataclass(frozen=True)
class Software:
    """Versions as installed, and the processor's part in them.

    blas: library of linear algebra under NumPy, and its version. kernel: what it has chosen for the
    processor, as `Haswell`, "" where it does not say. mitsuba: "" where there is none.
    """

    lightpaint: str
    numpy: str
    blas: str
    kernel: str
    mitsuba: str = ""

    @classmethod
    @cache
    def here(cls) -> "Software":
        """That of this process."""
        blas, kernel = linear_algebra()
        return cls(__version__, version("numpy"), blas, kernel, version("mitsuba"))


def version(package: str) -> str:
    """Of an installed package; "" if it is not."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return ""  # a saved basis needs no renderer
