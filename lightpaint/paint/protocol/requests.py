"""Requests: messages from clients to their session, with arrays beside them.

Clients number their messages (`seq`), and each is answered by one with that number (`reply`), even
in case of an error. A page keeps one stroke in flight, and the newest wins.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, get_args

from lightpaint.arrays import RGB
from lightpaint.paint.layers.layer import PAINTING_ID, Layer
from lightpaint.paint.protocol.base import Message
from lightpaint.paint.protocol.message_parts import Place
from lightpaint.paint.store.canvas_pixels import Region

#: Version of this protocol; a page of another version is told to reload.
VERSION = 3


@dataclass(frozen=True)
class Hello(Message, kind="hello"):
    """The first message of a page, and again after a dropped connection. Answered by `state`, or
    by `waiting` while there is no picture yet; `state` then comes as soon as there is one.
    """

    version: int


@dataclass(frozen=True)
class Paint(Message, kind="paint"):
    """Pixels under the brush; with arrays `image` (rows, columns, 3) float32 and `importance`
    (rows, columns) float32. Answered by `answer`.

    stroke: number of the stroke, which the page counts. is_final: whether this ends the stroke;
    only then it is kept. label: its name for undo. view: index of the painted view. layer: id of
    the layer of these pixels. For all kinds but `pixels`, `importance` is the coverage, 0 to 1, and
    masks need no `image`. properties: of the layer, from now on; with an unused id they add a layer
    on top.
    """

    request_buffers: ClassVar[Mapping[str, str]] = {
        "image": "(rows, columns, 3) float32",
        "importance": "(rows, columns) float32",
    }

    stroke: int
    region: Region
    is_final: bool = False
    label: str = "stroke"
    view: int = 0
    layer: int = PAINTING_ID
    properties: Layer | None = None

    def __post_init__(self) -> None:
        if self.stroke >= 2**53:  # largest exact integer of a page
            raise ValueError("stroke is a number below 2**53")


@dataclass(frozen=True)
class ChangeLayers(Message, kind="change_layers"):
    """A change of layers, their properties or their order: one step. Answered by `answer`.

    layers: new or changed ones; new ones lie on top. order: ids of all that stay, the lowest first;
    null for the present order. copies: ids of the originals by the id of each copy, which is among
    `layers`. is_final: whether it becomes a step; false while a slider moves. label: its name for
    undo.
    """

    layers: tuple[Layer, ...] = ()
    order: tuple[int, ...] | None = None
    copies: Mapping[str, int] = field(default_factory=dict)
    is_final: bool = True
    label: str = "layers"


@dataclass(frozen=True)
class DropStroke(Message, kind="drop_stroke"):
    """Cancel the unfinished stroke. Answered by `patch`."""

    stroke: int


@dataclass(frozen=True)
class Undo(Message, kind="undo"):
    """Undo the last step, whether paint, constraints or settings. Answered by `patch`."""


@dataclass(frozen=True)
class Redo(Message, kind="redo"):
    """Redo a step that was undone. Answered by `patch`."""


@dataclass(frozen=True)
class ConstrainLight(Message, kind="constrain_light"):
    """New constraints on one light; an empty object frees it. Answered by `answer`.

    constraints: keys and values as in a lights file: lock, off, limits, color, kelvin, duv,
    primaries.
    is_final: whether it becomes a step; false while a slider moves.
    """

    light: int
    constraints: Mapping[str, Any]
    is_final: bool = True


@dataclass(frozen=True)
class ConstrainLights(Message, kind="constrain_lights"):
    """New constraints on several lights, by name, as in `constrain_light`: one step. Answered by
    `answer`.
    """

    constraints: Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class MoveLights(Message, kind="move"):
    """New places, targets and cones of lights, by name. Answered by `answer`; `rig` follows.

    poses: changed fields of `lightpaint.Pose`: position, target, cutoff and beam; an empty object
    restores a light's place from the scene. is_final: whether it becomes a step; false while a
    light is dragged.
    """

    poses: Mapping[str, Mapping[str, Any]]
    is_final: bool = True


@dataclass(frozen=True)
class PointLight(Message, kind="point"):
    """A move of a light by a place in the picture. Answered by `answer`; `rig` follows.

    mode: `aim` points it there; `highlight` hangs it so that its reflection appears there; `shadow`
    hangs it so that the shadow of the surface at `edge` ends there. pixel, edge: column and row in
    pixels. view: index of the view. is_final: as in `move`.
    """

    light: int
    mode: Literal["aim", "highlight", "shadow"]
    pixel: tuple[float, float]
    edge: tuple[float, float] | None = None
    view: int = 0
    is_final: bool = True


@dataclass(frozen=True)
class AddLight(Message, kind="add_light"):
    """A new light, with a generated name: one step. Answered by `state`; `rig` follows.

    type: of the light. pixel: column and row in a picture; the light hangs a little before the
    surface there, and points away from it. position: its place, instead; it points down. view:
    index of the view.
    """

    type: Literal["spot", "point", "panel"]
    pixel: tuple[float, float] | None = None
    position: Place | None = None
    view: int = 0


@dataclass(frozen=True)
class RemoveLight(Message, kind="remove_light"):
    """A request to remove an added light, by name: one step. Answered by `state`; `rig`
    follows.
    """

    name: str


@dataclass(frozen=True)
class ShowRig(Message, kind="show_rig"):
    """A request for the places of all lights, and for `rig` after every later move. Answered by
    `started`, later by `rig`.
    """


@dataclass(frozen=True)
class PlaceLights(Message, kind="place"):
    """A request to find places, directions and cones of lights that come closest to the paintings,
    or to stop that. Answered by `started`, then by `trial` and later by `placed`; the result is one
    step.

    new_type: type of lights to add, instead of moving existing ones; null for none. max_count:
    maximum number of them. surfaces: names of rails, surfaces and shapes that they may hang on;
    none for anywhere free.
    """

    run: bool = True
    new_type: Literal["spot", "point", "panel"] | None = None
    max_count: int = 1
    surfaces: tuple[str, ...] = ()


@dataclass(frozen=True)
class TieLights(Message, kind="tie"):
    """The lights that share a dimmer: all such groups, of names. Answered by `answer`."""

    ties: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class ChangeSettings(Message, kind="change_settings"):
    """Settings of the answer, as in `Fit`. Answered by `answer`.

    settings: of hold, space, colors, literal, prefer_current, sparse; null for the default that
    follows from the painting.
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
class SaveLook(Message, kind="save_look"):
    """Keep painting and answer under a name. Answered by `looks`."""

    name: str


