"""The receiver of levels: what counts, and what is ignored."""

import socket
from collections.abc import Iterator
from typing import Any

import pytest
from console_rigs import artnet_packet, open_port, sacn_packet
from hypothesis import given
from hypothesis import strategies as st
from patience import PATIENCE_S

from lightpaint.dmx import console_receiver
from lightpaint.dmx.console_receiver import ConsoleReceiver, parse_artnet, parse_sacn
from lightpaint.dmx.console_target import ARTNET, SACN
from lightpaint.errors import ConsoleError

LEVELS, OTHERS = bytes(range(256)) * 2, bytes(512)


class Wire:
    """A receiver and a socket that sends to it."""

    def __init__(self, receiver: ConsoleReceiver, sender: socket.socket) -> None:
        self.receiver, self._sender = receiver, sender

    def deliver(self, *packets: bytes) -> None:
        """Send packets one by one, each of which is taken in."""
        for packet in packets:
            self._sender.sendto(packet, ("127.0.0.1", self.receiver.port))
            self.receiver.receive(PATIENCE_S)

    def ignore(self, *packets: bytes) -> None:
        """Send packets that change nothing."""
        before = self.receiver.levels, self.receiver.sources
        for packet in packets:
            self._sender.sendto(packet, ("127.0.0.1", self.receiver.port))
        self.receiver.receive(0.02)
        assert (self.receiver.levels, self.receiver.sources) == before


@pytest.fixture(params=[SACN, ARTNET], ids=lambda x: x.name)
def wire(request: Any) -> Iterator[Wire]:
    with open_port() as sender, ConsoleReceiver.open(request.param, port=0) as receiver:
        yield Wire(receiver, sender)


@pytest.fixture
def sacn_wire() -> Iterator[Wire]:
    with open_port() as sender, ConsoleReceiver.open(SACN, port=0) as receiver:
        yield Wire(receiver, sender)


def test_levels_arrive(wire: Wire) -> None:
    is_sacn = wire.receiver.protocol is SACN
    packet = sacn_packet(LEVELS, universe=7) if is_sacn else artnet_packet(LEVELS, universe=7)
    wire.deliver(packet)
    assert wire.receiver.levels == {7: LEVELS}
    name = "console" if is_sacn else "127.0.0.1"
    assert [(x, s.name, s.priority) for x, s in wire.receiver.sources.items()] == [(7, name, 100)]


def test_short_universes_are_filled(wire: Wire) -> None:
    is_sacn = wire.receiver.protocol is SACN
    wire.deliver(sacn_packet(b"\x01\x02") if is_sacn else artnet_packet(b"\x01\x02", universe=1))
    assert wire.receiver.levels == {1: b"\x01\x02".ljust(512, b"\x00")}


def test_previews_and_other_start_codes_are_ignored(sacn_wire: Wire) -> None:
    sacn_wire.ignore(
        sacn_packet(LEVELS, options=0x80),
        sacn_packet(LEVELS, start_code=0xDD),
        sacn_packet(LEVELS, start_code=0x17),
    )
    sacn_wire.deliver(sacn_packet(OTHERS, sequence=1))
    sacn_wire.ignore(
        sacn_packet(LEVELS, options=0x80, priority=200, sequence=2),
        sacn_packet(bytes([200] * 512), start_code=0xDD, sequence=3),
    )


def test_the_highest_priority_counts(sacn_wire: Wire) -> None:
    other = {"cid": b"the cid of other", "priority": 150}
    sacn_wire.deliver(sacn_packet(OTHERS), sacn_packet(LEVELS, **other))
    sacn_wire.deliver(sacn_packet(OTHERS, sequence=1))
    assert sacn_wire.receiver.levels == {1: LEVELS}
    assert sacn_wire.receiver.sources[1].priority == 150
    # When its stream has ended, the other one counts at once, and its last levels do not.
    sacn_wire.deliver(sacn_packet(bytes(512), **other, sequence=1, options=0x40))
    assert sacn_wire.receiver.sources[1].priority == 100
    sacn_wire.deliver(sacn_packet(OTHERS, sequence=2))
    assert sacn_wire.receiver.levels == {1: OTHERS}


