"""Versions of the software behind an answer, on which its last digits depend (docs/method.md)."""

import importlib.metadata
from dataclasses import dataclass
from functools import cache

from lightpaint.threads import linear_algebra
from lightpaint.version import __version__


@dataclass(frozen=True)
class Software:
    """Installed versions, and the kernel for the processor.

    blas: library of linear algebra under NumPy, and its version. kernel: of that library for the
    processor, such as `Haswell`; "" if unknown. mitsuba: "" if it is not installed.
    """

    lightpaint: str
    numpy: str
    blas: str
    kernel: str
    mitsuba: str = ""

    @classmethod
    @cache
    def installed(cls) -> "Software":
        """Return the versions of this process."""
        blas, kernel = linear_algebra()
        return cls(__version__, version("numpy"), blas, kernel, version("mitsuba"))


def version(package: str) -> str:
    """Return the version of an installed package; "" if it is not."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return ""  # a saved basis needs no renderer
