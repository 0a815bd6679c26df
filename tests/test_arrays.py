"""Arrays that are copied to where other libraries read them best."""

import numpy as np
import pytest

from lightpaint.arrays import ALIGNMENT, aligned


@pytest.mark.parametrize("kind", [np.float32, np.uint32, np.float64])
def test_copies_begin_where_registers_do(kind: type) -> None:
    """Wherever the numbers lie that are copied."""
    numbers = np.arange(400)
    for start in range(20):
        copy = aligned(numbers[start::3], kind)
        assert copy.ctypes.data % ALIGNMENT == 0
        assert copy.dtype == kind
        np.testing.assert_array_equal(copy, numbers[start::3])
