"""A hand that works with layers at random, the same for the same seed."""

import sys
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import lightpaint as lp
from lightpaint.basis.light_basis import Origin
from lightpaint.basis.lights import BasisLight
from lightpaint.images.denoiser import Features
from lightpaint.paint import protocol
from lightpaint.paint.layers.layer_pixels import selection_mask
from lightpaint.paint.layers.layer_stack import Gradient, Layer, LayerKind
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.session_file import MemoryStore, Store
from lightpaint.pipeline.job.settings import Settings

#: Of the views: the first has more than one tile across.
SIZES = ((12, 70), (9, 8))


def bases_of(views: int = 2) -> list[lp.Basis]:
    """Two soft lights, seen from several places."""
    bases = []
    for k, size in enumerate(SIZES[:views]):
        rng = np.random.default_rng(k)
        images = rng.uniform(0.1, 1, (2, *size, 3)).astype(np.float32)
        lights = tuple(
            BasisLight(name, "point", "intensity", "W/sr", (0.5, 0.5, 0.5)) for name in "ab"
        )
        origin = Origin("made", "made", f"view {k}", 0, "separate", (0, 0), (0, 0))
        basis = lp.Basis(lights, images, np.zeros_like(images), np.zeros(size, bool), origin)
        bases.append(replace(basis, features=random_surfaces(rng, size)))
    return bases


def random_surfaces(rng: np.random.Generator, size: tuple[int, int]) -> Features:
    """Surfaces of any albedo, some of them without diffuse reflection."""
    albedo = rng.uniform(0, 1, (*size, 3)).astype(np.float32)
    albedo[rng.random(size) < 0.2] = 0
    return Features(albedo, np.zeros_like(albedo))


def identity_of(views: int = 2) -> Identity:
    return Identity.of(bases_of(views))


def open_session(store: Store, views: int = 2) -> Session:
    """A session on what a store holds."""
    bases = bases_of(views)
    current_looks = [basis.current_look for basis in bases]
    return Session(bases, current_looks, store, settings=Settings(), transform=lp.ViewTransform())


def random_mask(rng: np.random.Generator, size: tuple[int, int]) -> npt.NDArray[np.float32]:
    """Coverage: all of it, one value, or a part of the picture softly."""
    if rng.random() < 0.3:
        return np.full(size, rng.choice([1.0, 0.3]), np.float32)
    mask = np.clip(rng.normal(0, 1, size), 0, 1)
    mask[:, int(rng.integers(1, size[1])) :] = 0
    return mask.astype(np.float32)


def random_gradient(rng: np.random.Generator, size: tuple[int, int]) -> Gradient:
    """Light that fades out or becomes other light, or an adjustment, in any direction."""
    start, end = rng.uniform(-5, max(size), (2, 2)).round(int(rng.integers(3))).tolist()
    light, end_light = rng.uniform(0, 2, (2, 3)).tolist()
    has_light, has_end = bool(rng.random() < 0.7), bool(rng.random() < 0.5)
    return Gradient(
        ("linear", "radial")[int(rng.integers(2))],
        (start[0], start[1]),
        (end[0], end[1]) if rng.random() < 0.9 else (start[0], start[1]),
        (light[0], light[1], light[2]) if has_light else None,
        (end_light[0], end_light[1], end_light[2]) if has_light and has_end else None,
        is_incident=bool(rng.random() < 0.5),
    )


