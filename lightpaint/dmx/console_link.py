"""A link to a console: what is shown last leaves at a steady rate, from a thread of its own.

E1.31 (6.6.1) wants levels that no longer change sent three times, and then every 0.8 to 1 s;
Art-Net 4 wants the latter, too.
"""

import math
import socket
import time
from collections.abc import Collection, Mapping
from contextlib import suppress
from importlib.util import find_spec
from threading import Condition, Thread
from typing import Protocol, Self

from lightpaint.dmx import console_target
from lightpaint.dmx.console_rig import ConsoleRig
from lightpaint.dmx.levels import DriveFade, RigDrives, check_drives, encode_levels
from lightpaint.errors import ConsoleError

#: Packets with the same levels before a universe falls silent.
REPEATS = 3

#: Seconds between packets of a universe whose levels do not change.
KEEP_ALIVE_S = 0.8

#: The source of sACN, as consoles show it.
SOURCE_NAME = "lightpaint"

#: Below the priority of consoles, 100: what they send wins.
PRIORITY = 90

#: Highest priority of sACN.
MAX_PRIORITY = 200

#: Frames in a second; DMX itself carries up to 44.
FPS, MAX_FPS = 30, 60


class SendSchedule:
    """The universes that are due, by the levels and times of what was sent."""

    def __init__(self) -> None:
        self._levels: dict[int, bytes] = {}
        self._repeats: dict[int, int] = {}
        self._sent_s: dict[int, float] = {}

    def take_due(self, levels: Mapping[int, bytes], now_s: float) -> dict[int, bytes]:
        """Return the levels of the universes that are due, which count as sent."""
        due = {}
        for universe, values in levels.items():
            if self._levels.get(universe) != values:
                self._levels[universe], self._repeats[universe] = values, REPEATS
            is_silent = now_s - self._sent_s.get(universe, -math.inf) >= KEEP_ALIVE_S
            if self._repeats[universe] or is_silent:
                due[universe] = values
                self._repeats[universe] = max(self._repeats[universe] - 1, 0)
                self._sent_s[universe] = now_s
        return due

    @property
    def is_settled(self) -> bool:
        """True if all levels have been sent as often as they should, and only stay alive."""
        return not any(self._repeats.values())

    @property
    def next_s(self) -> float:
        """The time of the next packet: at once until it is settled; never before the first."""
        if not self.is_settled:
            return -math.inf
        return min(self._sent_s.values(), default=math.inf) + KEEP_ALIVE_S


class LevelOutput(Protocol):
    """A sender of levels by one protocol, used from one thread."""

    def send(self, levels: Mapping[int, bytes]) -> None:
        """Send the 512 bytes of each universe, as the network numbers them. Raises OSError."""

    def close(self) -> None:
        """End what was sent, as the protocol has it."""


