"""From what was named to a page that paints it: session file, studio and server, until the end."""

import gc
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from lightpaint.basis.basis import Basis
from lightpaint.basis.lightgroups.read import LightGroups
from lightpaint.colour.transform import TransformChoice
from lightpaint.errors import PaintError, SceneError
from lightpaint.files import check_writable, file_length, is_name, one_line
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.file import constraints_of
from lightpaint.lighting.constraints.reduction import reduce_to
from lightpaint.lighting.views import check_same_lights
from lightpaint.paint.database import set_aside
from lightpaint.paint.opening import Opening
from lightpaint.paint.server import Server, check_installed
from lightpaint.paint.steps import Identity, Seen
from lightpaint.paint.store import Store
from lightpaint.paint.studio import Studio
from lightpaint.paint.subject import Subject
from lightpaint.paint.wishes import Wishes
from lightpaint.scene.scene import Scene
from lightpaint.screen import some_names
from lightpaint.settings import Settings
from lightpaint.sources import (
    NOT_IN_GROUPS,
    RENDERED,
    BasisFile,
    GroupsFile,
    SceneFile,
    check_needed,
)

#: The session in the folder of what is painted.
SESSION = "session.db"

#: Seconds in which a pass of a render ends.
PATIENCE_S = 60.0


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
        default = Settings()
        names = NOT_IN_GROUPS if isinstance(source, GroupsFile) else RENDERED
        idle = [name for name in names if getattr(settings, name) != getattr(default, name)]
        check_needed(idle, source)
        found = source.content
        groups = found if isinstance(found, LightGroups) else None
        basis = found.basis if isinstance(found, LightGroups) else found
        reduce_to(constraints_of(basis.asked).and_then(constraints), basis.lights)
        return Subject(basis=basis, groups=groups, **about)
    # What can be seen without the renderer is said before anything is opened.
    file_length(Path(source.path), "scene file", SceneError)
    opening = Opening(source, settings)
    if (known := opening.known) is not None:
        reduce_to(constraints_of(known.asked).and_then(constraints), known.lights)

    def check(scene: Scene) -> None:
        from lightpaint.basis.render.render import basis_lights

        reduce_to(constraints_of(scene.asked).and_then(constraints), basis_lights(scene))

    opening.checks.append(check)
    return Subject(scene=opening, **about)


def subjects_of(
    sources: Sequence[SceneFile | BasisFile | GroupsFile], folder: Path, **how: Any
) -> tuple[Subject, ...]:
    """Views of one lighting to be painted together. how: as of `subject_of`.

    Raises LightpaintError for what cannot be painted, alone or together.
    """
    made = tuple(subject_of(one, folder, among=len(sources), **how) for one in sources)
    check_bases([subject.basis for subject in made if subject.basis is not None])
    return made


def check_bases(bases: Sequence[Basis]) -> None:
    """Raise LightpaintError unless these are of views of one scene."""
    check_together([basis.origin.sensor for basis in bases])
    for basis in bases[1:]:
        check_same_lights(bases[0], basis)


def check_together(sensors: Sequence[str]) -> None:
    """Raise PaintError unless several views have names, by which files can be called."""
    if len(sensors) < 2:
        return
    if len(set(sensors)) < len(sensors):
        raise PaintError(f"a view is there twice: {some_names(sensors)}; give each sensor once")
    for name in sensors:
        if not is_name(name):
            raise PaintError(
                f"the sensor id {one_line(repr(name))} cannot name a file: choose another id"
            )


def identity_of(subject: Subject) -> Identity | None:
    """What a session of it is of; None of a scene that tells it when it has been loaded."""
    if subject.basis is not None:
        return Identity.of([subject.basis])
    if (known := subject.known) is not None:
        name, views = Path(known.path).name, (Seen(known.sensor, known.size),)
        return Identity(name, known.identity, tuple(light.name for light in known.lights), views)
    return None if isinstance(subject.scene, Opening) else identity_of_scene(subject.loaded)


