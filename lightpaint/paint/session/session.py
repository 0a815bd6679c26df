"""A painting in progress, and the lighting that answers it: the only brain of the painter.

A session hears what a page says, and says what has come of it; it reads and writes no file but
through its store, starts no thread, and renders nothing. What is done is a list of steps, each
with what was before it; the canvas, what is asked, and so the answer follow from them alone, so
that undoing, loading and painting in another order lead to the same bits.

One lighting answers the paintings of all its views. While a brush is down the answer is that of
`Live`; `settled` takes the exact one, which is what `lightpaint solve` finds for the exported
paintings.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.arrays import Doubles, Floats
from lightpaint.basis.basis import Basis
from lightpaint.basis.lights import BasisLight
from lightpaint.colour.display.view_transform import ViewTransform
from lightpaint.errors import LightpaintError, NothingToUndoError, PaintError
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.solution import Solution
from lightpaint.paint import protocol
from lightpaint.paint.protocol import AnswerUpdate, CanvasPatch, Message
from lightpaint.paint.session.answer_messages import Judgement, answer_findings, unpainted_headline
from lightpaint.paint.session.canvas import Canvases
from lightpaint.paint.session.live_answer import Answering
from lightpaint.paint.session.snapshot import Moment
from lightpaint.paint.store.canvas_pixels import Pixels, Region
from lightpaint.paint.store.database import DamagedError
from lightpaint.paint.store.light_requests import TITLES, Wishes
from lightpaint.paint.store.steps import Step
from lightpaint.paint.store.store import Store
from lightpaint.pipeline.settings import Settings
from lightpaint.target.target import Target


class Session:
    """What one person paints of one view, or of several.

    Args:
        bases: What the lights do in each view, which may get better (`improve`).
        presents: (h, w, 3) linear, the present look of each without its grain: the canvas to begin
            with.
        store: Where steps and looks are kept.
        settings: How the painting is to be answered, but for what is set in the session.
        transform: What the painting is seen through.
        constraints: What was asked of the lights before it began.
        name: What the painting is called.

    Attributes:
        views: Canvas of each view.
        answering: What is asked, and the last answer.
        version: A number that grows with every change.

    Raises:
        PaintError: If the store is of something else.
    """

    def __init__(
        self,
        bases: Sequence[Basis],
        presents: Sequence[Floats],
        store: Store,
        *,
        settings: Settings,
        transform: ViewTransform,
        constraints: Constraints | None = None,
        name: str = "painting",
    ) -> None:
        self.store, self.name, self.transform = store, name, transform
        self.version, self._stroke = 0, -1
        try:
            self.views, wishes = _painted(bases, presents, store)
        except (LightpaintError, ArithmeticError, LookupError, TypeError, ValueError):
            if not store.is_kept:
                raise
            store.mend()
            self.views, wishes = _painted(bases, presents, store)
        self.answering = Answering(
            self.views.live,
            wishes,
            settings=settings,
            constraints=constraints or Constraints(),
            transform=transform,
        )
        self._changed()

    # What there is

    @property
    def basis(self) -> Basis:
        """Of the first view: the lights are those of all."""
        return self.views[0].basis

    @property
    def wishes(self) -> Wishes:
        """What is asked now."""
        return self.answering.wishes

    @property
    def weights(self) -> Doubles:
        """(n, 3), the last answer."""
        return self.answering.weights

    @property
    def is_painted(self) -> bool:
        """Whether any pixel counts."""
        return self.views.is_painted

    @property
    def stroke(self) -> int:
        """Number of the last stroke that was heard of."""
        return self._stroke

    @property
    def is_open(self) -> bool:
        """Whether a stroke, or a slider, is not done yet."""
        return self.answering.kept is not None or self.views.is_open

    def target(self, view: int = 0) -> Target | None:
        """A painting, with arrays of its own; None where nothing is painted.

        It is answered elsewhere as here: one that is taken at its word is light, over nothing.
        """
        canvas = self.views[view]
        if not canvas.is_painted:
            return None
        image, importance, at_least = canvas.pixels(canvas.whole)
        is_sketch = not self.answering.fit.literal
        return Target(
            self.name if len(self.views) == 1 else f"{self.name} {canvas.name}",
            image,
            importance,
            everything=False,
            at_least=at_least,
            transform=self.transform,
            through_view=is_sketch,
            over_look=is_sketch,
        )

    def moment(self, wishes: Wishes | None = None) -> Moment:
        """What is painted now, and asked: `wishes`, by default those there are."""
        answering, bases = self.answering, tuple(view.basis for view in self.views)
        asked = wishes or answering.wishes
        targets = tuple(self.target(k) for k in range(len(bases)))
        how = answering.settings(asked), answering.constraints(asked), self.transform
        return Moment(self.version, bases, targets, asked, *how)

    def changed_by(self, change: protocol.Preview) -> Wishes:
        """Return the wishes after a change. Raises LightpaintError where it cannot be made."""
        self._check_names(change.asked)
        wishes = self.wishes.of_answer(change.values)
        for name, asked in change.asked.items():
            self._check_free(self.basis.lights[self.basis.names.index(name)])
            wishes = wishes.of_light(name, asked)
        if change.ties is not None:
            self._check_names(name for names in change.ties for name in names)
            wishes = wishes.of_ties(change.ties)
        self.answering.check(wishes)
        return wishes

    # What is said

    def said(self, message: protocol.Said, arrays: Mapping[str, npt.NDArray[Any]]) -> list[Message]:
        """What has come of a message. Raises LightpaintError, and has changed nothing then.

        A slider that is being moved moves back before anything else is done, and where what it is
        left at cannot be.
        """
        if not isinstance(message, protocol.Ask):
            self._leave_slider()
        try:
            return self._done(message, arrays)
        except LightpaintError:
            self._leave_slider()
            raise

    def _done(
        self, message: protocol.Said, arrays: Mapping[str, npt.NDArray[Any]]
    ) -> list[Message]:
        match message:
            case protocol.Paint():
                return [self._paint(message, arrays)]
            case protocol.Drop():
                return self._patched(*self._drop())
            case protocol.Undo():
                return self._step(-1)
            case protocol.Redo():
                return self._step(+1)
            case protocol.Ask():
                return [self._ask(message)]
            case protocol.AskAll():
                return [self._ask_all(message)]
            case protocol.Tie():
                self._check_names(name for names in message.ties for name in names)
                return [self._wish("tie", self.wishes.of_ties(message.ties))]
            case protocol.Set():
                wishes = self.wishes.of_answer(message.values)
                return [self._wish(", ".join(TITLES[key] for key in message.values), wishes)]
        raise PaintError(f"a session has no answer to {type(message).__name__}")

    def answer(self, **more: Any) -> AnswerUpdate:
        """Return the weights as they are, while the brush is down. more: further fields."""
        about = {"stroke": self._stroke, "exact": False, "version": self.version}
        mode, weights = self.answering.mode, self.weights
        return AnswerUpdate(**{**about, "mode": mode, "weights": weights, **more})

    def settled(
        self, moment: Moment, solution: Solution | None, judged: Judgement | None = None
    ) -> AnswerUpdate | None:
        """The exact answer to `moment`, if nothing has changed since.

        judged: what is known of it, once that is.
        """
        if moment.version != self.version:
            return None
        if solution is not None:
            self.answering.weights = solution.weights
        found = self.findings
        if judged is not None:
            found = judged.completes(found)
        known = {name: getattr(found, name) for name in protocol.Findings.__dataclass_fields__}
        return self.answer(**self.about, **known, exact=True)

    @property
    def findings(self) -> protocol.Findings:
        """What is known of the answer at once."""
        found = answer_findings([view.basis for view in self.views], self.weights)
        return found if self.is_painted else replace(found, headline=self.unpainted)

    @property
    def unpainted(self) -> str:
        """What is said of the answer while nothing is painted."""
        is_white = self.answering.fit.colors == "white"
        # What was asked before the session began counts as well.
        is_other = not np.allclose(self.weights, self.answering.basis.present_weights)
        is_asked = bool(self.wishes.lights) or (is_other and not is_white)
        return unpainted_headline(is_asked=is_asked, is_white=is_white)

    @property
    def about(self) -> dict[str, Any]:
        """What can be undone, and what is asked: the fields of `Standing`."""
        steps, position = self.store.steps, self.store.position
        fit = self.answering.fit
        return {
            "history": protocol.HistoryInfo(
                undo=tuple(self._called(step) for step in steps[:position][-50:]),
                redo=tuple(self._called(step) for step in steps[position:][:50]),
                count=position,
            ),
            "asked": {name: dict(its) for name, its in self.wishes.lights.items()},
            "ties": self.wishes.ties,
            "settings": dict(self.wishes.values),
            "meant": protocol.ResolvedFit(fit.space, fit.hold, fit.colors),
        }

    def _called(self, step: Step) -> str:
        """What undo calls it; of several views, in which it was."""
        where = [self.views[patch.view].name for patch in step.patches]
        is_told = len(self.views) > 1 and len(where) == 1
        return f"{step.label}, {where[0]}" if is_told else step.label

    def improve(self, bases: Sequence[Basis], presents: Sequence[Floats]) -> None:
        """Go on with bases of the same lights and sizes that have more samples.

        A stroke that is open stays so.
        """
        self.views.improve(bases, presents, self.store.steps[: self.store.position])
        self.answering.begin(self.views.live)
        self._changed()

    def left(self, *, with_stroke: bool) -> None:
        """Whoever was at it has gone, or begins anew: a slider that was left moves back.

        with_stroke: whether a stroke that is open is as it will stay, and kept so.
        """
        is_stroke = with_stroke and self.views.is_open
        if is_stroke:  # kept before anything is solved, which may be given up
            self._close("stroke")
        if self.answering.move_back() or is_stroke:
            self._changed()

    def _leave_slider(self) -> None:
        """One that is being moved moves back."""
        if self.answering.move_back():
            self._changed()

    def load(
        self,
        paintings: Mapping[int, Pixels],
        wishes: Wishes,
        label: str,
        weights: Doubles | None = None,
    ) -> list[Message]:
        """Go on from other paintings, by view, and what was asked with them: one step.

        weights: (n, 3), the answer that was kept with them. It is shown until the exact one is
        there; else one that begins at the answer to what was painted before.
        """
        self._leave_slider()
        self.answering.check(wishes)
        if self.views.is_open:
            self._drop()
        patches = self.views.instead(paintings)
        fields = {"before": self.wishes.as_json(), "after": wishes.as_json()}
        self.store.append(Step("look_loaded", label, fields, patches))
        self.views.put(patches)
        self.answering.ask(wishes)
        self._changed()
        if weights is not None:
            self.answering.weights = weights.copy()
        return self._patched(*((patch.view, patch.region) for patch in patches))

    # Paint

    def _paint(self, said: protocol.Paint, arrays: Mapping[str, npt.NDArray[Any]]) -> Message:
        view = self.views[said.view]
        given = view.checked(said.region, arrays)
        if said.stroke != self._stroke:
            # Of a stroke whose end was never heard, what is there is kept.
            self._close("stroke")
            self._stroke = said.stroke
        view.paint(said.region, given)
        if said.done:
            try:
                self._close(said.label)
            except LightpaintError:
                self._drop()
                raise
        self._changed()
        return self.answer(**(self.about if said.done else {}))

    def _close(self, label: str) -> None:
        """Make a step of the stroke that is open, if one is."""
        if patches := self.views.strokes():
            self.store.append(Step("stroke", label, {}, patches))
        self.views.close()

    def _drop(self) -> list[tuple[int, Region]]:
        """The stroke that is open is forgotten; where it was."""
        where = self.views.drop()
        self._changed()
        return where

    # Steps

    def _step(self, by: int) -> list[Message]:
        """Back or forth by one."""
        if self.views.is_open:
            self._close("stroke")
            self._changed()
        steps, now = self.store.steps, self.store.position
        position, is_back = now + by, by < 0
        if not 0 <= position <= len(steps):
            raise NothingToUndoError(f"There is nothing to {'undo' if is_back else 'redo'}.")
        step = steps[position] if is_back else steps[now]
        try:
            found = [patch.before if is_back else patch.after for patch in step.patches]
        except DamagedError:
            raise PaintError(self.store.mend()) from None
        self.store.move_to(position)
        for patch, pixels in zip(step.patches, found, strict=True):
            self.views[patch.view].put(patch.region, pixels)
        if step.fields:
            self.answering.ask(Wishes.of(step.fields["before" if is_back else "after"]))
        self._changed()
        return self._patched(*((patch.view, patch.region) for patch in step.patches))

    def _ask(self, said: protocol.Ask) -> Message:
        if said.light >= len(self.basis.lights):
            raise PaintError(f"no light {said.light}: there are {len(self.basis.lights)}")
        light = self.basis.lights[said.light]
        self._check_free(light)
        asked = self.wishes.of_light(light.name, said.asked)
        if said.done:
            return self._wish(light.name, asked)
        # While a slider moves nothing is kept.
        self.answering.move(asked)
        self._changed()
        return self.answer()

    def _ask_all(self, said: protocol.AskAll) -> Message:
        self._check_names(said.asked)
        wishes = self.wishes
        for name, asked in said.asked.items():
            self._check_free(self.basis.lights[self.basis.names.index(name)])
            wishes = wishes.of_light(name, asked)
        return self._wish(", ".join(said.asked), wishes)

    def _check_free(self, light: BasisLight) -> None:
        if light.is_fixed:
            raise PaintError(f"{light.name} is kept as it is, and cannot be asked for anything")

    def _wish(self, label: str, wishes: Wishes) -> Message:
        """Ask for something from now on: a step."""
        self.answering.check(wishes)
        self._close("stroke")
        fields = {"before": self.answering.at_rest.as_json(), "after": wishes.as_json()}
        self.store.append(Step("asked", label, fields))
        self.answering.ask(wishes)
        self._changed()
        return self.answer(**self.about)

    def _check_names(self, names: Any) -> None:
        if unknown := [name for name in names if name not in self.basis.names]:
            raise PaintError(f"no light is called {unknown[0]!r}")

    # What follows

    def _changed(self) -> None:
        self.version += 1
        self.answering.solve()

    def _patched(self, *where: tuple[int, Region]) -> list[Message]:
        """What the canvases hold there now: a message for each view, the first one's if nowhere."""
        views = tuple(view for view, _ in where)
        made: list[Message] = []
        for view, region in where or ((0, (0, 0, 0, 0)),):
            image, importance, _ = self.views[view].pixels(region)
            patch = CanvasPatch(
                region=region,
                view=view,
                views=views,
                version=self.version,
                stroke=self._stroke,
                exact=False,
                mode=self.answering.mode,
                image=image,
                importance=importance,
                weights=self.weights,
                **self.about,
            )
            made.append(patch)
        return made


def _painted(
    bases: Sequence[Basis], presents: Sequence[Floats], store: Store
) -> tuple[Canvases, Wishes]:
    """Return the canvases as the steps have made them, and what is asked."""
    done = store.steps[: store.position]
    told = [step.fields["after"] for step in done if step.fields]
    wishes = Wishes.of(told[-1]) if told else Wishes()
    wishes.constraints()
    return Canvases(bases, presents, done), wishes
