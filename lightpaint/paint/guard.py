"""Who may speak to the painter's server: a page that came from this launch, and nobody else.

Any page that is open in a browser can send requests to servers of the same machine, by whatever
name it likes. So the name that a request calls this server by is looked at (a foreign name that
leads here is an attack), what page it comes from, and a cookie that only this launch gives, to
those who know its token.

The token is exchanged by a page that loads the next by itself, and not by a redirect: the cookie is
SameSite=Strict, and would not come along where a link on another page had led here.
"""

import ipaddress
import secrets
import socket
import time
from collections.abc import Callable
from typing import Any
from urllib.parse import parse_qs

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

#: Names of the machine itself.
LOOPBACK = ("127.0.0.1", "localhost", "[::1]")

#: Seconds in which a browser has to use the token that it was started with. Others who work on the
#: machine can read that, as they can all command lines; it is good once.
SOON_S = 120.0

#: Said to who has no cookie, and to who has that of an earlier server.
UNKNOWN = "open the painter by the address that its terminal shows, which has a token"
EARLIER = f"this page is of an earlier start of the painter: {UNKNOWN}"

_AGAIN = b"""<!doctype html><html lang="en"><meta charset="utf-8"><title>lightpaint</title>
<meta http-equiv="refresh" content="0; url=/"><p><a href="/">Open the painter</a></p></html>"""

Scope = dict[str, Any]
Receive = Callable[[], Any]
Send = Callable[[Any], Any]
App = Callable[[Scope, Receive, Send], Any]


class Guard:
    """Lets through to `app` what comes from a page of this launch, and answers all else itself.

    port: by which the cookie is named, since browsers tell no ports apart. host: that was asked
    for, if another than the loopback; then the machine's own names and addresses are right, too.
    """

    def __init__(self, app: App, *, port: int, host: str | None = None) -> None:
        self.app, self.port, self.is_open = app, port, host is not None
        self.token, self._secret = secrets.token_urlsafe(24), secrets.token_urlsafe(24)
        self.cookie = f"lightpaint_{port}"
        self._names = {*LOOPBACK, *(() if host is None else _names_of(host))}
        self._once: dict[str, float] = {}

    def once(self) -> str:
        """A token that is good once, and soon."""
        token = secrets.token_urlsafe(24)
        self._once[token] = time.monotonic() + SOON_S
        return token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
        elif scope["type"] == "websocket":
            if self._refusal(scope, is_socket=True) is None and self._is_known(scope):
                await self.app(scope, receive, send)
            else:  # which a browser gets as 403
                await send({"type": "websocket.close", "code": 1008})
        elif (reason := self._refusal(scope)) is not None:
            await _answer(_headed(send, scope), 403, reason)
        elif scope["method"] not in ("GET", "HEAD"):
            await _answer(_headed(send, scope), 405, "only GET is answered here")
        elif scope["path"] == "/" and self._has_token(scope):
            said = f"{self.cookie}={self._secret}; HttpOnly; SameSite=Strict; Path=/"
            more = [(b"set-cookie", said.encode()), (b"content-type", b"text/html; charset=utf-8")]
            await _answer(_headed(send, scope), 200, _AGAIN, more)
        elif not self._is_known(scope):
            # Where somebody was known by an earlier start of it, that is what there is to say.
            status, reason = (410, EARLIER) if self._secrets(scope) else (403, UNKNOWN)
            await _answer(_headed(send, scope), status, reason)
        else:
            await self.app(scope, receive, _headed(send, scope))

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
        if name.lower() in self._names:
            return True
        # Whoever uses an address has been told of no foreign name that leads here.
        return self.is_open and _is_address(name.removeprefix("[").removesuffix("]"))

    def _is_known(self, scope: Scope) -> bool:
        return any(_same(secret, self._secret) for secret in self._secrets(scope))

    def _secrets(self, scope: Scope) -> list[str]:
        """What somebody has been given at this port, by this server or an earlier one."""
        # Other servers of the machine have theirs here, too, which need not be well formed.
        pieces = [piece for said in _header(scope, b"cookie") for piece in said.split(";")]
        named = [piece.strip().partition("=") for piece in pieces]
        return [value for name, _, value in named if name == self.cookie]

    def _has_token(self, scope: Scope) -> bool:
        try:
            given = parse_qs(scope["query_string"].decode("ascii"), max_num_fields=8)
        except ValueError:
            return False
        [token, *_] = given.get("token", [""])
        if _same(token, self.token):
            return True
        return self._once.pop(token, 0.0) > time.monotonic()


def _names_of(host: str) -> set[str]:
    shown = f"[{host}]" if ":" in host else host
    return {shown.lower(), socket.gethostname().lower(), socket.getfqdn().lower()}


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


async def _answer(
    send: Send, status: int, said: str | bytes, headers: list[tuple[bytes, bytes]] | None = None
) -> None:
    body = said.encode() if isinstance(said, str) else said
    headers = headers or [(b"content-type", b"text/plain; charset=utf-8")]
    length = (b"content-length", str(len(body)).encode())
    await send({"type": "http.response.start", "status": status, "headers": [*headers, length]})
    await send({"type": "http.response.body", "body": body})
