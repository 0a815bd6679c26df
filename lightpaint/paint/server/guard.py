"""Access to the painter's server, only for a page that came from this launch.

Any page that is open in a browser can send requests to servers of the same machine, by whatever
name it likes. So the guard checks the host name of a request (a foreign name that leads here is an
attack) and its origin, the page that it comes from. And it requires a key.

The key is not a cookie, since a browser sends a cookie to every port of a host, and so to every
other server of the machine. The page has the launch token in the fragment of its address, which
browsers send to nobody; it exchanges the token for the key, keeps the key for its tab, and sends it
in a header of its requests and in a subprotocol of its socket. Only the page itself is loaded
without a header; it is the same for everybody.
"""

import ipaddress
import secrets
import time
from collections.abc import Callable, Container
from typing import Any

from lightpaint.paint.server.address import LOOPBACK, Address, Reach

#: Content security policy of every response.
CONTENT_POLICY = {
    "default-src": "'none'",
    "script-src": "'self' 'wasm-unsafe-eval'",
    "style-src": "'self'",
    "img-src": "'self' blob: data:",
    "connect-src": "'self'",
    "base-uri": "'none'",
    "form-action": "'none'",
    "frame-ancestors": "'none'",
}

#: Seconds in which a browser has to use the token that it was started with. Other users of the
#: machine can read it, like all command lines; it works once.
ONE_TIME_TOKEN_S = 120.0

#: Path at which a page exchanges its token for the key, or checks its key.
KEY_PATH = "/key"

#: Subprotocol of a page's socket, and prefix of the one that carries the key.
PROTOCOL, KEY_PROTOCOL = "lightpaint", "lightpaint-key."

#: Answers to a request without a key, and to one with the key of an earlier server.
NO_KEY_TEXT = "open the painter by the address that its terminal shows, which has a token"
OLD_KEY_TEXT = f"this page is of an earlier start of the painter: {NO_KEY_TEXT}"

Scope = dict[str, Any]
Receive = Callable[[], Any]
Send = Callable[[Any], Any]
App = Callable[[Scope, Receive, Send], Any]


class Guard:
    """Passes requests of this launch's pages on to `app`, and answers all others itself.

    public: paths of the page's own files, open to every request with a valid host name. address:
    where it listens. If other machines are let in, the machine's own names and all its addresses
    are valid names, too.

    Attributes:
        token: Opens pages while the server runs, any number of times.
        program_token: Admits programs other than browsers, in a header; it opens no page.
    """

    def __init__(self, app: App, *, address: Address, public: Container[str] = ()) -> None:
        self.app, self.public, self._address = app, public, address
        self.token, self._key = secrets.token_urlsafe(24), secrets.token_urlsafe(24)
        self.program_token = secrets.token_urlsafe(24)
        self._one_time_tokens: dict[str, float] = {}

    def one_time_token(self) -> str:
        """Return a token that works once, for a short time."""
        token = secrets.token_urlsafe(24)
        self._one_time_tokens[token] = time.monotonic() + ONE_TIME_TOKEN_S
        return token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
        elif scope["type"] == "websocket":
            if self.is_allowed(scope):
                await self.app(scope, receive, send)
            else:  # which a browser gets as 403
                await send({"type": "websocket.close", "code": 1008})
        elif (reason := self._refusal(scope)) is not None:
            await _respond(_with_headers(send, scope), 403, reason)
        elif scope["method"] not in ("GET", "HEAD"):
            await _respond(_with_headers(send, scope), 405, "only GET is answered here")
        elif scope["path"] == KEY_PATH and self._has_page_token(scope):
            await _respond(_with_headers(send, scope), 200, self._key)
        elif scope["path"] in self.public or self.is_allowed(scope):
            await self.app(scope, receive, _with_headers(send, scope))
        else:
            # This is a key from an earlier start.
            status, reason = (
                (403, NO_KEY_TEXT) if _bearer_token(scope) is None else (410, OLD_KEY_TEXT)
            )
            await _respond(_with_headers(send, scope), status, reason)

    def is_allowed(self, scope: Scope) -> bool:
        """Return whether a request shows the key, and comes from a page of this server; or the
        programs' token, and comes from no page.
        """
        if self.is_program(scope):
            return True
        is_socket = scope["type"] == "websocket"
        token_ = _subprotocol_key(scope) if is_socket else _bearer_token(scope)
        is_right = token_ is not None and _is_equal(token_, self._key)
        return is_right and self._refusal(scope, is_socket=is_socket) is None

    def is_program(self, scope: Scope) -> bool:
        """Return whether a request comes from an authorized program that is not a browser.

        Browsers send the origin with every socket, and scripts cannot add headers to sockets. Nor
        can a page of another origin add a header to its requests, since no response here allows
        that. So a request with an origin comes from a page, whatever else it has.
        """
        token_ = _bearer_token(scope)
        is_right = token_ is not None and _is_equal(token_, self.program_token)
        return is_right and not _header(scope, b"origin") and self._refusal(scope) is None

    def _refusal(self, scope: Scope, *, is_socket: bool = False) -> str | None:
        """Return why the names in a request are wrong, or None."""
        hosts, origins = _header(scope, b"host"), _header(scope, b"origin")
        if len(hosts) != 1 or not self._is_own_host(hosts[0]):
            return "this server is called otherwise"
        # The port may differ through a tunnel, but has to equal the port of the page.
        if (is_socket and not origins) or any(x != f"http://{hosts[0]}" for x in origins):
            return "this comes from a page of another server"
        return None

    def _is_own_host(self, host: str) -> bool:
        name, _, port = host.rpartition(":") if not host.endswith("]") else (host, "", "")
        if not name:
            name = host
        elif port and not port.isdecimal():
            return False
        if name.lower() in (*LOOPBACK, *self._address.names):
            return True
        # A request by IP address uses no foreign name that leads here.
        is_open = self._address.reach is not Reach.MACHINE
        return is_open and _is_address(name.removeprefix("[").removesuffix("]"))

    def _has_page_token(self, scope: Scope) -> bool:
        """Return whether a page's token is valid; this uses up a one-time token."""
        token_ = _bearer_token(scope)
        if token_ is None or scope["method"] != "GET":
            return False
        if _is_equal(token_, self.token):
            return True
        return self._one_time_tokens.pop(token_, 0.0) > time.monotonic()


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def _is_equal(first: str, second: str) -> bool:
    return secrets.compare_digest(first.encode("utf-8", "replace"), second.encode())