class RandomEditor:
    """Random strokes and changes of layers in a session. states: after each step that is done."""

    def __init__(self, seed: int, store: Store | None = None, views: int = 2) -> None:
        self.rng = np.random.default_rng(seed)
        self.session = open_session(store or MemoryStore(identity_of(views)), views)
        self.strokes = 0
        self.states = [self.state()]

    def pixels(self, session: Session | None = None) -> list[bytes]:
        """All targets, to the bit."""
        views = (session or self.session).views
        return [x.tobytes() for view in views for x in (view.image, view.importance)]

    def state(self, session: Session | None = None) -> tuple[Any, list[bytes], list[Any]]:
        """Layers, targets and selections."""
        views = (session or self.session).views
        selections = [view.selection for view in views]
        masks = [(x.bounds, selection_mask(x).tobytes()) for x in selections]
        return views.layers, self.pixels(session), masks

    def act(self, *, with_undo: bool = True) -> None:
        """Do something, whatever it is."""
        position = self.session.store.position
        ids = [layer.id for layer in self.session.views.layers if layer.id]
        choices = ["add", "add", "paint", "select"]
        choices += ["change", "drop", "delete", "order", "copy", "group", "drag"] if ids else []
        choices += ["undo"] if with_undo and position else []
        action = choices[self.rng.integers(len(choices))]
        number = int(self.rng.choice(ids)) if ids else 0
        if action == "add":
            self.add(("paint", "adjust", "weigh", "gradient")[self.rng.integers(4)])
        elif action == "paint":
            self.paint(self.session.views.layers[number])
        elif action == "drop":
            self.paint(self.session.views.layers[number], is_final=False)
            self.session.handle(protocol.DropStroke(self.strokes), {})
        elif action == "select":
            self.select()
        elif action == "undo":
            self.session.handle(protocol.Undo(), {})
        else:
            self.rearrange(action, number)
        del self.states[position + 1 :]
        if action == "undo":
            del self.states[self.session.store.position + 1 :]
            # What is undone is done again: then it is known what comes next.
            self.session.handle(protocol.Redo(), {})
        if self.session.store.position > len(self.states) - 1:
            self.states.append(self.state())

    def rearrange(self, action: str, number: int) -> None:
        """Change layers, their order or both."""
        layers = self.session.views.layers
        layer, new = layers[number], self.session.views.next_layer
        if action in ("change", "drag"):
            values = {
                "is_visible": bool(self.rng.random() < 0.7),
                "strength": float(self.rng.uniform(0, 2)),
                "importance": float(self.rng.choice([0.5, 1.0, 3.0])),
            }
            changed = Layer(**{**vars(layer), **values})
            if layer.gradient is not None:
                changed = replace(changed, gradient=random_gradient(self.rng, SIZES[0]))
            if action == "drag":
                half = Layer(**{**vars(layer), "strength": 0.5})
                self.change(layers=(half,), is_final=False)
            self.change(layers=(changed,))
        elif action == "delete":
            self.change(order=tuple(k for k in layers.ids if k != number))
        elif action == "order":
            self.change(order=tuple(int(k) for k in self.rng.permutation(layers.ids)))
        elif action == "copy" and layer.kind != "group":
            copy = Layer(**{**vars(layer), "id": new, "name": "copy"})
            self.change(layers=(copy,), copies={str(new): number})
        elif action == "group" and layer.kind != "group":
            inner = Layer(**{**vars(layer), "group": new})
            self.change(layers=(Layer(new, "group", "both"), inner))

    def change(self, **fields: Any) -> None:
        layers = self.session.views.layers
        order = fields.get("order")
        if order is not None:  # a group that goes frees its layers
            fields["layers"] = tuple(
                Layer(**{**vars(layer), "group": None})
                for layer in layers
                if layer.id in order and layer.group is not None and layer.group not in order
            )
        self.session.handle(protocol.ChangeLayers(**fields), {})

    def add(self, kind: LayerKind) -> None:
        """Make a layer with a stroke, the first of which is not the whole."""
        properties = Layer(
            self.session.views.next_layer,
            kind,
            f"{kind} {self.strokes}",
            gain=float(2 ** self.rng.uniform(-2, 2)),
            tint=(1.1, 1.0, 0.9),
            times=3.0,
            gradient=random_gradient(self.rng, SIZES[0]) if kind == "gradient" else None,
        )
        if self.rng.random() < 0.5:
            self.paint(properties, is_final=False)
            self.strokes -= 1
        self.paint(properties)

    def select(self) -> None:
        """Select a part of some view, or nothing."""
        view = int(self.rng.integers(len(self.session.views)))
        height, width = self.session.views[view].size
        left = int(self.rng.integers(width))
        mask = np.rint(255 * random_mask(self.rng, (height, width))).astype(np.uint8)
        request = protocol.Select((0, height, left, width), view=view)
        self.session.handle(request, {"mask": mask[:, left:] * (self.rng.random() < 0.8)})

    def paint(self, layer: Layer, *, is_final: bool = True) -> None:
        """Paint into a layer, in some view."""
        if layer.kind == "group":
            return
        views = self.session.views
        view = int(self.rng.integers(len(views)))
        height, width = views[view].size
        top, left = int(self.rng.integers(height // 2)), int(self.rng.integers(width // 2))
        if self.rng.random() < 0.4:
            top = left = 0
        shape = height - top, width - left
        arrays = {"importance": random_mask(self.rng, shape)}
        if not layer.is_mask:
            arrays["image"] = self.rng.uniform(0, 2, (*shape, 3)).astype(np.float32)
        self.strokes += 1
        is_new = layer.id not in views.layers.ids
        request = protocol.Paint(
            self.strokes,
            (top, height, left, width),
            is_final,
            view=view,
            layer=layer.id,
            properties=layer if is_new or is_final else None,
        )
        self.session.handle(request, arrays)


def main() -> None:
    """Work in a session file until somebody ends this process; say each step that is kept.

    Now and then the file keeps what the layers come to.
    """
    with Store.open(Path(sys.argv[1]), identity_of()) as store:
        hand = RandomEditor(7, store)
        for k in count():
            hand.act(with_undo=False)
            if k % 3 == 1 and (compositions := hand.session.compositions()) is not None:
                store.put_compositions(*compositions)
            print(store.position, flush=True)


if __name__ == "__main__":
    main()
