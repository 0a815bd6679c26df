"""Small rigs of a console, and packets in the words of their standards."""

import socket
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from patience import PATIENCE_S

from lightpaint.dmx.console_rig import ConsoleRig, DmxChannel, RigEmitter, RigFixture, RigLight

COLORS = ("red", "green", "blue", "white")

#: Level at rest of the shutter of a lamp, and of its pan, which stays in the middle.
OPEN, MIDDLE = 32, 32768


def lamp(name: str, address: int, *, bits: int = 8, colors: tuple[str, ...] = COLORS) -> RigFixture:
    """A head of one light: dimmer, shutter, pan, and its emitters, of 8 or 16 bits."""
    size, first = bits // 8, 5
    places = [(first + size * k, first + 1 + size * k)[:size] for k in range(len(colors))]
    channels = (
        DmxChannel("Dimmer", "Head", (1,)),
        DmxChannel("Shutter1", "Head", (2,), default=OPEN),
        DmxChannel("Pan", "Yoke", (3, 4), default=MIDDLE),
        *(
            DmxChannel(f"ColorAdd_{color[0].upper()}", "Head", place)
            for color, place in zip(colors, places, strict=True)
        ),
    )
    emitters = tuple(
        RigEmitter(color, (0.3, 0.3), 1000.0, (3 + k,)) for k, color in enumerate(colors)
    )
    down, forward = (0.0, 0.0, -1.0), (0.0, 1.0, 0.0)
    light = RigLight(name, (0.0, 0.0, 4.0), down, forward, 20.0, 30.0, emitters, (0,))
    return RigFixture(
        f"{100 + address}", name, "Lamp", f"{bits} bit", {1: address}, channels, (light,)
    )


def two_lamps() -> ConsoleRig:
    """A lamp of 8 bits at 1.1, and one of 16 bits at 2.501."""
    lamps = lamp("left", 1), lamp("right", 512 + 501, bits=16)
    return ConsoleRig("show.mvr", lamps)


@contextmanager
def open_port(address: str = "127.0.0.1") -> Iterator[socket.socket]:
    """A free port of this machine that waits for packets."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as opened:
        opened.bind((address, 0))
        opened.settimeout(PATIENCE_S)
        yield opened


@dataclass(frozen=True)
class SacnFields:
    """The fields of a packet of E1.31 that differ from packet to packet."""

    cid: bytes
    source: str
    priority: int
    synchronization: int
    sequence: int
    options: int
    universe: int
    start_code: int
    slots: bytes

    @property
    def is_last(self) -> bool:
        """The bit Stream_Terminated, bit 6."""
        return bool(self.options & 0x40)


#: ANSI E1.31-2018, table 4-1: root layer, framing layer, DMP layer; big-endian.
SACN_LAYOUT = struct.Struct("!HH12sHI16s HI64sBHBBH HBBHHHB")


def sacn_fields(data: bytes) -> SacnFields:
    """Take a packet of levels apart, and hold all that is the same in each against the standard."""
    fields = SACN_LAYOUT.unpack_from(data)
    preamble, postamble, acn, root_length, root_vector, cid = fields[:6]
    frame_length, frame_vector, source, priority, sync, sequence, options, universe = fields[6:14]
    dmp_length, dmp_vector, kind, first, increment, count, start_code = fields[14:]
    assert (preamble, postamble, acn) == (0x0010, 0x0000, b"ASC-E1.17\x00\x00\x00")
    assert root_vector == 0x00000004  # VECTOR_ROOT_E131_DATA
    assert frame_vector == 0x00000002  # VECTOR_E131_DATA_PACKET
    assert (dmp_vector, kind, first, increment) == (0x02, 0xA1, 0x0000, 0x0001)
    slots = data[SACN_LAYOUT.size :]
    assert count == len(slots) + 1
    # A length counts from its own first byte to the end of the packet; its upper bits are 0x7.
    for start, length in ((16, root_length), (38, frame_length), (115, dmp_length)):
        assert length == 0x7000 | (len(data) - start)
    text = source.rstrip(b"\x00").decode("utf-8")
    return SacnFields(cid, text, priority, sync, sequence, options, universe, start_code, slots)


def sacn_packet(
    slots: bytes,
    *,
    universe: int = 1,
    cid: bytes = b"a console's cid.",
    source: bytes = b"console",
    priority: int = 100,
    sequence: int = 0,
    options: int = 0,
    start_code: int = 0,
) -> bytes:
    """Return a packet as the standard lays it out."""
    size = SACN_LAYOUT.size + len(slots)
    head = SACN_LAYOUT.pack(
        *(0x0010, 0, b"ASC-E1.17\x00\x00\x00", 0x7000 | (size - 16), 4, cid),
        *(0x7000 | (size - 38), 2, source, priority, 0, sequence, options, universe),
        *(0x7000 | (size - 115), 2, 0xA1, 0, 1, len(slots) + 1, start_code),
    )
    return head + slots


@dataclass(frozen=True)
class ArtnetFields:
    """The fields of ArtDmx that differ from packet to packet."""

    sequence: int
    universe: int
    slots: bytes


def artnet_fields(data: bytes) -> ArtnetFields:
    """Take an ArtDmx packet apart, as Art-Net 4 lays it out."""
    name, op_code, version, sequence, physical, sub_uni, net, length = struct.unpack_from(
        "<8sH2sBBBB2s", data
    )
    assert (name, op_code) == (b"Art-Net\x00", 0x5000)
    assert (int.from_bytes(version, "big"), physical) == (14, 0)
    slots = data[18:]
    assert int.from_bytes(length, "big") == len(slots)
    assert len(slots) % 2 == 0
    return ArtnetFields(sequence, net << 8 | sub_uni, slots)


def artnet_packet(slots: bytes, *, universe: int = 0, sequence: int = 0) -> bytes:
    """Return an ArtDmx packet."""
    head = struct.pack(
        "<8sH2sBBH2s",
        *(b"Art-Net\x00", 0x5000, b"\x00\x0e", sequence, 0, universe),
        len(slots).to_bytes(2, "big"),
    )
    return head + slots
