"""Exact answers of a session: found with their analysis whenever the brush rests."""

from collections.abc import Callable
from contextlib import suppress
from typing import Protocol

from lightpaint.lighting.analysis.analysis import analyse
from lightpaint.lighting.solution import Solution
from lightpaint.paint.background_threads import ExactSolveLoop
from lightpaint.paint.protocol import AnswerUpdate, Findings, Message
from lightpaint.paint.session.answer_messages import judge
from lightpaint.paint.session.session import Session
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.progress import cancellable


class OutdatedError(Exception):
    """Signal that ends work whose result is outdated: the user has continued to paint, or left."""


def raise_outdated() -> None:
    """Raise OutdatedError, to end work whose result is outdated."""
    raise OutdatedError


class AnswerHost(Protocol):
    """The studio, as its exact answers see it."""

    is_open: bool

    def session_at_rest(self) -> tuple[Session, SessionSnapshot] | None:
        """Return session and snapshot; None before there is a basis and while a stroke is open."""

    def publish_made(self, make: Callable[[], Message | None]) -> None:
        """Make a message under the lock and send it, in the order in which messages were made."""

    def publish(self, message: Message) -> None:
        """Send a message to pages."""


class ExactAnswers:
    """The exact answers of one studio's session.

    solved: called with the snapshot and its solution once the analysis is published too.
    """

    def __init__(
        self, host: AnswerHost, solved: Callable[[SessionSnapshot, Solution], None]
    ) -> None:
        self._host, self._solved = host, solved
        self._last: AnswerUpdate | None = None
        self._loop = ExactSolveLoop(self._solve, host.publish)
        self.run, self.stop, self.notify = self._loop.run, self._loop.stop, self._loop.notify

    def findings_of(self, session: Session) -> Findings:
        """Return the findings about the current answer, those of the analysis if there is one."""
        last = self._last
        if last is not None and last.version == session.version:
            return last.findings
        return session.findings

    def _solve(self) -> None:
        """Publish the exact answer, then its analysis."""
        at_rest = self._host.session_at_rest()
        if at_rest is None:
            return
        session, snapshot = at_rest

        def check() -> None:
            if snapshot.version != session.version or not self._host.is_open:
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

    def _publish(self, make: Callable[[], AnswerUpdate | None]) -> None:
        def remember() -> AnswerUpdate | None:
            message = make()
            self._last = message or self._last
            return message

        self._host.publish_made(remember)
