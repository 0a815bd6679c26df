"""The views of a painter in a notebook's cells: which has the session, and what stays when saved.

Two outputs, since JupyterLab would build the widget anew each time that an output with it changes.
A style hides the one or the other: while the widget is there, the saved view; without a kernel, the
error message in place of the widget.

The saved view is the last picture, and a mixer. Where a notebook is not trusted, scripts are
removed and the picture remains; elsewhere the mixer of reports replaces it, in a frame of its own,
so that neither its style nor the notebook's reaches the other.
"""

import asyncio
import contextvars
from collections.abc import Callable, Mapping
from threading import Lock, RLock, Timer
from typing import Any
from uuid import uuid4

import numpy as np
from markupsafe import Markup

from lightpaint.basis import Basis
from lightpaint.colour import ViewTransform, to_8_bit
from lightpaint.images import block_mean, fitting_factor
from lightpaint.lighting import Lighting
from lightpaint.paint.background_threads import error_text, error_tone, lower_priority
from lightpaint.paint.message_frames import is_other_version, parse_request
from lightpaint.paint.protocol import Closing, Failure, Hello, Message, TakeOver
from lightpaint.paint.session_access import SessionOwner
from lightpaint.paint.studio.session_studio import Studio
from lightpaint.report import data_uri, html, mixer_assets, mixer_html, target_picture
from lightpaint.target import Target
from lightpaint.viewer import styles

#: Maximum number of pixels in all planes of the mixer: with their scripts these stay below 400 kB.
MAX_PLANE_PIXELS = 44_000

#: Maximum width of the picture in pixels, and of its PNG in bytes, beyond which it is a JPEG.
MAX_PICTURE_WIDTH, MAX_PICTURE_BYTES = 640, 20_000

#: Maximum heights on the screen, in pixels, of the frame and of the mix in it.
FRAME_HEIGHT, MIX_HEIGHT = 690, 320

#: Seconds without a change before the saved view follows.
REST_S = 1.5

#: What a program without widgets shows in place of one: nothing, since the saved view follows.
NO_WIDGET = "<!-- the painter, whose last picture follows -->"

#: For JupyterLab, where the output of a widget is a panel: with the class of widgets it is an error
#: message. The page marks a painter that no kernel has answered.
STYLE = """<style>
.jp-OutputArea-child:has(> .lm-Panel:not(.jupyter-widgets)):not(:has(.is-unanswered))
  + .jp-OutputArea-child:has(.lightpaint-saved),
.jp-OutputArea-child:has(> .jupyter-widgets, .is-unanswered):has(
  + .jp-OutputArea-child .lightpaint-saved) { display: none }
</style>"""