def _header(scope: Scope, name: bytes) -> list[str]:
    return [value.decode("latin-1") for key, value in scope["headers"] if key == name]


def _bearer_token(scope: Scope) -> str | None:
    """Return the key in a header, which a browser sends only for the page's own script."""
    token_ = [value.partition(" ") for value in _header(scope, b"authorization")]
    [(scheme, _, token)] = token_ if len(token_) == 1 else [("", "", "")]
    return token if scheme.lower() == "bearer" else None


def _subprotocol_key(scope: Scope) -> str | None:
    """Return the key among a socket's subprotocols: a page cannot give a socket headers."""
    # From the header itself, since servers parse it differently.
    names = ",".join(_header(scope, b"sec-websocket-protocol")).split(",")
    keys = [name for x in names if (name := x.strip()).startswith(KEY_PROTOCOL)]
    return keys[0].removeprefix(KEY_PROTOCOL) if len(keys) == 1 else None


def _with_headers(send: Send, scope: Scope) -> Send:
    """Return `send` with the security headers of every response."""
    [host, *_] = _header(scope, b"host") or [""]
    # Not all browsers treat a socket of the same server as the same origin.
    live = f" ws://{host}" if host.replace(".", "").replace(":", "").isalnum() else ""
    rules = {**CONTENT_POLICY, "connect-src": CONTENT_POLICY["connect-src"] + live}
    headers = [
        (b"content-security-policy", "; ".join(f"{k} {v}" for k, v in rules.items()).encode()),
        (b"x-content-type-options", b"nosniff"),
        (b"referrer-policy", b"no-referrer"),
        (b"cross-origin-opener-policy", b"same-origin"),
        (b"cross-origin-resource-policy", b"same-origin"),
    ]

    async def head(message: Any) -> None:
        if message["type"] == "http.response.start":
            own = list(message.get("headers", ()))
            cache = [] if any(key == b"cache-control" for key, _ in own) else [_NO_STORE]
            message = {**message, "headers": [*own, *headers, *cache]}
        await send(message)

    return head


_NO_STORE = (b"cache-control", b"no-store")


async def _respond(send: Send, status: int, text: str) -> None:
    body = text.encode()
    headers = [
        (b"content-type", b"text/plain; charset=utf-8"),
        (b"content-length", str(len(body)).encode()),
    ]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
