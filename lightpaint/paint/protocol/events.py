"""Events: messages from a session to its clients, as replies or unasked.

Here are those about the state of the session and of the connection, and the list of all.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.paint.protocol import message_parts
from lightpaint.paint.protocol.answer_parts import AnswerChoice, Findings, PlanesReading
from lightpaint.paint.protocol.base import OPTIONAL, Event
from lightpaint.paint.protocol.task_events import ProgressReport, VerificationResult
from lightpaint.paint.store.history_steps import Region


@dataclass(frozen=True, kw_only=True, eq=False)
class SessionPending(Event, kind="waiting"):
    """The state while there is no picture yet; `state` follows. text: an error, if one occurred.

    version: of this protocol. scene, folder: names of the scene file and of the session.
    can_render: whether there is a scene to render, and not a basis alone. can_report: whether a
    report can be written. progress: of what it waits for. is_back: as in `state`.
    """

    version: int
    scene: str
    folder: str
    can_render: bool
    can_report: bool
    text: str
    progress: ProgressReport | None
    is_back: bool = True


@dataclass(frozen=True, kw_only=True, eq=False)
class SessionState(message_parts.EditState, Event, kind="state", is_observed=True):
    """The whole state: the answer to `hello`, `take_over` and `observe`, and unasked when the basis
    improves. All lists of lights are in the order of `lights`.

    version: of this protocol. size: height and width of the first view, and `objects` the names of
    its objects. lut: the grid of the tables `lut/NAME` of all `transforms`. resources: pictures,
    with a number that grows when one is replaced. verifications: the last one of each view.
    renders: the final renders, as in `renders`. is_new: whether the session has no steps yet.
    stroke: number of the last stroke that arrived. command: solves for the exported paintings.
    is_back: the client had the session before, and no other client since; also true if unasked.
    weights: (lights, 3) float64, the last answer.

    choices: as the last `choices` had them; empty once the session has changed since. scene,
    folder: names of the scene file and of the session. can_render: whether there is a scene to
    render, and not a basis alone. can_report: whether a report can be written. images: lights that
    are images. transforms: names of view transforms. transform: the one in use. basis: how many
    samples the planes have. answer: how close the last one is. console: null if there is none.
    planes, reading: measuring planes, and what the answer gives there; null until they are
    measured, and without any.
    """

    version: int
    scene: str
    folder: str
    can_render: bool
    can_report: bool
    size: tuple[int, int]
    objects: tuple[str, ...]
    lights: tuple[message_parts.LightInfo, ...]
    images: tuple[message_parts.ImageInfo, ...]
    views: tuple[message_parts.ViewInfo, ...]
    transforms: tuple[str, ...]
    transform: message_parts.TransformInfo
    lut: message_parts.TableInfo
    resources: Mapping[str, int]
    looks: tuple[message_parts.LookInfo, ...]
    presets: tuple[message_parts.PresetInfo, ...]
    references: tuple[message_parts.ReferenceInfo, ...]
    basis: message_parts.SampleCount
    verifications: tuple[VerificationResult, ...]
    is_new: bool
    stroke: int
    command: str
    answer: Findings
    weights: Doubles
    is_back: bool = True
    choices: tuple[AnswerChoice, ...] = ()
    renders: tuple[message_parts.RenderInfo, ...] = ()
    console: message_parts.ConsoleInfo | None = None
    planes: message_parts.PlanesInfo | None = None
    reading: PlanesReading | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class AnswerUpdate(message_parts.EditState, Findings, Event, kind="answer", is_observed=True):
    """The current lights: the answer to paint and requests, unasked once the exact answer is found,
    and again with its analysis.

    version: grows with every change of the session. stroke: number of the last stroke that arrived.
    exact: whether it equals the answer of `lightpaint solve`. mode: space in which it was found
    under the brush. reading: what these lights give on measuring planes, if there are any.
    weights: (lights, 3) float64. drives: of the emitters of each lamp in the order of the lights,
    null for other lights; some answers under the brush have them, exact ones have them in `lights`.
    draft: if the paint asked for one, (rows, columns, 3) float16, the painted view under these
    lights and the master dimmer, averaged over blocks of pixels. Stretched over the view, by
    interpolation, and multiplied by the picture `detail` it is a draft as `mixed` has one.
    """

    version: int
    stroke: int
    exact: bool
    mode: str
    weights: Doubles
    draft: npt.NDArray[np.float16] | None = field(default=None, metadata=OPTIONAL)
    drives: tuple[tuple[float, ...] | None, ...] | None = field(default=None, metadata=OPTIONAL)
    reading: PlanesReading | None = field(default=None, metadata=OPTIONAL)

    @property
    def findings(self) -> Findings:
        """Findings of the answer, without the lights."""
        return Findings(**{name: getattr(self, name) for name in Findings.__dataclass_fields__})


@dataclass(frozen=True, kw_only=True, eq=False)
class CanvasPatch(message_parts.EditState, Event, kind="patch"):
    """New pixels of a canvas, after undo and the like: one message for each changed view; `views`
    lists all of these.

    image: (rows, columns, 3) float32. importance: (rows, columns) float32. weights: (lights, 3)
    float64. region: of these pixels. view: index of the view. version, stroke, exact, mode: as in
    `answer`.
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
        standing = {
            name: getattr(self, name) for name in message_parts.EditState.__dataclass_fields__
        }
        return AnswerUpdate(
            version=self.version,
            stroke=self.stroke,
            exact=self.exact,
            mode=self.mode,
            weights=self.weights,
            **standing,
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class SelectionUpdate(message_parts.EditState, Event, kind="selected"):
    """The new selection: the answer to `select`, which changes no light."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PictureUpdate(Event, kind="renewed", is_observed=True):
    """New or replaced pictures, and their numbers. Sent without a request.

    resources: pictures, with a number that grows when one is replaced.
    """

    resources: Mapping[str, int]


@dataclass(frozen=True, kw_only=True, eq=False)
class DraggedPlane(Event, kind="dragged"):
    """The picture of a light that is dragged, so that it need not be fetched. Sent without a
    request, before the answer.

    light: its index. view: the one that the request named. resources: numbers of its pictures, all
    of which are this one. step: as the request had it. data: (h, w, 3) float16, divided by the
    light's `scale`; every step-th pixel of every step-th row.
    """

    light: int
    view: int
    step: int
    resources: Mapping[str, int]
    data: npt.NDArray[np.float16]


@dataclass(frozen=True, kw_only=True, eq=False)
class MixedPicture(Event, kind="mixed"):
    """The picture of a lighting: the answer to `mix`, and unasked the exact one.

    view, slot, number: as the request had them. step: between the pixels and rows. is_exact:
    whether it is the sum of the planes, and no draft. data: (h, w, 3) float16.
    """

    view: int
    slot: int
    number: int
    step: int
    is_exact: bool
    data: npt.NDArray[np.float16]


@dataclass(frozen=True, kw_only=True, eq=False)
class PictureData(Event, kind="fetched"):
    """A picture, as the array `data`: the answer to `fetch`.

    name: as requested. data: the picture.
    """

    name: str
    data: npt.NDArray[np.generic]


@dataclass(frozen=True, kw_only=True, eq=False)
class StepList(Event, kind="steps"):
    """The last steps of the history, in order, including undone ones: the answer to `list_steps`.

    earlier: number of steps before them. done: id of the last step that is not undone; 0 at the
    beginning. searches: those after a step that still exists, the oldest first.
    """

    steps: tuple[message_parts.StepInfo, ...]
    earlier: int
    done: int
    searches: tuple[message_parts.SearchInfo, ...] = ()


@dataclass(frozen=True, kw_only=True, eq=False)
class PreviousAnswer(Event, kind="previous"):
    """The answer before the last step, under the master dimmer: the answer to `show_previous`.

    weights: (lights, 3) float64, in the order of the state.
    """

    weights: Doubles


@dataclass(frozen=True, kw_only=True, eq=False)
class LookList(Event, kind="looks", is_observed=True):
    """The kept looks, and all pictures: the answer to requests about looks, and unasked when an
    observer has proposed one.

    resources: as in `renewed`.
    """

    looks: tuple[message_parts.LookInfo, ...]
    resources: Mapping[str, int]


@dataclass(frozen=True, kw_only=True, eq=False)
class ReferenceList(Event, kind="references"):
    """The references, the oldest first: the answer to requests about them, and unasked once a file
    has become one.
    """

    references: tuple[message_parts.ReferenceInfo, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class AnswerChoices(Event, kind="choices"):
    """The answers with other light colours, to choose from. Sent without a request, once the exact
    answer rests.

    version: of the session. choices: from the least freedom to the most; empty without paint, and
    where no light can change its colour. resources: numbers of their pictures.
    """

    version: int
    choices: tuple[AnswerChoice, ...]
    resources: Mapping[str, int]


@dataclass(frozen=True, kw_only=True, eq=False)
class Rig(Event, kind="rig"):
    """The places of all lights. Sent after every move, once requested.

    lights: in the order of the state. cameras: of each view; null for one that is not a pinhole.
    up: the axis nearest to upwards, 0, 1 or 2. low, high: corners of a box around the visible scene
    and all lights. surfaces: names of rails, surfaces and shapes that new lights may hang on.
    objects: those within that box, the largest first. skies: of images that are skies.
    """

    lights: tuple[message_parts.LightPlace, ...]
    cameras: tuple[message_parts.Camera | None, ...]
    up: int
    low: message_parts.Place
    high: message_parts.Place
    surfaces: tuple[str, ...]
    objects: tuple[message_parts.PlanObject, ...]
    skies: tuple[message_parts.SkyAxes, ...]


@dataclass(frozen=True, kw_only=True, eq=False)
class ConsoleState(Event, kind="console"):
    """The state of the console: the answer to requests about it."""

    console: message_parts.ConsoleInfo | None


@dataclass(frozen=True, kw_only=True, eq=False)
class Notice(Event, kind="notice", is_observed=True):
    """A sentence for users. Sent without a request. task: the one that it ends.

    text: the sentence. tone: whether it is a warning.
    """

    text: str
    tone: message_parts.Tone = "info"
    task: str | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, kw_only=True, eq=False)
class Failure(Event, kind="failed"):
    """The reason why a request was refused; nothing has changed.

    text: the reason, in a sentence. tone: whether it is a warning.
    """

    text: str
    tone: message_parts.Tone | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, kw_only=True, eq=False)
class Closing(Event, kind="closed"):
    """Notice that the client does not have the session, or has lost it: another client has `taken`
    it, the painter has `ended`, or the client speaks another `version` of this protocol.

    reason: as above. text: the same, in a sentence.
    """

    reason: Literal["taken", "ended", "version"]
    text: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Acknowledgement(Event, kind="done"):
    """Confirmation of a request that has no other answer."""
