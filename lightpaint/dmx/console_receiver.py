"""A receiver of levels on this machine, which shows what arrives as a fixture would take it."""

import errno
import socket
import time
from collections.abc import Hashable, Iterable
from dataclasses import dataclass
from ipaddress import AddressValueError, IPv4Address
from typing import Self

from lightpaint.dmx.console_rig import UNIVERSE_SIZE
from lightpaint.dmx.console_target import SACN, DmxProtocol
from lightpaint.errors import ConsoleError

#: How a packet of ACN begins: sizes before and after the packet, and its name.
ACN_START = b"\x00\x10\x00\x00ASC-E1.17\x00\x00\x00"

#: How a packet of Art-Net with levels begins; then follow the version, 14 or higher, and the rest.
ARTDMX_START = b"Art-Net\x00\x00\x50"

#: Bytes before the levels, and the smallest version.
ARTDMX_HEADER, ARTNET_VERSION = 18, 14

#: Priority where the protocol has none: the priority of sACN by default.
USUAL_PRIORITY = 100

#: The address of this machine for its own programs alone.
LOOPBACK = "127.0.0.1"

#: All addresses of this machine.
ANY = "0.0.0.0"

#: Longer than any packet with levels, in bytes.
MAX_PACKET = 2048

#: Seconds after which silent sources are looked for.
CHECK_S = 0.1


@dataclass(frozen=True)
class DmxPacket:
    """Levels of a universe from a source.

    source: tells sources apart. name: of the source. levels: 512 bytes. sequence: None if packets
    are not counted. is_last: whether its stream ends, and the levels do not count.
    """

    universe: int
    source: Hashable
    name: str
    priority: int
    sequence: int | None
    levels: bytes
    is_last: bool = False

    def is_behind(self, sequence: int | None) -> bool:
        """Return True if it was sent before a packet with a sequence number, as E1.31 (6.7.2)
        decides.
        """
        if sequence is None or self.sequence is None:
            return False
        difference = (self.sequence - sequence + 128) % 256 - 128
        return -20 < difference <= 0


def parse_sacn(data: bytes, sender: str) -> DmxPacket | None:
    """Return the levels in a packet of sACN; None for a preview, another start code than 0, and
    anything else.

    sender: address that it came from.
    """
    from sacn import DataPacket

    if not data.startswith(ACN_START):
        return None
    try:
        packet = DataPacket.make_data_packet(data)
    except (TypeError, ValueError):
        return None
    if packet.option_PreviewData or packet.dmxStartCode != 0:
        return None
    return DmxPacket(
        packet.universe,
        packet.cid,
        packet.sourceName or sender,
        packet.priority,
        packet.sequence,
        bytes(packet.dmxData),
        packet.option_StreamTerminated,
    )


def parse_artnet(data: bytes, sender: str) -> DmxPacket | None:
    """Return the levels in a packet of Art-Net; None for any other. sender: where it came from."""
    if not data.startswith(ARTDMX_START) or len(data) < ARTDMX_HEADER:
        return None
    version, length = (int.from_bytes(data[k : k + 2], "big") for k in (10, 16))
    levels = data[ARTDMX_HEADER:][:length]
    if version < ARTNET_VERSION or length > UNIVERSE_SIZE or len(levels) < length:
        return None
    universe = int.from_bytes(data[14:16], "little") & 0x7FFF
    sequence = data[12] or None
    padded = levels.ljust(UNIVERSE_SIZE, b"\x00")
    return DmxPacket(universe, sender, sender, USUAL_PRIORITY, sequence, padded)


@dataclass(frozen=True)
class LevelStream:
    """The last packet of a source for a universe. received_s: when it came."""

    packet: DmxPacket
    received_s: float


