"""The page's server: pictures go out over a web socket, commands come in.

It has a thread and an event loop of its own; the simulation, and all work on the device, stays in the thread that calls
`run`.
"""

import asyncio
import concurrent.futures
import importlib.resources
import math
import mimetypes
import os
import secrets
import socket
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route, WebSocketRoute
from typing_extensions import override
from uvicorn.protocols.http.h11_impl import H11Protocol

from wavetank.foundation.errors import WavetankError
from wavetank.foundation.memory import share_arenas
from wavetank.page.about import hello_message
from wavetank.page.aim import aim
from wavetank.page.dropped import drop_mesh
from wavetank.page.fitting import fits
from wavetank.page.gate import HEADERS, Gate
from wavetank.page.loop import Loop, Report
from wavetank.page.picture import jpeg, png
from wavetank.page.theme import style_sheet
from wavetank.page.viewers import LONGEST_MESSAGE, Viewer, Viewers
from wavetank.session.pace import share_interpreter
from wavetank.session.recording import Recording
from wavetank.session.session import Session

PORT = 8420  # the first one tried by default
MOST_CONNECTIONS = 1200  # at once; more are closed
OTHER_FILES = 128  # open files that the process may need for all else
IDLE = 10.0  # s after which a connection without a request is closed
MOST_DOWNLOADS = 4  # that wait for the simulation's thread
DOWNLOAD_PAUSE = 0.3  # s between two of them


class Protocol(H11Protocol):
    """HTTP/1.1 whose every response has our headers, also those to malformed requests; few connections, none idle."""

    @override
    def connection_made(self, transport: Any) -> None:
        super().connection_made(transport)
        if len(self.connections) > connections_allowed():
            transport.abort()
        else:
            self.loop.call_later(IDLE, self._close_if_idle, transport)

    def _close_if_idle(self, transport: Any) -> None:
        if self.cycle is None and transport.get_protocol() is self:  # a web socket has another protocol
            transport.close()

    @override
    def send_400_response(self, msg: str) -> None:
        headers = "".join(f"{name}: {value}\r\n" for name, value in HEADERS.items())
        head = f"HTTP/1.1 400 Bad Request\r\ncontent-type: text/plain; charset=utf-8\r\n{headers}"
        body = "Bad request\n"
        text = f"{head}content-length: {len(body)}\r\nconnection: close\r\n\r\n{body}"
        self.transport.write(text.encode("ascii"))
        self.transport.close()


