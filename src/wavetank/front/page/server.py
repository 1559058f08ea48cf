"""A page in a browser: pictures go out over a socket, commands come in.

The server has a thread and an event loop of its own; the simulation, and with it everything on the device, stays in
the thread that calls `run`.
"""

import asyncio
import concurrent.futures
import importlib.resources
import math
import mimetypes
import socket
import threading
import time
from collections.abc import Callable
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Route, WebSocketRoute

from wavetank.foundation.errors import WavetankError
from wavetank.front.about import everything, figures, status, world
from wavetank.front.hud import Hud
from wavetank.front.jobs import Jobs
from wavetank.front.page.gate import Gate
from wavetank.front.page.viewers import Viewers
from wavetank.front.picture import Painter, jpeg
from wavetank.session.pace import share_interpreter
from wavetank.session.recording import Recording
from wavetank.session.session import Session

PORT = 8420  # the first one tried where none is asked for
LONGEST_MESSAGE = 2_500_000  # bytes: a dropped scene file
STATUS_EVERY, FIGURES_EVERY = 0.1, 2.0  # s
CALM = 0.25  # s without a change after which a sharp picture is worth it


class WebFront:
    """Serves one session."""

    def __init__(self, session: Session, host: str = "127.0.0.1", port: int | None = None) -> None:
        self.session, self.start_scene = session, session.scene
        session.smooth = True
        self.painter = Painter(session)
        self.hud = Hud(session)
        self.viewers = Viewers(session.submit, self._ray, lambda: self._hello)
        self.viewers.wake = session.wake
        self._socket = _listen(host, port)
        self.port = self._socket.getsockname()[1]
        everywhere = host in ("0.0.0.0", "::")
        shown = socket.gethostname() if everywhere else f"[{host}]" if ":" in host and "[" not in host else host
        app = Starlette(routes=[
            Route("/", self._page), Route("/page/{file}", self._file), Route("/recording.toml", self._recording),
            Route("/scene.toml", self._scene),
            WebSocketRoute("/socket", self.viewers.serve),
        ])  # fmt: skip
        self.gate = Gate(app, host, self.port)
        self.url = f"http://{shown}:{self.port}/?token={self.gate.token}"
        self._server = uvicorn.Server(uvicorn.Config(
            self.gate, log_level="error", access_log=False, lifespan="off", ws="websockets-sansio",
            ws_max_size=LONGEST_MESSAGE, ws_per_message_deflate=False, timeout_graceful_shutdown=1,
        ))  # fmt: skip
        self._loop: asyncio.AbstractEventLoop | None = None
        self._thread = threading.Thread(target=self._serve, name="wavetank web", daemon=True)
        self._packer = concurrent.futures.ThreadPoolExecutor(1, "wavetank jpeg")
        self._jobs = Jobs(session.wake)
        self.ask = self._jobs.ask  # have something done between two frames
        self._stopped = threading.Event()
        self._told: dict[str, Any] = {}
        self._heard: Any = None  # the last status, and who was there
        self._outlined: dict[str, Any] = {}
        self._figures: dict[str, float] = {}
        self._measured = (-1, 0)  # frames and particles when that was
        self._next_status = self._next_figures = 0.0
        self._shown, self._shown_at, self._sharp = -1, 0.0, False
        self._packing: concurrent.futures.Future[None] | None = None
        self._hello = everything(session)

    # --- the simulation's thread ---

    def start(self) -> None:
        """Open the doors."""
        share_interpreter()
        self._thread.start()

    def run(self) -> None:
        """Let the water move until `stop`."""
        try:
            while not self._stopped.is_set():
                self.turn()
                self.session.rest(0.05, asleep=not self.viewers.all)
        finally:
            self._packer.shutdown()

    def turn(self) -> None:
        """Do what is due: jobs, commands, a frame, a picture, a status."""
        for error in self._jobs.do_all():
            if isinstance(error, WavetankError):
                self.session.note(str(error))
        driver = self.viewers.driver
        self.painter.detail = self.viewers.detail
        if driver is not None and driver.size != self.painter.asked:
            self.painter.want(*driver.size)
        if self.viewers.all:
            self.session.turn()
        else:  # time stands still while nobody is there: who opens the page sees the beginning
            self.session.drain()
            self.session.pace.stop()
        now = time.perf_counter()
        self._show(now)
        if now >= self._next_status and self.viewers.all:
            self._next_status = now + STATUS_EVERY
            self._tell(now)

    def stop(self) -> None:
        """Close the doors and end `run`."""
        self._stopped.set()
        self.session.wake()
        self._server.should_exit = True
        if self._thread.is_alive() and threading.current_thread() is not self._thread:
            self._thread.join(5.0)

    def _show(self, now: float) -> None:
        """Send a picture where something has changed and someone waits for it."""
        if not self.viewers.anyone_ready or (self._packing is not None and not self._packing.done()):
            return
        changed = self.session.changes != self._shown
        calm = not changed and not self._sharp and self.painter.is_reduced and now - self._shown_at > CALM
        new = any(viewer.is_new for viewer in self.viewers.all)
        if not (new or ((changed or calm) and self.painter.is_due(now))):
            return
        self._shown, self._shown_at, self._sharp = self.session.changes, now, calm
        for viewer in self.viewers.all:
            viewer.is_new = False
        image = self.painter.paint(sharp=calm)
        outlines = {"type": "regions", "regions": self.hud.regions(self.painter.wanted)}
        if new or outlines != self._outlined:
            self._outlined = outlines
            self._call(lambda: self.viewers.broadcast(outlines))
        self._packing = self._packer.submit(self._pack, image)

    def _pack(self, image: Any) -> None:
        picture = jpeg(image)
        self._call(lambda: self.viewers.show(picture))
        self.session.wake()

    def _tell(self, now: float) -> None:
        session = self.session
        if now >= self._next_figures and self._measured != (session.ticks, session.sim.count):
            self._next_figures, self._measured = now + FIGURES_EVERY, (session.ticks, session.sim.count)
            self._figures = figures(session)
        # The game first: a score that cannot be kept is one more note.
        game = self.hud.status()
        notes, session.notes = session.notes, []
        told_now = {
            "type": "status", **status(session, self.painter), "notes": notes, **self._figures, "game": game,
            "scores": self.hud.scores,
        }  # fmt: skip
        about = world(session)
        if about != self._told:
            self._told = about
            self._hello = {**self._hello, **about}
            told_now["world"] = about
        # JSON has no word for what is no number, such as the time of a frame before there was one.
        told = {k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in told_now.items()}
        heard = (told, [*self.viewers.all])
        if heard != self._heard:  # what stands still says nothing
            self._heard = heard
            self._call(lambda: self.viewers.broadcast(told))

    # --- the server's thread ---

    def _serve(self) -> None:
        async def main() -> None:
            self._loop = asyncio.get_running_loop()
            await self._server.serve(sockets=[self._socket])

        asyncio.run(main())

    def _call(self, act: Callable[[], None]) -> None:
        loop = self._loop
        if loop is not None and not loop.is_closed():
            loop.call_soon_threadsafe(act)

    def _ray(self, u: float, v: float) -> dict[str, Any]:
        width, height = self.painter.wanted
        origin, direction = self.session.camera.ray(u * width, v * height, width, height)
        return {"origin": tuple(map(float, origin)), "direction": tuple(map(float, direction))}

    async def _page(self, request: Request) -> Response:
        return _packaged("index.html")

    async def _file(self, request: Request) -> Response:
        return _packaged(request.path_params["file"])

    async def _recording(self, request: Request) -> Response:
        return await self._download("session.toml", lambda: Recording.of(self.session, self.start_scene).text())

    async def _scene(self, request: Request) -> Response:
        return await self._download("scene.toml", lambda: self.session.present_scene().text())

    async def _download(self, name: str, make: Callable[[], str]) -> Response:
        """Return a text that the simulation's thread makes, as a file."""
        future = self.ask(make)
        headers = {"content-disposition": f"attachment; filename={name}"}
        try:
            return Response(await asyncio.wrap_future(future), media_type="application/toml", headers=headers)
        except WavetankError as error:
            return Response(f"{error}\n", status_code=409, media_type="text/plain")


def _packaged(name: str) -> Response:
    """Return a file of the page; only those that are there by name."""
    folder = importlib.resources.files("wavetank.front.page") / "static"
    if name not in {entry.name for entry in folder.iterdir() if entry.is_file()}:
        return Response("not here\n", status_code=404, media_type="text/plain")
    kind = {"js": "text/javascript", "svg": "image/svg+xml"}.get(name.rpartition(".")[2])
    return Response(
        (folder / name).read_bytes(), media_type=kind or mimetypes.guess_type(name)[0] or "application/octet-stream"
    )


def _listen(host: str, port: int | None) -> socket.socket:
    """Open the first free port from `PORT` on, or the one asked for; raises `WavetankError` where it cannot be had."""
    ports = [port] if port is not None else [*range(PORT, PORT + 20), 0]
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    for number in ports:
        listener = socket.socket(family, socket.SOCK_STREAM)
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
