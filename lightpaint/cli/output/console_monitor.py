"""Lines and a document on levels that arrive: sources, and drives of lights or channels."""

import time
from collections.abc import Mapping
from typing import Any

from lightpaint.cli.output import terminal
from lightpaint.display_text import some_of
from lightpaint.dmx.console_rig import ConsoleRig, RigFixture, address_text
from lightpaint.dmx.levels import decode_levels
from lightpaint.dmx.network.console_receiver import ConsoleReceiver

#: Seconds between lines on the same subject, so that a fade can be read.
LINE_S = 0.2


class ConsoleMonitor:
    """The contents of a receiver, printed as they change.

    universes: of the network, by those of the rig. Without a rig it shows channels.
    """

    def __init__(
        self, receiver: ConsoleReceiver, rig: ConsoleRig | None, universes: Mapping[int, int]
    ) -> None:
        self._receiver, self._rig, self._universes = receiver, rig, universes
        self._printed: dict[str, str] = {}
        self._printed_s = -LINE_S

    def print_changes(self, *, at_once: bool = False) -> None:
        """Print what is not as it was printed, unless the last lines are too recent."""
        now_s = time.monotonic()
        if not at_once and now_s < self._printed_s + LINE_S:
            return
        texts = self._source_texts()
        texts |= self._channel_texts() if self._rig is None else self._light_texts()
        for subject, text in texts.items():
            if self._printed.get(subject) != text:
                terminal.write(f"{subject}: {text}")
        self._printed, self._printed_s = texts, now_s

    def document(self) -> dict[str, Any]:
        """Return what has arrived, for programs."""
        sources, levels = self._receiver.sources, self._receiver.levels
        universes = {
            str(universe): {
                "source": sources[universe].name if universe in sources else None,
                "priority": sources[universe].priority if universe in sources else None,
                "levels": {str(k): level for k, level in enumerate(values, start=1) if level},
            }
            for universe, values in sorted(levels.items())
        }
        document = {"protocol": self._receiver.protocol.scheme, "universes": universes}
        return document if self._rig is None else {**document, "lights": self._drives()}

    def _source_texts(self) -> dict[str, str]:
        sources = self._receiver.sources
        return {
            f"universe {universe}": f"from {sources[universe].name!r}, priority "
            f"{sources[universe].priority}"
            if universe in sources
            else "no source any more; its levels stay"
            for universe in sorted(self._receiver.levels)
        }

    def _channel_texts(self) -> dict[str, str]:
        """Return the channels of each universe that are not at 0."""
        return {
            f"channels of universe {universe}": some_of(
                [f"{k}={level}" for k, level in enumerate(values, start=1) if level], " "
            )
            or "all at 0"
            for universe, values in sorted(self._receiver.levels.items())
        }

    def _light_texts(self) -> dict[str, str]:
        """Return the drives of each light, with the address of its fixture; of a colour wheel that
        of the slot which shines.
        """
        assert self._rig is not None
        owners = self._rig.owners
        wheels = {
            light.name
            for fixture in self._rig.fixtures
            for light in fixture.lights
            if light.has_slots_for_emitters
        }
        return {
            f"{light} at {_address_of(owners[light])}": " ".join(
                f"{name}={drive:.3f}"
                for name, drive in drives.items()
                if drive or light not in wheels
            )
            or "dark"
            for light, drives in self._drives().items()
        }

    def _drives(self) -> dict[str, dict[str, float]]:
        """Return the drives of lights whose universes have arrived."""
        assert self._rig is not None
        received = self._receiver.levels
        levels = {own: received[x] for own, x in self._universes.items() if x in received}
        owners = self._rig.owners
        return {
            light: drives
            for light, drives in decode_levels(self._rig, levels).items()
            if drives and _universes_of(owners[light]) <= set(levels)
        }


def _universes_of(fixture: RigFixture) -> set[int]:
    return {x for channel in fixture.channels for x, _ in fixture.places(channel)}


def _address_of(fixture: RigFixture) -> str:
    return " and ".join(map(address_text, fixture.addresses.values()))
