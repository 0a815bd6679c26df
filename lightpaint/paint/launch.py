"""From what was named to a page that paints it: session file, studio and server, until the end."""

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
from lightpaint.paint.lazy_scene import Opening
from lightpaint.paint.server.address import Listening, listen
from lightpaint.paint.server.connection_file import ConnectionFile
from lightpaint.paint.server.server import Server, check_installed
from lightpaint.paint.session_file import Keeping, check_together, identity_of
from lightpaint.paint.store.database import set_aside
from lightpaint.paint.store.light_requests import Wishes
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

#: The session in the folder of what is painted.
SESSION = "session.db"


def subject_of(
    source: SceneFile | BasisFile | GroupsFile,
    folder: Path,
    *,
    settings: Settings | None = None,
    constraints: Constraints | None = None,
    choice: TransformChoice | None = None,
    command: Callable[[Mapping[str, str], Wishes], str] = lambda paintings, wishes: "",
    among: int = 1,
) -> Subject:
    """One view to be painted, as of `Subject`, read and checked before anything is rendered.

    Raises LightpaintError for what cannot be painted, or asked of its lights.
    """
    settings, constraints = settings or Settings(), constraints or Constraints()
    about: dict[str, Any] = {
        "source": source.path,
        "folder": folder,
        "settings": settings,
        "constraints": constraints,
        "choice": choice or TransformChoice(),
        "command": command,
        "among": among,
    }
    if not isinstance(source, SceneFile):
        check_nothing_idle(settings, source)
        found = source.content
        groups = found if isinstance(found, LightGroups) else None
        basis = found.basis if isinstance(found, LightGroups) else found
        reduce_to(constraints_of(basis.requests).and_then(constraints), basis.lights)
        return Subject(basis=basis, groups=groups, **about)
    # What can be seen without the renderer is said before anything is opened.
    file_length(Path(source.path), "scene file", SceneError)
    opening = Opening(source, settings)
    if (known := opening.known) is not None:
        reduce_to(constraints_of(known.lights.requests).and_then(constraints), known.lights)

    def check(scene: Scene) -> None:
        from lightpaint.basis.render.render import basis_lights

        reduce_to(constraints_of(scene.requests).and_then(constraints), basis_lights(scene))

    opening.checks.append(check)
    return Subject(scene=opening, **about)


def subjects_of(
    sources: Sequence[SceneFile | BasisFile | GroupsFile], folder: Path, **how: Any
) -> tuple[Subject, ...]:
    """Views of one lighting to be painted together. how: as of `subject_of`.

    Raises LightpaintError for what cannot be painted, alone or together, as far as it is known.
    """
    made = tuple(subject_of(one, folder, among=len(sources), **how) for one in sources)
    if (identity := identity_of(made)) is not None:
        check_together([view.sensor for view in identity.views])
    bases = [subject.basis for subject in made if subject.basis is not None]
    for basis in bases[1:]:
        check_same_lights(bases[0], basis)
    return made


def paint_in_browser(
    subjects: Sequence[Subject],
    opened: Callable[[Server], None],
    *,
    new: bool = False,
    host: str | None = None,
    port: int | None = None,
    say: Callable[[str], None] = lambda _: None,
) -> None:
    """Serve a page that paints these views, until Ctrl-C or the like; all that was done is kept.

    opened: called when the page can be opened. new: whether an earlier session is put aside. host,
    port: as of `listen`. say: hears remarks.

    Raises PaintError where the session cannot be had, OutputError where what was done last could
    not be written.
    """
    check_installed()
    folder = subjects[0].folder
    check_writable(folder)
    path = folder / SESSION
    listening = listen(host, port)  # before anything is written
    with listening[0]:
        _paint_at(listening, subjects, opened, path, new=new, say=say)


def _paint_at(
    listening: Listening,
    subjects: Sequence[Subject],
    opened: Callable[[Server], None],
    path: Path,
    *,
    new: bool,
    say: Callable[[str], None],
) -> None:
    """Serve the session of a file, which is made where there is none."""
    if new and (aside := set_aside(path)) is not None:
        say(f"the earlier session is kept as {aside}")
    keeping = Keeping(subjects, path, say)
    studio = Studio(subjects, keeping.opened)
    studio.on_unsaved = say
    try:
        server = Server(studio, keeping.store, listening=listening, say=say)
        keeping.server = server
        connection = ConnectionFile(path.parent, server.connection)

        def offer() -> None:  # once the folder is known to be this painter's
            try:
                connection.write()
            except OutputError as error:
                say(str(error))

        try:
            if keeping.store is None:
                keeping.on_opened = offer
            else:
                offer()
            studio.on_failure = partial(_failed, server)
            opened(server)
            with interruptible_between_pieces():  # who is being started cannot be waited for
                studio.start()
            with at_hand():
                server.run()
        finally:
            server.close()
            connection.remove()
        if studio.failure is not None and studio.store is None:
            raise studio.failure
    finally:
        _end(studio, keeping.store)


@contextmanager
def at_hand() -> Iterator[None]:
    """Let strokes wait for nothing but their own work, in a process that does nothing else.

    What is imported by now is not looked through for garbage, again and again; and whoever holds
    the interpreter for long lets go of it ten times as soon.
    """
    before = sys.getswitchinterval()
    sys.setswitchinterval(before / 10)
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
        sys.setswitchinterval(before)


#: Seconds in which a page that a browser was asked to open comes to hear why there is nothing.
COMES_S = 5.0


def _failed(server: Server, error: Exception) -> None:
    """End, since there is nothing to paint; a page that is about to come is told."""
    end_s = time.monotonic() + (COMES_S if server.is_expected else 0.0)
    while not server.has_page and time.monotonic() < end_s:
        time.sleep(0.05)
    server.stop(str(error))


def _end(studio: Studio, store: Store | None) -> None:
    """Close both, and the store also where the studio fails; then let renders come to an end."""
    try:
        studio.close()
    finally:
        if store is not None:
            store.close()
    studio.wait()
