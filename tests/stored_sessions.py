"""Steps and looks to keep in sessions, each of its number, and all that a session holds."""

from dataclasses import replace
from typing import Any

import numpy as np

from lightpaint.paint.store.history_steps import (
    Identity,
    Patch,
    Pixels,
    Step,
    StoredLook,
    ViewIdentity,
)
from lightpaint.paint.store.session_file import Store

SIZE = (12, 10)
IDENTITY = Identity("room.xml", "0f0f", ("panel", "bulb"), (ViewIdentity("camera", SIZE),))


def patch(rng: np.random.Generator, size: tuple[int, int] = SIZE) -> Patch:
    """Some region, with what is painted before and after; also none at all."""
    (top, bottom), (left, right) = (sorted(rng.integers(0, n + 1, 2).tolist()) for n in size)
    shape = bottom - top, right - left
    marks = [None if rng.random() < 0.5 else rng.random((*shape, 3)) < 0.1 for _ in range(2)]
    pixels = [
        Pixels(
            rng.standard_normal((*shape, 3)).astype(np.float32),
            rng.integers(0, 3, shape).astype(np.float32),
            at_least,
        ).copy()
        for at_least in marks
    ]
    return Patch((top, bottom, left, right), pixels[0], pixels[1])


def step(number: int) -> Step:
    """One of a kind of its own."""
    rng = np.random.default_rng(number)
    fields = {"before": {"n": number - 1}, "after": {"n": number, "é": [0.1, None, "\u202e"]}}
    patches = tuple(replace(patch(rng), view=view) for view in range(number % 3))
    return Step("stroke", f"stroke {number}", fields, patches)


def look(number: int, of: int) -> StoredLook:
    rng = np.random.default_rng(of)
    arrays = {
        "image": rng.random((*SIZE, 3)).astype(np.float32),
        "weights": rng.random((2, 3)),
        "thumbnail": rng.integers(0, 256, (3, 4, 3)).astype(np.uint8),
    }
    return StoredLook(number, {"name": f"look {of}"}, arrays)


def told(pixels: Any) -> Any:
    snapshot = [None if x is None else (x.shape, x.dtype.str, x.tobytes()) for x in pixels or ()]
    return None if pixels is None else tuple(snapshot)


def content(store: Store) -> Any:
    """All that is in it, to compare."""
    steps = [
        (
            one.kind,
            one.label,
            one.fields,
            [(x.view, x.region, told(x.before), told(x.after)) for x in one.patches],
        )
        for one in store.steps
    ]
    looks = [
        (one.id, one.fields, list(one.arrays), told(one.arrays.values())) for one in store.looks()
    ]
    return store.position, steps, looks


def big(number: int) -> Step:
    """A step of some 30 kB."""
    rng = np.random.default_rng(number)
    light = Pixels(rng.random((30, 40, 3)).astype(np.float32), np.ones((30, 40), np.float32))
    return Step("stroke", f"big {number}", {}, (Patch((0, 30, 0, 40), light, light),))


class Plain(Store):
    """Plain lists, as they are meant."""

    def __init__(self, steps: list[Step], position: int, looks: dict[int, StoredLook]) -> None:
        self.steps, self.position, self._kept = steps, position, looks

    def looks(self) -> list[StoredLook]:
        return list(self._kept.values())
