"""Values of a painter that cells and callbacks have set and that wait to be applied."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

#: Maximum number of rounds in which callbacks react to values set by callbacks.
MAX_CALLBACK_ROUNDS = 20


class PendingValues:
    """Values by the names of their traits, in the order in which they were set.

    lock: held while observers are called, since two notifying threads would each take the other's
    callbacks for theirs. apply: sets a value, and raises nothing. warn: receives a line on values
    that were not set.
    """

    def __init__(
        self,
        lock: AbstractContextManager[Any],
        apply: Callable[[str, Any], None],
        warn: Callable[[str], None],
    ) -> None:
        self._lock, self._apply, self._warn = lock, apply, warn
        self._values: list[tuple[str, Any]] = []
        self.is_notifying = False

    def add(self, name: str, value: Any) -> None:
        """Add a value, which is set after all observers have been called."""
        self._values.append((name, value))

    @contextmanager
    def notifying(self) -> Iterator[None]:
        """Hold back values that callbacks set until all observers have been called."""
        with self._lock:
            was_notifying, self.is_notifying = self.is_notifying, True
            try:
                yield
                if not was_notifying:
                    self._apply_all()
            finally:
                self.is_notifying = was_notifying

    def _apply_all(self) -> None:
        """Apply the waiting values, and then those that callbacks have set meanwhile."""
        for _ in range(MAX_CALLBACK_ROUNDS):
            values, self._values = self._values, []
            for name, value in values:
                self._apply(name, value)
        if self._values:
            self._values = []
            self._warn(
                "callbacks of the painter set something again each time that they are called: the "
                "last values were not set"
            )
