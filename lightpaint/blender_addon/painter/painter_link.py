# SPDX-License-Identifier: GPL-3.0-or-later
"""The connection to a painter: a thread reads messages, whoever asks gets them from a queue."""

import queue
import threading
import time

from .painter_messages import PROTOCOL_VERSION, from_bytes, to_bytes
from .socket_client import SocketClient

#: Messages that wait at most; of a painter that is much faster the oldest are dropped.
MAX_WAITING = 256

#: Seconds between two tries to connect.
RETRY_S = 0.2


class PainterLink:
    """An observer of a painter. `messages` may be called from one thread only.

    patience_s: seconds in which the painter has to answer; 0 to try once.

    Attributes:
        is_connected: Whether the painter has answered.
        has_ended: Whether the connection has ended and every message has been given out.
        error: Why there was no connection, or what ended it beside its ordinary end.
    """

    def __init__(self, address, token, patience_s=0.0):
        self.is_connected = self.has_ended = False
        self.error = ""
        self._address, self._token, self._patience_s = address, token, patience_s
        self._socket, self._queue = None, queue.Queue()
        self._is_over, self._is_closed = threading.Event(), False
        threading.Thread(target=self._run, name="lightpaint", daemon=True).start()

    def messages(self):
        """Return what has arrived since the last call, as pairs of JSON and buffers."""
        was_over, arrived = self._is_over.is_set(), []
        while not self._queue.empty():
            arrived.append(self._queue.get())
        self.has_ended = was_over
        return arrived

    def close(self):
        """End the connection."""
        self._is_closed = True
        if self._socket is not None:
            self._socket.close()

    def _run(self):
        try:
            self._socket = self._connect()
            self._socket.send(to_bytes({"kind": "observe", "seq": 1, "version": PROTOCOL_VERSION}))
            self.is_connected = True
            while (frame := self._socket.receive()) is not None:
                if self._queue.qsize() >= MAX_WAITING:
                    self._queue.get()
                self._queue.put(from_bytes(frame))
        except (OSError, ValueError) as error:
            self.error = " ".join(str(error).split())
        finally:
            if self._socket is not None:
                self._socket.close()
            self._is_over.set()

    def _connect(self):
        end = time.monotonic() + self._patience_s
        while True:
            try:
                return SocketClient.open(self._address, self._token)
            except OSError:
                if self._is_closed or time.monotonic() > end:
                    raise
                time.sleep(RETRY_S)
