"""Requests: messages from clients to their session, with arrays beside them.

Clients number their messages (`seq`), and each is answered by one with that number (`reply`), even
in case of an error. A page keeps one stroke in flight, and the newest wins.

Here are those about the connection, the settings and tasks, and the list of all.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from lightpaint.paint.protocol.base import Request

#: Version of this protocol; a page of another version has to reload.
VERSION = 3

#: Widths of final renders in pixels, and their maximum samples per pixel.
MIN_RENDER_WIDTH, MAX_RENDER_WIDTH, MAX_RENDER_SPP = 16, 2**14, 2**16


@dataclass(frozen=True)
class Hello(Request, kind="hello"):
    """The first message of a page, and again after a dropped connection. Answered by `state`, or by
    `waiting` while there is no picture yet; `state` then comes as soon as there is one.

    version: of the protocol that the client speaks.
    """

    version: int


@dataclass(frozen=True)
class ChangeSettings(Request, kind="change_settings"):
    """Settings of the answer, as in `Fit`. Answered by `answer`.

    settings: of hold, space, colors, literal, prefer_current, near, sparse; null for the default
    that follows from the painting. With `ignore_wishes` true, answers need not meet the wishes for
    measuring planes.
    """

    settings: Mapping[str, Any]


@dataclass(frozen=True)
class Preview(Request, kind="preview"):
    """A request to show the effect of a change, before it is made. Answered by `started`, later by
    `previewed`, with small pictures of the answer now and after the change, `before` and `after`
    (h, w, 3) uint8.

    number: of the preview, which the page counts; `previewed` returns it. settings, constraints,
    ties: as in `change_settings`, `constrain_lights` and `tie`; null for unchanged ties. view:
    index of the view.
    """

    number: int
    settings: Mapping[str, Any] = field(default_factory=dict)
    constraints: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    ties: tuple[tuple[str, ...], ...] | None = None
    view: int = 0


@dataclass(frozen=True)
class Export(Request, kind="export"):
    """Write results to a folder of the session, or stop that. Answered by `started`, later by
    `exported`, which names the files written, even if stopped.

    outputs: `target`: a painting of each painted view; `layers`: its layers; `picture`: the
    displayed answer in each view. name: of a new folder in `exports/` for these files; a number
    follows a name that is taken, so that no earlier export is replaced. "" for the folder of the
    session itself, whose earlier files of the same names are replaced. run: false to stop.
    """

    outputs: tuple[Literal["target", "picture", "lighting", "relit", "report", "layers"], ...]
    run: bool = True
    name: str = ""


@dataclass(frozen=True)
class RenderFinal(Request, kind="render_final"):
    """Render the answer of now with the renderer, in the background, into a new folder in
    `renders/`. Answered by `renders`, which follows again whenever a render changes its state.

    name: of the folder; a number follows one that is taken. width: of the picture in pixels; the
    height follows from the scene. spp: samples per pixel. formats: `exr`, linear light as rendered,
    its noise, and denoised; `png`, 16 bits, denoised, through the view and exposure of the scene.
    view: index of the view.
    """

    name: str
    width: int
    spp: int
    formats: tuple[Literal["exr", "png"], ...] = ("exr", "png")
    view: int = 0

    def __post_init__(self) -> None:
        if not MIN_RENDER_WIDTH <= self.width <= MAX_RENDER_WIDTH:
            raise ValueError(f"width is {MIN_RENDER_WIDTH} to {MAX_RENDER_WIDTH} pixels")
        if not 2 <= self.spp <= MAX_RENDER_SPP:
            raise ValueError(f"spp is 2 to {MAX_RENDER_SPP} samples per pixel")
        if not self.formats:
            raise ValueError("formats: expected exr, png or both")


@dataclass(frozen=True)
class StopRender(Request, kind="stop_render"):
    """Stop a final render, which writes nothing then. Answered by `renders`.

    render: its id.
    """

    render: int


@dataclass(frozen=True)
class SwitchConsole(Request, kind="switch_console"):
    """Send the answer to the console from now on, as it follows the brush, or end that. Answered by
    `console`.

    is_on: whether to send.
    """

    is_on: bool


@dataclass(frozen=True)
class BlackOut(Request, kind="black_out"):
    """Take all lamps of the console to 0 until it is switched on again. Answered by `console`."""


@dataclass(frozen=True)
class DropRender(Request, kind="drop_render"):
    """Take a final render that has ended off the list; its files stay. Answered by `renders`.

    render: its id.
    """

    render: int


@dataclass(frozen=True)
class Verify(Request, kind="verify"):
    """Render the answer in a view, or stop that. Answered by `started`, later by `verified`, or by
    `stopped` once the render has ended.

    run: false to stop. view: index of the view.
    """

    run: bool = True
    view: int = 0


@dataclass(frozen=True)
class Explain(Request, kind="explain"):
    """A request for the reasons why a view is not closer to its painting. Answered by `started`,
    later by `explained` and the picture `beyond`.

    view: index of the view.
    """

    view: int = 0


@dataclass(frozen=True)
class TakeOver(Request, kind="take_over"):
    """Take the session over from the page that has it. Answered by `state`."""


@dataclass(frozen=True)
class Fetch(Request, kind="fetch"):
    """A request for a picture, for clients without HTTP. Answered by `fetched`, with the picture as
    its array.

    name: of the picture, as in `resources`.
    """

    name: str


@dataclass(frozen=True)
class Observe(Request, kind="observe"):
    """The first message of an observer: a client that receives lighting, looks and progress, and
    never has the session. It may then send `fetch`, `export` and `propose`, and nothing else.
    Answered by `state` or `waiting`.

    version: as in `hello`.
    """

    version: int
