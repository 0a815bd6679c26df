"""The painter's server: carries messages and pictures between one session and its pages.

It knows nothing of light. The page is a table of files, read once at the start; pictures are raw
bytes by name and generation; all else goes over one WebSocket. `guard.py` decides which requests
are allowed.
"""

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lightpaint.errors import PaintError
from lightpaint.paint.message_frames import MAX_FRAME
from lightpaint.paint.protocol import VERSION
from lightpaint.paint.server.address import BoundSocket, listen
from lightpaint.paint.server.client import Client
from lightpaint.paint.server.guard import PROTOCOL, App, Guard
from lightpaint.paint.server.session_clients import Connections, ServedSession, picture_message
from lightpaint.paint.store.session_file import Store
from lightpaint.version import __version__
from lightpaint.viewer import BundleError, bundled, styles

if TYPE_CHECKING:
    import uvicorn
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.websockets import WebSocket


#: Bytes of a message without its pixels, and of each pixel (light and importance) in it.
MESSAGE_OVERHEAD_BYTES, BYTES_PER_PIXEL = 2**20, 16

#: Content types by suffix; other files are not part of the page.
CONTENT_TYPES = {
    ".html": "text/html;charset=utf-8",
    ".js": "text/javascript;charset=utf-8",
    ".css": "text/css;charset=utf-8",
    ".json": "application/json",
    ".svg": "image/svg+xml",
    ".png": "image/png",
    ".wasm": "application/wasm",
    ".woff2": "font/woff2",
    ".txt": "text/plain;charset=utf-8",
}

PAGE_FOLDER = Path(__file__).parents[1] / "page"

#: The viewer's modules, served as `/viewer`. Modules of the page import them by their path in the
#: package; browsers ignore the `..` beyond the root.
VIEWER_FOLDER = Path(__file__).parents[2] / "viewer"

#: The page's main module; a browser loads it with all its imports.
ENTRY_MODULE = "/main.js"

#: Its style sheet, which imports one for each part of the page.
STYLE_SHEET = "/style.css"

ICON = "/icon.svg"


def check_installed() -> None:
    """Raise PaintError, with what to do, unless the libraries of the server are here."""
    for name in ("starlette", "uvicorn", "websockets"):
        if find_spec(name) is None:
            raise PaintError(
                f"painting in the browser needs {name}: pip install 'lightpaint[paint]'"
            )


@dataclass(frozen=True)
class PageFile:
    """A file of the page, as it was at the start."""

    kind: str
    content: bytes


def page_files(folder: Path = PAGE_FOLDER) -> dict[str, PageFile]:
    """Return the files of the page by their paths; `/` is the page itself.

    Hidden files, links that lead elsewhere, and other kinds of files are left out.
    """
    root = folder.resolve()
    table = _files_below(root, "/")
    if "/index.html" in table:
        table["/"] = table["/index.html"]
    if ICON in table:
        # Some browsers request it from every page.
        table["/favicon.ico"] = table[ICON]
    if root == PAGE_FOLDER.resolve():
        table |= _files_below(VIEWER_FOLDER.resolve(), "/viewer/")
        # A browser takes ten milliseconds per file, independent of the server.
        table[ENTRY_MODULE] = PageFile(
            CONTENT_TYPES[".js"], bundled(f"paint/page{ENTRY_MODULE}").encode()
        )
        table[STYLE_SHEET] = PageFile(
            CONTENT_TYPES[".css"], styles(f"paint/page{STYLE_SHEET}").encode()
        )
    return table


def _files_below(root: Path, start: str) -> dict[str, PageFile]:
    """Return the files of a folder by their paths, which begin with `start`."""
    table = {}
    for path in sorted(root.rglob("*")):
        place = path.relative_to(root)
        is_hidden = any(part.startswith((".", "_")) for part in place.parts)
        if is_hidden or path.suffix not in CONTENT_TYPES or not path.resolve().is_relative_to(root):
            continue
        if path.is_file():
            table[f"{start}{place.as_posix()}"] = PageFile(
                CONTENT_TYPES[path.suffix], path.read_bytes()
            )
    return table


def page_app(
    connections: Connections,
    *,
    files: dict[str, PageFile] | None = None,
    is_program: Callable[[Any], bool] = lambda _: False,
) -> App:
    """Return the application behind the guard. is_program: whether a request comes from no page."""
    from starlette.applications import Starlette
    from starlette.responses import Response
    from starlette.routing import Route, WebSocketRoute

    table = page_files() if files is None else files

    async def page(request: "Request") -> "Response":
        file = table.get(request.scope["path"])
        if file is None:
            return Response("no such page", 404, media_type="text/plain")
        return Response(file.content, headers={"content-type": file.kind})

    async def data(request: "Request") -> "Response":
        if is_program(request.scope):
            await connections.wait_for_rest()
        name, generation = request.path_params["name"], request.query_params.get("g")
        return await _picture_response(connections, name, generation)

    async def live(websocket: "WebSocket") -> None:
        # A program may offer no subprotocol, and then gets none in the answer.
        await websocket.accept(PROTOCOL if PROTOCOL in websocket.scope["subprotocols"] else None)
        await connections.serve(Client(websocket, websocket.query_params.get("page", "")))

    @asynccontextmanager
    async def lifespan(_: Any) -> AsyncIterator[None]:
        connections.attach()
        yield
        await connections.close()

    routes = [
        WebSocketRoute("/live", live),
        Route("/data/{name:path}", data),
        Route("/{path:path}", page),
    ]
    return Starlette(routes=routes, lifespan=lifespan)


