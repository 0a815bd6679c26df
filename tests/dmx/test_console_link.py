"""Packets that leave for a console, byte by byte against the standards, and their times."""

import asyncio
import math
import socket
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from threading import Event
from typing import Any

import numpy as np
import pytest
import sacn
from console_rigs import artnet_fields, open_port, sacn_fields, two_lamps
from hypothesis import given
from hypothesis import strategies as st
from patience import PATIENCE_S

from lightpaint.dmx import console_link
from lightpaint.dmx.console_link import KEEP_ALIVE_S, ConsoleLink, SendSchedule
from lightpaint.dmx.console_receiver import ConsoleReceiver
from lightpaint.dmx.console_target import ARTNET, SACN, network_universes, parse_target
from lightpaint.dmx.levels import DriveFade, check_drives, decode_levels, encode_levels
from lightpaint.errors import ConsoleError, RigError

RIG = two_lamps()
LOOK = {"left": {"red": 1.0, "blue": 0.25}, "right": {"white": 0.3}}

#: Half a step of a channel of 8 bits.
ROUNDING = 0.5 / 255

#: Packets of two universes before they fall silent: three each.
BEFORE_SILENCE = 6


def received(
    scheme: str, read: Callable[[bytes], Any], use: Callable[[ConsoleLink], None], **options: Any
) -> list[Any]:
    """Packets that leave while a link is used, and at its end."""
    with open_port() as port:
        number = port.getsockname()[1]
        with ConsoleLink.open(f"{scheme}://127.0.0.1:{number}", RIG, **options) as link:
            use(link)
        port.settimeout(0)
        packets = []
        # On loopback a packet has arrived once it was sent.
        while True:
            try:
                packets.append(read(port.recv(2048)))
            except BlockingIOError:
                return packets


def settle(link: ConsoleLink) -> None:
    """Wait until all that was shown has left."""
    end_s = time.monotonic() + PATIENCE_S
    while not link.is_settled:
        assert time.monotonic() < end_s
        time.sleep(0.002)


def show(link: ConsoleLink) -> None:
    link.show(LOOK)
    settle(link)


def test_sacn_leaves_as_its_standard_says() -> None:
    packets = received("sacn", sacn_fields, show, priority=90)
    sent, farewell = packets[:BEFORE_SILENCE], packets[BEFORE_SILENCE:]
    expected = encode_levels(RIG, LOOK)
    assert [x.universe for x in sent] == [1, 2] * 3
    assert all(x.slots == expected[x.universe] for x in packets)
    assert all((x.source, x.priority, x.start_code) == ("lightpaint", 90, 0) for x in packets)
    assert all(x.synchronization == 0 for x in packets)
    assert len({x.cid for x in packets}) == 1
    assert all(x.options == 0 for x in sent)
    assert [(x.universe, x.options) for x in farewell] == [(1, 0x40)] * 3 + [(2, 0x40)] * 3
    for universe in (1, 2):
        counts = [x.sequence for x in packets if x.universe == universe]
        assert counts == list(range(counts[0], counts[0] + 6))


def test_artnet_leaves_as_its_standard_says() -> None:
    packets = received("artnet", artnet_fields, show)
    expected = encode_levels(RIG, LOOK)
    assert [x.universe for x in packets] == [0, 1] * 3  # counted from 0, and without an end
    assert all(x.slots == expected[x.universe + 1] for x in packets)
    assert [x.sequence for x in packets] == list(range(1, 7))


@pytest.mark.parametrize("scheme", ["sacn", "artnet"])
def test_nothing_leaves_before_something_is_shown(scheme: str) -> None:
    assert received(scheme, bytes, lambda _: time.sleep(0.05)) == []


def test_universes_get_other_numbers() -> None:
    packets = received("sacn", sacn_fields, show, universes={1: 5, 2: 63999})
    assert {x.universe for x in packets} == {5, 63999}
    packets = received("artnet", artnet_fields, show, universes={1: 32767})
    assert {x.universe for x in packets} == {32767, 1}


