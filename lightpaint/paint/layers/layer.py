"""A layer of a painting: one request, with its name, visibility, strength and importance."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from math import isfinite
from typing import Any, Literal, get_args

from lightpaint.arrays import RGB

#: The effect of a layer on the pixels below it.
LayerKind = Literal["pixels", "paint", "adjust", "weigh", "gradient", "group"]

#: The layer of paint without a layer id; sessions from before layers existed have only this one.
PAINTING_ID = 0

#: Largest strength and importance of a layer, and characters of its name.
MAX_STRENGTH, MAX_FACTOR, MAX_NAME_LENGTH = 2.0, 1e4, 80


#: Largest coordinate of a gradient, in pixels, and largest light.
MAX_PLACE, MAX_GRADIENT_LIGHT = 1e6, 65504.0


@dataclass(frozen=True)
class Gradient:
    """Light, or an adjustment, that falls off from one place of a picture to another.

    shape: `linear`, across the line between them; `radial`, around `start` as far as `end`. start,
    end: (x, y) in pixels. light: at `start`, linear; null for an adjustment by the layer's `gain`
    and `tint`. end_light: at `end`; null to fade out. is_incident: whether it is light that arrives
    at surfaces, which their albedo reflects.
    """

    shape: Literal["linear", "radial"]
    start: tuple[float, float]
    end: tuple[float, float]
    light: RGB | None = None
    end_light: RGB | None = None
    is_incident: bool = False

    def __post_init__(self) -> None:
        if not all(abs(x) <= MAX_PLACE for x in (*self.start, *self.end)):
            raise ValueError(f"a gradient from {self.start} to {self.end}: beyond {MAX_PLACE:g}")
        for light in (self.light, self.end_light):
            if light is not None and not all(0 <= x <= MAX_GRADIENT_LIGHT for x in light):
                raise ValueError(f"light {light}: expected 0 to {MAX_GRADIENT_LIGHT:g}")
        if self.light is None and self.end_light is not None:
            raise ValueError("a gradient with light at its end alone")

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> "Gradient":
        """Return the gradient of plain values. Raises TypeError or ValueError otherwise."""
        values: dict[str, Any] = {
            k: tuple(v) if isinstance(v, list) else v for k, v in data.items()
        }
        return cls(**values)


@dataclass(frozen=True)
class Layer:
    """A layer of a painting, without its pixels. Ids are never used twice in a session.

    kind: `pixels` replaces the light below, with its own importance; `paint` mixes a colour over it
    by its coverage; `adjust` scales its luminance by `gain` and its colour by `tint`, and `weigh`
    its importance by `times`, where the layer's mask covers; `gradient` does what `gradient` says,
    within its mask; `group` has no pixels, and holds the layers whose `group` is its id. strength:
    0 to 2; adjustments and `weigh` take it as a power, so that 2 is twice the stops. importance:
    factor of its importance. id: its number. name: for people. is_visible: whether it counts.
    group: id of the group that it is in; null for none. gain, tint: factors of luminance and
    colour. times: factor of importance. gradient: for this kind alone.
    """

    id: int
    kind: LayerKind
    name: str = ""
    is_visible: bool = True
    strength: float = 1.0
    importance: float = 1.0
    group: int | None = None
    gain: float = 1.0
    tint: RGB = (1.0, 1.0, 1.0)
    times: float = 1.0
    gradient: Gradient | None = None

    def __post_init__(self) -> None:
        if self.kind not in get_args(LayerKind):
            kinds = ", ".join(get_args(LayerKind))
            raise ValueError(f"layer {self.id} of the kind {self.kind!r:.40}: expected {kinds}")
        if not 0 <= self.id < 2**53:
            raise ValueError(f"layer {self.id}: expected a number from 0, below 2**53")
        if len(self.name) > MAX_NAME_LENGTH:
            raise ValueError(f"a name of {len(self.name)} characters: at most {MAX_NAME_LENGTH}")
        if not 0 <= self.strength <= MAX_STRENGTH:
            raise ValueError(f"strength {self.strength:g}: expected 0 to {MAX_STRENGTH:g}")
        if not 0 < self.importance <= MAX_FACTOR:
            raise ValueError(f"importance {self.importance:g}: expected above 0, to {MAX_FACTOR:g}")
        for name, factors in (
            ("gain", (self.gain,)),
            ("tint", self.tint),
            ("times", (self.times,)),
        ):
            if not all(isfinite(x) and 0 < x <= MAX_FACTOR for x in factors):
                raise ValueError(f"{name} {factors}: expected above 0, to {MAX_FACTOR:g}")
        if (self.kind == "gradient") != (self.gradient is not None):
            raise ValueError(f"a layer of kind {self.kind}, and its gradient is {self.gradient}")
        if self.group is not None and self.kind == "group":
            raise ValueError("a group within a group: expected layers alone")

    @property
    def is_mask(self) -> bool:
        """True if its pixels have no colour."""
        return self.kind in ("adjust", "weigh", "gradient")

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> "Layer":
        """Return the layer that `as_json` wrote. Raises TypeError or ValueError otherwise."""
        gradient = data.get("gradient")
        made = {"gradient": None if gradient is None else Gradient.of(gradient)}
        return cls(**{**data, **made, "tint": tuple(data.get("tint", (1.0, 1.0, 1.0)))})

    def as_json(self) -> dict[str, Any]:
        """Return plain values, without default ones."""
        default = asdict(Layer(self.id, "paint"))
        values = {k: v for k, v in asdict(self).items() if k in ("id", "kind") or v != default[k]}
        return {k: _plain(v) for k, v in values.items()}


def _plain(value: Any) -> Any:
    """Return lists for tuples."""
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    return list(value) if isinstance(value, tuple) else value


#: The painting of a session without other layers.
PAINTING = Layer(PAINTING_ID, "pixels", "Painting")
