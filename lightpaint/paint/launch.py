"""The painter in a browser: opens session file, studio and server, and closes them at the end."""

import gc
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from lightpaint.basis.lightgroups.read import LightGroups
from lightpaint.colour.display.view_transform import TransformChoice
from lightpaint.errors import OutputError, SceneError
from lightpaint.files import check_writable, file_length
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.constraints_file import constraints_of
from lightpaint.lighting.constraints.reduction import reduce_to
from lightpaint.lighting.views import check_same_lights
from lightpaint.paint.lazy_scene import LazyScene
from lightpaint.paint.server.address import BoundSocket, listen
from lightpaint.paint.server.connection_file import ConnectionFile
from lightpaint.paint.server.server import Server, check_installed
from lightpaint.paint.session_file import SessionFile, check_view_names, session_identity
from lightpaint.paint.store.database import set_aside
from lightpaint.paint.store.light_requests import LightRequests
from lightpaint.paint.store.store import Store
from lightpaint.paint.studio import Studio
from lightpaint.paint.subject import Subject
from lightpaint.pipeline.settings import Settings
from lightpaint.pipeline.sources import (
    BasisFile,
    GroupsFile,
    SceneFile,
    check_nothing_idle,
)
from lightpaint.scene.scene import Scene
from lightpaint.signals import interruptible_between_pieces

#: Name of the session file, in its folder.
SESSION_FILE = "session.db"


def make_subject(
    source: SceneFile | BasisFile | GroupsFile,
    folder: Path,
    *,
    settings: Settings | None = None,
    constraints: Constraints | None = None,
    choice: TransformChoice | None = None,
    command: Callable[[Mapping[str, str], LightRequests], str] = lambda paintings, requests: "",
    view_count: int = 1,
) -> Subject:
    """Return one view to be painted, read and checked before anything is rendered.

    Parameters are those of `Subject`. Raises LightpaintError for what cannot be painted, and for
    constraints that its lights cannot meet.
    """
    settings, constraints = settings or Settings(), constraints or Constraints()
    fields: dict[str, Any] = {
        "source": source.path,
        "folder": folder,
        "settings": settings,
        "constraints": constraints,
        "choice": choice or TransformChoice(),
        "command": command,
        "view_count": view_count,
    }
    if not isinstance(source, SceneFile):
        check_nothing_idle(settings, source)
        content = source.content
        groups = content if isinstance(content, LightGroups) else None
        basis = content.basis if isinstance(content, LightGroups) else content
        reduce_to(constraints_of(basis.requests).and_then(constraints), basis.lights)
        return Subject(basis=basis, groups=groups, **fields)
    # What can be seen without the renderer is said before anything is opened.
    file_length(Path(source.path), "scene file", SceneError)
    lazy_scene = LazyScene(source, settings)
    if (record := lazy_scene.record) is not None:
        reduce_to(constraints_of(record.lights.requests).and_then(constraints), record.lights)

    def check(scene: Scene) -> None:
        from lightpaint.basis.render.render import basis_lights

        reduce_to(constraints_of(scene.requests).and_then(constraints), basis_lights(scene))

    lazy_scene.checks.append(check)
    return Subject(scene=lazy_scene, **fields)


def make_subjects(
    sources: Sequence[SceneFile | BasisFile | GroupsFile], folder: Path, **how: Any
) -> tuple[Subject, ...]:
    """Return the views of one lighting, to be painted together. how: parameters of `make_subject`.

    Raises LightpaintError for what cannot be painted, alone or together, as far as that is known.
    """
    subjects = tuple(
        make_subject(source, folder, view_count=len(sources), **how) for source in sources
    )
    if (identity := session_identity(subjects)) is not None:
        check_view_names([view.sensor for view in identity.views])
    bases = [subject.basis for subject in subjects if subject.basis is not None]
    for basis in bases[1:]:
        check_same_lights(bases[0], basis)
    return subjects


def paint_in_browser(
    subjects: Sequence[Subject],
    on_ready: Callable[[Server], None],
    *,
    new: bool = False,
    host: str | None = None,
    port: int | None = None,
    say: Callable[[str], None] = lambda _: None,
) -> None:
    """Serve a page that paints these views until Ctrl-C or a signal; the session file keeps all
    work.

    on_ready: called when the page can be opened. new: whether an earlier session is set aside.
    host, port: as of `listen`. say: receives remarks.

    Raises PaintError where the session cannot be opened, OutputError where the last steps could not
    be written.
    """
    check_installed()
    folder = subjects[0].folder
    check_writable(folder)
    path = folder / SESSION_FILE
    listening = listen(host, port)  # before anything is written
    with listening[0]:
        _serve_session(listening, subjects, on_ready, path, new=new, say=say)


def _serve_session(
    listening: BoundSocket,
    subjects: Sequence[Subject],
    on_ready: Callable[[Server], None],
    path: Path,
    *,
    new: bool,
    say: Callable[[str], None],
) -> None:
    """Serve the session of a file, which is created where there is none."""
    if new and (aside := set_aside(path)) is not None:
        say(f"the earlier session is kept as {aside}")
    session_file = SessionFile(subjects, path, say)
    studio = Studio(subjects, session_file.open_store)
    studio.on_unsaved = say
    try:
        server = Server(studio, session_file.store, listening=listening, say=say)
        session_file.server = server
        connection_file = ConnectionFile(path.parent, server.connection)

        def write_connection() -> None:  # once the folder is known to be this painter's
            try:
                connection_file.write()
            except OutputError as error:
                say(str(error))

        try:
            if session_file.store is None:
                session_file.on_store_opened = write_connection
            else:
                write_connection()
            studio.on_failure = partial(_stop_after_failure, server)
            on_ready(server)
            with interruptible_between_pieces():  # who is being started cannot be waited for
                studio.start()
            with low_latency():
                server.run()
        finally:
            server.close()
            connection_file.remove()
        if studio.failure is not None and studio.store is None:
            raise studio.failure
    finally:
        _close(studio, session_file.store)


@contextmanager
def low_latency() -> Iterator[None]:
    """Let strokes wait for nothing but their own work, in a process that does nothing else.

    The garbage collector leaves alone what is imported by now, and a thread that holds the
    interpreter for long lets go of it ten times as soon.
    """
    before = sys.getswitchinterval()
    sys.setswitchinterval(before / 10)
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
        sys.setswitchinterval(before)


#: Seconds that a server waits, after a failure, for the page of a browser that was started.
PAGE_WAIT_S = 5.0


def _stop_after_failure(server: Server, error: Exception) -> None:
    """Stop the server, since there is nothing to paint; a page that is about to load is
    told why.
    """
    end_s = time.monotonic() + (PAGE_WAIT_S if server.expects_page else 0.0)
    while not server.has_page and time.monotonic() < end_s:
        time.sleep(0.05)
    server.stop(str(error))


def _close(studio: Studio, store: Store | None) -> None:
    """Close the studio, and the store even where the studio fails; then wait for running
    renders.
    """
    try:
        studio.close()
    finally:
        if store is not None:
            store.close()
    studio.wait()
