"""The painter in a notebook: `lp.Painter`, an anywidget over the same page and the same session.

The kernel's thread says and hears everything: what the studio's threads have to say is handed to
its event loop, where there is one. Without one, as in a script, they say it themselves.
"""

import asyncio
import atexit
import contextvars
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from inspect import signature
from pathlib import Path
from threading import Event, RLock
from typing import Any, Unpack
from weakref import WeakValueDictionary

from lightpaint.colour.display.view_transform import TransformChoice, ViewTransform
from lightpaint.errors import PaintError
from lightpaint.lighting.analysis.analysis import analyse, with_findings
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.answer.lighting_file import write_lighting
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.solution import Solution
from lightpaint.paint.background_threads import told
from lightpaint.paint.notebook import widget_arguments as cells
from lightpaint.paint.notebook.widget_files import widget_script, widget_style
from lightpaint.paint.notebook.widget_views import Places
from lightpaint.paint.protocol import AnswerUpdate, Message, Notice, SessionState
from lightpaint.paint.session.session import Session
from lightpaint.paint.store.steps import Identity
from lightpaint.paint.store.store import MemoryStore, Store
from lightpaint.paint.studio import Studio
from lightpaint.pipeline.settings import SettingsByName
from lightpaint.target.painting_file import write_painting
from lightpaint.target.target import Target

try:
    import anywidget
    import ipywidgets
    import traitlets
    from traitlets import ObserveHandler

    from lightpaint.paint.notebook.callbacks import Callback, LiveTrait
except ImportError as error:
    raise PaintError("lp.Painter needs anywidget: pip install 'lightpaint[notebook]'") from error

#: What can be set from a cell, and is told of.
LIVE = ("target", "targets", "lighting", "constraints")

#: What setting them means.
ACTS: dict[str, Callable[[Session, Any], cells.Loaded]] = {
    "target": cells.of_target,
    "targets": cells.of_targets,
    "lighting": cells.of_lighting,
    "constraints": cells.of_constraints,
}

#: Painters of this process that keep their session in a file, by its path.
KEPT_IN: WeakValueDictionary[Path, "Painter"] = WeakValueDictionary()


#: Pixels of the screen with less than which nobody can paint.
LEAST_HEIGHT = 240

#: What a painter takes of the room beside other widgets: without it, an HBox gives it none.
LAYOUT = {"width": "100%", "min_width": "320px"}

#: How often what callbacks set may make callbacks set something again.
ROUNDS = 20


