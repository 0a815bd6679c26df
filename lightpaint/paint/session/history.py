"""The history of a session: steps, and their changes of canvases and requests."""

import time
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis import Basis
from lightpaint.colour import ViewTransform
from lightpaint.errors import NothingToUndoError, PaintError
from lightpaint.paint import protocol
from lightpaint.paint.layers.canvases import Canvases
from lightpaint.paint.layers.layer_pixels import put_selection
from lightpaint.paint.layers.layer_stack import LayerStack
from lightpaint.paint.protocol import HistoryInfo, StepInfo, StepList
from lightpaint.paint.session.live_answer import LiveAnswer
from lightpaint.paint.session.picture_table import display_thumbnail
from lightpaint.paint.store.database import DamagedError
from lightpaint.paint.store.history_steps import Patch, Region, Step
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.paint.store.stored_arrays import StepAnswer

#: A step becomes a milestone this many steps after the last one.
STEPS_BETWEEN = 20

#: Seconds without a step before which the last step is a milestone: a person paused there.
PAUSE_SECONDS = 300.0

#: Number of steps listed to a page, backwards and forwards.
LISTED_STEPS = 50

#: Approximate pixels of the longer side of a step's picture.
PICTURE_SIDE = 96

#: Number of steps after stored compositions that are repeated on them; after more, all is composed.
MAX_REPEATED_STEPS = 32

#: Bytes of pixels that are kept while a file is checked for damage, so that they are read once.
MAX_KEPT_BYTES = 2**28

#: Requests to go to another state, earlier, later or new.
Travel = (
    protocol.Undo
    | protocol.Redo
    | protocol.GoToStep
    | protocol.ClearPainting
    | protocol.StartOver
    | protocol.ApplyPreset
    | protocol.LookLike
)

#: Views, and the region of each that changed.
Changes = Sequence[tuple[int, Region]]


def find_milestones(steps: Sequence[Step]) -> frozenset[int]:
    """Return the indices of the steps that are milestones.

    These are the last step before a pause, the last before everything was replaced (a look loaded,
    a new start), and, where there is neither, every `STEPS_BETWEEN`th.
    """
    milestones, last = set(), -1
    for k, (step, following) in enumerate(pairwise(steps)):
        is_pause = (
            step.stamp is not None
            and following.stamp is not None
            and following.stamp - step.stamp >= PAUSE_SECONDS
        )
        if is_pause or following.kind == "look_loaded" or k - last >= STEPS_BETWEEN:
            milestones.add(k)
            last = k
    return frozenset(milestones)


