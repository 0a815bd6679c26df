"""Requests about the painting: strokes, layers, undo, and looks, which keep a painting."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Literal

from lightpaint.arrays import RGB
from lightpaint.paint.layers.layer_stack import PAINTING_ID, Layer
from lightpaint.paint.protocol.base import Request
from lightpaint.paint.protocol.message_parts import PlacePair
from lightpaint.paint.store.history_steps import Region

#: Maximum number of steps in one list.
MAX_LISTED_STEPS = 10_000

#: Maximum number of pairs of places that are compared with a reference.
MAX_PAIRS = 20

#: Number of pictures that a page has the session mix at a time, and the largest step between the
#: pixels of a draft.
MAX_MIX_SLOTS, MAX_MIX_STEP = 16, 8

#: The slot in which a page shows the answer.
ANSWER_SLOT = 0


@dataclass(frozen=True)
class Paint(Request, kind="paint"):
    """Pixels under the brush; with arrays `image` (rows, columns, 3) float32 and `importance`
    (rows, columns) float32. Answered by `answer`.

    stroke: number of the stroke, which the page counts. is_final: whether this ends the stroke;
    only then it is kept. label: its name for undo. view: index of the painted view. layer: id of
    the layer of these pixels. For all kinds but `pixels`, `importance` is the coverage, 0 to 1, and
    masks need no `image`. properties: of the layer, from now on; with an unused id they add a layer
    on top. region: of these pixels. with_draft: whether the answer is to have a draft, of a view
    with `has_mixes`.
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
    with_draft: bool = False

    def __post_init__(self) -> None:
        if self.stroke >= 2**53:  # largest exact integer of a page
            raise ValueError("stroke is a number below 2**53")


@dataclass(frozen=True)
class MixLights(Request, kind="mix"):
    """Ask for the picture of a lighting, of a view with `has_mixes`; with the array `weights`
    (lights, 3) float64. Answered by `mixed` with a draft; another `mixed` with the exact picture
    follows unless `is_live`.

    slot, number: the page's own, which `mixed` returns: another `mix` for a slot stops an exact
    picture that is not there yet; so does `paint` with a draft for slot 0, the answer's. is_clean:
    whether to denoise it. is_live: whether more changes follow. step: between the pixels and rows
    of the draft.
    """

    request_buffers: ClassVar[Mapping[str, str]] = {"weights": "(lights, 3) float64"}

    slot: int
    number: int
    view: int = 0
    is_clean: bool = True
    is_live: bool = False
    step: int = 1

    def __post_init__(self) -> None:
        if not 0 <= self.slot < MAX_MIX_SLOTS:
            raise ValueError(f"slot is 0 to {MAX_MIX_SLOTS - 1}")
        if not 1 <= self.step <= MAX_MIX_STEP:
            raise ValueError(f"the step of a draft is 1 to {MAX_MIX_STEP}")


@dataclass(frozen=True)
class ChangeLayers(Request, kind="change_layers"):
    """A change of layers, their properties or their order: one step. Answered by `answer`.

    layers: new or changed ones; new ones lie on top. order: ids of all that stay, the lowest first;
    null for the current order. copies: ids of the originals by the id of each copy, which is among
    `layers`. is_final: whether it becomes a step; false while a slider moves. label: its name for
    undo.
    """

    layers: tuple[Layer, ...] = ()
    order: tuple[int, ...] | None = None
    copies: Mapping[str, int] = field(default_factory=dict)
    is_final: bool = True
    label: str = "layers"


@dataclass(frozen=True)
class Select(Request, kind="select"):
    """The selection of a view: a mask that clients multiply what they paint by; one step. With an
    array `mask` (rows, columns) uint8, 255 for a fully selected pixel. Answered by `selected`.

    region: of the mask; nothing is selected outside it. With an empty one, or a mask of zeros,
    everything can be painted. label: its name for undo. view: index of the view.
    """

    request_buffers: ClassVar[Mapping[str, str]] = {"mask": "(rows, columns) uint8"}

    region: Region
    label: str = "select"
    view: int = 0


@dataclass(frozen=True)
class ImportLayers(Request, kind="import_layers"):
    """A part of a file of layers, `.ora` or the painter's EXR; with array `part`, its bytes.
    Answered by `started`. After the last part follow `patch` messages, as a step was made, and a
    `notice`; or a `notice` that says why not.

    name: of the file. size: of the whole file in bytes. start: position of the part, which arrive
    in order. view: index of the view that the layers are of. replaces: whether they replace all
    layers, which needs a session of one view; otherwise they lie on top.
    """

    request_buffers: ClassVar[Mapping[str, str]] = {"part": "bytes, uint8 of any shape"}

    name: str
    size: int
    start: int
    view: int = 0
    replaces: bool = False


@dataclass(frozen=True)
class DropStroke(Request, kind="drop_stroke"):
    """Cancel the unfinished stroke, and what a drag or a slider has changed. Answered by `patch`.

    stroke: number of the stroke; 0 for none.
    """

    stroke: int = 0


@dataclass(frozen=True)
class Undo(Request, kind="undo"):
    """Undo the last step, whether paint, constraints or settings. Answered by `patch`."""


@dataclass(frozen=True)
class Redo(Request, kind="redo"):
    """Redo a step that was undone. Answered by `patch`."""


