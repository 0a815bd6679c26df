"""The limit on BLAS's threads: within, nested, in jobs side by side, and lifted after."""

import os
import subprocess
import sys
from threading import Barrier, get_ident

import numpy as np
import pytest
from least_squares import inner_products
from patience import PATIENCE_S
from threadpoolctl import threadpool_info, threadpool_limits

from lightpaint.threads import limit_jobs, one_thread, parallel_map


def _threads() -> set[int]:
    """Of NumPy's BLAS: the limit knows no other that tests before have loaded since, as SciPy's."""
    pools = [pool for pool in threadpool_info() if pool["user_api"] == "blas"]
    pools.sort(key=lambda pool: "numpy" not in pool["filepath"])
    return {pools[0]["num_threads"]}


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
    barrier = Barrier(2, timeout=PATIENCE_S)

    def work(_: int) -> list[set[int]]:
        limits = []
        for _ in range(10):
            with one_thread():
                barrier.wait()
                limits.append(_threads())
            limits.append(_threads())
        return limits

    with threadpool_limits(2, "blas"):
        assert parallel_map(work, range(2)) == [[{1}] * 20] * 2
        assert _threads() == {2}


def test_results_in_order_and_errors_come_through():
    assert parallel_map(lambda k: k * k, range(7)) == [k * k for k in range(7)]
    assert parallel_map(abs, []) == []
    with pytest.raises(ZeroDivisionError):
        parallel_map(lambda k: 1 // k, [1, 0])
    with pytest.raises(RuntimeError, match=r"^2$"):
        parallel_map(_fail_from_2_on, range(9))


def _fail_from_2_on(k: int) -> None:
    if k >= 2:
        raise RuntimeError(str(k))


def test_a_process_that_shares_a_machine_does_one_at_a_time():
    limit_jobs(1)
    try:
        assert {get_ident()} == set(parallel_map(lambda _: get_ident(), range(4)))
    finally:
        limit_jobs(None)


def test_jobs_within_jobs_wait_for_nobody():
    """However many ask at once for threads that are all busy."""

    def tree(depth: int) -> int:
        return 1 if depth == 0 else sum(parallel_map(tree, [depth - 1] * 4))

    assert tree(4) == 4**4


@pytest.mark.skipif(not hasattr(os, "fork"), reason="fork")
def test_a_fork_has_threads_of_its_own():
    assert parallel_map(abs, [-1, -2]) == [1, 2]
    child = os.fork()
    if child == 0:
        os._exit(0 if parallel_map(abs, [-1, -2]) == [1, 2] else 1)
    assert os.waitpid(child, 0)[1] == 0


def test_inner_products_of_few_lights_are_formed_on_one_thread(monkeypatch: pytest.MonkeyPatch):
    thread_names = []
    multiply = np.multiply

    def watched(*args: object, **kwargs: object) -> object:
        thread_names.append(_threads())
        return multiply(*args, **kwargs)  # type: ignore[call-overload]

    images, target = np.ones((2, 4, 4, 3), np.float32), np.ones((4, 4, 3), np.float32)
    monkeypatch.setattr(np, "multiply", watched)
    with threadpool_limits(2, "blas"):
        inner_products(images, target, np.ones((4, 4), np.float32))
    assert thread_names
    assert all(threads == {1} for threads in thread_names)


def test_a_library_that_is_loaded_within_a_limit_has_one_thread() -> None:
    """In a process of its own, in which SciPy's BLAS is not loaded yet."""
    code = """
import numpy
from threadpoolctl import threadpool_info
from lightpaint.lighting.algebra.symmetric_matrices import large_libraries
from lightpaint.threads import one_thread

def numbers():
    return [x["num_threads"] for x in threadpool_info() if x["user_api"] == "blas"]

with one_thread():
    before = numbers()
    large_libraries()
    assert len(numbers()) >= len(before), numbers()
    assert set(numbers()) == {1}, numbers()
print(len(before), len(numbers()))
"""
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "OPENBLAS_NUM_THREADS": "2"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
