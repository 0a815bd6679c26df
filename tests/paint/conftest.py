"""What tests of the painter share."""

import logging
from collections.abc import Iterator

import pytest
from live_server import Serving


@pytest.fixture
def serving(caplog: pytest.LogCaptureFixture) -> Iterator[Serving]:
    """What the terminal would show beside, is an error as well."""
    made = Serving()
    with caplog.at_level(logging.WARNING):
        yield made
        made.end()
    for connection in made.connections:
        connection.close()
    records = [*caplog.get_records("call"), *caplog.records]
    assert [record.getMessage() for record in records] == []