async def _picture_response(
    connections: Connections, name: str, generation: str | None
) -> "Response":
    """Return the pixels of a picture, which a page may keep if it asked for this generation."""
    from starlette.responses import Response

    before = connections.generations.get(name)
    try:
        picture = await picture_message(connections, name)
    except PaintError as error:
        return Response(str(error), 404, media_type="text/plain")
    [description], [content] = picture.content()["buffers"], picture.buffers()
    headers = {
        "content-type": "application/octet-stream",
        "x-dtype": description["dtype"],
        "x-shape": ",".join(map(str, description["shape"])),
    }
    after = connections.generations.get(name)
    if generation is not None and generation == str(before) == str(after):
        # Another launch has another key, and other pictures.
        caching = "private, max-age=31536000, immutable"
        headers |= {"cache-control": caching, "vary": "Authorization"}
    return Response(content, headers=headers)


class Server:
    """The server of one session.

    host, port: as in `listen`; a host other than the loopback exposes the painter. listening: the
    result of `listen`, which `close` closes. say: as in `Connections`. Raises PaintError if it
    cannot listen.

    Attributes:
        address: Where it listens.
        expects_page: Whether a browser was started with the page's address.
    """

    def __init__(
        self,
        session: ServedSession,
        store: Store | None = None,
        *,
        host: str | None = None,
        port: int | None = None,
        listening: BoundSocket | None = None,
        say: Callable[[str], None] = lambda _: None,
    ) -> None:
        check_installed()
        self._connections = Connections(session, store, say)
        self._socket, self.address = listening or listen(host, port)
        self._guard = Guard(_no_app, address=self.address)
        self._uvicorn: uvicorn.Server | None = None
        self._stop_requested = False
        self.expects_page = False

    @property
    def port(self) -> int:
        """Port that it listens on."""
        return self.address.port

    @property
    def url(self) -> str:
        """URL of the page, with the token that opens it in the fragment, which browsers send to
        nobody.
        """
        return f"{self.address.url}#token={self._guard.token}"

    @property
    def connection(self) -> dict[str, Any]:
        """Values that a program of this machine needs to connect."""
        token = self._guard.program_token
        versions = {"version": __version__, "protocol": VERSION}
        return {"address": self.address.local_url, "token": token, **versions}

    def one_time_url(self) -> str:
        """Return the URL for a browser that is started now; its token works once."""
        self.expects_page = True
        return f"{self.address.local_url}#token={self._guard.one_time_token()}"

    def follow_identity(self) -> None:
        """Accept messages as large as the views of the store, which has just learnt them."""
        if self._uvicorn is not None:
            self._uvicorn.config.ws_max_size = self._max_message_bytes

    @property
    def _max_message_bytes(self) -> int:
        """Size of the longest message that a page may send."""
        store = self._connections.store
        pixels = MAX_FRAME if store is None or store.identity is None else store.identity.max_pixels
        return min(MAX_FRAME, MESSAGE_OVERHEAD_BYTES + BYTES_PER_PIXEL * pixels)

    @property
    def has_page(self) -> bool:
        """True if a page has the session."""
        return self._connections.has_page

    def run(self) -> None:
        """Serve until Ctrl-C or a signal, which is raised again at a clean end."""
        # Connections wait at the socket during these imports.
        import uvicorn

        from lightpaint.paint.server.http_server import (
            GracefulServer,
            PageSocket,
            bounded_http_protocol,
            stop_on_hangup,
        )

        try:
            files = page_files()
        except BundleError as error:
            raise PaintError(f"the page cannot be served: {error}") from None
        self._guard.app, self._guard.public = (
            page_app(self._connections, files=files, is_program=self._guard.is_program),
            files,
        )
        config = uvicorn.Config(
            self._guard,
            http=bounded_http_protocol(self._guard.is_allowed),
            ws=PageSocket,
            ws_max_size=self._max_message_bytes,
            ws_per_message_deflate=False,
            ws_ping_interval=10.0,
            ws_ping_timeout=20.0,
            log_config=None,
            log_level="error",  # keep invalid requests of strangers off the terminal
            access_log=False,
            proxy_headers=False,
            server_header=False,
            limit_concurrency=256,
            timeout_graceful_shutdown=5,
        )
        self._uvicorn = GracefulServer(config, self._connections)
        self._uvicorn.should_exit = self._stop_requested
        with stop_on_hangup(self._uvicorn):
            self._uvicorn.run(sockets=[self._socket])

    def stop(self, farewell: str = "") -> None:
        """End `run`, from another thread. farewell: text for the pages instead of the usual one."""
        self._connections.farewell = farewell or self._connections.farewell
        self._stop_requested = True
        if self._uvicorn is not None:
            self._uvicorn.should_exit = True

    def close(self) -> None:
        """Close the listening socket."""
        self._socket.close()


async def _no_app(scope: Any, receive: Any, send: Any) -> None:
    """Handle requests before `run` has set the application: none arrives."""
