"""The address of the painter's page: a socket to listen on, and the URL that opens it."""

import errno
import ipaddress
import os
import socket
from dataclasses import dataclass
from enum import Enum

from lightpaint.errors import PaintError
from lightpaint.sentences import Hint

#: Default port, always the same so that the browser finds the page's stored settings again.
DEFAULT_PORT = 8421

#: Names of the machine itself.
LOOPBACK = ("127.0.0.1", "localhost", "[::1]")

#: Advice in errors about an address.
ADVICE = (
    "give an address of this machine, 0.0.0.0 for all of them, or leave it out, which lets in "
    "nobody but programs of this machine"
)

#: Timeout in seconds of this machine's connection to itself.
CONNECT_S = 2.0


class Reach(Enum):
    """Machines that can connect: this one, those that reach one of its addresses, or any."""

    MACHINE = "machine"
    ADDRESS = "address"
    ALL = "all"


@dataclass(frozen=True)
class Address:
    """The address of a listening socket.

    name: how the address is written in a URL, without its port; it leads here. names: further names
    by which requests may call this server, in lower case. local_name: as `name`, for a browser of
    this machine; None for the same.
    """

    name: str
    port: int
    reach: Reach
    names: frozenset[str] = frozenset()
    local_name: str | None = None

    @property
    def url(self) -> str:
        """URL of the page, which needs a token to open."""
        return f"http://{self.name}:{self.port}/"

    @property
    def local_url(self) -> str:
        """The same for a browser of this machine, to which the machine's own name is the safest."""
        return f"http://{self.local_name or self.name}:{self.port}/"


#: A listening socket and its address.
BoundSocket = tuple[socket.socket, Address]


def listen(host: str | None = None, port: int | None = None) -> BoundSocket:
    """Return a socket that listens, and its address, which has been tried.

    host: name or number of an address of this machine, None for the loopback. port: None for the
    default, or any if that is taken.

    Raises PaintError if none is free.
    """
    family, number, is_number = _resolve("127.0.0.1" if host is None else host)
    socket_ = _bind(host or number, family, number, port)
    local_name = None
    try:
        address, *_ = socket_.getsockname()
        bound, bound_port = ipaddress.ip_address(address), int(socket_.getsockname()[1])
        mapped = getattr(bound, "ipv4_mapped", None)
        if bound.is_unspecified:
            local_name = next((x for x in LOOPBACK if _is_reachable(x, bound_port)), "localhost")
            name, reach = _outward_name(bound_port) or local_name, Reach.ALL
        else:
            is_loopback = (mapped or bound).is_loopback
            reach = Reach.MACHINE if is_loopback else Reach.ADDRESS
            name = _url_host(bound) if is_number or host is None else _to_ascii(host).lower()
        if not _is_reachable(name, bound_port):
            raise PaintError(f"nothing can connect to {name}: {ADVICE}")
    except BaseException:
        socket_.close()
        raise
    names = {name.lower()}
    if reach is not Reach.MACHINE:
        names |= {socket.gethostname().lower(), socket.getfqdn().lower()}
    return socket_, Address(name, bound_port, reach, frozenset(names), local_name)


def _resolve(host: str) -> tuple[socket.AddressFamily, str, bool]:
    """Return family and number of an address, and whether it was given as a number."""
    name = host[1:-1] if host.startswith("[") and host.endswith("]") else host
    if not name.strip():
        raise PaintError(f"an empty host is not an address: {ADVICE}")
    if "%" in name:
        raise PaintError(f"no browser opens {host}, an address of one network card: {ADVICE}")
    for flags in (socket.AI_NUMERICHOST, 0):
        try:
            candidates = socket.getaddrinfo(
                _to_ascii(name), 0, type=socket.SOCK_STREAM, flags=flags
            )
        except (OSError, ValueError):
            continue
        # IPv4 first, as tunnels and people expect of `localhost`.
        family, _, _, _, place = min(
            candidates, key=lambda candidate: candidate[0] != socket.AF_INET
        )
        return family, str(place[0]), bool(flags)
    raise PaintError(f"{host[:80]!r} is not an address of this machine: {ADVICE}")


def _bind(host: str, family: socket.AddressFamily, number: str, port: int | None) -> socket.socket:
    reason = "ports are numbers up to 65535"
    for tried in (DEFAULT_PORT, 0) if port is None else (port,):
        if not 0 <= tried < 2**16:
            break
        is_any_6 = family == socket.AF_INET6 and ipaddress.ip_address(number).is_unspecified
        try:
            return socket.create_server(
                (number, tried),
                family=family,
                dualstack_ipv6=is_any_6 and socket.has_dualstack_ipv6(),
            )
        except OSError as error:
            reason = os.strerror(error.errno) if error.errno else str(error)
            if error.errno in (errno.EADDRNOTAVAIL, errno.EAFNOSUPPORT, errno.EINVAL):
                raise PaintError(f"cannot listen at {host}: {reason}; {ADVICE}") from None
    raise PaintError(
        f"cannot listen at {host}:{tried}: {reason}; choose another with ", Hint("port")
    )


def _outward_name(port: int) -> str | None:
    """Return this machine's name on its network, if the socket listens at all addresses.

    None if it is in no network.
    """
    for family, remote in ((socket.AF_INET, "203.0.113.1"), (socket.AF_INET6, "2001:db8::1")):
        # This sends no packet; it only selects the address of a route.
        try:
            with socket.socket(family, socket.SOCK_DGRAM) as probe:
                probe.connect((remote, 9))
                own = ipaddress.ip_address(str(probe.getsockname()[0]).partition("%")[0])
        except OSError:
            continue
        if not own.is_link_local and _is_reachable(_url_host(own), port):
            return _url_host(own)
    return None


def _is_reachable(name: str, port: int) -> bool:
    place = name.removeprefix("[").removesuffix("]"), port
    try:
        socket.create_connection(place, CONNECT_S).close()
    except OSError:
        return False
    return True


def _url_host(number: ipaddress.IPv4Address | ipaddress.IPv6Address) -> str:
    return f"[{number}]" if number.version == 6 else str(number)


def _to_ascii(name: str) -> str:
    return name if name.isascii() else name.encode("idna").decode()
