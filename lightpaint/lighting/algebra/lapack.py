"""SciPy's LAPACK and BLAS, for matrices of many unknowns."""

from functools import cache
from typing import Any

from lightpaint.threads import find_loaded_libraries


@cache
def large_libraries() -> tuple[Any, Any]:
    """Return SciPy's LAPACK and BLAS, loaded where unknowns are many; `one_thread` limits them
    from then on.
    """
    from scipy.linalg import blas, lapack

    find_loaded_libraries()
    return lapack, blas