class ConsoleLink:
    """A link that sends the drives of a rig to a console while it is open.

        with ConsoleLink.open("sacn://127.0.0.1", rig) as link:
            link.show({"par left": {"red": 0.4}}, fade_s=3)

    Nothing is sent before the first `show`. All methods may be called from any thread. What is
    shown last wins: a frame takes it whenever it is due. At the end a stream of sACN is terminated,
    and receivers do what they are set to do then; nothing goes dark unless it receives that.
    """

    def __init__(
        self,
        target: console_target.ConsoleTarget,
        rig: ConsoleRig,
        output: LevelOutput,
        universes: Mapping[int, int],
        *,
        priority: int,
        fps: float,
    ) -> None:
        """Start the thread. universes: of the network, by the universes of the rig."""
        self.target, self.universes = target, dict(universes)
        self._rig, self._output, self._priority = rig, output, priority
        self._frame_s, self._schedule = 1 / fps, SendSchedule()
        self._changed = Condition()
        self._fade: DriveFade | None = None
        self._is_new = self._is_closing = self._goes_dark = False
        self._frame_began_s = -math.inf
        self._levels: dict[int, bytes] = {}
        self._trouble: str | None = None
        self._has_sent = False
        self._thread = Thread(target=self._run, name="lightpaint-console", daemon=True)
        self._thread.start()

    @classmethod
    def open(
        cls,
        target: console_target.ConsoleTarget | str,
        rig: ConsoleRig,
        *,
        universes: Mapping[int, int] | None = None,
        priority: int = PRIORITY,
        fps: float = FPS,
        interface: str = "",
    ) -> Self:
        """Return a link to a target, like `sacn://127.0.0.1`; nothing is sent yet.

        universes: of the network by the universes of the rig, for those that differ. priority: of
        sACN, 0 to 200; Art-Net has none. fps: frames in a second. interface: IPv4 address of this
        machine to send from, "" for any. Raises ConsoleError for a host, a universe or an interface
        that does not exist, and without the library of the protocol.
        """
        target = console_target.parse_target(target) if isinstance(target, str) else target
        numbers = console_target.network_universes(rig, target.protocol, universes)
        if not numbers:
            raise ConsoleError(f"{rig.name} has no channel: there is nothing to send")
        if not 0 <= priority <= MAX_PRIORITY:
            raise ConsoleError(f"the priority is {priority}: expected 0 to {MAX_PRIORITY}")
        if not 0 < fps <= MAX_FPS:
            raise ConsoleError(f"fps is {fps:g}: expected more than 0, at most {MAX_FPS}")
        check_library(target.protocol)
        output = _open_output(target, numbers.values(), priority=priority, interface=interface)
        return cls(target, rig, output, numbers, priority=priority, fps=fps)

    @property
    def address(self) -> str:
        """The target, universes, source and priority in words."""
        return _address_of(self.target, self.universes.values(), self._priority)

    @property
    def trouble(self) -> str | None:
        """The network's last refusal, in a sentence; None while packets leave."""
        return self._trouble

    @property
    def has_sent(self) -> bool:
        """True once a packet has left."""
        return self._has_sent

    @property
    def is_settled(self) -> bool:
        """True once fades are over and their last levels have been sent as often as they should."""
        with self._changed:
            return not self._is_moving() and self._schedule.is_settled

    def show(
        self, drives: RigDrives, *, fade_s: float = 0.0, rig: ConsoleRig | None = None
    ) -> None:
        """Show drives instead of what is shown now, at once or in a fade from there.

        drives: by light and emitter, 0 to 1; all others go to 0. Before the first time all are at
        0. rig: the same rig whose channels rest at other levels from now on, without a fade. Raises
        RigError for drives that do not fit the rig, ConsoleError once it is closed.
        """
        check_drives(self._rig, drives)
        kept = {light: dict(values) for light, values in drives.items()}
        with self._changed:
            if self._is_closing:
                raise ConsoleError(f"the link to {self.target} is closed: open it again")
            now_s = time.monotonic()
            self._rig = rig or self._rig
            start: RigDrives = {} if self._fade is None else self._fade.at(now_s)
            self._fade, self._is_new = DriveFade(start, kept, now_s, fade_s), True
            self._changed.notify()

    def blackout(self) -> None:
        """Take all drives to 0 at once. Channels that give no light stay at rest."""
        self.show({})

    def close(self, *, blackout: bool = False) -> None:
        """End the link, and wait until its last packet has left.

        blackout: whether to go dark before; else the last levels stay where receivers keep them.
        """
        with self._changed:
            self._is_closing, self._goes_dark = True, blackout
            self._changed.notify()
        self._thread.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _run(self) -> None:
        """Send frames until the link is closed, then its end."""
        try:
            while self._wait():
                self._send_frame()
            if self._goes_dark and self._fade is not None:
                dark = self._encoded({})
                for _ in range(REPEATS):
                    self._send(dark)
        finally:
            self._is_closing = True
            # Receivers notice the end of packets by themselves.
            with suppress(OSError):
                self._output.close()

    def _wait(self) -> bool:
        """Wait for the next frame; return False once the link is closed."""
        with self._changed:
            while not self._is_closing:
                left_s = self._due_s() - time.monotonic()
                if left_s <= 0:
                    return True
                self._changed.wait(None if left_s == math.inf else left_s)
            return False

    def _due_s(self) -> float:
        """Return the time of the next frame."""
        if self._fade is None:
            return math.inf
        next_s = -math.inf if self._is_moving() else self._schedule.next_s
        return max(self._frame_began_s + self._frame_s, next_s)

    def _is_moving(self) -> bool:
        """Return True if the next frame has other drives than the last one, or is the first."""
        return self._is_new or self._fade is None or not self._fade.is_over(self._frame_began_s)

    def _send_frame(self) -> None:
        with self._changed:
            fade, is_moving = self._fade, self._is_moving()
            assert fade is not None
            self._frame_began_s = now_s = time.monotonic()
        if is_moving:
            self._levels = self._encoded(fade.at(now_s))
        with self._changed:
            due = self._schedule.take_due(self._levels, now_s)
            # A value that came meanwhile is for the next frame.
            self._is_new = self._fade is not fade
        self._send(due)

    def _encoded(self, drives: RigDrives) -> dict[int, bytes]:
        """Return the levels of drives by the universes of the network."""
        levels = encode_levels(self._rig, drives)
        return {self.universes[universe]: values for universe, values in levels.items()}

    def _send(self, levels: Mapping[int, bytes]) -> None:
        try:
            self._output.send(levels)
        except OSError as error:
            # The cable may be back before the next frame.
            self._trouble = f"cannot send to {self.target}: {error.strerror or error}"
        else:
            self._trouble, self._has_sent = None, True


