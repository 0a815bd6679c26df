"""The library colour-science. It takes a second to import, and only who needs it waits."""

import warnings
from functools import cache
from types import ModuleType
from typing import cast


@cache
def colour_science() -> ModuleType:
    """The module `colour`."""
    with warnings.catch_warnings():
        # It warns about plotting libraries that nothing here needs.
        warnings.simplefilter("ignore")
        import colour
    return cast("ModuleType", colour)
