"""References that pages send as files, and the list of them."""

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy.typing as npt

from lightpaint.errors import LightpaintError
from lightpaint.files import one_line
from lightpaint.paint import protocol
from lightpaint.paint.background_threads import BackgroundThreads
from lightpaint.paint.protocol import Message, Notice, ReferenceInfo, ReferenceList, TaskStarted
from lightpaint.paint.publisher import Publisher
from lightpaint.paint.references.reference_file import read_reference
from lightpaint.paint.session_access import SessionAccess
from lightpaint.paint.studio.received_file import ReceivedFile

#: Largest file of a reference, in bytes.
MAX_REFERENCE_BYTES = 2**27


class ReferenceImports:
    """The references of a session: files become some, and pages drop others."""

    def __init__(
        self, access: SessionAccess, publisher: Publisher, threads: BackgroundThreads
    ) -> None:
        self._access, self._publisher, self._threads = access, publisher, threads
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
        """Keep a file that has arrived as a reference, and publish the list or why not."""
        session, name = self._access.session, one_line(file_name)
        with tempfile.TemporaryDirectory(prefix="lightpaint-") as folder:
            path = Path(folder) / "reference"
            path.write_bytes(b"".join(parts))
            try:
                pixels = read_reference(path, session.transform)
            except LightpaintError as error:
                text = str(error).replace(str(path), name)
                self._publisher.publish(Notice(text=text, tone="warn", task="reference"))
                return

        def add() -> Message:
            try:
                session.references.add(Path(name).stem or name, pixels)
            except LightpaintError as error:
                return Notice(text=str(error), tone="warn", task="reference")
            return self._list()

        self._publisher.publish_made(add)

    def _list(self) -> ReferenceList:
        references = self._access.session.references
        return ReferenceList(references=tuple(ReferenceInfo(x.id, x.name) for x in references))
