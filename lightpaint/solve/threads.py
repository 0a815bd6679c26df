"""One thread for products of small blocks."""

from contextlib import AbstractContextManager
from functools import cache

# The controller finds the libraries that are loaded: numpy has to be.
import numpy as np  # noqa: F401
from threadpoolctl import ThreadpoolController


@cache
def _controller() -> ThreadpoolController:
    return ThreadpoolController()


def one_thread() -> AbstractContextManager[object]:
    """Within it, BLAS runs on one thread.

    On small blocks its threads wait for each other longer than they work, and how a sum is
    split among them decides its last bits.
    """
    limits: AbstractContextManager[object] = _controller().limit(limits=1, user_api="blas")
    return limits
