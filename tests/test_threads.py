"""The limit on BLAS's threads: within, nested, in jobs side by side, and lifted after."""

from threading import Barrier

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from lightpaint.lighting.normal_equations import inner_products
from lightpaint.threads import one_thread, side_by_side


def _threads() -> set[int]:
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def test_the_outermost_lifts_it():
    with threadpool_limits(2, "blas"):
        before = _threads()
        assert before == {2}
        with one_thread():
            with one_thread():
                assert _threads() == {1}
            assert _threads() == {1}
        assert _threads() == before


def test_an_error_lifts_it():
    with threadpool_limits(2, "blas"):
        with pytest.raises(RuntimeError, match="within"), one_thread():
            raise RuntimeError("within")
        assert _threads() == {2}


def test_jobs_within_which_limit_it_once_more():
    """The limit is one of the process: no job lifts it for the others, or for good."""
    barrier = Barrier(2, timeout=30)

    def work(_: int) -> list[set[int]]:
        seen = []
        for _ in range(10):
            with one_thread():
                barrier.wait()
                seen.append(_threads())
            seen.append(_threads())
        return seen

    with threadpool_limits(2, "blas"):
        assert side_by_side(work, range(2)) == [[{1}] * 20] * 2
        assert _threads() == {2}


def test_results_in_order_and_errors_come_through():
    assert side_by_side(lambda k: k * k, range(7)) == [k * k for k in range(7)]
    assert side_by_side(abs, []) == []
    with pytest.raises(ZeroDivisionError):
        side_by_side(lambda k: 1 // k, [1, 0])


def test_inner_products_of_few_lights_are_formed_on_one_thread(monkeypatch: pytest.MonkeyPatch):
    seen = []
    multiply = np.multiply

    def watched(*args: object, **kwargs: object) -> object:
        seen.append(_threads())
        return multiply(*args, **kwargs)  # type: ignore[call-overload]

    images, target = np.ones((2, 4, 4, 3), np.float32), np.ones((4, 4, 3), np.float32)
    monkeypatch.setattr(np, "multiply", watched)
    with threadpool_limits(2, "blas"):
        inner_products(images, target, np.ones((4, 4), np.float32))
    assert seen
    assert all(threads == {1} for threads in seen)
