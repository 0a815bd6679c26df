"""Where the session of what is painted is kept, and that it is one of just these views."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path

from lightpaint.errors import PaintError
from lightpaint.files import is_name, one_line
from lightpaint.paint.lazy_scene import Opening
from lightpaint.paint.server.server import Server
from lightpaint.paint.store.steps import Identity, SeenFrom
from lightpaint.paint.store.store import Store
from lightpaint.paint.subject import Subject, sensor_of
from lightpaint.scene.scene import Scene
from lightpaint.screen import some_names


def identity_of(
    subjects: Sequence[Subject], loaded: Mapping[int, Scene] | None = None
) -> Identity | None:
    """What their session is of; None as long as a scene has to be loaded for that.

    loaded: scenes of openings that have been, by their views. Of scenes it is that of the bases
    which are still to be rendered.
    """
    bases = [subject.basis for subject in subjects if subject.basis is not None]
    if bases:
        return Identity.of(bases)
    found = []
    for k, subject in enumerate(subjects):
        scene = subject.loaded if not isinstance(subject.scene, Opening) else None
        its = subject.known or scene or (loaded or {}).get(k)
        if its is None:
            return None
        found.append(its)
    first = found[0]
    names = tuple(light.name for light in first.lights)
    views = tuple(SeenFrom(sensor_of(its), its.size) for its in found)
    return Identity(Path(first.path).name, first.identity, names, views)


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


class Keeping:
    """The session file at `path`: opened at once, unless scenes have to be loaded for that.

    say: hears what is worth saying of the scenes, each thing once.

    Attributes:
        store: The session; None as long as there is none, and nobody knows what it is of.
        server: Told once it is known.
        on_opened: Called when there is a store that was not there at first.
    """

    def __init__(self, subjects: Sequence[Subject], path: Path, say: Callable[[str], None]) -> None:
        self.store: Store | None = None
        self.server: Server | None = None
        self.on_opened: Callable[[], None] = lambda: None
        self._subjects, self._path, self._say = subjects, path, say
        self._loaded: dict[int, Scene] = {}
        self._said: set[str] = set()
        if (identity := identity_of(subjects)) is not None or path.exists():
            self.store = Store.open(path, identity)
        for k, subject in enumerate(subjects):
            if subject.known is not None and isinstance(subject.scene, Opening):
                self._tell(subject.scene.remarks)
            elif isinstance(subject.scene, Opening):
                subject.scene.checks.append(partial(self._take, k, subject.scene))

    def opened(self, _: Identity) -> Store:
        """The store, when there are bases."""
        assert self.store is not None
        return self.store

    def _take(self, k: int, opening: Opening, scene: Scene) -> None:
        """Once the scene of view k is there, of which nothing was known."""
        from lightpaint.pipeline.remarks import remarks_of_film, remarks_of_memory, remarks_of_scene

        self._loaded[k] = scene
        if (identity := identity_of(self._subjects, self._loaded)) is not None:
            self._begin(identity)
        lasting = *remarks_of_scene(scene), *remarks_of_film(scene, opening.settings)
        self._tell((*lasting, *remarks_of_memory(scene)))
        from lightpaint.scene.runtime.variant import use_variant

        # What is said of this machine may not be so the next time.
        opening.remarks = tuple(x for x in lasting if x != use_variant().note)

    def _begin(self, identity: Identity) -> None:
        """Once all scenes are there."""
        check_together([view.sensor for view in identity.views])
        if self.store is None:
            self.store = Store.open(self._path, identity)
            self.on_opened()
        else:
            self.store.becomes(identity)
        if self.server is not None:
            self.server.keeps(self.store)

    def _tell(self, remarks: Iterable[str]) -> None:
        for remark in remarks:
            if remark not in self._said:
                self._said.add(remark)
                self._say(remark)
