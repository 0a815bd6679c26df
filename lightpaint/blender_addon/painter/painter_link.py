# SPDX-License-Identifier: GPL-3.0-or-later
"""The connection to a painter: a thread reads messages, whoever asks gets them from a queue.

Beneath is a WebSocket's client side in plain Python (RFC 6455), since Blender brings no library
for it.
"""

import base64
import contextlib
import hashlib
import ipaddress
import os
import re
import socket
import struct
import threading
import time
from collections import deque
from urllib.parse import urlsplit

from .painter_messages import PROTOCOL_VERSION, from_bytes, to_bytes

#: Seconds within which a painter of this machine accepts a connection.
CONNECT_S = 10.0

#: Maximum size of a message in bytes, as the painter has it.
MAX_MESSAGE = 2**28

#: Maximum number of frames of a message, of which most may be empty.
MAX_FRAMES = 2**12

#: Maximum size of the answer to the handshake in bytes.
MAX_HANDSHAKE = 2**16

#: What a token, and the path of an address, consist of, so that they end no line of a request.
_TOKEN, _PATH = re.compile(r"[A-Za-z0-9._~+/=-]+"), re.compile(r"[A-Za-z0-9._~/-]*")

_GUID = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"
_CONTINUATION, _BINARY, _CLOSE, _PING, _PONG = 0, 2, 8, 9, 10

#: Messages that wait at most, and their bytes; of a painter that is much faster the oldest are
#: dropped.
MAX_WAITING, MAX_WAITING_BYTES = 256, 2**25

#: Seconds in which a painter that is left takes the word for it.
CLOSE_S = 0.2

#: Seconds between two tries to connect.
RETRY_S = 0.2


class SocketClient:
    """A connection that sends and receives binary messages. One thread reads, any may send."""

    def __init__(self, connection, unread):
        self._connection, self._unread = connection, bytearray(unread)

    @classmethod
    def open(cls, address, token):
        """Connect to `live` under a painter's address.

        Raises OSError if it does not answer, and ValueError for what is not an address or token.
        """
        parts = checked_address(address, token)
        connection = socket.create_connection((parts.hostname, parts.port or 80), CONNECT_S)
        try:
            key = base64.b64encode(os.urandom(16)).decode()
            request = (
                f"GET {parts.path.rstrip('/')}/live HTTP/1.1\r\nHost: {parts.netloc}\r\n"
                "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                f"Sec-WebSocket-Key: {key}\r\nAuthorization: Bearer {token}\r\n\r\n"
            )
            connection.sendall(request.encode("ascii"))
            head, unread = _read_head(connection)
            expected = base64.b64encode(hashlib.sha1((key + _GUID).encode()).digest()).decode()
            if not head.startswith("HTTP/1.1 101") or expected not in head:
                first = head.partition("\r\n")[0][:80]
                raise ConnectionError(f"the painter refused: {first!r}")
            connection.settimeout(None)
        except BaseException:
            connection.close()
            raise
        return cls(connection, unread)

    def send(self, data):
        """Send one binary message."""
        self._connection.sendall(client_frame(_BINARY, data))

    def receive(self):
        """Return the next binary message; None once the connection has ended.

        Raises ValueError for frames that no painter sends.
        """
        parts, size = [], 0
        while True:
            try:
                is_last, code, data = self._read_frame()
                if code == _PING:
                    self._connection.sendall(client_frame(_PONG, data))
            except OSError:
                return None
            if code == _CLOSE:
                return None
            if code in (_PING, _PONG):
                continue
            if code != (_CONTINUATION if parts else _BINARY):
                raise ValueError(f"a frame of the kind {code}, which no painter sends here")
            parts.append(data)
            size += len(data)
            if size > MAX_MESSAGE or len(parts) > MAX_FRAMES:
                raise ValueError("a message that is longer than a painter's")
            if is_last:
                return b"".join(parts)

    def close(self):
        """End the connection, also for the thread that reads it, and if nobody reads it there."""
        with contextlib.suppress(OSError):
            self._connection.settimeout(CLOSE_S)
            self._connection.sendall(client_frame(_CLOSE, struct.pack(">H", 1000)))
        with contextlib.suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)
        self._connection.close()

    def _read_frame(self):
        first, second = self._read(2)
        length = second & 0x7F
        if length == 126:
            (length,) = struct.unpack(">H", self._read(2))
        elif length == 127:
            (length,) = struct.unpack(">Q", self._read(8))
        code, is_last = first & 0x0F, bool(first & 0x80)
        is_control = code >= _CLOSE
        if first & 0x70 or second & 0x80 or (is_control and (length > 125 or not is_last)):
            raise ValueError("a frame that is none of a painter's")
        if length > MAX_MESSAGE:
            raise ValueError("a message that is longer than a painter's")
        return is_last, code, self._read(length)

    def _read(self, count):
        while len(self._unread) < count:
            data = self._connection.recv(1 << 16)
            if not data:
                raise ConnectionError("the painter has closed the connection")
            self._unread += data
        data = bytes(self._unread[:count])
        del self._unread[:count]
        return data


