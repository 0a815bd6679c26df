"""The history of a session: steps, and what each of them changes in canvases and requests."""

from collections.abc import Mapping, Sequence

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.errors import NothingToUndoError, PaintError
from lightpaint.paint.protocol import HistoryInfo
from lightpaint.paint.session.canvas import Canvases
from lightpaint.paint.session.live_answer import LiveAnswer
from lightpaint.paint.store.canvas_pixels import Pixels
from lightpaint.paint.store.database import DamagedError
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.paint.store.steps import Patch, Step
from lightpaint.paint.store.store import Store

#: Steps that a page is told of, backwards and forwards.
LISTED_STEPS = 50


class History:
    """The steps of a session, each with the state before it. Nothing is solved here.

    store: keeps the steps. views: the canvases that they paint on. live_answer: has the requests
    that they set.
    """

    def __init__(self, store: Store, views: Canvases, live_answer: LiveAnswer) -> None:
        self._store, self._views, self._live_answer = store, views, live_answer

    def close_stroke(self, label: str) -> None:
        """Append the open stroke as a step, if there is one."""
        if patches := self._views.stroke_patches():
            self._store.append(Step("stroke", label, {}, patches))
        self._views.close()

    def append_requests(self, label: str, requests: SessionRequests) -> None:
        """Set requests from now on: a step. Raises LightpaintError for what cannot be asked."""
        self._live_answer.check(requests)
        self.close_stroke("stroke")
        before = self._live_answer.requests_at_rest
        fields = {"before": before.as_json(), "after": requests.as_json()}
        self._store.append(Step("asked", label, fields))
        self._live_answer.set_requests(requests)

    def replace_all(
        self, paintings: Mapping[int, Pixels], requests: SessionRequests, label: str
    ) -> Sequence[Patch]:
        """Replace the paintings, by view, and the requests: one step. Returns its patches."""
        patches = self._views.replacement_patches(paintings)
        before = self._live_answer.requests
        fields = {"before": before.as_json(), "after": requests.as_json()}
        self._store.append(Step("look_loaded", label, fields, patches))
        self._views.put(patches)
        self._live_answer.set_requests(requests)
        return patches

    def move(self, by: int) -> Sequence[Patch]:
        """Move back or forth by one step, and return the patches that it has changed.

        Raises NothingToUndoError at either end, PaintError for a step whose pixels are lost.
        """
        steps, current = self._store.steps, self._store.position
        position, is_back = current + by, by < 0
        if not 0 <= position <= len(steps):
            raise NothingToUndoError(f"There is nothing to {'undo' if is_back else 'redo'}.")
        step = steps[position] if is_back else steps[current]
        try:
            states = [patch.before if is_back else patch.after for patch in step.patches]
        except DamagedError:
            raise PaintError(self._store.recover()) from None
        self._store.move_to(position)
        for patch, pixels in zip(step.patches, states, strict=True):
            self._views[patch.view].put(patch.region, pixels)
        if step.fields:
            requests = step.fields["before" if is_back else "after"]
            self._live_answer.set_requests(SessionRequests.of(requests))
        return step.patches

    def info(self) -> HistoryInfo:
        """Return the labels of the steps that can be undone and redone."""
        steps, position = self._store.steps, self._store.position
        return HistoryInfo(
            undo=tuple(self._label(step) for step in steps[:position][-LISTED_STEPS:]),
            redo=tuple(self._label(step) for step in steps[position:][:LISTED_STEPS]),
            count=position,
        )

    def _label(self, step: Step) -> str:
        """Return the label of a step for undo, with the view's name if there are several."""
        view_names = [self._views[patch.view].name for patch in step.patches]
        names_view = len(self._views) > 1 and len(view_names) == 1
        return f"{step.label}, {view_names[0]}" if names_view else step.label


def restore(
    bases: Sequence[Basis], presents: Sequence[Floats], store: Store
) -> tuple[Canvases, SessionRequests]:
    """Return the canvases and the requests after the steps of the store."""
    applied = store.steps[: store.position]
    states = [step.fields["after"] for step in applied if step.fields]
    requests = SessionRequests.of(states[-1]) if states else SessionRequests()
    requests.constraints()
    return Canvases(bases, presents, applied), requests
