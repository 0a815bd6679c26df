"""The library colour-science. It takes a second to import, and only who needs it waits."""

import warnings
from functools import cache
from types import ModuleType
from typing import cast

from lightpaint.signals import interruptible_between_pieces


@cache
def colour_science() -> ModuleType:
    """The module `colour`."""
    # Interrupted in the middle, what it has begun complains when the process ends.
    with interruptible_between_pieces(), warnings.catch_warnings():
        # It warns about plotting libraries that nothing here needs.
        warnings.simplefilter("ignore")
        import colour
    return cast("ModuleType", colour)