def static_view(
    basis: Basis, lighting: Lighting, target: Target | None, transform: ViewTransform
) -> str:
    """Return a view under a lighting as HTML: a picture, and a mixer that starts from it.

    target: the painting, for the wipe of the mixer; None if nothing is painted.
    """
    light = basis.mix(lighting.weights_for(basis))
    factor = fitting_factor(basis.size, -(-basis.size[1] // MAX_PICTURE_WIDTH))
    pixels = to_8_bit(np.clip(transform.encode(block_mean(light, factor)), 0, 1))
    source = data_uri(pixels, largest_png=MAX_PICTURE_BYTES, quality=85)
    painting = None
    if target is not None:
        painting = target_picture(target, basis.current_look, transform=transform)
    mixer = mixer_html(basis, lighting, painting, transform=transform, max_pixels=MAX_PLANE_PIXELS)
    height, width = basis.size
    page = str(
        html(
            "paint/notebook/static_page",
            mixer=mixer,
            assets=mixer_assets(),
            wipe_style=Markup(styles("viewer/mixer/wipe.css")),
            mix_width=max(1, MIX_HEIGHT * width // height),
            frame_height=FRAME_HEIGHT,
        )
    )
    view = html(
        "paint/notebook/static_view",
        name=basis.origin.sensor or "The scene",
        source=source,
        width=max(width, MIX_HEIGHT),
        # Most quotes in it are double.
        page=Markup(page.replace("&", "&amp;").replace("'", "&#39;")),
    )
    return str(view)


class CellOutput:
    """The outputs of all cells that show one painter.

    render: returns the saved view as HTML; None while there is none. call: calls a function in the
    thread that may publish outputs.
    """

    def __init__(
        self, render: Callable[[], str | None], call: Callable[[Callable[[], None]], None]
    ) -> None:
        self._render, self._call = render, call
        self.id = uuid4().hex
        self._lock = Lock()  # not held during a render, which takes locks of the session
        self._timer: Timer | None = None
        self._changes = 0
        self._text = ""
        self._saved: str | None = None
        self._is_over = False

    def show(self, bundle: tuple[Mapping[str, Any], Mapping[str, Any]], text: str) -> None:
        """Show a painter in the cell that runs.

        bundle: data of the widget by MIME type, and their metadata. text: for a terminal.
        """
        from IPython.display import display

        (data, metadata), self._text, self._saved = bundle, text, self._render()
        widget = {**data, "text/html": NO_WIDGET}
        display(widget, raw=True, metadata=metadata, display_id=self._widget_id)  # type: ignore[no-untyped-call]
        display(self._saved_data(), raw=True, display_id=self.id)  # type: ignore[no-untyped-call]

    def follow(self) -> None:
        """Show a change in the saved view, once none has followed for a while."""
        with self._lock:
            if not self._text or self._is_over:
                return
            if self._timer is not None:
                self._timer.cancel()
            self._changes += 1
            self._timer = Timer(REST_S, self._refresh, [self._changes])
            self._timer.daemon = True
            self._timer.start()

    def end(self) -> None:
        """Remove the widget from its cells, which keep the view of now."""
        saved = self._render() if self._text else None
        with self._lock:
            self._is_over = True
            if self._timer is not None:
                self._timer.cancel()
            self._saved = saved or self._saved
        if self._text:
            _update({"text/plain": self._text, "text/html": NO_WIDGET}, self._widget_id)
            self._publish()

    @property
    def _widget_id(self) -> str:
        return f"{self.id}-widget"

    def _refresh(self, change: int) -> None:
        """Render the saved view in this thread, and publish it if it is another."""
        lower_priority()
        saved = self._render()
        with self._lock:
            if self._is_over or change != self._changes or saved in (None, self._saved):
                return
            self._saved = saved
        self._call(self._publish)

    def _publish(self) -> None:
        _update(self._saved_data(), self.id)

    def _saved_data(self) -> dict[str, str]:
        page = f'<div class="lightpaint-saved" data-painter="{self.id}">{self._saved or ""}</div>'
        return {"text/plain": self._text, "text/html": page + STYLE}


def _update(data: Mapping[str, str], display_id: str) -> None:
    from IPython.display import update_display

    update_display(data, raw=True, display_id=display_id)  # type: ignore[no-untyped-call]


#: Message to a view that does not have the session, or has lost it.
TAKEN = Closing(reason="taken", text="the painter is open at another place")

#: Message numbers of one view, which is view `seq // MESSAGES_PER_VIEW`.
MESSAGES_PER_VIEW = 2**32


class WidgetViews:
    """The places in a notebook that show one painter; the one shown last has the session.

    lock: held while a message is answered. send: sends JSON and buffers to all of them.
    """

    def __init__(
        self, studio: Studio, lock: RLock, send: Callable[[dict[str, Any], list[bytes]], None]
    ) -> None:
        self._studio, self._lock, self._send = studio, lock, send
        self._owner = SessionOwner[int]()

    def receive(self, content: Any, buffers: Any) -> None:
        """Answer a message of a page, even an invalid one."""
        seq = content.get("seq") if isinstance(content, dict) else None
        try:
            answers = self._answer(content, [bytes(x) for x in buffers or ()])
        except Exception as error:  # bugs, too: anywidget would not report them
            answers = [Failure(text=error_text(error), tone=error_tone(error))]
        page = seq // MESSAGES_PER_VIEW if type(seq) is int else None
        for k, message in enumerate(answers):
            self.send(message, seq if k == 0 else None, page=page)

    def _answer(self, content: Any, buffers: list[bytes]) -> list[Message]:
        """Return the answers to a message. Raises LightpaintError."""
        if is_other_version(content):
            text = "lightpaint has been updated: run the cell again"
            return [Closing(reason="version", text=text)]
        seq, request, arrays = parse_request(content, buffers)
        page = seq // MESSAGES_PER_VIEW
        with self._lock:
            if isinstance(request, Hello | TakeOver):
                is_back, displaced = self._owner.give(page)
                if displaced is not None:
                    self.send(TAKEN, page=displaced)
                return [self._studio.greet(is_back=is_back)]
            return self._studio.handle(request, arrays) if page == self._owner.page else [TAKEN]

    def send(self, message: Message, reply: int | None = None, *, page: int | None = None) -> None:
        """Send a message to the page that has the session, or to `page`."""
        address = {"page": self._owner.page if page is None else page}
        self._send(message.content(reply) | address, message.buffers())


class KernelThread:
    """The thread of a notebook's kernel, which sends the messages of all threads.

    It is known by the event loop and context of the cell that runs now; without a loop, as in a
    script, each thread sends its own.
    """

    def __init__(self) -> None:
        self._loop = _running_loop()
        self._context = contextvars.copy_context()

    def call(self, act: Callable[[], None]) -> None:
        """Call `act` soon in the loop, in its context; at once without a loop."""
        if self._loop is None:
            act()
        elif not self._loop.is_closed():
            self._loop.call_soon_threadsafe(act, context=self._context)


def _running_loop() -> asyncio.AbstractEventLoop | None:
    try:
        return asyncio.get_running_loop()
    except RuntimeError:
        return None
