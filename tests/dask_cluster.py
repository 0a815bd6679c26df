"""A Dask cluster on this machine: a scheduler and worker processes."""

import contextlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

distributed = pytest.importorskip("distributed", reason="Dask's distributed")

#: Seconds after which something has gone wrong, however busy the machine is.
LONG_S = 120.0


@dataclass
class Workers:
    """A scheduler with workers. slow: folder by which they are held (slow_worker.py)."""

    address: str
    slow: Path

    def pid(self, worker: str) -> int:
        """The process behind an address."""
        with distributed.Client(self.address, set_as_default=False) as client:
            return int(client.run(os.getpid, workers=[worker])[worker])

    def await_all(self, count: int = 2) -> None:
        """Until all are there: a nanny begins another in the place of one that died."""
        with distributed.Client(self.address, set_as_default=False) as client:
            wait_until(lambda: len(client.nthreads()) == count)


def wait_until(condition: Callable[[], Any]) -> None:
    """Wait for it."""
    deadline_s = time.monotonic() + LONG_S
    while not condition():
        assert time.monotonic() < deadline_s
        time.sleep(0.02)


@contextlib.contextmanager
def cluster_of(count: int, folder: Path, *, can_be_held: bool = True) -> Iterator[Workers]:
    """A scheduler with so many workers.

    can_be_held: whether they load slow_worker.py, which also shortens the training of guides.
    """
    (slow := folder / "slow").mkdir()
    file, tests = folder / "scheduler.json", Path(__file__).parent
    environment = {
        **os.environ,
        "LIGHTPAINT_TEST_SLOW": str(slow),
        "PYTHONPATH": os.pathsep.join([str(tests), *filter(None, sys.path)]),
        # Its own, so that nothing is found that the tests have kept.
        "LIGHTPAINT_CACHE": str(folder / "none"),
    }
    dask = [sys.executable, "-m", "dask"]
    options = ["--scheduler-file", str(file)]
    preload = ["--preload", "slow_worker"] if can_be_held else []
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "env": environment, "cwd": folder}
    with contextlib.ExitStack() as stack, (folder / "log").open("w") as log:
        for command in (
            [*dask, "scheduler", "--port", "0", "--host", "127.0.0.1", "--no-dashboard", *options],
            [
                *dask, "worker", "--nworkers", str(count), "--nthreads", "1", "--no-dashboard",
                "--local-directory", str(folder), *preload, *options,
            ],
        ):  # fmt: skip
            process = stack.enter_context(subprocess.Popen(command, stderr=log, **quiet))
            stack.callback(_end, process)
            wait_until(file.exists)
        wait_until(lambda: _address(file))
        worker_pool = Workers(_address(file), slow)
        worker_pool.await_all(count)
        yield worker_pool


def _address(file: Path) -> str:
    with contextlib.suppress(ValueError):  # half written
        return str(json.loads(file.read_text())["address"])
    return ""


def _end(process: "subprocess.Popen[Any]") -> None:
    process.terminate()
    try:
        process.wait(20)
    except subprocess.TimeoutExpired:
        process.kill()
