"""Requests: messages from clients to their session, with arrays beside them.

Clients number their messages (`seq`), and each is answered by one with that number (`reply`), even
in case of an error. A page keeps one stroke in flight, and the newest wins.

Here are those about the connection, the settings and tasks, and the list of all.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, get_args

from lightpaint.paint.protocol.base import Message
from lightpaint.paint.protocol.light_requests import (
    AddLight,
    ConstrainLight,
    ConstrainLights,
    MoveLights,
    PlaceLights,
    PointLight,
    RemoveLight,
    SetMaster,
    ShowRig,
    StartFromLamps,
    TieLights,
)
from lightpaint.paint.protocol.painting_requests import (
    AddReference,
    ApplyPreset,
    ChangeLayers,
    ClearPainting,
    CompareLooks,
    CopyLook,
    DropLook,
    DropReference,
    DropStroke,
    GoToStep,
    ImportLayers,
    ListSteps,
    LoadLook,
    LookLike,
    MixLooks,
    Paint,
    Propose,
    Redo,
    RenameLook,
    SaveLook,
    Select,
    ShowPrevious,
    StartOver,
    Undo,
)

#: Version of this protocol; a page of another version is told to reload.
VERSION = 3


@dataclass(frozen=True)
class Hello(Message, kind="hello"):
    """The first message of a page, and again after a dropped connection. Answered by `state`, or
    by `waiting` while there is no picture yet; `state` then comes as soon as there is one.
    """

    version: int


@dataclass(frozen=True)
class ChangeSettings(Message, kind="change_settings"):
    """Settings of the answer, as in `Fit`. Answered by `answer`.

    settings: of hold, space, colors, literal, prefer_current, near, sparse; null for the default
    that follows from the painting.
    """

    settings: Mapping[str, Any]


@dataclass(frozen=True)
class Preview(Message, kind="preview"):
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
class Export(Message, kind="export"):
    """Write results to the folder of the session, or stop that. Answered by `started`, later by
    `exported`, which names the files written, even if stopped.

    outputs: `target`: a painting of each painted view; `layers`: its layers; `picture`: the
    displayed answer in each view.
    """

    outputs: tuple[Literal["target", "picture", "lighting", "relit", "report", "layers"], ...]
    run: bool = True


@dataclass(frozen=True)
class Verify(Message, kind="verify"):
    """Render the answer in a view, or stop that. Answered by `started`, later by `verified`, or by
    `stopped` once the render has ended.
    """

    run: bool = True
    view: int = 0


@dataclass(frozen=True)
class Explain(Message, kind="explain"):
    """A request for the reasons why a view is not closer to its painting. Answered by `started`,
    later by `explained` and the picture `beyond`.
    """

    view: int = 0


@dataclass(frozen=True)
class TakeOver(Message, kind="take_over"):
    """Take the session over from the page that has it. Answered by `state`."""


@dataclass(frozen=True)
class Fetch(Message, kind="fetch"):
    """A request for a picture, for clients without HTTP. Answered by `fetched`, with the picture as
    its array.
    """

    name: str


@dataclass(frozen=True)
class Observe(Message, kind="observe"):
    """The first message of an observer: a client that receives lighting, looks and progress, and
    never has the session. It may then send `fetch`, `export` and `propose`, and nothing else.
    Answered by `state` or `waiting`.
    """

    version: int


#: All requests of clients.
AnyRequest = (
    Hello
    | Paint
    | ChangeLayers
    | Select
    | DropStroke
    | ImportLayers
    | Undo
    | Redo
    | ListSteps
    | GoToStep
    | ApplyPreset
    | AddReference
    | DropReference
    | LookLike
    | ShowPrevious
    | ClearPainting
    | StartOver
    | ConstrainLight
    | ConstrainLights
    | SetMaster
    | StartFromLamps
    | MoveLights
    | PointLight
    | AddLight
    | RemoveLight
    | PlaceLights
    | ShowRig
    | TieLights
    | ChangeSettings
    | Preview
    | SaveLook
    | LoadLook
    | RenameLook
    | CopyLook
    | MixLooks
    | CompareLooks
    | DropLook
    | Export
    | Verify
    | Explain
    | TakeOver
    | Fetch
    | Observe
    | Propose
)

#: The requests by kind.
REQUESTS: Mapping[str, type[Any]] = {request.kind: request for request in get_args(AnyRequest)}
