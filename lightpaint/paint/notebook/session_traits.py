"""Traits of a painter that equal its session, which cells set, and callbacks that observe them.

Imported only where ipywidgets is installed.
"""

import traceback
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from types import TracebackType
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

import traitlets

from lightpaint.files import first_line
from lightpaint.lighting.answer.combination import dimmed
from lightpaint.paint.background_threads import error_text
from lightpaint.paint.notebook.widget_arguments import LOADERS, LoadArguments, same_paintings
from lightpaint.paint.protocol import Message
from lightpaint.paint.studio.studio import Studio

Readable = TypeVar("Readable")
Assignable = TypeVar("Assignable")

#: Maximum number of rounds in which callbacks react to values set by callbacks.
MAX_CALLBACK_ROUNDS = 20


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
            traceback.print_exception(error.with_traceback(_from_caller(error)))
            text = f"{type(error).__name__}: {first_line(error)}"
            self.warn(f"a callback of painter.{change['name']} failed: {text}")


def _from_caller(error: Exception) -> TracebackType | None:
    frames = error.__traceback__
    return frames and (frames.tb_next or frames)


class TraitOwner(Protocol):
    """A painter with the traits `target`, `targets`, `lighting` and `constraints`."""

    targets: Any
    lighting: Any

    def set_trait(self, name: str, value: Any) -> None:
        """Set a trait, and notify its observers."""


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
        owner: TraitOwner,
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
        """Set a trait now, or once the first basis is there. Raises LightpaintError if now."""
        with self._lock:
            if self._studio.store is None:
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
                self._apply_late(name, value)
        if self._pending:
            self._pending = []
            self._warn(
                "callbacks of the painter set something again each time that they are called: the "
                "last values were not set"
            )

    def _apply_late(self, name: str, value: Any) -> None:
        """Apply a value that was set earlier; show an error, since its cell has ended."""
        try:
            self._apply(LOADERS[name](self._studio.session, value))
        except Exception as error:
            traceback.print_exc()
            self._warn(f"painter.{name} was not set: {error_text(error, at_length=False)}")
