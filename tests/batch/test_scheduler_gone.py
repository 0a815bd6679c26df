"""A scheduler that ends, while it is being reached or later: one line, and soon."""

import contextlib
import gc
import logging
import socket
import threading
import time
import weakref
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from batches import SilentListener

from lightpaint.batch import dask_workers
from lightpaint.batch.dask_engine import Cluster
from lightpaint.batch.dask_workers import ClusterWorkers, collect_lost_clients
from lightpaint.batch.parcels import unpack
from lightpaint.batch.work.work_items import ItemResult
from lightpaint.errors import BatchError, OutputError

distributed = pytest.importorskip("distributed", reason="Dask's distributed")

#: Seconds in which it is said: of a busy machine, too.
SOON_S = 25.0


@contextlib.contextmanager
def fake_server(with_bytes: bytes | None) -> Iterator[str]:
    """A server that says that much to each who comes, and ends; None: never anything."""
    server = socket.create_server(("127.0.0.1", 0))
    connections = []

    def serve() -> None:
        with contextlib.suppress(OSError):
            while True:
                connection, _ = server.accept()
                if with_bytes is None:
                    connections.append(connection)
                    continue
                with connection, contextlib.suppress(OSError):
                    connection.sendall(with_bytes)

    threading.Thread(target=serve, daemon=True).start()
    try:
        yield f"tcp://127.0.0.1:{server.getsockname()[1]}"
    finally:
        server.close()
        for connection in connections:
            connection.close()


@pytest.mark.parametrize("reply", [b"", b"\0" * 7, b"\1" + b"\0" * 30, b"GET / HTTP/1.1\r\n", None])
def test_one_that_ends_while_it_is_reached(
    reply: bytes | None, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(dask_workers, "ANSWER_S", 1.0)
    monkeypatch.setattr(dask_workers, "GONE_S", 0.5)
    began_s = time.monotonic()
    with fake_server(reply) as address, pytest.raises(BatchError) as refusal:
        ClusterWorkers(address, SilentListener(), "topic")  # type: ignore[arg-type]
    assert time.monotonic() - began_s < SOON_S
    assert f"no scheduler answers at {address}" in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert [x for x in caplog.records if x.levelno >= logging.WARNING] == []


def test_a_client_that_reached_nothing_is_closed_before_another_starts() -> None:
    class Lost:
        itself: object = None

    lost = Lost()
    lost.itself, is_collected = lost, weakref.ref(lost)
    del lost
    gc.disable()
    try:
        with fake_server(b"") as address, pytest.raises(BatchError):
            ClusterWorkers(address, SilentListener(), "topic")  # type: ignore[arg-type]
        assert is_collected() is None
    finally:
        gc.enable()


LATER: dict[str, Callable[[ClusterWorkers], object]] = {
    "refresh": lambda at: (setattr(at, "_looked_s", -1e9), at.refresh()),
    "is_there": lambda at: at.is_known("tcp://127.0.0.1:1"),
    "submit": lambda at: at.submit(None, "tcp://127.0.0.1:1", "key"),  # type: ignore[arg-type]
    "unfit": lambda at: at._reasons_against(["tcp://127.0.0.1:1"]),
}


@pytest.mark.parametrize("call", LATER)
def test_one_that_ends_later(call: str, caplog: pytest.LogCaptureFixture) -> None:
    options = {"n_workers": 0, "processes": False, "protocol": "tcp://", "dashboard_address": None}
    # Without a dashboard it still listens for HTTP: here on any port that is free.
    any_port = {"dashboard_address": "127.0.0.1:0"}
    collect_lost_clients()
    with distributed.LocalCluster(**options, scheduler_kwargs=any_port) as cluster:
        cluster_workers = ClusterWorkers(cluster.scheduler_address, SilentListener(), "topic")  # type: ignore[arg-type]
    caplog.clear()
    began_s = time.monotonic()

    def ask() -> None:
        while time.monotonic() - began_s < SOON_S:  # it may take a moment to be heard of
            LATER[call](cluster_workers)

    with pytest.raises(BatchError, match=r"is gone .*run the same command to continue") as refusal:
        ask()
    assert time.monotonic() - began_s < SOON_S
    assert "\n" not in str(refusal.value)
    assert cluster_workers.is_gone
    cluster_workers.close()
    assert [x for x in caplog.records if x.levelno >= logging.WARNING] == []


def test_what_a_worker_answers_that_is_no_answer_is_its_own_failure() -> None:
    cluster = Cluster("tcp://127.0.0.1:1", SilentListener())  # type: ignore[arg-type]
    item: Any = SimpleNamespace(name="look", kind="answer")
    for reply, is_told in (
        (ItemResult("look", "answer", ""), False),
        (["0" * 64], False),
        ([1], True),
        (None, True),
        (ItemResult("other", "answer", ""), True),
        (ItemResult("look", "answer", "", files={"a": "text"}), True),  # type: ignore[dict-item]
    ):

        def result(timeout: float, value: Any = reply) -> Any:
            return value

        future: Any = SimpleNamespace(
            item=item, worker="w", future=SimpleNamespace(result=result, status="finished")
        )
        item_result = cluster._result_of(future)
        is_reported = (
            isinstance(item_result, ItemResult)
            and "answers with something else" in item_result.failure
        )
        assert is_reported is is_told


def test_what_others_say_under_our_topic_is_passed_over() -> None:
    cluster = Cluster("tcp://127.0.0.1:1", SilentListener())  # type: ignore[arg-type]
    events = [{"item": "a", "worker": "w"}, {}, None, {"item": 1, "worker": "w"}, "text"]
    cluster._workers = SimpleNamespace(events=deque(events))  # type: ignore[assignment]
    cluster._read_events()
    assert cluster.starts == [("a", "w")]


@pytest.mark.parametrize("record", [b"{}", b"junk", b"\xff", b'{"answers": 3}', b"[1]", b"[]"])
def test_a_record_that_is_none_is_one_line(tmp_path: Path, record: bytes) -> None:
    item: Any = SimpleNamespace(output_folder=str(tmp_path / "look"), kind="answer")
    with pytest.raises(OutputError, match=r"a worker's result.json is damaged"):
        unpack(item, {"result.json": record, "lighting.json": b"{}"})
    assert not (tmp_path / "look").exists()
