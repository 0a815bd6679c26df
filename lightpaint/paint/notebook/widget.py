"""The painter in a notebook: `lp.Painter`, an anywidget over the same page and the same session.

All messages pass through the kernel's thread: the studio's threads hand theirs to its event loop.
Without a loop, as in a script, they send them themselves.
"""

import atexit
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from functools import partial
from inspect import signature
from pathlib import Path
from threading import Event, RLock
from typing import TYPE_CHECKING, Any, Generic, TypeVar, Unpack
from weakref import WeakValueDictionary

from lightpaint.colour import TransformChoice, ViewTransform
from lightpaint.display_text import brief
from lightpaint.errors import PaintError
from lightpaint.files import first_line
from lightpaint.keywords import keywords
from lightpaint.lighting import (
    Constraints,
    Lighting,
    Solution,
    analyse,
    dimmed,
    with_findings,
    write_lighting,
)
from lightpaint.paint.background_threads import error_text
from lightpaint.paint.notebook import widget_arguments
from lightpaint.paint.notebook.cell_views import CellOutput, KernelThread, WidgetViews, static_view
from lightpaint.paint.notebook.widget_arguments import (
    LOADERS,
    MIN_HEIGHT,
    LoadArguments,
    notebook_advice,
    same_paintings,
)
from lightpaint.paint.protocol import AnswerUpdate, Message, Notice, SessionState
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.session_file import MemoryStore, Store
from lightpaint.paint.studio.session_studio import Studio
from lightpaint.pipeline.job.settings import SettingsByName
from lightpaint.target import Target, write_painting
from lightpaint.viewer import bundled, styles

#: Painters of this process that keep their session in a file, by its path.
_PAINTERS_BY_FILE: WeakValueDictionary[Path, "Painter"] = WeakValueDictionary()

try:
    import anywidget
    import ipywidgets
    import traitlets
    from traitlets import ObserveHandler
except ImportError as error:
    raise PaintError("lp.Painter needs anywidget: pip install 'lightpaint[notebook]'") from error

#: Traits that cells set and observe.
LIVE_TRAITS = ("target", "targets", "lighting", "constraints")

#: Default layout: without a width, an HBox gives the painter none.
DEFAULT_LAYOUT = {"width": "100%", "min_width": "320px"}

Readable = TypeVar("Readable")
Assignable = TypeVar("Assignable")

#: Maximum number of rounds in which callbacks react to values set by callbacks.
MAX_CALLBACK_ROUNDS = 20


def _open_store(path: Path | None, identity: Identity) -> Store:
    """Return the session at `path`, or one in memory without a path. Raises LightpaintError."""
    if path is None:
        return MemoryStore(identity)
    with notebook_advice():
        return Store.open(path, identity)


def _save_answer(
    path: Path, snapshot: SessionSnapshot, lighting: Callable[[], Lighting], *, view: int
) -> None:
    """Write the painting of a view (`.exr`), or the lighting (`.json`). See `Painter.save`."""
    if view not in range(len(snapshot.targets)):
        raise PaintError(f"view is {view!r}: expected one of {len(snapshot.targets)}, from 0 on")
    if path.suffix == ".json":
        write_lighting(path, lighting())
    elif path.suffix != ".exr":
        raise PaintError(f"{path}: expected .exr for the painting, .json for the lighting")
    elif (target := snapshot.targets[view]) is None:
        raise PaintError("nothing is painted yet: there is no painting to keep")
    else:
        write_painting(path, target)


def widget_script() -> str:
    """Return the painter as one ES module, whose default export is an anywidget's."""
    return bundled("paint/page/widget.js")


def widget_style() -> str:
    """Return the style sheet of the painter."""
    return styles("paint/page/style.css")


class LiveTrait(traitlets.Any, Generic[Readable, Assignable]):  # type: ignore[misc]
    """A trait that the session sets with `set_trait`; assignments in cells become requests."""

    if TYPE_CHECKING:

        def __get__(self, obj: Any, cls: Any = None) -> Readable: ...

    def __set__(self, obj: Any, value: Assignable) -> None:
        obj._assign(self.name, value)