def test_levels_stay_when_a_stream_has_ended(sacn_wire: Wire) -> None:
    sacn_wire.deliver(sacn_packet(LEVELS), sacn_packet(OTHERS, sequence=1, options=0x40))
    assert sacn_wire.receiver.levels == {1: LEVELS}
    assert sacn_wire.receiver.sources == {}


def test_a_silent_source_no_longer_counts(wire: Wire, monkeypatch: pytest.MonkeyPatch) -> None:
    is_sacn = wire.receiver.protocol is SACN
    wire.deliver(sacn_packet(LEVELS) if is_sacn else artnet_packet(LEVELS, universe=1))
    assert wire.receiver.sources
    now_s = console_receiver.time.monotonic() + wire.receiver.protocol.silence_s
    wire.receiver._drop_silent(now_s + 1)
    assert wire.receiver.sources == {}
    assert wire.receiver.levels == {1: LEVELS}


def test_late_packets_are_dropped(wire: Wire) -> None:
    is_sacn = wire.receiver.protocol is SACN

    def packet(levels: bytes, sequence: int) -> bytes:
        if is_sacn:
            return sacn_packet(levels, sequence=sequence)
        return artnet_packet(levels, universe=1, sequence=sequence)

    wire.deliver(packet(LEVELS, 250))
    wire.ignore(packet(OTHERS, 249), packet(OTHERS, 231), packet(OTHERS, 250))
    wire.deliver(packet(OTHERS, 4))  # counted on, beyond 255
    assert wire.receiver.levels == {1: OTHERS}
    wire.deliver(packet(LEVELS, 200))  # so far behind that it has begun anew
    assert wire.receiver.levels == {1: LEVELS}


def test_what_is_not_counted_is_not_late() -> None:
    """Art-Net's sequence of 0 says that packets are not counted."""
    with open_port() as sender, ConsoleReceiver.open(ARTNET, port=0) as receiver:
        wire = Wire(receiver, sender)
        wire.deliver(artnet_packet(LEVELS), artnet_packet(OTHERS))
    assert receiver.levels == {0: OTHERS}


@given(st.binary(max_size=700))
def test_other_packets_are_ignored(data: bytes) -> None:
    assert parse_sacn(data, "10.0.0.9") is None
    assert parse_artnet(data, "10.0.0.9") is None


@given(st.integers(0, 637), st.integers(0, 255), st.integers(0, 637))
def test_damaged_packets_are_levels_or_ignored(place: int, value: int, length: int) -> None:
    sacn_data = bytearray(sacn_packet(LEVELS, priority=90))
    artnet_data = bytearray(artnet_packet(LEVELS))
    sacn_data[place] = value
    artnet_data[place % len(artnet_data)] = value
    for data, parse in ((sacn_data, parse_sacn), (artnet_data, parse_artnet)):
        for cut in (bytes(data), bytes(data[:length])):
            packet = parse(cut, "10.0.0.9")
            assert packet is None or len(packet.levels) == 512


def test_a_port_that_is_taken_is_refused() -> None:
    with open_port() as taken:
        number = taken.getsockname()[1]
        for protocol in (SACN, ARTNET):
            with pytest.raises(ConsoleError, match=f"port {number} of 127.0.0.1 is taken"):
                ConsoleReceiver.open(protocol, port=number)


def test_addresses_of_others_are_refused() -> None:
    with pytest.raises(ConsoleError, match=r"cannot listen at 192\.0\.2\.77"):
        ConsoleReceiver.open(SACN, address="192.0.2.77", port=0)
    with pytest.raises(ConsoleError, match="'stage' is not an IPv4 address"):
        ConsoleReceiver.open(SACN, address="stage", port=0)
