"""From what was named to a page that paints it: session file, studio and server, until the end."""

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from lightpaint.basis.lightgroups.read import LightGroups
from lightpaint.basis.render.render import basis_lights
from lightpaint.colour.transform import TransformChoice
from lightpaint.errors import PaintError
from lightpaint.files import check_writable, is_name, one_line
from lightpaint.job import NOT_IN_GROUPS, RENDERED
from lightpaint.lighting.constraints.constraints import Constraints
from lightpaint.lighting.constraints.file import constraints_of
from lightpaint.lighting.constraints.reduction import reduce_to
from lightpaint.lighting.views import check_same_lights
from lightpaint.paint.database import set_aside
from lightpaint.paint.server import Server, check_installed
from lightpaint.paint.steps import Identity, Seen
from lightpaint.paint.store import Store
from lightpaint.paint.studio import Studio
from lightpaint.paint.subject import Subject
from lightpaint.paint.wishes import Wishes
from lightpaint.scene.quality import on_film
from lightpaint.screen import some_names
from lightpaint.settings import Settings
from lightpaint.sources import BasisFile, GroupsFile, SceneFile, check_needed

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
    scene = on_film(source.content, settings.quality, settings.resolution)
    reduce_to(constraints_of(scene.asked).and_then(constraints), basis_lights(scene))
    return Subject(scene=scene, **about)


def subjects_of(
    sources: Sequence[SceneFile | BasisFile | GroupsFile], folder: Path, **how: Any
) -> tuple[Subject, ...]:
    """Views of one lighting to be painted together. how: as of `subject_of`.

    Raises LightpaintError for what cannot be painted, alone or together.
    """
    made = tuple(subject_of(one, folder, among=len(sources), **how) for one in sources)
    check_together([subject.sensor for subject in made])
    bases = [subject.basis for subject in made if subject.basis is not None]
    for basis in bases[1:]:
        check_same_lights(bases[0], basis)
    return made


def check_together(sensors: Sequence[str]) -> None:
    """Raise PaintError unless several views have names, by which files can be called."""
    if len(sensors) == 1:
        return
    if len(set(sensors)) < len(sensors):
        raise PaintError(f"a view is there twice: {some_names(sensors)}; give each sensor once")
    for name in sensors:
        if not is_name(name):
            raise PaintError(
                f"the sensor id {one_line(repr(name))} cannot name a file: choose another id"
            )


def identity_of(subjects: Sequence[Subject]) -> Identity:
    """What their session is of; of scenes that of the bases which are still to be rendered."""
    bases = [subject.basis for subject in subjects if subject.basis is not None]
    if bases:
        return Identity.of(bases)
    scenes = [subject.scene for subject in subjects if subject.scene is not None]
    names = tuple(light.name for light in scenes[0].lights)
    views = tuple(Seen(scene.sensor_names[scene.sensor], scene.size) for scene in scenes)
    return Identity(scenes[0].path.name, scenes[0].identity, names, views)


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
    store = Store.open(path, identity_of(subjects))
    studio = Studio(subjects, lambda _: store)
    try:
        server = Server(studio, store, host=host, port=port, say=say)
        try:
            opened(server)
            studio.start()
            server.run()
        finally:
            server.close()
    finally:
        _end(studio, store)


def _end(studio: Studio, store: Store) -> None:
    """Close both, and the store also where the studio fails; then let renders come to an end.

    What Mitsuba is at in another thread cannot be left alone at the end of a process.
    """
    try:
        studio.close()
    finally:
        store.close()
    wait_for_renders()


def wait_for_renders() -> None:
    """Until what renders beside a painter has come to an end."""
    end_s = time.monotonic() + PATIENCE_S
    for thread in threading.enumerate():
        if thread.name.startswith("lightpaint-"):
            thread.join(max(0.0, end_s - time.monotonic()))