@dataclass(frozen=True)
class Callback:
    """A function that observes changes; an error in it does not stop other callbacks.

    warn: receives its error in one line.
    """

    handler: Callable[[Any], Any]
    warn: Callable[[str], None] = field(compare=False)

    def __call__(self, change: Any) -> None:
        try:
            self.handler(change)
        except Exception as error:
            # The traceback begins at the callback's own line.
            frames = error.__traceback__
            traceback.print_exception(error.with_traceback(frames and (frames.tb_next or frames)))
            text = f"{type(error).__name__}: {first_line(error)}"
            self.warn(f"a callback of painter.{change['name']} failed: {text}")


class SessionTraits:
    """The traits of a painter by which cells read and change its session.

    Args:
        owner: The painter.
        studio: Has the session.
        lock: Held while observers are called, since two notifying threads would each take the
            other's callbacks for theirs.
        send: Sends a message to pages.
        warn: Receives a line on a value that was not set.
    """

    def __init__(
        self,
        owner: "Painter",
        studio: Studio,
        lock: AbstractContextManager[Any],
        *,
        send: Callable[[Message], None],
        warn: Callable[[str], None],
    ) -> None:
        self._owner, self._studio, self._lock = owner, studio, lock
        self._send, self._warn = send, warn
        self._pending: list[tuple[str, Any]] = []  # values by name, in the order of assignment
        self._is_notifying = False

    def assign(self, name: str, value: Any) -> None:
        """Apply a value that a cell sets, or raise its LightpaintError there.

        A value that a callback sets is applied after all observers have been called.
        """
        with self._lock:  # another thread may be notifying observers
            arguments = LOADERS[name](self._studio.session, value)
            if self._is_notifying:
                self._pending.append((name, value))
            else:
                self._apply(arguments)

    def assign_when_ready(self, name: str, value: Any) -> None:
        """Set a trait now, or once its lights are rendered. Raises LightpaintError if now."""
        with self._lock:
            if not self._studio.is_ready:
                self._pending.append((name, value))
            else:
                setattr(self._owner, name, value)

    def _apply(self, arguments: LoadArguments) -> None:
        """Load paintings and requests into the session. Raises LightpaintError if refused."""
        paintings, requests, _ = arguments
        if not paintings and requests == self._studio.session.requests:
            return  # it would be a step without a change
        for message in self._studio.load(*arguments):
            self._send(message)
        self.update()

    def update(self, values: dict[str, Any] | None = None) -> None:
        """Set the traits to `values`, by default the session's, and notify observers of changes."""
        with self._notifying():
            for name, value in (values or self.current_values()).items():
                if value is not getattr(self._owner, name):
                    self._owner.set_trait(name, value)

    def current_values(self) -> dict[str, Any]:
        """Return the values of all traits; a value that has not changed is the same object.

        An exact answer arrives twice, the second time with its analysis.
        """
        snapshot, answer = self._studio.snapshot_and_lighting()
        lighting = dimmed(answer, snapshot.requests.master)
        targets, earlier_targets = snapshot.targets, self._owner.targets
        earlier_lighting = self._owner.lighting
        lighting = lighting.for_target(
            " + ".join(target.name for target in snapshot.painted_targets)
        )
        if same_paintings(targets, earlier_targets):
            targets = earlier_targets
        return {
            "target": targets[0],
            "targets": targets,
            "lighting": earlier_lighting if lighting == earlier_lighting else lighting,
            "constraints": snapshot.requests.constraints(),
        }

    @contextmanager
    def _notifying(self) -> Iterator[None]:
        """Hold back values that callbacks set until all observers have been called."""
        with self._lock:
            was_notifying, self._is_notifying = self._is_notifying, True
            try:
                yield
                if not was_notifying:
                    self._apply_pending()
            finally:
                self._is_notifying = was_notifying

    def _apply_pending(self) -> None:
        """Apply the values that wait, and then those that callbacks have set meanwhile."""
        for _ in range(MAX_CALLBACK_ROUNDS):
            values, self._pending = self._pending, []
            for name, value in values:
                try:
                    self._apply(LOADERS[name](self._studio.session, value))
                except Exception as error:  # the cell that set it has ended
                    traceback.print_exc()
                    self._warn(f"painter.{name} was not set: {error_text(error, at_length=False)}")
        if self._pending:
            self._pending = []
            self._warn(
                "callbacks of the painter set something again each time that they are called: the "
                "last values were not set"
            )