def test_only_fixtures_of_the_rig_have_levels() -> None:
    [first, second] = received("sacn", sacn_fields, show)[:2]
    of_left = {0: 255, 1: 32, 2: 128, 4: 255, 6: 64}
    assert {k: x for k, x in enumerate(first.slots) if x} == of_left
    # The second stands at 501: its shutter and the middle of its pan, its dimmer and white.
    assert not any(second.slots[:500])
    assert second.slots[500:504] == bytes([math.ceil(0.3 * 255), 32, 128, 0])


@pytest.mark.parametrize("scheme", ["sacn", "artnet"])
def test_at_the_end_nothing_goes_dark_unless_asked(scheme: str) -> None:
    read = sacn_fields if scheme == "sacn" else artnet_fields
    lit = received(scheme, read, show)

    def black_out(link: ConsoleLink) -> None:
        show(link)
        link.close(blackout=True)

    dark = received(scheme, read, black_out)
    expected, rest = encode_levels(RIG, LOOK), encode_levels(RIG, {})
    offset = 0 if scheme == "sacn" else 1
    assert all(x.slots == expected[x.universe + offset] for x in lit)
    assert all(x.slots == rest[x.universe + offset] for x in dark[BEFORE_SILENCE:])
    # What gives no light stays where it was: the shutter and the pan.
    assert [*rest[1][:4]] == [0, 32, 128, 0]


def test_blackout_is_shown_like_any_look() -> None:
    def use(link: ConsoleLink) -> None:
        show(link)
        link.blackout()
        settle(link)

    last = received("sacn", sacn_fields, use)[-1]
    assert last.slots == encode_levels(RIG, {})[2]


def test_the_receiver_of_the_library_reads_it() -> None:
    """The foreign decoder: sacn's own receiver."""
    with open_port("") as port:
        number = port.getsockname()[1]
    arrived: dict[int, Any] = {}
    complete = Event()
    receiver = sacn.sACNreceiver(bind_address="127.0.0.1", bind_port=number)

    def take(packet: Any) -> None:
        arrived[packet.universe] = packet
        if len(arrived) == 2:
            complete.set()

    for universe in (1, 2):
        receiver.register_listener("universe", take, universe=universe)
    receiver.start()
    try:
        with ConsoleLink.open(f"sacn://127.0.0.1:{number}", RIG, priority=90) as link:
            link.show(LOOK)
            assert complete.wait(PATIENCE_S)
    finally:
        receiver.stop()
    levels = {universe: bytes(packet.dmxData) for universe, packet in arrived.items()}
    assert levels == encode_levels(RIG, LOOK)
    drives = decode_levels(RIG, levels)
    assert drives["left"]["blue"] == pytest.approx(0.25, abs=ROUNDING)
    assert drives["right"]["white"] == pytest.approx(0.3, abs=ROUNDING)
    assert {(x.priority, x.sourceName) for x in arrived.values()} == {(90, "lightpaint")}


def test_another_library_decodes_what_leaves_as_artnet() -> None:
    """That of `stupidArtnet`, which shares nothing with the `pyartnet` that sends."""
    receivers = pytest.importorskip("stupidArtnet")
    with open_port() as port:
        number = port.getsockname()[1]
    receiver = receivers.StupidArtnetServer(port=number)
    arrived: dict[int, bytes] = {}

    def take(levels: list[int], universe: int) -> None:
        arrived[universe] = bytes(levels)

    for universe in (0, 1):
        receiver.register_listener(universe, callback_function=take)
    try:
        with ConsoleLink.open(f"artnet://127.0.0.1:{number}", RIG) as link:
            link.show(LOOK)  # again and again, also once its thread has opened the port
            end_s = time.monotonic() + PATIENCE_S
            while len(arrived) < 2:
                assert time.monotonic() < end_s, "nothing was decoded"
                time.sleep(0.01)
            levels = {universe + 1: x for universe, x in arrived.items()}
            receiver.close()  # at the next packet
            link.show({})
            settle(link)
    finally:
        receiver.listen = False
        receiver.socket_server.close()
    assert levels == encode_levels(RIG, LOOK)
    drives = decode_levels(RIG, levels)
    assert drives["left"]["blue"] == pytest.approx(0.25, abs=ROUNDING)
    assert drives["right"]["white"] == pytest.approx(0.3, abs=ROUNDING)