class History:
    """The steps of a session, each with the state before it. Nothing is solved here.

    store: keeps the steps. views: the canvases that they paint on. live_answer: has the requests
    that they set.
    """

    def __init__(self, store: Store, views: Canvases, live_answer: LiveAnswer) -> None:
        self._store, self._views, self._live_answer = store, views, live_answer

    def _append(
        self, kind: str, label: str, fields: Mapping[str, Any], patches: Sequence[Patch] = ()
    ) -> None:
        self._store.append(Step(kind, label, {**fields, "stamp": time.time()}, tuple(patches)))

    def close_stroke(self, label: str) -> None:
        """Append the open stroke, or the open change of the layers, as a step, if there is one."""
        change, patches = self._views.open_change()
        if change or patches:
            fields = {"stack": change} if change else {}
            self._append("stroke" if patches else "layers", label, fields, patches)
        self._views.close()

    def append_selection(self, label: str, patch: Patch) -> None:
        """Select a part of a view, as a step."""
        self._append("selection", label, {}, (patch,))
        put_selection(self._views[patch.view].selection, patch, is_back=False)

    def append_requests(self, label: str, requests: SessionRequests) -> None:
        """Set requests, as a step. Raises LightpaintError for impossible ones."""
        self._live_answer.check(requests)
        self.close_stroke("stroke")
        requests_at_rest = self._live_answer.requests_at_rest
        fields = {"before": requests_at_rest.as_json(), "after": requests.as_json()}
        self._append("requests", label, fields)
        self._live_answer.set_requests(requests)

    def replace_all(
        self,
        layers: LayerStack,
        patches: Sequence[Patch],
        requests: SessionRequests,
        label: str,
        source: str = "",
    ) -> Changes:
        """Replace the layers, their pixels and the requests, as one step. Returns the changes.

        source: digest of the file that they are from, if any.
        """
        replaced_requests, change = self._live_answer.requests, self._views.layers.change_to(layers)
        fields: dict[str, Any] = {
            "before": replaced_requests.as_json(),
            "after": requests.as_json(),
        }
        fields |= {"stack": change} if change else {}
        fields |= {"source": source} if source else {}
        self._append("look_loaded", label, fields, patches)
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
        position, is_back = self._store.position + by, by < 0
        if not 0 <= position <= len(self._store.steps):
            raise NothingToUndoError(f"There is nothing to {'undo' if is_back else 'redo'}.")
        return self._go_to(position)

    def go_to(self, step_id: int) -> Changes:
        """Go to the state after a step, or to the beginning for 0, and return the changes.

        Raises PaintError for a step that does not exist, or one whose pixels are lost.
        """
        ids = (0, *self._store.step_ids)
        if step_id not in ids:
            raise PaintError(
                f"there is no step {step_id}: another took its place after it was undone"
            )
        return self._go_to(ids.index(step_id))

    def _go_to(self, position: int) -> Changes:
        current, is_back = self._store.position, position < self._store.position
        passed = self._store.steps[min(position, current) : max(position, current)]
        if is_back:
            passed.reverse()
        order = -1 if is_back else 1
        patches = [patch for step in passed for patch in step.patches[::order]]
        try:
            patches = _read_patches(patches, is_back=is_back)
        except DamagedError:
            raise PaintError(self._store.recover()) from None
        self._store.move_to(position)
        layers, requests = self._views.layers, None
        for step in passed:
            layers = layers.changed(step.fields.get("stack", {}), is_back=is_back)
            requests = step.fields.get("before" if is_back else "after", requests)
        changes = self._views.move(layers, patches, self._done_steps, is_back=is_back)
        if requests is not None:
            self._live_answer.set_requests(SessionRequests.of(requests))
        return changes

    def has_only_selected_since(self, position: int) -> bool:
        """Return whether selections alone are between a position and the current one."""
        first, last = sorted((position, self._store.position))
        passed = self._store.steps[first:last]
        return bool(passed) and all(step.kind == "selection" for step in passed)

    def picture(self, step_id: int) -> npt.NDArray[np.uint8]:
        """Return the small picture of the answer after a step, (h, w, 3); black if it has none."""
        answer = self._store.answer(step_id)
        return np.zeros((1, 1, 3), np.uint8) if answer is None else answer.picture

    def keep_answer(self, weights: Doubles, transform: ViewTransform) -> None:
        """Keep a lighting with the last step, and a small picture of the view that it changed.

        weights: (n, 3), as shown. transform: to show them through.
        """
        position = self._store.position
        patches = self._store.steps[position - 1].patches if position else ()
        view = self._views[patches[0].view if patches else 0]
        light = view.live.small_picture(weights)
        by_name = dict(zip(view.basis.names, map(tuple, weights.tolist()), strict=True))
        picture = display_thumbnail(light, transform, side=PICTURE_SIDE)
        places = self._live_answer.requests_at_rest.place_key
        self._store.put_answer(StepAnswer(by_name, places, picture))

    def previous_weights(self) -> Doubles:
        """Return the weights (n, 3) of the answer before the last step, as shown.

        Raises PaintError if there is no such step, or if lights have moved since.
        """
        position, ids = self._store.position, (0, *self._store.step_ids)
        if not position:
            raise NothingToUndoError("There is no step before.")
        answer = self._store.answer(ids[position - 1])
        if answer is None:
            raise PaintError("The answer before the last step is not known. Undo shows it.")
        if answer.places != self._live_answer.requests_at_rest.place_key:
            raise PaintError("The last step moved lights. Undo shows how it was before.")
        return answer.weights_of(self._views[0].basis.names)

    def list_steps(self, count: int) -> StepList:
        """Return the last `count` steps, including undone ones."""
        steps, ids = self._store.steps, self._store.step_ids
        first = max(0, len(steps) - count)
        milestones = find_milestones(steps)
        listed = tuple(
            StepInfo(ids[k], self._label(steps[k]), steps[k].stamp, k in milestones)
            for k in range(first, len(steps))
        )
        return StepList(steps=listed, earlier=first, done=self._store.last_id)

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
    stored = store.compositions(current_looks)
    if stored is None or len(applied) - stored[0] > MAX_REPEATED_STEPS:
        return Canvases(bases, current_looks, applied), requests
    position, compositions = stored
    views = Canvases(bases, current_looks, applied[:position], compositions)
    if further := applied[position:]:  # of a process that ended early
        views.repeat(further, applied)
    return views, requests


def _read_patches(patches: Sequence[Patch], *, is_back: bool) -> list[Patch]:
    """Return patches, of which the first have their pixels in memory, on the side that is needed.

    Raises DamagedError if any cannot be read.
    """
    read: list[Patch] = []
    left = MAX_KEPT_BYTES
    for patch in patches:
        pixels = patch.before if is_back else patch.after
        left -= sum(x.nbytes for x in pixels if x is not None)
        kept = Patch(patch.region, pixels, pixels, patch.view, patch.layer)
        read.append(kept if left >= 0 else patch)
    return read