class Painter(anywidget.AnyWidget):  # type: ignore[misc]
    """A painter in a notebook: paint light, and see the answer while the brush moves.

    Args:
        scene: What is painted: a basis, a scene (its basis is rendered meanwhile), light groups,
            or the path of a scene. Of several views a list of bases or of scenes, for one lighting.
        target: To begin with; of several views a list of them.
        constraints: What is asked of the lights, beside what is asked in the painter.
        transform: To paint through; that of the target, if it was seen through one, by default.
            What is open of it follows from the scene.
        store: A file to keep the session in, which is gone on with if it is there; a painter of
            this kernel that has it is closed. Without one what was painted lives as long as the
            kernel.
        folder: Receives what is exported.
        height: Of the painter, in pixels of the screen, at least 240.
        layout: As of every widget: the room that it takes beside others.
        settings: Fields of `lp.Settings`, by name.

    Attributes:
        target: The painting, a `Target`; None where nothing is painted. Of several views, the first
            one's.
        targets: The paintings of all views, in order.
        lighting: The `Lighting` that answers it. Setting it holds every light there.
        constraints: The `Constraints` that were asked in the painter. Like `lighting` None as long
            as nothing of a scene is rendered.

    What is painted changes these, and `observe` tells of it; setting them shows in the painter, as
    a step that can be undone.

    Raises:
        PaintError: For what cannot be painted, or set; without `lightpaint[notebook]`.

    Examples:
        >>> painter = lp.Painter(basis, target=target)
        >>> told = []
        >>> painter.observe(lambda change: told.append(change.new), "lighting")
        >>> painter.constraints = lp.Constraints.of({"panel": {"lock": True}})
        >>> np.round(painter.solution.lighting.emission["panel"], 3).tolist()
        [4.0, 3.0, 2.0]
        >>> painter.close()
    """

    _esm = widget_script()
    _sheet = traitlets.Unicode(widget_style()).tag(sync=True)
    height = traitlets.Int(720, min=LEAST_HEIGHT).tag(sync=True)
    target: LiveTrait[Target | None, Target | None] = LiveTrait(None)
    targets: LiveTrait[tuple[Target | None, ...], Sequence[Target | None]] = LiveTrait(())
    lighting: LiveTrait[Lighting | None, Lighting] = LiveTrait(None)
    constraints: LiveTrait[Constraints | None, Constraints | None] = LiveTrait(None)

    def __init__(
        self,
        scene: cells.Paintable | Sequence[cells.Paintable],
        target: Target | Sequence[Target | None] | None = None,
        *,
        constraints: Constraints | None = None,
        transform: ViewTransform | TransformChoice | None = None,
        store: str | Path | None = None,
        folder: str | Path | None = None,
        height: int = 720,
        layout: Mapping[str, Any] | ipywidgets.Layout | None = None,
        **settings: Unpack[SettingsByName],
    ) -> None:
        self._lock, self._is_there, self._is_telling = RLock(), Event(), False
        self._is_closed = False
        self._waiting: list[tuple[str, Any]] = []  # what is to be set as soon as it can be
        self._solved: tuple[int, Solution | None] | None = None
        self._loop = _running_loop()
        self._context = contextvars.copy_context()
        asked = {"settings": cells.settings_given(settings, ARGUMENTS), "constraints": constraints}
        transform = transform or cells.transform_of_paint(target)
        subjects = cells.subjects_given(scene, folder=folder, transform=transform, **asked)
        if target is not None:
            cells.check_given(target, subjects)
        place = cells.place_given(store)
        if place is not None:
            if (before := KEPT_IN.get(place.resolve())) is not None:
                before.close()  # its cell runs again
            KEPT_IN[place.resolve()] = self
        self._studio = Studio(subjects, partial(_opened, place))
        self._places = Places(self._studio, self._lock, self._carry)
        self._failed = ""
        room = layout if isinstance(layout, ipywidgets.Layout) else {**LAYOUT, **(layout or {})}
        super().__init__(height=height, layout=room)
        self.on_msg(self._said)
        self._studio.on_message = self._hears
        try:
            self._begin(target)
        except BaseException:
            self.close()  # the cell runs again, and finds its file free
            raise

    def _begin(self, target: Target | Sequence[Target | None] | None) -> None:
        """Paint, at once where nothing is to be rendered. Raises LightpaintError."""
        self._studio.start()
        if self._studio.renders:
            atexit.register(self.close)  # what renders cannot be left alone at the end
        else:
            self._is_there.wait()
            if self._failed:
                raise PaintError(self._failed)
            self._follow()
        if target is not None:
            self._set_once_there("targets" if cells.is_of_each_view(target) else "target", target)

    def __repr__(self) -> str:
        first, *others = self._studio.subjects
        its = first.loaded if first.basis is None else first.basis
        shown = f"{its.size[1]}x{its.size[0]}" if not others else f"{1 + len(others)} views"
        return f"Painter({first.name}, {len(its.lights)} lights, {shown})"

    @property
    def solution(self) -> Solution | None:
        """The exact answer to what is painted now, with all that is known of it; None where
        nothing is. Raises LightpaintError.
        """
        moment = self._studio.moment()
        if self._solved is None or self._solved[0] != moment.version:
            found = moment.solution()
            if found is not None:
                found = with_findings(found, analyse(found))
            self._solved = moment.version, found
        return self._solved[1]

    def save(self, path: str | Path, *, view: int = 0) -> None:
        """Keep the painting (`.exr`) or its lighting (`.json`), as `lightpaint solve` reads them.

        view: of which view, in the order in which they were given.

        Raises PaintError where nothing is painted yet, for another kind of file, or for a view that
        there is none of.
        """
        path, moment = Path(path), self._studio.moment()
        if view not in range(len(moment.targets)):
            raise PaintError(f"view is {view!r}: expected one of {len(moment.targets)}, from 0 on")
        if path.suffix == ".json":
            write_lighting(path, self._lighting())
        elif path.suffix != ".exr":
            raise PaintError(f"{path}: expected .exr for the painting, .json for the lighting")
        elif (target := moment.targets[view]) is None:
            raise PaintError("nothing is painted yet: there is no painting to keep")
        else:
            write_painting(path, target)

    def close(self) -> None:
        """End it; a session with a file can be gone on with. A second time it does nothing.

        Raises OutputError if what was done last could not be written; it has ended all the same.
        """
        if "_studio" not in vars(self) or self._is_closed:  # it has never begun, or ended before
            return
        self._is_closed = True
        atexit.unregister(self.close)  # which would keep it, and its pictures, until then
        self._studio.on_message = None
        try:
            self._studio.close()
        finally:
            super().close()
            if self._studio.renders:
                self._studio.wait()

    # What is set from a cell

    def __setattr__(self, name: str, value: Any) -> None:
        """Raises AttributeError for a slip of the pen, which would be an attribute of its own."""
        is_there = name.startswith("_") or hasattr(type(self), name)
        if not is_there and (meant := cells.meant(name, [*LIVE, "height"])):
            raise AttributeError(f"lp.Painter has no attribute {name!r}{meant}")
        super().__setattr__(name, value)

    def _assign(self, name: str, value: Any) -> None:
        """Do what somebody sets, or raise where they set it; a callback's wish is done later."""
        if self._is_closed:
            raise PaintError(f"painter.{name} cannot be set: it is closed; make another lp.Painter")
        with self._lock:  # another thread may be telling something now
            wish = ACTS[name](self._studio.session, value)
            if self._is_telling:
                self._waiting.append((name, value))
            else:
                self._do(wish)

    def _do(self, wish: cells.Loaded) -> None:
        """Raises LightpaintError for what cannot be had."""
        paintings, wishes, _ = wish
        if not paintings and wishes == self._studio.session.wishes:
            return  # it would be a step in which nothing happens, and answered for nothing
        for message in self._studio.load(*wish):
            self._places.tell(message)
        self._follow()

    def _set_waiting(self) -> None:
        """What has been waiting is set, and then what callbacks have set meanwhile."""
        for _ in range(ROUNDS):
            waiting, self._waiting = self._waiting, []
            for name, value in waiting:
                self._set_late(name, value)
        if self._waiting:
            self._waiting = []
            self._warn(
                "callbacks of the painter set something again whenever they are told of what they "
                "have set: the last of it was not set"
            )

    def _set_late(self, name: str, value: Any) -> None:
        """What fails is shown, and ends nothing: who set it has gone on."""
        try:
            self._do(ACTS[name](self._studio.session, value))
        except Exception as error:
            traceback.print_exc()
            self._warn(f"painter.{name} was not set: {told(error, at_length=False)}")

    # What is told

    def observe(self, handler: Any, names: Any = traitlets.All, type: str = "change") -> None:
        """Have `handler` called with each change; what fails in it is shown, and ends nothing.

        Raises PaintError for what cannot be called, and for names that there is nothing of.
        """
        if not callable(handler):
            raise PaintError(f"{handler!r} cannot observe a painter: expected a function")
        for name in [names] if isinstance(names, str) or names is traitlets.All else names:
            if name is not traitlets.All and not self.has_trait(name):
                raise PaintError(f"painter.{name} cannot be observed{cells.meant(name, LIVE)}")
        super().observe(self._callback(handler), names, type)

    def unobserve(self, handler: Any, names: Any = traitlets.All, type: str = "change") -> None:
        """Have it called no more."""
        super().unobserve(self._callback(handler), names, type)

    def _callback(self, handler: Any) -> Any:
        # What classes observe of themselves is called by its name, and is not a cell's.
        return handler if isinstance(handler, ObserveHandler) else Callback(handler, self._warn)

    def _warn(self, text: str) -> None:
        self._places.tell(Notice(text=text, tone="warn"))

    def _now(self) -> dict[str, Any]:
        """What the session has, by name of what says so; what has not changed is the same object.

        An exact answer comes twice, the second time with all that is known of it.
        """
        moment, lighting = self._studio.now()
        targets = moment.targets
        name = " + ".join(target.name for target in moment.painted_targets)
        if cells.same_paintings(targets, self.targets):
            targets = self.targets
        lighting = lighting.named(name)
        return {
            "target": targets[0],
            "targets": targets,
            "lighting": self.lighting if lighting == self.lighting else lighting,
            "constraints": moment.wishes.constraints(),
        }

    def _follow(self, new: dict[str, Any] | None = None) -> None:
        """Have the live objects say what the session has."""
        with self._telling():
            for name, value in (new or self._now()).items():
                if value is not getattr(self, name):
                    self.set_trait(name, value)

    @contextmanager
    def _telling(self) -> Iterator[None]:
        """Who observes is told; what callbacks set is set when all have been told."""
        with self._lock:  # two threads that tell would each take the other's callbacks for theirs
            before, self._is_telling = self._is_telling, True
            try:
                yield
                if not before:
                    self._set_waiting()
            finally:
                self._is_telling = before

    def _lighting(self) -> Lighting:
        """The exact answer, or what is asked where nothing is painted."""
        solution = self.solution
        return self._studio.now()[1] if solution is None else solution.lighting

    # What page and session say

    def _said(self, _: Any, content: Any, buffers: Any) -> None:
        self._places.hear(content, buffers)

    def _carry(self, content: dict[str, Any], buffers: list[bytes]) -> None:
        if self.comm is not None:
            self.send(content, buffers)

    def _hears(self, message: Message) -> None:
        """What the studio says by itself, from a thread of its own."""

        def act() -> None:
            with self._lock:
                self._heard(message)

        if not self._is_there.is_set() and isinstance(message, SessionState | Notice):
            self._failed = message.text if isinstance(message, Notice) else ""
            self._is_there.set()
        if self._loop is None:
            act()
        elif not self._loop.is_closed():
            self._loop.call_soon_threadsafe(act, context=self._context)

    def _heard(self, message: Message) -> None:
        self._places.tell(message)
        if isinstance(message, SessionState) or _is_exact(message):
            self._follow()

    def _set_once_there(self, name: str, value: Any) -> None:
        """Now, or as soon as there is something to paint on. Raises LightpaintError if now."""
        with self._lock:
            if self._studio.store is None:
                self._waiting.append((name, value))
            else:
                setattr(self, name, value)


#: What a painter is given that is no setting.
ARGUMENTS = [name for name in signature(Painter).parameters if name not in ("self", "settings")]


def _opened(place: Path | None, identity: Identity) -> Store:
    if place is None:
        return MemoryStore(identity)
    with cells.in_a_notebook():
        return Store.open(place, identity)


def _is_exact(message: Message) -> bool:
    return isinstance(message, AnswerUpdate) and message.exact


def _running_loop() -> asyncio.AbstractEventLoop | None:
    try:
        return asyncio.get_running_loop()
    except RuntimeError:
        return None