@dataclass(frozen=True)
class ListSteps(Request, kind="list_steps"):
    """A request for the last `count` steps of the history. Answered by `steps`."""

    count: int = 100

    def __post_init__(self) -> None:
        if not 0 < self.count <= MAX_LISTED_STEPS:
            raise ValueError(f"count is 1 to {MAX_LISTED_STEPS}")


@dataclass(frozen=True)
class GoToStep(Request, kind="go_to_step"):
    """Undo or redo up to the state after a step, by its id; 0 is the beginning. Answered by
    `patch`.
    """

    step: int


@dataclass(frozen=True)
class ShowPrevious(Request, kind="show_previous"):
    """A request for the answer before the last step, to compare with. Answered by `previous`."""


@dataclass(frozen=True)
class ApplyPreset(Request, kind="apply_preset"):
    """Put the layers of a preset on top, in all views and within what is selected: one step.
    Answered by `patch`.

    preset: its name, as in `state`. subject: name of the object that it is about; null to take the
    most central one.
    """

    preset: str
    subject: str | None = None


@dataclass(frozen=True)
class AddReference(Request, kind="add_reference"):
    """A part of a picture file that becomes a reference; with array `part`, its bytes. Answered by
    `started`. After the last part follows `references`, or a `notice` that says why not.

    name: of the file. size: of the whole file in bytes. start: position of the part, which arrive
    in order.
    """

    request_buffers: ClassVar[Mapping[str, str]] = {"part": "bytes, uint8 of any shape"}

    name: str
    size: int
    start: int


@dataclass(frozen=True)
class DropReference(Request, kind="drop_reference"):
    """Delete a reference. Answered by `references`.

    reference: its id.
    """

    reference: int


@dataclass(frozen=True)
class LookLike(Request, kind="look_like"):
    """Put layers on top that ask for the light of a reference, within what is selected: one step.
    Answered by `patch`.

    areas: that are compared beside the colour of the `whole` picture: its shadows and lit parts;
    these and its `regions`, top, middle and bottom; nine `parts`, for a reference of the same view;
    or `pairs` of places, each in the reference and in the view. matches_brightness: whether the
    picture becomes as bright as the reference; otherwise only differences within it count.
    reference: its id. pairs: of places, if `areas` is `pairs`. view: index of the view.
    """

    reference: int
    areas: Literal["whole", "regions", "parts", "pairs"] = "regions"
    pairs: tuple[PlacePair, ...] = ()
    view: int = 0
    matches_brightness: bool = False

    def __post_init__(self) -> None:
        if len(self.pairs) > MAX_PAIRS:
            raise ValueError(f"pairs of places are at most {MAX_PAIRS}")
        places = [x for pair in self.pairs for x in (*pair.reference, *pair.picture)]
        if not all(0 <= x <= 1 for x in places):
            raise ValueError("places are shares of width and height, 0 to 1")


@dataclass(frozen=True)
class ClearPainting(Request, kind="clear_painting"):
    """Delete all layers and all paint, in all views: one step. Answered by `patch`."""


@dataclass(frozen=True)
class StartOver(Request, kind="start_over"):
    """Go back to the scene as it was before anything was painted or requested, except for looks:
    one step. Answered by `patch`, or by `state` if lights had been added.
    """


@dataclass(frozen=True)
class SaveLook(Request, kind="save_look"):
    """Keep painting and answer under a name. Answered by `looks`.

    name: of the look.
    """

    name: str


@dataclass(frozen=True)
class LoadLook(Request, kind="load_look"):
    """Continue from a look; a step that can be undone. Answered by `patch`.

    look: its id.
    """

    look: int


@dataclass(frozen=True)
class RenameLook(Request, kind="rename_look"):
    """Give a look another name. Answered by `looks`.

    look: its id. name: the new one.
    """

    look: int
    name: str


@dataclass(frozen=True)
class CopyLook(Request, kind="copy_look"):
    """Keep a copy of a look. Answered by `looks`.

    look: its id.
    """

    look: int


@dataclass(frozen=True)
class MixLooks(Request, kind="mix_looks"):
    """Keep a mix of two looks: its lights are locked at the share `part` of the way from the first
    to the second. Answered by `looks`.

    first, second: their ids. part: 0 to 1. name: of the mix.
    """

    first: int
    second: int
    part: float
    name: str


@dataclass(frozen=True)
class CompareLooks(Request, kind="compare_looks"):
    """A request for pictures of looks whose lights hang elsewhere than now; for none, to stop.
    Answered by `started`; `renewed` then lists `look_plane/ID` and `look_clean/ID` of each: first
    with estimated planes of lights that hang nowhere else, later with rendered ones.

    looks: their ids.
    """

    looks: tuple[int, ...] = ()


@dataclass(frozen=True)
class DropLook(Request, kind="drop_look"):
    """Delete a look. Answered by `looks`.

    look: its id.
    """

    look: int


@dataclass(frozen=True)
class Propose(Request, kind="propose"):
    """Propose a lighting to the painter: it becomes a look with each light locked at the proposed
    level, and replaces an earlier proposal of that name. Answered by `looks`.

    lights: emission by name of light; other lights keep the emission of the current answer. name:
    of the proposal.
    """

    name: str
    lights: Mapping[str, RGB]
