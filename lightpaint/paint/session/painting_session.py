"""A painting in progress, and the lighting that answers it: all state of the painter.

A session handles requests and returns events; it accesses files only through its store, starts no
thread, and renders nothing. Its history is a list of steps, each with the state before it; canvas,
requests and answer follow from them alone, so that undoing, loading and painting in another order
lead to the same bits.

One lighting answers the paintings of all its views. While a brush is down the answer is the answer
of `LiveAnswer`; `accept_solution` takes the exact one, which is what `lightpaint solve` finds for
the exported paintings.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis import Basis, denoise_mix
from lightpaint.colour import ViewTransform
from lightpaint.errors import LightpaintError, PaintError
from lightpaint.lighting import Constraints, Solution, start_weights
from lightpaint.paint import protocol
from lightpaint.paint.layers.canvases import LayeredPaintings
from lightpaint.paint.layers.layer_pixels import selection_patch
from lightpaint.paint.layers.layer_stack import PAINTING_ID, LayerStack
from lightpaint.paint.layers.spent_adjustments import SpentAdjustments, without_copies
from lightpaint.paint.protocol import AnswerUpdate, Message
from lightpaint.paint.references.likeness import open_request
from lightpaint.paint.references.reference_table import ReferenceTable
from lightpaint.paint.session import session_messages
from lightpaint.paint.session.history import Changes, History, Travel, restore
from lightpaint.paint.session.live_answer import (
    DRIVES_S,
    DRIVES_SHARE,
    READING_SHARE,
    LiveAnswer,
    LivePace,
    RequestChange,
    changed_requests,
    move_lights,
    previewed_requests,
    weights_by_name,
)
from lightpaint.paint.session.moved_lights import MovedLights, NoPlaneSource, Placed, PlaneSource
from lightpaint.paint.session.session_planes import SessionPlanes
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.store.database import DamagedError
from lightpaint.paint.store.history_steps import Pixels
from lightpaint.paint.store.session_file import Store, StoredComposition
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.pipeline.job.settings import Settings
from lightpaint.target import Target


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
        history: Its steps, to list and to compare with.
        references: Its reference pictures.
        ground: A number that grows when another look lies under the painting.
        version: A number that grows with every change.
        stroke: Number of the last stroke that arrived.

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
        self.version, self.stroke, self.ground = 0, -1, 0
        self._scene_looks, self._shown_start = list(current_looks), dict[str, Sequence[float]]()
        self._kept_step = 0
        self._answered_step: int | None = None
        try:
            self.views, requests = restore(bases, current_looks, store)
        except (LightpaintError, ArithmeticError, LookupError, TypeError, ValueError):
            if not store.has_file:
                raise
            store.recover()
            self.views, requests = restore(bases, current_looks, store)
        self._moved_lights = MovedLights(plane_source or NoPlaneSource(), bases)
        self._moved_lights.begin(requests.placed, self.views)
        self.live_answer = LiveAnswer(
            self.views.live,
            requests,
            settings=settings,
            constraints=Constraints() if constraints is None else constraints,
            transform=transform,
            lights_of=lambda session_requests: self._moved_lights.lights(session_requests.placed),
        )
        self._drives_pace = LivePace(DRIVES_SHARE, DRIVES_S)
        self._readings_pace = LivePace(READING_SHARE)
        self.history = History(store, self.views, self.live_answer)
        self.references = ReferenceTable(store, transform)
        self._update_answer()
        self.ground = 0  # pages get all pictures of a new session

    @property
    def basis(self) -> Basis:
        """Basis of the first view; its lights are the lights of all views."""
        return self.views[0].basis

    @property
    def bases(self) -> tuple[Basis, ...]:
        """Bases of all views, with every light at its place in the scene."""
        return self._moved_lights.bases

    def bases_at(self, placed: Placed) -> Sequence[Basis]:
        """Return the bases of all views with lights at these places."""
        return self._moved_lights.bases_at(placed)

    @property
    def is_waiting(self) -> bool:
        """True while the lights of a view are not rendered: paint is kept, and answered then."""
        return any(basis.origin.is_plain_look for basis in self.bases)

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
    def is_open(self) -> bool:
        """True while a stroke or a slider is not finished."""
        return self.live_answer.before_slider is not None or self.views.is_open

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
            self._reset_slider()
        try:
            return self._dispatch(message, arrays)
        except DamagedError:
            raise PaintError(self._mend()) from None
        except LightpaintError:
            self._reset_slider()
            raise

    def _dispatch(
        self, message: protocol.Request, arrays: Mapping[str, npt.NDArray[Any]]
    ) -> list[Message]:
        match message:
            case protocol.Paint():
                self._paint(message, arrays)
                return [self._answer_to_edit(is_final=message.is_final)]
            case protocol.ChangeLayers():
                self._change_layers(message)
                return [self._answer_to_edit(is_final=message.is_final)]
            case protocol.Select():
                self._select(message, arrays)
                return [protocol.SelectionUpdate(**self.edit_state)]
            case protocol.DropStroke():
                return self._patch_messages(self._drop_stroke())
        if isinstance(message, Travel):
            return self._travel(message)
        if isinstance(message, protocol.StartFromLamps):
            return self._start_from_lamps(message)
        if isinstance(message, RequestChange):
            return [self._change_requests(message)]
        raise PaintError(f"a session has no answer to {type(message).__name__}")

    def answer_update(self, **fields_of_answer: Any) -> AnswerUpdate:
        """Return the current weights, with further fields, while the brush is down."""
        fields: dict[str, Any] = {"stroke": self.stroke, "exact": False, "version": self.version}
        fields |= {"mode": self.live_answer.mode, "weights": self.weights}
        if "reading" not in fields_of_answer:
            fields["reading"] = self.live_answer.planes_reading()
        return AnswerUpdate(**{**fields, **fields_of_answer})

    def accept_solution(
        self,
        snapshot: SessionSnapshot,
        solution: Solution | None,
        judgement: session_messages.Judgement | None = None,
    ) -> AnswerUpdate | None:
        """Accept the exact answer to `snapshot`, and return it; None if the session has changed
        since.

        judgement: the analysis, once there is one.
        """
        if snapshot.version != self.version:
            return None
        if solution is not None:
            self.live_answer.accept(solution.weights, solution.problem.reduction.mixed_emissions)
            self._keep_answer()
        findings = self.findings
        if judgement is not None:
            findings = judgement.complete(findings)
        fields = {name: getattr(findings, name) for name in protocol.Findings.__dataclass_fields__}
        return self.answer_update(**self.edit_state, **fields, exact=True)

    @property
    def findings(self) -> protocol.Findings:
        """Findings that need no analysis."""
        if self.is_waiting:
            return protocol.Findings(headline=session_messages.WAITING_HEADLINE)
        answer, bases = self.live_answer, [view.basis for view in self.views]
        findings = session_messages.answer_findings(
            bases, self.weights, answer.lamps, answer.mixed_emissions
        )
        if self.is_painted:
            return findings
        return replace(findings, headline=session_messages.unpainted_headline(self.live_answer))

    @property
    def edit_state(self) -> dict[str, Any]:
        """Steps that can be undone, and requests in effect: the fields of `EditState`."""
        return session_messages.edit_state(self.history, self.live_answer, self.views)

    def _answer_to_edit(self, *, is_final: bool) -> Message:
        """Return the answer to paint or a change of layers, with the steps once it is one."""
        if is_final:
            return self.answer_update(**self.edit_state)
        answer = self.live_answer
        drives = self._drives_pace.take(answer.drives) if answer.lamps else None
        reading = self._readings_pace.take(answer.planes_reading)
        return self.answer_update(drives=drives, reading=reading)

    def _patch_messages(self, regions: Changes) -> list[Message]:
        """Return the pixels of changed regions: a message per view, or one if there are none."""
        fields = {
            "version": self.version,
            "stroke": self.stroke,
            "exact": False,
            "mode": self.live_answer.mode,
            "weights": self.weights,
        }
        return session_messages.canvas_patches(self.views, regions, **fields, **self.edit_state)

    # Paint

    def _paint(self, request: protocol.Paint, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
        """Paint pixels of an open stroke, or of one that ends here and becomes a step."""
        layers = self.views.layers
        if request.properties is not None:
            layers = layers.with_layers([request.properties])
        layer = layers[request.layer if request.properties is None else request.properties.id]
        pixels = self.views[request.view].check_pixels(layer, request.region, arrays)
        if request.stroke != self.stroke:
            # Keep a stroke whose end never arrived, as far as it got.
            self.history.close_stroke("stroke")
            self.stroke = request.stroke
        self.views.open_layers(layers)
        self.views.paint(request.view, layer.id, request.region, pixels)
        if request.is_final:
            try:
                self.history.close_stroke(request.label)
            except LightpaintError:
                self._drop_stroke()
                raise
        self._update_answer()

    def _change_layers(self, request: protocol.ChangeLayers) -> None:
        """Change layers, their order, or both. An unfinished change is open, like a stroke."""
        layers = self.views.layers.with_layers(request.layers, request.order)
        copies = {int(number): source for number, source in request.copies.items()}
        for number, source in copies.items():
            if layers[number].kind != self.views.layers[source].kind:
                raise PaintError(f"layer {number} is not a copy of layer {source}")
            if number in self.views.layers.ids:
                raise PaintError(f"layer {number} is there already")
        if any(view.is_open for view in self.views):
            self.history.close_stroke("stroke")
        self.views.open_layers(layers)
        for number, source in copies.items():
            self.views.copy_layer(source, number)
        if request.order is not None and PAINTING_ID not in request.order:
            self.views.clear_painting()
        if request.is_final:
            self.history.close_stroke(request.label)
        self._update_answer()

    def _select(self, request: protocol.Select, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
        """Select a part of a view, as a step; an open stroke becomes one before it."""
        selection = self.views[request.view].selection
        patch = selection_patch(selection, request.view, request.region, arrays)
        if self.views.is_open:
            self.history.close_stroke("stroke")
            self._update_answer()
        if patch is not None:
            self.history.append_selection(request.label, patch)
            self._keep_answer()

    def _drop_stroke(self) -> Changes:
        """Drop the open stroke; return its views and regions."""
        regions = self.views.drop()
        self._update_answer()
        return regions

    # Constraints and places of lights

    def _change_requests(self, message: RequestChange) -> Message:
        is_move = isinstance(message, protocol.MoveLights)
        if isinstance(message, protocol.MoveLights) and not message.poses:
            self._reset_slider()
            return self.answer_update(poses=dict(self.requests.poses))
        lights, weights = self.basis.lights, self.weights
        label, requests = changed_requests(self.requests, lights, message, weights)
        if is_move:
            self._moved_lights.check(requests.placed)
        if getattr(message, "is_final", True):
            return self._append_requests(label, requests)
        self._move_slider(requests)
        return self.answer_update(**({"poses": dict(requests.poses)} if is_move else {}))

    def _start_from_lamps(self, message: protocol.StartFromLamps) -> list[Message]:
        """Start from the lamps as they are, which answer all adjustments, or from the scene again,
        over which these apply: one step.
        """
        earlier = dict(self.requests.spent)
        lights = self.basis.lights
        label, requests = changed_requests(self.requests, lights, message, self.weights)
        self.live_answer.check(requests)
        self.history.close_stroke("stroke")
        spent = SpentAdjustments(without_copies(self.views.layers, earlier))
        if message.is_on:
            spent = SpentAdjustments.of(self.views)
            requests = replace(requests, spent=(*earlier.items(), *spent.copies.items()))
        changes = self.history.replace_all(spent.layers, spent.patches, requests, label)
        self._update_answer()
        return self._patch_messages(changes)

    def hang_lights(self, label: str, placed: Placed) -> list[Message]:
        """Move lights and add others, by name: one step. Raises LightpaintError if refused.

        placed: poses of existing lights; full descriptions of new ones, as in `added`.
        """
        self._reset_slider()
        known_poses = {name: values for name, values in placed.items() if name in self.basis.names}
        requests = move_lights(self.requests, self.basis.lights, known_poses)
        requests = requests.with_added(
            {k: values for k, values in placed.items() if k not in known_poses}
        )
        self._moved_lights.check(requests.placed)
        return [self._append_requests(label, requests)]

    def _append_requests(self, label: str, requests: SessionRequests) -> Message:
        """Set requests, as a step. The answer stays if only the master dimmer has changed."""
        before = self.live_answer.requests_at_rest
        is_answered = not self.is_open and replace(before, master=requests.master) == requests
        self.history.append_requests(label, requests)
        if is_answered:
            self.version += 1
            self._keep_answer()
        else:
            self._update_answer()
        return self.answer_update(**self.edit_state)

    def _move_slider(self, requests: SessionRequests) -> None:
        """Set requests while a slider or a light moves; nothing is stored."""
        self.live_answer.move_slider(requests)
        self._update_answer()

    def _reset_slider(self) -> None:
        """Reset a slider that still moves."""
        if self.live_answer.reset_slider():
            self._update_answer()

    # Steps

    def _travel(self, request: Travel) -> list[Message]:
        """Go to another state of the session, and return the pixels that changed."""
        if self.views.is_open:
            self.history.close_stroke("stroke")
            self._update_answer()
        start = self.store.position
        match request:
            case protocol.Undo() | protocol.Redo():
                changes = self.history.move(-1 if isinstance(request, protocol.Undo) else +1)
            case protocol.GoToStep():
                changes = self.history.go_to(request.step)
            case protocol.ClearPainting() | protocol.StartOver():
                return self._clear(keep_requests=isinstance(request, protocol.ClearPainting))
            case protocol.ApplyPreset() | protocol.LookLike():
                changes, label = open_request(self.views, request, self.references)
                self.history.close_stroke(label)
        if not self.history.has_only_selected_since(start):
            self._update_answer()
        return self._patch_messages(changes)

    def _clear(self, *, keep_requests: bool) -> list[Message]:
        """Delete all layers and paint, and the requests too if not kept: one step."""
        requests = self.live_answer.requests_at_rest if keep_requests else SessionRequests()
        label = "clear painting" if keep_requests else "start over"
        return self.load({}, requests, label, layers=LayeredPaintings(LayerStack(), {}))

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
            if layers.view is None:
                requests = requests.with_spent_as(layers.new_ids(self.views))
            stack, patches = layers.patches(self.views)
        elif paintings:
            requests = requests.with_spent_as({})
            stack, patches = LayerStack(), self.views.replacement_patches(paintings)
        else:
            stack, patches = self.views.layers, ()
        source = "" if layers is None else layers.source
        changes = self.history.replace_all(stack, patches, requests, label, source)
        self._update_answer()
        if weights is not None:
            lights = self.views[0].basis.lights
            self.live_answer.accept(weights_by_name(weights, names or lights.names, lights))
        return self._patch_messages(changes)

    def _keep_answer(self) -> None:
        """Keep the answer with the last step, for the list of steps."""
        self._answered_step = self.store.last_id
        answer = self.live_answer
        shown = answer.requests_at_rest.output(answer.weights, answer.basis.is_fixed)
        self.history.keep_answer(shown, self.transform)

    def client_left(self, *, with_stroke: bool) -> None:
        """Reset an abandoned slider, when a client leaves or returns.

        with_stroke: whether an open stroke becomes a step.
        """
        is_stroke = with_stroke and self.views.is_open
        if is_stroke:  # stored before the solve, which may be abandoned
            self.history.close_stroke("stroke")
        if self.live_answer.reset_slider() or is_stroke:
            self._update_answer()

    # The session file

    def compositions(self) -> tuple[int, list[Floats], list[StoredComposition]] | None:
        """Return what a session file keeps to open sooner, as `Store.put_compositions` takes it.

        None while something is open, if that is kept already, or if there are no layers.
        """
        step = self.store.last_id
        if self.is_open or self.views.layers == LayerStack() or step == self._kept_step:
            return None
        self._kept_step = step
        return step, [x.current for x in self.views], [x.composition() for x in self.views]

    def _mend(self) -> str:
        """Continue with the readable part of a file that turned out to be damaged.

        Returns the losses in one line. Raises PaintError if recovery is impossible.
        """
        losses = self.store.recover()
        self.views.rebuild(self.store.steps[: self.store.position])
        self.live_answer.set_views(self.views.live)
        self._update_answer()
        return losses

    # Planes

    def improve(self, bases: Sequence[Basis], current_looks: Sequence[Floats]) -> None:
        """Replace the bases by ones of more samples, with the same lights and sizes.

        An open stroke stays open.
        """
        moved = self._moved_lights.improve(bases, self.live_answer.requests.placed)
        try:
            self.views.improve(moved, current_looks)
        except DamagedError:  # the store remarks on it
            self._mend()
            self.views.improve(moved, current_looks)
        self._scene_looks, self._shown_start = list(current_looks), {}
        self.live_answer.set_views(self.views.live)
        ground = self.ground
        self._update_answer()
        self.ground = ground  # pages get all pictures of new bases

    def set_measured_planes(self, planes: SessionPlanes) -> None:
        """Meet the wishes for measured planes from now on.

        Raises LightpaintError, and changes nothing then, if no answer can.
        """
        self.live_answer.set_planes(planes)
        self._update_answer()

    def renew_planes(self, names: Sequence[str]) -> None:
        """Take the planes of moved lights again after they have been rendered."""
        placed = self.live_answer.requests.placed
        self._moved_lights.renew(names, placed, self.views, self.live_answer)
        self._update_answer()

    def _update_answer(self) -> None:
        self.version += 1
        self._moved_lights.follow(self.live_answer.requests.placed, self.views, self.live_answer)
        self._follow_start()
        is_slider = self.live_answer.before_slider is not None
        if not self.is_waiting:
            self.live_answer.solve(while_painting=self.views.is_open and not is_slider)
        if not self.is_open and self._answered_step != self.store.last_id:
            self._keep_answer()

    def _follow_start(self) -> None:
        """Lay the look of the lighting to start from under the painting, unless it is there."""
        start = dict(self.live_answer.requests.start)
        if start == self._shown_start:
            return
        self._shown_start = start
        bases, looks = [view.basis for view in self.views], self._scene_looks
        if start:
            weights = start_weights(self.live_answer.constraints().start, bases[0].lights)
            looks = [denoise_mix(basis, weights) for basis in bases]
        self.views.improve(bases, looks)
        self.live_answer.set_views(self.views.live)
        self.ground += 1
