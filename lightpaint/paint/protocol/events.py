"""Events: messages from a session to its clients, as replies or unasked."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.paint.protocol.base import OPTIONAL, Message
from lightpaint.paint.protocol.parts import (
    Findings,
    LightInfo,
    LookInfo,
    SampleCount,
    Standing,
    TableInfo,
    Tone,
    TransformInfo,
    ViewInfo,
)
from lightpaint.paint.store.canvas_pixels import Region


@dataclass(frozen=True, kw_only=True, eq=False)
class ProgressReport(Message, kind="progress"):
    """How far something is that takes long. Unasked.

    what: `export`, `basis`, or what the renderer calls it.
    """

    what: str
    done: int
    total: int
    unit: str


@dataclass(frozen=True, kw_only=True, eq=False)
class VerificationResult(Message, kind="verified"):
    """The render of the answer in a view has come: the picture `verified`. Unasked.

    is_old: whether somebody has painted on since.
    """

    agrees: bool
    text: str
    view: int
    is_old: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class SessionPending(Message, kind="waiting"):
    """There is no picture yet; `state` follows. text: why, if something went wrong."""

    version: int
    scene: str
    folder: str
    can_render: bool
    can_report: bool
    text: str
    progress: ProgressReport | None
    is_back: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class SessionState(Standing, Message, kind="state"):
    """All there is: the answer to `hello`, `take_over` and `observe`, and unasked when the basis
    gets better. All lists of lights are in the order of `lights`.

    version: of this protocol. size: height and width of the first view, and `objects` its names.
    lut: the grid of the tables `lut/NAME` of all `transforms`. resources: pictures, with a number
    that grows when one is made anew. verified: the last render of each view. first: whether nothing
    was ever done. stroke: number of the last stroke that was heard of. command: that answers the
    exported paintings. is_back: the client had the session before, and nobody since, as whoever is
    told unasked. weights: (lights, 3) float64, the last answer.
    """

    version: int
    scene: str
    folder: str
    can_render: bool
    can_report: bool
    size: tuple[int, int]
    objects: tuple[str, ...]
    lights: tuple[LightInfo, ...]
    views: tuple[ViewInfo, ...]
    transforms: tuple[str, ...]
    transform: TransformInfo
    lut: TableInfo
    resources: Mapping[str, int]
    looks: tuple[LookInfo, ...]
    basis: SampleCount
    verified: tuple[VerificationResult, ...]
    first: bool
    stroke: int
    command: str
    answer: Findings
    weights: Doubles
    is_back: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class AnswerUpdate(Standing, Findings, Message, kind="answer"):
    """The lights as they are now: the answer to what is painted or asked, and unasked once the
    exact answer is there, and again when more is known of it.

    version: grows with every change of the session. stroke: the last one that was heard of. exact:
    whether it is what `lightpaint solve` finds. mode: how it was found under the brush. weights:
    (lights, 3) float64.
    """

    version: int
    stroke: int
    exact: bool
    mode: str
    weights: Doubles

    @property
    def findings(self) -> Findings:
        """The findings of the answer, by themselves."""
        return Findings(**{name: getattr(self, name) for name in Findings.__dataclass_fields__})


@dataclass(frozen=True, kw_only=True, eq=False)
class CanvasPatch(Standing, Message, kind="patch"):
    """What a canvas holds now, after undo and the like: one for each view that has changed, which
    `views` lists.

    image: (rows, columns, 3) float32. importance: (rows, columns) float32. weights: (lights, 3)
    float64.
    """

    region: Region
    view: int
    views: tuple[int, ...]
    version: int
    stroke: int
    exact: bool
    mode: str
    image: Floats
    importance: Floats
    weights: Doubles

    @property
    def answer(self) -> AnswerUpdate:
        """The same without pixels."""
        standing = {name: getattr(self, name) for name in Standing.__dataclass_fields__}
        return AnswerUpdate(
            version=self.version,
            stroke=self.stroke,
            exact=self.exact,
            mode=self.mode,
            weights=self.weights,
            **standing,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class PictureUpdate(Message, kind="renewed"):
    """Pictures that are there anew, and their numbers. Unasked."""

    resources: Mapping[str, int]


@dataclass(frozen=True, kw_only=True, eq=False)
class PictureData(Message, kind="fetched"):
    """A picture, as the array `data`: the answer to `fetch`."""

    name: str
    data: npt.NDArray[np.generic]


@dataclass(frozen=True, kw_only=True, eq=False)
class LookList(Message, kind="looks"):
    """The looks that are kept, and all pictures: the answer to what changes looks, and unasked when
    an observer has proposed one.
    """

    looks: tuple[LookInfo, ...]
    resources: Mapping[str, int]


@dataclass(frozen=True, kw_only=True, eq=False)
class TaskStarted(Message, kind="started"):
    """Something that takes long has begun. what: the request, or `stop`."""

    what: Literal["export", "verify", "explain", "preview", "stop"]


@dataclass(frozen=True, kw_only=True, eq=False)
class TaskStopped(Message, kind="stopped"):
    """Something that was stopped has come to its end. Unasked."""

    what: Literal["verify"]


@dataclass(frozen=True, kw_only=True, eq=False)
class ExportResult(Message, kind="exported"):
    """Files that were written. Unasked.

    command: answers the exported paintings; "" where there is none. is_stopped: whether more were
    to come. is_unpainted: whether what needs a painting was left out.
    """

    files: tuple[str, ...]
    command: str
    is_stopped: bool | None = field(default=None, metadata=OPTIONAL)
    is_unpainted: bool | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, kw_only=True, eq=False)
class Explanation(Message, kind="explained"):
    """Why a view is not closer; the picture `beyond` shows where. Unasked."""

    sentences: tuple[str, ...]
    view: int
    is_old: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class PreviewResult(Message, kind="previewed"):
    """What a change would do. Unasked. number: of the preview. is_at_cost: whether it changes more
    than it brings. before, after: (h, w, 3) uint8.
    """

    number: int
    view: int
    text: str
    is_at_cost: bool
    is_old: bool
    before: npt.NDArray[np.uint8]
    after: npt.NDArray[np.uint8]


@dataclass(frozen=True, kw_only=True, eq=False)
class Notice(Message, kind="say"):
    """A sentence for people. Unasked. what: the task that it ends."""

    text: str
    tone: Tone = "info"
    what: str | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, kw_only=True, eq=False)
class Failure(Message, kind="failed"):
    """Why a request was not done; nothing has changed."""

    text: str
    tone: Tone | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, kw_only=True, eq=False)
class Closing(Message, kind="closed"):
    """The client does not have the session, or no more: another has `taken` it, the painter has
    `ended`, or the client speaks another `version` of this protocol.
    """

    reason: Literal["taken", "ended", "version"]
    text: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Acknowledgement(Message, kind="done"):
    """A request was done, and there is nothing to say of it."""


#: What a client is told, by kind.
EVENTS: Mapping[str, type[Any]] = {
    event.kind: event
    for event in (
        SessionState,
        SessionPending,
        AnswerUpdate,
        CanvasPatch,
        PictureUpdate,
        PictureData,
        LookList,
        ProgressReport,
        TaskStarted,
        TaskStopped,
        ExportResult,
        VerificationResult,
        Explanation,
        PreviewResult,
        Notice,
        Failure,
        Closing,
        Acknowledgement,
    )
}
