"""A painter that is killed while lights move: what was acknowledged is there again."""

import subprocess
import sys
from pathlib import Path

import pytest
from layered_sessions import identity_of
from moved_sessions import RandomMover, open_moved_session
from renderer import REPOSITORY

from lightpaint.paint import protocol
from lightpaint.paint.store.session_file import MemoryStore, Store


@pytest.mark.nightly
@pytest.mark.parametrize("count", [4, 11])
def test_killed_at_any_moment_all_moves_that_were_acknowledged_are_there(
    tmp_path: Path, count: int
) -> None:
    """Moves, additions, removals, and several lights in one step, each after drags that are none.

    Another process does what a mover of that seed does, and prints each step that is answered.
    """
    path, program = tmp_path / "session.db", REPOSITORY / "tests" / "moved_sessions.py"
    command = [sys.executable, str(program), str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        lines = [process.stdout.readline() for _ in range(count)]
        process.kill()
    acknowledged = int(lines[-1])
    with Store.open(path, identity_of(1)) as store:
        # One more may have been written, and not been told of yet.
        assert store.position >= acknowledged == count
        reopened = open_moved_session(store)
        mover = RandomMover(5, open_moved_session(MemoryStore(identity_of(1))))
        while len(mover.states) <= store.position:
            mover.act()
        assert reopened.requests.placed == mover.states[store.position] != {}
        assert reopened.basis.names == mover.session.basis.names
        for position in range(store.position - 1, 0, -1):  # each is one step of undo
            reopened.handle(protocol.Undo(), {})
            assert reopened.requests.placed == mover.states[position]