class Painter(anywidget.AnyWidget):  # type: ignore[misc]
    """A painter in a notebook: paint light, and see the answer while the brush moves.

    Args:
        scene: A basis, a scene (its basis is rendered in the background), light groups, or the path
            of a scene. For several views under one lighting, a list of bases or of scenes.
        target: The initial painting; for several views a list.
        constraints: Constraints on the lights, in addition to those set in the painter.
        transform: The view transform to paint through; by default the transform of the target, if
            it has one. The scene determines open parts.
        store: The file of the session; an existing session continues. A painter of this kernel that
            has the file open is closed. Without a file the session ends with the kernel.
        folder: Receives exports.
        layers: A file whose layers replace the session's when the session first begins with them,
            `layers.exr` of an export, or an `.ora` of any program.
        height: Height of the painter in screen pixels, at least 240.
        layout: The layout of the widget, as for every ipywidget.
        settings: Fields of `lp.Settings`, by name.

    Attributes:
        target: The painting, a `Target`; None if nothing is painted. With several views, the
            painting of the first.
        targets: The paintings of all views, in order.
        lighting: The `Lighting` that answers it. Setting it locks every light there.
        constraints: The `Constraints` set in the painter. Like `lighting`, None until the first
            render of a scene.

    Painting changes these attributes and notifies observers (`observe`). Setting one changes the
    painter, as a step that can be undone.

    Raises:
        PaintError: For a scene or value that cannot be used; without `lightpaint[notebook]`.

    Examples:
        >>> painter = lp.Painter(basis, target=target)
        >>> changes = []
        >>> painter.observe(lambda change: changes.append(change.new), "lighting")
        >>> painter.constraints = lp.Constraints.of({"panel": {"lock": True}})
        >>> np.round(painter.solution.lighting.emission["panel"], 2).tolist()
        [4.0, 3.0, 2.0]
        >>> painter.close()
    """

    _esm = widget_script()
    _sheet = traitlets.Unicode(widget_style()).tag(sync=True)
    _saved_view = traitlets.Unicode("").tag(sync=True)
    height = traitlets.Int(720, min=MIN_HEIGHT).tag(sync=True)
    target: LiveTrait[Target | None, Target | None] = LiveTrait(None)
    targets: LiveTrait[tuple[Target | None, ...], Sequence[Target | None]] = LiveTrait(())
    lighting: LiveTrait[Lighting | None, Lighting] = LiveTrait(None)
    constraints: LiveTrait[Constraints | None, Constraints | None] = LiveTrait(None)

    def __init__(
        self,
        scene: widget_arguments.Paintable | Sequence[widget_arguments.Paintable],
        target: Target | Sequence[Target | None] | None = None,
        *,
        constraints: Constraints | None = None,
        transform: ViewTransform | TransformChoice | None = None,
        store: str | Path | None = None,
        folder: str | Path | None = None,
        layers: str | Path | None = None,
        height: int = 720,
        layout: Mapping[str, Any] | ipywidgets.Layout | None = None,
        **settings: Unpack[SettingsByName],
    ) -> None:
        widget_arguments.check_height(height)
        if not isinstance(layout, ipywidgets.Layout | None):
            widget_arguments.check_layout(layout, ipywidgets.Layout.class_trait_names())
        self._lock, self._ready = RLock(), Event()
        self._is_closed = False
        self._solved: tuple[int, Solution | None] | None = None
        self._kernel = KernelThread()
        self._output = CellOutput(self._static_view, self._kernel.call)
        subjects = widget_arguments.widget_subjects(
            scene,
            folder=folder,
            layers=layers,
            settings=widget_arguments.read_settings(settings, ARGUMENT_NAMES),
            constraints=constraints,
            transform=widget_arguments.transform_of_targets(target)
            if transform is None
            else transform,
        )
        if target is not None:
            widget_arguments.check_target_sizes(target, subjects)
        if not isinstance(store, str | Path | None):
            raise PaintError(f"store is {store!r}: expected the path of a file, like 'evening.db'")
        path = None if store is None else Path(store)
        if path is not None:
            if (earlier := _PAINTERS_BY_FILE.get(path.resolve())) is not None:
                earlier.close()  # the user has run its cell again
            _PAINTERS_BY_FILE[path.resolve()] = self
        self._studio = Studio(subjects, partial(_open_store, path))
        self._views = WidgetViews(self._studio, self._lock, self._send_to_pages)
        self._session_traits = SessionTraits(
            self, self._studio, self._lock, send=self._views.send, warn=self._warn
        )
        self._failed = ""
        if not isinstance(layout, ipywidgets.Layout):
            layout = {**DEFAULT_LAYOUT, **(layout or {})}
        super().__init__(height=height, layout=layout, _saved_view=self._output.id)
        self.on_msg(lambda _, content, buffers: self._views.receive(content, buffers))
        super().observe(lambda _: self._output.follow(), ("target", "lighting"))
        self._studio.on_message = self._on_studio_message
        try:
            self._begin(target)
        except BaseException:
            self.close()  # the file is then free when the cell runs again
            raise

    def _begin(self, target: Target | Sequence[Target | None] | None) -> None:
        """Start the studio; wait for it if nothing has to be rendered. Raises LightpaintError."""
        self._studio.start()
        if self._studio.has_scenes:
            atexit.register(self._end)  # a render must end before the process does
        else:
            self._ready.wait()
            if self._failed:
                raise PaintError(self._failed)
            self._session_traits.update()
        if target is not None:
            name = "targets" if widget_arguments.is_per_view(target) else "target"
            self._session_traits.assign_when_ready(name, target)

    def __repr__(self) -> str:
        first, *further = self._studio.subjects
        subject = first.loaded_scene if first.basis is None else first.basis
        extent = (
            f"{subject.size[1]}x{subject.size[0]}" if not further else f"{1 + len(further)} views"
        )
        return f"Painter({first.name}, {len(subject.lights)} lights, {extent})"

    def _ipython_display_(self) -> None:
        """Show the painter as the output of a cell, which follows what is painted when saved."""
        self._output.show(super()._repr_mimebundle_(), repr(self))

    def _repr_mimebundle_(self, **options: Any) -> tuple[dict[str, Any], dict[str, Any]]:
        data, metadata = super()._repr_mimebundle_(**options)
        return {**data, **({"text/html": page} if (page := self._static_view()) else {})}, metadata

    def _static_view(self) -> str | None:
        """Return the first view as HTML that needs no kernel; None until there is a basis."""
        if self.lighting is None:
            return None
        snapshot = self._studio.snapshot()
        return static_view(snapshot.bases[0], self.lighting, self.target, snapshot.transform)

    @property
    def solution(self) -> Solution | None:
        """Exact answer to the current paintings, with its analysis; None if nothing is painted.

        Raises LightpaintError.
        """
        snapshot = self._studio.snapshot()
        if self._solved is None or self._solved[0] != snapshot.version:
            solution = snapshot.solution()
            if solution is not None:
                solution = with_findings(solution, analyse(solution))
            self._solved = snapshot.version, solution
        return self._solved[1]

    @keywords()
    def save(self, path: str | Path, *, view: int = 0) -> None:
        """Write the painting (`.exr`) or its lighting (`.json`), as `lightpaint solve` reads them.

        view: index of the view, in the order in which the views were given.

        Raises PaintError if nothing is painted yet, for another kind of file, and for an unknown
        view.
        """
        _save_answer(Path(path), self._studio.snapshot(), self._lighting, view=view)

    def close(self) -> None:
        """End the painter; a session with a file can be continued. Closing twice does nothing.

        Its cells show its last picture and a mixer from then on, which need no kernel.

        Raises OutputError if the last steps could not be written; the painter has ended all the
        same.
        """
        if "_studio" not in vars(self) or self._is_closed:  # it has never begun, or ended before
            return
        self._output.end()
        self._end()

    def _end(self) -> None:
        """End the studio, and the widget with it. Raises OutputError."""
        self._is_closed = True
        atexit.unregister(self._end)  # the reference would keep the painter's pictures alive
        self._studio.on_message = None
        try:
            self._studio.close()
        finally:
            super().close()
            if self._studio.has_scenes:
                self._studio.wait()

    # Assignments from a cell

    def __setattr__(self, name: str, value: Any) -> None:
        """Set an attribute. Raises AttributeError for a misspelt name, PaintError for a height."""
        is_known = name.startswith("_") or hasattr(type(self), name)
        if not is_known and (hint := widget_arguments.did_you_mean(name, [*LIVE_TRAITS, "height"])):
            raise AttributeError(f"lp.Painter has no attribute {name!r}{hint}")
        if name == "height":
            widget_arguments.check_height(value)
        super().__setattr__(name, value)

    def _assign(self, name: str, value: Any) -> None:
        """Apply a value that a cell sets, or raise its error there; apply a callback's later."""
        if self._is_closed:
            raise PaintError(f"painter.{name} cannot be set: it is closed; make another lp.Painter")
        self._session_traits.assign(name, value)

    # Notifications

    def observe(self, handler: Any, names: Any = traitlets.All, type: str = "change") -> None:
        """Call `handler` with each change; an error in it is shown and ends nothing.

        Raises PaintError for a handler that cannot be called, and for names that are not traits.
        """
        self._check_observer(handler, names, type)
        super().observe(self._callback(handler), names, type)

    def unobserve(self, handler: Any, names: Any = traitlets.All, type: str = "change") -> None:
        """Stop calling `handler`. Raises PaintError for one that does not observe these."""
        self._check_observer(handler, names, type)
        try:
            super().unobserve(self._callback(handler), names, type)
        except ValueError as error:
            raise PaintError(f"{brief(handler)} does not observe this painter") from error

    def _check_observer(self, handler: Any, names: Any, change: Any) -> None:
        known = [*self.trait_names(), traitlets.All]
        widget_arguments.check_observer(handler, names, change, known, LIVE_TRAITS)

    def _callback(self, handler: Any) -> Any:
        # ipywidgets' own observers are ObserveHandlers, not callbacks of a cell.
        return handler if isinstance(handler, ObserveHandler) else Callback(handler, self._warn)

    def _warn(self, text: str) -> None:
        self._views.send(Notice(text=text, tone="warn"))

    def _lighting(self) -> Lighting:
        """Return the exact answer, or the requested lighting if nothing is painted."""
        solution, (snapshot, answer) = self.solution, self._studio.snapshot_and_lighting()
        lighting = answer if solution is None else solution.lighting
        return dimmed(lighting, snapshot.requests.master)

    # Messages of page and studio

    def _send_to_pages(self, content: dict[str, Any], buffers: list[bytes]) -> None:
        if self.comm is not None:
            self.send(content, buffers)

    def _on_studio_message(self, message: Message) -> None:
        """Handle an unrequested message of the studio, from another thread."""

        def act() -> None:
            with self._lock:
                self._views.send(message)
                is_exact = isinstance(message, AnswerUpdate) and message.exact
                has_lights = isinstance(message, SessionState) and self._studio.is_ready
                if is_exact or has_lights:
                    self._session_traits.update()
                    self._output.follow()

        if not self._ready.is_set() and isinstance(message, SessionState | Notice):
            self._failed = message.text if isinstance(message, Notice) else ""
            self._ready.set()
        self._kernel.call(act)


#: Arguments of a painter other than settings.
ARGUMENT_NAMES = [
    name for name in signature(Painter).parameters if name not in ("self", "settings")
]