class PageServer:
    """Serves one session."""

    def __init__(
        self, session: Session, host: str = "127.0.0.1", port: int | None = None, token: str | None = None
    ) -> None:
        self.session, self.start_scene = session, session.scene
        self.viewers = Viewers(session.submit, self._ray, lambda: {**self._hello, "run": self.run_number})
        self.viewers.wake, self.viewers.in_server = session.wake, self._in_server
        self.viewers.fit, self.viewers.aim, self.viewers.drop_mesh = self._fit, self._aim, self._drop_mesh
        self.run_number = secrets.token_hex(8)  # identifies this run of the server
        self.loop = Loop(session, self)
        self.painter, self.call, self.ask = self.loop.painter, self.loop.call, self.loop.ask
        self._socket = _listen(host, port)
        self.port = self._socket.getsockname()[1]
        everywhere = host in ("0.0.0.0", "::")
        shown = socket.gethostname() if everywhere else f"[{host}]" if ":" in host and "[" not in host else host
        app = Starlette(
            routes=[
                Route("/", self._page),
                Route("/page/{file}", self._file),
                Route("/recording.toml", self._recording),
                Route("/scene.toml", self._scene),
                Route("/picture.png", self._picture),
                WebSocketRoute("/socket", self.viewers.serve),
            ]
        )
        self.gate = Gate(app, host, self.port, token)
        self.url = f"http://{shown}:{self.port}/?token={self.gate.token}"
        self._server = uvicorn.Server(
            uvicorn.Config(
                self.gate,
                log_level="error",
                access_log=False,
                lifespan="off",
                ws="websockets-sansio",
                ws_max_size=LONGEST_MESSAGE,
                ws_per_message_deflate=False,
                timeout_graceful_shutdown=1,
                http=Protocol,
                server_header=False,
                limit_concurrency=MOST_CONNECTIONS,
                backlog=64,
            )
        )
        self._events: asyncio.AbstractEventLoop | None = None
        self._thread = threading.Thread(target=self._serve, name="wavetank web", daemon=True)
        self._encoder = concurrent.futures.ThreadPoolExecutor(1, "wavetank jpeg")
        self._encoding: concurrent.futures.Future[None] | None = None
        self._one_download = asyncio.Lock()
        self._downloads, self._next_download = 0, 0.0  # in progress; time of the next one
        self._sent_world: dict[str, Any] = {}
        self._sent: Any = None  # the last status, and its viewers
        self._sent_regions: dict[str, Any] = {}
        self._hello = hello_message(session)

    # --- the simulation's thread ---

    def start(self) -> None:
        """Start to serve."""
        share_interpreter()
        share_arenas()
        self._thread.start()

    def run(self) -> None:
        """Run the session until `stop`."""
        try:
            self.loop.run()
        finally:
            self._encoder.shutdown()

    def stop(self) -> None:
        """Stop to serve and end `run`."""
        self.loop.stop()
        self._server.should_exit = True
        if self._thread.is_alive() and threading.current_thread() is not self._thread:
            self._thread.join(5.0)

    # --- for the loop, in the simulation's thread: see `loop.Audience` ---

    @property
    def has_viewers(self) -> bool:
        """Whether there are viewers."""
        return bool(self.viewers.all)

    @property
    def wants_picture(self) -> bool:
        """Whether a viewer waits for a picture, and none is being encoded."""
        return self.viewers.anyone_ready and (self._encoding is None or self._encoding.done())

    @property
    def has_new_viewer(self) -> bool:
        """Whether a viewer has just connected."""
        return any(viewer.is_new for viewer in self.viewers.all)

    @property
    def size(self) -> tuple[int, int] | None:
        """Width and height of the picture on the driver's screen [px]."""
        driver = self.viewers.driver
        return driver.size if driver is not None else None

    @property
    def detail(self) -> str:
        """Resolution of pictures."""
        return self.viewers.detail

    def show(self, image: np.ndarray, regions: list[dict[str, Any]]) -> None:
        """Send a picture to all viewers, and the regions where they have changed."""
        outlines = {"type": "regions", "regions": regions}
        if self.has_new_viewer or outlines != self._sent_regions:
            self._sent_regions = outlines
            self._in_server(lambda: self.viewers.broadcast(outlines))
        for viewer in self.viewers.all:
            viewer.is_new = False
        self._encoding = self._encoder.submit(self._encode, image)

    def _encode(self, image: np.ndarray) -> None:
        picture = jpeg(image)
        self._in_server(lambda: self.viewers.show(picture))
        self.session.wake()

    def send_report(self, report: Report, notes: list[str]) -> None:
        """Send the status to all viewers, where anything has changed."""
        status = {
            "type": "status",
            **report.status,
            "notes": notes,
            **report.figures,
            "game": report.game,
            "scores": report.scores,
        }
        if report.world != self._sent_world:
            self._sent_world = report.world
            self._hello = {**self._hello, **report.world}
            status["world"] = report.world
        # JSON has no NaN, such as the time of a frame before the first one.
        plain = {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in status.items()}
        message = (plain, [*self.viewers.all])
        if message != self._sent:  # nothing to send while nothing changes
            self._sent = message
            self._in_server(lambda: self.viewers.broadcast(plain))

    def send_progress(self, kernel: int) -> None:
        """Send all viewers the number of the kernel that is being compiled."""
        self._in_server(lambda: self.viewers.broadcast({"type": "compiling", "number": kernel}))

    # --- the server's thread ---

    def _serve(self) -> None:
        async def main() -> None:
            self._events = asyncio.get_running_loop()
            await self._server.serve(sockets=[self._socket])

        asyncio.run(main())

    def _in_server(self, act: Callable[[], None]) -> None:
        events = self._events
        if events is not None and not events.is_closed():
            events.call_soon_threadsafe(act)

    def _ray(self, u: float, v: float, tool: str) -> dict[str, Any]:
        width, height = self.painter.wanted
        origin, direction = self.session.camera_for(tool).ray(u * width, v * height, width, height)
        return {"origin": tuple(map(float, origin)), "direction": tuple(map(float, direction))}

    def _answer(self, viewer: Viewer, what: str, job: Callable[[], dict[str, Any]]) -> None:
        """Send one viewer the result of a call in the simulation's thread; an error becomes a note."""

        def done() -> dict[str, Any]:
            try:
                return job()
            except WavetankError as error:
                return {"type": "note", "text": str(error)[:400]}

        def tell(answer: concurrent.futures.Future[Any]) -> None:
            if not answer.cancelled() and answer.exception() is None:
                self._in_server(lambda: viewer.post(answer.result()))

        self.ask((viewer, what), done).add_done_callback(tell)

    def _fit(self, viewer: Viewer) -> None:
        self._answer(viewer, "fit", lambda: fits(self.session))

    def _aim(self, viewer: Viewer, tool: str, u: float, v: float, reach: float) -> None:
        size = self.painter.wanted
        self._answer(viewer, "aim", lambda: {"type": "aim", **aim(self.session, tool, u, v, reach, size)})

    def _drop_mesh(self, viewer: Viewer, text: str, file: str) -> None:
        def job() -> dict[str, Any]:
            return {"type": "note", "text": drop_mesh(self.session, text, file)}

        self._answer(viewer, f"mesh {file}", job)

    async def _page(self, request: Request) -> Response:
        return _packaged("index.html")

    async def _file(self, request: Request) -> Response:
        name = request.path_params["file"]
        if name == "run":
            return Response(self.run_number, media_type="text/plain")
        return Response(style_sheet(), media_type="text/css") if name == "theme.css" else _packaged(name)

    async def _recording(self, request: Request) -> Response:
        return await self._download("session.toml", lambda: Recording.of(self.session, self.start_scene).text())

    async def _scene(self, request: Request) -> Response:
        return await self._download("scene.toml", lambda: self.session.current_scene().text())

    async def _picture(self, request: Request) -> Response:
        def made() -> bytes:
            return png(self.painter.paint(sharp=True))

        return await self._download("wavetank.png", made, "image/png")

    async def _download(self, name: str, make: Callable[[], str | bytes], kind: str = "application/toml") -> Response:
        """Return a file that the simulation's thread makes; few at once, as they delay the water."""
        if self._downloads >= MOST_DOWNLOADS:
            return Response(
                "too many downloads at once; try again\n",
                status_code=429,
                media_type="text/plain",
                headers={"retry-after": "1"},
            )

        def made() -> str | bytes:
            try:
                return make()
            except WavetankError as error:
                self.session.note(str(error))
                raise

        headers = {"content-disposition": f"attachment; filename={name}"}
        self._downloads += 1
        try:
            async with self._one_download:
                await asyncio.sleep(max(0.0, self._next_download - time.monotonic()))
                text = await asyncio.wrap_future(self.ask("download", made))
                self._next_download = time.monotonic() + DOWNLOAD_PAUSE
            return Response(text, media_type=kind, headers=headers)
        except WavetankError as error:
            return Response(f"{error}\n", status_code=409, media_type="text/plain")
        finally:
            self._downloads -= 1


