"""The switch by which a console follows the brush."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass

from lightpaint.dmx.console_rig import ConsoleRig, address_text
from lightpaint.dmx.network.console_link import ConsoleLink
from lightpaint.dmx.rig_drives import RigDrives
from lightpaint.errors import PaintError
from lightpaint.paint.protocol import BlackOut, ConsoleInfo, ConsoleState, Message, SwitchConsole
from lightpaint.paint.session.session import Session


@dataclass(frozen=True)
class Console:
    """A console that a session may send to.

    rig: its fixtures. open_link: opens a link to it; None if there is no target. address: the
    target, and how it is sent to, in words; "" if there is none.
    """

    rig: ConsoleRig
    open_link: Callable[[], ConsoleLink] | None = None
    address: str = ""

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

    def __init__(self, console: Console | None) -> None:
        self.console = console
        self._link: ConsoleLink | None = None
        self._is_dark = False

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
                "there is no console to send to: start the painter with --rig and --to"
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
                link.show(drives_of_session(session))
            except BaseException:
                link.close()
                raise
            self._link = link
        else:
            self.follow(session)

    def follow(self, session: Session) -> None:
        """Show the session's answer, unless it is off or dark."""
        if self._link is not None and not self._is_dark:
            self._link.show(drives_of_session(session))

    def close(self) -> None:
        """End the stream; what receivers show then is theirs to decide."""
        link, self._link = self._link, None
        if link is not None:
            with suppress(OSError):
                link.close()


def drives_of_session(session: Session) -> RigDrives:
    """Return the drives of the lamps of emitters in the answer under the master dimmer."""
    names, weights = session.basis.names, session.weights * session.requests.master
    return {
        names[k]: dict(zip(lamp.names, lamp.drives_for(weights[k]).tolist(), strict=True))
        for k, lamp in session.live_answer.lamps.items()
    }
