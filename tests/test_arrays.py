"""Arrays that are copied to where other libraries read them best."""

import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lightpaint import arrays
from lightpaint.arrays import ALIGNMENT, aligned, is_finite


@pytest.mark.parametrize("kind", [np.float32, np.uint32, np.float64])
def test_copies_begin_where_registers_do(kind: type) -> None:
    """Wherever the numbers lie that are copied."""
    numbers = np.arange(400)
    for start in range(20):
        copy = aligned(numbers[start::3], kind)
        assert copy.ctypes.data % ALIGNMENT == 0
        assert copy.dtype == kind
        np.testing.assert_array_equal(copy, numbers[start::3])


@pytest.mark.parametrize("kind", [np.float16, ">f2", np.float32])
@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan, 65504, -0.0, 2**-24])
def test_is_finite_is_what_numpy_says(kind: Any, value: float) -> None:
    values = np.zeros((3, 5), kind)
    values[1, 2] = value
    assert is_finite(values) == np.isfinite(values).all()
    assert is_finite(values[:, ::2]) == np.isfinite(values[:, ::2]).all()


@pytest.mark.skipif(sys.platform != "linux", reason="asks Linux for the largest memory")
def test_only_a_process_that_was_large_gives_memory_back(monkeypatch: pytest.MonkeyPatch):
    given_back: list[int] = []
    monkeypatch.setattr(
        arrays.ctypes, "CDLL", lambda _: SimpleNamespace(malloc_trim=given_back.append)
    )
    held = np.ones(2**20)
    for limit, count in ((2**62, 0), (held.nbytes, 1)):
        monkeypatch.setattr(arrays, "LARGE_MEMORY", limit)
        arrays.release_freed_memory()
        assert len(given_back) == count
