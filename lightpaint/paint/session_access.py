"""The session of a studio behind its lock, for all threads that work on it."""

from threading import RLock

from lightpaint.errors import PaintError
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.paint.layers.view_layers import ViewLayers
from lightpaint.paint.session.look_library import LookLibrary
from lightpaint.paint.session.session import Session
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.store.session_requests import SessionRequests
from lightpaint.paint.store.store import Store


class SessionAccess:
    """Access to a session that opens once its first bases are there.

    Attributes:
        lock: Held while the session is read or changed.
        current: The session; None before there is a basis.
        failure_text: Why there is none, or why its bases got no better; empty without a failure.
    """

    def __init__(self) -> None:
        self.lock = RLock()
        self.current: Session | None = None
        self.failure_text = ""
        self._looks: LookLibrary | None = None

    def open(self, session: Session, looks: LookLibrary) -> None:
        """Give threads the session and its looks."""
        with self.lock:
            self.current, self._looks = session, looks

    @property
    def session(self) -> Session:
        """The session. Raises PaintError before there is a basis."""
        if self.current is None:
            raise self._absence
        return self.current

    @property
    def looks(self) -> LookLibrary:
        """The looks of the session. Raises PaintError before there is a basis."""
        if self._looks is None:
            raise self._absence
        return self._looks

    @property
    def _absence(self) -> PaintError:
        return PaintError(self.failure_text or "the first picture is still being rendered")

    @property
    def store(self) -> Store | None:
        """The session's store; None before there is a basis."""
        return None if self.current is None else self.current.store

    @property
    def version(self) -> int:
        """Number that grows with every change. Raises PaintError before there is a basis."""
        return self.session.version

    def snapshot(self) -> SessionSnapshot:
        """Return the current paintings and requests. Raises PaintError before there is a basis."""
        with self.lock:
            return self.session.snapshot()

    def layers(self) -> tuple[ViewLayers, ...]:
        """Return the current layers of each view. Raises PaintError before there is a basis."""
        with self.lock:
            views = self.session.views
            return tuple(ViewLayers.of(view, views.layers) for view in views)

    def keep_compositions(self) -> None:
        """Write what the layers come to into the session file, so that it opens sooner."""
        with self.lock:
            compositions = self.session.compositions()
        if compositions is not None:
            self.session.store.put_compositions(*compositions)

    def snapshot_at_rest(self) -> SessionSnapshot | None:
        """Return the snapshot; None before there is a basis and while a stroke is open."""
        with self.lock:
            is_at_rest = self.current is not None and not self.current.is_open
            return self.session.snapshot() if is_at_rest else None

    def snapshot_and_lighting(
        self, requests: SessionRequests | None = None
    ) -> tuple[SessionSnapshot, Lighting]:
        """Return a snapshot and the last answer. Raises PaintError before there is a basis.

        requests: replace those of the session, if given.
        """
        with self.lock:
            snapshot = self.session.snapshot(requests)
            weights = self.session.weights
        return snapshot, Lighting.of_weights(snapshot.bases[0], weights)
