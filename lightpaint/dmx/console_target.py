"""Targets of levels, `sacn://127.0.0.1` or `artnet://broadcast`, and their universes."""

import socket
from collections.abc import Mapping
from dataclasses import dataclass
from ipaddress import AddressValueError, IPv4Address
from typing import TYPE_CHECKING

from lightpaint.display_text import some_names
from lightpaint.errors import ConsoleError
from lightpaint.files import one_line
from lightpaint.validation import parse_whole_number

if TYPE_CHECKING:
    from lightpaint.dmx.console_rig import ConsoleRig


@dataclass(frozen=True)
class DmxProtocol:
    """A protocol that carries universes over UDP.

    scheme: of its targets. port: the one that its standard says. first_universe, last_universe: as
    the protocol numbers them. group_word: the word for all receivers in the network.
    silence_s: seconds without a packet after which a source is gone.
    """

    scheme: str
    name: str
    port: int
    first_universe: int
    last_universe: int
    group_word: str
    silence_s: float


SACN = DmxProtocol("sacn", "sACN", 5568, 1, 63999, "multicast", 2.5)
ARTNET = DmxProtocol("artnet", "Art-Net", 6454, 0, 32767, "broadcast", 10.0)

#: Both protocols by their schemes.
PROTOCOLS = {protocol.scheme: protocol for protocol in (SACN, ARTNET)}

#: Examples of targets, for errors.
EXAMPLES = "sacn://127.0.0.1, sacn://multicast, artnet://HOST or artnet://broadcast"


@dataclass(frozen=True)
class ConsoleTarget:
    """A receiver of levels, or all of them in the network.

    host: its name or IPv4 address; "" for all.
    """

    protocol: DmxProtocol
    host: str
    port: int

    @property
    def is_group(self) -> bool:
        """True for all receivers in the network."""
        return not self.host

    def __str__(self) -> str:
        port = "" if self.port == self.protocol.port else f":{self.port}"
        return f"{self.protocol.scheme}://{self.host or self.protocol.group_word}{port}"

    def address(self) -> str:
        """Return the IPv4 address of its host. Raises ConsoleError for a host that has none, and
        for an address of many, which needs its word.
        """
        try:
            found = socket.getaddrinfo(self.host, None, socket.AF_INET, socket.SOCK_DGRAM)
        except (OSError, UnicodeError) as error:
            reason = getattr(error, "strerror", None) or "not a name"
            raise ConsoleError(
                f"{self} has no IPv4 address: {reason}; give the address of the receiver"
            ) from None
        address = str(found[0][4][0])
        if _is_of_many(address):
            raise ConsoleError(
                f"{self} is the address of many receivers: write {self.protocol.scheme}://"
                f"{self.protocol.group_word} to reach all of them"
            )
        return address


def parse_target(text: str) -> ConsoleTarget:
    """Return the target that a text is, `sacn://HOST[:PORT]`. Raises ConsoleError for other text.

    A host is resolved only when something is sent.
    """
    scheme, separator, rest = text.strip().partition("://")
    protocol = PROTOCOLS.get(scheme.lower())
    host, colon, port_text = rest.rstrip("/").partition(":")
    if protocol is None or not separator or not host or any(x in host for x in "/@? "):
        raise ConsoleError(f"{one_line(repr(text))} is not a target: expected {EXAMPLES}")
    try:
        port = parse_whole_number(port_text) if colon else protocol.port
    except ValueError:
        port = 0
    if not 0 < port < 2**16:
        raise ConsoleError(
            f"{one_line(repr(text))} has no port from 1 to 65535: leave it out for "
            f"{protocol.port}, the one of {protocol.name}"
        )
    other_words = {x.group_word: x for x in PROTOCOLS.values() if x is not protocol}
    if host in other_words:
        raise ConsoleError(
            f"{protocol.name} has no {host}: write {protocol.scheme}://{protocol.group_word}, or "
            f"{other_words[host].scheme}://{host}"
        )
    return ConsoleTarget(protocol, "" if host == protocol.group_word else host, port)


def network_universes(
    rig: "ConsoleRig", protocol: DmxProtocol, given: Mapping[int, int] | None = None
) -> dict[int, int]:
    """Return the universe of the network for each one of a rig.

    The first one of a rig is the first one of the protocol, which is 0 for Art-Net.

    given: universes of the network by the universes of the rig, for some. Raises ConsoleError for a
    universe that the rig or the protocol does not have, and for two that would become one.
    """
    given = given or {}
    if unknown := sorted(set(given) - set(rig.universes)):
        known = some_names(map(str, rig.universes)) or "none"
        raise ConsoleError(f"{rig.name} has no universe {unknown[0]}: it has {known}")
    numbers = {x: given.get(x, x - 1 + protocol.first_universe) for x in rig.universes}
    for number, network in numbers.items():
        if not protocol.first_universe <= network <= protocol.last_universe:
            raise ConsoleError(
                f"universe {number} of {rig.name} would be universe {network}: {protocol.name} has "
                f"{protocol.first_universe} to {protocol.last_universe}"
            )
        if shared := [x for x, other in numbers.items() if other == network and x != number]:
            raise ConsoleError(
                f"universes {number} and {shared[0]} of {rig.name} would both be universe "
                f"{network}: give one of them another number"
            )
    return numbers


def _is_of_many(address: str) -> bool:
    try:
        known = IPv4Address(address)
    except AddressValueError:
        return False
    return known.is_multicast or known.is_unspecified or known == IPv4Address("255.255.255.255")
