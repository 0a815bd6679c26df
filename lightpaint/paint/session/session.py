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
from lightpaint.paint.layers.layer import PAINTING_ID
from lightpaint.paint.layers.layer_stack import LayerStack
from lightpaint.paint.layers.layered_paintings import LayeredPaintings
from lightpaint.paint.protocol import AnswerUpdate, Message
from lightpaint.paint.session.answer_messages import Judgement, answer_findings
from lightpaint.paint.session.edit_messages import canvas_patches, edit_state, unpainted_headline
from lightpaint.paint.session.history import History, restore
from lightpaint.paint.session.light_changes import (
    constrain_light,
    constrain_lights,
    move_lights,
    remove_light,
    tie_lights,
)
from lightpaint.paint.session.live_answer import LiveAnswer, weights_by_name
from lightpaint.paint.session.moved_lights import MovedLights, NoPlaneSource, Placed, PlaneSource
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.store.canvas_pixels import Pixels, Region
from lightpaint.paint.store.session_requests import TITLES, SessionRequests
from lightpaint.paint.store.store import Store
from lightpaint.pipeline.job.settings import Settings
from lightpaint.target.target import Target


class Session:
    """A person's painting of one view, or of several.

    Args:
        bases: Planes of the lights in each view, which may get better (`improve`).
        presents: (h, w, 3) linear, the present look of each, denoised: the empty canvas.
        store: Keeps steps and looks.
        settings: Defaults of settings that the session does not set.
        transform: View transform to paint through.
        constraints: On the lights, from before the session began.
        name: Of the painting.
        plane_source: Makes the planes of moved lights; without one, no light can move.

    Attributes:
        views: Canvas of each view.
        live_answer: Requests, and the last answer.
        version: A number that grows with every change.

    Raises:
        PaintError: If the store is of something else.
    """

    def __init__(
        self,
        bases: Sequence[Basis],
        presents: Sequence[Floats],
        store: Store,
        *,
        settings: Settings,
        transform: ViewTransform,
        constraints: Constraints | None = None,
        name: str = "painting",
        plane_source: PlaneSource | None = None,
    ) -> None:
        self.store, self.name, self.transform = store, name, transform
        self.version, self._stroke = 0, -1
        try:
            self.views, requests = restore(bases, presents, store)
        except (LightpaintError, ArithmeticError, LookupError, TypeError, ValueError):
            if not store.has_file:
                raise
            store.recover()
            self.views, requests = restore(bases, presents, store)
        self._moved_lights = MovedLights(plane_source or NoPlaneSource(), bases)
        self._moved_lights.begin(requests.placed, self.views)
        self.live_answer = LiveAnswer(
            self.views.live,
            requests,
            settings=settings,
            constraints=constraints or Constraints(),
            transform=transform,
            lights_of=lambda its: self._moved_lights.lights(its.placed),
        )
        self._history = History(store, self.views, self.live_answer)
        self._update_answer()

    # State

    @property
    def basis(self) -> Basis:
        """Basis of the first view; its lights are those of all views."""
        return self.views[0].basis

    @property
    def bases(self) -> tuple[Basis, ...]:
        """Bases of all views, with every light at its place in the scene."""
        return self._moved_lights.bases

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
        return self._stroke

    @property
    def is_open(self) -> bool:
        """True while a stroke or a slider is not finished."""
        return self.live_answer.before_slider is not None or self.views.is_open

    def target(self, view: int = 0) -> Target | None:
        """Return a copy of a painting as a target; None if nothing is painted.

        Solved elsewhere it has the same answer: a literal painting is light, painted over nothing.
        """
        name = self.name if len(self.views) == 1 else f"{self.name} {self.views[view].name}"
        is_sketch = not self.live_answer.fit.literal
        return self.views[view].target(name, self.transform, is_sketch=is_sketch)

    def snapshot(self, requests: SessionRequests | None = None) -> SessionSnapshot:
        """Return the paintings and `requests`, by default those in effect."""
        live_answer, bases = self.live_answer, tuple(view.basis for view in self.views)
        effective = requests or live_answer.requests
        targets = tuple(self.target(k) for k in range(len(bases)))
        options = (
            live_answer.settings(effective),
            live_answer.constraints(effective),
            self.transform,
        )
        return SessionSnapshot(self.version, bases, targets, effective, *options)

    def preview_requests(self, change: protocol.Preview) -> SessionRequests:
        """Return the requests after a change. Raises LightpaintError if it is impossible."""
        lights = self.basis.lights
        requests = self.requests.with_values(change.settings)
        requests = constrain_lights(requests, lights, change.constraints)
        if change.ties is not None:
            requests = tie_lights(requests, lights, change.ties)
        self.live_answer.check(requests)
        return requests

    # Requests and answers

    def handle(
        self, message: protocol.AnyRequest, arrays: Mapping[str, npt.NDArray[Any]]
    ) -> list[Message]:
        """Handle a request. Raises LightpaintError if refused; nothing has changed then.

        A moving slider is reset before any other request, and if its last value is refused.
        """
        if not isinstance(message, protocol.ConstrainLight | protocol.MoveLights):
            self._reset_slider()
        try:
            return self._dispatch(message, arrays)
        except LightpaintError:
            self._reset_slider()
            raise

    def _dispatch(
        self, message: protocol.AnyRequest, arrays: Mapping[str, npt.NDArray[Any]]
    ) -> list[Message]:
        match message:
            case protocol.Paint():
                return [self._paint(message, arrays)]
            case protocol.ChangeLayers():
                return [self._change_layers(message)]
            case protocol.DropStroke():
                return self._patch_messages(*self._drop_stroke())
            case protocol.Undo():
                return self._move_step(-1)
            case protocol.Redo():
                return self._move_step(+1)
            case protocol.ConstrainLight():
                return [self._constrain_light(message)]
            case protocol.MoveLights():
                return [self._move_lights(message)]
            case protocol.RemoveLight():
                requests = remove_light(self.requests, self.basis.lights, message.name)
                return [self._append_requests(f"remove {message.name}", requests)]
            case protocol.ConstrainLights():
                requests = constrain_lights(self.requests, self.basis.lights, message.constraints)
                return [self._append_requests(", ".join(message.constraints), requests)]
            case protocol.TieLights():
                requests = tie_lights(self.requests, self.basis.lights, message.ties)
                return [self._append_requests("tie", requests)]
            case protocol.ChangeSettings():
                requests = self.requests.with_values(message.settings)
                label = ", ".join(TITLES[key] for key in message.settings)
                return [self._append_requests(label, requests)]
        raise PaintError(f"a session has no answer to {type(message).__name__}")

    def answer_update(self, **fields_of_answer: Any) -> AnswerUpdate:
        """Return the present weights, with further fields, while the brush is down."""
        fields = {"stroke": self._stroke, "exact": False, "version": self.version}
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
        return edit_state(self._history, self.live_answer, self.views)

    def improve(self, bases: Sequence[Basis], presents: Sequence[Floats]) -> None:
        """Replace the bases by ones of more samples, with the same lights and sizes.

        An open stroke stays open.
        """
        moved = self._moved_lights.improve(bases, self.requests.placed)
        self.views.improve(moved, presents)
        self.live_answer.set_views(self.views.live)
        self._update_answer()

    def renew_planes(self, names: Sequence[str]) -> None:
        """Take the planes of moved lights again after they have been rendered."""
        self._moved_lights.renew(names, self.requests.placed, self.views, self.live_answer)
        self._update_answer()

    def client_left(self, *, with_stroke: bool) -> None:
        """Reset an abandoned slider, after the client has left or before it reconnects.

        with_stroke: whether an open stroke becomes a step.
        """
        is_stroke = with_stroke and self.views.is_open
        if is_stroke:  # stored before the solve, which may be abandoned
            self._history.close_stroke("stroke")
        if self.live_answer.reset_slider() or is_stroke:
            self._update_answer()

    def _reset_slider(self) -> None:
        """Reset a slider that still moves."""
        if self.live_answer.reset_slider():
            self._update_answer()

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

        weights: (n, 3), the answer that was kept with them, of lights with these names. It shows
        until the exact one is found; without it the solve starts at the answer to the previous
        painting. layers: those that come to these paintings; without them each painting becomes a
        layer's pixels as it is.
        """
        self._reset_slider()
        self._moved_lights.check(requests.placed)
        self.live_answer.check(requests)
        if self.views.is_open:
            self._drop_stroke()
        if layers is not None:
            stack, patches = layers.patches(self.views)
        elif paintings:
            stack, patches = LayerStack(), self.views.replacement_patches(paintings)
        else:
            stack, patches = self.views.layers, ()
        changes = self._history.replace_all(stack, patches, requests, label)
        self._update_answer()
        if weights is not None:
            lights = self.basis.lights
            self.live_answer.weights = weights_by_name(weights, names or lights.names, lights)
        return self._patch_messages(*changes)

    # Paint

    def _paint(self, request: protocol.Paint, arrays: Mapping[str, npt.NDArray[Any]]) -> Message:
        layers = self.views.layers
        if request.properties is not None:
            layers = layers.with_layers([request.properties])
        layer = layers[request.layer if request.properties is None else request.properties.id]
        pixels = self.views[request.view].check_pixels(layer, request.region, arrays)
        if request.stroke != self._stroke:
            # Keep a stroke whose end never arrived, as far as it got.
            self._history.close_stroke("stroke")
            self._stroke = request.stroke
        self.views.open_layers(layers)
        self.views.paint(request.view, layer.id, request.region, pixels)
        if request.is_final:
            try:
                self._history.close_stroke(request.label)
            except LightpaintError:
                self._drop_stroke()
                raise
        self._update_answer()
        return self.answer_update(**(self.edit_state if request.is_final else {}))

    def _change_layers(self, request: protocol.ChangeLayers) -> Message:
        """Change layers, their order, or both. An unfinished change is open, like a stroke."""
        layers = self.views.layers.with_layers(request.layers, request.order)
        copies = {int(number): source for number, source in request.copies.items()}
        for number, source in copies.items():
            if layers[number].kind != self.views.layers[source].kind:
                raise PaintError(f"layer {number} is no copy of layer {source}")
            if number in self.views.layers.ids:
                raise PaintError(f"layer {number} is there already")
        if any(view.is_open for view in self.views):
            self._history.close_stroke("stroke")
        self.views.open_layers(layers)
        for number, source in copies.items():
            self.views.copy_layer(source, number)
        if request.order is not None and PAINTING_ID not in request.order:
            self.views.clear_painting()
        if request.is_final:
            self._history.close_stroke(request.label)
        self._update_answer()
        return self.answer_update(**(self.edit_state if request.is_final else {}))

    def _drop_stroke(self) -> list[tuple[int, Region]]:
        """Drop the open stroke; return its views and regions."""
        regions = self.views.drop()
        self._update_answer()
        return regions

    # Steps

    def _move_step(self, by: int) -> list[Message]:
        """Move back or forth by one step."""
        if self.views.is_open:
            self._history.close_stroke("stroke")
            self._update_answer()
        changes = self._history.move(by)
        self._update_answer()
        return self._patch_messages(*changes)

    def _constrain_light(self, message: protocol.ConstrainLight) -> Message:
        name, requests = constrain_light(self.requests, self.basis.lights, message)
        if message.is_final:
            return self._append_requests(name, requests)
        # Nothing is stored while a slider moves.
        self.live_answer.move_slider(requests)
        self._update_answer()
        return self.answer_update()

    def _move_lights(self, message: protocol.MoveLights) -> Message:
        requests = move_lights(self.requests, self.basis.lights, message.poses)
        self._moved_lights.check(requests.placed)
        if message.is_final:
            return self._append_requests(f"move {', '.join(message.poses)}", requests)
        # Nothing is stored while a light is dragged.
        self.live_answer.move_slider(requests)
        self._update_answer()
        return self.answer_update(poses=dict(requests.poses))

    def hang_lights(self, label: str, placed: Placed) -> list[Message]:
        """Move lights and add others, by name: one step. Raises LightpaintError if refused.

        placed: poses of existing lights; full descriptions of new ones, as in `added`.
        """
        self._reset_slider()
        there = {name: its for name, its in placed.items() if name in self.basis.names}
        requests = move_lights(self.requests, self.basis.lights, there)
        requests = requests.with_added({k: its for k, its in placed.items() if k not in there})
        self._moved_lights.check(requests.placed)
        return [self._append_requests(label, requests)]

    def _append_requests(self, label: str, requests: SessionRequests) -> Message:
        """Set requests, as a step."""
        self._history.append_requests(label, requests)
        self._update_answer()
        return self.answer_update(**self.edit_state)

    # Answers

    def _update_answer(self) -> None:
        self.version += 1
        self._moved_lights.follow(self.requests.placed, self.views, self.live_answer)
        self.live_answer.solve()

    def _patch_messages(self, *regions: tuple[int, Region]) -> list[Message]:
        """Return the pixels of changed regions: a message per view, or one if there are none."""
        fields = {
            "version": self.version,
            "stroke": self._stroke,
            "exact": False,
            "mode": self.live_answer.mode,
            "weights": self.weights,
        }
        return canvas_patches(self.views, regions, **fields, **self.edit_state)
