"""Pictures of lightings of so many lights that no page has their planes.

A draft comes at once: the current look, denoised and of all pixels, times the ratio of the two
lightings in the small picture that follows the brush. It has the edges and textures of the current
look, and soft shadows of lights that change. While lights rest, the exact picture follows.
"""

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from threading import Lock
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis import Basis, as_halves, denoise_mix
from lightpaint.errors import PaintError
from lightpaint.images import block_mean, denoised, resampled
from lightpaint.lighting import LiveView
from lightpaint.paint.background_threads import LatestWork
from lightpaint.paint.layers.canvas import Canvas
from lightpaint.paint.protocol import (
    ANSWER_SLOT,
    AnswerUpdate,
    Message,
    MixedPicture,
    MixLights,
    Paint,
)
from lightpaint.paint.session.picture_table import Picture, look_detail, page_factor
from lightpaint.paint.session_access import StudioLinks
from lightpaint.paint.studio.exact_answers import OutdatedError
from lightpaint.progress import cancellable


class DraftPictures:
    """The drafts of one view, whose details are found once for each current look."""

    def __init__(self) -> None:
        self._known: tuple[LiveView, Floats, dict[int, Floats]] | None = None

    def picture(self, view: Canvas, weights: Doubles, step: int = 1) -> Picture:
        """Return the draft of a lighting as a page has it, (h, w, 3) float16.

        weights: (n, 3). step: return every step-th pixel of every step-th row.
        """
        detail, small = self._detail(view, step), view.live.draft(weights)
        halves = np.empty((*detail.shape[1:], 3), np.float16)
        # Channel by channel: the memory of whole pictures would be new each time.
        for c, of_channel in enumerate(detail):
            light = resampled(small[..., c : c + 1], of_channel.shape)[..., 0]
            light *= of_channel
            halves[..., c] = as_halves(light)
        return halves

    def _detail(self, view: Canvas, step: int) -> Floats:
        """Return the current look over its own average, (3, h, w), as large as a page has it, at
        every step-th pixel of every step-th row.
        """
        live, look = view.live, view.current
        if self._known is None or self._known[0] is not live or self._known[1] is not look:
            detail = look_detail(live, look, view.basis)
            whole = np.ascontiguousarray(detail.transpose(2, 0, 1))
            self._known = live, look, {1: whole}
        details = self._known[2]
        if step not in details:
            details[step] = np.ascontiguousarray(details[1][:, ::step, ::step])
        return details[step]


def checked_weights(basis: Basis, arrays: Mapping[str, npt.NDArray[Any]]) -> Doubles:
    """Return the weights (n, 3) of a message. Raises PaintError for others."""
    weights, expected = arrays.get("weights"), (len(basis.lights), 3)
    if weights is None or weights.shape != expected or not np.isfinite(weights).all():
        raise PaintError(f"weights: expected finite numbers of shape {expected}")
    return np.asarray(weights, np.float64)


@dataclass(frozen=True, eq=False)
class _Mix:
    """A picture that a page asks for. weights: (n, 3), of the lights of `basis`."""

    request: MixLights
    basis: Basis
    weights: Doubles

    def picture(self) -> Picture:
        """Return all pixels, as a page has them, (h, w, 3) float16."""
        basis, weights = self.basis, self.weights
        if not self.request.is_clean:
            mixed = basis.mix(weights)
        elif basis.former is None:
            mixed = denoise_mix(basis, weights)
        else:
            mixed = denoised(basis.mix(weights), basis.features)
        return as_halves(block_mean(mixed, page_factor(basis)))


class MixedPictures:
    """The pictures that the page of a studio asks for."""

    def __init__(self, links: StudioLinks) -> None:
        self._access, self._publisher, self._threads = links
        self._drafts: dict[int, DraftPictures] = {}  # by view
        self._lock = Lock()
        self._wanted: dict[tuple[int, int], _Mix] = {}  # by view and slot
        self._work = LatestWork(self._mix_wanted, self._publisher.publish)
        self._is_working = False
        self.stop = self._work.stop

    def handle(self, message: MixLights, arrays: Mapping[str, npt.NDArray[Any]]) -> list[Message]:
        """Return a draft, and make the exact picture unless more changes follow.

        Raises PaintError for weights of other lights.
        """
        view = self._access.session.views[message.view]
        weights, key = checked_weights(view.basis, arrays), (message.view, message.slot)
        with self._lock:
            self._wanted.pop(key, None)
            if not message.is_live:
                self._wanted[key] = _Mix(message, view.basis, weights)
        if not message.is_live:
            self._begin()
        draft = self._draft(message.view, weights, message.step)
        return [_answer(message, draft, step=message.step)]

    def with_draft(self, paint: Paint, messages: list[Message]) -> list[Message]:
        """Return the messages that answer some paint, with a draft in the answer if it asks for
        one, which would come later, and behind the next paint, if the page asked for it afterwards.

        It has few pixels: the page multiplies the details, which it has, back.
        """
        if not paint.with_draft:
            return messages
        session = self._access.session
        with self._lock:
            self._wanted.pop((paint.view, ANSWER_SLOT), None)
        weights = session.requests.output(session.weights, session.basis.is_fixed)
        draft = as_halves(session.views[paint.view].live.draft(weights))
        return [replace(x, draft=draft) if isinstance(x, AnswerUpdate) else x for x in messages]

    def _draft(self, view: int, weights: Doubles, step: int) -> Picture:
        """Return the draft of a lighting in a view. weights: (n, 3). step: as in a request."""
        drafts = self._drafts.setdefault(view, DraftPictures())
        return drafts.picture(self._access.session.views[view], weights, step)

    def _begin(self) -> None:
        """Have the thread look at what is wanted, and start it for the first."""
        if not self._is_working:
            self._is_working = True
            self._threads.start_low_priority(self._work.run, "mixes")
        self._work.give(self._wanted)

    def _mix_wanted(self, wanted: dict[tuple[int, int], _Mix]) -> None:
        """Publish the exact pictures that are wanted, until there are none."""
        while wanted:
            with self._lock:
                key, mix = next(iter(wanted.items()), (None, None))
            if key is None or mix is None:
                return

            def check(key: tuple[int, int] = key, mix: _Mix = mix) -> None:
                if wanted.get(key) is not mix or not self._publisher.is_open:
                    raise OutdatedError

            with suppress(OutdatedError), cancellable(check):
                picture = mix.picture()
                check()
                self._publisher.publish_made(
                    partial(_answer, mix.request, picture, step=1, is_exact=True)
                )
            with self._lock:
                if wanted.get(key) is mix:
                    del wanted[key]


def _answer(
    request: MixLights, picture: npt.NDArray[np.float16], *, step: int, is_exact: bool = False
) -> MixedPicture:
    return MixedPicture(
        view=request.view,
        slot=request.slot,
        number=request.number,
        step=step,
        is_exact=is_exact,
        data=picture,
    )
