"""The edits of a session: paint, layers, requests and steps, each followed by the answer."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.denoised_mixes import denoise_mix
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import LightpaintError, PaintError
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.start_lighting import start_weights
from lightpaint.paint import protocol
from lightpaint.paint.layers.canvases import LayeredPaintings
from lightpaint.paint.layers.layer_stack import PAINTING_ID, LayerStack
from lightpaint.paint.layers.selection import selection_patch
from lightpaint.paint.references.likeness_layers import open_request
from lightpaint.paint.references.reference_table import ReferenceTable
from lightpaint.paint.session.history import Changes, History, Travel, restore
from lightpaint.paint.session.live_answer import LiveAnswer, weights_by_name
from lightpaint.paint.session.moved_lights import MovedLights, Placed, PlaneSource
from lightpaint.paint.store.canvas_pixels import Pixels
from lightpaint.paint.store.database import DamagedError
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.paint.store.store import Store, StoredComposition
from lightpaint.pipeline.job.settings import Settings


class SessionEdits:
    """The canvases, requests and steps of a session, and the answer that follows each change.

    Args: as those of `Session`.

    Attributes:
        views: Canvas of each view.
        live_answer: Requests, and the last answer.
        history, references: The steps, and the reference pictures.
        ground: A number that grows when another look lies under the painting.
        version: A number that grows with every change.
        stroke: Number of the last stroke that arrived.
    """

    def __init__(
        self,
        bases: Sequence[Basis],
        current_looks: Sequence[Floats],
        store: Store,
        *,
        settings: Settings,
        transform: ViewTransform,
        constraints: Constraints,
        plane_source: PlaneSource,
    ) -> None:
        self.version, self.stroke, self.ground = 0, -1, 0
        self._scene_looks, self._shown_start = list(current_looks), dict[str, Sequence[float]]()
        self._store, self._transform, self._kept_step = store, transform, 0
        self._answered_step: int | None = None
        try:
            self.views, requests = restore(bases, current_looks, store)
        except (LightpaintError, ArithmeticError, LookupError, TypeError, ValueError):
            if not store.has_file:
                raise
            store.recover()
            self.views, requests = restore(bases, current_looks, store)
        self._moved_lights = MovedLights(plane_source, bases)
        self._moved_lights.begin(requests.placed, self.views)
        self.live_answer = LiveAnswer(
            self.views.live,
            requests,
            settings=settings,
            constraints=constraints,
            transform=transform,
            lights_of=lambda session_requests: self._moved_lights.lights(session_requests.placed),
        )
        self.history = History(store, self.views, self.live_answer)
        self.references = ReferenceTable(store, transform)
        self._update_answer()
        self.ground = 0  # pages get all pictures of a new session

    @property
    def bases(self) -> tuple[Basis, ...]:
        """Bases of all views, with every light at its place in the scene."""
        return self._moved_lights.bases

    def bases_at(self, placed: Placed) -> Sequence[Basis]:
        """Return the bases of all views with lights at these places."""
        return self._moved_lights.bases_at(placed)

    @property
    def is_open(self) -> bool:
        """True while a stroke or a slider is not finished."""
        return self.live_answer.before_slider is not None or self.views.is_open

    def check_places(self, placed: Placed) -> None:
        """Raise LightpaintError for places that these lights cannot have."""
        self._moved_lights.check(placed)

    # Paint

    def paint(self, request: protocol.Paint, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
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
                self.drop_stroke()
                raise
        self._update_answer()

    def change_layers(self, request: protocol.ChangeLayers) -> None:
        """Change layers, their order, or both. An unfinished change is open, like a stroke."""
        layers = self.views.layers.with_layers(request.layers, request.order)
        copies = {int(number): source for number, source in request.copies.items()}
        for number, source in copies.items():
            if layers[number].kind != self.views.layers[source].kind:
                raise PaintError(f"layer {number} is no copy of layer {source}")
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

    def select(self, request: protocol.Select, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
        """Select a part of a view, as a step; an open stroke becomes one before it."""
        selection = self.views[request.view].selection
        patch = selection_patch(selection, request.view, request.region, arrays)
        if self.views.is_open:
            self.history.close_stroke("stroke")
            self._update_answer()
        if patch is not None:
            self.history.append_selection(request.label, patch)
            self.keep_answer()

    def drop_stroke(self) -> Changes:
        """Drop the open stroke; return its views and regions."""
        regions = self.views.drop()
        self._update_answer()
        return regions

    # Steps

    def travel(self, request: Travel) -> Changes:
        """Go to another state of the session, and return the changes."""
        if self.views.is_open:
            self.history.close_stroke("stroke")
            self._update_answer()
        start = self._store.position
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
        return changes

    def _clear(self, *, keep_requests: bool) -> Changes:
        """Delete all layers and paint, and the requests too if not kept: one step."""
        requests = self.live_answer.requests_at_rest if keep_requests else SessionRequests()
        label = "clear painting" if keep_requests else "start over"
        return self.replace_all({}, requests, label, layers=LayeredPaintings(LayerStack(), {}))

    def keep_answer(self) -> None:
        """Keep the answer with the last step, for the list of steps."""
        self._answered_step = self._store.last_id
        answer = self.live_answer
        shown = answer.requests_at_rest.output(answer.weights, answer.basis.is_fixed)
        self.history.keep_answer(shown, self._transform)

    def append_requests(self, label: str, requests: SessionRequests) -> None:
        """Set requests, as a step. The answer stays if only the master dimmer has changed."""
        before = self.live_answer.requests_at_rest
        is_answered = not self.is_open and replace(before, master=requests.master) == requests
        self.history.append_requests(label, requests)
        if is_answered:
            self.version += 1
            self.keep_answer()
        else:
            self._update_answer()

    def replace_all(
        self,
        paintings: Mapping[int, Pixels],
        requests: SessionRequests,
        label: str,
        weights: Doubles | None = None,
        *,
        names: Sequence[str] | None = None,
        layers: LayeredPaintings | None = None,
    ) -> Changes:
        """Replace the paintings, by view, and the requests: one step.

        weights: (n, 3), the answer that was kept with them, of lights with these names. It shows
        until the exact one is found; without it the solve starts at the answer to the previous
        painting. layers: those that come to these paintings; without them each painting becomes a
        layer's pixels as it is.
        """
        self.reset_slider()
        self._moved_lights.check(requests.placed)
        self.live_answer.check(requests)
        if self.views.is_open:
            self.drop_stroke()
        if layers is not None:
            stack, patches = layers.patches(self.views)
        elif paintings:
            stack, patches = LayerStack(), self.views.replacement_patches(paintings)
        else:
            stack, patches = self.views.layers, ()
        source = "" if layers is None else layers.source
        changes = self.history.replace_all(stack, patches, requests, label, source)
        self._update_answer()
        if weights is not None:
            lights = self.views[0].basis.lights
            self.live_answer.weights = weights_by_name(weights, names or lights.names, lights)
        return changes

    def move_slider(self, requests: SessionRequests) -> None:
        """Set requests while a slider or a light moves; nothing is stored."""
        self.live_answer.move_slider(requests)
        self._update_answer()

    def reset_slider(self) -> None:
        """Reset a slider that still moves."""
        if self.live_answer.reset_slider():
            self._update_answer()

    def close_open(self, *, with_stroke: bool) -> None:
        """Reset an abandoned slider.

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
        step = self._store.last_id
        if self.is_open or self.views.layers == LayerStack() or step == self._kept_step:
            return None
        self._kept_step = step
        return step, [x.current for x in self.views], [x.composition() for x in self.views]

    def mend(self) -> str:
        """Continue with the readable part of a file that turned out to be damaged.

        Returns the losses in one line. Raises PaintError if recovery is impossible.
        """
        losses = self._store.recover()
        self.views.rebuild(self._store.steps[: self._store.position])
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
            self.mend()
            self.views.improve(moved, current_looks)
        self._scene_looks, self._shown_start = list(current_looks), {}
        self.live_answer.set_views(self.views.live)
        ground = self.ground
        self._update_answer()
        self.ground = ground  # pages get all pictures of new bases

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
        self.live_answer.solve(while_painting=self.views.is_open and not is_slider)
        if not self.is_open and self._answered_step != self._store.last_id:
            self.keep_answer()

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
