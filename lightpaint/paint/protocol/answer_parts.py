"""Records inside events that say how close an answer is, and what each light does for it."""

from dataclasses import dataclass, field
from typing import Literal

from lightpaint.arrays import RGB
from lightpaint.paint.protocol.base import OPTIONAL


@dataclass(frozen=True)
class Advice:
    """A constraint that keeps the lights from the paint and can be loosened.

    kind: of the constraint; `reach` if there is none, but moving lights may help, and `light` if a
    new light may, since all that reach the paint light the rest, too. names: its
    lights. gain: share of the error that disappears without it; null if more is needed. hold: the
    weaker hold to set. delta_e: mean ΔE over the paint now and without it; null if not known.
    """

    kind: str
    names: tuple[str, ...]
    gain: float | None
    hold: float | None
    delta_e: tuple[float, float] | None = None


@dataclass(frozen=True)
class Closeness:
    """Closeness of an answer in one view. delta_e_present: ΔE of the current look.

    headline: how close it is, in words. help: a constraint to loosen; null for none. delta_e: mean
    ΔE over the paint. sentences: what stands below the headline.
    """

    headline: str
    help: Advice | None
    delta_e: float
    delta_e_present: float
    sentences: tuple[str, ...]


#: The choices of `colors` whose answers can be compared: each lamp as it is, as the paint asks, and
#: any colour.
AnswerColors = Literal["own", "gentle", "free"]


@dataclass(frozen=True)
class WishDelivery:
    """The share of a wish that came: of a `layer`, of a `group` of layers, or of a `wish`, which is
    a stroke in a layer.

    layers: ids of its layers. brightness, color: share of the asked change that came; null if none
    was asked. delta_e: of its lit parts, against the painting. name: of the layer, group or stroke.
    kind: `layer`, `group` or `wish`. is_darker: whether it asks for less light.
    """

    name: str
    kind: str
    layers: tuple[int, ...]
    brightness: float | None
    color: float | None
    delta_e: float
    is_darker: bool = False


@dataclass(frozen=True)
class AnswerChoice:
    """The exact answer with one choice of `colors`. Its picture is `choice/COLORS`, in each view.

    is_chosen: whether it is the answer itself. delta_e: its mean ΔE over the paint. brightness,
    color: mean share of the asked changes that came, from 0 to 1, in which each wish counts alike;
    null if none was asked. worst: the wish of which least came; null if at least three quarters of
    each did. colors: the choice.
    """

    colors: AnswerColors
    is_chosen: bool
    delta_e: float
    brightness: float | None
    color: float | None
    worst: WishDelivery | None


@dataclass(frozen=True)
class LightAnswer:
    """The answer for one light.

    stops: relative to its current emission; null if it is, or was, off. kelvin: null for a colour
    that is not white. share: of the light in the picture. error: its uncertainty, in words.
    is_constrained: whether a constraint limits it. is_unreached: whether no paint depends on it.
    emission: linear, in the unit of the light. swatch: its colour for a screen, as in CSS. is_on:
    whether it shines. drives: of the emitters of a lamp, 0 to 1, in their order. slot_delta_e: of a
    lamp with a colour wheel, how far its slot is from the colour that was solved for. rendering:
    how the lamp renders colours, in words; null where its spectra are unknown, and of lights far
    from white.
    """

    emission: RGB
    stops: float | None
    kelvin: float | None
    swatch: str
    is_on: bool
    share: float
    error: str | None = field(default=None, metadata=OPTIONAL)
    is_constrained: bool | None = field(default=None, metadata=OPTIONAL)
    is_unreached: bool | None = field(default=None, metadata=OPTIONAL)
    drives: tuple[float, ...] | None = field(default=None, metadata=OPTIONAL)
    slot_delta_e: float | None = field(default=None, metadata=OPTIONAL)
    rendering: str | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True)
class PlaneWish:
    """A wish for a measuring plane or, as `power`, for all lamps together.

    asked: in lx, in W, or as a share. reached: what came of it, at the sure end of its interval;
    null if that is unknown. to: the other plane of a ratio; "" for none.
    """

    kind: Literal["mean", "uniformity", "max", "ratio", "power"]
    asked: float
    reached: float
    is_met: bool
    to: str = ""


@dataclass(frozen=True)
class PlaneLight:
    """The illuminance on a measuring plane, in lx. mean_error: a standard error. uniformity: least
    over mean. lux: at each of its points.
    """

    mean: float
    mean_error: float
    uniformity: float
    least: float
    most: float
    lux: tuple[float, ...]
    wishes: tuple[PlaneWish, ...]


@dataclass(frozen=True)
class PlanesReading:
    """The illuminance on measuring planes under an answer and the master dimmer.

    planes: in the order of the state. watts: power of all lamps; null if the power of one is
    unknown. power: the limit of it; null for none. is_required: whether answers have to meet the
    wishes, as far as they can be met. is_old: whether lights have been moved, added or removed
    since the planes were measured.
    """

    planes: tuple[PlaneLight, ...]
    watts: float | None
    power: PlaneWish | None
    is_required: bool
    is_old: bool


@dataclass(frozen=True, kw_only=True)
class Findings:
    """Properties of an answer; the sentences follow later than the lights.

    lights: in the order of the state. shares: of each light, by view, if there are several.
    closeness: of each view; null for unpainted views. deliveries: how much of each wish came, in
    all views together. headline, help, delta_e, delta_e_present, sentences: as in `Closeness`, of
    the view with the largest error.
    """

    lights: tuple[LightAnswer, ...] | None = field(default=None, metadata=OPTIONAL)
    shares: tuple[tuple[float, ...], ...] | None = field(default=None, metadata=OPTIONAL)
    headline: str | None = field(default=None, metadata=OPTIONAL)
    help: Advice | None = field(default=None, metadata=OPTIONAL)
    delta_e: float | None = field(default=None, metadata=OPTIONAL)
    delta_e_present: float | None = field(default=None, metadata=OPTIONAL)
    sentences: tuple[str, ...] | None = field(default=None, metadata=OPTIONAL)
    closeness: tuple[Closeness | None, ...] | None = field(default=None, metadata=OPTIONAL)
    deliveries: tuple[WishDelivery, ...] | None = field(default=None, metadata=OPTIONAL)
