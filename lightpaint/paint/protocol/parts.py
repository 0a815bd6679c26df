"""Parts of what clients are told: records inside the messages of `events.py`."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from lightpaint.arrays import RGB
from lightpaint.paint.protocol.base import OPTIONAL


@dataclass(frozen=True)
class LightInfo:
    """What does not change of a light.

    present: its emission before anything was painted. parameter, plugin: where the scene has it.
    form: how the scene writes its emission. members: emitters that it is a group of. group: name
    of that group; null for a single emitter. is_fixed: whether it is kept as it is. is_scalar:
    whether it has one number for all channels. scale: what its stored plane is multiplied by.
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


@dataclass(frozen=True)
class ViewInfo:
    """One picture that is painted.

    size: height and width in pixels. objects: names, in the order of the picture `objects`.
    scales: what the stored plane of each light is multiplied by.
    """

    name: str
    size: tuple[int, int]
    objects: tuple[str, ...]
    scales: tuple[float, ...]


@dataclass(frozen=True)
class LookInfo:
    """A look that is kept. stamp: when, in seconds since 1970. thumbnail: name of its picture."""

    id: int
    name: str
    stamp: float | None
    weights: tuple[RGB, ...]
    thumbnail: str
    is_proposal: bool = False


@dataclass(frozen=True)
class TransformInfo:
    """The view transform that the pictures are seen through, and its exposure in stops."""

    name: str
    stops: float


@dataclass(frozen=True)
class TableInfo:
    """The grid of the view transforms' tables: points on a side, lowest and highest log2 light."""

    side: int
    low: float
    high: float


@dataclass(frozen=True)
class SampleCount:
    """Samples per pixel that have been rendered, and that are wanted."""

    spp: int
    wanted: int
    done: bool


@dataclass(frozen=True)
class HistoryInfo:
    """Labels of the last steps that can be taken back and done again; count: of all steps."""

    undo: tuple[str, ...]
    redo: tuple[str, ...]
    count: int


@dataclass(frozen=True)
class ResolvedFit:
    """How the painting is answered where nobody has set it, as of `lightpaint.Fit`."""

    space: str | None
    hold: float | None
    colors: str | None


@dataclass(frozen=True)
class Advice:
    """What keeps the lights from the paint and can be let go of.

    kind: of the constraint. names: lights of which it was asked. closes: share of what is missed
    that goes without it; null where it takes more than that. hold: the weaker hold to set.
    """

    kind: str
    names: tuple[str, ...]
    closes: float | None
    hold: float | None


@dataclass(frozen=True)
class Closeness:
    """How close an answer is in one view. delta_e_asked: ΔE of the present look."""

    headline: str
    help: Advice | None
    delta_e: float
    delta_e_asked: float
    sentences: tuple[str, ...]


@dataclass(frozen=True)
class LightAnswer:
    """The answer for one light.

    stops: against its present emission; null where it is, or was, off. kelvin: null for what is no
    white. share: of the light in the picture. error: how sure it is, in words. held: whether a
    constraint holds it. unreached: whether no paint asks for it.
    """

    emission: RGB
    stops: float | None
    kelvin: float | None
    swatch: str
    is_on: bool
    share: float
    error: str | None = field(default=None, metadata=OPTIONAL)
    held: bool | None = field(default=None, metadata=OPTIONAL)
    unreached: bool | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, kw_only=True)
class Findings:
    """What is known of an exact answer; the sentences come later than the lights.

    lights: in the order of the state. shares: of each light, by view, where there are several.
    of_views: how close each view is; null for views that are not painted.
    """

    lights: tuple[LightAnswer, ...] | None = field(default=None, metadata=OPTIONAL)
    shares: tuple[tuple[float, ...], ...] | None = field(default=None, metadata=OPTIONAL)
    headline: str | None = field(default=None, metadata=OPTIONAL)
    help: Advice | None = field(default=None, metadata=OPTIONAL)
    delta_e: float | None = field(default=None, metadata=OPTIONAL)
    delta_e_asked: float | None = field(default=None, metadata=OPTIONAL)
    sentences: tuple[str, ...] | None = field(default=None, metadata=OPTIONAL)
    of_views: tuple[Closeness | None, ...] | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, kw_only=True)
class Standing:
    """What can be undone, and what is asked of the lights and of the answer.

    asked: by name of light, keys and values as in a lights file. ties: names on one dimmer.
    settings: what somebody has set. meant: what that comes to.
    """

    history: HistoryInfo | None = field(default=None, metadata=OPTIONAL)
    asked: Mapping[str, Mapping[str, Any]] | None = field(default=None, metadata=OPTIONAL)
    ties: tuple[tuple[str, ...], ...] | None = field(default=None, metadata=OPTIONAL)
    settings: Mapping[str, Any] | None = field(default=None, metadata=OPTIONAL)
    meant: ResolvedFit | None = field(default=None, metadata=OPTIONAL)


#: How something is said to a person.
Tone = Literal["info", "warn"]
