"""Files of a painter in a notebook: its session, what `save` writes, and its one-script page."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol
from weakref import WeakValueDictionary

from lightpaint.errors import PaintError
from lightpaint.lighting.answer.lighting import Lighting
from lightpaint.lighting.answer.lighting_file import write_lighting
from lightpaint.paint.notebook.widget_arguments import notebook_advice
from lightpaint.paint.session.snapshot import SessionSnapshot
from lightpaint.paint.store.history_steps import Identity
from lightpaint.paint.store.store import MemoryStore, Store
from lightpaint.target.painting_file import write_painting
from lightpaint.viewer.bundle import bundled, styles


class Closable(Protocol):
    """The interface of a painter to others that use its file."""

    def close(self) -> None:
        """End the painter."""


#: Painters of this process that keep their session in a file, by its path.
_PAINTERS_BY_FILE: WeakValueDictionary[Path, Closable] = WeakValueDictionary()


def claim_file(path: Path, painter: Closable) -> None:
    """Register `painter` for the session at `path`, and close the painter that had it before."""
    if (earlier := _PAINTERS_BY_FILE.get(path.resolve())) is not None:
        earlier.close()  # the user has run its cell again
    _PAINTERS_BY_FILE[path.resolve()] = painter


def store_path(store: Any) -> Path | None:
    """Return the path of the session file, if one is given. Raises PaintError for anything else."""
    if not isinstance(store, str | Path | None):
        raise PaintError(f"store is {store!r}: expected the path of a file, like 'evening.db'")
    return None if store is None else Path(store)


def open_store(path: Path | None, identity: Identity) -> Store:
    """Return the session at `path`, or one in memory without a path. Raises LightpaintError."""
    if path is None:
        return MemoryStore(identity)
    with notebook_advice():
        return Store.open(path, identity)


def save_answer(
    path: Path, snapshot: SessionSnapshot, lighting: Callable[[], Lighting], *, view: int
) -> None:
    """Write the painting of a view (`.exr`), or the lighting (`.json`). See `Painter.save`."""
    if view not in range(len(snapshot.targets)):
        raise PaintError(f"view is {view!r}: expected one of {len(snapshot.targets)}, from 0 on")
    if path.suffix == ".json":
        write_lighting(path, lighting())
    elif path.suffix != ".exr":
        raise PaintError(f"{path}: expected .exr for the painting, .json for the lighting")
    elif (target := snapshot.targets[view]) is None:
        raise PaintError("nothing is painted yet: there is no painting to keep")
    else:
        write_painting(path, target)


def widget_script() -> str:
    """Return the painter as one ES module, whose default export is an anywidget's."""
    return bundled("paint/page/widget.js")


def widget_style() -> str:
    """Return the style sheet of the painter."""
    return styles("paint/page/style.css")
