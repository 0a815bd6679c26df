"""Killed at any moment, a solve and a relight leave the earlier result or the new one, whole.

All steps of how results appear are tried in test_staging.py; `python tests/killed_commands.py`
kills more.
"""

import signal
from collections.abc import Callable

import pytest
from killed_commands import Stage, wait_for_record, wait_for_seconds, wait_for_staging
from nightly import nightly


@pytest.fixture(scope="module", params=["solve", nightly("relight")])
def stage(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Stage:
    return Stage(tmp_path_factory.mktemp("kills"), str(request.param))


@pytest.mark.parametrize(
    ("wait_until", "number"),
    [
        nightly(wait_for_seconds(0.5), signal.SIGKILL),
        (wait_for_staging(0.0), signal.SIGTERM),
        nightly(wait_for_staging(0.2), signal.SIGKILL),
        nightly(wait_for_record, signal.SIGKILL),
    ],
)
def test_the_earlier_or_the_new(
    stage: Stage, wait_until: Callable[[Stage], None], number: signal.Signals
) -> None:
    outcome = stage.killed(wait_until, number)
    assert outcome.kind in ("earlier", "new"), outcome
    if number == signal.SIGTERM:
        assert outcome.code == 143
        assert outcome.kind == "earlier"
        assert outcome.stderr.endswith(": interrupted\n")
        assert "Traceback" not in outcome.stderr