@pytest.mark.parametrize("protocol", [SACN, ARTNET])
def test_groups_of_receivers_stay_on_the_interface(protocol: Any) -> None:
    """Multicast and broadcast reach a socket that is not the host of any target; on loopback."""
    target = f"{protocol.scheme}://{protocol.group_word}"
    with open_port("") as port:
        number = port.getsockname()[1]
        for group in ("239.255.0.1", "239.255.0.2"):
            member = socket.inet_aton(group) + socket.inet_aton("127.0.0.1")
            port.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
        with ConsoleLink.open(f"{target}:{number}", RIG, interface="127.0.0.1") as link:
            link.show(LOOK)
            data, (sender, _) = port.recvfrom(2048)
    assert sender == "127.0.0.1"
    read = sacn_fields if protocol is SACN else artnet_fields
    assert read(data).slots == encode_levels(RIG, LOOK)[1]


class RecordingOutput:
    """An output that keeps what it gets, and may refuse it."""

    def __init__(self) -> None:
        self.frames: list[dict[int, bytes]] = []
        self.refusal: OSError | None = None
        self.is_closed = False

    def send(self, levels: Any) -> None:
        if self.refusal is not None:
            raise self.refusal
        self.frames.append(dict(levels))

    def close(self) -> None:
        self.is_closed = True


@pytest.fixture
def output(monkeypatch: pytest.MonkeyPatch) -> RecordingOutput:
    recording = RecordingOutput()
    monkeypatch.setattr(console_link, "_open_output", lambda *_, **__: recording)
    return recording


def test_a_fade_is_straight_in_light(output: RecordingOutput) -> None:
    with ConsoleLink.open("sacn://127.0.0.1", RIG, fps=60) as link:
        link.show({"right": {"red": 1.0}})
        settle(link)
        link.show({"right": {"blue": 1.0}}, fade_s=0.3)
        settle(link)
    drives = [decode_levels(RIG, frame)["right"] for frame in output.frames if 2 in frame]
    sums = [x["red"] + x["blue"] for x in drives]
    np.testing.assert_allclose(sums, 1, atol=2 * ROUNDING)
    blues = [x["blue"] for x in drives]
    assert blues == sorted(blues)
    assert len({round(x, 3) for x in blues}) > 5
    assert blues[-1] == 1


def test_the_last_value_wins_and_frames_keep_their_distance(output: RecordingOutput) -> None:
    began_s = time.monotonic()
    with ConsoleLink.open("sacn://127.0.0.1", RIG, fps=20) as link:
        for k in range(300):
            link.show({"left": {"red": k / 299}})
        settle(link)
        frames = len(output.frames)
    lasted_s = time.monotonic() - began_s
    assert frames <= lasted_s * 20 + 1
    assert decode_levels(RIG, output.frames[-1])["left"]["red"] == 1
    assert output.is_closed


def test_a_refusal_of_the_network_is_kept_until_it_is_over(output: RecordingOutput) -> None:
    output.refusal = OSError(101, "Network is unreachable")
    with ConsoleLink.open("sacn://10.0.0.9", RIG) as link:
        link.show(LOOK)
        settle(link)
        assert link.trouble == "cannot send to sacn://10.0.0.9: Network is unreachable"
        output.refusal = None
        link.blackout()
        settle(link)
        assert link.trouble is None


def test_a_closed_link_refuses(output: RecordingOutput) -> None:
    link = ConsoleLink.open("sacn://127.0.0.1", RIG)
    link.close()
    link.close()
    with pytest.raises(ConsoleError, match="is closed"):
        link.show(LOOK)
    assert output.frames == []


