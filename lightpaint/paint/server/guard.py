"""Who may speak to the painter's server: a page that came from this launch, and nobody else.

Any page that is open in a browser can send requests to servers of the same machine, by whatever
name it likes. So the guard looks at the name that a request calls this server by (a foreign name
that leads here is an attack), and at what page the request comes from. And it wants a key.

A browser attaches nothing by itself that opens anything: it sends a cookie to every port of a name,
and so to every other server of the machine. The page has the launch token in the fragment of its
address, which browsers send to nobody; it exchanges the token for the key, keeps that for its tab,
and shows it in a header of what it fetches and in a subprotocol of its socket. What is loaded
without a header is the page itself, which is the same for everybody.
"""

import ipaddress
import secrets
import time
from collections.abc import Callable, Container
from typing import Any

from lightpaint.paint.server.address import LOOPBACK, Address, Reach

#: What a browser is told of all that comes from here.
POLICY = {
    "default-src": "'none'",
    "script-src": "'self' 'wasm-unsafe-eval'",
    "style-src": "'self'",
    "img-src": "'self' blob: data:",
    "connect-src": "'self'",
    "base-uri": "'none'",
    "form-action": "'none'",
    "frame-ancestors": "'none'",
}

#: Seconds in which a browser has to use the token that it was started with. Others who work on the
#: machine can read that, as they can all command lines; it is good once.
SOON_S = 120.0

#: Where a page exchanges its token for the key, and asks whether its key is known.
KEY_PATH = "/key"

#: The protocol of a page's socket, and what its key stands behind in another one.
PROTOCOL, KEY_PROTOCOL = "lightpaint", "lightpaint-key."

#: Said to who shows no key, and to who shows that of an earlier server.
UNKNOWN = "open the painter by the address that its terminal shows, which has a token"
EARLIER = f"this page is of an earlier start of the painter: {UNKNOWN}"

Scope = dict[str, Any]
Receive = Callable[[], Any]
Send = Callable[[Any], Any]
App = Callable[[Scope, Receive, Send], Any]


class Guard:
    """Lets through to `app` what comes from a page of this launch, and answers all else itself.

    public: paths of the page's own files, which are for everybody who calls the server by its name.
    address: where it listens. Where others are let in, the machine's own names and all addresses
    are right names, too.

    Attributes:
        token: Opens pages for as long as the server runs, as often as somebody likes.
        program_token: Lets programs in that are no browser, in a header; it opens no page.
    """

    def __init__(self, app: App, *, address: Address, public: Container[str] = ()) -> None:
        self.app, self.public, self._address = app, public, address
        self.token, self._key = secrets.token_urlsafe(24), secrets.token_urlsafe(24)
        self.program_token = secrets.token_urlsafe(24)
        self._once: dict[str, float] = {}

    def once(self) -> str:
        """Return a token that is good once, and soon."""
        token = secrets.token_urlsafe(24)
        self._once[token] = time.monotonic() + SOON_S
        return token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
        elif scope["type"] == "websocket":
            if self.knows(scope):
                await self.app(scope, receive, send)
            else:  # which a browser gets as 403
                await send({"type": "websocket.close", "code": 1008})
        elif (reason := self._refusal(scope)) is not None:
            await _answer(_headed(send, scope), 403, reason)
        elif scope["method"] not in ("GET", "HEAD"):
            await _answer(_headed(send, scope), 405, "only GET is answered here")
        elif scope["path"] == KEY_PATH and self._is_opened(scope):
            await _answer(_headed(send, scope), 200, self._key)
        elif scope["path"] in self.public or self.knows(scope):
            await self.app(scope, receive, _headed(send, scope))
        else:
            # Who has a key has that of an earlier start.
            status, reason = (403, UNKNOWN) if _bearer(scope) is None else (410, EARLIER)
            await _answer(_headed(send, scope), status, reason)

    def knows(self, scope: Scope) -> bool:
        """Return whether a request shows the key, and comes from a page of this server; or the
        programs' token, and comes from no page.
        """
        if self.is_program(scope):
            return True
        is_socket = scope["type"] == "websocket"
        given = _offered(scope) if is_socket else _bearer(scope)
        is_right = given is not None and _same(given, self._key)
        return is_right and self._refusal(scope, is_socket=is_socket) is None

    def is_program(self, scope: Scope) -> bool:
        """Return whether a request comes from a program that is no browser, and may.

        Browsers name the origin of every socket, and give none a header of a script's; a page of
        another origin is refused the header of what it fetches, since nothing here allows it. So a
        request that names an origin is a page's, whatever else it shows.
        """
        given = _bearer(scope)
        is_right = given is not None and _same(given, self.program_token)
        return is_right and not _header(scope, b"origin") and self._refusal(scope) is None

    def _refusal(self, scope: Scope, *, is_socket: bool = False) -> str | None:
        """Why the names in a request are wrong, or None."""
        hosts, origins = _header(scope, b"host"), _header(scope, b"origin")
        if len(hosts) != 1 or not self._is_here(hosts[0]):
            return "this server is called otherwise"
        # A port may be another one, through a tunnel; that of the page has to be the same.
        if (is_socket and not origins) or any(x != f"http://{hosts[0]}" for x in origins):
            return "this comes from a page of another server"
        return None

    def _is_here(self, host: str) -> bool:
        name, _, port = host.rpartition(":") if not host.endswith("]") else (host, "", "")
        if not name:
            name = host
        elif port and not port.isdecimal():
            return False
        if name.lower() in (*LOOPBACK, *self._address.names):
            return True
        # Whoever uses an address has been told of no foreign name that leads here.
        is_open = self._address.reach is not Reach.MACHINE
        return is_open and _is_address(name.removeprefix("[").removesuffix("]"))

    def _is_opened(self, scope: Scope) -> bool:
        """Whether the token of a page is right; a token that is good once is used up by that."""
        given = _bearer(scope)
        if given is None or scope["method"] != "GET":
            return False
        if _same(given, self.token):
            return True
        return self._once.pop(given, 0.0) > time.monotonic()


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _same(one: str, other: str) -> bool:
    return secrets.compare_digest(one.encode("utf-8", "replace"), other.encode())