def identity_of_scene(scene: Scene) -> Identity:
    """That of the basis which is still to be rendered."""
    names = tuple(light.name for light in scene.lights)
    seen = Seen(scene.sensor_names[scene.sensor], scene.size)
    return Identity(scene.path.name, scene.identity, names, (seen,))


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
    port: as of `Server`. say: hears remarks.

    Raises PaintError where the session cannot be had, OutputError where what was done last could
    not be written.
    """
    check_installed()
    folder = subjects[0].folder
    check_writable(folder)
    path = folder / SESSION
    if new and (aside := set_aside(path)) is not None:
        say(f"the earlier session is kept as {aside}")
    places = _Places(subjects, path, say)
    studio = Studio(subjects, places.opened)
    try:
        server = Server(studio, places.store, host=host, port=port, say=say)
        places.server = server
        try:
            studio.on_failure = partial(_failed, server)
            opened(server)
            studio.start()
            with at_hand():
                server.run()
        finally:
            server.close()
        if studio.failure is not None and studio.store is None:
            raise studio.failure
    finally:
        _end(studio, places.store)


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


class _Places:
    """Where a session is kept: opened at once, unless a scene has to be loaded for that."""

    def __init__(self, subjects: Sequence[Subject], path: Path, say: Callable[[str], None]) -> None:
        self.path = path
        self.store: Store | None = None
        self.server: Server | None = None
        self._say, self._has_said = say, set[str]()
        self._known = [identity_of(subject) for subject in subjects]
        if (identity := self._identity) is not None or path.exists():
            self.store = Store.open(path, identity)
        for k, subject in enumerate(subjects):
            scene = subject.scene
            if isinstance(scene, Opening):
                if scene.known is not None:
                    self._remark(scene.remarks)
                else:
                    scene.checks.append(partial(self._loaded, k, scene))

    @property
    def _identity(self) -> Identity | None:
        """What is painted; None before all of it is known."""
        known = [one for one in self._known if one is not None]
        if len(known) < len(self._known):
            return None
        check_together([view.sensor for one in known for view in one.views])
        return Identity.joined(known)

    def _remark(self, remarks: Iterable[str]) -> None:
        """Say what has not been said of another view."""
        for remark in remarks:
            if remark not in self._has_said:
                self._has_said.add(remark)
                self._say(remark)

    def _loaded(self, k: int, opening: Opening, scene: Scene) -> None:
        """Once a scene is there of which nothing was known."""
        from lightpaint.remarks import remarks_of_film, remarks_of_memory, remarks_of_scene

        self._known[k] = identity_of_scene(scene)
        if (identity := self._identity) is not None:
            self._keep(identity)
        of_scene, of_film = remarks_of_scene(scene), remarks_of_film(scene, opening.settings)
        self._remark((*of_scene, *of_film, *remarks_of_memory(scene)))
        from lightpaint.scene.variant import use_variant

        # What is said of this machine may not be so the next time.
        opening.remarks = tuple(x for x in (*of_scene, *of_film) if x != use_variant().note)

    def _keep(self, identity: Identity) -> None:
        if self.store is None:
            self.store = Store.open(self.path, identity)
        else:
            self.store.becomes(identity)
        if self.server is not None:
            self.server.keeps(self.store)

    def opened(self, _: Identity) -> Store:
        """The store, when there is a basis."""
        assert self.store is not None
        return self.store


#: Seconds in which a page that a browser was asked to open comes to hear why there is nothing.
COMES_S = 5.0


def _failed(server: Server, error: Exception) -> None:
    """End, since there is nothing to paint; a page that is about to come is told."""
    end_s = time.monotonic() + (COMES_S if server.is_expected else 0.0)
    while not server.has_page and time.monotonic() < end_s:
        time.sleep(0.05)
    server.stop(str(error))


def _end(studio: Studio, store: Store | None) -> None:
    """Close both, and the store also where the studio fails; then let renders come to an end.

    What Mitsuba is at in another thread cannot be left alone at the end of a process.
    """
    try:
        studio.close()
    finally:
        if store is not None:
            store.close()
    wait_for_renders()


def wait_for_renders() -> None:
    """Until what renders beside a painter has come to an end."""
    end_s = time.monotonic() + PATIENCE_S
    for thread in threading.enumerate():
        if thread.name.startswith("lightpaint-"):
            thread.join(max(0.0, end_s - time.monotonic()))
