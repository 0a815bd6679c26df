"""Exact answers of a session: found with their analysis whenever the brush rests."""

import time
from collections.abc import Callable
from contextlib import suppress

from lightpaint.lighting.analysis.analysis import analyse
from lightpaint.lighting.solution import Solution
from lightpaint.paint.background_threads import ExactSolveLoop
from lightpaint.paint.protocol import AnswerUpdate, Findings
from lightpaint.paint.publisher import Publisher
from lightpaint.paint.session.session import Session
from lightpaint.paint.session.session_messages import judge
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.session_access import SessionAccess
from lightpaint.progress import cancellable

#: Seconds between two writes of the compositions of layers, which are as large as the pictures.
KEEP_INTERVAL_S = 60.0


class OutdatedError(Exception):
    """Signal that ends work whose result is outdated: the user has continued to paint, or left."""


def raise_outdated() -> None:
    """Raise OutdatedError, to end work whose result is outdated."""
    raise OutdatedError


class ExactAnswers:
    """The exact answers of one studio's session.

    solved: called with the snapshot and its solution once the analysis is published too.
    """

    def __init__(
        self,
        access: SessionAccess,
        publisher: Publisher,
        solved: Callable[[SessionSnapshot, Solution], None],
    ) -> None:
        self._access, self._publisher, self._solved = access, publisher, solved
        self._last: AnswerUpdate | None = None
        self._keep_at = time.monotonic() + KEEP_INTERVAL_S
        self._loop = ExactSolveLoop(self._solve, publisher.publish)
        self.run, self.stop, self.notify = self._loop.run, self._loop.stop, self._loop.notify

    def findings_of(self, session: Session) -> Findings:
        """Return the findings about the current answer, those of the analysis if there is one."""
        last = self._last
        if last is not None and last.version == session.version:
            return last.findings
        return session.findings

    def _solve(self) -> None:
        """Publish the exact answer, then its analysis."""
        snapshot = self._access.snapshot_at_rest()
        if snapshot is None:
            return
        session = self._access.session

        def check() -> None:
            if snapshot.version != session.version or not self._publisher.is_open:
                raise OutdatedError

        # The next stroke cancels this solve, so that it gets the processors at once.
        with suppress(OutdatedError), cancellable(check):
            solution = snapshot.solution()
            self._publish(lambda: session.accept_solution(snapshot, solution))
            if solution is None:
                return
            check()
            judgement = judge(analyse(solution), snapshot.painted_views)
            self._publish(lambda: session.accept_solution(snapshot, solution, judgement))
            self._solved(snapshot, solution)
            if time.monotonic() >= self._keep_at:
                self._keep_at = time.monotonic() + KEEP_INTERVAL_S
                self._access.keep_compositions()

    def _publish(self, make: Callable[[], AnswerUpdate | None]) -> None:
        def remember() -> AnswerUpdate | None:
            message = make()
            self._last = message or self._last
            return message

        self._publisher.publish_made(remember)
