"""The painter's server: carries messages and pictures between one session and its pages.

It knows nothing of light. The page is a table of files; pictures are raw bytes by name and
generation; all else goes over one WebSocket. `guard.py` says who may ask.
"""

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from lightpaint.errors import PaintError
from lightpaint.paint.frames import MAX_FRAME
from lightpaint.paint.protocol import VERSION
from lightpaint.paint.server.address import Listening, listen
from lightpaint.paint.server.client import Client
from lightpaint.paint.server.guard import PROTOCOL, App, Guard
from lightpaint.paint.server.page_files import PageFile, page_files
from lightpaint.paint.server.session_clients import Line, Painted, pictured
from lightpaint.paint.store.store import Store
from lightpaint.version import __version__

if TYPE_CHECKING:
    import uvicorn
    from starlette.requests import Request
    from starlette.responses import Response
    from starlette.websockets import WebSocket

#: Bytes of a message beside its pixels, and of each pixel (light and importance) that it may bring.
BESIDE, OF_PIXEL = 2**20, 16


def check_installed() -> None:
    """Raise PaintError, with what to do, unless the libraries of the server are here."""
    for name in ("starlette", "uvicorn", "websockets"):
        if find_spec(name) is None:
            raise PaintError(
                f"painting in the browser needs {name}: pip install 'lightpaint[paint]'"
            )


def page_app(
    line: Line,
    *,
    files: dict[str, PageFile] | None = None,
    is_program: Callable[[Any], bool] = lambda _: False,
) -> App:
    """What is answered to those who may ask. is_program: whether a request is of no page."""
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
        name, asked = request.path_params["name"], request.query_params.get("g")
        if is_program(request.scope):
            await line.at_rest()
        before = line.generations.get(name)
        try:
            picture = await pictured(line, name)
        except PaintError as error:
            return Response(str(error), 404, media_type="text/plain")
        [about], [content] = picture.content()["buffers"], picture.buffers()
        headers = {
            "content-type": "application/octet-stream",
            "x-dtype": about["dtype"],
            "x-shape": ",".join(map(str, about["shape"])),
        }
        if asked is not None and asked == str(before) == str(line.generations.get(name)):
            # Another launch has another key, and other pictures.
            kept = "private, max-age=31536000, immutable"
            headers |= {"cache-control": kept, "vary": "Authorization"}
        return Response(content, headers=headers)

    async def live(websocket: "WebSocket") -> None:
        # A program may have offered none, and is not answered with what it did not offer.
        await websocket.accept(PROTOCOL if PROTOCOL in websocket.scope["subprotocols"] else None)
        await line.serve(Client(websocket, websocket.query_params.get("page", "")))

    @asynccontextmanager
    async def lifespan(_: Any) -> AsyncIterator[None]:
        line.begin()
        yield
        await line.end()

    routes = [
        WebSocketRoute("/live", live),
        Route("/data/{name:path}", data),
        Route("/{path:path}", page),
    ]
    return Starlette(routes=routes, lifespan=lifespan)


class Server:
    """One session, served.

    host, port: as of `listen`; a host other than the loopback is for those who know why. listening:
    what `listen` has returned, which `close` closes. say: as of `Line`. Raises PaintError where it
    cannot listen.

    Attributes:
        address: Where it listens.
        is_expected: Whether a browser has been told where the page is.
    """

    def __init__(
        self,
        session: Painted,
        store: Store | None = None,
        *,
        host: str | None = None,
        port: int | None = None,
        listening: Listening | None = None,
        say: Callable[[str], None] = lambda _: None,
    ) -> None:
        check_installed()
        self._line = Line(session, store, say)
        self._socket, self.address = listening or listen(host, port)
        self._guard = Guard(_nothing_yet, address=self.address)
        self._serving: uvicorn.Server | None = None
        self._is_to_stop = False
        self.is_expected = False

    @property
    def port(self) -> int:
        """Where it listens."""
        return self.address.port

    @property
    def url(self) -> str:
        """Where the page is, with the token that opens it: in the fragment, which stays there."""
        return f"{self.address.url}#token={self._guard.token}"

    @property
    def connection(self) -> dict[str, Any]:
        """What a program of this machine has to know to connect."""
        token = self._guard.program_token
        about = {"version": __version__, "protocol": VERSION}
        return {"address": self.address.url_here, "token": token, **about}

    def url_once(self) -> str:
        """Return the same for a browser that is started now: good once."""
        self.is_expected = True
        return f"{self.address.url_here}#token={self._guard.once()}"

    def keeps(self, store: Store) -> None:
        """What is done is kept there, from now on; of a session that was opened later."""
        self._line.store = store
        if self._serving is not None:
            self._serving.config.ws_max_size = self._largest

    @property
    def _largest(self) -> int:
        """Bytes of the longest message that a page may send."""
        store = self._line.store
        pixels = MAX_FRAME if store is None or store.identity is None else store.identity.largest
        return min(MAX_FRAME, BESIDE + OF_PIXEL * pixels)

    @property
    def has_page(self) -> bool:
        """Whether a page is there to hear what is said."""
        return self._line.has_page

    def run(self) -> None:
        """Serve until Ctrl-C or the like, which is raised again when all has ended well."""
        # Whoever comes meanwhile waits at the socket.
        import uvicorn

        from lightpaint.paint.server.http_connections import bounded_http
        from lightpaint.paint.server.shutdown import EndingServer, PageSocket, hanging_up

        files = page_files()
        self._guard.app, self._guard.public = (
            page_app(self._line, files=files, is_program=self._guard.is_program),
            files,
        )
        config = uvicorn.Config(
            self._guard,
            http=bounded_http(self._guard.knows),
            ws=PageSocket,
            ws_max_size=self._largest,
            ws_per_message_deflate=False,
            ws_ping_interval=10.0,
            ws_ping_timeout=20.0,
            log_config=None,
            log_level="error",  # junk of strangers is no news for the terminal
            access_log=False,
            proxy_headers=False,
            server_header=False,
            limit_concurrency=256,
            timeout_graceful_shutdown=5,
        )
        self._serving = EndingServer(config, self._line)
        self._serving.should_exit = self._is_to_stop
        with hanging_up(self._serving):
            self._serving.run(sockets=[self._socket])

    def stop(self, why: str = "") -> None:
        """Let `run` end, from another thread. why: what pages are told, if not the usual."""
        self._line.farewell = why or self._line.farewell
        self._is_to_stop = True
        if self._serving is not None:
            self._serving.should_exit = True

    def close(self) -> None:
        """Listen no more."""
        self._socket.close()


async def _nothing_yet(scope: Any, receive: Any, send: Any) -> None:
    """What is behind the guard before anybody serves."""
