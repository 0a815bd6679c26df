"""Events: messages from a session to its clients, as replies or unasked."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.paint.protocol.base import OPTIONAL, Message
from lightpaint.paint.protocol.message_parts import (
    Camera,
    EditState,
    Findings,
    LightInfo,
    LightPlace,
    LookInfo,
    Place,
    SampleCount,
    TableInfo,
    Tone,
    TransformInfo,
    ViewInfo,
)
from lightpaint.paint.store.canvas_pixels import Region


@dataclass(frozen=True, kw_only=True, eq=False)
class ProgressReport(Message, kind="progress"):
    """The progress of a long task. Unasked.

    task: `export`, `basis`, `sampling` for samples added where the paint needs them, or the
    renderer's name for the task.
    """

    task: str
    done: int
    total: int
    unit: str


@dataclass(frozen=True, kw_only=True, eq=False)
class VerificationResult(Message, kind="verified"):
    """The result of a verification; its render is the picture `verified`. Unasked.

    is_old: whether the session has changed since.
    """

    agrees: bool
    text: str
    view: int
    is_old: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class SessionPending(Message, kind="waiting"):
    """The state while there is no picture yet; `state` follows. text: an error, if one occurred."""

    version: int
    scene: str
    folder: str
    can_render: bool
    can_report: bool
    text: str
    progress: ProgressReport | None
    is_back: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class SessionState(EditState, Message, kind="state"):
    """The whole state: the answer to `hello`, `take_over` and `observe`, and unasked when the basis
    improves. All lists of lights are in the order of `lights`.

    version: of this protocol. size: height and width of the first view, and `objects` the names of
    its objects.
    lut: the grid of the tables `lut/NAME` of all `transforms`. resources: pictures, with a number
    that grows when one is replaced. verifications: the last one of each view. is_new: whether
    the session has no steps yet. stroke: number of the last stroke that arrived. command: solves
    for the exported paintings. is_back: the client had the session before, and no other client
    since; also true if unasked. weights: (lights, 3) float64, the last answer.
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
    verifications: tuple[VerificationResult, ...]
    is_new: bool
    stroke: int
    command: str
    answer: Findings
    weights: Doubles
    is_back: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class AnswerUpdate(EditState, Findings, Message, kind="answer"):
    """The present lights: the answer to paint and requests, unasked once the exact answer is found,
    and again with its analysis.

    version: grows with every change of the session. stroke: number of the last stroke that arrived.
    exact: whether it equals the answer of `lightpaint solve`. mode: space in which it was found
    under the brush.
    weights: (lights, 3) float64.
    """

    version: int
    stroke: int
    exact: bool
    mode: str
    weights: Doubles

    @property
    def findings(self) -> Findings:
        """Findings of the answer, without the lights."""
        return Findings(**{name: getattr(self, name) for name in Findings.__dataclass_fields__})


@dataclass(frozen=True, kw_only=True, eq=False)
class CanvasPatch(EditState, Message, kind="patch"):
    """New pixels of a canvas, after undo and the like: one message for each changed view; `views`
    lists all of these.

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
        """Return the same as an answer, without pixels."""
        standing = {name: getattr(self, name) for name in EditState.__dataclass_fields__}
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
    """New or replaced pictures, and their numbers. Unasked."""

    resources: Mapping[str, int]


@dataclass(frozen=True, kw_only=True, eq=False)
class PictureData(Message, kind="fetched"):
    """A picture, as the array `data`: the answer to `fetch`."""

    name: str
    data: npt.NDArray[np.generic]


@dataclass(frozen=True, kw_only=True, eq=False)
class LookList(Message, kind="looks"):
    """The kept looks, and all pictures: the answer to requests about looks, and unasked when an
    observer has proposed one.
    """

    looks: tuple[LookInfo, ...]
    resources: Mapping[str, int]


@dataclass(frozen=True, kw_only=True, eq=False)
class TaskStarted(Message, kind="started"):
    """Notice that a long task has started. task: the request, or `stop`."""

    task: Literal["export", "verify", "explain", "preview", "rig", "place", "stop"]


@dataclass(frozen=True, kw_only=True, eq=False)
class TaskStopped(Message, kind="stopped"):
    """Notice that a stopped task has ended. Unasked."""

    task: Literal["verify"]


@dataclass(frozen=True, kw_only=True, eq=False)
class ExportResult(Message, kind="exported"):
    """Files that were written. Unasked.

    command: solves for the exported paintings; "" for none. is_stopped: whether the export was
    stopped before its end. is_unpainted: whether files that need a painting were left out.
    """

    files: tuple[str, ...]
    command: str
    is_stopped: bool | None = field(default=None, metadata=OPTIONAL)
    is_unpainted: bool | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, kw_only=True, eq=False)
class Explanation(Message, kind="explained"):
    """The reasons why a view is not closer to its painting; the picture `beyond` shows where.
    Unasked.
    """

    sentences: tuple[str, ...]
    view: int
    is_old: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class PreviewResult(Message, kind="previewed"):
    """The effect of a change, before it is made. Unasked. number: of the preview. is_at_cost:
    whether it changes the unpainted part by more than it gains. before, after: (h, w, 3) uint8.
    """

    number: int
    view: int
    text: str
    is_at_cost: bool
    is_old: bool
    before: npt.NDArray[np.uint8]
    after: npt.NDArray[np.uint8]


@dataclass(frozen=True, kw_only=True, eq=False)
class Rig(Message, kind="rig"):
    """The places of all lights. Sent after every move, once requested.

    lights: in the order of the state. cameras: of each view; null for one that is no pinhole. up:
    the axis nearest to upwards, 0, 1 or 2. low, high: corners of a box around the visible scene and
    all lights. surfaces: names of rails, surfaces and shapes that new lights may hang on.
    """

    lights: tuple[LightPlace, ...]
    cameras: tuple[Camera | None, ...]
    up: int
    low: Place
    high: Place
    surfaces: tuple[str, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class TrialPlaces(Message, kind="trial"):
    """The places that a search is trying. Unasked.

    positions, directions: by name of light, including new ones.
    """

    positions: Mapping[str, Place]
    directions: Mapping[str, Place]


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacingResult(Message, kind="placed"):
    """The result of a search for places of lights. Unasked.

    text: the moves or additions and their gain, or why there are none. names: of these lights.
    """

    text: str
    names: tuple[str, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Notice(Message, kind="notice"):
    """A sentence for users. Unasked. task: the one that it ends."""

    text: str
    tone: Tone = "info"
    task: str | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, kw_only=True, eq=False)
class Failure(Message, kind="failed"):
    """The reason why a request was refused; nothing has changed."""

    text: str
    tone: Tone | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, kw_only=True, eq=False)
class Closing(Message, kind="closed"):
    """Notice that the client does not have the session, or has lost it: another client has `taken`
    it, the painter has `ended`, or the client speaks another `version` of this protocol.
    """

    reason: Literal["taken", "ended", "version"]
    text: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Acknowledgement(Message, kind="done"):
    """Confirmation of a request that has no other answer."""


#: The events by kind.
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
        Rig,
        TrialPlaces,
        PlacingResult,
        Notice,
        Failure,
        Closing,
        Acknowledgement,
    )
}
