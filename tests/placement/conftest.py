"""Searches for places run on one thread: they launch hundreds of kernels, each of a few pixels."""

from collections.abc import Iterator

import pytest

from lightpaint.scene.runtime import kernel_threads


@pytest.fixture(scope="module", autouse=True)
def _one_thread() -> Iterator[None]:
    """Beside other workers a second thread costs more than it brings; others search on all."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(kernel_threads, "_limit", 1)
        yield
