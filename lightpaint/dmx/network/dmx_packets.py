"""Packets of levels as they arrive; all others are ignored."""

from collections.abc import Hashable
from dataclasses import dataclass

from lightpaint.dmx.console_rig import UNIVERSE_SIZE

#: How a packet of ACN begins: sizes before and after the packet, and its name.
ACN_START = b"\x00\x10\x00\x00ASC-E1.17\x00\x00\x00"

#: How a packet of Art-Net with levels begins; then follow the version, 14 or higher, and the rest.
ARTDMX_START = b"Art-Net\x00\x00\x50"

#: Bytes before the levels, and the smallest version.
ARTDMX_HEADER, ARTNET_VERSION = 18, 14

#: Priority where the protocol has none: that of sACN by default.
USUAL_PRIORITY = 100


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