def test_what_a_rig_lacks_is_refused_before_it_is_shown(output: RecordingOutput) -> None:
    with ConsoleLink.open("sacn://127.0.0.1", RIG) as link:
        with pytest.raises(RigError, match="has no light sun: it has left, right"):
            link.show({"sun": {"red": 1}})
        with pytest.raises(RigError, match="has no emitter lime: it has blue, green, red, white"):
            link.show({"left": {"lime": 1}})
        for drive in (1.5, -0.1, float("nan")):
            with pytest.raises(RigError, match="expected 0 to 1"):
                link.show({"left": {"red": drive}})
    assert output.frames == []


def test_the_address_is_said_in_words(output: RecordingOutput) -> None:
    with ConsoleLink.open("sacn://127.0.0.1", RIG, universes={1: 5}) as link:
        expected = "sacn://127.0.0.1, universes 5, 2, source 'lightpaint', priority 90"
        assert link.address == expected
    with ConsoleLink.open("artnet://10.0.0.9", RIG) as link:
        assert link.address == "artnet://10.0.0.9, universes 0, 1"


def test_unchanged_levels_leave_three_times_and_then_stay_alive() -> None:
    schedule, levels = SendSchedule(), {1: b"a", 2: b"b"}
    assert schedule.next_s == -np.inf or schedule.is_settled
    sent = [schedule.take_due(levels, 0.02 * k) for k in range(5)]
    assert sent == [levels, levels, levels, {}, {}]
    assert schedule.is_settled
    assert schedule.next_s == pytest.approx(0.04 + KEEP_ALIVE_S)
    assert 0.8 <= KEEP_ALIVE_S <= 1.0  # both standards
    assert schedule.take_due(levels, schedule.next_s) == levels
    assert schedule.take_due({1: b"c", 2: b"b"}, 0.9) == {1: b"c"}


def test_a_fade_begins_where_the_last_one_is() -> None:
    first = DriveFade({}, {"a": {"red": 1.0}}, 10.0, 2.0)
    middle = first.at(11.0)
    assert middle == {"a": {"red": 0.5}}
    second = DriveFade(middle, {"b": {"red": 1.0}}, 11.0, 1.0)
    assert second.at(10.0) == {"a": {"red": 0.5}, "b": {"red": 0.0}}
    assert second.at(11.5) == {"a": {"red": 0.25}, "b": {"red": 0.5}}
    assert second.at(12.0) == {"b": {"red": 1.0}}


@given(st.floats(0, 1), st.floats(0, 1), st.floats(0, 1))
def test_drives_on_their_way_are_drives(start: float, end: float, share: float) -> None:
    fade = DriveFade({"left": {"red": start}}, {"left": {"red": end}}, 0.0, 1.0)
    check_drives(RIG, fade.at(share))


@pytest.mark.parametrize(
    ("text", "spelled"),
    [
        ("sacn://127.0.0.1", "sacn://127.0.0.1"),
        ("sacn://multicast", "sacn://multicast"),
        ("ArtNet://stage-left.local/", "artnet://stage-left.local"),
        ("artnet://broadcast", "artnet://broadcast"),
        ("artnet://10.0.0.1:6454", "artnet://10.0.0.1"),
        ("sacn://10.0.0.1:9000", "sacn://10.0.0.1:9000"),
    ],
)
def test_targets(text: str, spelled: str) -> None:
    target = parse_target(text)
    assert str(target) == spelled
    assert target.is_group == text.endswith("cast")
    assert target.protocol in (SACN, ARTNET)
    assert (SACN.port, ARTNET.port) == (5568, 6454)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", "is not a target: expected sacn://127.0.0.1, sacn://multicast, artnet://HOST or"),
        ("127.0.0.1", "is not a target"),
        ("osc://127.0.0.1", "is not a target"),
        ("sacn://", "is not a target"),
        ("sacn://a b", "is not a target"),
        ("sacn://10.0.0.1:0", "has no port from 1 to 65535: leave it out for 5568"),
        ("artnet://10.0.0.1:x", "leave it out for 6454, the one of Art-Net"),
        ("artnet://multicast", "Art-Net has no multicast: write artnet://broadcast, or sacn://mul"),
        ("sacn://broadcast", "sACN has no broadcast: write sacn://multicast"),
    ],
)
def test_other_texts_are_no_targets(text: str, line: str) -> None:
    with pytest.raises(ConsoleError) as caught:
        parse_target(text)
    assert line in str(caught.value)


