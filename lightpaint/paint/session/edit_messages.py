"""Fields of messages about edits: steps to undo, requests in effect, changed pixels."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.paint.layers.canvas import Canvas
from lightpaint.paint.layers.canvases import Canvases
from lightpaint.paint.layers.layer_stack import Layer
from lightpaint.paint.protocol import (
    CanvasPatch,
    LayerInfo,
    LayerList,
    Message,
    ResolvedFit,
    SelectionInfo,
)
from lightpaint.paint.session.answer_messages import unpainted_text
from lightpaint.paint.session.history import History
from lightpaint.paint.session.live_answer import LiveAnswer
from lightpaint.paint.store.canvas_pixels import Region
from lightpaint.paint.store.session_requests import HOLD_KEYS


def edit_state(history: History, live_answer: LiveAnswer, views: Canvases) -> dict[str, Any]:
    """Return steps that can be undone, requests in effect and layers: the fields of `EditState`."""
    requests, fit = live_answer.requests, live_answer.fit
    return {
        "history": history.info(),
        "constraints": {name: dict(constraints) for name, constraints in requests.lights.items()},
        "ties": requests.ties,
        "settings": dict(requests.values),
        "poses": dict(requests.poses),
        "added_lights": tuple(requests.added),
        "places": requests.place_key,
        "effective_settings": ResolvedFit(fit.space, fit.hold, fit.colors),
        "layers": LayerList(
            tuple(layer_info(layer, views) for layer in views.layers), views.next_layer
        ),
        "master": requests.master,
        "earlier": dict(requests.earlier),
        "kept": requests.kept,
        "is_started": bool(requests.start),
        "selection": SelectionInfo(
            tuple(view.selection.bounds for view in views),
            sum(view.selection.revision for view in views),
        ),
    }


def layer_info(layer: Layer, views: Canvases) -> LayerInfo:
    """Return a layer for clients, with the region of its pixels in each view."""
    pixels = [view.layer(layer.id) for view in views]
    return LayerInfo(
        **vars(layer),
        regions=tuple(one.bounds for one in pixels),
        accents=tuple(view.accent(layer.id) for view in views),
        revision=sum(one.revision for one in pixels),
    )


def layer_picture(layer: Layer, view: Canvas) -> npt.NDArray[np.float32]:
    """Return the pixels of a layer in its region: (rows, columns, 4), colour and coverage; of a
    mask (rows, columns, 1).
    """
    pixels = view.layer(layer.id)
    image, coverage, _ = pixels.part(pixels.bounds)
    mask = coverage[..., None]
    return mask if layer.is_mask else np.concatenate([image, mask], axis=-1)


def unpainted_headline(live_answer: LiveAnswer) -> str:
    """Return the headline while nothing is painted."""
    is_white = live_answer.fit.colors == "white"
    # Constraints from before the session count, too.
    is_other = not np.allclose(live_answer.weights, live_answer.basis.current_weights)
    is_asked = bool(live_answer.requests.lights) or (is_other and not is_white)
    is_moved = bool(live_answer.requests.placed)
    if live_answer.requests.start and not live_answer.requests.lights:
        return unpainted_text(is_asked=False, is_white=False, is_started=True)
    requests = live_answer.requests.lights.values()
    return unpainted_text(
        is_asked=is_asked,
        is_white=is_white,
        is_moved=is_moved,
        is_set=bool(requests) and all(set(x) <= set(HOLD_KEYS) for x in requests),
    )


def canvas_patches(
    canvases: Canvases, regions: Sequence[tuple[int, Region]], **fields: Any
) -> list[Message]:
    """Return the canvases' pixels there: a message for each view, or one for the first if nowhere.

    fields: the further fields of each.
    """
    views = tuple(view for view, _ in regions)
    messages: list[Message] = []
    for view, region in regions or ((0, (0, 0, 0, 0)),):
        image, importance, _ = canvases[view].pixels(region)
        messages.append(
            CanvasPatch(
                region=region,
                view=view,
                views=views,
                image=image,
                importance=importance,
                **fields,
            )
        )
    return messages