@dataclass(frozen=True)
class LoadLook(Message, kind="load_look"):
    """Continue from a look; a step that can be undone. Answered by `patch`."""

    look: int


@dataclass(frozen=True)
class RenameLook(Message, kind="rename_look"):
    """Give a look another name. Answered by `looks`."""

    look: int
    name: str


@dataclass(frozen=True)
class CopyLook(Message, kind="copy_look"):
    """Keep a copy of a look. Answered by `looks`."""

    look: int


@dataclass(frozen=True)
class MixLooks(Message, kind="mix_looks"):
    """Keep a mix of two looks: its lights are locked at the share `part` of the way from the first
    to the second. Answered by `looks`.
    """

    first: int
    second: int
    part: float
    name: str


@dataclass(frozen=True)
class DropLook(Message, kind="drop_look"):
    """Delete a look. Answered by `looks`."""

    look: int


@dataclass(frozen=True)
class Export(Message, kind="export"):
    """Write results to the folder of the session, or stop that. Answered by `started`, later by
    `exported`, which names the files written, even if stopped.

    outputs: `target`: a painting of each painted view; `picture`: the displayed answer in each
    view.
    """

    outputs: tuple[Literal["target", "picture", "lighting", "relit", "report"], ...]
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


@dataclass(frozen=True)
class Propose(Message, kind="propose"):
    """Propose a lighting to the painter: it becomes a look with each light locked at the proposed
    level, and replaces an earlier proposal of that name. Answered by `looks`.

    lights: emission by name of light; other lights keep that of the present answer.
    """

    name: str
    lights: Mapping[str, RGB]


#: All requests of clients.
AnyRequest = (
    Hello
    | Paint
    | ChangeLayers
    | DropStroke
    | Undo
    | Redo
    | ConstrainLight
    | ConstrainLights
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