@pytest.mark.parametrize("address", ["239.255.0.1", "255.255.255.255", "0.0.0.0"])
def test_addresses_of_many_need_their_word(address: str) -> None:
    for scheme, word in (("sacn", "multicast"), ("artnet", "broadcast")):
        with pytest.raises(ConsoleError, match=f"write {scheme}://{word} to reach all"):
            ConsoleLink.open(f"{scheme}://{address}", RIG)


@pytest.mark.parametrize("scheme", ["sacn", "artnet"])
def test_a_broadcast_address_without_its_word_is_refused_by_the_system(scheme: str) -> None:
    """An address of many that looks like any other: the system knows it, on loopback as well."""
    with ConsoleLink.open(f"{scheme}://127.255.255.255:9", RIG) as link:
        link.show(LOOK)
        settle(link)
        assert link.trouble == f"cannot send to {scheme}://127.255.255.255:9: Permission denied"


@pytest.mark.parametrize("scheme", ["sacn", "artnet"])
def test_unknown_hosts_and_interfaces(scheme: str) -> None:
    with pytest.raises(ConsoleError, match="has no IPv4 address"):
        ConsoleLink.open(f"{scheme}://256.0.0.1.", RIG)
    with pytest.raises(ConsoleError, match="expected an IPv4 address of this machine"):
        ConsoleLink.open(f"{scheme}://127.0.0.1", RIG, interface="192.0.2.77")
    with pytest.raises(ConsoleError, match="expected an IPv4 address of this machine"):
        ConsoleLink.open(f"{scheme}://127.0.0.1", RIG, interface="eth9")


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ({3: 1}, "show.mvr has no universe 3: it has 1, 2"),
        ({1: 2}, "universes 1 and 2 of show.mvr would both be universe 2"),
        ({1: 0}, "universe 1 of show.mvr would be universe 0: sACN has 1 to 63999"),
        ({1: 64000}, "sACN has 1 to 63999"),
    ],
)
def test_universes_that_cannot_be(given: dict[int, int], line: str) -> None:
    with pytest.raises(ConsoleError, match=line):
        network_universes(RIG, SACN, given)


@pytest.mark.parametrize(
    ("options", "line"),
    [
        ({"priority": 201}, "the priority is 201: expected 0 to 200"),
        ({"fps": 0}, "fps is 0: expected more than 0, at most 60"),
    ],
)
def test_options_that_cannot_be(options: dict[str, Any], line: str) -> None:
    with pytest.raises(ConsoleError, match=line):
        ConsoleLink.open("sacn://127.0.0.1", RIG, **options)


@pytest.mark.parametrize("protocol", [SACN, ARTNET])
def test_our_receiver_reads_what_our_sender_sends(protocol: Any) -> None:
    numbers = network_universes(RIG, protocol)
    with ConsoleReceiver.open(protocol, port=0) as receiver:
        target = f"{protocol.scheme}://127.0.0.1:{receiver.port}"
        with ConsoleLink.open(target, RIG) as link:
            link.show(LOOK)
            while len(receiver.levels) < 2:
                receiver.receive(PATIENCE_S)
    levels = {universe: receiver.levels[number] for universe, number in numbers.items()}
    assert levels == encode_levels(RIG, LOOK)


def test_a_link_opens_where_a_loop_runs_as_in_a_notebook() -> None:
    async def opened() -> bool:
        with (
            open_port() as port,
            ConsoleLink.open(f"artnet://127.0.0.1:{port.getsockname()[1]}", RIG) as link,
        ):
            link.show(LOOK)
            port.settimeout(PATIENCE_S)
            return bool(port.recv(1024))

    # In a thread of its own, since a browser's tests may have left a loop in this one.
    with ThreadPoolExecutor(1) as thread:
        assert thread.submit(asyncio.run, opened()).result()
