"""Exact answers of a session, found whenever the brush rests, and those with other colours.

Those with other light colours are to choose from at a glance. They are what a click on them leads
to: exact answers under the same requests but for `colors`. They are solved after the exact answer
and its analysis, and the next change cancels them.
"""

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, get_args

from lightpaint import lighting
from lightpaint.basis import Basis, DenoisedPlanes
from lightpaint.errors import ConstraintError
from lightpaint.paint import protocol
from lightpaint.paint.background_threads import ExactSolveLoop, LatestWork
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.session.picture_table import Picture, display_thumbnail
from lightpaint.paint.session.session_messages import judge, wish_delivery
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.session_access import StudioLinks
from lightpaint.paint.store.history_steps import name_in_view
from lightpaint.progress import cancellable

#: Seconds between two writes of the compositions of layers, which are as large as the pictures.
KEEP_INTERVAL_S = 60.0

#: Approximate pixels of the longer side of a choice's picture.
PICTURE_SIDE = 128


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
        self, links: StudioLinks, solved: Callable[[SessionSnapshot, lighting.Solution], None]
    ) -> None:
        self._access, self._publisher, _ = links
        self._solved = solved
        self._last: protocol.AnswerUpdate | None = None
        self._keep_at = time.monotonic() + KEEP_INTERVAL_S
        self._loop = ExactSolveLoop(self._solve, self._publisher.publish)
        self.run, self.stop, self.notify = self._loop.run, self._loop.stop, self._loop.notify

    def findings_of(self, session: Session) -> protocol.Findings:
        """Return the findings about the current answer, from its analysis if there is one."""
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
            judgement = judge(lighting.analyse(solution), snapshot.painted_views)
            self._publish(lambda: session.accept_solution(snapshot, solution, judgement))
            self._solved(snapshot, solution)
            if time.monotonic() >= self._keep_at:
                self._keep_at = time.monotonic() + KEEP_INTERVAL_S
                self._access.keep_compositions()

    def _publish(self, make: Callable[[], protocol.AnswerUpdate | None]) -> None:
        def remember() -> protocol.AnswerUpdate | None:
            message = make()
            self._last = message or self._last
            return message

        self._publisher.publish_made(remember)


class ChoiceSolver:
    """The answers with other light colours, of one studio's session.

    clean_planes: returns the denoised planes of bases; None for each that has none yet.
    """

    def __init__(
        self,
        links: StudioLinks,
        clean_planes: Callable[[Sequence[Basis]], Sequence[DenoisedPlanes | None]],
    ) -> None:
        self._access, self._publisher, _ = links
        self._clean_planes = clean_planes
        self._last: protocol.AnswerChoices | None = None
        self._loop = LatestWork(self._solve, self._publisher.publish)
        self.run, self.stop = self._loop.run, self._loop.stop

    def give(self, snapshot: SessionSnapshot, solution: lighting.Solution) -> None:
        """Replace the exact answer to which there are to be others."""
        self._loop.give((snapshot, solution))

    def choices_at(self, version: int) -> tuple[protocol.AnswerChoice, ...]:
        """Return the choices of a version of the session; none if they are of another."""
        is_current = self._last is not None and self._last.version == version
        return self._last.choices if self._last is not None and is_current else ()

    def _solve(self, answer: tuple[SessionSnapshot, lighting.Solution]) -> None:
        """Solve for the other choices, and publish all of them with their pictures."""
        snapshot, solution = answer

        def check() -> None:
            if not self._publisher.is_open or self._access.version != snapshot.version:
                raise OutdatedError

        with suppress(OutdatedError), cancellable(check):
            check()
            solutions = (
                solve_choices(snapshot, solution) if lighting.can_change_colors(solution) else {}
            )
            choices = tuple(
                protocol.AnswerChoice(
                    colors=colors, is_chosen=x is solution, **_choice_figures(snapshot, x)
                )
                for colors, x in solutions.items()
            )
            pictures = {
                name: picture
                for colors, x in solutions.items()
                for name, picture in self._pictures(snapshot, colors, x)
            }
            check()
            self._publisher.publish_made(lambda: self._message(snapshot, choices, pictures))

    def _message(
        self,
        snapshot: SessionSnapshot,
        choices: tuple[protocol.AnswerChoice, ...],
        pictures: dict[str, Picture],
    ) -> protocol.AnswerChoices | None:
        """Store the pictures, and return the message; None if the session has changed since."""
        if self._access.version != snapshot.version:
            return None
        resources = self._publisher.pictures.put_all(pictures).resources
        self._last = protocol.AnswerChoices(
            version=snapshot.version, choices=choices, resources=resources
        )
        return self._last

    def _pictures(
        self, snapshot: SessionSnapshot, colors: protocol.AnswerColors, solution: lighting.Solution
    ) -> list[tuple[str, Picture]]:
        """Return the names and pictures of a choice, (h, w, 3) uint8, of all views."""
        weights = snapshot.requests.output(solution.weights, snapshot.bases[0].is_fixed)
        clean = self._clean_planes(snapshot.bases)
        return [
            (
                name_in_view(f"choice/{colors}", k),
                display_thumbnail(
                    (planes or basis).mix(weights), snapshot.transform, side=PICTURE_SIDE
                ),
            )
            for k, (basis, planes) in enumerate(zip(snapshot.bases, clean, strict=True))
        ]


def solve_choices(
    snapshot: SessionSnapshot, solution: lighting.Solution
) -> dict[protocol.AnswerColors, lighting.Solution]:
    """Return the exact answer with each choice of colours; none for one that is impossible.

    solution: the exact answer to `snapshot`, with its own choice.
    """
    solutions: dict[protocol.AnswerColors, lighting.Solution] = {}
    for colors in get_args(protocol.AnswerColors):
        if solution.problem.fit.colors == colors:
            solutions[colors] = solution
            continue
        with suppress(ConstraintError):  # another constraint may exclude it
            solutions[colors] = snapshot.solution_with(colors)
    return solutions


def _choice_figures(snapshot: SessionSnapshot, solution: lighting.Solution) -> dict[str, Any]:
    """Return the fields of `AnswerChoice` that say what an answer delivers."""
    picture = solution.basis.mix(solution.weights)
    deliveries = lighting.measure_deliveries(solution, picture).deliveries
    brightness, color = lighting.mean_shares(deliveries)
    worst = lighting.worst_delivery(deliveries)
    return {
        "delta_e": snapshot.delta_e(solution),
        "brightness": brightness,
        "color": color,
        "worst": None if worst is None else wish_delivery(worst),
    }
