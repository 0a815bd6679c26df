"""What tests of the painter share."""

import logging
from collections.abc import Iterator
from pathlib import Path

import pytest
from live_server import RunningServer
from moving import MovingStudio


@pytest.fixture
def serving(caplog: pytest.LogCaptureFixture) -> Iterator[RunningServer]:
    """What the terminal would show beside, is an error as well."""
    server = RunningServer()
    with caplog.at_level(logging.WARNING):
        yield server
        server.end()
    for connection in server.connections:
        connection.close()
    records = [*caplog.get_records("call"), *caplog.records]
    assert [record.getMessage() for record in records] == []


@pytest.fixture
def moving(tmp_path: Path) -> Iterator[MovingStudio]:
    """A studio of the test room."""
    studio = MovingStudio(tmp_path)
    yield studio
    studio.close()


@pytest.fixture
def without_reasons(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out why an answer is not closer, which takes most of the time of an exact answer.

    For tests in which nobody is told of it.
    """
    reasons_of = "lightpaint.lighting.analysis.appearance.answer_appearance.reasons_of"
    monkeypatch.setattr(reasons_of, lambda *_: ())
