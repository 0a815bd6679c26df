"""The painter in a browser: opens and closes session file, studio, server and connection file.

The session file is opened at once, and completed when the identity of its views is known.
"""

import gc
import json
import os
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from threading import Timer
from typing import Any

from lightpaint.errors import OutputError
from lightpaint.files import check_writable, replacing
from lightpaint.paint.server.address import BoundSocket, listen
from lightpaint.paint.server.page_server import Server, check_installed
from lightpaint.paint.store.database import SESSION_FILE, set_aside
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.session_file import Store
from lightpaint.paint.studio.console_switch import Console
from lightpaint.paint.studio.session_studio import Studio
from lightpaint.paint.subject import LazyScene, Subject, check_view_names, session_identity
from lightpaint.scene import Scene
from lightpaint.signals import interruptible_between_pieces

#: Name of the file by which programs find a running painter, in the same folder.
CONNECTION_FILE = "painter.json"

#: Seconds of loading after which it is announced.
SLOW_S = 2.0


def paint_in_browser(
    subjects: Sequence[Subject],
    on_ready: Callable[[Server], None],
    *,
    new: bool = False,
    host: str | None = None,
    port: int | None = None,
    console: Console | None = None,
    say: Callable[[str], None] = lambda _: None,
) -> None:
    """Serve a page that paints these views until Ctrl-C or a signal; the session file keeps all
    work.

    on_ready: called when the page can be opened. new: whether an earlier session is set aside.
    host, port: as in `listen`. console: one that the page can send the answer to. say: receives
    remarks.

    Raises PaintError if the session cannot be opened, OutputError if the last steps could not be
    written.
    """
    check_installed()
    folder = subjects[0].folder
    check_writable(folder)
    path = folder / SESSION_FILE
    listening = listen(host, port)  # before anything is written
    with listening[0]:
        with _announced_if_slow(subjects[0].name, say):
            for subject in subjects:
                subject.check_files()
        _serve_session(listening, subjects, on_ready, path, new=new, console=console, say=say)


@contextmanager
def _announced_if_slow(name: str, say: Callable[[str], None]) -> Iterator[None]:
    """Say that `name` is being loaded if the work within takes longer than SLOW_S."""
    timer = Timer(SLOW_S, say, (f"loading {name}; the address follows",))
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def _serve_session(
    listening: BoundSocket,
    subjects: Sequence[Subject],
    on_ready: Callable[[Server], None],
    path: Path,
    *,
    new: bool,
    console: Console | None,
    say: Callable[[str], None],
) -> None:
    """Serve the session of a file, which is created if it does not exist."""
    if new and (kept_path := set_aside(path)) is not None:
        say(f"the earlier session is kept as {kept_path}")
    session_file = SessionFile(subjects, path, say)
    studio = Studio(subjects, session_file.open_store, console=console)
    studio.on_unsaved = say
    try:
        server = Server(studio, session_file.store, listening=listening, say=say)
        session_file.server = server
        connection_file = ConnectionFile(path.parent, server.connection)
        try:
            _write_if_possible(connection_file, say)
            studio.on_failure = partial(_stop_after_failure, server)
            on_ready(server)
            with interruptible_between_pieces():  # a thread that is starting cannot be joined
                studio.start()
            with low_latency():
                server.run()
        finally:
            server.close()
            connection_file.remove()
        if studio.failure is not None and not studio.is_ready:
            raise studio.failure
    finally:
        _close(studio, session_file)


def _write_if_possible(file: "ConnectionFile", say: Callable[[str], None]) -> None:
    """Write the connection file; say if that fails, since pages can paint without it."""
    try:
        file.write()
    except OutputError as error:
        say(error.sentence)


