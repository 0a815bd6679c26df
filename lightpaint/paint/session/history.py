"""The history of a session: steps, and their changes of canvases and requests."""

from collections.abc import Sequence
from typing import Any

from lightpaint.arrays import Floats
from lightpaint.basis.basis import Basis
from lightpaint.errors import NothingToUndoError, PaintError
from lightpaint.paint.layers.canvases import Canvases
from lightpaint.paint.layers.layer_stack import LayerStack
from lightpaint.paint.layers.selection import put_selection
from lightpaint.paint.protocol import HistoryInfo
from lightpaint.paint.session.live_answer import LiveAnswer
from lightpaint.paint.store.canvas_pixels import Region
from lightpaint.paint.store.database import DamagedError
from lightpaint.paint.store.history_steps import Patch, Step
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.paint.store.store import Store

#: Number of steps listed to a page, backwards and forwards.
LISTED_STEPS = 50

#: Views, and the region of each that changed.
Changes = Sequence[tuple[int, Region]]


class History:
    """The steps of a session, each with the state before it. Nothing is solved here.

    store: keeps the steps. views: the canvases that they paint on. live_answer: has the requests
    that they set.
    """

    def __init__(self, store: Store, views: Canvases, live_answer: LiveAnswer) -> None:
        self._store, self._views, self._live_answer = store, views, live_answer

    def close_stroke(self, label: str) -> None:
        """Append the open stroke, or the open change of the layers, as a step, if there is one."""
        change, patches = self._views.open_change()
        if change or patches:
            fields = {"stack": change} if change else {}
            self._store.append(Step("stroke" if patches else "layers", label, fields, patches))
        self._views.close()

    def append_selection(self, label: str, patch: Patch) -> None:
        """Select a part of a view, as a step."""
        self._store.append(Step("selection", label, patches=(patch,)))
        put_selection(self._views[patch.view].selection, patch, is_back=False)

    def append_requests(self, label: str, requests: SessionRequests) -> None:
        """Set requests, as a step. Raises LightpaintError for impossible ones."""
        self._live_answer.check(requests)
        self.close_stroke("stroke")
        requests_at_rest = self._live_answer.requests_at_rest
        fields = {"before": requests_at_rest.as_json(), "after": requests.as_json()}
        self._store.append(Step("requests", label, fields))
        self._live_answer.set_requests(requests)

    def replace_all(
        self, layers: LayerStack, patches: Sequence[Patch], requests: SessionRequests, label: str
    ) -> Changes:
        """Replace the layers, their pixels and the requests, as one step. Returns the changes."""
        replaced_requests, change = self._live_answer.requests, self._views.layers.change_to(layers)
        fields: dict[str, Any] = {
            "before": replaced_requests.as_json(),
            "after": requests.as_json(),
        }
        fields |= {"stack": change} if change else {}
        self._store.append(Step("look_loaded", label, fields, tuple(patches)))
        changes = self._views.move(layers, patches, self._done_steps)
        self._live_answer.set_requests(requests)
        return changes

    @property
    def _done_steps(self) -> Sequence[Step]:
        return self._store.steps[: self._store.position]

    def move(self, by: int) -> Changes:
        """Move back or forth by one step, and return its changes.

        Raises NothingToUndoError at either end, PaintError for a step whose pixels are lost.
        """
        steps, current = self._store.steps, self._store.position
        position, is_back = current + by, by < 0
        if not 0 <= position <= len(steps):
            raise NothingToUndoError(f"There is nothing to {'undo' if is_back else 'redo'}.")
        step = steps[position] if is_back else steps[current]
        try:
            for patch in step.patches:
                _ = patch.before if is_back else patch.after
        except DamagedError:
            raise PaintError(self._store.recover()) from None
        self._store.move_to(position)
        layers = self._views.layers.changed(step.fields.get("stack", {}), is_back=is_back)
        changes = self._views.move(layers, step.patches, self._done_steps, is_back=is_back)
        if requests := step.fields.get("before" if is_back else "after"):
            self._live_answer.set_requests(SessionRequests.of(requests))
        return changes

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
        views = {patch.view for patch in step.patches}
        names_view = len(self._views) > 1 and len(views) == 1
        return f"{step.label}, {self._views[views.pop()].name}" if names_view else step.label


def restore(
    bases: Sequence[Basis], current_looks: Sequence[Floats], store: Store
) -> tuple[Canvases, SessionRequests]:
    """Return the canvases and the requests after the steps of the store."""
    applied = store.steps[: store.position]
    states = [step.fields["after"] for step in applied if "after" in step.fields]
    requests = SessionRequests.of(states[-1]) if states else SessionRequests()
    requests.constraints()
    return Canvases(bases, current_looks, applied), requests
