"""Import of the library colour-science, which takes a second, on first use."""

import warnings
from functools import cache
from types import ModuleType
from typing import cast

from lightpaint.signals import interruptible_between_pieces


@cache
def colour_science() -> ModuleType:
    """Return the module `colour`."""
    # An interrupt in the middle of the import would cause complaints when the process ends.
    with interruptible_between_pieces(), warnings.catch_warnings():
        # It warns about missing plotting libraries, which are not needed here.
        warnings.simplefilter("ignore")
        import colour
    return cast("ModuleType", colour)