class ConsoleReceiver:
    """The levels of all universes that arrive at a port.

    Of several sources for one universe the highest priority counts, and of these the latest packet.
    A source whose stream has ended, or that is silent for too long, no longer counts; levels stay
    until another source sends.
    """

    def __init__(self, protocol: DmxProtocol, opened: socket.socket) -> None:
        self.protocol, self._socket = protocol, opened
        self._parse = parse_sacn if protocol is SACN else parse_artnet
        self._streams: dict[int, dict[Hashable, LevelStream]] = {}
        self._levels: dict[int, bytes] = {}

    @classmethod
    def open(
        cls,
        protocol: DmxProtocol,
        *,
        address: str = LOOPBACK,
        port: int | None = None,
        groups: Iterable[int] = (),
    ) -> Self:
        """Return a receiver at an address of this machine, `0.0.0.0` for all of them.

        port: the protocol's own if None. groups: universes whose multicast it joins if it listens
        at all addresses; other addresses receive none. Raises ConsoleError for an address that this
        machine does not have, and a port that another program has.
        """
        number = protocol.port if port is None else port
        opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            # Without SO_REUSEADDR: who shares a port takes packets from the other.
            opened.bind((str(IPv4Address(address)), number))
            if address == ANY and protocol is SACN:
                for universe in groups:
                    _join(opened, universe)
        except AddressValueError:
            opened.close()
            raise ConsoleError(f"{address!r} is not an IPv4 address like {LOOPBACK}") from None
        except OSError as error:
            opened.close()
            raise _refusal(error, address, number) from None
        return cls(protocol, opened)

    @property
    def port(self) -> int:
        """The port that it listens at."""
        return int(self._socket.getsockname()[1])

    @property
    def levels(self) -> dict[int, bytes]:
        """The 512 levels of each universe that has been received, as the network numbers them."""
        return dict(self._levels)

    @property
    def sources(self) -> dict[int, DmxPacket]:
        """The latest packet of the source that counts, for each universe that has one."""
        return {
            universe: max(streams.values(), key=_rank).packet
            for universe, streams in self._streams.items()
            if streams
        }

    def receive(self, timeout_s: float) -> None:
        """Take in what arrives within a time, and return at once when it has taken something."""
        end_s = time.monotonic() + timeout_s
        while (left_s := end_s - time.monotonic()) > 0:
            self._socket.settimeout(min(left_s, CHECK_S))
            has_taken = self._take_one()
            self._drop_silent(time.monotonic())
            if has_taken:
                return

    def close(self) -> None:
        """Leave the port to others."""
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _take_one(self) -> bool:
        """Wait for a packet; return True if it has levels."""
        try:
            data, (sender, _) = self._socket.recvfrom(MAX_PACKET)
        except TimeoutError:
            return False
        packet = self._parse(data, sender)
        if packet is None:
            return False
        return self._take(packet, time.monotonic())

    def _take(self, packet: DmxPacket, now_s: float) -> bool:
        streams = self._streams.setdefault(packet.universe, {})
        if packet.is_last:
            return streams.pop(packet.source, None) is not None
        previous = streams.get(packet.source)
        if previous is not None and packet.is_behind(previous.packet.sequence):
            return False
        streams[packet.source] = LevelStream(packet, now_s)
        self._levels[packet.universe] = max(streams.values(), key=_rank).packet.levels
        return True

    def _drop_silent(self, now_s: float) -> None:
        for streams in self._streams.values():
            for source, stream in list(streams.items()):
                if now_s - stream.received_s > self.protocol.silence_s:
                    del streams[source]


def _rank(stream: LevelStream) -> tuple[int, float]:
    return stream.packet.priority, stream.received_s


def _join(opened: socket.socket, universe: int) -> None:
    from sacn.messages.data_packet import calculate_multicast_addr

    group = socket.inet_aton(calculate_multicast_addr(universe)) + socket.inet_aton(ANY)
    opened.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, group)


def _refusal(error: OSError, address: str, port: int) -> ConsoleError:
    if error.errno == errno.EADDRINUSE:
        return ConsoleError(
            f"port {port} of {address} is taken: end the program that listens there, such as a "
            "visualiser or another lightpaint, or give another port"
        )
    reason = error.strerror or error
    return ConsoleError(f"cannot listen at {address}, port {port}: {reason}")
