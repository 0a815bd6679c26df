"""Records inside events."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from lightpaint.arrays import RGB
from lightpaint.paint.layers.layer_stack import Gradient, Layer
from lightpaint.paint.protocol.base import OPTIONAL
from lightpaint.paint.store.history_steps import Region


@dataclass(frozen=True)
class ConsoleInfo:
    """The console that the answer can be sent to.

    address: target, universes, source and priority in words. is_on: whether it follows the brush.
    is_dark: whether it was blacked out. trouble: why nothing leaves, in a sentence.
    """

    address: str
    is_on: bool
    is_dark: bool
    trouble: str | None = None


@dataclass(frozen=True)
class EmitterInfo:
    """An emitter of a lamp, such as its red LEDs. swatch: its colour for a screen, as in CSS."""

    name: str
    swatch: str


@dataclass(frozen=True)
class LightInfo:
    """The constant properties of a light.

    present: its emission before anything was painted. parameter, plugin: its definition in the
    scene. form: how the scene writes its emission. members: its emitters, if it is a group. group:
    name of that group; null for a single emitter. is_fixed: whether it is not adjusted. is_scalar:
    whether one number stands for all channels. scale: factor of its stored plane. name, label: its
    name in the scene, and as people read it. unit: of its emission. emitters: those that mix the
    light of a lamp, if its lights file lists them. address: its fixture and first channel on a
    console; "" if unknown. lamp: of which it is an emitter, where renders have spectra; "" for a
    whole light.
    """

    name: str
    label: str
    unit: str
    parameter: str
    plugin: str
    form: str
    members: tuple[str, ...]
    group: str | None
    present: RGB
    is_fixed: bool
    is_scalar: bool
    scale: float
    emitters: tuple[EmitterInfo, ...] = ()
    address: str = ""
    lamp: str = ""


@dataclass(frozen=True)
class ImageInfo:
    """A light that is an image: its texels are lights.

    places: index of the light that each texel is, row by row from the top; in a symmetric image two
    texels are one light; where some texels are finer than others, several places are one texel; -1
    for one that is not adjusted, or only together with others. shares: part of the image that each
    place covers, which add up to 1. aspect: width of its map over the height.
    """

    name: str
    places: tuple[tuple[int, ...], ...]
    shares: tuple[tuple[float, ...], ...]
    aspect: float


#: Three coordinates in units of the scene.
Place = tuple[float, ...]


@dataclass(frozen=True)
class LightPlace:
    """The place of a light, and its target.

    position: null for one at infinity, or without a place. direction: unit vector along its axis;
    null for one without an axis. target: the requested point, or else the surface on its axis.
    cutoff, beam: degrees from its axis; null for all but spots. rail: both ends of its rail.
    immovable_reason: why it cannot be moved; "" if it can.
    """

    position: Place | None
    direction: Place | None
    target: Place | None
    cutoff: float | None
    beam: float | None
    rail: tuple[Place, Place] | None
    immovable_reason: str


@dataclass(frozen=True)
class PlanObject:
    """An object of the scene, seen from above.

    corners: of its outline, which is convex, in the two axes beside the upward one, in their order.
    """

    name: str
    corners: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class SkyAxes:
    """The turn of the map of a sky.

    name: of the image. from_world: three rows of a matrix that takes a direction from the scene to
    the map's own axes: its first row is up (0, 1, 0), and column x of n is at the azimuth
    2π (x + 1/2) / n from −z towards x.
    """

    name: str
    from_world: tuple[Place, ...]


@dataclass(frozen=True)
class Camera:
    """A camera without a lens. Pixel (x, y) sees origin + s · (x · x_axis + y · y_axis + forward).

    is_parallel: all rays have the direction `forward` and begin at origin + x · x_axis + y ·
    y_axis. origin, x_axis, y_axis, forward: vectors in units of the scene.
    """

    origin: Place
    x_axis: Place
    y_axis: Place
    forward: Place
    is_parallel: bool


@dataclass(frozen=True)
class MeasuredPlane:
    """A plane on which illuminance is measured, in one of the cases if there are several.

    name: as people read it, with the case. plane, case: names of both; "" is the light of the
    scene. size: rows and columns of a picture of it. cells: row and column of each point. points:
    where they are, in units of the scene. sides: of the cell of each point, across and along, six
    numbers; null for listed points. seen: for each view, the indices of the points that nothing
    covers in its picture, which may lie beyond its edges.
    """

    name: str
    plane: str
    case: str
    size: tuple[int, int]
    cells: tuple[tuple[int, int], ...]
    points: tuple[tuple[float, ...], ...]
    sides: tuple[tuple[float, ...], ...] | None
    seen: tuple[tuple[int, ...], ...]


@dataclass(frozen=True)
class PlanesInfo:
    """The measuring planes.

    floor_m2: the area that power is divided by; null without one. budget_watts: the most power that
    is allowed; null if any is. cameras: the camera of each view; null for one that is not a
    pinhole.
    """

    planes: tuple[MeasuredPlane, ...]
    floor_m2: float | None
    budget_watts: float | None
    cameras: tuple[Camera | None, ...]


@dataclass(frozen=True)
class ViewInfo:
    """A view that is painted.

    size: height and width in pixels. objects: names, in the order of the picture `objects`. scales:
    factor of the stored plane of each light. plane_size: height and width of these planes, whose
    pixels are means over blocks of the view's if they are fewer, as of many lights. has_mixes:
    whether the lights are too many for a page to hold their planes: it shows pictures of that size
    that the session mixes (`mix`).
    """

    name: str
    size: tuple[int, int]
    objects: tuple[str, ...]
    scales: tuple[float, ...]
    plane_size: tuple[int, int]
    has_mixes: bool = False


#: Records of layers, which messages have as they are.
LAYER_RECORDS = (Layer, Gradient)


@dataclass(frozen=True, kw_only=True)
class LayerInfo(Layer):
    """A layer, and where its pixels are: the picture `layer/ID`, in each view.

    regions: of that picture, by view; empty without coverage. accents: factor of its importance
    there, since the whole picture is painted. revision: grows when its pixels change.
    """

    regions: tuple[Region, ...]
    accents: tuple[float, ...]
    revision: int


@dataclass(frozen=True)
class LayerList:
    """The layers of the painting. layers: the lowest first. next: the id of the next new one."""

    layers: tuple[LayerInfo, ...]
    next: int


@dataclass(frozen=True)
class SelectionInfo:
    """The selected parts: the picture `selection/VIEW`, (rows, columns) uint8, in each view.

    regions: of that picture, by view; empty without a selection. revision: grows when one changes.
    """

    regions: tuple[Region, ...]
    revision: int


@dataclass(frozen=True)
class LookInfo:
    """A kept look. stamp: time in seconds since 1970. thumbnail: name of its picture.

    lights: names of its lights, which may differ from the current ones. weights: of each. places:
    as in `EditState`. id: a number that no other look has. is_proposal: whether an observer has
    proposed it.
    """

    id: int
    name: str
    stamp: float | None
    lights: tuple[str, ...]
    weights: tuple[RGB, ...]
    places: str
    thumbnail: str
    is_proposal: bool = False


@dataclass(frozen=True)
class TransformInfo:
    """The view transform that the pictures are seen through. name: its own. stops: its exposure."""

    name: str
    stops: float


@dataclass(frozen=True)
class TableInfo:
    """The grid of the view transforms' tables.

    side: points on a side. low, high: lowest and highest log2 light.
    """

    side: int
    low: float
    high: float


@dataclass(frozen=True)
class SampleCount:
    """Samples per pixel.

    spp: of the current basis. target_spp: of the final one. is_complete: whether all are there.
    """

    spp: int
    target_spp: int
    is_complete: bool


@dataclass(frozen=True)
class HistoryInfo:
    """The history. undo, redo: labels of the last steps that can be. count: of all steps."""

    undo: tuple[str, ...]
    redo: tuple[str, ...]
    count: int


@dataclass(frozen=True)
class StepInfo:
    """A step of the history. stamp: time in seconds since 1970; null if unknown.

    id: a number that no other step has; the picture `step/ID` shows the answer after it.
    is_milestone: the last step before a pause or before everything was replaced, or the last of
    many. label: what was done.
    """

    id: int
    label: str
    stamp: float | None
    is_milestone: bool


@dataclass(frozen=True)
class SearchInfo:
    """A search for places of lights that has ended, beside the steps of the history.

    after: id of the last step when it ended, which is its own if it found something; 0 for none.
    title: what was searched for. text: what came of it. tried: sentences on what was tried. stamp:
    time in seconds since 1970. id: a number that no other search has. seconds: that it took.
    """

    id: int
    after: int
    title: str
    text: str
    tried: tuple[str, ...]
    stamp: float
    seconds: float


@dataclass(frozen=True)
class PresetInfo:
    """A preset: a request for a whole scene. Its picture is `preset/NAME`.

    has_subject: whether it is about one object. name: in requests. title, description: for people.
    """

    name: str
    title: str
    description: str
    has_subject: bool


@dataclass(frozen=True)
class ReferenceInfo:
    """A reference. Its pictures are `reference/ID`, (h, w, 3) uint8 as the session's view transform
    shows it, and `reference_light/ID`, its light, reduced, (h, w, 3) float16.

    id: a number that no other reference has. name: of its file.
    """

    id: int
    name: str


@dataclass(frozen=True, kw_only=True)
class RenderInfo:
    """A final render. Its small picture is `render/ID`, (h, w, 3) uint8, and the bytes of its files
    are `render_file/ID/NAME`, uint8, once it is done.

    name: as requested. height: null until it is known. state: `waiting` for an earlier one; the
    others speak for themselves. done, total: its passes. text: why it has failed. files: paths of
    those that were written. id: a number that no other render has. view, width, spp, formats: as
    requested.
    """

    id: int
    name: str
    view: int
    width: int
    height: int | None = None
    spp: int
    formats: tuple[str, ...]
    state: Literal["waiting", "rendering", "done", "stopped", "failed"] = "waiting"
    done: int = 0
    total: int = 0
    text: str = ""
    files: tuple[str, ...] = ()


@dataclass(frozen=True)
class PlacePair:
    """Two places that should look alike: (x, y) as shares of width and height, 0 to 1.

    reference: the place in the reference. picture: the place in the view.
    """

    reference: tuple[float, float]
    picture: tuple[float, float]


@dataclass(frozen=True)
class ResolvedFit:
    """The resolved values of all settings, as in `lightpaint.Fit`.

    space: `display` or `linear`. hold: strength of the hold. colors: freedom of the lights.
    """

    space: str | None
    hold: float | None
    colors: str | None


@dataclass(frozen=True, kw_only=True)
class EditState:
    """The steps that can be undone, and the requests in effect.

    constraints: by name of light, keys and values as in a lights file. ties: names on one dimmer.
    settings: those that were set. effective_settings: those in effect. poses: of moved lights, by
    name. added_lights: names of lights that the scene does not have. places: a text, equal for
    equal places of all lights; "" if all hang as in the scene. layers: of the painting. master:
    factor of all lights but fixed ones, by the master dimmer: a light shines at `master` times its
    weight. selection: the part of the painting that strokes keep to.

    earlier: constraints of lights that are locked or off, by name, from before they were, to be
    sent when they are released. kept: names of those that are locked only since they were moved.
    is_started: whether the solve starts from lamps that were set by hand. history: labels of steps
    to undo and redo.
    """

    history: HistoryInfo | None = field(default=None, metadata=OPTIONAL)
    constraints: Mapping[str, Mapping[str, Any]] | None = field(default=None, metadata=OPTIONAL)
    ties: tuple[tuple[str, ...], ...] | None = field(default=None, metadata=OPTIONAL)
    settings: Mapping[str, Any] | None = field(default=None, metadata=OPTIONAL)
    poses: Mapping[str, Mapping[str, Any]] | None = field(default=None, metadata=OPTIONAL)
    added_lights: tuple[str, ...] | None = field(default=None, metadata=OPTIONAL)
    places: str | None = field(default=None, metadata=OPTIONAL)
    effective_settings: ResolvedFit | None = field(default=None, metadata=OPTIONAL)
    layers: LayerList | None = field(default=None, metadata=OPTIONAL)
    master: float | None = field(default=None, metadata=OPTIONAL)
    selection: SelectionInfo | None = field(default=None, metadata=OPTIONAL)
    earlier: Mapping[str, Mapping[str, Any]] | None = field(default=None, metadata=OPTIONAL)
    kept: tuple[str, ...] | None = field(default=None, metadata=OPTIONAL)
    is_started: bool | None = field(default=None, metadata=OPTIONAL)


#: Tone of a message to the user.
Tone = Literal["info", "warn"]
