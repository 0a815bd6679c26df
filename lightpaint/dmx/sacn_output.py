"""Levels as sACN, ANSI E1.31, in packets of the library `sacn`.

Its sender sends to port 5568 only, loses errors in a thread of its own, and synchronizes by
multicast what it flushes; so only its packets are used, and the socket is ours.
"""

import socket
import uuid
from collections.abc import Collection, Mapping

import sacn

from lightpaint.dmx.console_target import ConsoleTarget

#: Packets that end a stream, E1.31 (6.2.6).
FAREWELLS = 3

#: Routers that a multicast packet may pass.
HOPS = 8


class SacnOutput:
    """A source of sACN."""

    def __init__(
        self,
        target: ConsoleTarget,
        universes: Collection[int],
        *,
        source_name: str,
        priority: int,
        interface: str,
    ) -> None:
        """Open a socket; nothing is sent. interface: address of this machine, "" for any.

        Raises ConsoleError for a host without an address.
        """
        address = "" if target.is_group else target.address()
        identity = tuple(uuid.uuid4().bytes)
        self._packets = {
            universe: sacn.DataPacket(identity, source_name, universe, priority=priority)
            for universe in universes
        }
        self._addresses = {
            universe: (address or packet.calculate_multicast_addr(), target.port)
            for universe, packet in self._packets.items()
        }
        self._begun: set[int] = set()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, HOPS)
        if interface:
            own = socket.inet_aton(interface)
            self._socket.bind((interface, 0))
            self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, own)

    def send(self, levels: Mapping[int, bytes]) -> None:
        """Send the 512 bytes of each universe. Raises OSError."""
        for universe, values in levels.items():
            self._packets[universe].dmxData = tuple(values)
            self._send(universe)
            self._begun.add(universe)

    def close(self) -> None:
        """End the streams that have begun, and close the socket. Raises OSError."""
        try:
            for universe in sorted(self._begun):
                self._packets[universe].option_StreamTerminated = True
                for _ in range(FAREWELLS):
                    self._send(universe)
        finally:
            self._socket.close()

    def _send(self, universe: int) -> None:
        packet = self._packets[universe]
        self._socket.sendto(bytes(packet.getBytes()), self._addresses[universe])
        packet.sequence_increase()
