"""How a test comes by the key of a painter's server, as a page does, and shows it."""

import urllib.request
from urllib.parse import urldefrag

from lightpaint.paint.server.guard import KEY_PROTOCOL, PROTOCOL


def bearer(key: str) -> dict[str, str]:
    """The header that a page shows a key or token in."""
    return {"Authorization": f"Bearer {key}"}


def offered(key: str) -> list[str]:
    """The protocols that a page's socket shows a key in."""
    return [PROTOCOL, f"{KEY_PROTOCOL}{key}"]


def key_of(url: str) -> str:
    """What a page that was opened by the address of a terminal exchanges its token for."""
    base, fragment = urldefrag(url)
    asking = urllib.request.Request(f"{base}key", headers=bearer(fragment.removeprefix("token=")))
    with urllib.request.urlopen(asking) as answer:
        return str(answer.read().decode())
