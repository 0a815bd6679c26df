"""Layers of a painting: one request each, and their order in a session.

A layer has a name, visibility, strength and importance.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from math import isfinite
from typing import Any, Literal, get_args

from lightpaint.arrays import RGB
from lightpaint.errors import PaintError
from lightpaint.paint.store.history_steps import Step

#: The effect of a layer on the pixels below it.
LayerKind = Literal["pixels", "paint", "adjust", "weigh", "gradient", "group"]

#: The layer of paint without a layer id; sessions from before layers existed have only this one.
PAINTING_ID = 0

#: Largest strength and importance of a layer, and characters of its name.
MAX_STRENGTH, MAX_FACTOR, MAX_NAME_LENGTH = 2.0, 1e4, 80


#: Largest coordinate of a gradient, in pixels, and largest light.
MAX_PLACE, MAX_GRADIENT_LIGHT = 1e6, 65504.0

#: Maximum number of layers in a session.
MAX_LAYERS = 1000

#: The change of a stack, as JSON: `order`, ids before and after, if it changed; `layers`, by id,
#: the layer before and after, null where there is none.
StackChange = Mapping[str, Any]


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

    def within(self, group: "Layer") -> "Layer":
        """Return the layer with the strength and importance of its group included."""
        return replace(
            self,
            strength=min(MAX_STRENGTH, self.strength * group.strength),
            importance=min(MAX_FACTOR, self.importance * group.importance),
        )

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


@dataclass(frozen=True)
class LayerStack:
    """Layers, the lowest first; the layers of a group lie directly below it."""

    layers: tuple[Layer, ...] = (PAINTING,)

    @classmethod
    def of(cls, layers: Iterable[Layer]) -> "LayerStack":
        """Return a stack in which the layers of each group lie directly below it.

        It always has the layer of paint without an id, if need be below all others. Raises
        PaintError for two layers of one id, a group that does not exist, or too many.
        """
        listed = tuple(layers)
        if all(layer.id != PAINTING.id for layer in listed):
            listed = (PAINTING, *listed)
        by_id = {layer.id: layer for layer in listed}
        if len(by_id) < len(listed):
            raise PaintError("two layers of one id")
        if len(listed) > MAX_LAYERS:
            raise PaintError(f"{len(listed)} layers: at most {MAX_LAYERS} are kept; delete some")
        for layer in listed:
            if layer.group is not None and _kind(by_id.get(layer.group)) != "group":
                raise PaintError(f"layer {layer.id} is in the group {layer.group}, which is none")
        ordered: list[Layer] = []
        for layer in listed:
            if layer.kind == "group":
                ordered += [inner for inner in listed if inner.group == layer.id]
            if layer.group is None:
                ordered.append(layer)
        return cls(tuple(ordered))

    def __iter__(self) -> Iterator[Layer]:
        return iter(self.layers)

    def __len__(self) -> int:
        return len(self.layers)

    @property
    def ids(self) -> tuple[int, ...]:
        """Ids of the layers, the lowest first."""
        return tuple(layer.id for layer in self.layers)

    def __getitem__(self, number: int) -> Layer:
        """Return the layer of an id. Raises PaintError if there is none."""
        for layer in self.layers:
            if layer.id == number:
                return layer
        raise PaintError(f"there is no layer {number}")

    def with_layers(
        self, changed: Sequence[Layer], order: Sequence[int] | None = None
    ) -> "LayerStack":
        """Return the stack with other layers of these ids; new ones lie on top.

        order: the ids of all layers that stay, the lowest first; None for the current order. Raises
        PaintError for an unknown id.
        """
        by_id = {layer.id: layer for layer in (*self.layers, *changed)}
        for layer in changed:
            if layer.id in self.ids and self[layer.id].kind != layer.kind:
                raise PaintError(f"layer {layer.id} is of kind {self[layer.id].kind}")
        if unknown := [number for number in order or () if number not in by_id]:
            raise PaintError(f"there is no layer {unknown[0]}")
        return LayerStack.of(by_id[number] for number in (by_id if order is None else order))

    def shown(self) -> tuple[Layer, ...]:
        """Return the visible layers, with the strength and importance of their groups included.

        They have no names, so that layers with equal effect compare equal. Strength 0 hides a
        layer.
        """
        shown, by_id = [], {layer.id: layer for layer in self.layers}
        for layer in self.layers:
            group = None if layer.group is None else by_id[layer.group]
            if layer.kind == "group" or not (layer.is_visible and (not group or group.is_visible)):
                continue
            effective = layer if group is None else layer.within(group)
            if effective.strength > 0:
                shown.append(replace(effective, name="", group=None))
        return tuple(shown)

    def change_to(self, after: "LayerStack") -> StackChange:
        """Return the change from this state to another; empty if there is none."""
        change: dict[str, Any] = {}
        if self.ids != after.ids:
            change["order"] = [list(self.ids), list(after.ids)]
        states = [{layer.id: layer for layer in stack} for stack in (self, after)]
        changed = {
            str(number): [None if layer is None else layer.as_json() for layer in pair]
            for number in dict.fromkeys((*self.ids, *after.ids))
            if len(set(pair := [state.get(number) for state in states])) > 1
        }
        return {**change, "layers": changed} if changed else change

    def changed(self, change: StackChange, *, is_back: bool = False) -> "LayerStack":
        """Return the stack after a change, or before it. A lost layer is ignored."""
        by_id = {layer.id: layer for layer in self.layers}
        for number, pair in change.get("layers", {}).items():
            by_id.pop(int(number), None)
            if (data := pair[0 if is_back else 1]) is not None:
                by_id[int(number)] = Layer.of(data)
        orders = change.get("order")
        order = self.ids if orders is None else orders[0 if is_back else 1]
        layers = [by_id[number] for number in order if number in by_id]
        known = {layer.id for layer in layers if layer.kind == "group"}
        return LayerStack.of(
            layer if layer.group in known else replace(layer, group=None) for layer in layers
        )


def stack_after(steps: Sequence[Step]) -> LayerStack:
    """Return the layers after these steps."""
    # All changes at once, since a stack is checked in a time that grows with its layers.
    changes = [change for step in steps if (change := step.fields.get("stack"))]
    orders = [change["order"] for change in changes if "order" in change]
    pairs = {n: pair for change in changes for n, pair in change.get("layers", {}).items()}
    change = {"layers": pairs, **({"order": orders[-1]} if orders else {})}
    return LayerStack().changed(change) if changes else LayerStack()


def next_layer_id(steps: Sequence[Step]) -> int:
    """Return the first id above all ids of layers in these steps."""
    numbers = (int(n) for step in steps for n in step.fields.get("stack", {}).get("layers", ()))
    return 1 + max(numbers, default=PAINTING.id)


def _kind(layer: Layer | None) -> str | None:
    return None if layer is None else layer.kind
