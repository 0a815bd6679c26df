"""Files that pages send in parts, and those that a session begins with: layers and references."""

import hashlib
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from lightpaint.errors import LightpaintError, PaintError
from lightpaint.files import one_line
from lightpaint.paint import protocol
from lightpaint.paint.layers.canvases import LayeredPaintings
from lightpaint.paint.layers.layer_files import read_layers
from lightpaint.paint.layers.layer_stack import PAINTING_ID, LayerStack
from lightpaint.paint.protocol import (
    AddReference,
    ImportLayers,
    Message,
    Notice,
    ReferenceInfo,
    ReferenceList,
    TaskStarted,
)
from lightpaint.paint.references.reference_table import read_reference
from lightpaint.paint.session.painting_session import Session
from lightpaint.paint.session_access import StudioLinks

#: Largest file that a page may send, in bytes.
MAX_LAYERS_BYTES = 2**29

#: Largest file of a reference, in bytes.
MAX_REFERENCE_BYTES = 2**27


class ReceivedFile:
    """A file that arrives in parts; the next one takes its place.

    max_bytes: of the largest that is taken. It is in memory until it has arrived.
    """

    def __init__(self, max_bytes: int) -> None:
        self._max_bytes = max_bytes
        self._parts: list[bytes] = []

    def take(
        self,
        message: ImportLayers | AddReference,
        arrays: Mapping[str, npt.NDArray[Any]],
    ) -> list[bytes] | None:
        """Take a part; return all parts after the last one, None before.

        Raises PaintError for anything else than the next part.
        """
        part, name = arrays.get("part"), one_line(message.name)
        if part is None or part.dtype != np.uint8:
            raise PaintError("a part of a file without its bytes")
        if message.size > self._max_bytes:
            raise PaintError(
                f"{name} has {message.size / 1e9:.1f} GB: expected at most "
                f"{self._max_bytes / 1e9:.1f} GB"
            )
        if message.start == 0:
            self._parts = []
        end = message.start + part.size
        if message.start != sum(map(len, self._parts)) or end > message.size:
            raise PaintError(f"{name} did not arrive in order: send it again")
        self._parts.append(part.tobytes())
        if end < message.size:
            return None
        parts, self._parts = self._parts, []
        return parts


@contextmanager
def received(parts: list[bytes], name: str) -> Iterator[Path]:
    """Yield a file with these parts, which are taken; errors call it by `name`."""
    with tempfile.TemporaryDirectory(prefix="lightpaint-") as folder:
        path = Path(folder) / "received"
        path.write_bytes(b"".join(parts))
        parts.clear()
        try:
            yield path
        except LightpaintError as error:
            text = error.sentence.spelled(lambda datum: name if datum == path else None)
            raise PaintError(text) from None


def begin_with_layers(session: Session, path: Path) -> bool:
    """Replace the layers by the layers of a file, as a step, unless the session has done that
    before.

    Returns whether it was done now. Raises LightpaintError for a file without usable layers.
    """
    with path.open("rb") as file:
        source = hashlib.file_digest(file, "sha256").hexdigest()
    if any(step.fields.get("source") == source for step in session.store.steps):
        return False
    layers = read_layers(path, session.views[0].size, session.transform)
    _load(session, replace(layers, source=source), path.name)
    return True


def _load(session: Session, layers: LayeredPaintings, name: str) -> list[Message]:
    return session.load({}, session.requests, f"layers of {one_line(name)}", layers=layers)


class LayerImports:
    """Files of layers that pages send in parts. One is received at a time.

    on_loaded: called, without the lock, after the session has got the layers.
    """

    def __init__(self, links: StudioLinks, on_loaded: Callable[[], None]) -> None:
        self._access, self._publisher, self._threads = links
        self._on_loaded = on_loaded
        self._file = ReceivedFile(MAX_LAYERS_BYTES)

    def handle(
        self, message: protocol.ImportLayers, arrays: Mapping[str, npt.NDArray[Any]]
    ) -> list[Message]:
        """Take a part of a file; read the file after the last. Raises PaintError for no part."""
        views = self._access.session.views
        _ = views[message.view]  # raises PaintError if there is no such view
        if message.replaces and len(views) > 1:
            raise PaintError("layers of a file are of one view: put them on top")
        if (parts := self._file.take(message, arrays)) is not None:
            self._threads.start_low_priority(lambda: self._import(message, parts), "import")
        return [TaskStarted(task="import")]

    def _import(self, message: protocol.ImportLayers, parts: list[bytes]) -> None:
        """Give the session the layers of a file that has arrived, and publish its changes.

        Raises LightpaintError if that is impossible.
        """
        session, name = self._access.session, one_line(message.name)
        with received(parts, name) as path:
            layers = read_layers(path, session.views[message.view].size, session.transform)
        layers = replace(layers, view=None if message.replaces else message.view)

        def load() -> list[Message]:
            session.client_left(with_stroke=True)
            return _load(session, layers, name)

        try:
            self._publisher.publish_all_made(load)
            self._publisher.publish(Notice(text=_report(layers.layers, name), tone="info"))
        finally:
            self._on_loaded()


def _report(layers: LayerStack, name: str) -> str:
    count = sum(layer.kind != "group" and layer.id != PAINTING_ID for layer in layers)
    return f"Imported {count} layer{'s' * (count != 1)} of {name}; undo leads back."


class ReferenceImports:
    """The references of a session: files become some, and pages drop others."""

    def __init__(self, links: StudioLinks) -> None:
        self._access, self._publisher, self._threads = links
        self._file = ReceivedFile(MAX_REFERENCE_BYTES)

    def handle(
        self,
        message: protocol.AddReference | protocol.DropReference,
        arrays: Mapping[str, npt.NDArray[Any]],
    ) -> list[Message]:
        """Take a part of a file, which becomes a reference after the last one; or drop a reference.

        Raises PaintError if refused.
        """
        if isinstance(message, protocol.DropReference):
            self._access.session.references.drop(message.reference)
            return [self._list()]
        self._access.session.references.check_room()
        if (parts := self._file.take(message, arrays)) is not None:
            self._threads.start_low_priority(lambda: self._add(message.name, parts), "reference")
        return [TaskStarted(task="reference")]

    def _add(self, file_name: str, parts: list[bytes]) -> None:
        """Keep a file that has arrived as a reference, and publish the list.

        Raises LightpaintError if that is impossible.
        """
        session, name = self._access.session, one_line(file_name)
        with received(parts, name) as path:
            pixels = read_reference(path, session.transform)

        def add() -> Message:
            session.references.add(Path(name).stem or name, pixels)
            return self._list()

        self._publisher.publish_made(add)

    def _list(self) -> ReferenceList:
        references = self._access.session.references
        return ReferenceList(references=tuple(ReferenceInfo(x.id, x.name) for x in references))
