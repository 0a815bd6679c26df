"""A painting in progress, and the lighting that answers it: the only brain of the painter.

A session hears what a page says, and says what has come of it; it reads and writes no file but
through its store, starts no thread, and renders nothing. What is done is a list of steps, each
with what was before it; the canvas, what is asked, and so the answer follow from them alone, so
that undoing, loading and painting in another order lead to the same bits.

While a brush is down the answer is that of `Live`; `settle` finds the exact one, which is what
`lightpaint solve` finds for the exported painting.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.colour.transform import ViewTransform
from lightpaint.errors import LightpaintError, PaintError
from lightpaint.lighting.analysis.analyse import analyse
from lightpaint.lighting.analysis.uncertainty import correct_noise
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.file import constraints_of
from lightpaint.lighting.fit import meant_by
from lightpaint.lighting.live import Live
from lightpaint.lighting.problem import Problem, reduced_by
from lightpaint.lighting.solution import Solution
from lightpaint.lighting.solve import solution_of
from lightpaint.paint import protocol
from lightpaint.paint.frames import Message
from lightpaint.paint.steps import Patch, Pixels, Region, Step, painted_by
from lightpaint.paint.store import Store
from lightpaint.paint.told import lights_fields
from lightpaint.paint.wishes import Wishes
from lightpaint.report.sentences import what_is_missed
from lightpaint.report.verdict import headline
from lightpaint.settings import Settings
from lightpaint.target.target import Target

#: Importance of a pixel beyond which it is a slip, and light, beside the present look's brightest.
MOST, BRIGHTEST = 1e4, 1e9


@dataclass(frozen=True)
class Moment:
    """What was painted and asked at one time, for a solve that takes longer than a stroke.

    version: of the session then. target: None where nothing was painted.
    """

    version: int
    basis: Basis
    target: Target | None
    wishes: Wishes
    settings: Settings
    constraints: Constraints

    def solution(self) -> Solution | None:
        """The exact answer; None where nothing is painted. Raises LightpaintError."""
        if self.target is None:
            return None
        problem = Problem.of(
            self.basis, self.target, constraints=self.constraints, fit=self.settings
        )
        solution = solution_of(problem)
        if self.settings.corrects_noise(is_known=self.basis.knows_noise):
            solution = correct_noise(solution)
        return solution

    def beyond(self) -> tuple[list[str], npt.NDArray[np.uint8]]:
        """What no light can make of the painting: sentences, and a picture (h, w) of where.

        The best with nothing else asked: nothing held, any colour, no constraints. 255 stands for
        what is missed by all that a display has.
        """
        height, width = self.basis.size
        if self.target is None:
            return ["Nothing is painted yet."], np.zeros((height, width), np.uint8)
        solution = self.solution()
        assert solution is not None
        [analysis] = analyse(solution)
        free = replace(self.settings, hold=0.0, colors="free")
        best = solution_of(Problem.of(self.basis, self.target, fit=free))
        transform = best.problem.fit.transform or ViewTransform()
        shown = transform.encode(self.basis.mix(best.weights))
        missed = np.abs(shown - transform.encode(self.target.image)).max(axis=-1)
        missed = np.where(self.target.importance > 0, np.clip(missed, 0, 1), 0)
        said = [headline(analysis.seen), *what_is_missed(analysis.diagnosis)]
        return said, np.round(255 * missed).astype(np.uint8)


class Session:
    """What one person paints of one view.

    Args:
        basis: What the lights do, which may get better (`improve`).
        present: (h, w, 3) linear, the present look without its grain: the canvas to begin with.
        store: Where steps and looks are kept.
        settings: How the painting is to be answered, but for what is set in the session.
        transform: What the painting is seen through.
        name: What the painting is called.

    Raises:
        PaintError: If the store is of something else.
    """

    def __init__(
        self,
        basis: Basis,
        present: Floats,
        store: Store,
        *,
        settings: Settings,
        transform: ViewTransform,
        constraints: Constraints | None = None,
        name: str = "painting",
    ) -> None:
        self.store, self.name, self.transform = store, name, transform
        self._given = constraints or Constraints()
        self._settings = settings
        self.basis = basis
        self.present = np.asarray(present, np.float32)
        self.version, self._stroke = 0, -1
        self._open: list[tuple[Region, Pixels]] = []
        self._moved: Wishes | None = None
        self.wishes = Wishes()
        self._replay()

    # What there is

    @property
    def size(self) -> tuple[int, int]:
        """(height, width) of the picture."""
        return self.basis.size

    @property
    def is_painted(self) -> bool:
        """Whether any pixel counts."""
        return bool(self.importance.any())

    @property
    def stroke(self) -> int:
        """Number of the last stroke that was heard of."""
        return self._stroke

    @property
    def is_open(self) -> bool:
        """Whether a stroke, or a slider, is not done yet."""
        return bool(self._open) or self._moved is not None

    @property
    def target(self) -> Target | None:
        """The painting, with arrays of its own; None where nothing is painted."""
        if not self.is_painted:
            return None
        return Target(
            self.name,
            self.image.copy(),
            self.importance.copy(),
            everything=False,
            transform=self.transform,
            through_view=True,
            over_look=True,
        )

    def moment(self) -> Moment:
        """What is painted and asked now."""
        wishes = self.wishes
        settings = wishes.settings(self._settings)
        constraints = self._given.and_then(wishes.constraints())
        return Moment(self.version, self.basis, self.target, wishes, settings, constraints)

    # What is said

    def said(self, message: protocol.Said, arrays: Mapping[str, npt.NDArray[Any]]) -> list[Message]:
        """What has come of a message. Raises LightpaintError, and has changed nothing then."""
        match message:
            case protocol.Paint():
                return [self._paint(message, arrays)]
            case protocol.Drop():
                return [self._patched(*self._dropped())]
            case protocol.Undo():
                return [self._step(-1)]
            case protocol.Redo():
                return [self._step(+1)]
            case protocol.Ask():
                return [self._ask(message)]
            case protocol.Tie():
                self._check_names(name for names in message.ties for name in names)
                return [self._wish("tie", replace(self.wishes, ties=message.ties))]
            case protocol.Set():
                label = ", ".join(message.values)
                return [self._wish(label, self.wishes.of_answer(message.values))]
        raise PaintError(f"a session has no answer to {type(message).__name__}")

    def answer(self, **more: Any) -> Message:
        """The weights as they are, while the brush is down."""
        about = {"stroke": self._stroke, "exact": False, "version": self.version}
        return Message("answer", {**about, "mode": self.live.mode, **more}, self.weights_array)

    @property
    def weights_array(self) -> dict[str, Doubles]:
        """As messages have them."""
        return {"weights": self.weights}

    def settled(
        self,
        moment: Moment,
        solution: Solution | None,
        *,
        of_lights: Sequence[Mapping[str, Any]] = (),
        **more: Any,
    ) -> Message | None:
        """The exact answer to `moment`, if nothing has changed since.

        of_lights, more: what is known of each light, and of the whole.
        """
        if moment.version != self.version:
            return None
        if solution is not None:
            self.weights = solution.weights
        lights = lights_fields(self.basis, self.weights)
        for light, known in zip(lights, of_lights, strict=bool(of_lights)):
            light |= known
        return self.answer(**{**self.about, **more, "lights": lights, "exact": True})

    @property
    def about(self) -> dict[str, Any]:
        """What can be undone, and what is asked: part of most messages."""
        steps, position = self.store.steps, self.store.position
        fit = self._fit
        return {
            "history": {
                "undo": [step.label for step in steps[:position]][-50:],
                "redo": [step.label for step in steps[position:]][:50],
                "count": position,
            },
            "asked": {name: dict(its) for name, its in self.wishes.lights.items()},
            "ties": [list(names) for names in self.wishes.ties],
            "settings": dict(self.wishes.values),
            "meant": {"space": fit.space, "hold": fit.hold, "colors": fit.colors},
        }

    def improve(self, basis: Basis, present: Floats) -> None:
        """Go on with a basis of the same lights and size that has more samples.

        A stroke that is open stays so.
        """
        painted = [(region, self._pixels(region)) for region, _ in self._open]
        weights = self.weights
        self.basis, self.present = basis, np.asarray(present, np.float32)
        self._open, moved, wishes = [], self._moved, self.wishes
        self._replay()
        for region, pixels in painted:
            self._open.append((region, self._pixels(region)))
            self._put(region, pixels)
        if moved is not None:
            self._moved, self.wishes = moved, wishes
            self._asks()
        self.weights = weights
        self._changed()

    def left(self, *, with_stroke: bool) -> None:
        """Whoever was at it has gone, or begins anew: a slider that was left moves back.

        with_stroke: whether a stroke that is open is as it will stay, and kept so.
        """
        if self._moved is not None:
            self.wishes, self._moved = self._moved, None
            self._asks()
            self._changed()
        if with_stroke and self._open:
            self._close("stroke")
            self._changed()

    def load(self, image: Floats, importance: Floats, wishes: Wishes, label: str) -> Message:
        """Go on from another painting and what was asked with it: one step."""
        self._forget_open()
        whole = (0, self.size[0], 0, self.size[1])
        given = np.asarray(image, np.float32), np.asarray(importance, np.float32)
        patch = Patch(whole, self._pixels(whole), given)
        fields = {"before": self.wishes.as_json(), "after": wishes.as_json()}
        self._check(wishes)
        self.store.append(Step("look_loaded", label, fields, patch))
        self._put(whole, given)
        self.wishes = wishes
        self._asks()
        self._changed()
        return self._patched(whole)

    # Paint

    def _paint(self, said: protocol.Paint, arrays: Mapping[str, npt.NDArray[Any]]) -> Message:
        region = said.region
        given = self._checked(region, arrays)
        if said.stroke != self._stroke:
            # Of a stroke whose end was never heard, what is there is kept.
            self._close("stroke")
            self._stroke = said.stroke
        before = self._pixels(region)
        self._open.append((region, before))
        self._put(region, given)
        if said.done:
            try:
                self._close(said.label)
            except LightpaintError:
                self._dropped()
                raise
        self._changed()
        return self.answer(**(self.about if said.done else {}))

    def _checked(self, region: Region, arrays: Mapping[str, npt.NDArray[Any]]) -> Pixels:
        top, bottom, left, right = region
        height, width = self.size
        if not (0 <= top <= bottom <= height and 0 <= left <= right <= width):
            raise PaintError(f"paint at {list(region)}, and the picture is {width}x{height}")
        try:
            image, importance = arrays["image"], arrays["importance"]
        except KeyError:
            raise PaintError("paint without its image and importance") from None
        shape = bottom - top, right - left
        if image.shape != (*shape, 3) or importance.shape != shape:
            raise PaintError(
                f"paint of {list(image.shape)} and {list(importance.shape)} at {list(region)}"
            )
        if not (np.isfinite(image).all() and np.isfinite(importance).all()):
            raise PaintError("paint of NaN or Inf")
        if importance.size and not (importance.min() >= 0 and importance.max() <= MOST):
            raise PaintError(f"importance beyond 0 to {MOST:g}")
        if image.size and not (image.min() >= 0 and image.max() <= BRIGHTEST):
            raise PaintError(f"light beyond 0 to {BRIGHTEST:g}")
        return image.astype(np.float32), importance.astype(np.float32)

    def _put(self, region: Region, pixels: Pixels) -> None:
        """Pixels onto the canvas; what is not painted shows the present look."""
        top, bottom, left, right = region
        where = slice(top, bottom), slice(left, right)
        image, importance = pixels
        painted = (importance > 0)[..., None]
        self.image[where] = np.where(painted, image, self.present[where])
        same = np.array_equal(self.importance[where], importance)
        self.importance[where] = importance
        self.live.painted(where, with_importance=not same)

    def _pixels(self, region: Region) -> Pixels:
        top, bottom, left, right = region
        where = slice(top, bottom), slice(left, right)
        return self.image[where].copy(), self.importance[where].copy()

    def _close(self, label: str) -> None:
        """Make a step of the stroke that is open, if one is; a slider that was left moves back."""
        if self._moved is not None:
            self.wishes, self._moved = self._moved, None
            self._asks()
        if not self._open:
            return
        region = _around([one for one, _ in self._open])
        if region[0] == region[1] or region[2] == region[3]:
            self._open = []
            return
        after = self._pixels(region)
        image, importance = (x.copy() for x in after)
        for (top, bottom, left, right), pixels in reversed(self._open):
            part = np.s_[top - region[0] : bottom - region[0], left - region[2] : right - region[2]]
            image[part], importance[part] = pixels
        before = image, importance
        if not all(np.array_equal(a, b) for a, b in zip(before, after, strict=True)):
            # What is sent again, since its answer was lost, is there already.
            self.store.append(Step("stroke", label, {}, Patch(region, before, after)))
        self._open = []

    def _dropped(self) -> tuple[Region]:
        """The stroke that is open is forgotten; where it was."""
        region = _around([one for one, _ in self._open])
        for one, pixels in reversed(self._open):
            self._put(one, pixels)
        self._open = []
        self._changed()
        return (region,)

    def _forget_open(self) -> None:
        if self._open:
            self._dropped()

    # Steps

    def _step(self, by: int) -> Message:
        """Back or forth by one."""
        self._close("stroke")
        steps, now = self.store.steps, self.store.position
        position, is_back = now + by, by < 0
        if not 0 <= position <= len(steps):
            raise PaintError(f"there is nothing to {'undo' if is_back else 'redo'}")
        step = steps[position] if is_back else steps[now]
        self.store.move_to(position)
        region: Region = (0, 0, 0, 0)
        if step.patch is not None:
            region = step.patch.region
            self._put(region, step.patch.before if is_back else step.patch.after)
        if step.fields:
            self.wishes = Wishes.of(step.fields["before" if is_back else "after"])
            self._asks()
        self._changed()
        return self._patched(region)

    def _ask(self, said: protocol.Ask) -> Message:
        if said.light >= len(self.basis.lights):
            raise PaintError(f"no light {said.light}: there are {len(self.basis.lights)}")
        light = self.basis.lights[said.light]
        if light.is_fixed:
            raise PaintError(f"{light.name} is kept as it is, and cannot be asked for anything")
        asked = self.wishes.of_light(light.name, said.asked)
        if said.done:
            before = self._moved or self.wishes
            self._moved = None
            return self._wish(light.name, asked, before=before)
        # While a slider moves nothing is kept.
        self._check(asked)
        self._moved = self._moved or self.wishes
        self.wishes = asked
        self._asks()
        self._changed()
        return self.answer()

    def _wish(self, label: str, wishes: Wishes, *, before: Wishes | None = None) -> Message:
        """Ask for something from now on: a step."""
        self._close("stroke")
        self._check(wishes)
        fields = {"before": (before or self.wishes).as_json(), "after": wishes.as_json()}
        self.store.append(Step("asked", label, fields))
        self.wishes = wishes
        self._asks()
        self._changed()
        return self.answer(**self.about)

    def _check(self, wishes: Wishes) -> None:
        """Raise LightpaintError for what cannot be asked, before anything is changed."""
        fit = meant_by(wishes.settings(self._settings), [self._nothing])
        reduced_by(self._constraints(wishes), self.basis, fit)

    def _check_names(self, names: Any) -> None:
        if unknown := [name for name in names if name not in self.basis.names]:
            raise PaintError(f"no light is called {unknown[0]!r}")

    # What follows

    def _replay(self) -> None:
        """Canvas and what is asked, from the steps."""
        steps = self.store.steps[: self.store.position]
        empty = np.zeros(self.size, np.float32)
        self.image, self.importance = painted_by(steps, (self.present, empty))
        unpainted = self.importance == 0
        self.image[unpainted] = self.present[unpainted]
        told = [step.fields["after"] for step in steps if step.fields]
        self.wishes = Wishes.of(told[-1]) if told else Wishes()
        fit = self._fit
        constraints = self._constraints(self.wishes)
        self.live = Live(self.basis, self.image, self.importance, fit=fit, constraints=constraints)
        self.live.prepare()
        self.weights = self.basis.present_weights
        self._changed()

    def _changed(self) -> None:
        self.version += 1
        self.weights = self.live.answer(self.weights)

    def _asks(self) -> None:
        fit = self._fit
        self.live.asks(fit, self._constraints(self.wishes))

    @property
    def _fit(self) -> Settings:
        return meant_by(self.wishes.settings(self._settings), [self._nothing])

    def _constraints(self, wishes: Wishes) -> Constraints:
        asked = constraints_of(self.basis.asked).and_then(self._given)
        return asked.and_then(wishes.constraints())

    @property
    def _nothing(self) -> Target:
        """A target as those of this session are, for what follows from that."""
        one = np.ones((1, 1), np.float32)
        black = np.zeros((1, 1, 3), np.float32)
        how: dict[str, Any] = {"through_view": True, "over_look": True}
        return Target(self.name, black, one, False, transform=self.transform, **how)

    def _patched(self, region: Region) -> Message:
        """What the canvas holds there now."""
        image, importance = self._pixels(region)
        fields: dict[str, Any] = {"region": list(region), "version": self.version, **self.about}
        fields |= {"mode": self.live.mode, "exact": False, "stroke": self._stroke}
        arrays: dict[str, npt.NDArray[Any]] = {
            "image": image,
            "importance": importance,
            **self.weights_array,
        }
        return Message("patch", fields, arrays)


def _around(regions: list[Region]) -> Region:
    """The smallest region that holds all."""
    if not regions:
        return (0, 0, 0, 0)
    tops, bottoms, lefts, rights = zip(*regions, strict=True)
    return min(tops), max(bottoms), min(lefts), max(rights)
