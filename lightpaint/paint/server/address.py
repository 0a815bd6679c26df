"""Where the painter's page is served: a socket to listen on, and the address that opens it."""

import errno
import ipaddress
import os
import socket
from dataclasses import dataclass
from enum import Enum

from lightpaint.errors import PaintError

#: Where it listens unless somebody says otherwise or another does already: at one place, so that
#: the browser finds again what the page has put down for itself.
PORT = 8421

#: Names of the machine itself.
LOOPBACK = ("127.0.0.1", "localhost", "[::1]")

#: What to do about an address that cannot be had.
ADVICE = (
    "give an address of this machine, 0.0.0.0 for all of them, or leave it out, which lets in "
    "nobody but programs of this machine"
)

#: Seconds in which this machine connects to itself.
CONNECT_S = 2.0


class Reach(Enum):
    """Who can connect: programs of this machine, whoever reaches one address of it, or any."""

    MACHINE = "machine"
    ADDRESS = "address"
    ALL = "all"


@dataclass(frozen=True)
class Address:
    """Where a socket listens.

    name: how the address is written in a URL, without its port; it leads here. names: further names
    by which requests may call this server, in lower case. here: as `name`, for a browser of this
    machine; None for the same.
    """

    name: str
    port: int
    reach: Reach
    names: frozenset[str] = frozenset()
    here: str | None = None

    @property
    def url(self) -> str:
        """The page, which a token has still to open."""
        return f"http://{self.name}:{self.port}/"

    @property
    def url_here(self) -> str:
        """The same for a browser of this machine, to which its own name is the safest."""
        return f"http://{self.here or self.name}:{self.port}/"


#: A socket that listens, and where.
Listening = tuple[socket.socket, Address]


def listen(host: str | None = None, port: int | None = None) -> Listening:
    """Return a socket that listens, and its address, which has been tried.

    host: name or number of an address of this machine, None for the loopback. port: None for the
    usual one, or any if that is taken.

    Raises PaintError where there is none.
    """
    family, number, is_number = _resolved("127.0.0.1" if host is None else host)
    made = _bound(host or number, family, number, port)
    here = None
    try:
        at, *_ = made.getsockname()
        bound, its_port = ipaddress.ip_address(at), int(made.getsockname()[1])
        mapped = getattr(bound, "ipv4_mapped", None)
        if bound.is_unspecified:
            here = next((x for x in LOOPBACK if _leads_here(x, its_port)), "localhost")
            name, reach = _outward_name(its_port) or here, Reach.ALL
        else:
            is_loopback = (mapped or bound).is_loopback
            reach = Reach.MACHINE if is_loopback else Reach.ADDRESS
            name = _written(bound) if is_number or host is None else _ascii(host).lower()
        if not _leads_here(name, its_port):
            raise PaintError(f"nothing can connect to {name}: {ADVICE}")
    except BaseException:
        made.close()
        raise
    names = {name.lower()}
    if reach is not Reach.MACHINE:
        names |= {socket.gethostname().lower(), socket.getfqdn().lower()}
    return made, Address(name, its_port, reach, frozenset(names), here)


def _resolved(host: str) -> tuple[socket.AddressFamily, str, bool]:
    """Family and number of an address, and whether it was given as a number."""
    name = host[1:-1] if host.startswith("[") and host.endswith("]") else host
    if not name.strip():
        raise PaintError(f"an empty host is no address: {ADVICE}")
    if "%" in name:
        raise PaintError(f"no browser opens {host}, an address of one network card: {ADVICE}")
    for flags in (socket.AI_NUMERICHOST, 0):
        try:
            found = socket.getaddrinfo(_ascii(name), 0, type=socket.SOCK_STREAM, flags=flags)
        except (OSError, ValueError):
            continue
        # IPv4 first: that is what tunnels and people expect of `localhost`.
        family, _, _, _, place = min(found, key=lambda one: one[0] != socket.AF_INET)
        return family, str(place[0]), bool(flags)
    raise PaintError(f"{host[:80]!r} is no address of this machine: {ADVICE}")


def _bound(host: str, family: socket.AddressFamily, number: str, port: int | None) -> socket.socket:
    reason = "ports are numbers up to 65535"
    for tried in (PORT, 0) if port is None else (port,):
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
    raise PaintError(f"cannot listen at {host}:{tried}: {reason}; choose another with port=...")


def _outward_name(port: int) -> str | None:
    """How others on its network call this machine, where all of its addresses are listened to;
    None where it is in no network.
    """
    for family, elsewhere in ((socket.AF_INET, "203.0.113.1"), (socket.AF_INET6, "2001:db8::1")):
        # No packet is sent: it asks by which address one would go.
        try:
            with socket.socket(family, socket.SOCK_DGRAM) as asking:
                asking.connect((elsewhere, 9))
                own = ipaddress.ip_address(str(asking.getsockname()[0]).partition("%")[0])
        except OSError:
            continue
        if not own.is_link_local and _leads_here(_written(own), port):
            return _written(own)
    return None


def _leads_here(name: str, port: int) -> bool:
    place = name.removeprefix("[").removesuffix("]"), port
    try:
        socket.create_connection(place, CONNECT_S).close()
    except OSError:
        return False
    return True


def _written(number: ipaddress.IPv4Address | ipaddress.IPv6Address) -> str:
    return f"[{number}]" if number.version == 6 else str(number)


def _ascii(name: str) -> str:
    return name if name.isascii() else name.encode("idna").decode()
