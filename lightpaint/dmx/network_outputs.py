"""Levels on a network: as Art-Net 4 by the library `pyartnet`, whose node sends on request, and as
sACN, ANSI E1.31, in packets of the library `sacn`.

The sender of `sacn` sends to port 5568 only, loses errors in a thread of its own, and synchronizes
by multicast what it flushes; so only its packets are used, and the socket is ours.
"""

import asyncio
import socket
import uuid
from collections.abc import Collection, Mapping
from concurrent.futures import ThreadPoolExecutor

import sacn
from pyartnet import ArtNetNode
from pyartnet.base.network import UnicastNetworkTarget

from lightpaint.dmx.console_rig import UNIVERSE_SIZE
from lightpaint.dmx.console_target import ConsoleTarget

#: The address of all nodes of Art-Net in the network.
BROADCAST = "255.255.255.255"

#: Packets that end a stream, E1.31 (6.2.6).
FAREWELLS = 3

#: Routers that a multicast packet may pass.
HOPS = 8


class BroadcastTarget(UnicastNetworkTarget):
    """An address of many nodes, to which a plain socket may not send."""

    def create_socket(self) -> socket.socket:
        """Return a socket that may."""
        created = super().create_socket()
        created.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        return created


class ArtnetOutput:
    """A controller that sends Art-Net. The protocol has no priority and no end of a stream."""

    def __init__(
        self, target: ConsoleTarget, universes: Collection[int], *, interface: str
    ) -> None:
        """Open a socket; nothing is sent. interface: address of this machine, "" for any.

        Raises ConsoleError for a host without an address.
        """
        kind = BroadcastTarget if target.is_group else UnicastNetworkTarget
        host = BROADCAST if target.is_group else target.address()
        self._node = ArtNetNode(kind.create(host, target.port, source_ip=interface or None))
        self._channels = {
            universe: self._node.add_universe(universe).add_channel(1, UNIVERSE_SIZE)
            for universe in universes
        }
        self._loop = asyncio.new_event_loop()
        # The caller's thread may have a loop of its own, as in a notebook.
        with ThreadPoolExecutor(1) as thread:
            thread.submit(self._loop.run_until_complete, self._open()).result()

    def send(self, levels: Mapping[int, bytes]) -> None:
        """Send the 512 bytes of each universe, from a thread without a loop. Raises OSError."""
        self._loop.run_until_complete(self._send(levels))

    def close(self) -> None:
        """Close the socket; nodes keep their last levels."""
        try:
            self._loop.run_until_complete(self._node.__aexit__(None, None, None))
        finally:
            self._loop.close()

    async def _open(self) -> None:
        await self._node.__aenter__()
        # The schedule is ours: both protocols have the same.
        await self._node.stop_refresh()

    async def _send(self, levels: Mapping[int, bytes]) -> None:
        for universe, values in levels.items():
            self._channels[universe].set_values(values)
            # Sent here, so that an error reaches the caller, and not the node's own task.
            self._node.get_universe(universe).send_data()


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