def _header(scope: Scope, name: bytes) -> list[str]:
    return [value.decode("latin-1") for key, value in scope["headers"] if key == name]


def _bearer(scope: Scope) -> str | None:
    """Return the key in a header, which a browser sends for nobody but the page's own script."""
    given = [value.partition(" ") for value in _header(scope, b"authorization")]
    [(scheme, _, shown)] = given if len(given) == 1 else [("", "", "")]
    return shown if scheme.lower() == "bearer" else None


def _offered(scope: Scope) -> str | None:
    """Return the key among a socket's subprotocols: a page cannot give a socket headers."""
    # From the header itself: what servers make of it differs.
    names = ",".join(_header(scope, b"sec-websocket-protocol")).split(",")
    found = [name for x in names if (name := x.strip()).startswith(KEY_PROTOCOL)]
    return found[0].removeprefix(KEY_PROTOCOL) if len(found) == 1 else None


def _headed(send: Send, scope: Scope) -> Send:
    """`send`, with what a browser is to know of everything."""
    [host, *_] = _header(scope, b"host") or [""]
    # Not all browsers take a socket of the same server for the same origin.
    live = f" ws://{host}" if host.replace(".", "").replace(":", "").isalnum() else ""
    rules = {**POLICY, "connect-src": POLICY["connect-src"] + live}
    headers = [
        (b"content-security-policy", "; ".join(f"{k} {v}" for k, v in rules.items()).encode()),
        (b"x-content-type-options", b"nosniff"),
        (b"referrer-policy", b"no-referrer"),
        (b"cross-origin-opener-policy", b"same-origin"),
        (b"cross-origin-resource-policy", b"same-origin"),
    ]

    async def head(message: Any) -> None:
        if message["type"] == "http.response.start":
            its = list(message.get("headers", ()))
            kept = [] if any(key == b"cache-control" for key, _ in its) else [_UNKEPT]
            message = {**message, "headers": [*its, *headers, *kept]}
        await send(message)

    return head


_UNKEPT = (b"cache-control", b"no-store")


async def _answer(send: Send, status: int, said: str) -> None:
    body = said.encode()
    headers = [
        (b"content-type", b"text/plain; charset=utf-8"),
        (b"content-length", str(len(body)).encode()),
    ]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
