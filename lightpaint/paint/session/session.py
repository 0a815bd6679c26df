"""A painting in progress, and the lighting that answers it: all state of the painter.

A session handles requests and returns events; it accesses files only through its store, starts no
thread, and renders nothing. Its history is a list of steps, each with the state before it; canvas,
requests and answer follow from them alone, so that undoing, loading and painting in another order
lead to the same bits.

One lighting answers the paintings of all its views. While a brush is down the answer is that of
`LiveAnswer`; `accept_solution` takes the exact one, which is what `lightpaint solve` finds for the
exported paintings.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import LightpaintError, PaintError
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.solution import Solution
from lightpaint.paint import protocol
from lightpaint.paint.layers.canvases import LayeredPaintings
from lightpaint.paint.protocol import AnswerUpdate, Message
from lightpaint.paint.session.answer_messages import Judgement, answer_findings
from lightpaint.paint.session.edit_messages import canvas_patches, edit_state, unpainted_headline
from lightpaint.paint.session.history import Changes, Travel
from lightpaint.paint.session.moved_lights import NoPlaneSource, Placed, PlaneSource
from lightpaint.paint.session.request_changes import (
    RequestChange,
    changed_requests,
    move_lights,
    previewed_requests,
)
from lightpaint.paint.session.session_edits import SessionEdits
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.store.canvas_pixels import Pixels
from lightpaint.paint.store.database import DamagedError
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.paint.store.store import Store
from lightpaint.pipeline.job.settings import Settings
from lightpaint.target.target import Target


class Session:
    """A person's painting of one view, or of several.

    Args:
        bases: Planes of the lights in each view, which may get better (`improve`).
        current_looks: (h, w, 3) linear, the current look of each, denoised: the empty canvas.
        store: Keeps steps and looks.
        settings: Defaults of settings that the session does not set.
        transform: View transform to paint through.
        constraints: On the lights, from before the session began.
        plane_source: Makes the planes of moved lights; without one, no light can move.

    Attributes:
        views: Canvas of each view.
        live_answer: Requests, and the last answer.
        bases_at: Returns the bases of all views with lights at other places, rendered or estimated.
        history: Its steps, to list and to compare with.
        references: Its reference pictures.
        compositions: Returns what `Store.put_compositions` keeps; None if there is nothing new.

    Raises:
        PaintError: If the store is of something else.
    """

    def __init__(
        self,
        bases: Sequence[Basis],
        current_looks: Sequence[Floats],
        store: Store,
        *,
        settings: Settings,
        transform: ViewTransform,
        constraints: Constraints | None = None,
        plane_source: PlaneSource | None = None,
    ) -> None:
        self.store, self.transform = store, transform
        self._edits = SessionEdits(
            bases,
            current_looks,
            store,
            settings=settings,
            transform=transform,
            constraints=constraints or Constraints(),
            plane_source=plane_source or NoPlaneSource(),
        )
        self.views, self.live_answer = self._edits.views, self._edits.live_answer
        self.bases_at = self._edits.bases_at
        self.history, self.compositions = self._edits.history, self._edits.compositions
        self.references = self._edits.references

    @property
    def version(self) -> int:
        """A number that grows with every change."""
        return self._edits.version

    @property
    def ground(self) -> int:
        """A number that grows when another look lies under the painting."""
        return self._edits.ground

    @property
    def basis(self) -> Basis:
        """Basis of the first view; its lights are those of all views."""
        return self.views[0].basis

    @property
    def bases(self) -> tuple[Basis, ...]:
        """Bases of all views, with every light at its place in the scene."""
        return self._edits.bases

    @property
    def requests(self) -> SessionRequests:
        """Requests in effect."""
        return self.live_answer.requests

    @property
    def weights(self) -> Doubles:
        """(n, 3), the last answer."""
        return self.live_answer.weights

    @property
    def is_painted(self) -> bool:
        """True if any pixel counts."""
        return self.views.is_painted

    @property
    def stroke(self) -> int:
        """Number of the last stroke that arrived."""
        return self._edits.stroke

    @property
    def is_open(self) -> bool:
        """True while a stroke or a slider is not finished."""
        return self._edits.is_open

    def target(self, view: int = 0) -> Target | None:
        """Return a copy of a painting as a target; None if nothing is painted.

        Solved elsewhere it has the same answer: a literal painting is light, painted over nothing.
        """
        name = "painting" if len(self.views) == 1 else f"painting {self.views[view].name}"
        is_sketch = not self.live_answer.fit.literal
        return self.views[view].target(name, self.transform, is_sketch=is_sketch)

    def snapshot(self, requests: SessionRequests | None = None) -> SessionSnapshot:
        """Return the paintings and `requests`, by default those in effect."""
        live_answer, bases = self.live_answer, tuple(view.basis for view in self.views)
        effective = requests or live_answer.requests
        targets = tuple(self.target(k) for k in range(len(bases)))
        options = live_answer.settings(effective), live_answer.constraints(effective)
        return SessionSnapshot(self.version, bases, targets, effective, *options, self.transform)

    def preview_requests(self, change: protocol.Preview) -> SessionRequests:
        """Return the requests after a change. Raises LightpaintError if it is impossible."""
        requests = previewed_requests(self.requests, self.basis.lights, change)
        self.live_answer.check(requests)
        return requests

    # Requests and answers

    def handle(
        self, message: protocol.Request, arrays: Mapping[str, npt.NDArray[Any]]
    ) -> list[Message]:
        """Handle a request. Raises LightpaintError if refused; nothing has changed then.

        A moving slider is reset before any other request, and if its last value is refused. Of a
        damaged file, the session continues with the readable part.
        """
        sliders = protocol.ConstrainLight | protocol.ConstrainLights | protocol.MoveLights
        if not isinstance(message, sliders):
            self._edits.reset_slider()
        try:
            return self._dispatch(message, arrays)
        except DamagedError:
            raise PaintError(self._edits.mend()) from None
        except LightpaintError:
            self._edits.reset_slider()
            raise

    def _dispatch(
        self, message: protocol.Request, arrays: Mapping[str, npt.NDArray[Any]]
    ) -> list[Message]:
        match message:
            case protocol.Paint():
                self._edits.paint(message, arrays)
                return [self._answer_to_edit(is_final=message.is_final)]
            case protocol.ChangeLayers():
                self._edits.change_layers(message)
                return [self._answer_to_edit(is_final=message.is_final)]
            case protocol.Select():
                self._edits.select(message, arrays)
                return [protocol.SelectionUpdate(**self.edit_state)]
            case protocol.DropStroke():
                return self._patch_messages(self._edits.drop_stroke())
        if isinstance(message, Travel):
            return self._patch_messages(self._edits.travel(message))
        if isinstance(message, RequestChange):
            return [self._change_requests(message)]
        raise PaintError(f"a session has no answer to {type(message).__name__}")

    def answer_update(self, **fields_of_answer: Any) -> AnswerUpdate:
        """Return the current weights, with further fields, while the brush is down."""
        fields = {"stroke": self.stroke, "exact": False, "version": self.version}
        mode, weights = self.live_answer.mode, self.weights
        return AnswerUpdate(**{**fields, "mode": mode, "weights": weights, **fields_of_answer})

    def accept_solution(
        self,
        snapshot: SessionSnapshot,
        solution: Solution | None,
        judgement: Judgement | None = None,
    ) -> AnswerUpdate | None:
        """Accept the exact answer to `snapshot`, and return it; None if the session has changed
        since.

        judgement: the analysis, once there is one.
        """
        if snapshot.version != self.version:
            return None
        if solution is not None:
            self.live_answer.weights = solution.weights
            self._edits.keep_answer()
        findings = self.findings
        if judgement is not None:
            findings = judgement.complete(findings)
        fields = {name: getattr(findings, name) for name in protocol.Findings.__dataclass_fields__}
        return self.answer_update(**self.edit_state, **fields, exact=True)

    @property
    def findings(self) -> protocol.Findings:
        """Findings that need no analysis."""
        findings = answer_findings([view.basis for view in self.views], self.weights)
        if self.is_painted:
            return findings
        return replace(findings, headline=unpainted_headline(self.live_answer))

    @property
    def edit_state(self) -> dict[str, Any]:
        """Steps that can be undone, and requests in effect: the fields of `EditState`."""
        return edit_state(self._edits.history, self.live_answer, self.views)

    def improve(self, bases: Sequence[Basis], current_looks: Sequence[Floats]) -> None:
        """Replace the bases by ones of more samples, with the same lights and sizes.

        An open stroke stays open.
        """
        self._edits.improve(bases, current_looks)

    def renew_planes(self, names: Sequence[str]) -> None:
        """Take the planes of moved lights again after they have been rendered."""
        self._edits.renew_planes(names)

    def client_left(self, *, with_stroke: bool) -> None:
        """Close what is open, as `SessionEdits.close_open`, when a client leaves or returns."""
        self._edits.close_open(with_stroke=with_stroke)

    def load(
        self,
        paintings: Mapping[int, Pixels],
        requests: SessionRequests,
        label: str,
        weights: Doubles | None = None,
        *,
        names: Sequence[str] | None = None,
        layers: LayeredPaintings | None = None,
    ) -> list[Message]:
        """Replace the paintings, by view, and the requests: one step.

        weights, names, layers: as in `SessionEdits.replace_all`.
        """
        changes = self._edits.replace_all(
            paintings, requests, label, weights, names=names, layers=layers
        )
        return self._patch_messages(changes)

    def _change_requests(self, message: RequestChange) -> Message:
        is_move = isinstance(message, protocol.MoveLights)
        if isinstance(message, protocol.MoveLights) and not message.poses:
            self._edits.reset_slider()
            return self.answer_update(poses=dict(self.requests.poses))
        lights, weights = self.basis.lights, self.weights
        label, requests = changed_requests(self.requests, lights, message, weights)
        if is_move:
            self._edits.check_places(requests.placed)
        if getattr(message, "is_final", True):
            return self._append_requests(label, requests)
        self._edits.move_slider(requests)
        return self.answer_update(**({"poses": dict(requests.poses)} if is_move else {}))

    def hang_lights(self, label: str, placed: Placed) -> list[Message]:
        """Move lights and add others, by name: one step. Raises LightpaintError if refused.

        placed: poses of existing lights; full descriptions of new ones, as in `added`.
        """
        self._edits.reset_slider()
        known_poses = {name: values for name, values in placed.items() if name in self.basis.names}
        requests = move_lights(self.requests, self.basis.lights, known_poses)
        requests = requests.with_added(
            {k: values for k, values in placed.items() if k not in known_poses}
        )
        self._edits.check_places(requests.placed)
        return [self._append_requests(label, requests)]

    def _append_requests(self, label: str, requests: SessionRequests) -> Message:
        """Set requests, as a step."""
        self._edits.append_requests(label, requests)
        return self.answer_update(**self.edit_state)

    def _answer_to_edit(self, *, is_final: bool) -> Message:
        """Return the answer to paint or a change of layers, with the steps once it is one."""
        return self.answer_update(**(self.edit_state if is_final else {}))

    def _patch_messages(self, regions: Changes) -> list[Message]:
        """Return the pixels of changed regions: a message per view, or one if there are none."""
        fields = {
            "version": self.version,
            "stroke": self.stroke,
            "exact": False,
            "mode": self.live_answer.mode,
            "weights": self.weights,
        }
        return canvas_patches(self.views, regions, **fields, **self.edit_state)
