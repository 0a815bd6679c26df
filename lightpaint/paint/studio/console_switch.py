"""The switch by which a console follows the brush."""

from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from dataclasses import dataclass

from lightpaint.arrays import Position
from lightpaint.dmx import ConsoleLink, ConsoleRig, RigDrives, address_text, aimed_rig
from lightpaint.errors import PaintError
from lightpaint.paint.protocol import BlackOut, ConsoleInfo, ConsoleState, Message, SwitchConsole
from lightpaint.paint.session.painting_session import Session


@dataclass(frozen=True)
class Console:
    """A console that a session may send to.

    rig: its fixtures. open_link: opens a link to it; None if there is no target. address: the
    target, and how it is sent to, in words; "" if there is none. has_positions: whether pan and
    tilt follow lights that move.
    """

    rig: ConsoleRig
    open_link: Callable[[], ConsoleLink] | None = None
    address: str = ""
    has_positions: bool = False

    @property
    def addresses(self) -> Mapping[str, str]:
        """The fixture and the first channel of each light, by its name."""
        return {
            light: f"{fixture.kind} {address_text(min(fixture.addresses.values()))}"
            for light, fixture in self.rig.owners.items()
            if fixture.addresses
        }


class ConsoleSwitch:
    """The state of a session's link to a console: off at first, and nothing is sent.

    console: None if the session has none. While it is on, `follow` shows each answer; the link
    sends the last one at its own rate.
    """

    def __init__(
        self,
        console: Console | None,
        *,
        find_directions: Callable[[Session], Mapping[str, Position]] | None = None,
        warn: Callable[[str], None] = lambda _: None,
    ) -> None:
        """Start switched off.

        find_directions: returns where the lights of a session point, by name; None if none can
        move. warn: receives what a fixture cannot do.
        """
        self.console = console
        self._find_directions, self._warn = find_directions, warn
        self._link: ConsoleLink | None = None
        self._is_dark = False
        self._directions: Mapping[str, Position] | None = None
        self._aimed: ConsoleRig | None = None
        self._remarks: Collection[str] = ()

    @property
    def addresses(self) -> Mapping[str, str]:
        """The fixture and the first channel of each light, by its name; none without a rig."""
        return {} if self.console is None else self.console.addresses

    @property
    def info(self) -> ConsoleInfo | None:
        """Its state for pages; None without a target."""
        if self.console is None or self.console.open_link is None:
            return None
        return ConsoleInfo(
            address=self.console.address,
            is_on=self._link is not None,
            is_dark=self._is_dark,
            trouble=None if self._link is None else self._link.trouble,
        )

    def handle(self, message: SwitchConsole | BlackOut, session: Session) -> list[Message]:
        """Switch it, or go dark until it is switched on again.

        Raises PaintError without a console, RigError if its rig lacks a light of the session.
        """
        if self.console is None or self.console.open_link is None:
            raise PaintError(
                "there is no console to send to: start the painter with a rig and an address"
            )
        match message:
            case SwitchConsole(is_on):
                self._switch(session, self.console.open_link, is_on=is_on)
            case BlackOut():
                if self._link is None:
                    raise PaintError("the console is off: nothing is sent that could go dark")
                self._link.blackout()
                self._is_dark = True
        return [ConsoleState(console=self.info)]

    def _switch(
        self, session: Session, open_link: Callable[[], ConsoleLink], *, is_on: bool
    ) -> None:
        self._is_dark = False
        if not is_on:
            self.close()
            return
        if self._link is None:
            link = open_link()
            try:
                self._show(link, session)
            except BaseException:
                link.close()
                raise
            self._link = link
        else:
            self.follow(session)

    def follow(self, session: Session) -> None:
        """Show the session's answer, unless it is off or dark."""
        if self._link is not None and not self._is_dark:
            self._show(self._link, session)

    def _show(self, link: ConsoleLink, session: Session) -> None:
        drives = drives_of_session(session)
        if self.console is None or not self.console.has_positions or self._find_directions is None:
            link.show(drives)
            return
        directions = self._find_directions(session)
        if self._aimed is None or directions != self._directions:
            # From where the heads are, so that they go the shortest way.
            self._aimed, remarks = aimed_rig(self._aimed or self.console.rig, directions)
            for remark in remarks:
                if remark not in self._remarks:
                    self._warn(remark)
            self._directions, self._remarks = directions, remarks
        link.show(drives, rig=self._aimed)

    def close(self) -> None:
        """End the stream; what receivers show then is theirs to decide."""
        link, self._link = self._link, None
        if link is not None:
            with suppress(OSError):
                link.close()


def drives_of_session(session: Session) -> RigDrives:
    """Return the drives of the lamps of emitters in the answer under the master dimmer."""
    return session.live_answer.named_drives(session.weights * session.requests.master)