def checked_address(address, token):
    """Return the parts of a painter's address. Raises ValueError for others, or an odd token."""
    if not isinstance(address, str) or not isinstance(token, str):
        raise ValueError("a painter has an address and a token, both texts")
    parts = urlsplit(address)
    if parts.scheme != "http" or not parts.hostname or not _PATH.fullmatch(parts.path):
        raise ValueError(f"{address[:80]!r} is not an address of a painter")
    if not _TOKEN.fullmatch(token):
        raise ValueError("the painter's token has characters that no token has")
    return parts


def is_loopback(hostname):
    """Return whether a host of an address is this machine itself."""
    if hostname == "localhost":
        return True
    try:
        return ipaddress.ip_address(hostname).is_loopback
    except ValueError:
        return False


def client_frame(code, data):
    """Return one masked frame, as clients have to send them."""
    if len(data) < 126:
        length = struct.pack(">B", 0x80 | len(data))
    elif len(data) < 2**16:
        length = struct.pack(">BH", 0x80 | 126, len(data))
    else:
        length = struct.pack(">BQ", 0x80 | 127, len(data))
    mask = os.urandom(4)
    # The exclusive or of two integers is a hundred times as fast as the exclusive or of their
    # bytes.
    repeated = (mask * (len(data) // 4 + 1))[: len(data)]
    masked = int.from_bytes(data, "big") ^ int.from_bytes(repeated, "big")
    return bytes([0x80 | code]) + length + mask + masked.to_bytes(len(data), "big")


def _read_head(connection):
    """Return the head of the answer to a handshake, and what was read beyond it."""
    received = b""
    while b"\r\n\r\n" not in received:
        data = connection.recv(1 << 12)
        if not data or len(received) > MAX_HANDSHAKE:
            raise ConnectionError("the painter did not answer the handshake")
        received += data
    head, _, unread = received.partition(b"\r\n\r\n")
    return head.decode("latin-1"), unread


class _Waiting:
    """Messages that one thread adds and another takes, the oldest first."""

    def __init__(self):
        self._messages, self._bytes, self._lock = deque(), 0, threading.Lock()

    def add(self, message, size):
        """Add a message, of so many bytes, and drop the oldest ones beyond the bounds."""
        with self._lock:
            self._messages.append((message, size))
            self._bytes += size
            while len(self._messages) > 1 and (
                len(self._messages) > MAX_WAITING or self._bytes > MAX_WAITING_BYTES
            ):
                self._bytes -= self._messages.popleft()[1]

    def take(self):
        """Return all that wait, of which none waits any more."""
        with self._lock:
            taken, self._messages, self._bytes = self._messages, deque(), 0
        return [message for message, _ in taken]


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
        self._socket, self._waiting = None, _Waiting()
        self._is_over, self._is_closed = threading.Event(), False
        threading.Thread(target=self._run, name="lightpaint", daemon=True).start()

    def messages(self):
        """Return what has arrived since the last call, as pairs of JSON and buffers."""
        was_over = self._is_over.is_set()
        arrived = self._waiting.take()
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
                self._waiting.add(from_bytes(frame), len(frame))
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
