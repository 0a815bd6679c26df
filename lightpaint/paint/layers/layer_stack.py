"""The layers of a session in their order, and the differences between two states of them."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from lightpaint.errors import PaintError
from lightpaint.paint.layers.layer import MAX_FACTOR, MAX_STRENGTH, PAINTING, Layer
from lightpaint.paint.store.history_steps import Step

#: Maximum number of layers in a session.
MAX_LAYERS = 1000

#: The change of a stack, as JSON: `order`, ids before and after, if it changed; `layers`, by id,
#: the layer before and after, null where there is none.
StackChange = Mapping[str, Any]


@dataclass(frozen=True)
class LayerStack:
    """Layers, the lowest first; those of a group lie directly below it."""

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
            strength, importance = layer.strength, layer.importance
            if group is not None:
                strength = min(MAX_STRENGTH, strength * group.strength)
                importance = min(MAX_FACTOR, importance * group.importance)
            if strength > 0:
                plain = replace(layer, name="", group=None)
                shown.append(replace(plain, strength=strength, importance=importance))
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