def connections_allowed() -> int:
    """Return how many connections may be open: fewer where the system allows this process few files."""
    try:
        import resource
    except ImportError:  # Windows
        return MOST_CONNECTIONS
    files = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
    return MOST_CONNECTIONS if files < 0 else max(1, min(MOST_CONNECTIONS, files - OTHER_FILES))


def _packaged(name: str) -> Response:
    """Return a file of `static`, by its exact name only."""
    folder = importlib.resources.files("wavetank.page") / "static"
    if name not in {entry.name for entry in folder.iterdir() if entry.is_file()}:
        return Response("not found\n", status_code=404, media_type="text/plain")
    kind = {"js": "text/javascript", "svg": "image/svg+xml"}.get(name.rpartition(".")[2])
    return Response(
        (folder / name).read_bytes(), media_type=kind or mimetypes.guess_type(name)[0] or "application/octet-stream"
    )


def _listen(host: str, port: int | None) -> socket.socket:
    """Listen on `port`, by default the first free one from `PORT` on; raises `WavetankError` where that fails."""
    ports = [port] if port is not None else [*range(PORT, PORT + 20), 0]
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    for number in ports:
        listener = socket.socket(family, socket.SOCK_STREAM)
        if os.name == "posix":  # else a port stays refused for a minute after a run
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listener.bind((host, number))
            listener.listen(64)
            return listener
        except (OSError, OverflowError) as error:
            listener.close()
            if number == ports[-1]:
                raise WavetankError(
                    f"--port {number} on --host {host} cannot be opened: {error}; "
                    "try --port 0 for any free one, and --host 127.0.0.1."
                ) from None
    raise AssertionError
