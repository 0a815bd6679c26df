"""The session file, which is opened once the identity of its views is known."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path

from lightpaint.display_text import some_names
from lightpaint.errors import PaintError
from lightpaint.files import is_name, one_line
from lightpaint.paint.server.server import Server
from lightpaint.paint.store.history_steps import Identity, ViewIdentity
from lightpaint.paint.store.store import Store
from lightpaint.paint.subject import LazyScene, Subject, sensor_name
from lightpaint.scene.scene import Scene


def session_identity(
    subjects: Sequence[Subject], loaded: Mapping[int, Scene] | None = None
) -> Identity | None:
    """Return the identity of a session; None while a scene still has to be loaded for it.

    loaded: scenes that have been loaded, by view. A scene has the same identity as its later basis.
    """
    bases = [subject.basis for subject in subjects if subject.basis is not None]
    if bases:
        return Identity.of(bases)
    records = []
    for k, subject in enumerate(subjects):
        scene = subject.loaded_scene if not isinstance(subject.scene, LazyScene) else None
        record = subject.record or scene or (loaded or {}).get(k)
        if record is None:
            return None
        records.append(record)
    first = records[0]
    names = tuple(light.name for light in first.lights)
    views = tuple(ViewIdentity(sensor_name(record), record.size) for record in records)
    return Identity(Path(first.path).name, first.identity, names, views)


def check_view_names(sensors: Sequence[str]) -> None:
    """Raise PaintError unless several views have distinct names that are valid file names."""
    if len(sensors) == 1:
        return
    if len(set(sensors)) < len(sensors):
        raise PaintError(f"a view is there twice: {some_names(sensors)}; give each sensor once")
    for name in sensors:
        if not is_name(name):
            raise PaintError(
                f"the sensor id {one_line(repr(name))} cannot name a file: choose another id"
            )


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
        for k, subject in enumerate(subjects):
            if subject.record is not None and isinstance(subject.scene, LazyScene):
                self._report_new(subject.scene.remarks)
            elif isinstance(subject.scene, LazyScene):
                subject.scene.checks.append(partial(self._on_scene_loaded, k, subject.scene))

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
        from lightpaint.pipeline.job.remarks import (
            remarks_of_film,
            remarks_of_memory,
            remarks_of_scene,
        )

        self._loaded[k] = scene
        if (identity := session_identity(self._subjects, self._loaded)) is not None:
            self._open_with(identity)
        lasting = *remarks_of_scene(scene), *remarks_of_film(scene, lazy_scene.settings)
        self._report_new((*lasting, *remarks_of_memory(scene)))
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
