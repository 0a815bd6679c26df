"""Threads: one for products of small blocks, several for jobs that have nothing in common."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager
from functools import cache
from typing import TypeVar

# The controller finds the libraries that are loaded: numpy has to be.
import numpy as np  # noqa: F401
from threadpoolctl import ThreadpoolController

Job = TypeVar("Job")
Result = TypeVar("Result")


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


def linear_algebra() -> tuple[str, str]:
    """The library under NumPy with its version, and its kernel: `openblas 0.3.31`, `Haswell`.

    Kernels add in different orders, so that results differ in their last digits. "" for what is not
    known: a library that is not listed, or says nothing of a kernel.
    """
    found = [x for x in _controller().info() if x.get("user_api") == "blas"]
    # SciPy has one of its own.
    found.sort(key=lambda library: "numpy" not in library["filepath"])
    if not found:
        return "", ""
    first = found[0]
    return f"{first['internal_api']} {first.get('version') or ''}".strip(), str(
        first.get("architecture") or ""
    )


def side_by_side(work: Callable[[Job], Result], jobs: Iterable[Job]) -> list[Result]:
    """work(job) of each job, several at a time with BLAS on one thread; results in order.

    What comes out has the bits that one job after the other would give.
    """
    # One thread more than processors: three channels then share two of them evenly.
    with one_thread(), ThreadPoolExecutor((os.cpu_count() or 1) + 1) as pool:
        return list(pool.map(work, jobs))