def link_address(
    target: console_target.ConsoleTarget,
    rig: ConsoleRig,
    *,
    universes: Mapping[int, int] | None = None,
    priority: int = PRIORITY,
) -> str:
    """Return `ConsoleLink.address` of a link that is not open. Raises as `ConsoleLink.open`."""
    check_library(target.protocol)
    numbers = console_target.network_universes(rig, target.protocol, universes)
    return _address_of(target, numbers.values(), priority)


def _address_of(
    target: console_target.ConsoleTarget, universes: Collection[int], priority: int
) -> str:
    plural = "s" if len(universes) > 1 else ""
    text = f"{target}, universe{plural} {', '.join(map(str, universes))}"
    if target.protocol is not console_target.SACN:
        return text
    return f"{text}, source {SOURCE_NAME!r}, priority {priority}"


def check_library(protocol: console_target.DmxProtocol) -> None:
    """Raise ConsoleError, with what to do, unless the library of a protocol is here."""
    name = "sacn" if protocol is console_target.SACN else "pyartnet"
    if find_spec(name) is None:
        raise ConsoleError(f"{protocol.name} needs {name}: pip install 'lightpaint[stage]'")


def _open_output(
    target: console_target.ConsoleTarget,
    universes: Collection[int],
    *,
    priority: int,
    interface: str,
) -> LevelOutput:
    """Return the output for a target. Raises ConsoleError for an interface of another machine."""
    try:
        if interface:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as tried:
                tried.bind((interface, 0))
        # These libraries take a while to import, and only who sends needs them.
        from lightpaint.dmx.network_outputs import ArtnetOutput, SacnOutput

        if target.protocol is console_target.SACN:
            return SacnOutput(
                *(target, universes),
                source_name=SOURCE_NAME,
                priority=priority,
                interface=interface,
            )
        return ArtnetOutput(target, universes, interface=interface)
    except OSError as error:
        raise ConsoleError(
            f"cannot send from {interface or 'this machine'}: {error.strerror or error}; expected "
            "an IPv4 address of this machine"
        ) from None
