"""Killed at any moment, a solve and a relight leave the earlier result or the new one, whole.

All steps of how results appear are tried in test_staging.py; `python tests/killed_commands.py`
kills more.
"""

import signal
from collections.abc import Callable

import pytest
from killed_commands import Stage, after, when_staged, when_staging
from nightly import at_night


@pytest.fixture(scope="module", params=["solve", "relight"])
def stage(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Stage:
    return Stage(tmp_path_factory.mktemp("kills"), str(request.param))


@pytest.mark.parametrize(
    ("until", "number"),
    [
        at_night(after(0.5), signal.SIGKILL),
        (when_staging(0.0), signal.SIGTERM),
        at_night(when_staging(0.2), signal.SIGKILL),
        (when_staged, signal.SIGKILL),
    ],
)
def test_the_earlier_or_the_new(
    stage: Stage, until: Callable[[Stage], None], number: signal.Signals
) -> None:
    outcome = stage.killed(until, number)
    assert outcome.kind in ("earlier", "new"), outcome
    if number == signal.SIGTERM:
        assert outcome.code == 143
        assert outcome.kind == "earlier"
        assert outcome.said.endswith(": interrupted\n")
        assert "Traceback" not in outcome.said