class SessionFile:
    """The session file at `path`, opened at once, before its scenes are loaded: two painters that
    start together would both believe it to be theirs.

    say: receives remarks on the scenes, each one once.

    Attributes:
        store: The session.
        server: Receives the store once its identity is known.
    """

    def __init__(self, subjects: Sequence[Subject], path: Path, say: Callable[[str], None]) -> None:
        self.server: Server | None = None
        self._subjects, self._path, self._report = subjects, path, say
        self._loaded: dict[int, Scene] = {}
        self._reported: set[str] = set()
        identity = session_identity(subjects)
        self._is_unused = identity is None and not path.exists()
        self.store = Store.open(path, identity)
        try:
            for k, subject in enumerate(subjects):
                if subject.record is not None and isinstance(subject.scene, LazyScene):
                    self._report_new(subject.scene.remarks)
                elif isinstance(subject.scene, LazyScene):
                    subject.scene.when_loaded(partial(self._on_scene_loaded, k, subject.scene))
        except BaseException:
            self.close()
            raise

    def open_store(self, _: Identity) -> Store:
        """Return the store; called when there are bases."""
        return self.store

    def close(self) -> None:
        """Close the session; a new one whose scenes could not be loaded leaves no file."""
        self.store.close()
        if self._is_unused:
            self._path.unlink(missing_ok=True)

    def _on_scene_loaded(self, k: int, lazy_scene: LazyScene, scene: Scene) -> None:
        """Complete the identity with the scene of view k, which was not cached."""
        from lightpaint.lighting import constraints_of
        from lightpaint.pipeline import (
            remarks_of_film,
            remarks_of_memory,
            remarks_of_scene,
            remarks_on_spectra,
        )

        self._loaded[k] = scene
        if (identity := session_identity(self._subjects, self._loaded)) is not None:
            self._open_with(identity)
        lasting = *remarks_of_scene(scene), *remarks_of_film(scene, lazy_scene.settings)
        of_spectra = remarks_on_spectra(scene, constraints_of(scene.requests))
        self._report_new(
            (*lasting, *of_spectra, *remarks_of_memory(scene, lazy_scene.settings.basis_spp))
        )
        from lightpaint.scene.runtime.variant import use_variant

        # Remarks about this machine may not hold next time.
        lazy_scene.remarks = tuple(x for x in lasting if x != use_variant().note)

    def _open_with(self, identity: Identity) -> None:
        """Open the store, or check its identity, once all scenes are loaded."""
        check_view_names([view.sensor for view in identity.views])
        self.store.set_identity(identity)
        self._is_unused = False
        if self.server is not None:
            self.server.follow_identity()

    def _report_new(self, remarks: Iterable[str]) -> None:
        for remark in remarks:
            if remark not in self._reported:
                self._reported.add(remark)
                self._report(remark)


class ConnectionFile:
    """The file by which programs find a running painter, readable only by its owner.

    folder: folder of the session. about: content of the file, as JSON: the address, and a `token`
    unique to this painter.
    """

    def __init__(self, folder: Path, about: Mapping[str, Any]) -> None:
        self.path, self._about = folder / CONNECTION_FILE, dict(about)

    def write(self) -> None:
        """Write the file, replacing one that a killed painter has left.

        Raises OutputError if the file cannot be written.
        """
        with replacing(self.path) as temporary:
            # No other user may read it, even under its temporary name, and no link is followed.
            descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
            with open(descriptor, "w", encoding="utf-8") as file:
                file.write(json.dumps(self._about) + "\n")

    def remove(self) -> None:
        """Delete the file, unless another painter has replaced it."""
        with suppress(OSError, ValueError, AttributeError):
            record = json.loads(self.path.read_text(encoding="utf-8"))
            if record.get("token") == self._about["token"]:
                self.path.unlink()


@contextmanager
def low_latency() -> Iterator[None]:
    """Answer strokes with low latency, in a process that does nothing else.

    The garbage collector skips all objects that exist now, and threads switch ten times as often.
    """
    interval = sys.getswitchinterval()
    sys.setswitchinterval(interval / 10)
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
        sys.setswitchinterval(interval)


#: Seconds that a server waits, after a failure, for the page of a browser that was started.
PAGE_WAIT_S = 5.0


def _stop_after_failure(server: Server, error: Exception) -> None:
    """Stop the server, since there is nothing to paint, and tell a loading page the reason."""
    end_s = time.monotonic() + (PAGE_WAIT_S if server.expects_page else 0.0)
    while not server.has_page and time.monotonic() < end_s:
        time.sleep(0.05)
    server.stop(str(error))


def _close(studio: Studio, session_file: SessionFile) -> None:
    """Close the studio, and the session even if the studio fails; then wait for renders."""
    try:
        studio.close()
    finally:
        session_file.close()
    studio.wait()
