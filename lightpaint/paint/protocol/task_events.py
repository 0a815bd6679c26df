"""Events about tasks that run in the background: how far they are, and their results."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from lightpaint.paint.protocol.base import OPTIONAL, Event
from lightpaint.paint.protocol.message_parts import Place, RenderInfo


@dataclass(frozen=True, kw_only=True, eq=False)
class ProgressReport(Event, kind="progress", is_observed=True):
    """The progress of a long task. Sent without a request.

    task: `export`, `final` for a final render, `basis`, `sampling` for samples added where the
    paint needs them, `planes` for measuring planes, or the renderer's name for the task. done,
    total: steps so far, and in all. unit: of these steps; "" for none.
    """

    task: str
    done: int
    total: int
    unit: str


@dataclass(frozen=True, kw_only=True, eq=False)
class VerificationResult(Event, kind="verified", is_observed=True):
    """The result of a verification; its render is the picture `verified`. Sent without a request.

    is_old: whether the session has changed since. agrees: whether the render is the predicted
    picture but for noise. text: the result, in a sentence. view: index of the view.
    """

    agrees: bool
    text: str
    view: int
    is_old: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class TaskStarted(Event, kind="started"):
    """Notice that a long task has started. task: the request, or `stop`."""

    task: Literal[
        "export",
        "verify",
        "explain",
        "preview",
        "rig",
        "place",
        "compare",
        "import",
        "reference",
        "stop",
    ]


@dataclass(frozen=True, kw_only=True, eq=False)
class TaskStopped(Event, kind="stopped"):
    """Notice that a stopped task has ended. Sent without a request.

    task: the request.
    """

    task: Literal["verify"]


@dataclass(frozen=True, kw_only=True, eq=False)
class ExportResult(Event, kind="exported", is_observed=True):
    """Files that were written. Sent without a request.

    command: the command line that solves for the exported paintings; "" for none. is_stopped:
    whether the export was stopped before its end. is_unpainted: whether files that need a painting
    were left out. files: their paths.
    """

    files: tuple[str, ...]
    command: str
    is_stopped: bool | None = field(default=None, metadata=OPTIONAL)
    is_unpainted: bool | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, kw_only=True, eq=False)
class RenderList(Event, kind="renders"):
    """The final renders since the painter was started, the oldest first: the answer to requests
    about them, and unasked when one changes its state.
    """

    renders: tuple[RenderInfo, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class Explanation(Event, kind="explained"):
    """The reasons why a view is not closer to its painting; the picture `beyond` shows where. Sent
    without a request.

    sentences: the reasons. view: index of the view. is_old: whether the session has changed since.
    """

    sentences: tuple[str, ...]
    view: int
    is_old: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class PreviewResult(Event, kind="previewed"):
    """The effect of a change, before it is made. Sent without a request. number: of the preview.
    is_at_cost: whether it changes the unpainted part by more than it gains. before, after: (h, w,
    3) uint8.

    view: as requested. text: the effect, in a sentence. is_old: whether the session has changed
    since.
    """

    number: int
    view: int
    text: str
    is_at_cost: bool
    is_old: bool
    before: npt.NDArray[np.uint8]
    after: npt.NDArray[np.uint8]


@dataclass(frozen=True, kw_only=True, eq=False)
class TrialPlaces(Event, kind="trial"):
    """The places that a search is trying. Sent without a request.

    positions, directions: by name of light, including new ones.
    """

    positions: Mapping[str, Place]
    directions: Mapping[str, Place]


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacingEstimate(Event, kind="place_estimate"):
    """The extent of a search for places, and its time: the answer to `estimate_place`.

    text: the lights, and what each may do. seconds: about how long it takes, at least and at most.
    is_measured: whether an earlier search of this session tells the pace of this machine.
    """

    text: str
    seconds: tuple[float, float]
    is_measured: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class PlacingResult(Event, kind="placed"):
    """The result of a search for places of lights. Sent without a request.

    text: the moves or additions and their gain, or why there are none. names: of these lights.
    """

    text: str
    names: tuple[str, ...]
